!> Transfers between points and nodes, a block of points at a time.
!>
!> Node data are interleaved so that one node is one vector of eight numbers, or two of four:
!>   total(1:8)   mass, momentum x, momentum y, mass again (a lane has to hold something, and
!>                sg_boundary marks nodes there), then the force in two parts, fx + fx', fy + fy':
!>                fx, fy, fx', fy'                                     (sums over points)
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
!> 4, S' S for 5 and 6, S S' for 7 and 8. So a node is one multiplication and addition of eight
!> lanes. Forces alone go to lanes 5 and 6 in full.
!>
!> A point reaches two or three columns of nodes and as many rows. Those of a block that reach the
!> same go one after the other, through one text with the number of columns and rows as arguments:
!> they are constants wherever it is called, and compiled as such once it is inlined there. The
!> rarer map_gradient and map_body_force take all nine nodes.
!>
!> Nodes are counted along rows: node (i, j) is i + j (nx + 1).
module sg_transfer
  use sg_kinds, only: dp, i8, wp
  use sg_weighting, only: axis_t, BLOCK, weights_t
  implicit none
  private

  public :: map_momentum, map_gradient, map_force, map_momentum_and_force, map_body_force, &
    gather_motion, gather_motion_and_gradient

  !> Lanes that go with the slope along x and along y: above 0.
  real(wp), parameter :: WITH_GX(8) = real([0, 0, 0, 0, 1, 1, 0, 0], wp)
  real(wp), parameter :: WITH_GY(8) = real([0, 0, 0, 0, 0, 0, 1, 1], wp)

