!> Files that survive a kill, signals, host name and time of day: what the operating system offers
!> and Fortran does not reach.
module sg_posix
  use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_int32_t, c_int64_t, c_int8_t, &
    c_null_char
  use sg_errors, only: error_t, EXIT_BAD_INPUT, EXIT_INTERNAL, raise
  use sg_kinds, only: i1, i4, i8, wp
  implicit none
  private

  public :: append_file_t
  public :: catch_signals, caught_signal
  public :: end_program
  public :: file_exists, read_file, read_text, replace_file, write_file, make_directory
  public :: remove_file, remove_files
  public :: host_name, utc_time, working_directory, sleep_seconds, checksum, hash_text, hash_of_file

  !> A file to which bytes are added: after `append` they outlive this process, after `sync` they
  !> are on disk.
  type :: append_file_t
    private
    integer(c_int) :: descriptor = -1
    character(len=:), allocatable :: path
  contains
    procedure :: open => open_append_file
    procedure :: lock => lock_append_file
    procedure :: append => append_bytes
    procedure :: sync => sync_append_file
    procedure :: truncate => truncate_append_file
    procedure :: close => close_append_file
  end type append_file_t

  interface
    subroutine c_exit(code) bind(c, name='exit')
      import :: c_int
      implicit none
      integer(c_int), value :: code
    end subroutine c_exit

    function sg_catch_signals() bind(c) result(status)
      import :: c_int
      implicit none
      integer(c_int) :: status
    end function sg_catch_signals

    function sg_caught_signal() bind(c) result(number)
      import :: c_int
      implicit none
      integer(c_int) :: number
    end function sg_caught_signal

    function sg_open_append(path) bind(c) result(descriptor)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int) :: descriptor
    end function sg_open_append

    function sg_close(descriptor) bind(c) result(status)
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int) :: status
    end function sg_close

    function sg_append(descriptor, bytes, length) bind(c) result(status)
      import :: c_int, c_int64_t, c_int8_t
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int8_t), intent(in) :: bytes(*)
      integer(c_int64_t), value :: length
      integer(c_int) :: status
    end function sg_append

    function sg_sync(descriptor) bind(c) result(status)
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int) :: status
    end function sg_sync

    function sg_truncate(descriptor, length) bind(c) result(status)
      import :: c_int, c_int64_t
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int64_t), value :: length
      integer(c_int) :: status
    end function sg_truncate

    function sg_lock(descriptor) bind(c) result(status)
      import :: c_int
      implicit none
      integer(c_int), value :: descriptor
      integer(c_int) :: status
    end function sg_lock

    function sg_file_size(path) bind(c) result(length)
      import :: c_char, c_int64_t
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int64_t) :: length
    end function sg_file_size

    function sg_read(path, bytes, length) bind(c) result(got)
      import :: c_char, c_int64_t, c_int8_t
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int8_t), intent(out) :: bytes(*)
      integer(c_int64_t), value :: length
      integer(c_int64_t) :: got
    end function sg_read

    function sg_replace(from, to) bind(c) result(status)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: from(*), to(*)
      integer(c_int) :: status
    end function sg_replace

    function sg_make_directory(path) bind(c) result(status)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int) :: status
    end function sg_make_directory

    function sg_remove_file(path) bind(c) result(status)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int) :: status
    end function sg_remove_file

    function sg_remove_files(directory, suffix) bind(c) result(status)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(in) :: directory(*), suffix(*)
      integer(c_int) :: status
    end function sg_remove_files

    subroutine sg_error_text(number, text, capacity) bind(c)
      import :: c_char, c_int
      implicit none
      integer(c_int), value :: number, capacity
      character(kind=c_char), intent(out) :: text(*)
    end subroutine sg_error_text

    subroutine sg_host_name(text, capacity) bind(c)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(out) :: text(*)
      integer(c_int), value :: capacity
    end subroutine sg_host_name

    subroutine sg_working_directory(text, capacity) bind(c)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(out) :: text(*)
      integer(c_int), value :: capacity
    end subroutine sg_working_directory

    subroutine sg_utc_time(text, capacity) bind(c)
      import :: c_char, c_int
      implicit none
      character(kind=c_char), intent(out) :: text(*)
      integer(c_int), value :: capacity
    end subroutine sg_utc_time

    subroutine sg_sleep(seconds) bind(c)
      import :: c_double
      implicit none
      real(c_double), value :: seconds
    end subroutine sg_sleep

    function sg_crc32(bytes, length) bind(c) result(crc)
      import :: c_int32_t, c_int64_t, c_int8_t
      implicit none
      integer(c_int8_t), intent(in) :: bytes(*)
      integer(c_int64_t), value :: length
      integer(c_int32_t) :: crc
    end function sg_crc32

    function sg_fnv1a(bytes, length) bind(c) result(hash)
      import :: c_int64_t, c_int8_t
      implicit none
      integer(c_int8_t), intent(in) :: bytes(*)
      integer(c_int64_t), value :: length
      integer(c_int64_t) :: hash
    end function sg_fnv1a
  end interface

