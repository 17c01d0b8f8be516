!> Mohr-Coulomb whose strength falls and whose dilation fades with the equivalent plastic strain
!> kappa.
!>
!>   phi, c   linear from their first values at softening_start to the residual ones at
!>            softening_end
!>   psi      linear from its first value at 0 to nothing at dilation_end; never above phi, where
!>            plastic flow would give energy back
!> The strength that returns a stress is that at the end of the step: kappa = kappa_n + dkappa(phi,
!> c, psi), found by fixed-point iteration, which contracts by (softening modulus)/(2 G) a round.
!> Where it does not (a drop of strength within a strain that is elastic), the strength at the start
!> of the step stays.
module sg_softening
  use sg_kinds, only: wp
  use sg_materials, only: material_t, mohr_coulomb_strength
  use sg_mohr_coulomb, only: return_cracked
  use sg_rounding, only: COARSENESS
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: first_strength_t, return_softening, plastic_strain_increment

  !> Rounds of the iteration, and the change of kappa at which it ends.
  integer, parameter :: MOST_ROUNDS = 60
  real(wp), parameter :: CONVERGED = 1.0e-14_wp*COARSENESS
  real(wp), parameter :: DEGREE = acos(-1.0_wp)/180.0_wp

  !> What the points of a block have before they soften: angles in degrees, Pa, the sine of the
  !> dilation angle, and Young's modulus over that of the material.
  type :: first_strength_t
    real(wp) :: friction_angle(BLOCK), cohesion(BLOCK), dilation_angle(BLOCK), sin_dilation(BLOCK)
    real(wp) :: stiffness(BLOCK)
  end type first_strength_t

contains

  !> As return_cracked, with strength and dilation from `plastic_strain`, which grows. A point that
  !> is weaker than the residual strength of its material from the `first` does not soften.
  subroutine return_softening(n, material, first, plastic_strain, sxx, syy, szz, sxy, gap, &
    crack)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    type(first_strength_t), intent(in) :: first
    real(wp), intent(inout) :: plastic_strain(n), sxx(n), syy(n), szz(n), sxy(n), gap(n), &
      crack(:, :)
    real(wp) :: trial(BLOCK, 4), first_gap(n), first_crack(4, size(crack, 2))
    real(wp) :: kappa(n), next(n), change
    integer :: round

    trial(:n, 1) = sxx
    trial(:n, 2) = syy
    trial(:n, 3) = szz
    trial(:n, 4) = sxy
    first_gap = gap
    first_crack = crack
    kappa = plastic_strain
    do round = 1, MOST_ROUNDS
      call return_with(kappa)
      next = plastic_strain + plastic_strain_increment(n, material%shear, trial, sxx, syy, szz, &
        sxy)/first%stiffness(:n)
      change = maxval(abs(next - kappa))
      if (.not. change > CONVERGED) exit
      kappa = next
    end do
    if (change > CONVERGED) then
      call return_with(merge(plastic_strain, kappa, abs(next - kappa) > CONVERGED))
      next = plastic_strain + plastic_strain_increment(n, material%shear, trial, sxx, syy, szz, &
        sxy)/first%stiffness(:n)
    end if
    plastic_strain = next

  contains

    !> The return of the trial stresses with the strength at `strain`.
    subroutine return_with(strain)
      real(wp), intent(in) :: strain(n)
      real(wp) :: share(n), sin_friction(n), cohesion_term(n), tension_limit(n), sin_dilation(n)

      share = min(max((strain - material%softening_start)/(material%softening_end &
        - material%softening_start), 0.0_wp), 1.0_wp)
      associate (phi => first%friction_angle(:n), c => first%cohesion(:n))
        call mohr_coulomb_strength(material, phi + share*min(0.0_wp, &
          material%residual_friction_angle - phi), c + share*min(0.0_wp, &
          material%residual_cohesion - c), sin_friction, cohesion_term, tension_limit)
      end associate
      sin_dilation = first%sin_dilation(:n)
      if (material%dilation_end > 0.0_wp) sin_dilation = sin(DEGREE*first%dilation_angle(:n) &
        *max(1.0_wp - strain/material%dilation_end, 0.0_wp))
      sin_dilation = min(sin_dilation, sin_friction)
      sxx = trial(:n, 1)
      syy = trial(:n, 2)
      szz = trial(:n, 3)
      sxy = trial(:n, 4)
      gap = first_gap
      crack = first_crack
      call return_cracked(n, material, sin_friction, cohesion_term, tension_limit, sin_dilation, &
        sxx, syy, szz, sxy, gap, crack)
    end subroutine return_with
  end subroutine return_softening

  !> sqrt(2/3 e:e) with e = dev(trial - returned)/(2 G): the growth of the equivalent plastic
  !> strain.
  pure function plastic_strain_increment(n, shear, trial, sxx, syy, szz, sxy) result(increment)
    integer, intent(in) :: n
    real(wp), intent(in) :: shear, trial(BLOCK, 4), sxx(n), syy(n), szz(n), sxy(n)
    real(wp) :: increment(n), dxx, dyy, dzz, dxy, mean
    integer :: p

    !$omp simd private(dxx, dyy, dzz, dxy, mean)
    do p = 1, n
      dxx = trial(p, 1) - sxx(p)
      dyy = trial(p, 2) - syy(p)
      dzz = trial(p, 3) - szz(p)
      dxy = trial(p, 4) - sxy(p)
      mean = (dxx + dyy + dzz)/3.0_wp
      increment(p) = sqrt(2.0_wp/3.0_wp*((dxx - mean)**2 + (dyy - mean)**2 + (dzz - mean)**2 &
        + 2.0_wp*dxy**2))/(2.0_wp*shear)
    end do
  end function plastic_strain_increment
end module sg_softening
