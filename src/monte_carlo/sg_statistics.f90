!> Statistics of a running ensemble, with intervals of 95 %.
!>
!> Intervals take `members` as [members of a group, groups], groups being independent of one
!> another: groups of one member, or the pairs of antithetic sampling.
module sg_statistics
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use sg_kinds, only: i8, wp
  use sg_sorting, only: sort_index
  use sg_special_functions, only: student_quantile
  implicit none
  private

  public :: sample_statistics_t, describe, contiguous_prefix
  public :: whole_groups, mean_interval, sd_interval, share_interval

  !> Phi^-1(0.975).
  real(wp), parameter :: NORMAL_QUANTILE_975 = 1.959963984540054_wp
  !> Fewest groups of which an interval of the sd is told.
  integer, parameter :: FEWEST_FOR_SD = 8

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

  !> Groups of `group_size` members one after another of which all are `usable`, [group_size,
  !> groups]; an incomplete last one is left out.
  pure function whole_groups(values, usable, group_size) result(members)
    real(wp), intent(in) :: values(:)
    logical, intent(in) :: usable(:)
    integer, intent(in) :: group_size
    real(wp), allocatable :: members(:, :)
    logical :: whole(size(values)/group_size)

    associate (g => group_size, n => group_size*size(whole))
      whole = all(reshape(usable(:n), [g, size(whole)]), dim=1)
      members = reshape(pack(values(:n), reshape(spread(whole, 1, g), [n])), [g, count(whole)])
    end associate
  end function whole_groups

  !> Interval of the mean by Student's t, over the means of the groups; without end for one group.
  pure function mean_interval(members) result(interval)
    real(wp), intent(in) :: members(:, :)
    real(wp) :: interval(2)
    type(sample_statistics_t) :: statistics
    logical :: all_of(size(members, 2))

    all_of = .true.
    statistics = describe(sum(members, dim=1)/size(members, 1), all_of)
    interval = statistics%mean + statistics%half_width*[-1.0_wp, 1.0_wp]
  end function mean_interval

  !> Interval of the standard deviation by Bonett, Computational Statistics & Data Analysis 50
  !> (2006) 775-782, which needs no normal distribution: that of the variance is exp(ln(c s^2) +-
  !> z se). His kurtosis n sum d^4/(sum d^2)^2 is taken of the mean squares of groups, which for
  !> groups of one are the squares themselves. Without end for fewer than 8 groups, a point where
  !> all values are equal.
  function sd_interval(members) result(interval)
    real(wp), intent(in) :: members(:, :)
    real(wp) :: interval(2)
    real(wp) :: values(size(members))
    real(wp) :: squares, kurtosis, centre, c, se
    integer :: n, trimmed

    n = size(members, 2)
    interval = [0.0_wp, huge(1.0_wp)]
    if (n < FEWEST_FOR_SD) return
    values = reshape(members, [size(members)])
    squares = sum((values - sum(values)/size(values))**2)
    interval = 0.0_wp
    if (.not. squares > 0.0_wp) return
    ! d is counted from the mean without the outermost values.
    trimmed = floor(size(values)/(2.0_wp*sqrt(size(values) - 4.0_wp)))
    values = values(sort_index(values))
    centre = sum(values(trimmed + 1:size(values) - trimmed))/(size(values) - 2*trimmed)
    kurtosis = n*sum(sum((members - centre)**2, dim=1)**2)/squares**2
    c = n/(n - NORMAL_QUANTILE_975)
    se = c*sqrt((kurtosis - (n - 3.0_wp)/n)/(n - 1))
    interval = sqrt(c*squares/(size(values) - 1))* &
      exp(0.5_wp*NORMAL_QUANTILE_975*se*[-1.0_wp, 1.0_wp])
  end function sd_interval

  !> Interval of a probability by Wilson (1927), from the members for which it `holds`. Groups of
  !> several count as the number of independent members that has the variance of their means; in
  !> that variance, a group more in which it holds and one in which it does not keep what has not
  !> been seen yet from passing for impossible.
  pure function share_interval(holds) result(interval)
    logical, intent(in) :: holds(:, :)
    real(wp) :: interval(2)
    real(wp) :: means(size(holds, 2) + 2)
    real(wp) :: share, n, z

    share = real(count(holds), wp)/size(holds)
    n = real(size(holds), wp)
    if (size(holds, 1) > 1) then
      means = [real(count(holds, dim=1), wp)/size(holds, 1), 0.0_wp, 1.0_wp]
      associate (middle => sum(means)/size(means))
        n = middle*(1.0_wp - middle)*size(means)*(size(means) - 1)/sum((means - middle)**2)
      end associate
    end if
    z = NORMAL_QUANTILE_975
    interval = (share + 0.5_wp*z**2/n + z*sqrt(share*(1.0_wp - share)/n + (0.5_wp*z/n)**2)* &
      [-1.0_wp, 1.0_wp])/(1.0_wp + z**2/n)
  end function share_interval
end module sg_statistics
