!> Transfers between points and nodes, a block of points at a time.
!>
!> Node data are interleaved so that one node is one or two vectors:
!>   total(1:8)   mass, momentum x, momentum y, mass, then the force in two parts, fx + fx',
!>                fy + fy': fx, fy, fx', fy'                           (sums over points)
!>   motion(1:8)  two velocities, whose meaning the time scheme chooses, the second three times:
!>                a, a, b, b, b, b, b, b (x and y in turn)             (read by the points)
!>
!> map_momentum:   m_i += S m_p;  p_i += S m_p v_p                 (Eqs. 3, 4 of Ma et al. 2022)
!> map_gradient:   p_i += S m_p L_p (x_i - x_p)                    (TPIC, Nakamura et al. 2023)
!> map_force:      f_i -= V_p sigma_p grad S                       (Eq. 5)
!> gather:         a_p = sum S motion_i;  L_p = sum motion_i(3:4) (x) grad S
!>
!> With the force in two parts and the second velocity thrice, every lane of total and of motion is
!> one product (a function of x) (a function of y) (what is mapped or gathered): S S for lanes 1 to
!> 4, S' S for 5 and 6, S S' for 7 and 8. A processor with vectors of eight numbers does a node in
!> one multiplication and addition (the wide forms, where VECTOR_BYTES allows); with shorter ones
!> momentum and force are mapped one after the other, four lanes each.
!>
!> Nodes are counted along rows: node (i, j) is i + j (nx + 1). What a point brings to the nodes is
!> laid out for the whole block first: vectors put together from numbers just computed would stall
!> the loads behind them.
module sg_transfer
  use sg_kinds, only: dp, wp
  use sg_vectors, only: VECTOR_BYTES
  use sg_weighting, only: axis_t, BLOCK, weights_t
  implicit none
  private

  public :: map_momentum, map_gradient, map_force, map_momentum_and_force, map_body_force, &
    gather_motion, gather_motion_and_gradient

  !> Eight lanes are one vector.
  logical, parameter :: IS_WIDE = 8*storage_size(1.0_wp) <= 8*VECTOR_BYTES
  !> Lanes that go with the slope along x and along y: above 0.
  real(wp), parameter :: WITH_GX(8) = real([0, 0, 0, 0, 1, 1, 0, 0], wp)
  real(wp), parameter :: WITH_GY(8) = real([0, 0, 0, 0, 0, 0, 1, 1], wp)

