!> Rank 0 of an ensemble: keeps each member in journal and memory, tells of progress, rewrites
!> ensemble.h5 now and then and decides when the run has to end.
module sg_director
  use sg_case_watch, only: case_watch_t
  use sg_ensemble, only: case_results_t, run_record_t, write_ensemble
  use sg_errors, only: error_t
  use sg_journal, only: journal_t
  use sg_kinds, only: i8, wp
  use sg_outcome, only: outcome_t, RUNOUT_Q995, SECONDS, STATUS_OK, status_text
  use sg_plan, only: plan_t
  use sg_posix, only: caught_signal, file_exists
  use sg_progress, only: json_text, progress_t
  use sg_scheduler, only: CARRY_ON, director_t, FINISH_STARTED, STOP_NOW
  use sg_statistics, only: contiguous_prefix, describe, mean_interval, sample_statistics_t, &
    whole_groups
  use sg_text, only: to_text
  use sg_timer, only: wall_seconds
  implicit none
  private

  public :: ensemble_director_t

  type, extends(director_t) :: ensemble_director_t
    type(plan_t) :: plan
    type(journal_t) :: journal
    type(progress_t) :: progress
    type(run_record_t) :: record
    type(case_results_t), allocatable :: results(:)
    !> Ends cases early; the plan and the results then go as far as the member they end with.
    type(case_watch_t) :: watch
    character(len=:), allocatable :: directory
    !> Wall clock of the start and, if the run has a limit, of its end; 0 = none.
    real(wp) :: start = 0.0_wp, deadline = 0.0_wp
    real(wp) :: report_seconds = 30.0_wp
    !> Members computed since the start of this program.
    integer(i8) :: fresh = 0
    !> Why the run ends early; not allocated while it does not.
    character(len=:), allocatable :: stop_reason
    !> The first error of keeping results: the run ends.
    type(error_t), allocatable :: error
    real(wp) :: last_report = 0.0_wp, last_write = 0.0_wp, last_look = 0.0_wp
    real(wp) :: write_cost = 0.0_wp, longest = 0.0_wp
    real(wp) :: last_sync = 0.0_wp, sync_cost = 0.0_wp
  contains
    procedure :: accept
    procedure :: decide
    procedure :: wants
    procedure :: keep
    procedure :: tell_rule
    procedure :: report
    procedure :: running_text
    procedure :: write_results
    procedure :: sync_journal
    procedure :: count_members
    procedure :: prefix_of
    procedure :: statistics_of
  end type ensemble_director_t

  !> Between two looks at the file STOP, in s.
  real(wp), parameter :: LOOK_EVERY = 1.0_wp
  !> ensemble.h5 and the sync of the journal may take these shares of the time.
  real(wp), parameter :: WRITE_SHARE = 0.02_wp, SYNC_SHARE = 0.05_wp
  !> Kept free before the wall clock limit for the end of the run, in s.
  real(wp), parameter :: END_MARGIN = 1.0_wp