contains

  !> Adds mass and momentum of `n` points to the nodes.
  pure subroutine map_momentum(n, w, mass, vx, vy, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    !> [n], kg/m and m/s.
    real(wp), intent(in) :: mass(n), vx(n), vy(n)
    !> Last node of `total`.
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)

    call add_momentum(2, 2, n, w, mass, vx, vy, last, total)
    call add_momentum(3, 2, n, w, mass, vx, vy, last, total)
    call add_momentum(2, 3, n, w, mass, vx, vy, last, total)
    call add_momentum(3, 3, n, w, mass, vx, vy, last, total)
  end subroutine map_momentum

  !> map_momentum for the points that reach so many `columns` and `rows`.
  pure subroutine add_momentum(columns, rows, n, w, mass, vx, vy, last, total)
    integer, intent(in) :: columns, rows, n, last
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass(n), vx(n), vy(n)
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: brought(4), along_row(4), s
    integer(i8) :: points
    integer :: p, i, j, k, node

    points = w%reaching(columns, rows)
    do while (points /= 0_i8)
      call take_point(points, p)
      brought = [mass(p), mass(p)*vx(p), mass(p)*vy(p), mass(p)]
      do j = 1, rows
        node = w%row(p, j) - 1
        s = w%sy(p, j)
        !$omp simd simdlen(4)
        do k = 1, 4
          along_row(k) = s*brought(k)
        end do
        do i = 1, columns
          s = w%sx(p, i)
          !$omp simd simdlen(4)
          do k = 1, 4
            total(k, node + i) = total(k, node + i) + s*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine add_momentum

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
      twice = twice + mass(p)*((gradient(1, p)**2 + gradient(2, p)**2) &
        *(w%sx(p, 1)*dx(p, 1)**2 + w%sx(p, 2)*dx(p, 2)**2 + w%sx(p, 3)*dx(p, 3)**2) &
        + (gradient(3, p)**2 + gradient(4, p)**2)*(w%sy(p, 1)*dy(p, 1)**2 &
        + w%sy(p, 2)*dy(p, 2)**2 + w%sy(p, 3)*dy(p, 3)**2))
    end do
    energy = energy + 0.5_wp*twice
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

    call add_force(2, 2, n, w, volume, sxx, syy, sxy, last, total)
    call add_force(3, 2, n, w, volume, sxx, syy, sxy, last, total)
    call add_force(2, 3, n, w, volume, sxx, syy, sxy, last, total)
    call add_force(3, 3, n, w, volume, sxx, syy, sxy, last, total)
  end subroutine map_force

  !> map_force for the points that reach so many `columns` and `rows`: both parts of the force into
  !> lanes 5 and 6, since two lanes and two products are as fast as four of one.
  pure subroutine add_force(columns, rows, n, w, volume, sxx, syy, sxy, last, total)
    integer, intent(in) :: columns, rows, n, last
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: with_gx(2), with_gy(2), a(2), b(2), s, g
    integer(i8) :: points
    integer :: p, i, j, k, node

    points = w%reaching(columns, rows)
    do while (points /= 0_i8)
      call take_point(points, p)
      s = -volume(p)
      with_gx = [s*sxx(p), s*sxy(p)]
      with_gy = [s*sxy(p), s*syy(p)]
      do j = 1, rows
        node = w%row(p, j) - 1
        s = w%sy(p, j)
        g = w%gy(p, j)
        !$omp simd simdlen(2)
        do k = 1, 2
          a(k) = s*with_gx(k)
          b(k) = g*with_gy(k)
        end do
        do i = 1, columns
          s = w%sx(p, i)
          g = w%gx(p, i)
          !$omp simd simdlen(2)
          do k = 1, 2
            total(4 + k, node + i) = total(4 + k, node + i) + g*a(k) + s*b(k)
          end do
        end do
      end do
    end do
  end subroutine add_force

  !> map_momentum and map_force.
  pure subroutine map_momentum_and_force(n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass(n), vx(n), vy(n), volume(n), sxx(n), syy(n), sxy(n)
    integer, intent(in) :: last
    real(wp), intent(inout) :: total(8, 0:last)

    call add_both(2, 2, n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
    call add_both(3, 2, n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
    call add_both(2, 3, n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
    call add_both(3, 3, n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
  end subroutine map_momentum_and_force

  !> map_momentum_and_force for the points that reach so many `columns` and `rows`.
  pure subroutine add_both(columns, rows, n, w, mass, vx, vy, volume, sxx, syy, sxy, last, total)
    integer, intent(in) :: columns, rows, n, last
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass(n), vx(n), vy(n), volume(n), sxx(n), syy(n), sxy(n)
    real(wp), intent(inout) :: total(8, 0:last)
    real(wp) :: brought(8), along_row(8), column(8, 3), row(8, 3), s
    integer(i8) :: points
    integer :: p, i, j, k, node

    points = w%reaching(columns, rows)
    do while (points /= 0_i8)
      call take_point(points, p)
      s = -volume(p)
      brought = [mass(p), mass(p)*vx(p), mass(p)*vy(p), mass(p), s*sxx(p), s*sxy(p), s*sxy(p), &
        s*syy(p)]
      call spread_weights(columns, p, w%sx, w%gx, WITH_GX, column)
      call spread_weights(rows, p, w%sy, w%gy, WITH_GY, row)
      do j = 1, rows
        node = w%row(p, j) - 1
        !$omp simd simdlen(8)
        do k = 1, 8
          along_row(k) = row(k, j)*brought(k)
        end do
        do i = 1, columns
          !$omp simd simdlen(8)
          do k = 1, 8
            total(k, node + i) = total(k, node + i) + column(k, i)*along_row(k)
          end do
        end do
      end do
    end do
  end subroutine add_both

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

  !> The weights `s` and slopes `g` of point `p` at the `nodes` that it reaches along an axis, as
  !> lanes: the slope where `with_slope` is above 0, the weight elsewhere.
  pure subroutine spread_weights(nodes, p, s, g, with_slope, lanes)
    integer, intent(in) :: nodes, p
    real(wp), intent(in) :: s(BLOCK, 3), g(BLOCK, 3), with_slope(8)
    real(wp), intent(inout) :: lanes(8, 3)
    real(wp) :: weight, slope
    integer :: i, k

    do i = 1, nodes
      weight = s(p, i)
      slope = g(p, i)
      !$omp simd simdlen(8)
      do k = 1, 8
        lanes(k, i) = merge(slope, weight, with_slope(k) > 0.0_wp)
      end do
    end do
  end subroutine spread_weights

  !> The first of `points`, which are bits, and not yet none: `p`. Takes it off them.
  pure subroutine take_point(points, p)
    integer(i8), intent(inout) :: points
    integer, intent(out) :: p

    p = trailz(points) + 1
    points = ibclr(points, p - 1)
  end subroutine take_point

  !> value(p, :) = sum of S times motion(1:4).
  pure subroutine gather_motion(w, nx, ny, motion, value)
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(BLOCK, 4)

    call take_motion(2, 2, w, nx, ny, motion, value)
    call take_motion(3, 2, w, nx, ny, motion, value)
    call take_motion(2, 3, w, nx, ny, motion, value)
    call take_motion(3, 3, w, nx, ny, motion, value)
  end subroutine gather_motion

  !> gather_motion for the points that reach so many `columns` and `rows`.
  pure subroutine take_motion(columns, rows, w, nx, ny, motion, value)
    integer, intent(in) :: columns, rows, nx, ny
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(BLOCK, 4)
    real(wp) :: v(4), row(4)
    integer(i8) :: points
    integer :: p, i, j, k, node

    points = w%reaching(columns, rows)
    do while (points /= 0_i8)
      call take_point(points, p)
      node = w%node(p) - 1
      v = 0.0_wp
      do j = 1, rows
        row = 0.0_wp
        do i = 1, columns
          !$omp simd simdlen(4)
          do k = 1, 4
            row(k) = row(k) + w%sx(p, i)*motion(k, node + i)
          end do
        end do
        !$omp simd simdlen(4)
        do k = 1, 4
          v(k) = v(k) + w%sy(p, j)*row(k)
        end do
        node = node + nx + 1
      end do
      value(p, 1) = v(1)
      value(p, 2) = v(2)
      value(p, 3) = v(3)
      value(p, 4) = v(4)
    end do
  end subroutine take_motion

  !> As gather_motion; also gradient(p, :) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy) of v =
  !> motion(3:4), in 1/s.
  pure subroutine gather_motion_and_gradient(w, nx, ny, motion, value, gradient)
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(BLOCK, 4), gradient(BLOCK, 4)

    call take_motion_and_gradient(2, 2, w, nx, ny, motion, value, gradient)
    call take_motion_and_gradient(3, 2, w, nx, ny, motion, value, gradient)
    call take_motion_and_gradient(2, 3, w, nx, ny, motion, value, gradient)
    call take_motion_and_gradient(3, 3, w, nx, ny, motion, value, gradient)
  end subroutine gather_motion_and_gradient

  !> gather_motion_and_gradient for the points that reach so many `columns` and `rows`.
  pure subroutine take_motion_and_gradient(columns, rows, w, nx, ny, motion, value, gradient)
    integer, intent(in) :: columns, rows, nx, ny
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: motion(8, 0:(nx + 1)*(ny + 1) - 1)
    real(wp), intent(inout) :: value(BLOCK, 4), gradient(BLOCK, 4)
    real(wp) :: found(8), along_row(8), column(8, 3), row(8, 3)
    integer(i8) :: points
    integer :: p, i, j, k, node

    points = w%reaching(columns, rows)
    do while (points /= 0_i8)
      call take_point(points, p)
      call spread_weights(columns, p, w%sx, w%gx, WITH_GX, column)
      call spread_weights(rows, p, w%sy, w%gy, WITH_GY, row)
      node = w%node(p) - 1
      found = 0.0_wp
      do j = 1, rows
        along_row = 0.0_wp
        do i = 1, columns
          !$omp simd simdlen(8)
          do k = 1, 8
            along_row(k) = along_row(k) + column(k, i)*motion(k, node + i)
          end do
        end do
        !$omp simd simdlen(8)
        do k = 1, 8
          found(k) = found(k) + row(k, j)*along_row(k)
        end do
        node = node + nx + 1
      end do
      value(p, 1) = found(1)
      value(p, 2) = found(2)
      value(p, 3) = found(3)
      value(p, 4) = found(4)
      gradient(p, 1) = found(5)
      gradient(p, 2) = found(6)
      gradient(p, 3) = found(7)
      gradient(p, 4) = found(8)
    end do
  end subroutine take_motion_and_gradient
end module sg_transfer
