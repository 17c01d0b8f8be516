!> Why a call of HDF5 failed, in the words of the operating system.
module sg_hdf5_reason
  use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_funloc, c_funptr, c_int, &
    c_int64_t, c_loc, c_null_char, c_ptr
  implicit none
  private

  public :: system_reason

  integer, parameter :: LONGEST = 256
  integer(c_int64_t), parameter :: DEFAULT_STACK = 0
  integer(c_int), parameter :: UPWARD = 0

  !> H5E_error2_t; identifiers have 64 bits since HDF5 1.10.
  type, bind(c) :: entry_t
    integer(c_int64_t) :: class_id, major, minor
    integer(c_int) :: line
    type(c_ptr) :: procedure_name, file_name, description
  end type entry_t

  type :: reason_t
    character(len=LONGEST) :: text = ''
  end type reason_t

  interface
    !> Not in the Fortran interface of the library.
    function walk_stack(stack, direction, visit, found) bind(c, name='H5Ewalk2') result(status)
      import :: c_funptr, c_int, c_int64_t, c_ptr
      implicit none
      integer(c_int64_t), value :: stack
      integer(c_int), value :: direction
      type(c_funptr), value :: visit
      type(c_ptr), value :: found
      integer(c_int) :: status
    end function walk_stack
  end interface

contains

  !> After a call that failed and before the next one: `: No space left on device`, or nothing if
  !> the system had no part in it.
  function system_reason() result(text)
    character(len=:), allocatable :: text
    type(reason_t), target :: found
    integer(c_int) :: status

    status = walk_stack(DEFAULT_STACK, UPWARD, c_funloc(note_entry), c_loc(found))
    text = ''
    if (status >= 0 .and. found%text /= '') text = ': '//trim(found%text)
  end function system_reason

  !> Called for each entry of the stack. Those of the system say
  !> `..., errno = 28, error message = 'No space left on device', ...`.
  function note_entry(number, entry, found) bind(c) result(status)
    integer(c_int), value :: number
    type(entry_t), intent(in) :: entry
    type(c_ptr), value :: found
    integer(c_int) :: status
    character(len=*), parameter :: MARK = "error message = '"
    character(kind=c_char, len=1), pointer :: letters(:)
    character(len=4*LONGEST) :: line
    type(reason_t), pointer :: reason
    integer :: first, length

    status = 0
    call c_f_pointer(found, reason)
    call c_f_pointer(entry%description, letters, [len(line)])
    line = ''
    do length = 1, len(line)
      if (letters(length) == c_null_char) exit
      line(length:length) = letters(length)
    end do
    first = index(line, MARK) + len(MARK)
    if (first > len(MARK) .and. number >= 0) reason%text = &
      line(first:first + index(line(first:), "'") - 2)
  end function note_entry
end module sg_hdf5_reason
