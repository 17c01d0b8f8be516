!> A row as bytes: what is sent between ranks and kept in the journal, so that both hold the same.
module sg_outcome_bytes
  use sg_kinds, only: i1, i4, i8, sp, wp
  use sg_outcome, only: COLUMN_COUNT, outcome_t
  implicit none
  private

  public :: pack_outcome, unpack_outcome, peek_member

  integer, parameter :: LONG = 8, SHORT = 4
  !> case, status, columns of the profile, length of the reason; id.
  integer, parameter :: HEAD = 4*SHORT + LONG

contains

  pure function pack_outcome(outcome) result(bytes)
    type(outcome_t), intent(in) :: outcome
    integer(i1), allocatable :: bytes(:)
    integer :: columns, letters, mark

    columns = 0
    letters = 0
    if (allocated(outcome%height)) columns = size(outcome%height)
    if (allocated(outcome%reason)) letters = len(outcome%reason)
    allocate (bytes(HEAD + LONG*COLUMN_COUNT + SHORT*columns + letters))
    bytes(:4*SHORT) = transfer([int(outcome%case_index, i4), int(outcome%status, i4), &
                                int(columns, i4), int(letters, i4)], bytes)
    bytes(4*SHORT + 1:HEAD) = transfer(outcome%id, bytes)
    mark = HEAD
    bytes(mark + 1:mark + LONG*COLUMN_COUNT) = transfer(outcome%values, bytes)
    mark = mark + LONG*COLUMN_COUNT
    if (columns > 0) bytes(mark + 1:mark + SHORT*columns) = transfer(outcome%height, bytes)
    mark = mark + SHORT*columns
    if (letters > 0) bytes(mark + 1:) = transfer(outcome%reason, bytes)
  end function pack_outcome

  !> `ok` is false when the bytes are no row.
  pure subroutine unpack_outcome(bytes, outcome, ok)
    integer(i1), intent(in) :: bytes(:)
    type(outcome_t), intent(out) :: outcome
    logical, intent(out) :: ok
    integer(i4) :: numbers(4)
    integer :: mark

    ok = size(bytes) >= HEAD + LONG*COLUMN_COUNT
    if (.not. ok) return
    numbers = transfer(bytes(:4*SHORT), numbers)
    ok = all(numbers(3:4) >= 0)
    if (ok) ok = size(bytes) == HEAD + LONG*COLUMN_COUNT + SHORT*numbers(3) + numbers(4)
    if (.not. ok) return
    outcome%case_index = numbers(1)
    outcome%status = numbers(2)
    outcome%id = transfer(bytes(4*SHORT + 1:HEAD), 0_i8)
    mark = HEAD
    outcome%values = transfer(bytes(mark + 1:mark + LONG*COLUMN_COUNT), 0.0_wp, COLUMN_COUNT)
    mark = mark + LONG*COLUMN_COUNT
    allocate (outcome%height(numbers(3)))
    outcome%height = transfer(bytes(mark + 1:mark + SHORT*numbers(3)), 0.0_sp, int(numbers(3)))
    mark = mark + SHORT*numbers(3)
    allocate (character(len=numbers(4)) :: outcome%reason)
    if (numbers(4) > 0) outcome%reason = transfer(bytes(mark + 1:), outcome%reason)
  end subroutine unpack_outcome

  !> Case and id of what may be a damaged row; zeros if too short.
  pure subroutine peek_member(bytes, case_index, id)
    integer(i1), intent(in) :: bytes(:)
    integer, intent(out) :: case_index
    integer(i8), intent(out) :: id

    case_index = 0
    id = 0
    if (size(bytes) < HEAD) return
    case_index = int(transfer(bytes(:SHORT), 0_i4))
    id = transfer(bytes(4*SHORT + 1:HEAD), 0_i8)
  end subroutine peek_member
end module sg_outcome_bytes
