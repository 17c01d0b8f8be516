!> How one member differs from the others of its scene.
module sg_variation
  use sg_kinds, only: wp
  implicit none
  private

  public :: variation_t

  !> How a member differs from the scene. The defaults change nothing; the homogeneous members of a
  !> study use the others for changes that mean nothing physically.
  type :: variation_t
    !> Factor on the CFL number or on the fixed step.
    real(wp) :: step_factor = 1.0_wp
    !> Relative growth of the cells about the lower left corner. Walls must stay on lines of nodes,
    !> so the lines inside the body are shifted by stretching: by a whole cell at the toe for
    !> cell_size/width.
    real(wp) :: cell_stretch = 0.0_wp
    !> Friction angles of the points of one material, in degrees; not allocated: as the material
    !> says.
    real(wp), allocatable :: friction_angle(:)
    integer :: material = 0
    !> The run ends after so many steps (the last good state of one that failed), or after so many
    !> steps of the relaxation, which are then what the observer is shown.
    integer :: last_step = huge(1), last_relaxation_step = huge(1)
  end type variation_t
end module sg_variation
