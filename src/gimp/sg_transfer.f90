!> Transfers between points and nodes, a block of points at a time.
!>
!> Node data are interleaved so that one node is one or two vectors:
!>   total(1:8)   mass, momentum x, momentum y, -, then the force in two parts, fx + fx', fy + fy':
!>                fx, fy, fx', fy'                                         (sums over points)
!>   motion(1:4)  two velocities, whose meaning the time scheme chooses    (read by the points)
!>
!> map_momentum:   m_i += S m_p;  p_i += S m_p v_p                 (Eqs. 3, 4 of Ma et al. 2022)
!> map_gradient:   p_i += S m_p L_p (x_i - x_p)                    (TPIC, Nakamura et al. 2023)
!> map_force:      f_i -= V_p sigma_p grad S                       (Eq. 5)
!> gather:         a_p = sum S motion_i;  L_p = sum motion_i(3:4) (x) grad S
!>
!> With the force in two parts every component of total is one product (a function of x) (a function
!> of y) (what the point brings), S S for 1 to 4, S' S for 5 and 6, S S' for 7 and 8, and a node
!> costs one multiplication and addition of eight numbers.
!>
!> Nodes are counted along rows: node (i, j) is i + j (nx + 1). What a point brings to the nodes is
!> laid out for the whole block first: vectors put together from numbers just computed would stall
!> the loads behind them.
module sg_transfer
  use sg_kinds, only: dp, wp
  use sg_weighting, only: axis_t, BLOCK, weights_t
  implicit none
  private

  public :: map_momentum, map_gradient, map_force, map_momentum_and_force, map_body_force, &
    gather_motion, gather_motion_and_gradient

  !> Which components of total go with the weight and which with the slope, along x and along y.
  real(wp), parameter :: WITH_GX(8) = real([0, 0, 0, 0, 1, 1, 0, 0], wp)
  real(wp), parameter :: WITH_GY(8) = real([0, 0, 0, 0, 0, 0, 1, 1], wp)
  real(wp), parameter :: WITH_SX(8) = 1.0_wp - WITH_GX
  real(wp), parameter :: WITH_SY(8) = 1.0_wp - WITH_GY

