!> Materials: what a case file says of one, turned into the constants that the kernels need.
module sg_materials
  use sg_config, only: material_config_t
  use sg_kinds, only: dp, wp
  implicit none
  private

  public :: material_t, create_material, cone_strength, mohr_coulomb_strength
  public :: MODEL_LINEAR_ELASTIC, MODEL_NEO_HOOKEAN, MODEL_MOHR_COULOMB, MODEL_DRUCKER_PRAGER

  integer, parameter :: MODEL_LINEAR_ELASTIC = 1
  integer, parameter :: MODEL_NEO_HOOKEAN = 2
  !> Mohr-Coulomb; Tresca is the one with phi = 0 and no limit of tension.
  integer, parameter :: MODEL_MOHR_COULOMB = 3
  !> Drucker-Prager; von Mises is the one with alpha = 0 and no limit of tension.
  integer, parameter :: MODEL_DRUCKER_PRAGER = 4

  !> Tension limit of a material that has none, as a multiple of its shear strength.
  real(dp), parameter :: UNLIMITED = 1.0e12_dp

  real(dp), parameter :: DEGREE = acos(-1.0_dp)/180.0_dp

  type :: material_t
    !> One of the MODEL_ constants.
    integer :: model
    !> Initial density in kg/m^3.
    real(wp) :: density
    !> Lame's first constant, shear and bulk modulus, in Pa.
    real(wp) :: lame, shear, bulk
    real(wp) :: poisson
    !> Young's modulus in Pa.
    real(wp) :: young
    !> Mohr-Coulomb: friction and dilation angle in degrees, sine of the latter, cohesion and
    !> tension strength in Pa.
    real(wp) :: friction_angle = 0.0_wp, dilation_angle = 0.0_wp, sin_dilation = 0.0_wp
    real(wp) :: cohesion = 0.0_wp
    real(wp) :: tension_strength = 0.0_wp
    !> Softening of Mohr-Coulomb: strength left, in degrees and Pa, and the equivalent plastic
    !> strains between which it falls; strain at which dilation has faded (0: never).
    logical :: softens = .false.
    real(wp) :: residual_friction_angle = 0.0_wp, residual_cohesion = 0.0_wp
    real(wp) :: softening_start = 0.0_wp, softening_end = 0.0_wp, dilation_end = 0.0_wp
    !> A point at the apex carries tension, which it loses once it is open.
    logical :: is_brittle = .false.
    !> Drucker-Prager: f = sqrt(J2) + alpha I1 - k, flow with alpha_flow, mean stress at most
    !> mean_limit; k and mean_limit in Pa. k is k_per_cohesion times the cohesion, or the undrained
    !> strength.
    real(wp) :: alpha = 0.0_wp, alpha_flow = 0.0_wp, k = 0.0_wp, mean_limit = 0.0_wp
    real(wp) :: k_per_cohesion = 0.0_wp
    !> The cohesion is an undrained strength (Tresca, von Mises).
    logical :: is_undrained = .false.
    !> Work that is asked for although points can do without it (docs/skips.md): gaps are closed
    !> where there is none, the multiplier is divided for without dilation.
    logical :: closes_all_gaps = .false., divides_always = .false.
    !> Points that leave the plane by more, in Pa, take the exact return.
    real(wp) :: most_violation = 0.0_wp
  end type material_t

