!> What people and programs read while a run goes on: lines on the screen and in DIR/run.log, and
!> events in DIR/events.jsonl. Both files are opened for each line, so that nothing is lost by a
!> kill;
!> lines follow time, not steps.
module sg_progress
  use, intrinsic :: iso_fortran_env, only: output_unit
  use sg_kinds, only: i8, wp
  use sg_posix, only: utc_time
  use sg_text, only: text_of_duration, to_text
  implicit none
  private

  public :: progress_t, id_list, json_text

  type :: progress_t
    character(len=:), allocatable :: directory
    !> Also on the screen.
    logical :: on_screen = .true.
  contains
    procedure :: say
    procedure :: tell
    procedure :: report
  end type progress_t

contains

  !> A line for people.
  subroutine say(this, text)
    class(progress_t), intent(in) :: this
    character(len=*), intent(in) :: text

    if (this%on_screen) then
      write (output_unit, '(a)') text
      flush (output_unit)
    end if
    call add_line(this%directory//'/run.log', utc_time()//' '//text)
  end subroutine say

  !> An event for programs: `members` are further members of the JSON object, like `"done":3`.
  subroutine tell(this, event, members)
    class(progress_t), intent(in) :: this
    character(len=*), intent(in) :: event, members
    character(len=:), allocatable :: rest

    rest = ''
    if (len(members) > 0) rest = ','//members
    call add_line(this%directory//'/events.jsonl', &
      '{"time":"'//utc_time()//'","event":"'//event//'"'//rest//'}')
  end subroutine tell

  !> The progress line: `seconds` since the start, in which `fresh` members were computed; `running`
  !> says what is known of the runout. `expected` members will have been needed in the end, of
  !> `total` that may be.
  subroutine report(this, done, total, expected, failed, fresh, seconds, running)
    class(progress_t), intent(in) :: this
    integer(i8), intent(in) :: done, total, expected, failed, fresh
    real(wp), intent(in) :: seconds
    character(len=*), intent(in) :: running
    character(len=:), allocatable :: rate, needed, eta, eta_seconds

    rate = 'unknown'
    eta = 'unknown'
    eta_seconds = 'null'
    needed = ''
    if (expected < total) needed = 'about '//to_text(expected - done)//' members more, '
    if (fresh > 0 .and. seconds > 0.0_wp) then
      rate = to_text(60.0_wp*fresh/seconds, 3)//'/min'
      eta = text_of_duration(seconds*(expected - done)/fresh)
      eta_seconds = to_text(seconds*(expected - done)/fresh, 6)
    end if
    call this%say(to_text(done)//'/'//to_text(total)//' done, '//to_text(failed)//' failed, '// &
      rate//', '//needed//'ETA '//eta//running)
    call this%tell('progress', '"done":'//to_text(done)//',"total":'//to_text(total)// &
      ',"expected":'//to_text(expected)//',"failed":'//to_text(failed)//',"seconds":'// &
      to_text(seconds, 6)//',"eta_seconds":'//eta_seconds)
  end subroutine report

  !> A log that cannot be written does not end the run: results are in the journal, whose writes are
  !> looked at.
  subroutine add_line(path, text)
    character(len=*), intent(in) :: path, text
    integer :: unit, status, written

    open (newunit=unit, file=path, position='append', action='write', iostat=status)
    if (status /= 0) return
    write (unit, '(a)', iostat=written) text
    close (unit, iostat=status)
    if (max(written, status) > 0) return ! the line is lost, no result
  end subroutine add_line

  !> Ids that are marked, like `17-23,31`; the first is `id_of_first`.
  pure function id_list(marked, id_of_first) result(text)
    logical, intent(in) :: marked(:)
    integer(i8), intent(in) :: id_of_first
    character(len=:), allocatable :: text
    integer :: first, last

    text = ''
    first = 1
    do while (first <= size(marked))
      if (marked(first)) then
        last = first
        do while (last < size(marked))
          if (.not. marked(last + 1)) exit
          last = last + 1
        end do
        if (len(text) > 0) text = text//','
        text = text//to_text(id_of_first + first - 1)
        if (last > first) text = text//'-'//to_text(id_of_first + last - 1)
        first = last
      end if
      first = first + 1
    end do
  end function id_list

  !> A JSON string with its quotes.
  pure function json_text(text) result(quoted)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: quoted
    integer :: i

    quoted = '"'
    do i = 1, len(text)
      select case (iachar(text(i:i)))
      case (34, 92)
        quoted = quoted//achar(92)//text(i:i)
      case (10)
        quoted = quoted//achar(92)//'n'
      case (0:9, 11:31)
        quoted = quoted//' '
      case default
        quoted = quoted//text(i:i)
      end select
    end do
    quoted = quoted//'"'
  end function json_text
end module sg_progress
