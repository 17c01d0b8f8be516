!> Members to ranks: dynamic, two-sided, every rank works. Rank 0 computes too and serves the others
!> from inside its own member, through the monitor that the solver asks; the others hold one task in
!> advance, so that they do not wait for it.
!>
!> Rank 0 sends TASK (case, id), NO_MORE, DRAIN (finish the member in hand, forget the one in
!> advance) and ABANDON_ALL; the others send RESULT (a row), SIGNALLED and DONE. After DONE a rank
!> reads whatever still comes until BYE, so that no message is left over.
module sg_scheduler
  use sg_comm, only: comm_t
  use sg_kinds, only: i1, i8, wp
  use sg_member_model, only: member_model_t
  use sg_monitor, only: ABANDON, GO_ON, monitor_t, OUT_OF_TIME
  use sg_outcome, only: outcome_t, STATUS_ABANDONED
  use sg_outcome_bytes, only: pack_outcome, unpack_outcome
  use sg_posix, only: caught_signal, sleep_seconds
  use sg_timer, only: wall_seconds
  implicit none
  private

  public :: director_t, run_members
  public :: CARRY_ON, FINISH_STARTED, STOP_NOW

  !> Decisions of a director, each stronger than the one before.
  integer, parameter :: CARRY_ON = 0
  !> Start no member any more, finish those in hand.
  integer, parameter :: FINISH_STARTED = 1
  !> Drop the members in hand.
  integer, parameter :: STOP_NOW = 2

  !> What rank 0 does with results, and how it decides.
  type, abstract :: director_t
  contains
    procedure(accept_interface), deferred :: accept
    procedure(decide_interface), deferred :: decide
    procedure :: wants => wants_all
  end type director_t

  abstract interface
    !> Keeps a finished member.
    subroutine accept_interface(this, outcome)
      import :: director_t, outcome_t
      implicit none
      class(director_t), intent(inout) :: this
      type(outcome_t), intent(in) :: outcome
    end subroutine accept_interface

    !> Called every few milliseconds, and after members were accepted.
    function decide_interface(this) result(decision)
      import :: director_t
      implicit none
      class(director_t), intent(inout) :: this
      integer :: decision
    end function decide_interface
  end interface

  integer, parameter :: TASK = 1, NO_MORE = 2, DRAIN = 3, ABANDON_ALL = 4, BYE = 5
  integer, parameter :: RESULT_TAG = 11, SIGNALLED = 12, DONE = 13
  integer, parameter :: TASK_BYTES = 16
  !> Between two looks at messages while a member is computed, and while there is nothing to do.
  real(wp), parameter :: LOOK_EVERY = 0.005_wp, REST = 0.0005_wp
  !> Rank 0 handles at most so many messages before it syncs and decides: some 10 ms of work.
  integer, parameter :: MESSAGES_PER_LOOK = 1000

  !> What both kinds of rank share.
  type, abstract, extends(monitor_t) :: rank_monitor_t
    type(comm_t) :: comm
    real(wp) :: member_seconds = 0.0_wp
    real(wp) :: member_start = 0.0_wp, last_look = 0.0_wp
    integer :: decision = CARRY_ON
  contains
    procedure :: ask
    procedure(look_interface), deferred :: look
  end type rank_monitor_t

  abstract interface
    !> Handles all messages that wait.
    subroutine look_interface(this)
      import :: rank_monitor_t
      implicit none
      class(rank_monitor_t), intent(inout) :: this
    end subroutine look_interface
  end interface

  type, extends(rank_monitor_t) :: server_t
    class(director_t), pointer :: director => null()
    !> [2, n]: case and id, in order of execution; the next one to give.
    integer(i8), allocatable :: tasks(:, :)
    integer(i8) :: next = 1
    !> For each other rank: it has not said DONE; it was told NO_MORE; tasks it holds.
    logical, allocatable :: is_open(:), told(:)
    integer, allocatable :: held(:)
  contains
    procedure :: look => serve
    procedure :: take
    procedure :: give
    procedure :: tell
    procedure :: handle
  end type server_t

  type, extends(rank_monitor_t) :: worker_t
    integer(i8) :: queue(2, 4) = 0
    integer :: waiting = 0
    logical :: is_last = .false., said = .false., dismissed = .false.
  contains
    procedure :: look => listen
  end type worker_t

