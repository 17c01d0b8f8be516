!> Strain, volume and stress of a block of points, whatever their material: the one place that knows
!> the order of things within the stress update.
!>
!> Where Young's modulus varies, the material has a nominal one, E, and a point E_p, its stiffness
!> E_p/E. The return of a stress asks only for Poisson's ratio: all that E decides are the strains
!> it leaves. So it works with the nominal modulus, and these strains are divided by the stiffness.
module sg_stress_update
  use sg_cracks, only: crack_opening, turn_cracks
  use sg_drucker_prager, only: return_drucker_prager
  use sg_kinds, only: dp, wp
  use sg_linear_elastic, only: find_strain, predict_stress, strain_t, stress_power
  use sg_materials, only: material_t, MODEL_DRUCKER_PRAGER, MODEL_LINEAR_ELASTIC, &
    MODEL_MOHR_COULOMB, MODEL_NEO_HOOKEAN
  use sg_mohr_coulomb, only: close_gap, release_open, return_cracked
  use sg_neo_hookean, only: find_neo_hookean_stress, neo_hookean_wave_squared, &
    update_deformation
  use sg_particles, only: particles_t
  use sg_softening, only: first_strength_t, plastic_strain_increment, return_softening
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: update_stress, can_crack, return_block, wave_speed_squared

