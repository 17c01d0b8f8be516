!> Wall clock.
module sg_timer
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: wall_seconds

contains

  !> Seconds since an arbitrary origin, monotonic, with the resolution of the system clock.
  function wall_seconds() result(seconds)
    real(wp) :: seconds
    integer(i8) :: count, rate

    call system_clock(count, rate)
    seconds = real(count, wp)/real(rate, wp)
  end function wall_seconds
end module sg_timer
