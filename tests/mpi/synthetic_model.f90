!> A member that costs next to nothing: a hash of (case, id) as its row, random delays so that the
!> order of execution changes from run to run, and a failure now and then.
module synthetic_model
  use sg_kinds, only: i8, sp, wp
  use sg_member_model, only: member_model_t
  use sg_monitor, only: GO_ON, monitor_t, OUT_OF_TIME
  use sg_outcome, only: COLUMN_COUNT, COLUMNS, outcome_t, reset_outcome, RUNOUT_Q995, SECONDS, &
    STATUS_ABANDONED, STATUS_RUNAWAY, STATUS_TIME_LIMIT
  use sg_posix, only: sleep_seconds
  use sg_timer, only: wall_seconds
  implicit none
  private

  public :: synthetic_model_t, expected_outcome, PROFILE_COLUMNS

  integer, parameter :: PROFILE_COLUMNS = 7

  type, extends(member_model_t) :: synthetic_model_t
    !> Longest delay of a member in s.
    real(wp) :: delay = 0.004_wp
    !> Member of each case that takes a tenth of a second longer; 0 for none.
    integer(i8) :: slow_id = 0
  contains
    procedure :: run
  end type synthetic_model_t

contains

  subroutine run(this, case_index, id, monitor, outcome)
    class(synthetic_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(out) :: outcome
    real(wp) :: start, delay
    integer :: answer

    call random_number(delay)
    delay = delay*this%delay
    if (id == this%slow_id) delay = delay + 0.1_wp
    start = wall_seconds()
    call expected_outcome(case_index, id, outcome)
    do while (wall_seconds() - start < delay)
      answer = monitor%ask()
      if (answer == OUT_OF_TIME) outcome%status = STATUS_TIME_LIMIT
      if (answer /= GO_ON .and. answer /= OUT_OF_TIME) outcome%status = STATUS_ABANDONED
      if (answer /= GO_ON) exit
      call sleep_seconds(0.0005_wp)
    end do
    outcome%values(SECONDS) = wall_seconds() - start
  end subroutine run

  !> What `run` gives, apart from `seconds`, which is 0 here.
  subroutine expected_outcome(case_index, id, outcome)
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(outcome_t), intent(out) :: outcome
    integer :: i

    call reset_outcome(outcome, case_index, id, PROFILE_COLUMNS)
    do i = 1, COLUMN_COUNT
      outcome%values(i) = mixed(case_index, id, i)
      if (COLUMNS(i)%is_integer) outcome%values(i) = real(int(100.0_wp*outcome%values(i)), wp)
    end do
    do i = 1, PROFILE_COLUMNS
      outcome%height(i) = real(mixed(case_index, id, 100 + i), sp)
    end do
    outcome%values(SECONDS) = 0.0_wp
    if (mod(id, 11_i8) == 3) then
      outcome%status = STATUS_RUNAWAY
      outcome%reason = 'point 17 ran away, on purpose'
    end if
  end subroutine expected_outcome

  !> Something between 0 and 1 that looks random.
  pure function mixed(case_index, id, column) result(value)
    integer, intent(in) :: case_index, column
    integer(i8), intent(in) :: id
    real(wp) :: value
    integer(i8) :: state
    integer :: i

    state = mod(case_index*7919_i8 + id*104729_i8 + column*1299709_i8, 2147483647_i8)
    do i = 1, 3
      state = mod(state*16807_i8 + 1, 2147483647_i8)
    end do
    value = real(state, wp)/2147483647.0_wp
  end function mixed
end module synthetic_model
