!> Material points from a CSV file: the shape 'points'.
module sg_point_file
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: wp
  use sg_number_text, only: parse_real
  use sg_posix, only: read_text
  use sg_text, only: to_text
  implicit none
  private

  public :: read_point_file

  character(len=*), parameter :: SHORT_HEAD = 'x,y,width,height'
  character(len=*), parameter :: LONG_HEAD = 'x,y,width,height,vx,vy'

contains

  !> Reads points (m, m/s). All have the same width and height, as one body needs. What is wrong is
  !> told with file and line.
  subroutine read_point_file(path, x, y, width, height, vx, vy, error)
    character(len=*), intent(in) :: path
    real(wp), allocatable, intent(out) :: x(:), y(:), vx(:), vy(:)
    real(wp), intent(out) :: width, height
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text
    real(wp), allocatable :: rows(:, :)
    real(wp) :: row(6)
    integer :: start, end, line, columns, count

    width = 0.0_wp
    height = 0.0_wp
    call read_text(path, text, error)
    if (allocated(error)) return
    allocate (rows(6, count_lines(text)))
    start = 1
    line = 0
    count = 0
    columns = 0
    do while (start <= len(text))
      end = start + index(text(start:)//achar(10), achar(10)) - 2
      line = line + 1
      if (line == 1) then
        columns = columns_of(text(start:end))
        if (columns == 0) then
          call complain('the first line must be '//SHORT_HEAD//' or '//LONG_HEAD)
          return
        end if
      else if (len_trim(bare(text(start:end))) > 0) then
        call read_row(bare(text(start:end)), columns, row, error)
        if (allocated(error)) then
          call complain(error%message)
          return
        end if
        count = count + 1
        rows(:, count) = row
        if (.not. (row(3) > 0.0_wp .and. row(4) > 0.0_wp)) then
          call complain('width and height must be above 0')
          return
        else if (any(row(3:4) /= rows(3:4, 1))) then
          call complain('all points of a body have the same width and height (use a body for each)')
          return
        end if
      end if
      start = end + 2
    end do
    if (count == 0) then
      call complain('there are no points')
      return
    end if
    x = rows(1, :count)
    y = rows(2, :count)
    width = rows(3, 1)
    height = rows(4, 1)
    vx = rows(5, :count)
    vy = rows(6, :count)

  contains

    subroutine complain(what)
      character(len=*), intent(in) :: what
      character(len=:), allocatable :: message
      message = path//':'//to_text(line)//': '//what
      call raise(error, EXIT_BAD_INPUT, message, 'read_point_file')
    end subroutine complain
  end subroutine read_point_file

  pure function count_lines(text) result(lines)
    character(len=*), intent(in) :: text
    integer :: lines, k

    lines = 1
    do k = 1, len(text)
      if (text(k:k) == achar(10)) lines = lines + 1
    end do
  end function count_lines

  !> The line without the carriage return of other systems.
  pure function bare(line) result(text)
    character(len=*), intent(in) :: line
    character(len=:), allocatable :: text

    text = line
    if (len(text) == 0) return
    if (text(len(text):) == achar(13)) text = text(:len(text) - 1)
  end function bare

  pure function columns_of(head) result(columns)
    character(len=*), intent(in) :: head
    integer :: columns

    columns = 0
    if (bare(head) == SHORT_HEAD) columns = 4
    if (bare(head) == LONG_HEAD) columns = 6
  end function columns_of

  !> The numbers of one line; velocities that it has not got are 0.
  subroutine read_row(line, columns, row, error)
    character(len=*), intent(in) :: line
    integer, intent(in) :: columns
    real(wp), intent(out) :: row(6)
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: fault
    integer :: k, start, length

    row = 0.0_wp
    start = 1
    do k = 1, columns
      length = index(line(start:)//',', ',') - 1
      call parse_real(trim(adjustl(line(start:start + length - 1))), row(k), fault)
      if (allocated(fault)) then
        if (len(fault) > 0) call raise(error, EXIT_BAD_INPUT, 'value '//to_text(k)//': '//fault, &
          'read_row')
      end if
      if (allocated(error)) return
      start = start + length + 1
      if (start > len(line) + 1 .and. k < columns) then
        call raise(error, EXIT_BAD_INPUT, 'there are '//to_text(k)//' values instead of '// &
          to_text(columns), 'read_row')
        return
      end if
    end do
    if (start <= len(line)) call raise(error, EXIT_BAD_INPUT, 'there are more than '// &
      to_text(columns)//' values', 'read_row')
  end subroutine read_row
end module sg_point_file