contains

  !> Collective: computes the members `tasks` (case and id, [2, n]; those of rank 0 count) and hands
  !> each to the director of rank 0. `member_seconds` > 0 limits the time of one.
  subroutine run_members(comm, tasks, director, model, member_seconds)
    type(comm_t), intent(in) :: comm
    integer(i8), intent(in) :: tasks(:, :)
    class(director_t), intent(inout), target :: director
    class(member_model_t), intent(inout) :: model
    real(wp), intent(in) :: member_seconds

    if (comm%rank() == 0) then
      call run_server(comm, tasks, director, model, member_seconds)
    else
      call run_worker(comm, model, member_seconds)
    end if
  end subroutine run_members

  subroutine run_server(comm, tasks, director, model, member_seconds)
    type(comm_t), intent(in) :: comm
    integer(i8), intent(in) :: tasks(:, :)
    class(director_t), intent(inout), target :: director
    class(member_model_t), intent(inout) :: model
    real(wp), intent(in) :: member_seconds
    type(server_t) :: server
    integer(i8) :: case_and_id(2)
    integer :: i
    logical :: found

    server%comm = comm
    server%member_seconds = member_seconds
    server%director => director
    server%tasks = tasks
    allocate (server%is_open(comm%size() - 1), server%told(comm%size() - 1))
    allocate (server%held(comm%size() - 1))
    server%is_open = .true.
    server%told = .false.
    server%held = 0
    do i = 1, comm%size() - 1
      call server%give(i)
    end do
    do
      call server%look()
      if (server%decision /= CARRY_ON) exit
      call server%take(case_and_id, found)
      if (.not. found) exit
      call run_one(server, model, case_and_id, director)
    end do
    do while (any(server%is_open))
      call server%look()
      call sleep_seconds(REST)
    end do
  end subroutine run_server

  !> A member of rank 0 itself.
  subroutine run_one(server, model, case_and_id, director)
    type(server_t), intent(inout) :: server
    class(member_model_t), intent(inout) :: model
    integer(i8), intent(in) :: case_and_id(2)
    class(director_t), intent(inout) :: director
    type(outcome_t) :: outcome

    server%member_start = wall_seconds()
    call model%run(int(case_and_id(1)), case_and_id(2), server, outcome)
    if (outcome%status /= STATUS_ABANDONED) call director%accept(outcome)
  end subroutine run_one

  !> Whether a member is still to be computed, asked when its turn has come; what is not wanted then
  !> is left out for good. Directors that end cases early have a procedure of their own.
  logical function wants_all(this, case_index, id) result(wanted)
    class(director_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id

    wanted = .true.
  end function wants_all

  !> The next task that is wanted, unless the run is ending.
  subroutine take(this, case_and_id, found)
    class(server_t), intent(inout) :: this
    integer(i8), intent(out) :: case_and_id(2)
    logical, intent(out) :: found

    case_and_id = 0
    found = .false.
    if (this%decision /= CARRY_ON) return
    do while (.not. found .and. this%next <= size(this%tasks, 2, kind=i8))
      case_and_id = this%tasks(:, this%next)
      this%next = this%next + 1
      found = this%director%wants(int(case_and_id(1)), case_and_id(2))
    end do
  end subroutine take

  !> Fills up the tasks of a rank to two, or to one near the end, where a task in advance would keep
  !> other ranks idle.
  subroutine give(this, worker)
    class(server_t), intent(inout) :: this
    integer, intent(in) :: worker
    integer(i8) :: case_and_id(2)
    logical :: found

    do while (this%held(worker) < 2 .and. .not. this%told(worker))
      if (this%held(worker) == 1 .and. &
          size(this%tasks, 2, kind=i8) - this%next < this%comm%size()) return
      call this%take(case_and_id, found)
      if (found) then
        call this%comm%send(transfer(case_and_id, [0_i1]), worker, TASK)
        this%held(worker) = this%held(worker) + 1
      else
        if (this%held(worker) == 0) call this%tell(worker, NO_MORE)
        return
      end if
    end do
  end subroutine give

  subroutine tell(this, worker, tag)
    class(server_t), intent(inout) :: this
    integer, intent(in) :: worker, tag
    integer(i1) :: nothing(0)

    call this%comm%send(nothing, worker, tag)
    this%told(worker) = .true.
  end subroutine tell

  subroutine serve(this)
    class(server_t), intent(inout) :: this
    integer :: decision, source, tag, length, i
    logical :: found
    integer, parameter :: ORDERS(FINISH_STARTED:STOP_NOW) = [DRAIN, ABANDON_ALL]

    ! Not without end: under a flood of results signals and the clock have their turn too.
    do i = 1, MESSAGES_PER_LOOK
      call this%comm%probe(found, source, tag, length)
      if (.not. found) exit
      call this%handle(source, tag, length)
    end do
    decision = max(this%decision, this%director%decide())
    if (decision == this%decision) return
    this%decision = decision
    do i = 1, size(this%is_open)
      if (this%is_open(i)) call this%tell(i, ORDERS(decision))
    end do
  end subroutine serve

  subroutine handle(this, source, tag, length)
    class(server_t), intent(inout) :: this
    integer, intent(in) :: source, tag, length
    integer(i1) :: bytes(length)
    type(outcome_t) :: outcome
    logical :: ok
    integer :: i

    call this%comm%receive(bytes, source, tag)
    select case (tag)
    case (RESULT_TAG)
      this%held(source) = this%held(source) - 1
      ! First a new task, then the slow work of keeping the result.
      call this%give(source)
      call unpack_outcome(bytes, outcome, ok)
      if (ok) call this%director%accept(outcome)
    case (SIGNALLED)
      if (this%decision == STOP_NOW) return
      this%decision = STOP_NOW
      do i = 1, size(this%is_open)
        if (this%is_open(i)) call this%tell(i, ABANDON_ALL)
      end do
    case (DONE)
      call this%tell(source, BYE)
      this%is_open(source) = .false.
    case default ! no other tag is sent to rank 0
    end select
  end subroutine handle

  subroutine run_worker(comm, model, member_seconds)
    type(comm_t), intent(in) :: comm
    class(member_model_t), intent(inout) :: model
    real(wp), intent(in) :: member_seconds
    type(worker_t) :: worker
    type(outcome_t) :: outcome
    integer(i8) :: case_and_id(2)
    integer(i1) :: nothing(0)

    worker%comm = comm
    worker%member_seconds = member_seconds
    do
      call worker%look()
      if (worker%decision == CARRY_ON .and. worker%waiting > 0) then
        case_and_id = worker%queue(:, 1)
        worker%queue(:, :3) = worker%queue(:, 2:)
        worker%waiting = worker%waiting - 1
        worker%member_start = wall_seconds()
        call model%run(int(case_and_id(1)), case_and_id(2), worker, outcome)
        if (outcome%status == STATUS_ABANDONED) cycle
        call comm%send(pack_outcome(outcome), 0, RESULT_TAG)
      else if (worker%decision /= CARRY_ON .or. worker%is_last) then
        exit
      else
        call sleep_seconds(REST)
      end if
    end do
    call comm%send(nothing, 0, DONE)
    ! Signals are not told any more: rank 0 reads nothing of this rank after DONE.
    worker%said = .true.
    do while (.not. worker%dismissed)
      call worker%look()
      call sleep_seconds(REST)
    end do
  end subroutine run_worker

  subroutine listen(this)
    class(worker_t), intent(inout) :: this
    integer :: source, tag, length
    logical :: found
    integer(i1) :: bytes(TASK_BYTES), nothing(0)

    do
      call this%comm%probe(found, source, tag, length)
      if (.not. found) exit
      call this%comm%receive(bytes(:length), source, tag)
      select case (tag)
      case (TASK)
        this%waiting = this%waiting + 1
        this%queue(:, this%waiting) = transfer(bytes, 0_i8, 2)
      case (NO_MORE)
        this%is_last = .true.
      case (DRAIN)
        this%decision = max(this%decision, FINISH_STARTED)
      case (ABANDON_ALL)
        this%decision = STOP_NOW
      case (BYE)
        this%dismissed = .true.
        exit
      case default ! no other tag is sent to a worker
      end select
    end do
    if (this%said) return
    if (caught_signal() == 0) return
    call this%comm%send(nothing, 0, SIGNALLED)
    this%said = .true.
  end subroutine listen

  !> Cheap most of the time: one look at the clock.
  function ask(this) result(answer)
    class(rank_monitor_t), intent(inout) :: this
    integer :: answer
    real(wp) :: now

    answer = GO_ON
    now = wall_seconds()
    if (now - this%last_look < LOOK_EVERY) return
    call this%look()
    this%last_look = wall_seconds()
    if (this%decision == STOP_NOW) then
      answer = ABANDON
    else if (this%member_seconds > 0.0_wp .and. now - this%member_start > this%member_seconds) then
      answer = OUT_OF_TIME
    end if
  end function ask
end module sg_scheduler
