!> The real scheduler with members that sleep: how much of the ranks' time is idle, and what
!> rank 0 spends on a member. Usage: mpirun -n N bench_scheduler [MEMBERS_PER_RANK]
!> [SHORTEST]. Times of members are spread evenly from SHORTEST to 5 SHORTEST seconds. Sleeping
!> members measure the scheduler, not the cores; ranks may outnumber these. The journal is written
!> into the present directory. Prints; judges nothing.
program bench_scheduler
  use sg_comm, only: comm_t
  use sg_ensemble, only: case_results_t, ENSEMBLE_NAME, run_record_t, &
    write_ensemble
  use sg_errors, only: error_t
  use sg_journal, only: JOURNAL_NAME
  use sg_kinds, only: i1, i8, wp
  use sg_outcome, only: outcome_t
  use sg_outcome_bytes, only: pack_outcome, unpack_outcome
  use sg_posix, only: remove_file
  use sg_scheduler, only: run_members
  use sg_timer, only: wall_seconds
  use sleeping_members, only: counting_director_t, make_record, make_row, row_geometry, &
    sleeping_model_t
  implicit none

  integer, parameter :: SYNCS = 200, MESSAGES = 1000
  !> Rows of ensemble.h5: those of the paper's study.
  integer, parameter :: CASES = 15, MEMBERS_PER_CASE = 1000
  type(comm_t) :: comm
  integer :: members_per_rank
  real(wp) :: shortest

  members_per_rank = nint(argument(1, 50.0_wp))
  shortest = argument(2, 0.02_wp)
  call comm%init()
  call time_idle()
  call time_journal()
  call time_ensemble()
  if (comm%size() > 1) call time_messages()
  call comm%finalize()

