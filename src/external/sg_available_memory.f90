!> How much memory the machine can still give.
module sg_available_memory
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_kinds, only: i8, wp
  use sg_text, only: to_text
  implicit none
  private

  public :: available_memory, require_memory, text_of_bytes

contains

  !> Bytes that can be taken without swapping, as Linux estimates it; huge where it does not say.
  !> Ranks on one machine share them.
  function available_memory() result(bytes)
    integer(i8) :: bytes
    character(len=128) :: line
    integer :: unit, status

    bytes = huge(bytes)
    open (newunit=unit, file='/proc/meminfo', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:13) /= 'MemAvailable:') cycle
      read (line(14:), *, iostat=status) bytes ! in KiB
      if (status == 0) bytes = bytes*1024_i8
      if (status /= 0) bytes = huge(bytes)
      exit
    end do
    close (unit)
  end function available_memory

  !> Refuses, before anything is allocated, what the machine cannot hold.
  subroutine require_memory(bytes, purpose, advice, error)
    integer(i8), intent(in) :: bytes
    !> What needs it, and what to do instead.
    character(len=*), intent(in) :: purpose, advice
    type(error_t), allocatable, intent(out) :: error
    integer(i8) :: available

    available = available_memory()
    if (bytes > available) call raise(error, EXIT_BAD_INPUT, purpose//' needs '// &
      text_of_bytes(bytes)//' of memory, the machine has '//text_of_bytes(available)// &
      ' left: '//advice, 'require_memory')
  end subroutine require_memory

  !> Bytes as people say them, in powers of 1000.
  pure function text_of_bytes(bytes) result(text)
    integer(i8), intent(in) :: bytes
    character(len=:), allocatable :: text
    character(len=2), parameter :: UNITS(5) = ['B ', 'kB', 'MB', 'GB', 'TB']
    real(wp) :: value
    integer :: unit

    value = real(bytes, wp)
    unit = 1
    do while (value >= 1000.0_wp .and. unit < size(UNITS))
      value = value/1000.0_wp
      unit = unit + 1
    end do
    text = to_text(value, 3)//' '//trim(UNITS(unit))
  end function text_of_bytes
end module sg_available_memory
