!> What MPI tests `use`: everything of funit, and the object that a test gets its ranks from.
module pfunit
  use funit
  use funit_core, only: funit_end_with, funit_failures_here, funit_finished, funit_report, &
    funit_set_rank
  use mpi_f08, only: MPI_COMM_NULL, MPI_COMM_WORLD, MPI_Comm, MPI_INTEGER, MPI_LOGICAL, MPI_SUM, &
    MPI_UNDEFINED, MPI_Allreduce, MPI_Bcast, MPI_Comm_free, MPI_Comm_rank, MPI_Comm_size, &
    MPI_Comm_split, MPI_Finalize, MPI_Init, operator(/=)
  implicit none
  private :: funit_end_with, funit_failures_here, funit_finished, funit_report, funit_set_rank
  private :: MPI_COMM_NULL, MPI_COMM_WORLD, MPI_Comm, MPI_INTEGER, MPI_LOGICAL, MPI_SUM
  private :: MPI_UNDEFINED, MPI_Allreduce, MPI_Bcast, MPI_Comm_free, MPI_Comm_rank, MPI_Comm_size
  private :: MPI_Comm_split, MPI_Finalize, MPI_Init, operator(/=)
  private :: begin, finish, is_active, get_communicator, get_rank, get_size

  !> A test on the first `npes` ranks.
  type :: MpiTestMethod
    type(MPI_Comm), private :: communicator
  contains
    !> Handle of a communicator that holds the ranks of this test, as in pFUnit an integer by
    !> default (`communicator%mpi_val` of mpi_f08).
    procedure :: getMpiCommunicator => get_communicator
    !> Rank in that communicator.
    procedure :: getProcessRank => get_rank
    !> Its size: the npes of the test.
    procedure :: getNumProcesses => get_size
    procedure :: begin
    procedure :: finish
    procedure :: isActive => is_active
  end type MpiTestMethod

contains

  !> Starts MPI; refuses to run on fewer ranks than the suite needs.
  subroutine pfunit_open(ranks)
    integer, intent(in) :: ranks
    integer :: world_size, rank

    call MPI_Init()
    call MPI_Comm_size(MPI_COMM_WORLD, world_size)
    call MPI_Comm_rank(MPI_COMM_WORLD, rank)
    if (world_size < ranks) then
      if (rank == 0) then
        write (*, '(a, i0, a)') 'FAILED: these tests need mpirun with ', ranks, ' ranks.'
      end if
      call MPI_Finalize()
      stop 1
    end if
    call funit_set_rank(rank)
    call funit_open()
  end subroutine pfunit_open

  !> Summary by rank 0, exit code on all ranks.
  subroutine pfunit_close(file_count)
    integer, intent(in) :: file_count
    integer :: rank
    logical :: passed

    call MPI_Comm_rank(MPI_COMM_WORLD, rank)
    if (rank == 0) passed = funit_report(file_count)
    call MPI_Bcast(passed, 1, MPI_LOGICAL, 0, MPI_COMM_WORLD)
    call MPI_Finalize()
    call funit_finished()
    if (.not. passed) stop 1
  end subroutine pfunit_close

  !> Collective on all ranks of the program.
  subroutine begin(this, name, npes)
    class(MpiTestMethod), intent(inout) :: this
    character(len=*), intent(in) :: name
    integer, intent(in) :: npes
    integer :: rank

    call funit_begin(name)
    call MPI_Comm_rank(MPI_COMM_WORLD, rank)
    call MPI_Comm_split(MPI_COMM_WORLD, merge(0, MPI_UNDEFINED, rank < npes), rank, &
      this%communicator)
  end subroutine begin

  !> Collective on all ranks of the program: the test has failed if it failed on any.
  subroutine finish(this)
    class(MpiTestMethod), intent(inout) :: this
    integer :: failures

    if (this%isActive()) call MPI_Comm_free(this%communicator)
    call MPI_Allreduce(funit_failures_here(), failures, 1, MPI_INTEGER, MPI_SUM, MPI_COMM_WORLD)
    call funit_end_with(failures)
  end subroutine finish

  !> Whether this rank takes part in the test.
  function is_active(this) result(active)
    class(MpiTestMethod), intent(in) :: this
    logical :: active
    active = this%communicator /= MPI_COMM_NULL
  end function is_active

  function get_communicator(this) result(handle)
    class(MpiTestMethod), intent(in) :: this
    integer :: handle
    handle = this%communicator%mpi_val
  end function get_communicator

  function get_rank(this) result(rank)
    class(MpiTestMethod), intent(in) :: this
    integer :: rank
    call MPI_Comm_rank(this%communicator, rank)
  end function get_rank

  function get_size(this) result(process_count)
    class(MpiTestMethod), intent(in) :: this
    integer :: process_count
    call MPI_Comm_size(this%communicator, process_count)
  end function get_size
end module pfunit
