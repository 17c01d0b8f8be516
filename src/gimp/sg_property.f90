!> The properties of points that a member can vary.
module sg_property
  implicit none
  private

  public :: property_index, PROPERTY_COUNT, PROPERTY_NAMES, PROPERTY_UNITS
  public :: PROPERTY_COHESION, PROPERTY_DENSITY, PROPERTY_DILATION_ANGLE, &
    PROPERTY_FRICTION_ANGLE, PROPERTY_UNDRAINED_STRENGTH, PROPERTY_YOUNG

  integer, parameter :: PROPERTY_FRICTION_ANGLE = 1
  integer, parameter :: PROPERTY_COHESION = 2
  integer, parameter :: PROPERTY_UNDRAINED_STRENGTH = 3
  integer, parameter :: PROPERTY_YOUNG = 4
  integer, parameter :: PROPERTY_DENSITY = 5
  integer, parameter :: PROPERTY_DILATION_ANGLE = 6
  integer, parameter :: PROPERTY_COUNT = 6

  !> As in the case file, by the constants above.
  character(len=*), parameter :: PROPERTY_NAMES(PROPERTY_COUNT) = [character(len=18) :: &
    'friction_angle', 'cohesion', 'undrained_strength', 'young', 'density', 'dilation_angle']
  !> Units of their values.
  character(len=*), parameter :: PROPERTY_UNITS(PROPERTY_COUNT) = [character(len=6) :: &
    'degree', 'Pa', 'Pa', 'Pa', 'kg/m3', 'degree']

contains

  !> Constant of the property called `name`; 0 for one that is not known.
  pure function property_index(name) result(property)
    character(len=*), intent(in) :: name
    integer :: property

    do property = PROPERTY_COUNT, 1, -1
      if (PROPERTY_NAMES(property) == name) return
    end do
  end function property_index
end module sg_property
