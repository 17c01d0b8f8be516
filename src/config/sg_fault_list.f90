!> Everything that is wrong with a case file, gathered so that the user sees all of it at once.
module sg_fault_list
  use sg_text, only: edit_distance, to_text
  implicit none
  private

  public :: fault_list_t, did_you_mean, quoted

  !> So many faults are shown; more of them have a common cause.
  integer, parameter :: MOST_SHOWN = 60

  type :: fault_t
    integer :: line
    character(len=:), allocatable :: text
    !> Behind the text: who has it, of several; and how many have.
    character(len=:), allocatable :: note
    integer :: bearers = 1
  end type fault_t

  type :: fault_list_t
    private
    integer, public :: number = 0
    type(fault_t), allocatable :: items(:)
  contains
    procedure :: add
    procedure :: add_of
    procedure :: settle
    procedure :: text => text_of_faults
  end type fault_list_t

contains

  !> Adds the fault `where: what` in a line of the file. `where` is `&group key`, `&group` or empty.
  subroutine add(this, line, where, what)
    class(fault_list_t), intent(inout) :: this
    integer, intent(in) :: line
    character(len=*), intent(in) :: where, what
    type(fault_t), allocatable :: more(:)

    if (.not. allocated(this%items)) allocate (this%items(16))
    if (this%number == size(this%items)) then
      allocate (more(2*this%number))
      more(:this%number) = this%items
      call move_alloc(more, this%items)
    end if
    this%number = this%number + 1
    this%items(this%number)%line = line
    if (len_trim(where) > 0) then
      this%items(this%number)%text = printable(trim(where)//': '//what)
    else
      this%items(this%number)%text = printable(what)
    end if
    this%items(this%number)%note = ''
  end subroutine add

  !> Adds the faults of one of several, whom `note` names; those that are there already are told
  !> once, of the first who has them.
  subroutine add_of(this, others, note)
    class(fault_list_t), intent(inout) :: this
    type(fault_list_t), intent(in) :: others
    character(len=*), intent(in) :: note
    integer :: i, j

    each: do i = 1, others%number
      do j = 1, this%number
        if (this%items(j)%line == others%items(i)%line .and. &
          this%items(j)%text == others%items(i)%text) then
          this%items(j)%bearers = this%items(j)%bearers + 1
          cycle each
        end if
      end do
      call this%add(others%items(i)%line, '', others%items(i)%text)
      this%items(this%number)%note = note
    end do each
  end subroutine add_of

  !> What all `number` of them have is told without a note.
  subroutine settle(this, number)
    class(fault_list_t), intent(inout) :: this
    integer, intent(in) :: number
    integer :: i

    do i = 1, this%number
      if (this%items(i)%bearers == number) this%items(i)%note = ''
    end do
  end subroutine settle

  !> Control characters, with which a file could do things to the terminal, become '?'.
  pure function printable(text) result(clean)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: clean
    integer :: i

    clean = text
    do i = 1, len(text)
      if (iachar(text(i:i)) < 32 .or. iachar(text(i:i)) == 127) clean(i:i) = '?'
    end do
  end function printable

  !> All faults, one a line as `file:line: text`, in the order of the file.
  function text_of_faults(this, file_name) result(text)
    class(fault_list_t), intent(in) :: this
    character(len=*), intent(in) :: file_name
    character(len=:), allocatable :: text
    integer :: order(this%number)
    integer :: i, j, shown

    ! Insertion sort: stable, and the list is short.
    do i = 1, this%number
      j = i
      do while (j > 1)
        if (this%items(order(j - 1))%line <= this%items(i)%line) exit
        order(j) = order(j - 1)
        j = j - 1
      end do
      order(j) = i
    end do

    text = ''
    shown = min(this%number, MOST_SHOWN)
    do i = 1, shown
      if (i > 1) text = text//new_line('a')
      text = text//file_name//':'//to_text(this%items(order(i))%line)//': '// &
        this%items(order(i))%text//this%items(order(i))%note
    end do
    if (this%number > shown) then
      text = text//new_line('a')//file_name//': and '//to_text(this%number - shown)// &
        ' more faults, not shown'
    end if
  end function text_of_faults

  !> `did you mean X?` with the candidate closest to `word`, or empty when none is close.
  pure function did_you_mean(word, candidates, prefix) result(text)
    character(len=*), intent(in) :: word
    character(len=*), intent(in) :: candidates(:)
    !> Written before the candidate.
    character(len=*), intent(in) :: prefix
    character(len=:), allocatable :: text
    integer :: i, distance, best, closest

    text = ''
    closest = 0
    best = min(3, max(1, (len_trim(word) + 1)/3)) + 1
    do i = 1, size(candidates)
      if (len_trim(candidates(i)) == 0) cycle
      distance = edit_distance(trim(word), trim(candidates(i)))
      ! Part of a name counts as close, but any true misspelling comes first.
      if (len_trim(word) >= 3 .and. index(candidates(i), &
        trim(word)) == 1) distance = min(distance, 1)
      if (distance < best) then
        best = distance
        closest = i
      end if
    end do
    if (closest > 0) text = 'did you mean '//prefix//trim(candidates(closest))//'?'
  end function did_you_mean

  pure function quoted(text) result(in_quotes)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: in_quotes
    in_quotes = ''''//trim(text)//''''
  end function quoted
end module sg_fault_list
