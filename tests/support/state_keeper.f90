!> An observer that keeps what it was last shown.
module state_keeper
  use sg_kinds, only: wp
  use sg_observer, only: history_row_t, observer_t, shown_particles_t
  implicit none
  private

  public :: keeper_t

  type, extends(observer_t) :: keeper_t
    type(shown_particles_t) :: particles
    type(history_row_t) :: row
  contains
    procedure :: note_history
    procedure :: note_state
  end type keeper_t

contains

  subroutine note_history(this, row)
    class(keeper_t), intent(inout) :: this
    type(history_row_t), intent(in) :: row
    this%row = row
  end subroutine note_history

  subroutine note_state(this, step, time, particles)
    class(keeper_t), intent(inout) :: this
    integer, intent(in) :: step
    real(wp), intent(in) :: time
    type(shown_particles_t), intent(in) :: particles
    this%particles = particles
  end subroutine note_state
end module state_keeper
