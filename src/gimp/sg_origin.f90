!> Where the kernel counts positions from. Single precision knows places of a domain of 100 cells to
!> a hundred-thousandth of a cell, but only if no digits are spent on what all of them share.
module sg_origin
  use sg_config, only: config_t
  use sg_kinds, only: dp, wp
  implicit none
  private

  public :: kernel_origin, counted_from

contains

  !> (0, 0) for double precision; for single the lower left corner of the grid, in m. The force of
  !> the manufactured solution knows of places, and so has (0, 0) too.
  pure function kernel_origin(config) result(origin)
    type(config_t), intent(in) :: config
    real(dp) :: origin(2)

    origin = 0.0_dp
    if (wp /= dp .and. config%loading%body_force /= 'manufactured') then
      origin = [config%grid%x_min, config%grid%y_min]
    end if
  end function kernel_origin

  !> The configuration with its grid and boundaries counted from `origin`, m.
  pure function counted_from(config, origin) result(here)
    type(config_t), intent(in) :: config
    real(dp), intent(in) :: origin(2)
    type(config_t) :: here

    here = config
    here%grid%x_min = config%grid%x_min - origin(1)
    here%grid%x_max = config%grid%x_max - origin(1)
    here%grid%y_min = config%grid%y_min - origin(2)
    here%grid%y_max = config%grid%y_max - origin(2)
    here%boundaries%x_min = config%boundaries%x_min - origin(1)
    here%boundaries%x_max = config%boundaries%x_max - origin(1)
    here%boundaries%y_min = config%boundaries%y_min - origin(2)
    here%boundaries%y_max = config%boundaries%y_max - origin(2)
  end function counted_from
end module sg_origin
