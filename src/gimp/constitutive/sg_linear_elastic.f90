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

  public :: strain_t, find_strain, update_volume, predict_stress, stress_power

  !> Strain increments of up to BLOCK points; exy is the tensor component, `share` the part of the
  !> increment that strains the material (below 1 only for a point that first has a gap to close).
  type :: strain_t
    real(wp) :: exx(BLOCK), eyy(BLOCK), exy(BLOCK), spin(BLOCK), share(BLOCK)
  end type strain_t

contains

  !> Strain increments from gradient(:, p) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy).
  pure subroutine find_strain(n, time_step, gradient, strain)
    integer, intent(in) :: n
    real(wp), intent(in) :: time_step
    real(wp), intent(in) :: gradient(4, BLOCK)
    type(strain_t), intent(inout) :: strain
    integer :: p

    !$omp simd
    do p = 1, n
      strain%exx(p) = time_step*gradient(1, p)
      strain%eyy(p) = time_step*gradient(4, p)
      strain%exy(p) = 0.5_wp*time_step*(gradient(2, p) + gradient(3, p))
      strain%spin(p) = 0.5_wp*time_step*(gradient(2, p) - gradient(3, p))
      strain%share(p) = 1.0_wp
    end do
  end subroutine find_strain

  !> V grows by exp(tr e), to second order: a pure rotation leaves it alone.
  pure subroutine update_volume(n, strain, volume)
    integer, intent(in) :: n
    type(strain_t), intent(in) :: strain
    real(wp), intent(inout) :: volume(n)
    real(wp) :: trace
    integer :: p

    !$omp simd private(trace)
    do p = 1, n
      trace = strain%exx(p) + strain%eyy(p)
      volume(p) = volume(p)*(1.0_wp + trace*(1.0_wp + 0.5_wp*trace))
    end do
  end subroutine update_volume

  !> Stress turned with the material, plus the elastic answer to `share` of the strain increment.
  pure subroutine predict_stress(n, lame, shear, strain, sxx, syy, szz, sxy)
    integer, intent(in) :: n
    !> Lame's constants in Pa.
    real(wp), intent(in) :: lame, shear
    type(strain_t), intent(in) :: strain
    real(wp), intent(inout) :: sxx(n), syy(n), szz(n), sxy(n)
    real(wp) :: mean, half_difference, shear_stress, trace, turn, cosine, sine
    integer :: p

    !$omp simd private(mean, half_difference, shear_stress, trace, turn, cosine, sine)
    do p = 1, n
      mean = 0.5_wp*(sxx(p) + syy(p))
      half_difference = 0.5_wp*(sxx(p) - syy(p))
      ! cos and sin of twice the rotation angle, tan(angle) = spin
      turn = 2.0_wp/(1.0_wp + strain%spin(p)*strain%spin(p))
      cosine = turn - 1.0_wp
      sine = strain%spin(p)*turn
      shear_stress = half_difference*sine + sxy(p)*cosine
      half_difference = half_difference*cosine - sxy(p)*sine
      trace = strain%share(p)*(strain%exx(p) + strain%eyy(p))
      mean = mean + (lame + shear)*trace
      half_difference = half_difference + shear*strain%share(p)*(strain%exx(p) - strain%eyy(p))
      sxx(p) = mean + half_difference
      syy(p) = mean - half_difference
      szz(p) = szz(p) + lame*trace
      sxy(p) = shear_stress + 2.0_wp*shear*strain%share(p)*strain%exy(p)
    end do
  end subroutine predict_stress

  !> Sum over points of V sigma : strain increment, in J/m, for the share of it that meets stress.
  pure function stress_power(n, strain, volume, sxx, syy, sxy) result(work)
    integer, intent(in) :: n
    type(strain_t), intent(in) :: strain
    real(wp), intent(in) :: volume(n), sxx(n), syy(n), sxy(n)
    real(wp) :: work
    integer :: p

    work = 0.0_wp
    !$omp simd reduction(+:work)
    do p = 1, n
      work = work + strain%share(p)*volume(p)*(sxx(p)*strain%exx(p) + syy(p)*strain%eyy(p) &
        + 2.0_wp*sxy(p)*strain%exy(p))
    end do
  end function stress_power
end module sg_linear_elastic