contains

  !> Constants of a material that passed the checks of the configuration, found in double precision.
  pure function create_material(config) result(material)
    type(material_config_t), intent(in) :: config
    type(material_t) :: material
    real(dp) :: lame, shear

    lame = config%young*config%poisson/((1.0_dp + config%poisson)*(1.0_dp - 2.0_dp*config%poisson))
    shear = config%young/(2.0_dp*(1.0_dp + config%poisson))
    material%density = real(config%density, wp)
    material%poisson = real(config%poisson, wp)
    material%young = real(config%young, wp)
    material%lame = real(lame, wp)
    material%shear = real(shear, wp)
    material%bulk = real(lame + 2.0_dp/3.0_dp*shear, wp)
    select case (config%model)
    case ('mohr_coulomb')
      material%model = MODEL_MOHR_COULOMB
      material%friction_angle = real(config%friction_angle, wp)
      material%dilation_angle = real(config%dilation_angle, wp)
      material%sin_dilation = real(sin(config%dilation_angle*DEGREE), wp)
      material%cohesion = real(config%cohesion, wp)
      material%tension_strength = real(config%tension_strength, wp)
      call set_softening(config, material)
    case ('tresca')
      material%model = MODEL_MOHR_COULOMB
      material%cohesion = real(config%undrained_strength, wp)
      material%tension_strength = real(UNLIMITED*config%undrained_strength, wp)
    case ('drucker_prager')
      material%model = MODEL_DRUCKER_PRAGER
      material%friction_angle = real(config%friction_angle, wp)
      call set_cone(config, material)
    case ('von_mises')
      ! In plane strain the out-of-plane stress settles midway, where sqrt(J2) is half the
      ! difference of the other two.
      material%model = MODEL_DRUCKER_PRAGER
      material%cohesion = real(config%undrained_strength, wp)
      material%k = real(config%undrained_strength, wp)
      material%k_per_cohesion = 1.0_wp
      material%tension_strength = real(UNLIMITED*config%undrained_strength, wp)
      material%mean_limit = material%tension_strength
    case ('neo_hookean')
      material%model = MODEL_NEO_HOOKEAN
    case default
      material%model = MODEL_LINEAR_ELASTIC
    end select
    material%is_undrained = config%model == 'tresca' .or. config%model == 'von_mises'
    material%is_brittle = merge(material%mean_limit, material%tension_strength, &
      material%model == MODEL_DRUCKER_PRAGER) > 0.0_wp
  end function create_material

  pure subroutine set_softening(config, material)
    type(material_config_t), intent(in) :: config
    type(material_t), intent(inout) :: material

    material%dilation_end = real(config%dilation_end, wp)
    material%softens = config%softening == 'linear' .or. config%dilation_end > 0.0_wp
    material%residual_friction_angle = real(config%friction_angle, wp)
    material%residual_cohesion = real(config%cohesion, wp)
    ! Strength never begins to fall.
    material%softening_start = 0.5_wp*huge(1.0_wp)
    material%softening_end = huge(1.0_wp)
    if (config%softening /= 'linear') return
    material%residual_friction_angle = real(config%residual_friction_angle, wp)
    material%residual_cohesion = real(config%residual_cohesion, wp)
    material%softening_start = real(config%softening_start, wp)
    material%softening_end = real(config%softening_end, wp)
  end subroutine set_softening

  !> alpha (on I1) and k of the cone. All have their apex at I1 = 3 c cot(phi), k = 3 alpha c
  !> cot(phi); with s = sin(phi), alpha = s/q:
  !>   outer, inner              q = sqrt(3)/2 (3 -+ s): the compression and the extension edges
  !>   equal_area                circle of the area of the hexagon, q^2 = pi (9 - s^2)/(2 sqrt(3))
  !>   plane_strain              same limit load in plane strain with the dilation psi: with
  !>                             alpha_f = sin(psi)/sqrt(9 + 3 sin(psi)^2),
  !>                             q = 3 (sqrt(1 - 3 alpha_f^2) + alpha_f s)
  !>   plane_strain_associated   the same with psi = phi, q = sqrt(9 + 3 s^2): the inscribed cone
  !> Drucker & Prager 1952; Chen & Han 1988. Flow has alpha_f for all of them.
  pure subroutine set_cone(config, material)
    type(material_config_t), intent(in) :: config
    type(material_t), intent(inout) :: material
    real(dp), parameter :: ROOT3 = sqrt(3.0_dp)
    real(dp), parameter :: PI = acos(-1.0_dp)
    real(dp) :: s, sin_dilation, flow, q

    s = sin(config%friction_angle*DEGREE)
    sin_dilation = sin(config%dilation_angle*DEGREE)
    flow = sin_dilation/sqrt(9.0_dp + 3.0_dp*sin_dilation**2)
    select case (config%cone)
    case ('outer')
      q = 0.5_dp*ROOT3*(3.0_dp - s)
    case ('inner')
      q = 0.5_dp*ROOT3*(3.0_dp + s)
    case ('equal_area')
      q = sqrt(2.0_dp*ROOT3*PI*(9.0_dp - s**2))/(2.0_dp*ROOT3)
    case ('plane_strain_associated')
      q = sqrt(9.0_dp + 3.0_dp*s**2)
    case default ! plane_strain
      q = 3.0_dp*(sqrt(1.0_dp - 3.0_dp*flow**2) + flow*s)
    end select
    material%sin_dilation = real(sin_dilation, wp)
    material%alpha_flow = real(flow, wp)
    material%alpha = real(s/q, wp)
    material%cohesion = real(config%cohesion, wp)
    material%k = real(3.0_dp*config%cohesion*cos(config%friction_angle*DEGREE)/q, wp)
    material%k_per_cohesion = real(3.0_dp*cos(config%friction_angle*DEGREE)/q, wp)
    material%tension_strength = real(config%tension_strength, wp)
    material%mean_limit = material%tension_strength
    if (material%k < 3.0_wp*material%alpha*material%mean_limit) then
      material%mean_limit = material%k/(3.0_wp*material%alpha)
    end if
  end subroutine set_cone

  !> Strength of a point with the friction angle `friction_angle` in degrees and `cohesion` in Pa:
  !> sin(phi), 2 c cos(phi), and the largest tension, min(tension strength, c cot(phi)).
  elemental subroutine mohr_coulomb_strength(material, friction_angle, cohesion, sin_friction, &
    cohesion_term, tension_limit)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: friction_angle, cohesion
    real(wp), intent(out) :: sin_friction, cohesion_term, tension_limit
    real(wp) :: angle

    angle = friction_angle*real(DEGREE, wp)
    sin_friction = sin(angle)
    cohesion_term = 2.0_wp*cohesion*cos(angle)
    tension_limit = material%tension_strength
    ! c cot(phi) = (2 c cos(phi)) / (2 sin(phi)); without friction there is no apex.
    if (cohesion_term < 2.0_wp*sin_friction*tension_limit) then
      tension_limit = cohesion_term/(2.0_wp*sin_friction)
    end if
  end subroutine mohr_coulomb_strength

  !> Strength of a Drucker-Prager point with `cohesion` (von Mises: undrained strength) in Pa: k and
  !> the largest mean stress, min(tension strength, k/(3 alpha)), in Pa.
  elemental subroutine cone_strength(material, cohesion, k, mean_limit)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: cohesion
    real(wp), intent(out) :: k, mean_limit

    k = material%k_per_cohesion*cohesion
    mean_limit = material%tension_strength
    if (k < 3.0_wp*material%alpha*mean_limit) mean_limit = k/(3.0_wp*material%alpha)
  end subroutine cone_strength
end module sg_materials
