!> DIR/journal.bin: the truth on resume. A header with the configuration the directory belongs to,
!> then one record for every finished member, appended by rank 0 and synced, many at once where many
!> come at once. Its lock is that of the run directory.
!>
!> Header: 'SGIMPJNL', five int32 (version, byte order, columns, length of text, CRC of the text),
!> text. Record: three int32 (mark, length of payload, CRC of length and payload), payload as in
!> sg_outcome_bytes.
module sg_journal
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: i1, i4, i8
  use sg_outcome, only: COLUMN_COUNT, outcome_t
  use sg_outcome_bytes, only: pack_outcome, peek_member, unpack_outcome
  use sg_posix, only: append_file_t, checksum, read_file
  implicit none
  private

  public :: journal_t, damage_t, JOURNAL_NAME

  character(len=*), parameter :: JOURNAL_NAME = 'journal.bin'
  integer(i4), parameter :: FORMAT_VERSION = 1
  integer(i4), parameter :: BYTE_ORDER = 16909060
  integer(i4), parameter :: RECORD_MARK = 1397181522
  character(len=8), parameter :: SIGNATURE = 'SGIMPJNL'
  integer, parameter :: HEADER = 28, RECORD_HEADER = 12
  !> No row is longer: a length beyond it is damage.
  integer(i8), parameter :: LONGEST = 67108864

  !> A stretch of the file that is not a good record.
  type :: damage_t
    !> Offset of its first byte and number of bytes.
    integer(i8) :: offset = 0, length = 0
    !> The member it seems to have been; zeros where that cannot be read. A cut-off end has none.
    integer :: case_index = 0
    integer(i8) :: id = 0
    logical :: is_tail = .false.
  end type damage_t

  type :: journal_t
    private
    type(append_file_t) :: file
    character(len=:), allocatable :: path
    !> Records were added that may not be on disk yet.
    logical :: has_unsynced = .false.
  contains
    procedure :: open
    procedure :: load
    procedure :: start
    procedure :: clear
    procedure :: add
    procedure :: sync
    procedure :: is_dirty
    procedure :: close
  end type journal_t

