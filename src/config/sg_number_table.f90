!> Tables of numbers from CSV files whose first line names the columns.
module sg_number_table
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: wp
  use sg_number_text, only: parse_real
  use sg_posix, only: read_text
  use sg_text, only: joined, to_text
  implicit none
  private

  public :: number_table_t, read_number_table

  type :: number_table_t
    character(len=:), allocatable :: path
    !> Which of the headings the file has.
    integer :: heading = 0
    !> [columns, rows].
    real(wp), allocatable :: values(:, :)
    !> Line of each row in the file.
    integer, allocatable :: line(:)
  contains
    procedure :: fault
  end type number_table_t

contains

  !> Reads a file whose first line is one of `headings`, names between commas, and every other a
  !> number for each name; empty lines do not count. What is wrong is told with file and line.
  subroutine read_number_table(path, headings, table, error)
    character(len=*), intent(in) :: path, headings(:)
    type(number_table_t), intent(out) :: table
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text, row
    integer :: start, end, line, columns, count, k

    table%path = path
    call read_text(path, text, error)
    if (allocated(error)) return
    start = 1
    line = 0
    count = 0
    columns = 0
    do while (start <= len(text))
      end = start + index(text(start:)//achar(10), achar(10)) - 2
      line = line + 1
      row = bare(text(start:end))
      if (line == 1) then
        do k = 1, size(headings)
          if (row == trim(headings(k))) table%heading = k
        end do
        if (table%heading == 0) exit
        columns = 1 + count_of(',', trim(headings(table%heading)))
        allocate (table%values(columns, count_of(achar(10), text) + 1))
        allocate (table%line(size(table%values, 2)))
      else if (len_trim(row) > 0) then
        count = count + 1
        table%line(count) = line
        call read_row(row, table%values(:, count), error)
        if (allocated(error)) then
          error%message = table%fault(count, error%message)
          return
        end if
      end if
      start = end + 2
    end do
    if (table%heading == 0) then
      call raise(error, EXIT_BAD_INPUT, path//':1: the first line must be '// &
        joined(headings, ' or '), 'read_number_table')
      return
    end if
    table%values = table%values(:, :count)
    table%line = table%line(:count)
  end subroutine read_number_table

  !> `what` with file and line of a row before it.
  pure function fault(this, row, what) result(text)
    class(number_table_t), intent(in) :: this
    integer, intent(in) :: row
    character(len=*), intent(in) :: what
    character(len=:), allocatable :: text

    text = this%path//':'//to_text(this%line(row))//': '//what
  end function fault

  pure integer function count_of(character, text) result(number)
    character, intent(in) :: character
    character(len=*), intent(in) :: text
    integer :: k

    number = count([(text(k:k) == character, k=1, len(text))])
  end function count_of

  !> The line without the carriage return of other systems.
  pure function bare(line) result(text)
    character(len=*), intent(in) :: line
    character(len=:), allocatable :: text

    text = line
    if (len(text) == 0) return
    if (text(len(text):) == achar(13)) text = text(:len(text) - 1)
  end function bare

  !> The numbers of one line.
  subroutine read_row(line, row, error)
    character(len=*), intent(in) :: line
    real(wp), intent(out) :: row(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: fault
    integer :: k, start, length

    row = 0.0_wp
    start = 1
    do k = 1, size(row)
      length = index(line(start:)//',', ',') - 1
      call parse_real(trim(adjustl(line(start:start + length - 1))), row(k), fault)
      if (allocated(fault)) then
        if (len(fault) > 0) call raise(error, EXIT_BAD_INPUT, 'value '//to_text(k)//': '//fault, &
          'read_row')
      end if
      if (allocated(error)) return
      start = start + length + 1
      if (start > len(line) + 1 .and. k < size(row)) then
        call raise(error, EXIT_BAD_INPUT, 'there are '//to_text(k)//' values instead of '// &
          to_text(size(row)), 'read_row')
        return
      end if
    end do
    if (start <= len(line)) call raise(error, EXIT_BAD_INPUT, 'there are more than '// &
      to_text(size(row))//' values', 'read_row')
  end subroutine read_row
end module sg_number_table