contains

  !> From now on SIGTERM, SIGUSR1 and SIGINT only set what `caught_signal` returns.
  subroutine catch_signals(error)
    type(error_t), allocatable, intent(out) :: error

    call check(sg_catch_signals(), 'cannot catch signals', 'catch_signals', EXIT_INTERNAL, error)
  end subroutine catch_signals

  !> Number of the last signal caught, or 0.
  function caught_signal() result(number)
    integer :: number

    number = int(sg_caught_signal())
  end function caught_signal

  !> Opens or makes the file.
  subroutine open_append_file(this, path, error)
    class(append_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error

    this%path = path
    this%descriptor = sg_open_append(c_text(path))
    call check(min(this%descriptor, 0), 'cannot open '//path//' for writing', &
      'open_append_file', EXIT_BAD_INPUT, error)
  end subroutine open_append_file

  !> `locked` is false when another process holds the lock. The lock ends with this process.
  subroutine lock_append_file(this, locked, error)
    class(append_file_t), intent(in) :: this
    logical, intent(out) :: locked
    type(error_t), allocatable, intent(out) :: error
    integer(c_int) :: status

    status = sg_lock(this%descriptor)
    locked = status == 1
    call check(min(status, 0), 'cannot lock '//this%path, 'lock_append_file', EXIT_BAD_INPUT, error)
  end subroutine lock_append_file

  subroutine append_bytes(this, bytes, error)
    class(append_file_t), intent(in) :: this
    integer(i1), intent(in) :: bytes(:)
    type(error_t), allocatable, intent(out) :: error

    call check(sg_append(this%descriptor, bytes, size(bytes, kind=i8)), &
      'cannot write '//this%path, 'append_bytes', EXIT_INTERNAL, error)
  end subroutine append_bytes

  !> Returns when all bytes are on disk.
  subroutine sync_append_file(this, error)
    class(append_file_t), intent(in) :: this
    type(error_t), allocatable, intent(out) :: error

    call check(sg_sync(this%descriptor), 'cannot write '//this%path, 'sync_append_file', &
      EXIT_INTERNAL, error)
  end subroutine sync_append_file

  !> Cuts the file to `length` bytes.
  subroutine truncate_append_file(this, length, error)
    class(append_file_t), intent(in) :: this
    integer(i8), intent(in) :: length
    type(error_t), allocatable, intent(out) :: error

    call check(sg_truncate(this%descriptor, length), &
      'cannot truncate '//this%path, 'truncate_append_file', EXIT_INTERNAL, error)
  end subroutine truncate_append_file

  subroutine close_append_file(this)
    class(append_file_t), intent(inout) :: this
    integer(c_int) :: status

    if (this%descriptor < 0) return
    ! What has to be safe was synced before: nothing can be lost here.
    status = sg_close(this%descriptor)
    this%descriptor = -1
  end subroutine close_append_file

  !> Of any kind; false also where it cannot be looked at.
  function file_exists(path) result(exists)
    character(len=*), intent(in) :: path
    logical :: exists

    exists = sg_file_size(c_text(path)) >= 0
  end function file_exists

  !> The whole file as bytes.
  subroutine read_file(path, bytes, error)
    character(len=*), intent(in) :: path
    integer(i1), allocatable, intent(out) :: bytes(:)
    type(error_t), allocatable, intent(out) :: error
    integer(c_int64_t) :: length

    length = sg_file_size(c_text(path))
    if (length >= 0) then
      allocate (bytes(length))
      length = sg_read(c_text(path), bytes, length)
    end if
    call check(int(min(length, 0_c_int64_t), c_int), 'cannot read '//path, 'read_file', &
      EXIT_BAD_INPUT, error)
    if (.not. allocated(error)) bytes = bytes(:length)
  end subroutine read_file

  !> A whole text file.
  subroutine read_text(path, text, error)
    character(len=*), intent(in) :: path
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error
    integer(i1), allocatable :: bytes(:)

    text = ''
    call read_file(path, bytes, error)
    if (allocated(error)) return
    text = repeat(' ', size(bytes))
    text = transfer(bytes, text)
  end subroutine read_text

  !> Ends the program with an exit code, without a word (a Fortran stop would print one).
  subroutine end_program(code)
    integer, intent(in) :: code

    call c_exit(int(code, c_int))
  end subroutine end_program

  !> Puts `from` in the place of `to`, at once and synced.
  subroutine replace_file(from, to, error)
    character(len=*), intent(in) :: from, to
    type(error_t), allocatable, intent(out) :: error

    call check(sg_replace(c_text(from), c_text(to)), 'cannot put '//from//' in the place of '//to, &
      'replace_file', EXIT_INTERNAL, error)
  end subroutine replace_file

  !> A text file, complete or not there at all.
  subroutine write_file(path, text, error)
    character(len=*), intent(in) :: path, text
    type(error_t), allocatable, intent(out) :: error
    type(append_file_t) :: file
    integer(i1), allocatable :: bytes(:)

    allocate (bytes(len(text)))
    bytes = transfer(text, bytes, len(text))
    call file%open(path//'.new', error)
    if (allocated(error)) return
    call file%truncate(0_i8, error)
    if (.not. allocated(error)) call file%append(bytes, error)
    call file%close()
    if (.not. allocated(error)) call replace_file(path//'.new', path, error)
  end subroutine write_file

  !> Makes the directory and those above it; fine if it exists.
  subroutine make_directory(path, error)
    character(len=*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error

    call check(sg_make_directory(c_text(path)), 'cannot make the directory '//path, &
      'make_directory', EXIT_BAD_INPUT, error)
  end subroutine make_directory

  !> Fine if it is not there.
  subroutine remove_file(path, error)
    character(len=*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error

    call check(sg_remove_file(c_text(path)), 'cannot remove '//path, 'remove_file', &
      EXIT_BAD_INPUT, error)
  end subroutine remove_file

  !> All files of a directory whose names end in `suffix`; fine if there is no such directory.
  subroutine remove_files(directory, suffix, error)
    character(len=*), intent(in) :: directory, suffix
    type(error_t), allocatable, intent(out) :: error

    call check(sg_remove_files(c_text(directory), c_text(suffix)), &
      'cannot remove files of '//directory, 'remove_files', EXIT_BAD_INPUT, error)
  end subroutine remove_files

  function host_name() result(name)
    character(len=:), allocatable :: name
    character(kind=c_char, len=1) :: buffer(256)

    call sg_host_name(buffer, size(buffer))
    name = fortran_text(buffer)
  end function host_name

  !> Absolute path of the directory in which the program was started, `.` if nobody knows.
  function working_directory() result(path)
    character(len=:), allocatable :: path
    character(kind=c_char, len=1) :: buffer(4096)

    call sg_working_directory(buffer, size(buffer))
    path = fortran_text(buffer)
  end function working_directory

  !> Now, like 2026-01-31T12:00:00Z.
  function utc_time() result(text)
    character(len=:), allocatable :: text
    character(kind=c_char, len=1) :: buffer(32)

    call sg_utc_time(buffer, size(buffer))
    text = fortran_text(buffer)
  end function utc_time

  subroutine sleep_seconds(seconds)
    real(wp), intent(in) :: seconds

    call sg_sleep(real(seconds, c_double))
  end subroutine sleep_seconds

  !> CRC-32 of bytes.
  function checksum(bytes) result(crc)
    integer(i1), intent(in) :: bytes(:)
    integer(i4) :: crc

    crc = sg_crc32(bytes, size(bytes, kind=i8))
  end function checksum

  !> 64-bit FNV-1a hash of a text, as 16 hexadecimal digits.
  function hash_text(text) result(digits)
    character(len=*), intent(in) :: text
    character(len=16) :: digits
    integer(i1), allocatable :: bytes(:)

    allocate (bytes(len(text)))
    bytes = transfer(text, bytes, len(text))
    write (digits, '(z16.16)') sg_fnv1a(bytes, size(bytes, kind=i8))
  end function hash_text

  !> Hash of what a file holds; empty if it cannot be read.
  function hash_of_file(path) result(digits)
    character(len=*), intent(in) :: path
    character(len=:), allocatable :: digits
    character(len=:), allocatable :: text
    type(error_t), allocatable :: error

    digits = ''
    call read_text(path, text, error)
    if (.not. allocated(error)) digits = hash_text(text)
  end function hash_of_file

  !> Sets `error` when `status` is negative: minus the error number of the system.
  subroutine check(status, message, place, code, error)
    integer(c_int), intent(in) :: status
    character(len=*), intent(in) :: message, place
    integer, intent(in) :: code
    type(error_t), allocatable, intent(out) :: error
    character(kind=c_char, len=1) :: buffer(256)

    if (status >= 0) return
    call sg_error_text(-status, buffer, size(buffer))
    call raise(error, code, message//': '//fortran_text(buffer), place)
  end subroutine check

  pure function c_text(text) result(chars)
    character(len=*), intent(in) :: text
    character(kind=c_char, len=1) :: chars(len(text) + 1)
    integer :: i

    do i = 1, len(text)
      chars(i) = text(i:i)
    end do
    chars(len(text) + 1) = c_null_char
  end function c_text

  pure function fortran_text(chars) result(text)
    character(kind=c_char, len=1), intent(in) :: chars(:)
    character(len=:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, size(chars)
      if (chars(i) == c_null_char) exit
      text = text//chars(i)
    end do
  end function fortran_text
end module sg_posix
