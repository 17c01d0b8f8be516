!> Weighting functions S_ip and their slopes, one axis at a time; the 2-D function is the product.
!>
!> All kinds share one stencil of three nodes an axis, counted from `base`, so that one transfer
!> kernel serves them all. Node k (from 0) lies at `origin + k h`. Lengths below are in cells: xi =
!> (x - origin)/h.
!>
!> uGIMP (Bardenhagen & Kober 2004; closed form without branches), w = width of the point in cells,
!> 0 < w <= 1:
!>   base = floor(xi - w/2), f = xi - w/2 - base, u = max(0, f + w - 1), d = max(0, 1 - f - w)
!>   S_0 = ((1-f)^2 - d^2)/(2w),  S_2 = u^2/(2w),  S_1 = 1 - S_0 - S_2
!>   S_2' = u/(w h),  S_0' = S_2' - 1/h,  S_1' = -(S_0' + S_2')
!> linear: base = floor(xi), f = xi - base; S = (1-f, f, 0), S' = (-1, 1, 0)/h.
module sg_weighting
  use sg_kinds, only: wp
  implicit none
  private

  public :: weights_t, axis_weights_interface, BLOCK
  public :: gimp_axis_weights, linear_axis_weights

  !> Points that a kernel handles at a time: long enough to fill vector units, short enough for the
  !> first cache.
  integer, parameter :: BLOCK = 64

  !> Weights of up to BLOCK points.
  type :: weights_t
    !> First node of the stencil in x and y, counted from 0.
    integer :: i(BLOCK), j(BLOCK)
    !> Weights and slopes (1/m) along x and along y: point, node of the stencil.
    real(wp) :: sx(BLOCK, 3), sy(BLOCK, 3), gx(BLOCK, 3), gy(BLOCK, 3)
  end type weights_t

  abstract interface
    !> Weights of `n` points along one axis. `last_base` is the largest allowed first node: a point
    !> outside the grid is held inside, so that no array is overrun before the end of the step
    !> reports it lost.
    pure subroutine axis_weights_interface(n, x, origin, inverse_cell, width, last_base, base, s, g)
      import :: wp, BLOCK
      implicit none
      integer, intent(in) :: n
      !> Positions in m.
      real(wp), intent(in) :: x(n)
      !> Position of node 0 in m, 1/h in 1/m, width of the points in cells.
      real(wp), intent(in) :: origin, inverse_cell, width
      integer, intent(in) :: last_base
      integer, intent(inout) :: base(BLOCK)
      real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    end subroutine axis_weights_interface
  end interface

contains

  !> uGIMP; see the head of the module.
  pure subroutine gimp_axis_weights(n, x, origin, inverse_cell, width, last_base, base, s, g)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    real(wp), intent(in) :: origin, inverse_cell, width
    integer, intent(in) :: last_base
    integer, intent(inout) :: base(BLOCK)
    real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    real(wp) :: half, half_inverse_width, slope, left, f, u, d, s0, s2, g0, g2
    integer :: p, k

    half = 0.5_wp*width
    half_inverse_width = 0.5_wp/width
    slope = inverse_cell/width
    !$omp simd private(left, k, f, u, d, s0, s2, g0, g2)
    do p = 1, n
      left = (x(p) - origin)*inverse_cell - half
      k = min(max(floor(left), 0), last_base)
      f = left - real(k, wp)
      u = max(0.0_wp, f + width - 1.0_wp)
      d = max(0.0_wp, 1.0_wp - f - width)
      s0 = ((1.0_wp - f)*(1.0_wp - f) - d*d)*half_inverse_width
      s2 = u*u*half_inverse_width
      g2 = u*slope
      g0 = g2 - inverse_cell
      base(p) = k
      s(p, 1) = s0
      s(p, 2) = 1.0_wp - s0 - s2
      s(p, 3) = s2
      g(p, 1) = g0
      g(p, 2) = -(g0 + g2)
      g(p, 3) = g2
    end do
  end subroutine gimp_axis_weights

  !> Linear hat functions: the classical MPM. `width` plays no part.
  pure subroutine linear_axis_weights(n, x, origin, inverse_cell, width, last_base, base, s, g)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n)
    real(wp), intent(in) :: origin, inverse_cell, width
    integer, intent(in) :: last_base
    integer, intent(inout) :: base(BLOCK)
    real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    real(wp) :: xi, f
    integer :: p, k

    !$omp simd private(xi, k, f)
    do p = 1, n
      xi = (x(p) - origin)*inverse_cell
      k = min(max(floor(xi), 0), last_base)
      f = xi - real(k, wp)
      base(p) = k
      s(p, 1) = 1.0_wp - f
      s(p, 2) = f
      s(p, 3) = 0.0_wp
      g(p, 1) = -inverse_cell
      g(p, 2) = inverse_cell
      g(p, 3) = 0.0_wp
    end do
  end subroutine linear_axis_weights
end module sg_weighting