contains

  !> Takes the points `first` to `last`, all of one material, one step further. `gradient` of the
  !> velocity in 1/s. Adds the work of their stresses to `work` (J/m).
  subroutine update_stress(particles, material, first, last, time_step, gradient, work)
    type(particles_t), intent(inout) :: particles
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp), intent(in) :: time_step, gradient(BLOCK, 4)
    real(dp), intent(inout) :: work
    type(strain_t) :: strain
    real(wp) :: twice, share(BLOCK)
    integer :: n

    n = last - first + 1
    twice = 0.0_wp
    associate (p => particles)
      if (size(p%fxx) > 0) call update_deformation(n, time_step, gradient, &
        p%fxx(first:last), p%fxy(first:last), p%fyx(first:last), p%fyy(first:last))
      if (material%model == MODEL_NEO_HOOKEAN) then
        call find_strain(n, time_step, gradient, strain)
        twice = stress_power(n, strain, p%volume(first:last), p%sxx(first:last), &
          p%syy(first:last), p%sxy(first:last))
        call hyperelastic_block(p, material, first, last)
      else
        share = 1.0_wp
        if (material%closes_all_gaps .or. has_gap(n, p%gap(first:last))) then
          if (material%is_brittle) call release_block(p, material, first, last)
          call close_gap(n, time_step, gradient, p%gap(first:last), share)
        end if
        if (size(p%crack) > 0) call turn_cracks(n, time_step, gradient, p%crack(:, first:last))
        if (size(p%young) > 0) then
          call predict_varied(p, material, first, last, time_step, gradient, share, strain, twice)
        else
          call predict_stress(n, time_step, gradient, share, material%lame, material%shear, &
            p%volume(first:last), p%sxx(first:last), p%syy(first:last), p%szz(first:last), &
            p%sxy(first:last), strain, twice)
        end if
        if (material%model /= MODEL_LINEAR_ELASTIC) call return_block(p, material, first, last)
      end if
      twice = twice + stress_power(n, strain, p%volume(first:last), p%sxx(first:last), &
        p%syy(first:last), p%sxy(first:last))
    end associate
    work = work + 0.5_wp*twice
  end subroutine update_stress

  !> As release_open, for a block.
  subroutine release_block(p, material, first, last)
    type(particles_t), intent(inout) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: gap(BLOCK)
    integer :: n

    n = last - first + 1
    if (size(p%young) > 0) gap(:n) = p%gap(first:last)
    call release_open(n, material%bulk, p%gap(first:last), p%sxx(first:last), p%syy(first:last), &
      p%szz(first:last), p%sxy(first:last))
    if (size(p%young) > 0) p%gap(first:last) = gap(:n) + (p%gap(first:last) - gap(:n)) &
      /stiffness(p, material, first, last)
  end subroutine release_block

  !> As predict_stress, for a block of points with a stiffness of their own: to the nominal modulus
  !> it is as if a strain that much larger were theirs.
  subroutine predict_varied(p, material, first, last, time_step, gradient, share, strain, power)
    type(particles_t), intent(inout) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp), intent(in) :: time_step, gradient(BLOCK, 4), share(BLOCK)
    type(strain_t), intent(inout) :: strain
    real(wp), intent(inout) :: power
    type(strain_t) :: scaled
    real(wp) :: scaled_share(BLOCK), scaled_power
    integer :: n

    n = last - first + 1
    call find_strain(n, time_step, gradient, strain)
    strain%exx(:n) = share(:n)*strain%exx(:n)
    strain%eyy(:n) = share(:n)*strain%eyy(:n)
    strain%exy(:n) = share(:n)*strain%exy(:n)
    power = power + stress_power(n, strain, p%volume(first:last), p%sxx(first:last), &
      p%syy(first:last), p%sxy(first:last))
    scaled_share(:n) = share(:n)*stiffness(p, material, first, last)
    scaled_power = 0.0_wp
    call predict_stress(n, time_step, gradient, scaled_share, material%lame, material%shear, &
      p%volume(first:last), p%sxx(first:last), p%syy(first:last), p%szz(first:last), &
      p%sxy(first:last), scaled, scaled_power)
  end subroutine predict_varied

  !> Young's modulus of the points over that of their material, [last - first + 1]; only where it
  !> varies.
  pure function stiffness(p, material, first, last) result(ratio)
    type(particles_t), intent(in) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: ratio(last - first + 1)

    ratio = p%young(first:last)/material%young
  end function stiffness

  !> Stress and volume of neo-Hookean points from their deformation gradient.
  subroutine hyperelastic_block(p, material, first, last)
    type(particles_t), intent(inout) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: stress(BLOCK, 4), mass(BLOCK), ratio(BLOCK)
    integer :: n, k

    n = last - first + 1
    mass(:n) = p%mass(first:last)
    ! What they would weigh with the density of the material: mass stands for the first volume.
    if (size(p%density) > 0) mass(:n) = mass(:n)*(material%density/p%density(first:last))
    call find_neo_hookean_stress(n, material%lame, material%shear, material%density, &
      mass(:n), p%fxx(first:last), p%fxy(first:last), p%fyx(first:last), &
      p%fyy(first:last), p%volume(first:last), stress)
    if (size(p%young) > 0) then
      ratio(:n) = stiffness(p, material, first, last)
      do k = 1, 4
        stress(:n, k) = ratio(:n)*stress(:n, k)
      end do
    end if
    p%sxx(first:last) = stress(:n, 1)
    p%syy(first:last) = stress(:n, 2)
    p%szz(first:last) = stress(:n, 3)
    p%sxy(first:last) = stress(:n, 4)
  end subroutine hyperelastic_block

  !> Can a point crack: has one a cut-off below the apex of its cone, or may softening give it one?
  pure function can_crack(p, materials) result(can)
    type(particles_t), intent(in) :: p
    type(material_t), intent(in) :: materials(:)
    logical :: can
    integer :: body

    can = .false.
    do body = 1, size(p%bodies)
      associate (b => p%bodies(body), m => materials(p%bodies(body)%material))
        if (m%model /= MODEL_MOHR_COULOMB .or. m%is_undrained) cycle
        can = can .or. any(p%cohesion_term(b%first:b%last) > merge(0.0_wp, 2.0_wp &
          *p%sin_friction(b%first:b%last)*p%tension_limit(b%first:b%last), m%softens))
      end associate
    end do
  end function can_crack

  !> Returns the trial stresses of plastic points to their yield surface; what cracks open more than
  !> they did leaves the volume.
  subroutine return_block(p, material, first, last)
    type(particles_t), intent(inout) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: gap(BLOCK), closed(BLOCK)
    integer :: n

    n = last - first + 1
    if (size(p%crack) > 0) closed(:n) = crack_opening(n, material%bulk, p%crack(:, first:last))
    if (size(p%young) > 0) then
      gap(:n) = p%gap(first:last)
      call return_nominal(p, material, first, last)
      p%gap(first:last) = gap(:n) + (p%gap(first:last) - gap(:n)) &
        /stiffness(p, material, first, last)
    else
      call return_nominal(p, material, first, last)
    end if
    if (size(p%crack) > 0) then
      closed(:n) = closed(:n) - crack_opening(n, material%bulk, p%crack(:, first:last))
      if (.not. any(abs(closed(:n)) > 0.0_wp)) return
      if (size(p%young) > 0) closed(:n) = closed(:n)/stiffness(p, material, first, last)
      p%volume(first:last) = p%volume(first:last)*exp(closed(:n))
    end if
  end subroutine return_block

  !> The same with the gap that the nominal modulus makes.
  subroutine return_nominal(p, material, first, last)
    type(particles_t), intent(inout) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: trial(BLOCK, 4), sin_dilation(BLOCK), k(BLOCK), mean_limit(BLOCK), strain(BLOCK)
    integer :: n, last_crack

    n = last - first + 1
    last_crack = merge(last, first - 1, size(p%crack) > 0)
    if (material%softens) then
      call return_softening(n, material, first_strength(p, material, first, last), &
        p%plastic_strain(first:last), p%sxx(first:last), p%syy(first:last), p%szz(first:last), &
        p%sxy(first:last), p%gap(first:last), p%crack(:, first:last_crack))
      return
    end if
    if (size(p%plastic_strain) > 0) then
      trial(:n, 1) = p%sxx(first:last)
      trial(:n, 2) = p%syy(first:last)
      trial(:n, 3) = p%szz(first:last)
      trial(:n, 4) = p%sxy(first:last)
    end if
    select case (material%model)
    case (MODEL_MOHR_COULOMB)
      sin_dilation = material%sin_dilation
      if (size(p%sin_dilation) > 0) sin_dilation(:n) = p%sin_dilation(first:last)
      call return_cracked(n, material, p%sin_friction(first:last), p%cohesion_term(first:last), &
        p%tension_limit(first:last), sin_dilation, p%sxx(first:last), p%syy(first:last), &
        p%szz(first:last), p%sxy(first:last), p%gap(first:last), p%crack(:, first:last_crack))
    case (MODEL_DRUCKER_PRAGER)
      k = material%k
      mean_limit = material%mean_limit
      if (size(p%cohesion) + size(p%undrained_strength) > 0) then
        k(:n) = p%cohesion_term(first:last)
        mean_limit(:n) = p%tension_limit(first:last)
      end if
      call return_drucker_prager(n, material, k, mean_limit, p%sxx(first:last), &
        p%syy(first:last), p%szz(first:last), p%sxy(first:last), p%gap(first:last))
    case default ! elastic: nothing to return to
    end select
    if (size(p%plastic_strain) > 0) then
      strain(:n) = plastic_strain_increment(n, material%shear, trial, p%sxx(first:last), &
        p%syy(first:last), p%szz(first:last), p%sxy(first:last))
      if (size(p%young) > 0) strain(:n) = strain(:n)/stiffness(p, material, first, last)
      p%plastic_strain(first:last) = p%plastic_strain(first:last) + strain(:n)
    end if
  end subroutine return_nominal

  !> Strength before softening: of the points where it varies, else of the material.
  pure function first_strength(p, material, first, last) result(strength)
    type(particles_t), intent(in) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    type(first_strength_t) :: strength
    integer :: n

    n = last - first + 1
    strength%friction_angle(:n) = p%friction_angle(first:last)
    strength%cohesion(:n) = material%cohesion
    if (size(p%cohesion) > 0) strength%cohesion(:n) = p%cohesion(first:last)
    strength%dilation_angle(:n) = material%dilation_angle
    strength%sin_dilation(:n) = material%sin_dilation
    if (size(p%sin_dilation) > 0) then
      strength%dilation_angle(:n) = p%dilation_angle(first:last)
      strength%sin_dilation(:n) = p%sin_dilation(first:last)
    end if
    strength%stiffness(:n) = 1.0_wp
    if (size(p%young) > 0) strength%stiffness(:n) = stiffness(p, material, first, last)
  end function first_strength

  !> Square of the largest wave speed in the present state, among points that carry stress, (m/s)^2.
  function wave_speed_squared(p, material, first, last) result(squared)
    type(particles_t), intent(in) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: squared
    integer :: n

    n = last - first + 1
    if (material%model == MODEL_NEO_HOOKEAN) then
      squared = neo_hookean_wave_squared(n, material%lame, material%shear, material%density, &
        wave_ratio(p, material, first, last), p%fxx(first:last), p%fxy(first:last), &
        p%fyx(first:last), p%fyy(first:last))
    else if (size(p%young) > 0 .or. size(p%density) > 0) then
      squared = varied_wave_speed(p, material, first, last)
    else
      squared = largest_wave_speed(n, material%lame + 2.0_wp*material%shear, &
        p%mass(first), p%volume(first:last), p%gap(first:last))
    end if
  end function wave_speed_squared

  !> The same for points that differ in modulus or density, and are not neo-Hookean.
  function varied_wave_speed(p, material, first, last) result(squared)
    type(particles_t), intent(in) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: squared, volume(last - first + 1)

    ! With these volumes points like the first have the speeds of the others.
    volume = p%volume(first:last)*(p%mass(first)/p%mass(first:last))
    if (size(p%young) > 0) volume = volume*stiffness(p, material, first, last)
    squared = largest_wave_speed(last - first + 1, material%lame + 2.0_wp*material%shear, &
      p%mass(first), volume, p%gap(first:last))
  end function varied_wave_speed

  !> (E_p/E)/(rho_p/rho), [last - first + 1]: what a neo-Hookean point has times the square of the
  !> wave speed.
  pure function wave_ratio(p, material, first, last) result(ratio)
    type(particles_t), intent(in) :: p
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    real(wp) :: ratio(last - first + 1)

    ratio = 1.0_wp
    if (size(p%young) > 0) ratio = stiffness(p, material, first, last)
    if (size(p%density) > 0) ratio = ratio*(material%density/p%density(first:last))
  end function wave_ratio

  !> Square of the largest wave speed, M V/m, among points without a gap, in (m/s)^2.
  pure function largest_wave_speed(n, modulus, mass, volume, gap) result(squared)
    integer, intent(in) :: n
    !> Pa; of one point, kg/m; m^2.
    real(wp), intent(in) :: modulus, mass, volume(n), gap(n)
    real(wp) :: squared, largest, here
    integer :: p

    largest = 0.0_wp
    !$omp simd private(here) reduction(max:largest)
    do p = 1, n
      here = volume(p) ! what merge chooses from is in registers, or the loop does not vectorise
      largest = max(largest, merge(here, 0.0_wp, gap(p) <= 0.0_wp))
    end do
    squared = modulus*largest/mass
  end function largest_wave_speed

  !> Whether one of `n` points has a gap to close.
  pure function has_gap(n, gap) result(has)
    integer, intent(in) :: n
    real(wp), intent(in) :: gap(n)
    logical :: has
    real(wp) :: widest
    integer :: p

    widest = 0.0_wp
    !$omp simd reduction(max:widest)
    do p = 1, n
      widest = max(widest, gap(p))
    end do
    has = widest > 0.0_wp
  end function has_gap
end module sg_stress_update
