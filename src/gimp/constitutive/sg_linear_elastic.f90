!> Isotropic linear elasticity in rate form with the Jaumann rate, and the kinematics all materials
!> share.
!>
!> Per step, with L the velocity gradient: strain increment = sym(L) dt, rotation angle w = (L_yx -
!> L_xy) dt/2. Stress is turned by the rotation in the Cayley (midpoint) form, tan(theta) = w for
!> half the angle of the stress deviator, orthogonal to rounding (Hughes & Winget 1980), and then
!> takes the elastic increment.
module sg_linear_elastic
  use sg_kinds, only: wp
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: strain_t, find_strain, predict_stress, stress_power

  !> Strain increments of up to BLOCK points; exy is the tensor component.
  type :: strain_t
    real(wp) :: exx(BLOCK), eyy(BLOCK), exy(BLOCK)
  end type strain_t

contains

  !> Strain increments from gradient(p, :) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy).
  pure subroutine find_strain(n, time_step, gradient, strain)
    integer, intent(in) :: n
    real(wp), intent(in) :: time_step
    real(wp), intent(in) :: gradient(BLOCK, 4)
    type(strain_t), intent(inout) :: strain
    integer :: p

    !$omp simd
    do p = 1, n
      strain%exx(p) = time_step*gradient(p, 1)
      strain%eyy(p) = time_step*gradient(p, 4)
      strain%exy(p) = 0.5_wp*time_step*(gradient(p, 2) + gradient(p, 3))
    end do
  end subroutine find_strain

  !> Volume and stress after a step without plastic flow. Volume grows by exp(tr e), to second
  !> order: a pure rotation leaves it alone. Stress turns with the material and takes the elastic
  !> answer to the `share` of the strain increment that strains it (below 1 only for a point that
  !> first has a gap to close); `strain` is that share. Adds sum V sigma : e, with the first V and
  !> sigma, to `power` (J/m).
  pure subroutine predict_stress(n, time_step, gradient, share, lame, shear, volume, sxx, syy, &
    szz, sxy, strain, power)
    integer, intent(in) :: n
    !> Gradient as in find_strain; Lame's constants in Pa.
    real(wp), intent(in) :: time_step, gradient(BLOCK, 4), share(BLOCK), lame, shear
    !> m^2 and Pa.
    real(wp), intent(inout) :: volume(n), sxx(n), syy(n), szz(n), sxy(n)
    type(strain_t), intent(inout) :: strain
    real(wp), intent(inout) :: power
    real(wp) :: half_step, mean, half_difference, shear_stress, trace, turn, cosine, sine, spin
    real(wp) :: exx, eyy, exy
    integer :: p

    half_step = 0.5_wp*time_step
    !$omp simd private(mean, half_difference, shear_stress, trace, turn, cosine, sine, spin) &
    !$omp& private(exx, eyy, exy) reduction(+:power)
    do p = 1, n
      exx = time_step*gradient(p, 1)
      eyy = time_step*gradient(p, 4)
      spin = half_step*(gradient(p, 2) - gradient(p, 3))
      trace = exx + eyy
      exx = share(p)*exx
      eyy = share(p)*eyy
      exy = share(p)*half_step*(gradient(p, 2) + gradient(p, 3))
      power = power + volume(p)*(sxx(p)*exx + syy(p)*eyy + 2.0_wp*sxy(p)*exy)
      volume(p) = volume(p)*(1.0_wp + trace*(1.0_wp + 0.5_wp*trace))
      mean = 0.5_wp*(sxx(p) + syy(p))
      half_difference = 0.5_wp*(sxx(p) - syy(p))
      ! cos and sin of twice the rotation angle, tan(angle) = spin
      turn = 2.0_wp/(1.0_wp + spin*spin)
      cosine = turn - 1.0_wp
      sine = spin*turn
      shear_stress = half_difference*sine + sxy(p)*cosine
      half_difference = half_difference*cosine - sxy(p)*sine
      mean = mean + (lame + shear)*(exx + eyy)
      half_difference = half_difference + shear*(exx - eyy)
      sxx(p) = mean + half_difference
      syy(p) = mean - half_difference
      szz(p) = szz(p) + lame*(exx + eyy)
      sxy(p) = shear_stress + 2.0_wp*shear*exy
      strain%exx(p) = exx
      strain%eyy(p) = eyy
      strain%exy(p) = exy
    end do
  end subroutine predict_stress

  !> Sum over points of V sigma : strain increment, in J/m.
  pure function stress_power(n, strain, volume, sxx, syy, sxy) result(power)
    integer, intent(in) :: n
    type(strain_t), intent(in) :: strain
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    real(wp) :: power
    integer :: p

    power = 0.0_wp
    !$omp simd reduction(+:power)
    do p = 1, n
      power = power + volume(p)*(sxx(p)*strain%exx(p) + syy(p)*strain%eyy(p) &
        + 2.0_wp*sxy(p)*strain%exy(p))
    end do
  end function stress_power
end module sg_linear_elastic
