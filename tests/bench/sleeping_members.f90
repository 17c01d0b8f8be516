!> Members that sleep for a known time, and a director that only counts them: for measurements of
!> the scheduler.
module sleeping_members
  use sg_ensemble, only: case_geometry_t, run_record_t
  use sg_errors, only: error_t
  use sg_journal, only: journal_t
  use sg_kinds, only: i8, wp
  use sg_member_model, only: member_model_t
  use sg_monitor, only: GO_ON, monitor_t
  use sg_outcome, only: outcome_t, reset_outcome, SECONDS, STATUS_ABANDONED
  use sg_posix, only: sleep_seconds
  use sg_scheduler, only: CARRY_ON, director_t, STOP_NOW
  use sg_timer, only: wall_seconds
  implicit none
  private

  public :: counting_director_t, make_record, make_row, row_geometry, sleeping_model_t

  !> Columns of the paper's profile.
  integer, parameter :: PROFILE_COLUMNS = 160
  !> Between two questions to the monitor, in s: about a step of the paper's column.
  real(wp), parameter :: STEP = 0.001_wp

  type, extends(member_model_t) :: sleeping_model_t
    !> In s; members take this long to five times as long.
    real(wp) :: shortest = 0.0_wp
  contains
    procedure :: run
  end type sleeping_model_t

  type, extends(director_t) :: counting_director_t
    type(journal_t) :: journal
    logical :: keeps = .false.
    type(error_t), allocatable :: error
    integer :: count = 0
    !> Sum, least and most of the times of members, in s.
    real(wp) :: busy = 0.0_wp, least = huge(1.0_wp), most = 0.0_wp
  contains
    procedure :: keep_journal
    procedure :: accept
    procedure :: decide
  end type counting_director_t

contains

  subroutine run(this, case_index, id, monitor, outcome)
    class(sleeping_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(out) :: outcome
    real(wp) :: start, length, left

    start = wall_seconds()
    call make_row(case_index, id, outcome)
    length = this%shortest*(1.0_wp + 4.0_wp*evenly_spread(id))
    do
      if (monitor%ask() /= GO_ON) outcome%status = STATUS_ABANDONED
      left = length - (wall_seconds() - start)
      if (outcome%status == STATUS_ABANDONED .or. left <= 0.0_wp) exit
      call sleep_seconds(min(left, STEP))
    end do
    outcome%values(SECONDS) = wall_seconds() - start
  end subroutine run

  !> Between 0 and 1: multiples of the golden ratio, in an order that looks random.
  pure function evenly_spread(id) result(share)
    integer(i8), intent(in) :: id
    real(wp) :: share

    share = modulo(id*0.618033988749895_wp, 1.0_wp)
    share = modulo(share*4093.0_wp, 1.0_wp)
  end function evenly_spread

  !> A row of the size that the paper's column has.
  subroutine make_row(case_index, id, outcome)
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(outcome_t), intent(out) :: outcome

    call reset_outcome(outcome, case_index, id, PROFILE_COLUMNS)
    outcome%values = 0.0_wp
    outcome%height = 0.0
  end subroutine make_row

  !> What ensemble.h5 says of such a run: the least that it wants to be said.
  subroutine make_record(record)
    type(run_record_t), intent(out) :: record

    record%case_text = '&case /'
    record%resolved = '&case /'
    record%host = ''
    record%started = ''
    record%ended = ''
    record%state = 'bench'
    record%config_hash = ''
    record%field_method = ''
    record%sampling = ''
    allocate (record%fields(0))
    record%identity = ''
    record%members = ''
  end subroutine make_record

  !> Columns of the profile, as many as the paper's grid has.
  function row_geometry() result(geometry)
    type(case_geometry_t) :: geometry
    integer :: i

    allocate (geometry%profile_x(PROFILE_COLUMNS))
    geometry%profile_x = [(0.125_wp*(i - 0.5_wp), i=1, PROFILE_COLUMNS)]
  end function row_geometry

  !> From now on rows go into a new journal in the present directory.
  subroutine keep_journal(this, error)
    class(counting_director_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error

    this%keeps = .true.
    call this%journal%open('.', error)
    if (.not. allocated(error)) call this%journal%start('bench', error)
  end subroutine keep_journal

  subroutine accept(this, outcome)
    class(counting_director_t), intent(inout) :: this
    type(outcome_t), intent(in) :: outcome

    if (this%keeps .and. .not. allocated(this%error)) call this%journal%add(outcome, this%error)
    this%count = this%count + 1
    associate (taken => outcome%values(SECONDS))
      this%busy = this%busy + taken
      this%least = min(this%least, taken)
      this%most = max(this%most, taken)
    end associate
  end subroutine accept

  function decide(this) result(decision)
    class(counting_director_t), intent(inout) :: this
    integer :: decision

    decision = CARRY_ON
    if (this%keeps .and. .not. allocated(this%error)) call this%journal%sync(this%error)
    if (allocated(this%error)) decision = STOP_NOW
  end function decide
end module sleeping_members