contains

  !> Adds mass and momentum of `n` points to the nodes.
  pure subroutine map_momentum(n, w, mass, vx, vy, nx, ny, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> [n], kg/m and m/s.
    real(wp), intent(in) :: mass(n), vx(n), vy(n)
    !> Last node in each direction.
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp) :: brought(4, BLOCK), along_row(4)
    integer :: p, i, j, k, node

    call pack_momentum(4, n, mass, vx, vy, brought)
    do p = 1, n
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(nx + 1) - 1
        !$omp simd
        do k = 1, 4
          along_row(k) = w%sy(p, j)*brought(k, p)
        end do
        do i = 1, 3
          !$omp simd
          do k = 1, 4
            total(k, node + i) = total(k, node + i) + w%sx(p, i)*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine map_momentum

  !> Adds to the momentum of the nodes what the velocities about `n` points differ from those at
  !> them, L (x_i - x_p); no momentum in sum, since the weights reproduce linear functions. Adds
  !> the kinetic energy of these differences, sum m S |L (x_i - x_p)|^2/2, to `energy` (J/m).
  pure subroutine map_gradient(n, w, mass, x, y, gradient, x_axis, y_axis, total, energy)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> [n], kg/m and m; [4, n], 1/s, in the order of gather_motion_and_gradient.
    real(wp), intent(in) :: mass(n), x(n), y(n), gradient(4, n)
    type(axis_t), intent(in) :: x_axis, y_axis
    real(wp), intent(inout) :: total(8, 0:(x_axis%last + 1)*(y_axis%last + 1) - 1)
    real(dp), intent(inout) :: energy
    real(wp) :: dx(BLOCK, 3), dy(BLOCK, 3), at_point(2), along_x(2), twice
    integer :: p, i, j, node

    call find_distances(n, x, w%i, x_axis, dx)
    call find_distances(n, y, w%j, y_axis, dy)
    ! Mixed terms vanish: sum S (x_i - x_p) = 0.
    twice = 0.0_wp
    !$omp simd reduction(+:twice)
    do p = 1, n
      twice = twice + mass(p)*((gradient(1, p)**2 + gradient(2, p)**2)*(w%sx(p, 1)*dx(p, 1)**2 &
        + w%sx(p, 2)*dx(p, 2)**2 + w%sx(p, 3)*dx(p, 3)**2) + (gradient(3, p)**2 &
        + gradient(4, p)**2)*(w%sy(p, 1)*dy(p, 1)**2 + w%sy(p, 2)*dy(p, 2)**2 &
        + w%sy(p, 3)*dy(p, 3)**2))
    end do
    energy = energy + 0.5_wp*twice
    do p = 1, n
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(x_axis%last + 1) - 1
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
  pure subroutine map_force(n, w, volume, sxx, syy, sxy, nx, ny, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> [n], m^2 and Pa.
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp) :: brought(4, BLOCK), along_row(4), along_column(4, 3)
    integer :: p, i, j, k, node

    call pack_force(4, 0, n, volume, sxx, syy, sxy, brought)
    do p = 1, n
      do i = 1, 3
        !$omp simd
        do k = 1, 4
          along_column(k, i) = w%sx(p, i)*WITH_SX(4 + k) + w%gx(p, i)*WITH_GX(4 + k)
        end do
      end do
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(nx + 1) - 1
        !$omp simd
        do k = 1, 4
          along_row(k) = (w%sy(p, j)*WITH_SY(4 + k) + w%gy(p, j)*WITH_GY(4 + k))*brought(k, p)
        end do
        do i = 1, 3
          !$omp simd
          do k = 1, 4
            total(4 + k, node + i) = total(4 + k, node + i) + along_column(k, i)*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine map_force

  !> map_momentum and map_force in one go through the nodes.
  pure subroutine map_momentum_and_force(n, w, mass, vx, vy, volume, sxx, syy, sxy, nx, ny, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass(n), vx(n), vy(n), volume(n), sxx(n), syy(n), sxy(n)
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp) :: brought(8, BLOCK), along_row(8), along_column(8, 3)
    integer :: p, i, j, k, node

    call pack_momentum(8, n, mass, vx, vy, brought)
    call pack_force(8, 4, n, volume, sxx, syy, sxy, brought)
    do p = 1, n
      do i = 1, 3
        !$omp simd simdlen(8)
        do k = 1, 8
          along_column(k, i) = w%sx(p, i)*WITH_SX(k) + w%gx(p, i)*WITH_GX(k)
        end do
      end do
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(nx + 1) - 1
        !$omp simd simdlen(8)
        do k = 1, 8
          along_row(k) = (w%sy(p, j)*WITH_SY(k) + w%gy(p, j)*WITH_GY(k))*brought(k, p)
        end do
        do i = 1, 3
          !$omp simd simdlen(8)
          do k = 1, 8
            total(k, node + i) = total(k, node + i) + along_column(k, i)*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine map_momentum_and_force

  !> f_i += S m_p b_p for forces per mass `bx`, `by` in m/s^2.
  pure subroutine map_body_force(n, w, mass, bx, by, nx, ny, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass(n), bx(BLOCK), by(BLOCK)
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:(nx + 1)*(ny + 1) - 1)
    integer :: p, i, j, node

    do p = 1, n
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(nx + 1) - 1
        do i = 1, 3
          total(5:6, node + i) = total(5:6, node + i) + w%sx(p, i)*w%sy(p, j)*mass(p)*[bx(p), &
            by(p)]
        end do
      end do
    end do
  end subroutine map_body_force

  !> What `n` points bring to the mass and momentum of their nodes, in the order of total(1:4).
  pure subroutine pack_momentum(lanes, n, mass, vx, vy, brought)
    integer, intent(in) :: lanes, n
    real(wp), intent(in) :: mass(n), vx(n), vy(n)
    real(wp), intent(inout) :: brought(lanes, BLOCK)
    integer :: p

    !$omp simd
    do p = 1, n
      brought(1, p) = mass(p)
      brought(2, p) = mass(p)*vx(p)
      brought(3, p) = mass(p)*vy(p)
      brought(4, p) = 0.0_wp
    end do
  end subroutine pack_momentum

  !> What they bring to the forces, in the order of total(5:8), behind the lane `k`.
  pure subroutine pack_force(lanes, k, n, volume, sxx, syy, sxy, brought)
    integer, intent(in) :: lanes, k, n
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    real(wp), intent(inout) :: brought(lanes, BLOCK)
    integer :: p

    !$omp simd
    do p = 1, n
      brought(k + 1, p) = -volume(p)*sxx(p)
      brought(k + 2, p) = -volume(p)*sxy(p)
      brought(k + 3, p) = -volume(p)*sxy(p)
      brought(k + 4, p) = -volume(p)*syy(p)
    end do
  end subroutine pack_force

  !> value(:, p) = sum of S times motion.
  pure subroutine gather_motion(n, w, nx, ny, motion, value)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(4, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(4, BLOCK)
    real(wp) :: v(4)
    integer :: p, j, k, node

    do p = 1, n
      v = 0.0_wp
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(nx + 1)
        !$omp simd
        do k = 1, 4
          v(k) = v(k) + w%sy(p, j)*(w%sx(p, 1)*motion(k, node) + w%sx(p, 2)*motion(k, node + 1) &
            + w%sx(p, 3)*motion(k, node + 2))
        end do
      end do
      value(:, p) = v
    end do
  end subroutine gather_motion

  !> As gather_motion; also gradient(:, p) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy) of v =
  !> motion(3:4), in 1/s.
  pure subroutine gather_motion_and_gradient(n, w, nx, ny, motion, value, gradient)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(4, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(4, BLOCK), gradient(4, BLOCK)
    real(wp) :: row, slope, v(4), gx(4), gy(4)
    integer :: p, j, k, node

    do p = 1, n
      v = 0.0_wp
      gx = 0.0_wp
      gy = 0.0_wp
      do j = 1, 3
        node = w%i(p) + (w%j(p) + j - 1)*(nx + 1)
        !$omp simd private(row, slope)
        do k = 1, 4
          row = w%sx(p, 1)*motion(k, node) + w%sx(p, 2)*motion(k, node + 1) &
            + w%sx(p, 3)*motion(k, node + 2)
          slope = w%gx(p, 1)*motion(k, node) + w%gx(p, 2)*motion(k, node + 1) &
            + w%gx(p, 3)*motion(k, node + 2)
          v(k) = v(k) + w%sy(p, j)*row
          gx(k) = gx(k) + w%sy(p, j)*slope
          gy(k) = gy(k) + w%gy(p, j)*row
        end do
      end do
      value(:, p) = v
      gradient(1:2, p) = gx(3:4)
      gradient(3:4, p) = gy(3:4)
    end do
  end subroutine gather_motion_and_gradient
end module sg_transfer
