!> The only user of MPI: what the Monte Carlo layer and the main program need, and no more.
!> MPI ends the program when one of its calls fails (its default error handler), so the status of
!> the calls is not looked at here.
module sg_comm
  use mpi_f08, only: MPI_Abort, MPI_Allreduce, MPI_Barrier, MPI_Bcast, MPI_BYTE, MPI_Comm, &
    MPI_Comm_free, MPI_Comm_rank, MPI_Comm_size, MPI_Comm_split, MPI_Comm_split_type, &
    MPI_COMM_TYPE_SHARED, MPI_COMM_WORLD, MPI_Finalize, MPI_Get_count, &
    MPI_INFO_NULL, MPI_Init_thread, MPI_INTEGER, MPI_Iprobe, MPI_LOR, MPI_LOGICAL, MPI_MAX, &
    MPI_MIN, MPI_DOUBLE_PRECISION, MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_Recv, MPI_Send, MPI_Status, &
    MPI_THREAD_FUNNELED
  use sg_errors, only: error_t, raise
  use sg_kinds, only: i1, wp
  implicit none
  private

  public :: comm_t

  type :: comm_t
    private
    type(MPI_Comm) :: handle
    integer :: own_rank = 0
    integer :: ranks = 1
  contains
    procedure :: init
    procedure :: attach
    procedure :: finalize
    procedure :: abort
    procedure :: rank
    procedure :: size => rank_count
    procedure :: barrier
    procedure :: broadcast_text
    procedure :: broadcast_integer
    procedure :: broadcast_reals
    procedure :: any_true
    procedure :: count_alike
    procedure :: max_real
    procedure :: agree
    procedure :: probe
    procedure :: send
    procedure :: receive
  end type comm_t

