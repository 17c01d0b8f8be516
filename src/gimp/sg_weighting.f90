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
!> cpGIMP: the same with the present width of each point, which follows its stretch.
!> linear: base = floor(xi), f = xi - base; S = (1-f, f, 0), S' = (-1, 1, 0)/h.
!> bspline (quadratic; Steffen, Kirby & Berzins 2008): d = xi - k of the nearest node k,
!>   S = ((1/2-d)^2/2, 3/4-d^2, (1/2+d)^2/2),  S' = (d-1/2, -2d, d+1/2)/h;
!>   where k is a wall, the node behind it is taken to continue the line through the next two, which
!>   makes S linear there, (max(-d,0), 1-|d|, max(d,0)): the wall is then held exactly.
module sg_weighting
  use sg_kinds, only: i8, wp
  use sg_rounding, only: COARSENESS
  implicit none
  private

  public :: weights_t, axis_t, axis_weights_interface, points_above, BLOCK, NO_WALL
  public :: gimp_axis_weights, cpgimp_axis_weights, linear_axis_weights, bspline_axis_weights

  !> Points that a kernel handles at a time: long enough to fill vector units, short enough for the
  !> first cache, and no more than an integer of kind i8 has bits, which stand for the points of a
  !> block.
  integer, parameter :: BLOCK = 64
  !> `first_wall` or `last_wall` of an axis that is open there.
  integer, parameter :: NO_WALL = -1
  !> Narrowest domain of a point in cells (cpGIMP): below, the weights are linear but for a strip
  !> about the nodes that no longer matters, and the slopes would change within rounding.
  real(wp), parameter :: LEAST_WIDTH = 1.0e-3_wp
  !> The same for uGIMP, whose weights are differences over twice the width; in single precision
  !> they are known to 1e-3 here, on 160 cells.
  real(wp), parameter :: LEAST_FIXED_WIDTH = 1.0e-11_wp*COARSENESS

  !> Weights of up to BLOCK points.
  type :: weights_t
    !> First node of the stencil in x and y, counted from 0, and its number, i + j (nx + 1).
    integer :: i(BLOCK), j(BLOCK), node(BLOCK)
    !> Number of the first node in each of the three rows that the points are mapped to.
    integer :: row(BLOCK, 3)
    !> Weights and slopes (1/m) along x and along y: point, node of the stencil.
    real(wp) :: sx(BLOCK, 3), sy(BLOCK, 3), gx(BLOCK, 3), gy(BLOCK, 3)
    !> Points, as bits, whose stencils reach that many columns and rows of nodes, the weights of the
    !> third being zero elsewhere; a point that is in none of them is not mapped.
    integer(i8) :: reaching(2:3, 2:3)
  contains
    procedure :: find_stencils
    procedure :: number_rows
    procedure :: keep_rows
  end type weights_t

  !> The nodes along one axis.
  type :: axis_t
    !> Position of node 0 in m, and 1/h in 1/m.
    real(wp) :: origin, inverse_cell
    !> Last node, and the largest allowed first node of a stencil: a point outside the grid is held
    !> inside, so that no array is overrun before the end of the step reports it lost.
    integer :: last, last_base
    !> Nodes of the closed walls, NO_WALL where the axis is open.
    integer :: first_wall, last_wall
  end type axis_t

  abstract interface
    !> Weights of `n` points along one axis.
    pure subroutine axis_weights_interface(n, x, width, axis, base, s, g)
      import :: wp, axis_t, BLOCK
      implicit none
      integer, intent(in) :: n
      !> Positions and full widths of the points in m. All points of a call have the same width,
      !> except for cpGIMP.
      real(wp), intent(in) :: x(n), width(n)
      type(axis_t), intent(in) :: axis
      integer, intent(inout) :: base(BLOCK)
      !> Within the grid the slope of the third node is nowhere negative, and where it is 0, so is
      !> its weight: find_stencils leaves the node out there.
      real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    end subroutine axis_weights_interface
  end interface

