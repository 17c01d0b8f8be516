!> Finds the tensor grid on which points lie, if they do: the structure that makes fields cheap.
module sg_lattice
  use sg_kinds, only: i8, wp
  use sg_sorting, only: sort_index
  implicit none
  private

  public :: lattice_t, find_spacing

  !> Coordinates closer than this share of the larger extent are the same.
  real(wp), parameter :: COORDINATE_TOLERANCE = 1.0e-9_wp
  !> Largest deviation from an even spacing, as a share of the spacing.
  real(wp), parameter :: SPACING_TOLERANCE = 1.0e-6_wp
  !> Longest even row that is looked for.
  real(wp), parameter :: MOST_STEPS = 1.0e6_wp
  !> Sites per point up to which the points count as lying on a lattice. A disc fills 79 % of its
  !> bounding lattice; n points without structure have n^2 sites.
  integer, parameter :: MOST_SITES_PER_POINT = 16

  type :: lattice_t
    !> Distinct coordinates, ascending, in m: [nx] and [ny].
    real(wp), allocatable :: x(:), y(:)
    !> Column and row of each point, [n].
    integer, allocatable :: column(:), row(:)
    !> False: too many sites for the number of points; use the points as they are.
    logical :: is_lattice = .false.
  contains
    procedure :: init
    procedure :: find_order
    procedure :: is_even
  end type lattice_t

contains

  !> The lattice of the points, which may come in any order and may leave sites empty.
  subroutine init(this, x, y)
    class(lattice_t), intent(out) :: this
    !> [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    real(wp) :: tolerance

    tolerance = 0.0_wp
    if (size(x) > 0) tolerance = COORDINATE_TOLERANCE*max(maxval(x) - minval(x), &
      maxval(y) - minval(y))
    call find_distinct(x, tolerance, this%x, this%column)
    call find_distinct(y, tolerance, this%y, this%row)
    this%is_lattice = int(size(this%x), i8)*size(this%y) <= &
      int(MOST_SITES_PER_POINT, i8)*size(x)
  end subroutine init

  !> The distinct values, ascending, and the position in them of each value.
  subroutine find_distinct(values, tolerance, distinct, position)
    real(wp), intent(in) :: values(:), tolerance
    real(wp), allocatable, intent(out) :: distinct(:)
    integer, allocatable, intent(out) :: position(:)
    integer :: i, count

    distinct = values(sort_index(values))
    count = min(1, size(values))
    do i = 2, size(values)
      if (distinct(i) - distinct(count) <= tolerance) cycle
      count = count + 1
      distinct(count) = distinct(i)
    end do
    distinct = distinct(:count)
    allocate (position(size(values)))
    do i = 1, size(values)
      position(i) = last_not_above(distinct, values(i))
    end do
  end subroutine find_distinct

  !> Position of the last element of an ascending array that is <= value (at least 1).
  pure function last_not_above(ascending, value) result(low)
    real(wp), intent(in) :: ascending(:), value
    integer :: low, high, middle

    low = 1
    high = size(ascending) + 1
    do while (high - low > 1)
      middle = (low + high)/2
      if (ascending(middle) <= value) then
        low = middle
      else
        high = middle
      end if
    end do
  end function last_not_above

  !> The points in lattice order, x running fastest: `order(k)` is the k-th point.
  subroutine find_order(this, order)
    class(lattice_t), intent(in) :: this
    !> [n].
    integer, intent(out) :: order(:)
    integer, allocatable :: first(:)
    integer :: i, site

    ! A counting sort over the sites.
    allocate (first(size(this%x)*size(this%y) + 1))
    first = 0
    do i = 1, size(order)
      site = this%column(i) + (this%row(i) - 1)*size(this%x)
      first(site + 1) = first(site + 1) + 1
    end do
    first(1) = 1
    do site = 1, size(first) - 1
      first(site + 1) = first(site + 1) + first(site)
    end do
    do i = 1, size(order)
      site = this%column(i) + (this%row(i) - 1)*size(this%x)
      order(first(site)) = i
      first(site) = first(site) + 1
    end do
  end subroutine find_order

  !> Are columns and rows evenly spaced, but for some that are missing?
  pure logical function is_even(this)
    class(lattice_t), intent(in) :: this
    integer, allocatable :: place(:)
    real(wp) :: spacing(2)

    call find_spacing(this%x, spacing(1), place)
    call find_spacing(this%y, spacing(2), place)
    is_even = all(spacing >= 0.0_wp)
  end function is_even

  !> Spacing of evenly spaced coordinates of which some may be missing (so the smallest gap), and
  !> the place of each on that grid, from 1. `spacing` is 0 for a single coordinate and -1 when
  !> they are not even (or more than MOST_STEPS apart).
  pure subroutine find_spacing(coordinates, spacing, place)
    !> x or y of the lattice.
    real(wp), intent(in) :: coordinates(:)
    real(wp), intent(out) :: spacing
    integer, allocatable, intent(out) :: place(:)
    real(wp) :: steps(size(coordinates)), extent
    integer :: n

    n = size(coordinates)
    allocate (place(n))
    place = 1
    spacing = 0.0_wp
    if (n < 2) return
    extent = coordinates(n) - coordinates(1)
    spacing = minval(coordinates(2:) - coordinates(:n - 1))
    if (extent > MOST_STEPS*spacing) then
      spacing = -1.0_wp
      return
    end if
    ! The mean over whole steps, so that the rounding of one gap does not add up.
    spacing = extent/anint(extent/spacing)
    steps = (coordinates - coordinates(1))/spacing
    place = nint(steps) + 1
    if (any(abs(steps - anint(steps)) > SPACING_TOLERANCE)) spacing = -1.0_wp
  end subroutine find_spacing
end module sg_lattice
