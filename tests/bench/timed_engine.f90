!> The director of real runs with a clock at what it does, and members that cost nothing.
module timed_engine
  use sg_director, only: ensemble_director_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_member_model, only: member_model_t
  use sg_monitor, only: GO_ON, monitor_t
  use sg_outcome, only: outcome_t, STATUS_ABANDONED
  use sg_timer, only: wall_seconds
  use sleeping_members, only: make_row
  implicit none
  private

  public :: free_model_t, timed_director_t

  type, extends(member_model_t) :: free_model_t
  contains
    procedure :: run
  end type free_model_t

  !> Times in s: into journal and memory, sync of the journal, rewriting ensemble.h5.
  type, extends(ensemble_director_t) :: timed_director_t
    real(wp) :: keeping = 0.0_wp, syncing = 0.0_wp, writing = 0.0_wp
    integer :: syncs = 0, writes = 0
  contains
    procedure :: accept
    procedure :: sync_journal
    procedure :: write_results
  end type timed_director_t

contains

  subroutine run(this, case_index, id, monitor, outcome)
    class(free_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(out) :: outcome

    call make_row(case_index, id, outcome)
    ! Here messages are looked after, as in a member that takes longer.
    if (monitor%ask() /= GO_ON) outcome%status = STATUS_ABANDONED
  end subroutine run

  subroutine accept(this, outcome)
    class(timed_director_t), intent(inout) :: this
    type(outcome_t), intent(in) :: outcome
    real(wp) :: begin

    begin = wall_seconds()
    call this%ensemble_director_t%accept(outcome)
    this%keeping = this%keeping + wall_seconds() - begin
  end subroutine accept

  subroutine sync_journal(this)
    class(timed_director_t), intent(inout) :: this
    real(wp) :: begin

    if (.not. this%journal%is_dirty()) return
    begin = wall_seconds()
    call this%ensemble_director_t%sync_journal()
    this%syncing = this%syncing + wall_seconds() - begin
    this%syncs = this%syncs + 1
  end subroutine sync_journal

  subroutine write_results(this, error)
    class(timed_director_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: begin

    call this%sync_journal()
    begin = wall_seconds()
    call this%ensemble_director_t%write_results(error)
    this%writing = this%writing + wall_seconds() - begin
    this%writes = this%writes + 1
  end subroutine write_results
end module timed_engine
