!> How one member differs from the others of its scene.
module sg_variation
  use sg_kinds, only: wp
  implicit none
  private

  public :: property_values_t, variation_t

  !> One property of the points of one material.
  type :: property_values_t
    !> A PROPERTY_ constant of sg_property; index into the materials of the scene.
    integer :: property = 0, material = 0
    !> [point_count(material)] in the order of points_of(material) of the scene; SI units, degrees.
    !> Young's modulus and density must be above 0.
    real(wp), allocatable :: values(:)
  end type property_values_t

  !> How a member differs from the scene. The defaults change nothing; the homogeneous members of a
  !> study use the others for changes that mean nothing physically.
  type :: variation_t
    !> Factor on the CFL number or on the fixed step.
    real(wp) :: step_factor = 1.0_wp
    !> Relative growth of the cells about the lower left corner. Walls must stay on lines of nodes,
    !> so the lines inside the body are shifted by stretching: by a whole cell at the toe for
    !> cell_size/width.
    real(wp) :: cell_stretch = 0.0_wp
    !> Properties that points have of their own; what is not listed, and all if it is not allocated,
    !> is as the material says. One property of one material is listed once.
    type(property_values_t), allocatable :: properties(:)
    !> The run ends after so many steps (the last good state of one that failed), or after so many
    !> steps of the relaxation, which are then what the observer is shown.
    integer :: last_step = huge(1), last_relaxation_step = huge(1)
  end type variation_t
end module sg_variation