contains

  !> Numbers the first nodes of `n` points in a grid whose rows end with node `nx`, and sorts the
  !> points by what their stencils reach: all nodes if they are `whole`.
  pure subroutine find_stencils(this, n, nx, whole)
    class(weights_t), intent(inout) :: this
    integer, intent(in) :: n, nx
    logical, intent(in) :: whole
    integer(i8) :: wide, high, all_points
    integer :: p

    !$omp simd
    do p = 1, n
      this%node(p) = this%i(p) + this%j(p)*(nx + 1)
    end do
    all_points = maskr(n, kind=i8)
    if (whole) then
      wide = all_points
      high = all_points
    else
      wide = points_above(n, this%gx(:, 3), 0.0_wp)
      high = points_above(n, this%gy(:, 3), 0.0_wp)
    end if
    this%reaching(2, 2) = iand(all_points, not(ior(wide, high)))
    this%reaching(3, 2) = iand(wide, not(high))
    this%reaching(2, 3) = iand(high, not(wide))
    this%reaching(3, 3) = iand(wide, high)
  end subroutine find_stencils

  !> The points among the first `n` of a block whose `value` is above `limit`, as bits: point p is
  !> bit p - 1.
  pure function points_above(n, value, limit) result(points)
    integer, intent(in) :: n
    real(wp), intent(in) :: value(BLOCK), limit
    integer :: p
    integer(i8) :: points, its_bit
    real(wp) :: its_value
    !> A table, since shifts by the number of the point do not vectorise.
    integer(i8), parameter :: BIT(BLOCK) = [(shiftl(1_i8, p - 1), p=1, BLOCK)]

    points = 0_i8
    !$omp simd private(its_bit, its_value) reduction(ior:points)
    do p = 1, n
      its_bit = BIT(p)
      its_value = value(p)
      points = ior(points, merge(its_bit, 0_i8, its_value > limit))
    end do
  end function points_above

  !> Numbers the first nodes of all three rows, for mapping.
  pure subroutine number_rows(this, n, nx)
    class(weights_t), intent(inout) :: this
    integer, intent(in) :: n, nx
    integer :: p

    !$omp simd
    do p = 1, n
      this%row(p, 1) = this%node(p)
      this%row(p, 2) = this%node(p) + nx + 1
      this%row(p, 3) = this%node(p) + 2*(nx + 1)
    end do
  end subroutine number_rows

  !> Leads what `n` points bring to rows of nodes other than first_row to last_row to the node
  !> `spare` and the two after it.
  pure subroutine keep_rows(this, n, first_row, last_row, spare)
    class(weights_t), intent(inout) :: this
    integer, intent(in) :: n, first_row, last_row, spare
    integer :: p, k

    do k = 1, 3
      !$omp simd
      do p = 1, n
        this%row(p, k) = merge(this%row(p, k), spare, this%j(p) + k - 1 >= first_row &
          .and. this%j(p) + k - 1 <= last_row)
      end do
    end do
  end subroutine keep_rows

  !> uGIMP; see the head of the module.
  pure subroutine gimp_axis_weights(n, x, width, axis, base, s, g)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), width(n)
    type(axis_t), intent(in) :: axis
    integer, intent(inout) :: base(BLOCK)
    real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    real(wp) :: w, half_inverse_width, slope
    integer :: p

    w = max(width(1)*axis%inverse_cell, LEAST_FIXED_WIDTH)
    half_inverse_width = 0.5_wp/w
    slope = axis%inverse_cell/w
    !$omp simd
    do p = 1, n
      call domain_weights(x(p), w, half_inverse_width, slope, axis, base(p), s(p, 1), s(p, 2), &
        s(p, 3), g(p, 1), g(p, 2), g(p, 3))
    end do
  end subroutine gimp_axis_weights

  !> The three weights and slopes of one point at `x` (m) whose domain is `w` cells wide; equations
  !> are in the head of the module. `half_inverse_width` = 1/(2w) and `slope` = 1/(w h) come from
  !> outside, where they can be found once for many points.
  pure subroutine domain_weights(x, w, half_inverse_width, slope, axis, base, s0, s1, s2, g0, g1, &
    g2)
    real(wp), intent(in) :: x, w, half_inverse_width, slope
    type(axis_t), intent(in) :: axis
    integer, intent(inout) :: base
    real(wp), intent(inout) :: s0, s1, s2, g0, g1, g2
    real(wp) :: left, f, u, d

    left = (x - axis%origin)*axis%inverse_cell - 0.5_wp*w
    base = min(max(int(left), 0), axis%last_base) ! int: floor, but for what is raised to 0
    f = left - real(base, wp)
    u = max(0.0_wp, f + w - 1.0_wp)
    d = max(0.0_wp, 1.0_wp - f - w)
    s0 = ((1.0_wp - f)*(1.0_wp - f) - d*d)*half_inverse_width
    s2 = u*u*half_inverse_width
    s1 = 1.0_wp - s0 - s2
    g2 = u*slope
    g0 = g2 - axis%inverse_cell
    g1 = -(g0 + g2)
  end subroutine domain_weights

  !> cpGIMP: the width of each point counts, between LEAST_WIDTH and one cell.
  pure subroutine cpgimp_axis_weights(n, x, width, axis, base, s, g)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), width(n)
    type(axis_t), intent(in) :: axis
    integer, intent(inout) :: base(BLOCK)
    real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    real(wp) :: w
    integer :: p

    !$omp simd private(w)
    do p = 1, n
      w = min(max(width(p)*axis%inverse_cell, LEAST_WIDTH), 1.0_wp)
      call domain_weights(x(p), w, 0.5_wp/w, axis%inverse_cell/w, axis, base(p), s(p, 1), &
        s(p, 2), s(p, 3), g(p, 1), g(p, 2), g(p, 3))
    end do
  end subroutine cpgimp_axis_weights

  !> Linear hat functions: the classical MPM. `width` plays no part.
  pure subroutine linear_axis_weights(n, x, width, axis, base, s, g)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), width(n)
    type(axis_t), intent(in) :: axis
    integer, intent(inout) :: base(BLOCK)
    real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    real(wp) :: xi, f
    integer :: p, k

    !$omp simd private(xi, k, f)
    do p = 1, n
      xi = (x(p) - axis%origin)*axis%inverse_cell
      k = min(max(int(xi), 0), axis%last_base)
      f = xi - real(k, wp)
      base(p) = k
      s(p, 1) = 1.0_wp - f
      s(p, 2) = f
      s(p, 3) = 0.0_wp
      g(p, 1) = -axis%inverse_cell
      g(p, 2) = axis%inverse_cell
      g(p, 3) = 0.0_wp
    end do
  end subroutine linear_axis_weights

  !> Quadratic B-splines, linear within half a cell of a wall; `width` plays no part.
  pure subroutine bspline_axis_weights(n, x, width, axis, base, s, g)
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), width(n)
    type(axis_t), intent(in) :: axis
    integer, intent(inout) :: base(BLOCK)
    real(wp), intent(inout) :: s(BLOCK, 3), g(BLOCK, 3)
    real(wp) :: xi, d, s0, s2, g0, g2, linear
    integer :: p, k, first_wall, last_wall

    first_wall = axis%first_wall
    last_wall = axis%last_wall
    !$omp simd private(xi, k, d, s0, s2, g0, g2, linear)
    do p = 1, n
      xi = (x(p) - axis%origin)*axis%inverse_cell
      k = min(max(int(xi - 0.5_wp), 0), axis%last_base)
      d = xi - real(k + 1, wp)
      linear = merge(1.0_wp, 0.0_wp, k + 1 == first_wall .or. k + 1 == last_wall)
      s0 = 0.5_wp*(0.5_wp - d)*(0.5_wp - d)
      s2 = 0.5_wp*(0.5_wp + d)*(0.5_wp + d)
      g0 = d - 0.5_wp
      g2 = d + 0.5_wp
      s0 = s0 + linear*(max(-d, 0.0_wp) - s0)
      s2 = s2 + linear*(max(d, 0.0_wp) - s2)
      g0 = g0 + linear*(merge(-1.0_wp, 0.0_wp, d < 0.0_wp) - g0)
      g2 = g2 + linear*(merge(0.0_wp, 1.0_wp, d < 0.0_wp) - g2)
      base(p) = k
      s(p, 1) = s0
      s(p, 2) = 1.0_wp - s0 - s2
      s(p, 3) = s2
      g(p, 1) = g0*axis%inverse_cell
      g(p, 2) = -(g0 + g2)*axis%inverse_cell
      g(p, 3) = g2*axis%inverse_cell
    end do
  end subroutine bspline_axis_weights
end module sg_weighting
