!> From a field on fine points to the same field on coarser ones: its mean over the domain of each.
!> So grids of different cells see one ground, as comparisons between them and two-level estimators
!> need (Giles 2015, Multilevel Monte Carlo methods, section 2).
module sg_restriction
  use sg_kinds, only: wp
  implicit none
  private

  public :: restriction_t

  !> A sparse matrix [coarse points, fine points] whose rows sum to 1.
  type :: restriction_t
    !> Entries of coarse point i: `first(i)` to `first(i + 1) - 1`.
    integer, allocatable :: first(:)
    integer, allocatable, private :: fine(:)
    real(wp), allocatable, private :: weight(:)
  contains
    procedure :: init
    procedure :: apply
  end type restriction_t

contains

  !> Weights are the areas that the rectangles of the fine points have in common with that of the
  !> coarse one. One that meets none (at a ragged edge) takes the nearest. All in m.
  subroutine init(this, fine_x, fine_y, fine_width, fine_height, x, y, width, height)
    class(restriction_t), intent(out) :: this
    !> [fine points], at least one.
    real(wp), intent(in) :: fine_x(:), fine_y(:), fine_width(:), fine_height(:)
    !> [coarse points]
    real(wp), intent(in) :: x(:), y(:), width(:), height(:)
    integer, allocatable :: start(:), member(:)
    real(wp) :: size_of(2), corner(2), area
    integer :: buckets(2), i, j, k, bx, by, low(2), high(2), used, pass

    ! Fine points by square buckets, so that each coarse one looks at its neighbours alone.
    size_of = [max(maxval(fine_width), maxval(width)), max(maxval(fine_height), maxval(height))]
    corner = [minval(fine_x), minval(fine_y)]
    buckets = 1 + int([maxval(fine_x) - corner(1), maxval(fine_y) - corner(2)]/size_of)
    call sort_into_buckets(bucket_of(fine_x, fine_y), product(buckets), start, member)
    allocate (this%first(size(x) + 1))
    do pass = 1, 2 ! count, then fill
      used = 0
      do i = 1, size(x)
        this%first(i) = used + 1
        low = max(int([x(i) - corner(1), y(i) - corner(2)]/size_of), 1) - 1
        high = min(int([x(i) - corner(1), y(i) - corner(2)]/size_of) + 1, buckets - 1)
        do by = low(2), high(2)
          do bx = low(1), high(1)
            do k = start(1 + bx + buckets(1)*by), start(2 + bx + buckets(1)*by) - 1
              j = member(k)
              area = overlap(x(i), width(i), fine_x(j), fine_width(j)) &
                *overlap(y(i), height(i), fine_y(j), fine_height(j))
              if (.not. area > 1.0e-9_wp*width(i)*height(i)) cycle
              used = used + 1
              if (pass == 1) cycle
              this%fine(used) = j
              this%weight(used) = area
            end do
          end do
        end do
        if (used < this%first(i)) then
          used = used + 1
          if (pass == 2) then
            this%fine(used) = minloc((fine_x - x(i))**2 + (fine_y - y(i))**2, dim=1)
            this%weight(used) = 1.0_wp
          end if
        end if
        if (pass == 2) this%weight(this%first(i):used) = this%weight(this%first(i):used) &
          /sum(this%weight(this%first(i):used))
      end do
      this%first(size(x) + 1) = used + 1
      if (pass == 1) allocate (this%fine(used), this%weight(used))
    end do

  contains

    elemental integer function bucket_of(px, py)
      real(wp), intent(in) :: px, py

      bucket_of = 1 + int((px - corner(1))/size_of(1)) + buckets(1)*int((py - corner(2))/size_of(2))
    end function bucket_of
  end subroutine init

  !> Members of bucket b: `member(start(b))` to `member(start(b + 1) - 1)`.
  pure subroutine sort_into_buckets(bucket, count_of, start, member)
    integer, intent(in) :: bucket(:), count_of
    integer, allocatable, intent(out) :: start(:), member(:)
    integer :: filled(count_of), i

    allocate (start(count_of + 1), member(size(bucket)))
    filled = 0
    do i = 1, size(bucket)
      filled(bucket(i)) = filled(bucket(i)) + 1
    end do
    start(1) = 1
    do i = 1, count_of
      start(i + 1) = start(i) + filled(i)
    end do
    filled = 0
    do i = 1, size(bucket)
      member(start(bucket(i)) + filled(bucket(i))) = i
      filled(bucket(i)) = filled(bucket(i)) + 1
    end do
  end subroutine sort_into_buckets

  !> Length that two intervals, given by centre and width, have in common.
  elemental real(wp) function overlap(centre, width, other, other_width)
    real(wp), intent(in) :: centre, width, other, other_width

    overlap = max(0.0_wp, min(centre + 0.5_wp*width, other + 0.5_wp*other_width) &
      - max(centre - 0.5_wp*width, other - 0.5_wp*other_width))
  end function overlap

  !> Values on the coarse points of values on the fine ones.
  pure function apply(this, values) result(coarse)
    class(restriction_t), intent(in) :: this
    real(wp), intent(in) :: values(:)
    real(wp) :: coarse(size(this%first) - 1)
    integer :: i

    do i = 1, size(coarse)
      associate (a => this%first(i), b => this%first(i + 1) - 1)
        coarse(i) = sum(this%weight(a:b)*values(this%fine(a:b)))
      end associate
    end do
  end function apply
end module sg_restriction
