!> The rule that ends a case before its last realization. It is looked at after `minimum` members
!> and after each further batch, on the ids from 1 on without a gap, and what it says there depends
!> on those members alone: a case ends at the same member on any number of ranks and after any
!> interruption. Long runs, which come late, hold it back instead of dropping out.
!>
!> Failed members count as ids, not as values.
module sg_stop_rule
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use sg_config, only: monte_carlo_config_t
  use sg_kinds, only: wp
  use sg_outcome, only: COLUMN_COUNT, COLUMNS, RUNOUT_Q995
  use sg_statistics, only: describe, mean_interval, sample_statistics_t, sd_interval, &
    share_interval, whole_groups
  use sg_text, only: to_text
  implicit none
  private

  public :: stop_rule_t, judgement_t, make_stop_rule
  public :: RULE_COUNT, RULE_PRECISION, RULE_SUCCESSIVE
  public :: STATISTIC_MEAN, STATISTIC_SD, STATISTIC_EXCEEDANCE

  !> All realizations; a narrow interval of 95 %; small changes by the last member.
  integer, parameter :: RULE_COUNT = 1, RULE_PRECISION = 2, RULE_SUCCESSIVE = 3
  integer, parameter :: STATISTIC_MEAN = 1, STATISTIC_SD = 2, STATISTIC_EXCEEDANCE = 3

  type :: stop_rule_t
    integer :: rule = RULE_COUNT
    integer :: statistic = STATISTIC_MEAN
    !> The runout, a position in COLUMNS of sg_outcome.
    integer :: column = RUNOUT_Q995
    !> In m, for STATISTIC_EXCEEDANCE.
    real(wp) :: threshold = 0.0_wp
    !> Half-width asked for, or its share of the estimate; of RULE_SUCCESSIVE the change of the mean
    !> in m and of the variance in m^2.
    real(wp) :: tolerance = 0.0_wp
    logical :: is_relative = .false.
    !> 2: members 2k - 1 and 2k are an antithetic pair.
    integer :: group_size = 1
    !> Members before the first look and between two looks.
    integer :: minimum = 50, batch = 10
    !> Members after which a case ends in any event.
    integer :: most = huge(1)
  contains
    procedure :: follow
    procedure :: judge
    procedure :: in_words
    procedure :: statistic_in_words
    procedure, private :: check_precision
    procedure, private :: check_successive
  end type stop_rule_t

  !> What a look at the members of a case has found.
  type :: judgement_t
    !> The members looked at, ids from 1 on; 0: no look yet.
    integer :: members = 0
    logical :: is_met = .false.
    !> The statistic and its interval of 95 %, in m or 1; of RULE_SUCCESSIVE the mean alone.
    real(wp) :: estimate = 0.0_wp, interval(2) = huge(1.0_wp)*[-1.0_wp, 1.0_wp]
    !> Half the interval and what was asked for; of RULE_SUCCESSIVE the larger of the two changes
    !> (m, m^2) and its tolerance.
    real(wp) :: half_width = huge(1.0_wp), target = 0.0_wp
    !> Members that the case will have in the end, by what is known now.
    integer :: forecast = 0
  end type judgement_t