contains

  !> A member that was just computed: into the journal, whose sync `decide` waits for.
  subroutine accept(this, outcome)
    class(ensemble_director_t), intent(inout) :: this
    type(outcome_t), intent(in) :: outcome
    logical :: ended

    if (allocated(this%error)) return
    call this%journal%add(outcome, this%error)
    if (allocated(this%error)) return
    ended = this%results(outcome%case_index)%stop_rule_met
    call this%keep(outcome)
    this%fresh = this%fresh + 1
    if (this%results(outcome%case_index)%stop_rule_met .and. .not. ended) then
      call this%sync_journal()
      call this%tell_rule(outcome%case_index)
    end if
    if (outcome%status == STATUS_OK .and. outcome%reason == '') return
    associate (label => this%results(outcome%case_index)%label)
      if (outcome%status == STATUS_OK) then
        call this%progress%say('member '//to_text(outcome%id)//' of '//label//': '//outcome%reason)
        return
      end if
      call this%progress%say('member '//to_text(outcome%id)//' of '//label//' failed ('// &
        status_text(outcome%status)//'): '//outcome%reason)
      call this%progress%tell('member_failed', '"case":'//json_text(label)//',"id":'// &
        to_text(outcome%id)//',"status":'//to_text(outcome%status)//',"reason":'// &
        json_text(outcome%reason))
    end associate
  end subroutine accept

  !> Into memory only; members outside the plan (of a longer run before, or beyond the end of a case
  !> that a rule has ended) stay in the journal.
  subroutine keep(this, outcome)
    class(ensemble_director_t), intent(inout) :: this
    type(outcome_t), intent(in) :: outcome

    if (.not. this%plan%holds(outcome%case_index, outcome%id)) return
    associate (results => this%results(outcome%case_index))
      call results%put(outcome)
      call this%watch%look(outcome%case_index, results)
      this%plan%cases(outcome%case_index)%member_count = size(results%present)
    end associate
    if (outcome%values(SECONDS) > this%longest) this%longest = outcome%values(SECONDS)
  end subroutine keep

  !> Members of the plan: where a case has ended, no further ones.
  logical function wants(this, case_index, id) result(wanted)
    class(ensemble_director_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id

    wanted = this%plan%holds(case_index, id)
  end function wants

  !> What the rule says of a case, if any looks at it.
  subroutine tell_rule(this, case_index)
    class(ensemble_director_t), intent(inout) :: this
    integer, intent(in) :: case_index
    character(len=:), allocatable :: text

    text = this%watch%in_words(case_index, this%results(case_index))
    if (text == '') return
    associate (label => this%results(case_index)%label)
      call this%progress%say(label//': '//text)
      call this%progress%tell('stop_rule', '"case":'//json_text(label)//','// &
        this%watch%as_json(case_index))
    end associate
  end subroutine tell_rule

  function decide(this) result(decision)
    class(ensemble_director_t), intent(inout) :: this
    integer :: decision
    real(wp) :: now, left
    type(error_t), allocatable :: error

    decision = CARRY_ON
    now = wall_seconds()
    if (now - this%last_sync >= this%sync_cost/SYNC_SHARE) call this%sync_journal()
    if (allocated(this%error)) then
      this%stop_reason = this%error%message
      decision = STOP_NOW
    else if (caught_signal() /= 0) then
      this%stop_reason = 'signal '//to_text(caught_signal())
      decision = STOP_NOW
    else if (now - this%last_look >= LOOK_EVERY) then
      this%last_look = now
      if (file_exists(this%directory//'/STOP')) then
        this%stop_reason = 'the file STOP'
        decision = STOP_NOW
      end if
    end if
    if (decision == STOP_NOW) return
    if (this%deadline > 0.0_wp) then
      left = this%deadline - now - END_MARGIN - 2.0_wp*this%write_cost
      if (left <= 0.0_wp) decision = STOP_NOW
      if (left > 0.0_wp .and. left < 1.1_wp*this%longest) decision = FINISH_STARTED
      if (decision /= CARRY_ON) this%stop_reason = 'the wall clock limit'
    end if
    ! Members that other ranks hold in advance are not needed.
    if (this%watch%is_over(this%results)) decision = max(decision, FINISH_STARTED)
    if (now - this%last_report >= this%report_seconds) call this%report()
    if (now - this%last_write >= max(this%report_seconds, this%write_cost/WRITE_SHARE)) then
      call this%write_results(error)
      if (allocated(error)) call move_alloc(error, this%error)
    end if
  end function decide

  !> A line of progress.
  subroutine report(this)
    class(ensemble_director_t), intent(inout) :: this
    integer(i8) :: done, expected, failed

    call this%sync_journal()
    call this%count_members(done, failed)
    this%last_report = wall_seconds()
    expected = this%plan%total()
    if (.not. this%plan%is_part()) expected = this%watch%forecast(this%results)
    call this%progress%report(done, this%plan%total(), expected, failed, this%fresh, &
      this%last_report - this%start, this%running_text())
  end subroutine report

  !> Mean of the 99.5 % runout with its 95 % interval, in the study case that has come farthest,
  !> over its ids without a gap.
  function running_text(this) result(text)
    class(ensemble_director_t), intent(in) :: this
    character(len=:), allocatable :: text
    type(sample_statistics_t) :: s
    integer :: i, n, best, most

    best = 1
    most = 0
    do i = 1, size(this%results)
      n = this%prefix_of(i)
      if (n == 0 .or. n < most) cycle
      if (n == most .and. this%results(best)%role /= 'homogeneous') cycle
      best = i
      most = n
    end do
    text = ''
    if (most == 0) return
    s = this%statistics_of(best)
    if (s%count == 0) return
    text = ', runout_q995 of '//this%results(best)%label//' '//to_text(s%mean, 5)
    if (s%half_width < huge(1.0_wp)) text = text//' +- '//to_text(s%half_width, 2)
    text = text//' m (95 %, n='//to_text(s%count)//')'
  end function running_text

  !> Members of a case without a gap, from the first that this run is to compute.
  pure integer function prefix_of(this, case_index)
    class(ensemble_director_t), intent(in) :: this
    integer, intent(in) :: case_index

    associate (range => this%plan%range_of(case_index))
      prefix_of = contiguous_prefix(this%results(case_index)%present(range(1):range(2)))
    end associate
  end function prefix_of

  !> Of the 99.5 % runout of these members; nothing of weighted ones.
  pure function statistics_of(this, case_index) result(statistics)
    class(ensemble_director_t), intent(in) :: this
    integer, intent(in) :: case_index
    type(sample_statistics_t) :: statistics
    integer(i8) :: first, last

    if (this%record%sampling == 'importance') return
    associate (r => this%results(case_index), range => this%plan%range_of(case_index))
      first = range(1)
      last = first + this%prefix_of(case_index) - 1
      associate (values => r%values(RUNOUT_Q995, first:last), &
        good => r%status(first:last) == STATUS_OK)
        statistics = describe(values, good)
        if (this%record%sampling == 'antithetic' .and. r%role /= 'homogeneous' .and. &
          modulo(first, 2_i8) == 1) call take_pairs(values, good, statistics)
      end associate
    end associate
  end function statistics_of

  !> The interval of the mean by antithetic pairs, which are what is independent.
  pure subroutine take_pairs(values, good, statistics)
    real(wp), intent(in) :: values(:)
    logical, intent(in) :: good(:)
    type(sample_statistics_t), intent(inout) :: statistics
    real(wp), allocatable :: pairs(:, :)
    real(wp) :: interval(2)

    allocate (pairs, source=whole_groups(values, good, 2))
    interval = mean_interval(pairs)
    statistics%half_width = huge(1.0_wp)
    if (size(pairs, 2) > 1) statistics%half_width = 0.5_wp*(interval(2) - interval(1))
  end subroutine take_pairs

  !> Puts on disk, at once, all members that came in since the last time. Nothing is told of a
  !> member, in a line of progress or in ensemble.h5, before.
  subroutine sync_journal(this)
    class(ensemble_director_t), intent(inout) :: this
    real(wp) :: begin

    if (allocated(this%error) .or. .not. this%journal%is_dirty()) return
    begin = wall_seconds()
    call this%journal%sync(this%error)
    this%last_sync = wall_seconds()
    this%sync_cost = this%last_sync - begin
  end subroutine sync_journal

  subroutine write_results(this, error)
    class(ensemble_director_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: begin

    call this%sync_journal()
    if (allocated(this%error)) then
      error = this%error
      return
    end if
    begin = wall_seconds()
    call write_ensemble(this%directory, this%record, this%results, error)
    this%last_write = wall_seconds()
    this%write_cost = this%last_write - begin
  end subroutine write_results

  !> Members that this run is to compute and that are there, and how many of them failed.
  subroutine count_members(this, done, failed)
    class(ensemble_director_t), intent(in) :: this
    integer(i8), intent(out) :: done, failed
    integer :: i

    done = 0
    failed = 0
    do i = 1, size(this%results)
      associate (r => this%results(i), range => this%plan%range_of(i))
        done = done + count(r%present(range(1):range(2)), kind=i8)
        failed = failed + count(r%present(range(1):range(2)) .and. &
          r%status(range(1):range(2)) /= STATUS_OK, kind=i8)
      end associate
    end do
  end subroutine count_members
end module sg_director