contains

  !> Starts MPI on all ranks. Threads of a rank, if any, leave it to the first to call MPI.
  subroutine init(this)
    class(comm_t), intent(inout) :: this
    integer :: provided

    call MPI_Init_thread(MPI_THREAD_FUNNELED, provided)
    this%handle = MPI_COMM_WORLD
    call ask_size(this)
  end subroutine init

  !> Uses a communicator that exists, given as its integer handle.
  subroutine attach(this, handle)
    class(comm_t), intent(inout) :: this
    integer, intent(in) :: handle

    this%handle%mpi_val = handle
    call ask_size(this)
  end subroutine attach

  subroutine ask_size(this)
    class(comm_t), intent(inout) :: this

    call MPI_Comm_rank(this%handle, this%own_rank)
    call MPI_Comm_size(this%handle, this%ranks)
  end subroutine ask_size

  subroutine finalize(this)
    class(comm_t), intent(inout) :: this

    this%ranks = 1
    call MPI_Finalize()
  end subroutine finalize

  !> Ends all ranks at once with an exit code; only where they can no longer agree.
  subroutine abort(this, code)
    class(comm_t), intent(in) :: this
    integer, intent(in) :: code

    call MPI_Abort(this%handle, code)
  end subroutine abort

  !> From 0.
  pure function rank(this) result(number)
    class(comm_t), intent(in) :: this
    integer :: number

    number = this%own_rank
  end function rank

  pure function rank_count(this) result(number)
    class(comm_t), intent(in) :: this
    integer :: number

    number = this%ranks
  end function rank_count

  subroutine barrier(this)
    class(comm_t), intent(in) :: this

    call MPI_Barrier(this%handle)
  end subroutine barrier

  !> Every rank gets the text of rank 0; on the others it need not be allocated.
  subroutine broadcast_text(this, text)
    class(comm_t), intent(in) :: this
    character(len=:), allocatable, intent(inout) :: text

    if (.not. allocated(text)) text = ''
    call broadcast_from(this, 0, text)
  end subroutine broadcast_text

  subroutine broadcast_integer(this, value)
    class(comm_t), intent(in) :: this
    integer, intent(inout) :: value

    call MPI_Bcast(value, 1, MPI_INTEGER, 0, this%handle)
  end subroutine broadcast_integer

  subroutine broadcast_reals(this, values)
    class(comm_t), intent(in) :: this
    real(wp), intent(inout) :: values(:)

    call MPI_Bcast(values, size(values), MPI_DOUBLE_PRECISION, 0, this%handle)
  end subroutine broadcast_reals

  !> Ranks on the machine of this one that have the same `value`, which is not negative, with this
  !> one. Collective.
  function count_alike(this, value) result(number)
    class(comm_t), intent(in) :: this
    integer, intent(in) :: value
    integer :: number
    type(MPI_Comm) :: machine, alike

    call MPI_Comm_split_type(this%handle, MPI_COMM_TYPE_SHARED, this%own_rank, MPI_INFO_NULL, &
      machine)
    call MPI_Comm_split(machine, value, this%own_rank, alike)
    call MPI_Comm_size(alike, number)
    call MPI_Comm_free(alike)
    call MPI_Comm_free(machine)
  end function count_alike

  !> Whether `value` is true on any rank; the same answer everywhere.
  function any_true(this, value) result(any_of_them)
    class(comm_t), intent(in) :: this
    logical, intent(in) :: value
    logical :: any_of_them

    call MPI_Allreduce(value, any_of_them, 1, MPI_LOGICAL, MPI_LOR, this%handle)
  end function any_true

  function max_real(this, value) result(largest)
    class(comm_t), intent(in) :: this
    real(wp), intent(in) :: value
    real(wp) :: largest

    call MPI_Allreduce(value, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, this%handle)
  end function max_real

  !> Ranks agree on an error before they branch: afterwards either none has one or all have that of
  !> the lowest rank that had one.
  subroutine agree(this, error)
    class(comm_t), intent(in) :: this
    type(error_t), allocatable, intent(inout) :: error
    integer :: mine, owner, code, length
    character(len=:), allocatable :: text

    mine = this%ranks
    if (allocated(error)) mine = this%own_rank
    call MPI_Allreduce(mine, owner, 1, MPI_INTEGER, MPI_MIN, this%handle)
    if (owner == this%ranks) return
    code = 0
    length = 0
    text = ''
    if (owner == this%own_rank) then
      code = error%code
      length = len(error%message)
      text = error%message//error%place
    end if
    call MPI_Bcast(code, 1, MPI_INTEGER, owner, this%handle)
    call MPI_Bcast(length, 1, MPI_INTEGER, owner, this%handle)
    call broadcast_from(this, owner, text)
    call raise(error, code, text(:length), text(length + 1:))
  end subroutine agree

  subroutine broadcast_from(this, owner, text)
    class(comm_t), intent(in) :: this
    integer, intent(in) :: owner
    character(len=:), allocatable, intent(inout) :: text
    integer :: length
    integer(i1), allocatable :: bytes(:)

    length = len(text)
    call MPI_Bcast(length, 1, MPI_INTEGER, owner, this%handle)
    allocate (bytes(length))
    if (this%own_rank == owner) bytes = transfer(text, bytes, length)
    call MPI_Bcast(bytes, length, MPI_BYTE, owner, this%handle)
    if (this%own_rank == owner) return
    deallocate (text)
    allocate (character(len=length) :: text)
    text = transfer(bytes, text)
  end subroutine broadcast_from

  !> Whether a message waits, of whom, with which tag and how many bytes. Does not block.
  subroutine probe(this, found, source, tag, length)
    class(comm_t), intent(in) :: this
    logical, intent(out) :: found
    integer, intent(out) :: source, tag, length
    type(MPI_Status) :: status

    source = -1
    tag = -1
    length = 0
    if (this%ranks == 1) then
      found = .false.
      return
    end if
    call MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, this%handle, found, status)
    if (.not. found) return
    source = status%MPI_SOURCE
    tag = status%MPI_TAG
    call MPI_Get_count(status, MPI_BYTE, length)
  end subroutine probe

  !> Sends bytes; returns when `bytes` may be changed again.
  subroutine send(this, bytes, destination, tag)
    class(comm_t), intent(in) :: this
    integer(i1), intent(in) :: bytes(:)
    integer, intent(in) :: destination, tag

    call MPI_Send(bytes, size(bytes), MPI_BYTE, destination, tag, this%handle)
  end subroutine send

  !> Receives the message that `probe` found.
  subroutine receive(this, bytes, source, tag)
    class(comm_t), intent(in) :: this
    integer(i1), intent(out) :: bytes(:)
    integer, intent(in) :: source, tag
    type(MPI_Status) :: status

    call MPI_Recv(bytes, size(bytes), MPI_BYTE, source, tag, this%handle, status)
  end subroutine receive
end module sg_comm
