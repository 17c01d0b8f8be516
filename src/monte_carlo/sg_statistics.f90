!> Statistics of a running ensemble.
module sg_statistics
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use sg_kinds, only: i8, wp
  use sg_special_functions, only: student_quantile
  implicit none
  private

  public :: sample_statistics_t, describe, contiguous_prefix

  type :: sample_statistics_t
    integer(i8) :: count = 0
    !> sd with n - 1; 0 for one value.
    real(wp) :: mean = 0.0_wp, sd = 0.0_wp
    !> Half-width of the 95 % interval of the mean, t(0.975, n - 1) sd/sqrt(n); huge for n < 2.
    real(wp) :: half_width = huge(1.0_wp)
  end type sample_statistics_t

contains

  !> Statistics of the `values` that are finite and marked in `wanted` (same shape). Two passes, in
  !> the order of the array: the same on any number of ranks.
  pure function describe(values, wanted) result(statistics)
    real(wp), intent(in) :: values(:)
    logical, intent(in) :: wanted(:)
    type(sample_statistics_t) :: statistics
    logical :: good(size(values))

    good = wanted .and. ieee_is_finite(values)
    associate (n => statistics%count)
      n = count(good, kind=i8)
      if (n == 0) return
      statistics%mean = sum(values, mask=good)/n
      if (n == 1) return
      statistics%sd = sqrt(sum((values - statistics%mean)**2, mask=good)/(n - 1))
      statistics%half_width = student_quantile(0.975_wp, real(n - 1, wp))*statistics%sd/ &
                              sqrt(real(n, wp))
    end associate
  end function describe

  !> Number of ids from 1 on without a gap. Statistics of an unfinished ensemble use these alone:
  !> members that finish late (long runouts) must not drop out first.
  pure function contiguous_prefix(present) result(length)
    logical, intent(in) :: present(:)
    integer :: length

    do length = 0, size(present) - 1
      if (.not. present(length + 1)) return
    end do
  end function contiguous_prefix
end module sg_statistics