contains

  !> Adds mass and momentum of `n` points to the nodes.
  pure subroutine map_momentum(n, w, mass, vx, vy, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> Of one point, kg/m; [n], m/s.
    real(wp), intent(in) :: mass, vx(n), vy(n)
    !> Last node of `total`.
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: brought(4, BLOCK), along_row(4), s
    integer :: p, i, j, k, node

    call pack_momentum(n, mass, vx, vy, brought)
    do p = 1, n
      do j = 1, 3
        node = w%row(p, j) - 1
        s = w%sy(p, j)
        !$omp simd simdlen(4)
        do k = 1, 4
          along_row(k) = s*brought(k, p)
        end do
        do i = 1, 3
          s = w%sx(p, i)
          !$omp simd simdlen(4)
          do k = 1, 4
            total(k, node + i) = total(k, node + i) + s*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine map_momentum

  !> Adds to the momentum of the nodes what the velocities about `n` points differ from those at
  !> them, L (x_i - x_p); no momentum in sum, since the weights reproduce linear functions. Adds
  !> the kinetic energy of these differences, sum m S |L (x_i - x_p)|^2/2, to `energy` (J/m).
  pure subroutine map_gradient(n, w, mass, x, y, gradient, x_axis, y_axis, last, total, energy)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> [n], kg/m; [n], m; [4, n], 1/s, in the order of gather_motion_and_gradient.
    real(wp), intent(in) :: mass(n), x(n), y(n), gradient(4, n)
    type(axis_t), intent(in) :: x_axis, y_axis
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)
    real(dp), intent(inout) :: energy
    real(wp) :: dx(BLOCK, 3), dy(BLOCK, 3), at_point(2), along_x(2), twice
    integer :: p, i, j, node

    call find_distances(n, x, w%i, x_axis, dx)
    call find_distances(n, y, w%j, y_axis, dy)
    ! Mixed terms vanish: sum S (x_i - x_p) = 0.
    twice = 0.0_wp
    !$omp simd reduction(+:twice)
    do p = 1, n
      twice = twice + mass(p)/mass(1)*((gradient(1, p)**2 + gradient(2, p)**2) &
        *(w%sx(p, 1)*dx(p, 1)**2 + w%sx(p, 2)*dx(p, 2)**2 + w%sx(p, 3)*dx(p, 3)**2) &
        + (gradient(3, p)**2 + gradient(4, p)**2)*(w%sy(p, 1)*dy(p, 1)**2 &
        + w%sy(p, 2)*dy(p, 2)**2 + w%sy(p, 3)*dy(p, 3)**2))
    end do
    energy = energy + 0.5_wp*mass(1)*twice
    do p = 1, n
      do j = 1, 3
        node = w%row(p, j) - 1
        at_point = w%sy(p, j)*mass(p)*dy(p, j)*gradient(3:4, p)
        along_x = w%sy(p, j)*mass(p)*gradient(1:2, p)
        do i = 1, 3
          total(2:3, node + i) = total(2:3, node + i) + w%sx(p, i)*(at_point + dx(p, i)*along_x)
        end do
      end do
    end do
  end subroutine map_gradient

  !> Distances from points to the three nodes of their stencils from `base` on, along one axis, m.
  pure subroutine find_distances(n, x, base, axis, distance)
    integer, intent(in) :: n, base(BLOCK)
    real(wp), intent(in) :: x(n)
    type(axis_t), intent(in) :: axis
    real(wp), intent(inout) :: distance(BLOCK, 3)
    real(wp) :: cell
    integer :: p

    cell = 1.0_wp/axis%inverse_cell
    !$omp simd
    do p = 1, n
      distance(p, 1) = axis%origin + base(p)*cell - x(p)
      distance(p, 2) = distance(p, 1) + cell
      distance(p, 3) = distance(p, 2) + cell
    end do
  end subroutine find_distances

  !> Adds the internal force of `n` points to the nodes.
  pure subroutine map_force(n, w, volume, sxx, syy, sxy, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> [n], m^2 and Pa.
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: brought(4, BLOCK), along_row(4), along_column(4, 3), s, g
    integer :: p, i, j, k, node

    call pack_force(n, volume, sxx, syy, sxy, brought)
    do p = 1, n
      do i = 1, 3
        s = w%sx(p, i)
        g = w%gx(p, i)
        along_column(:, i) = [g, g, s, s]
      end do
      do j = 1, 3
        node = w%row(p, j) - 1
        s = w%sy(p, j)
        g = w%gy(p, j)
        along_row = [s, s, g, g]
        !$omp simd simdlen(4)
        do k = 1, 4
          along_row(k) = along_row(k)*brought(k, p)
        end do
        do i = 1, 3
          !$omp simd simdlen(4)
          do k = 1, 4
            total(4 + k, node + i) = total(4 + k, node + i) + along_column(k, i)*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine map_force

  !> map_momentum and map_force.
  pure subroutine map_momentum_and_force(n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass, vx(n), vy(n), volume(n), sxx(n), syy(n), sxy(n)
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: momentum(4, BLOCK), force(4, BLOCK), brought(8, BLOCK)

    if (IS_WIDE) then
      call pack_momentum(n, mass, vx, vy, momentum)
      call pack_force(n, volume, sxx, syy, sxy, force)
      brought(1:4, :n) = momentum(:, :n)
      brought(5:8, :n) = force(:, :n)
      call map_wide(n, w, brought, last, total)
    else
      call map_momentum(n, w, mass, vx, vy, last, total)
      call map_force(n, w, volume, sxx, syy, sxy, last, total)
    end if
  end subroutine map_momentum_and_force

  !> Adds what the points bring to all eight lanes of the nodes.
  pure subroutine map_wide(n, w, brought, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: brought(8, BLOCK)
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: along_row(8), along_column(8, 3), s, g
    integer :: p, i, j, k, node

    do p = 1, n
      do i = 1, 3
        s = w%sx(p, i)
        g = w%gx(p, i)
        !$omp simd simdlen(8)
        do k = 1, 8
          along_column(k, i) = merge(g, s, WITH_GX(k) > 0.0_wp)
        end do
      end do
      do j = 1, 3
        node = w%row(p, j) - 1
        s = w%sy(p, j)
        g = w%gy(p, j)
        !$omp simd simdlen(8)
        do k = 1, 8
          along_row(k) = merge(g, s, WITH_GY(k) > 0.0_wp)*brought(k, p)
        end do
        do i = 1, 3
          !$omp simd simdlen(8)
          do k = 1, 8
            total(k, node + i) = total(k, node + i) + along_column(k, i)*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine map_wide

  !> f_i += S m_p b_p for forces per mass `bx`, `by` in m/s^2.
  pure subroutine map_body_force(n, w, mass, bx, by, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass, bx(BLOCK), by(BLOCK)
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)
    integer :: p, i, j, node

    do p = 1, n
      do j = 1, 3
        node = w%row(p, j) - 1
        do i = 1, 3
          total(5:6, node + i) = total(5:6, node + i) + w%sx(p, i)*w%sy(p, j)*mass*[bx(p), by(p)]
        end do
      end do
    end do
  end subroutine map_body_force

  !> What `n` points bring to the mass and momentum of their nodes, in the order of total(1:4). The
  !> mass comes twice: a constant 0 in the fourth lane would have all four stored one by one.
  pure subroutine pack_momentum(n, mass, vx, vy, brought)
    integer, intent(in) :: n
    real(wp), intent(in) :: mass, vx(n), vy(n)
    real(wp), intent(inout) :: brought(4, BLOCK)
    integer :: p

    !$omp simd
    do p = 1, n
      brought(1, p) = mass
      brought(2, p) = mass*vx(p)
      brought(3, p) = mass*vy(p)
      brought(4, p) = mass
    end do
  end subroutine pack_momentum

  !> What they bring to the forces, in the order of total(5:8).
  pure subroutine pack_force(n, volume, sxx, syy, sxy, brought)
    integer, intent(in) :: n
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    real(wp), intent(inout) :: brought(4, BLOCK)
    integer :: p

    !$omp simd
    do p = 1, n
      brought(1, p) = -volume(p)*sxx(p)
      brought(2, p) = -volume(p)*sxy(p)
      brought(3, p) = -volume(p)*sxy(p)
      brought(4, p) = -volume(p)*syy(p)
    end do
  end subroutine pack_force

  !> value(p, :) = sum of S times motion(1:4).
  pure subroutine gather_motion(n, w, nx, ny, motion, value)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(BLOCK, 4)
    real(wp) :: found(4, BLOCK), v(4)
    integer :: p, j, k, node

    do p = 1, n
      v = 0.0_wp
      node = w%node(p)
      do j = 1, 3
        !$omp simd simdlen(4)
        do k = 1, 4
          v(k) = v(k) + w%sy(p, j)*(w%sx(p, 1)*motion(k, node) + w%sx(p, 2)*motion(k, node + 1) &
            + w%sx(p, 3)*motion(k, node + 2))
        end do
        node = node + nx + 1
      end do
      found(:, p) = v
    end do
    !$omp simd
    do p = 1, n
      value(p, 1) = found(1, p)
      value(p, 2) = found(2, p)
      value(p, 3) = found(3, p)
      value(p, 4) = found(4, p)
    end do
  end subroutine gather_motion

  !> As gather_motion; also gradient(p, :) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy) of v =
  !> motion(3:4), in 1/s.
  pure subroutine gather_motion_and_gradient(n, w, nx, ny, motion, value, gradient)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(BLOCK, 4), gradient(BLOCK, 4)
    real(wp) :: found(8, BLOCK)
    integer :: p

    if (IS_WIDE) then
      call gather_wide(n, w, nx, ny, motion, found)
    else
      call gather_narrow(n, w, nx, ny, motion, found)
    end if
    !$omp simd
    do p = 1, n
      value(p, 1) = found(1, p)
      value(p, 2) = found(2, p)
      value(p, 3) = found(3, p)
      value(p, 4) = found(4, p)
      gradient(p, 1) = found(5, p)
      gradient(p, 2) = found(6, p)
      gradient(p, 3) = found(7, p)
      gradient(p, 4) = found(8, p)
    end do
  end subroutine gather_motion_and_gradient

  !> found(:, p) = sums of all eight lanes.
  pure subroutine gather_wide(n, w, nx, ny, motion, found)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: found(8, BLOCK)
    !> Functions of x of the three columns of nodes, and of y of the three rows.
    real(wp) :: column(8, 3), row(8, 3), sx, gx, sy, gy
    integer :: p, i, k, low, middle, high

    do p = 1, n
      do i = 1, 3
        sx = w%sx(p, i)
        gx = w%gx(p, i)
        sy = w%sy(p, i)
        gy = w%gy(p, i)
        !$omp simd simdlen(8)
        do k = 1, 8
          column(k, i) = merge(gx, sx, WITH_GX(k) > 0.0_wp)
          row(k, i) = merge(gy, sy, WITH_GY(k) > 0.0_wp)
        end do
      end do
      low = w%node(p)
      middle = low + nx + 1
      high = middle + nx + 1
      !$omp simd simdlen(8)
      do k = 1, 8
        found(k, p) = row(k, 1)*(column(k, 1)*motion(k, low) &
          + column(k, 2)*motion(k, low + 1) + column(k, 3)*motion(k, low + 2)) &
          + row(k, 2)*(column(k, 1)*motion(k, middle) &
          + column(k, 2)*motion(k, middle + 1) + column(k, 3)*motion(k, middle + 2)) &
          + row(k, 3)*(column(k, 1)*motion(k, high) &
          + column(k, 2)*motion(k, high + 1) + column(k, 3)*motion(k, high + 2))
      end do
    end do
  end subroutine gather_wide

  !> The same from lanes 1 to 4 alone.
  pure subroutine gather_narrow(n, w, nx, ny, motion, found)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: found(8, BLOCK)
    real(wp) :: row, slope, v(4), gx(4), gy(4)
    integer :: p, j, k, node

    do p = 1, n
      v = 0.0_wp
      gx = 0.0_wp
      gy = 0.0_wp
      node = w%node(p)
      do j = 1, 3
        !$omp simd simdlen(4) private(row, slope)
        do k = 1, 4
          row = w%sx(p, 1)*motion(k, node) + w%sx(p, 2)*motion(k, node + 1) &
            + w%sx(p, 3)*motion(k, node + 2)
          slope = w%gx(p, 1)*motion(k, node) + w%gx(p, 2)*motion(k, node + 1) &
            + w%gx(p, 3)*motion(k, node + 2)
          v(k) = v(k) + w%sy(p, j)*row
          gx(k) = gx(k) + w%sy(p, j)*slope
          gy(k) = gy(k) + w%gy(p, j)*row
        end do
        node = node + nx + 1
      end do
      found(1:4, p) = v
      found(5:6, p) = gx(3:4)
      found(7:8, p) = gy(3:4)
    end do
  end subroutine gather_narrow
end module sg_transfer