contains

  !> The n-th word of the command line as a number.
  function argument(n, default) result(value)
    integer, intent(in) :: n
    real(wp), intent(in) :: default
    real(wp) :: value
    character(len=32) :: word

    value = default
    call get_command_argument(n, word)
    if (word /= '') read (word, *) value
  end function argument

  subroutine give_up(error)
    type(error_t), intent(in) :: error

    print '(a)', error%message
    call comm%abort(1)
  end subroutine give_up

  !> Runs `number` members; `wall` from the first task to the last answer.
  subroutine run_sleepers(number, director, wall)
    integer, intent(in) :: number
    type(counting_director_t), intent(out) :: director
    real(wp), intent(out) :: wall
    type(sleeping_model_t) :: model
    type(error_t), allocatable :: error
    integer(i8), allocatable :: tasks(:, :)
    integer(i8) :: k

    model%shortest = shortest
    allocate (tasks(2, number))
    tasks(1, :) = 1
    tasks(2, :) = [(k, k=1_i8, int(number, i8))]
    if (comm%rank() == 0) call director%keep_journal(error)
    call comm%agree(error)
    if (allocated(error)) call give_up(error)
    call comm%barrier()
    wall = wall_seconds()
    call run_members(comm, tasks, director, model, 0.0_wp)
    wall = wall_seconds() - wall
    if (comm%rank() /= 0) return
    call director%journal%close()
    call remove_file(JOURNAL_NAME, error)
  end subroutine run_sleepers

  !> Share of the ranks' time in which no member was at work.
  subroutine time_idle()
    type(counting_director_t) :: director
    real(wp) :: wall

    call run_sleepers(members_per_rank*comm%size(), director, wall)
    if (comm%rank() /= 0) return
    print '(i0, a, i0, a, f6.3, a, f6.3, a, f7.3, a)', comm%size(), ' ranks, ', director%count, &
      ' members of ', director%least, ' to ', director%most, ' s: wall ', wall, ' s'
    print '(a, f6.2, a)', 'idle share ', 100.0_wp*(1.0_wp - director%busy/(comm%size()*wall)), ' %'
  end subroutine time_idle

  !> What the journal costs rank 0: a row, and a sync, of one row and of many.
  subroutine time_journal()
    type(counting_director_t) :: director
    type(outcome_t) :: outcome
    type(error_t), allocatable :: error
    real(wp) :: start, adding, syncing(2)
    integer :: k

    if (comm%rank() /= 0) return
    call make_row(1, 1_i8, outcome)
    call director%keep_journal(error)
    if (allocated(error)) call give_up(error)
    syncing = 0.0_wp
    do k = 1, SYNCS
      call director%accept(outcome)
      start = wall_seconds()
      call director%journal%sync(error)
      if (allocated(error)) call give_up(error)
      syncing(1) = syncing(1) + wall_seconds() - start
    end do
    adding = wall_seconds()
    do k = 1, MESSAGES
      call director%accept(outcome)
    end do
    adding = wall_seconds() - adding
    start = wall_seconds()
    call director%journal%sync(error)
    syncing(2) = wall_seconds() - start
    call director%journal%close()
    call remove_file(JOURNAL_NAME, error)
    print '(a, f7.2, a, f8.1, a, i0, a, f8.1, a)', 'journal: ', 1.0e6_wp*adding/MESSAGES, &
      ' us a row, ', 1.0e6_wp*syncing(1)/SYNCS, ' us a sync of one row, of ', MESSAGES, &
      ' rows ', 1.0e6_wp*syncing(2), ' us'
  end subroutine time_journal

  !> Writing ensemble.h5.
  subroutine time_ensemble()
    type(case_results_t) :: results(CASES)
    type(run_record_t) :: record
    type(outcome_t) :: outcome
    type(error_t), allocatable :: error
    real(wp) :: seconds
    integer :: k, id

    if (comm%rank() /= 0) return
    do k = 1, CASES
      results(k)%label = 'case_'//achar(iachar('a') + k)
      results(k)%acf = 'snx'
      results(k)%distribution = 'normal'
      call results(k)%init(int(MEMBERS_PER_CASE, i8), row_geometry())
      do id = 1, MEMBERS_PER_CASE
        call make_row(k, int(id, i8), outcome)
        call results(k)%put(outcome)
      end do
    end do
    call make_record(record)
    seconds = wall_seconds()
    call write_ensemble('.', record, results, error)
    seconds = wall_seconds() - seconds
    if (allocated(error)) call give_up(error)
    call remove_file(ENSEMBLE_NAME, error)
    print '(a, i0, a, f8.3, a)', ENSEMBLE_NAME//' of ', CASES*MEMBERS_PER_CASE, ' members: ', &
      seconds, ' s'
  end subroutine time_ensemble

  !> What rank 0 does for one row that waits, but for keeping it: look, receive, unpack, and a new
  !> task.
  subroutine time_messages()
    integer, parameter :: ROW = 1, TASK = 2
    type(outcome_t) :: outcome
    integer(i1), allocatable :: bytes(:)
    integer(i1) :: answer(16)
    real(wp) :: seconds
    integer :: source, tag, length, k
    logical :: found, ok

    call make_row(1, 1_i8, outcome)
    bytes = pack_outcome(outcome)
    answer = 0
    ! Rank 0 may still be in the scheduler, where these messages would be taken for its own.
    call comm%barrier()
    if (comm%rank() == 1) then
      do k = 1, MESSAGES
        call comm%send(bytes, 0, ROW)
      end do
    end if
    call comm%barrier()
    seconds = wall_seconds()
    if (comm%rank() == 0) then
      k = 0
      do while (k < MESSAGES)
        call comm%probe(found, source, tag, length)
        if (.not. found) cycle
        call comm%receive(bytes(:length), source, tag)
        call unpack_outcome(bytes(:length), outcome, ok)
        call comm%send(answer, source, TASK)
        k = k + 1
      end do
      seconds = wall_seconds() - seconds
      print '(a, i0, a, f7.2, a)', 'a row of ', size(bytes), ' bytes and its answer: ', &
        1.0e6_wp*seconds/MESSAGES, ' us of rank 0'
    else if (comm%rank() == 1) then
      do k = 1, MESSAGES
        call wait_message()
        call comm%receive(answer, 0, TASK)
      end do
    end if
    call comm%barrier()
  end subroutine time_messages

  subroutine wait_message()
    integer :: source, tag, length
    logical :: found

    found = .false.
    do while (.not. found)
      call comm%probe(found, source, tag, length)
    end do
  end subroutine wait_message
end program bench_scheduler