contains

  pure function make_stop_rule(config) result(rule)
    type(monte_carlo_config_t), intent(in) :: config
    type(stop_rule_t) :: rule
    integer :: k

    rule%most = config%realizations
    select case (config%stop_rule)
    case ('precision')
      rule%rule = RULE_PRECISION
      rule%is_relative = size(config%relative_half_width) > 0
      if (rule%is_relative) then
        rule%tolerance = config%relative_half_width(1)
      else
        rule%tolerance = config%half_width(1)
      end if
      if (config%stop_statistic == 'sd') rule%statistic = STATISTIC_SD
      if (config%stop_statistic == 'exceedance') rule%statistic = STATISTIC_EXCEEDANCE
      rule%threshold = config%stop_threshold
      if (config%sampling == 'antithetic') rule%group_size = 2
    case ('successive')
      rule%rule = RULE_SUCCESSIVE
      rule%tolerance = config%successive_tolerance
    case default
      return
    end select
    rule%minimum = config%stop_minimum
    rule%batch = config%stop_batch
    do k = 1, COLUMN_COUNT
      if (COLUMNS(k)%name == config%stop_runout) rule%column = k
    end do
  end function make_stop_rule

  !> Takes up all looks that have become due, until the rule is met. `judgement` is that of the last
  !> look before, or a fresh one.
  subroutine follow(this, values, good, judgement)
    class(stop_rule_t), intent(in) :: this
    !> Of the ids from 1 on without a gap, in m.
    real(wp), intent(in) :: values(:)
    !> Members that did not fail.
    logical, intent(in) :: good(:)
    type(judgement_t), intent(inout) :: judgement
    integer :: next

    if (this%rule == RULE_COUNT) return
    do while (.not. judgement%is_met)
      next = judgement%members + this%batch
      if (judgement%members == 0) next = this%minimum
      if (next > size(values)) return
      judgement = this%judge(values(:next), good(:next))
    end do
  end subroutine follow

  !> One look, at all these members.
  function judge(this, values, good) result(judgement)
    class(stop_rule_t), intent(in) :: this
    real(wp), intent(in) :: values(:)
    logical, intent(in) :: good(:)
    type(judgement_t) :: judgement
    logical :: usable(size(values))
    real(wp) :: needed

    judgement%members = size(values)
    judgement%forecast = this%most
    usable = good .and. ieee_is_finite(values)
    if (this%rule == RULE_PRECISION) then
      call this%check_precision(values, usable, judgement, needed)
    else
      call this%check_successive(values, usable, judgement, needed)
    end if
    if (judgement%is_met) then
      judgement%forecast = size(values)
    else if (needed < real(this%most, wp)) then
      ! The next look after that many.
      judgement%forecast = min(this%most, size(values) + this%batch*max(1, &
        ceiling((needed - size(values))/this%batch)))
    end if
  end function judge

  !> The width of an interval falls with the root of the number of members.
  subroutine check_precision(this, values, usable, judgement, needed)
    class(stop_rule_t), intent(in) :: this
    real(wp), intent(in) :: values(:)
    logical, intent(in) :: usable(:)
    type(judgement_t), intent(inout) :: judgement
    real(wp), intent(out) :: needed
    real(wp), allocatable :: members(:, :)
    type(sample_statistics_t) :: statistics

    needed = huge(1.0_wp)
    allocate (members, source=whole_groups(values, usable, this%group_size))
    if (size(members, 2) < 2) return
    statistics = describe(reshape(members, [size(members)]), spread(.true., 1, size(members)))
    select case (this%statistic)
    case (STATISTIC_SD)
      judgement%estimate = statistics%sd
      judgement%interval = sd_interval(members)
    case (STATISTIC_EXCEEDANCE)
      judgement%estimate = real(count(members > this%threshold), wp)/size(members)
      judgement%interval = share_interval(members > this%threshold)
    case default
      judgement%estimate = statistics%mean
      judgement%interval = mean_interval(members)
    end select
    judgement%half_width = 0.5_wp*judgement%interval(2) - 0.5_wp*judgement%interval(1)
    judgement%target = this%tolerance
    if (this%is_relative) judgement%target = this%tolerance*abs(judgement%estimate)
    judgement%is_met = judgement%half_width <= judgement%target
    if (.not. judgement%target > 0.0_wp) return
    if (judgement%half_width < sqrt(huge(1.0_wp))*judgement%target) needed = &
      size(values)*(judgement%half_width/judgement%target)**2
  end subroutine check_precision

  !> The last member changes the mean of k by about sd/k, the variance by about sd^2/k.
  subroutine check_successive(this, values, usable, judgement, needed)
    class(stop_rule_t), intent(in) :: this
    real(wp), intent(in) :: values(:)
    logical, intent(in) :: usable(:)
    type(judgement_t), intent(inout) :: judgement
    real(wp), intent(out) :: needed
    type(sample_statistics_t) :: before, now
    integer :: last

    needed = huge(1.0_wp)
    last = findloc(usable, .true., dim=1, back=.true.)
    before = describe(values(:last - 1), usable(:last - 1))
    if (last == 0 .or. before%count < 2) return
    now = describe(values(:last), usable(:last))
    judgement%estimate = now%mean
    judgement%half_width = max(abs(now%mean - before%mean), abs(now%sd**2 - before%sd**2))
    judgement%target = this%tolerance
    judgement%is_met = judgement%half_width < judgement%target
    needed = max(now%sd, now%sd**2)/this%tolerance
  end subroutine check_successive

  !> For people: when a case ends.
  function in_words(this) result(text)
    class(stop_rule_t), intent(in) :: this
    character(len=:), allocatable :: text

    select case (this%rule)
    case (RULE_PRECISION)
      text = 'precision: a case ends once the 95 % interval of '//this%statistic_in_words()// &
        ' is within +-'
      if (this%is_relative) then
        text = text//to_text(100.0_wp*this%tolerance, 6)//' % of it'
      else
        text = text//to_text(this%tolerance)//unit_of(this)
      end if
    case (RULE_SUCCESSIVE)
      text = 'successive: a case ends once its last member changes '//this%statistic_in_words()// &
        ' by less than '//to_text(this%tolerance)//' (m, m^2), which bounds no error'
    case default
      text = 'count: a case ends with its last realization'
      return
    end select
    text = text//'; looked at from '//to_text(this%minimum)//' members on, every '// &
      to_text(this%batch)
  end function in_words

  !> What the rule looks at, as `the mean of runout_q995`.
  function statistic_in_words(this) result(text)
    class(stop_rule_t), intent(in) :: this
    character(len=:), allocatable :: text
    character(len=:), allocatable :: runout

    runout = trim(COLUMNS(this%column)%name)
    if (this%rule == RULE_SUCCESSIVE) then
      text = 'mean and variance of '//runout
    else if (this%statistic == STATISTIC_EXCEEDANCE) then
      text = 'P('//runout//' > '//to_text(this%threshold)//' m)'
    else if (this%statistic == STATISTIC_SD) then
      text = 'the sd of '//runout
    else
      text = 'the mean of '//runout
    end if
  end function statistic_in_words

  !> Unit of an absolute half-width.
  pure function unit_of(rule) result(unit)
    type(stop_rule_t), intent(in) :: rule
    character(len=:), allocatable :: unit

    unit = ' m'
    if (rule%statistic == STATISTIC_EXCEEDANCE) unit = ''
  end function unit_of
end module sg_stop_rule
