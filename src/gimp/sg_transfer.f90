!> Transfers between points and nodes, a block of points at a time.
!>
!> Node data are interleaved so that one node is one or two vectors:
!>   nodes%total(1:8): mass, momentum x, momentum y, -, force x, force y, -, -   (sums over points)
!>   nodes%motion(1:4): two velocities, whose meaning the time scheme chooses     (read by the
!> points)
!>
!> map_momentum:   m_i += S m_p;  p_i += S m_p v_p                            (Eqs. 3, 4 of Ma et
!> al. 2022)
!> map_force:      f_i -= V_p sigma_p grad S                                  (Eq. 5)
!> gather:         a_p = sum S motion_i;  L_p = sum motion_i(3:4) (x) grad S
module sg_transfer
  use sg_kinds, only: wp
  use sg_weighting, only: BLOCK, weights_t
  implicit none
  private

  public :: map_momentum, map_force, map_momentum_and_force, gather_motion, &
    gather_motion_and_gradient

contains

  !> Adds mass and momentum of `n` points to the nodes.
  pure subroutine map_momentum(n, w, mass, vx, vy, nx, ny, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: mass(n), vx(n), vy(n)
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny)
    real(wp) :: a(4), s
    integer :: p, i, j, k

    do p = 1, n
      a = [mass(p), mass(p)*vx(p), mass(p)*vy(p), 0.0_wp]
      do j = 1, 3
        do i = 1, 3
          s = w%sx(p, i)*w%sy(p, j)
          do k = 1, 4
            total(k, w%i(p) + i - 1, w%j(p) + j - 1) = total(k, w%i(p) + i - 1, w%j(p) + j &
              - 1) + s*a(k)
          end do
        end do
      end do
    end do
  end subroutine map_momentum

  !> Adds the internal force of `n` points to the nodes.
  pure subroutine map_force(n, w, volume, sxx, syy, sxy, nx, ny, total)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny)
    real(wp) :: b(2), c(2), along_x(2), along_y(2)
    integer :: p, i, j, k

    do p = 1, n
      b = -volume(p)*[sxx(p), sxy(p)]
      c = -volume(p)*[sxy(p), syy(p)]
      do j = 1, 3
        along_x = w%sy(p, j)*b
        along_y = w%gy(p, j)*c
        do i = 1, 3
          do k = 1, 2
            total(4 + k, w%i(p) + i - 1, w%j(p) + j - 1) = total(4 + k, w%i(p) + i - 1, w%j(p) &
              + j - 1) &
              + w%gx(p, i)*along_x(k) + w%sx(p, i)*along_y(k)
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
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny)
    ! What S_x S_y multiplies in the first half of a node, and S_x' S_y and S_x S_y' in the second.
    ! Laid out for
    ! all points first: vectors put together from numbers just computed would stall the loads
    ! behind them.
    real(wp) :: a(4, BLOCK), b(4, BLOCK), c(4, BLOCK), momentum(4), along_x(4), along_y(4)
    integer :: p, i, j, k, first, row

    !$omp simd
    do p = 1, n
      a(1, p) = mass(p)
      a(2, p) = mass(p)*vx(p)
      a(3, p) = mass(p)*vy(p)
      a(4, p) = 0.0_wp
      b(1, p) = -volume(p)*sxx(p)
      b(2, p) = -volume(p)*sxy(p)
      b(3, p) = 0.0_wp
      b(4, p) = 0.0_wp
      c(1, p) = -volume(p)*sxy(p)
      c(2, p) = -volume(p)*syy(p)
      c(3, p) = 0.0_wp
      c(4, p) = 0.0_wp
    end do
    do p = 1, n
      first = w%i(p) - 1
      row = w%j(p) - 1
      do j = 1, 3
        !$omp simd
        do k = 1, 4
          momentum(k) = w%sy(p, j)*a(k, p)
          along_x(k) = w%sy(p, j)*b(k, p)
          along_y(k) = w%gy(p, j)*c(k, p)
        end do
        do i = 1, 3
          !$omp simd
          do k = 1, 4
            total(k, first + i, row + j) = total(k, first + i, row + j) + w%sx(p, i)*momentum(k)
          end do
          !$omp simd
          do k = 1, 4
            total(4 + k, first + i, row + j) = total(4 + k, first + i, row + j) &
              + (w%gx(p, i)*along_x(k) + w%sx(p, i)*along_y(k))
          end do
        end do
      end do
    end do
  end subroutine map_momentum_and_force

  !> value(:, p) = sum of S times motion.
  pure subroutine gather_motion(n, w, nx, ny, motion, value)
    integer, intent(in) :: n
    type(weights_t), intent(in) :: w
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: motion(4, 0:nx, 0:ny)
    real(wp), intent(inout) :: value(4, BLOCK)
    real(wp) :: row(4), v(4)
    integer :: p, i, j, k

    do p = 1, n
      v = 0.0_wp
      do j = 1, 3
        row = 0.0_wp
        do i = 1, 3
          do k = 1, 4
            row(k) = row(k) + w%sx(p, i)*motion(k, w%i(p) + i - 1, w%j(p) + j - 1)
          end do
        end do
        v = v + w%sy(p, j)*row
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
    real(wp), intent(in) :: motion(4, 0:nx, 0:ny)
    real(wp), intent(inout) :: value(4, BLOCK), gradient(4, BLOCK)
    real(wp) :: row(4), slope(4), v(4), gx(4), gy(4)
    integer :: p, i, j, k

    do p = 1, n
      v = 0.0_wp
      gx = 0.0_wp
      gy = 0.0_wp
      do j = 1, 3
        row = 0.0_wp
        slope = 0.0_wp
        do i = 1, 3
          do k = 1, 4
            row(k) = row(k) + w%sx(p, i)*motion(k, w%i(p) + i - 1, w%j(p) + j - 1)
            slope(k) = slope(k) + w%gx(p, i)*motion(k, w%i(p) + i - 1, w%j(p) + j - 1)
          end do
        end do
        v = v + w%sy(p, j)*row
        gx = gx + w%sy(p, j)*slope
        gy = gy + w%gy(p, j)*row
      end do
      value(:, p) = v
      gradient(1:2, p) = gx(3:4)
      gradient(3:4, p) = gy(3:4)
    end do
  end subroutine gather_motion_and_gradient
end module sg_transfer