contains

  !> Opens or makes the journal and takes the lock; a run that holds it is an error.
  subroutine open (this, directory, error)
    class(journal_t), intent(inout) :: this
    character(len=*), intent(in) :: directory
    type(error_t), allocatable, intent(out) :: error
    logical :: locked

    this%path = directory//'/'//JOURNAL_NAME
    call this%file%open(this%path, error)
    if (allocated(error)) return
    call this%file%lock(locked, error)
    if (allocated(error) .or. locked) return
    call this%file%close()
    call raise(error, EXIT_BAD_INPUT, 'another run is at work in '//directory, 'journal_t%open')
  end subroutine open

  !> Reads all that is good. `text` is that of the header, empty for a new journal. A cut-off end is
  !> removed from the file; other damage is skipped. Both are told in `damage`.
  subroutine load(this, text, outcomes, damage, error)
    class(journal_t), intent(inout) :: this
    character(len=:), allocatable, intent(out) :: text
    type(outcome_t), allocatable, intent(out) :: outcomes(:)
    type(damage_t), allocatable, intent(out) :: damage(:)
    type(error_t), allocatable, intent(out) :: error
    integer(i1), allocatable :: bytes(:)
    integer(i8) :: mark, next

    text = ''
    allocate (outcomes(0), damage(0))
    call read_file(this%path, bytes, error)
    if (allocated(error) .or. size(bytes) == 0) return
    call read_header(bytes, text, mark, error)
    if (allocated(error)) return
    if (mark == 0) then
      ! Killed while the header was written: nothing was kept yet.
      damage = [damage_t(0_i8, size(bytes, kind=i8), 0, 0_i8, .true.)]
      call this%file%truncate(0_i8, error)
      return
    end if
    call scan_records(bytes, mark, outcomes, damage)
    if (size(damage) == 0) return
    next = damage(size(damage))%offset
    if (damage(size(damage))%is_tail) call this%file%truncate(next, error)
  end subroutine load

  !> `mark` is the offset of the first record; 0 when the header was cut off.
  subroutine read_header(bytes, text, mark, error)
    integer(i1), intent(in) :: bytes(:)
    character(len=:), allocatable, intent(inout) :: text
    integer(i8), intent(out) :: mark
    type(error_t), allocatable, intent(out) :: error
    character(len=8) :: signature_found
    type(outcome_t), allocatable :: found(:)
    type(damage_t), allocatable :: holes(:)
    integer(i4) :: numbers(5)

    mark = 0
    signature_found = SIGNATURE
    if (size(bytes) > 0) signature_found(:min(8, size(bytes))) = transfer(bytes(:min(8, &
      size(bytes))), repeat(' ', min(8, size(bytes))))
    if (signature_found /= SIGNATURE) then
      call raise(error, EXIT_BAD_INPUT, JOURNAL_NAME//' is no journal of this program; '// &
        '--overwrite starts anew', 'journal_t%load')
      return
    end if
    if (size(bytes, kind=i8) < HEADER) return
    numbers = transfer(bytes(9:HEADER), numbers)
    if (numbers(2) /= BYTE_ORDER) then
      call raise(error, EXIT_BAD_INPUT, JOURNAL_NAME// &
        ' is no journal of this program on such a '// &
        'machine; --overwrite starts anew', 'journal_t%load')
    else if (numbers(1) /= FORMAT_VERSION .or. numbers(3) /= COLUMN_COUNT) then
      call raise(error, EXIT_BAD_INPUT, JOURNAL_NAME//' is of another version of the program; '// &
        '--overwrite starts anew', 'journal_t%load')
    else if (numbers(4) < 0 .or. size(bytes, kind=i8) < HEADER + int(numbers(4), i8)) then
      ! Cut off while it was written, if no record follows; otherwise its length is damaged.
      allocate (found(0), holes(0))
      call scan_records(bytes, int(HEADER, i8), found, holes)
      if (size(found) > 0) call raise(error, EXIT_BAD_INPUT, 'the header of '//JOURNAL_NAME// &
        ' is damaged, but records follow it; --overwrite starts anew', 'journal_t%load')
    else if (checksum(bytes(HEADER + 1:HEADER + numbers(4))) /= numbers(5)) then
      call raise(error, EXIT_BAD_INPUT, 'the header of '//JOURNAL_NAME//' is damaged; '// &
        '--overwrite starts anew', 'journal_t%load')
    else
      mark = HEADER + int(numbers(4), i8)
      deallocate (text)
      allocate (character(len=numbers(4)) :: text)
      text = transfer(bytes(HEADER + 1:mark), text)
    end if
  end subroutine read_header

  subroutine scan_records(bytes, first, outcomes, damage)
    integer(i1), intent(in) :: bytes(:)
    integer(i8), intent(in) :: first
    type(outcome_t), allocatable, intent(inout) :: outcomes(:)
    type(damage_t), allocatable, intent(inout) :: damage(:)
    type(outcome_t), allocatable :: found(:)
    type(damage_t) :: bad
    integer(i8) :: mark, length
    integer :: number

    number = 0
    allocate (found(64))
    mark = first
    do while (mark < size(bytes, kind=i8))
      if (number == size(found)) found = [found, found]
      length = record_length(bytes, mark, found(number + 1))
      if (length > 0) then
        number = number + 1
        mark = mark + length
        cycle
      end if
      bad = damage_t()
      bad%offset = mark
      call peek_member(bytes(min(mark + RECORD_HEADER, size(bytes, kind=i8)) + 1:), &
        bad%case_index, bad%id)
      do while (length == 0 .and. mark < size(bytes, kind=i8))
        mark = mark + 1
        length = record_length(bytes, mark, found(number + 1))
      end do
      bad%length = mark - bad%offset
      bad%is_tail = length == 0
      damage = [damage, bad]
    end do
    outcomes = found(:number)
  end subroutine scan_records

  !> Bytes of the good record at offset `mark`; 0 if there is none.
  function record_length(bytes, mark, outcome) result(length)
    integer(i1), intent(in) :: bytes(:)
    integer(i8), intent(in) :: mark
    type(outcome_t), intent(inout) :: outcome
    integer(i8) :: length
    integer(i4) :: numbers(3)
    logical :: ok

    length = 0
    if (mark + RECORD_HEADER > size(bytes, kind=i8)) return
    numbers = transfer(bytes(mark + 1:mark + RECORD_HEADER), numbers)
    if (numbers(1) /= RECORD_MARK .or. numbers(2) < 0 .or. numbers(2) > LONGEST) return
    if (mark + RECORD_HEADER + numbers(2) > size(bytes, kind=i8)) return
    associate (payload => bytes(mark + RECORD_HEADER + 1:mark + RECORD_HEADER + numbers(2)))
      if (checksum([transfer(numbers(2), payload), payload]) /= numbers(3)) return
      call unpack_outcome(payload, outcome, ok)
    end associate
    if (ok) length = RECORD_HEADER + numbers(2)
  end function record_length

  !> Empties the journal and writes a header with `text`.
  subroutine start(this, text, error)
    class(journal_t), intent(inout) :: this
    character(len=*), intent(in) :: text
    type(error_t), allocatable, intent(out) :: error
    integer(i1) :: shape_of(1)
    integer(i1), allocatable :: body(:)

    call this%file%truncate(0_i8, error)
    if (allocated(error)) return
    allocate (body(len(text)))
    body = transfer(text, body, len(text))
    call this%file%append([transfer(SIGNATURE, shape_of), &
      transfer([FORMAT_VERSION, BYTE_ORDER, int(COLUMN_COUNT, i4), size(body, kind=i4), &
        checksum(body)], shape_of), body], error)
    this%has_unsynced = .true.
    if (.not. allocated(error)) call this%sync(error)
  end subroutine start

  !> Makes it a new journal, without header.
  subroutine clear(this, error)
    class(journal_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error

    call this%file%truncate(0_i8, error)
  end subroutine clear

  !> The member outlives this process, and the machine once `sync` has returned.
  subroutine add(this, outcome, error)
    class(journal_t), intent(inout) :: this
    type(outcome_t), intent(in) :: outcome
    type(error_t), allocatable, intent(out) :: error
    integer(i1), allocatable :: payload(:), body(:)
    integer(i1) :: shape_of(1)

    allocate (payload, source=pack_outcome(outcome))
    body = [transfer(size(payload, kind=i4), shape_of), payload]
    call this%file%append([transfer(RECORD_MARK, shape_of), body(:4), &
      transfer(checksum(body), shape_of), payload], error)
    this%has_unsynced = .true.
  end subroutine add

  !> Returns when all members added so far are on disk.
  subroutine sync(this, error)
    class(journal_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error

    if (.not. this%has_unsynced) return
    call this%file%sync(error)
    this%has_unsynced = allocated(error)
  end subroutine sync

  !> Members were added that may not be on disk yet.
  pure function is_dirty(this) result(dirty)
    class(journal_t), intent(in) :: this
    logical :: dirty

    dirty = this%has_unsynced
  end function is_dirty

  !> Gives up the lock.
  subroutine close (this)
    class(journal_t), intent(inout) :: this

    call this%file%close()
  end subroutine close
end module sg_journal
