!> What the engine costs for a member: members that cost nothing, through scheduler, journal and
!> ensemble.h5, and where the time of rank 0 goes. Usage: mpirun -n N bench_engine [MEMBERS]. Files
!> are written into ./bench_engine. Prints a row of a table; judges nothing.
program bench_engine
  use sg_comm, only: comm_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_posix, only: make_directory
  use sg_scheduler, only: run_members
  use sg_timer, only: wall_seconds
  use sleeping_members, only: make_record, row_geometry
  use timed_engine, only: free_model_t, timed_director_t
  implicit none

  character(len=*), parameter :: DIRECTORY = 'bench_engine'
  type(comm_t) :: comm
  type(timed_director_t) :: director
  type(free_model_t) :: model
  integer(i8), allocatable :: tasks(:, :)
  integer(i8) :: members, k
  type(error_t), allocatable :: error
  character(len=32) :: word
  real(wp) :: wall

  members = 20000
  call get_command_argument(1, word)
  if (word /= '') read (word, *) members
  call comm%init()
  allocate (tasks(2, members))
  tasks(1, :) = 1
  tasks(2, :) = [(k, k=1, members)]
  if (comm%rank() == 0) call prepare(error)
  call comm%agree(error)
  if (allocated(error)) call give_up(error)
  call comm%barrier()
  wall = wall_seconds()
  call run_members(comm, tasks, director, model, 0.0_wp)
  if (comm%rank() == 0) then
    call director%write_results(error)
    wall = wall_seconds() - wall
    if (.not. allocated(error) .and. allocated(director%error)) error = director%error
    if (allocated(error)) call give_up(error)
    call director%journal%close()
    call print_row()
  end if
  call comm%finalize()

contains

  subroutine give_up(error)
    type(error_t), intent(in) :: error

    print '(a)', error%message
    call comm%abort(1)
  end subroutine give_up

  !> As the driver does it for a run of one case.
  subroutine prepare(error)
    type(error_t), allocatable, intent(out) :: error

    allocate (director%plan%cases(1), director%results(1))
    director%plan%cases(1)%label = 'base'
    director%plan%cases(1)%member_count = members
    director%directory = DIRECTORY
    director%progress%directory = DIRECTORY
    director%progress%on_screen = .false.
    director%start = wall_seconds()
    director%last_report = director%start
    director%last_write = director%start
    call make_record(director%record)
    associate (results => director%results(1))
      results%label = 'base'
      results%acf = 'snx'
      results%distribution = 'normal'
      call results%init(members, row_geometry())
    end associate
    call make_directory(DIRECTORY, error)
    if (.not. allocated(error)) call director%journal%open(DIRECTORY, error)
    if (.not. allocated(error)) call director%journal%start('bench', error)
  end subroutine prepare

  subroutine print_row()
    real(wp) :: parts(5)

    parts = [wall, director%keeping, director%syncing, director%writing, 0.0_wp]
    ! Its own loop and rows and, with more ranks, pack, send, receive, unpack and the next task.
    parts(5) = wall - sum(parts(2:4))
    parts = 1.0e6_wp*parts/members
    print '(a)', '| ranks | members | wall | messages | journal | sync | ensemble.h5 |'
    print '(a)', '|---|---|---|---|---|---|---|'
    print '(2(a, i0), 5(a, f6.2), a)', '| ', comm%size(), ' | ', members, ' | ', parts(1), ' | ', &
      parts(5), ' | ', parts(2), ' | ', parts(3), ' | ', parts(4), ' |'
    print '(a, i0, a, i0, a)', 'us a member; ', director%syncs, ' syncs, ', director%writes, &
      ' times ensemble.h5'
  end subroutine print_row
end program bench_engine
