!> Compressible neo-Hookean elasticity in the total deformation gradient F (plane strain, F_zz = 1):
!>   P = lambda ln J F^-T + mu (F - F^-T),  sigma = (lambda ln J I + mu (b - I))/J,  b = F F^T
!>   energy per initial volume W = mu/2 (tr b - 2 - 2 ln J) + lambda/2 (ln J)^2, tr b in the plane
!> (Bonet & Wood 2008).
module sg_neo_hookean
  use sg_kinds, only: dp, wp
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: update_deformation, find_neo_hookean_stress, neo_hookean_energy
  public :: neo_hookean_wave_squared, find_stretch

contains

  !> F <- (I + dt L) F with gradient(p, :) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy).
  pure subroutine update_deformation(n, time_step, gradient, fxx, fxy, fyx, fyy)
    integer, intent(in) :: n
    real(wp), intent(in) :: time_step, gradient(BLOCK, 4)
    real(wp), intent(inout) :: fxx(n), fxy(n), fyx(n), fyy(n)
    real(wp) :: old_x, old_y
    integer :: p

    !$omp simd private(old_x, old_y)
    do p = 1, n
      old_x = fxx(p)
      old_y = fyx(p)
      fxx(p) = old_x + time_step*(gradient(p, 1)*old_x + gradient(p, 3)*old_y)
      fyx(p) = old_y + time_step*(gradient(p, 2)*old_x + gradient(p, 4)*old_y)
      old_x = fxy(p)
      old_y = fyy(p)
      fxy(p) = old_x + time_step*(gradient(p, 1)*old_x + gradient(p, 3)*old_y)
      fyy(p) = old_y + time_step*(gradient(p, 2)*old_x + gradient(p, 4)*old_y)
    end do
  end subroutine update_deformation

  !> Cauchy stress in Pa and present volume in m^2, from the deformation gradient and the initial
  !> volume, mass/density. A point turned inside out (J <= 0) gives what is not finite, which the
  !> step reports.
  pure subroutine find_neo_hookean_stress(n, lame, shear, density, mass, fxx, fxy, fyx, fyy, &
    volume, stress)
    integer, intent(in) :: n
    !> Pa, Pa, kg/m^3.
    real(wp), intent(in) :: lame, shear, density
    real(wp), intent(in) :: mass(n), fxx(n), fxy(n), fyx(n), fyy(n)
    real(wp), intent(inout) :: volume(n)
    !> xx, yy, zz, xy
    real(wp), intent(inout) :: stress(BLOCK, 4)
    real(wp) :: jacobian, spherical
    integer :: p

    do p = 1, n
      jacobian = fxx(p)*fyy(p) - fxy(p)*fyx(p)
      volume(p) = jacobian*mass(p)/density
      spherical = lame*log(jacobian)
      stress(p, 1) = (spherical + shear*(fxx(p)**2 + fxy(p)**2 - 1.0_wp))/jacobian
      stress(p, 2) = (spherical + shear*(fyx(p)**2 + fyy(p)**2 - 1.0_wp))/jacobian
      stress(p, 3) = spherical/jacobian
      stress(p, 4) = shear*(fxx(p)*fyx(p) + fxy(p)*fyy(p))/jacobian
    end do
  end subroutine find_neo_hookean_stress

  !> W in J/m^3. In double precision, since little is left of the first bracket at small strains.
  elemental function neo_hookean_energy(lame, shear, fxx, fxy, fyx, fyy) result(energy)
    real(dp), intent(in) :: lame, shear, fxx, fxy, fyx, fyy
    real(dp) :: energy, log_j
    log_j = log(fxx*fyy - fxy*fyx)
    energy = 0.5_dp*shear*(fxx**2 + fxy**2 + fyx**2 + fyy**2 - 2.0_dp - 2.0_dp*log_j) &
      + 0.5_dp*lame*log_j**2
  end function neo_hookean_energy

  !> Largest squared wave speed in the present configuration, (m/s)^2: along a principal stretch s,
  !> (lambda (1 - ln J) + mu (1 + s^2))/rho_0; s^2 <= tr b bounds it. `ratio`: what a point has
  !> times that square because its modulus or density is not that of the material.
  pure function neo_hookean_wave_squared(n, lame, shear, density, ratio, fxx, fxy, fyx, fyy) &
    result(squared)
    integer, intent(in) :: n
    real(wp), intent(in) :: lame, shear, density, ratio(n), fxx(n), fxy(n), fyx(n), fyy(n)
    real(wp) :: squared
    integer :: p

    squared = 0.0_wp
    do p = 1, n
      squared = max(squared, ratio(p)*(lame*(1.0_wp - log(fxx(p)*fyy(p) - fxy(p)*fyx(p))) &
        + shear*(1.0_wp + fxx(p)**2 + fxy(p)**2 + fyx(p)**2 + fyy(p)**2)))
    end do
    squared = squared/density
  end function neo_hookean_wave_squared

  !> Diagonal of the right stretch U = (C + J I)/sqrt(tr C + 2 J), C = F^T F: what a rotation leaves
  !> alone (Coombs et al. 2020). For cpGIMP.
  pure subroutine find_stretch(n, fxx, fxy, fyx, fyy, stretch_x, stretch_y)
    integer, intent(in) :: n
    real(wp), intent(in) :: fxx(n), fxy(n), fyx(n), fyy(n)
    real(wp), intent(inout) :: stretch_x(BLOCK), stretch_y(BLOCK)
    real(wp) :: cxx, cyy, jacobian, scale
    integer :: p

    !$omp simd private(cxx, cyy, jacobian, scale)
    do p = 1, n
      cxx = fxx(p)**2 + fyx(p)**2
      cyy = fxy(p)**2 + fyy(p)**2
      jacobian = fxx(p)*fyy(p) - fxy(p)*fyx(p)
      scale = 1.0_wp/sqrt(cxx + cyy + 2.0_wp*jacobian)
      stretch_x(p) = (cxx + jacobian)*scale
      stretch_y(p) = (cyy + jacobian)*scale
    end do
  end subroutine find_stretch
end module sg_neo_hookean
