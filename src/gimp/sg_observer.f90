!> Someone who looks at a simulation while it runs. The solver calls; what is done with it (files,
!> arrays for a test) is the observer's business. Watching never changes a time step.
module sg_observer
  use sg_kinds, only: wp
  use sg_particles, only: shown_particles_t => particles_t
  implicit none
  private

  public :: observer_t, blind_observer_t, history_row_t
  !> Points as observers and scenes have them: in double precision.
  public :: shown_particles_t

  !> One line of the history; units as in `units` of the history group: SI, per metre of thickness.
  type :: history_row_t
    real(wp) :: time, kinetic_energy, elastic_energy, potential_energy
    !> Work of the stresses that is not stored as elastic energy; energy taken by damping; by walls
    !> and prescribed velocities (negative: put in); the sum of the three, J/m.
    real(wp) :: plastic_work, damping_work, wall_work, dissipated
    !> As the column energy_error.
    real(wp) :: energy_error
    !> Force of the prescribed velocities on the material, N/m.
    real(wp) :: reaction(2)
    real(wp) :: momentum(2), angular_momentum, centre(2)
    !> Farthest edge, position behind which 99.5 % of the mass lies, highest edge, m.
    real(wp) :: front_max, front_q995, height_max
  end type history_row_t

  type, abstract :: observer_t
    !> Simulated time between calls in s; 0 for no calls.
    real(wp) :: history_interval = 0.0_wp, snapshot_interval = 0.0_wp
    !> The first and the last state are wanted too.
    logical :: wants_ends = .false.
    !> Snapshots are to hold the plastic strain.
    logical :: wants_plastic_strain = .false.
  contains
    procedure(note_history_interface), deferred :: note_history
    procedure(note_state_interface), deferred :: note_state
  end type observer_t

  abstract interface
    subroutine note_history_interface(this, row)
      import :: observer_t, history_row_t
      implicit none
      class(observer_t), intent(inout) :: this
      type(history_row_t), intent(in) :: row
    end subroutine note_history_interface

    !> The points at the end of step `step`, at `time` seconds.
    subroutine note_state_interface(this, step, time, particles)
      import :: observer_t, shown_particles_t, wp
      implicit none
      class(observer_t), intent(inout) :: this
      integer, intent(in) :: step
      real(wp), intent(in) :: time
      type(shown_particles_t), intent(in) :: particles
    end subroutine note_state_interface
  end interface

  !> Looks at nothing.
  type, extends(observer_t) :: blind_observer_t
  contains
    procedure :: note_history => ignore_history
    procedure :: note_state => ignore_state
  end type blind_observer_t

contains

  subroutine ignore_history(this, row)
    class(blind_observer_t), intent(inout) :: this
    type(history_row_t), intent(in) :: row
  end subroutine ignore_history

  subroutine ignore_state(this, step, time, particles)
    class(blind_observer_t), intent(inout) :: this
    integer, intent(in) :: step
    real(wp), intent(in) :: time
    type(shown_particles_t), intent(in) :: particles
  end subroutine ignore_state
end module sg_observer
