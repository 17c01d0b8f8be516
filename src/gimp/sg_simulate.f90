!> One member in the precision that the configuration asks for: the only place that knows of both
!> kernels.
module sg_simulate
  use sg_config, only: config_t
  use sg_monitor, only: monitor_t
  use sg_observer, only: observer_t
  use sg_outcome, only: outcome_t
  use sg_scene, only: scene_t
  use sg_simulation, only: simulate_double => simulate
  use sg_simulation_single, only: simulate_single => simulate
  use sg_variation, only: variation_t
  implicit none
  private

  public :: simulate

contains

  !> As `simulate` of sg_simulation.
  subroutine simulate(config, scene, variation, monitor, observer, outcome)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    class(monitor_t), intent(inout) :: monitor
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome

    if (config%solver%precision == 'single') then
      call simulate_single(config, scene, variation, monitor, observer, outcome)
    else
      call simulate_double(config, scene, variation, monitor, observer, outcome)
    end if
  end subroutine simulate
end module sg_simulate
