!> Angles: degrees outside, radians inside.
module sg_angles
  use sg_kinds, only: wp
  implicit none
  private

  public :: DEGREE

  !> In radians.
  real(wp), parameter :: DEGREE = acos(-1.0_wp)/180.0_wp
end module sg_angles
