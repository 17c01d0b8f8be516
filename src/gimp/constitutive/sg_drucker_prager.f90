!> Drucker-Prager plasticity with a limit of mean stress: exact return for a whole block at once.
!>
!> With q = sqrt(J2) and m = I1/3, tension positive:
!>   yield    f = q + 3 alpha m - k <= 0,  m <= T
!>   flow     g = q + 3 alpha_f m on the cone, associated on the limit
!>   return   q - G l, m - 3 K alpha_f l with l = f/(G + 9 K alpha alpha_f); where that leaves m > T
!>            (the tip of the cone is such a place): m = T, q = min(q, k - 3 alpha T)
!> The deviator keeps its direction, so two numbers describe the return, and it is exact. Von Mises
!> is alpha = alpha_f = 0. At q = 0 on the limit the volumetric strain that makes no stress opens
!> the gap (see sg_mohr_coulomb).
module sg_drucker_prager
  use sg_kinds, only: wp
  use sg_materials, only: material_t
  use sg_rounding, only: COARSENESS, LEAST_STRESS
  implicit none
  private

  public :: return_drucker_prager

  !> A deviator below this share of the stresses involved is rounding: the point is at the tip.
  real(wp), parameter :: ROUNDING = 1.0e-13_wp*COARSENESS

contains

  !> Returns the trial stresses of `n` points in place and adds to the gap of those at the tip.
  !> `k` and `mean_limit` are those of the points, whatever the material says.
  pure subroutine return_drucker_prager(n, material, k, mean_limit, sxx, syy, szz, sxy, gap)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: k(n), mean_limit(n)
    !> Pa; gap is a strain.
    real(wp), intent(inout) :: sxx(n), syy(n), szz(n), sxy(n), gap(n)
    real(wp) :: mean, dxx, dyy, dzz, q, multiplier, new_mean, new_q, ratio, stiffness, at_limit
    integer :: p
    logical :: limited

    stiffness = material%shear + 9.0_wp*material%bulk*material%alpha*material%alpha_flow
    !$omp simd private(mean, dxx, dyy, dzz, q, multiplier, new_mean, new_q, ratio, limited) &
    !$omp& private(at_limit)
    do p = 1, n
      at_limit = max(k(p) - 3.0_wp*material%alpha*mean_limit(p), 0.0_wp)
      mean = (sxx(p) + syy(p) + szz(p))/3.0_wp
      dxx = sxx(p) - mean
      dyy = syy(p) - mean
      dzz = szz(p) - mean
      q = sqrt(0.5_wp*(dxx*dxx + dyy*dyy + dzz*dzz) + sxy(p)*sxy(p))
      multiplier = max(q + 3.0_wp*material%alpha*mean - k(p), 0.0_wp)/stiffness
      new_q = q - material%shear*multiplier
      new_mean = mean - 3.0_wp*material%bulk*material%alpha_flow*multiplier
      limited = new_mean > mean_limit(p)
      new_q = merge(min(q, at_limit), new_q, limited)
      new_mean = min(new_mean, mean_limit(p))
      ratio = new_q/max(q, LEAST_STRESS)
      ! The mean is moved by its change, so that a stress within the cone stays as it is.
      sxx(p) = mean + ratio*dxx + (new_mean - mean)
      syy(p) = mean + ratio*dyy + (new_mean - mean)
      szz(p) = mean + ratio*dzz + (new_mean - mean)
      sxy(p) = ratio*sxy(p)
      gap(p) = gap(p) + merge((mean - new_mean)/material%bulk, 0.0_wp, &
        limited .and. new_q <= ROUNDING*(abs(mean) + q + k(p)))
    end do
  end subroutine return_drucker_prager
end module sg_drucker_prager
