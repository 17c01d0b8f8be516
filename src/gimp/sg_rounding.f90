!> What rounding means in the precision that the kernel is compiled for.
module sg_rounding
  use sg_kinds, only: dp, wp
  implicit none
  private

  public :: COARSENESS, LEAST_STRESS

  !> Unit of rounding over that of double precision: 1, or 2^29 in single. Tolerances that stand for
  !> a number of roundings are written for double precision and multiplied by it.
  real(wp), parameter :: COARSENESS = real(epsilon(1.0_wp)/epsilon(1.0_dp), wp)
  !> Guards the division by a stress, in Pa, where what it divides is 0 if the stress is. In single
  !> precision squares of less than 1e-19 vanish, and roots of such squares are no guide.
  real(wp), parameter :: LEAST_STRESS = real(merge(1.0e-100_dp, 1.0e-10_dp, wp == dp), wp)
end module sg_rounding
