!> Materials: what a case file says of one, turned into the constants that the kernels need.
module sg_materials
  use sg_config, only: material_config_t
  use sg_kinds, only: wp
  implicit none
  private

  public :: material_t, create_material, mohr_coulomb_strength
  public :: MODEL_LINEAR_ELASTIC, MODEL_MOHR_COULOMB

  integer, parameter :: MODEL_LINEAR_ELASTIC = 1
  integer, parameter :: MODEL_MOHR_COULOMB = 2

  real(wp), parameter :: DEGREE = acos(-1.0_wp)/180.0_wp

  type :: material_t
    !> One of the MODEL_ constants.
    integer :: model
    !> Initial density in kg/m^3.
    real(wp) :: density
    !> Lame's first constant, shear and bulk modulus, in Pa.
    real(wp) :: lame, shear, bulk
    real(wp) :: poisson
    !> Mohr-Coulomb: friction angle in degrees, sine of the dilation angle, cohesion and tension
    !> strength in Pa.
    real(wp) :: friction_angle, sin_dilation, cohesion, tension_strength
  end type material_t

contains

  !> Constants of a material that passed the checks of the configuration.
  pure function create_material(config) result(material)
    type(material_config_t), intent(in) :: config
    type(material_t) :: material

    material%model = merge(MODEL_MOHR_COULOMB, MODEL_LINEAR_ELASTIC, config%model == 'mohr_coulomb')
    material%density = config%density
    material%poisson = config%poisson
    material%lame = config%young*config%poisson/((1.0_wp + config%poisson)*(1.0_wp &
      - 2.0_wp*config%poisson))
    material%shear = config%young/(2.0_wp*(1.0_wp + config%poisson))
    material%bulk = material%lame + 2.0_wp/3.0_wp*material%shear
    material%friction_angle = 0.0_wp
    material%sin_dilation = 0.0_wp
    material%cohesion = 0.0_wp
    material%tension_strength = 0.0_wp
    if (material%model == MODEL_MOHR_COULOMB) then
      material%friction_angle = config%friction_angle
      material%sin_dilation = sin(config%dilation_angle*DEGREE)
      material%cohesion = config%cohesion
      material%tension_strength = config%tension_strength
    end if
  end function create_material

  !> Strength of a point with the friction angle `friction_angle` in degrees: sin(phi), 2 c
  !> cos(phi), and the largest tension, min(tension strength, c cot(phi)).
  elemental subroutine mohr_coulomb_strength(material, friction_angle, sin_friction, &
    cohesion_term, tension_limit)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: friction_angle
    real(wp), intent(out) :: sin_friction, cohesion_term, tension_limit

    sin_friction = sin(friction_angle*DEGREE)
    cohesion_term = 2.0_wp*material%cohesion*cos(friction_angle*DEGREE)
    tension_limit = material%tension_strength
    ! c cot(phi) = (2 c cos(phi)) / (2 sin(phi)); without friction there is no apex.
    if (cohesion_term < 2.0_wp*sin_friction*tension_limit) then
      tension_limit = cohesion_term/(2.0_wp*sin_friction)
    end if
  end subroutine mohr_coulomb_strength
end module sg_materials
