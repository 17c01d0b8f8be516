!> Cost per point and step on the paper's column: whole runs of the three schemes, and where the
!> time of usl goes.
!> Usage: bench_kernel CASE.nml [end_time [scheme [repeats]]]; with a scheme, the run of that one
!> and no more.
!> Prints processor time, which a busy machine spoils less than wall time, and beside it the wall
!> time, which alone tells what threads are worth; judges nothing. With repeats the same run is made
!> so many times, and processor times add up the least of each few milliseconds of it (the steps
!> between two questions to the monitor): what a run costs that nobody disturbs, as long as every
!> part of it was once left in peace. The wall time is the mean of the runs.
program bench_kernel
  use case_file, only: read_case, stop_on_error
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_grid, only: losses_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: outcome_t, reset_outcome, STEPS
  use sg_scene, only: build_scene, scene_t
  use sg_simulate, only: simulate
  use sg_solver, only: solver_t
  use sg_stress_update, only: update_stress, wave_speed_squared
  use sg_timer, only: wall_seconds
  use sg_transfer, only: gather_motion_and_gradient, map_momentum_and_force
  use sg_variation, only: variation_t
  use sg_weighting, only: BLOCK, weights_t
  use stopwatch, only: stopwatch_t
  implicit none

  character(len=4), parameter :: SCHEMES(3) = ['usl ', 'musl', 'usf ']
  !> Parts of a step that are timed apart.
  integer, parameter :: WEIGHTS = 1, GATHER = 2, STRESS = 3, MAP = 4, NODES = 5
  type(config_t) :: config
  type(scene_t) :: scene
  type(error_t), allocatable :: error
  character(len=512) :: argument
  integer :: k, repeats

  call get_command_argument(1, argument)
  call read_case(trim(argument), config)
  call get_command_argument(2, argument)
  if (argument /= '') read (argument, *) config%solver%end_time
  call build_scene(config, scene, error)
  call stop_on_error(error)
  print '(a, i0, a, f6.3, a)', 'points ', scene%particles%count, ', cells of ', &
    config%grid%cell_size, ' m'
  call get_command_argument(4, argument)
  repeats = 1
  if (argument /= '') read (argument, *) repeats
  call get_command_argument(3, argument)
  if (argument /= '') then
    call time_run(trim(argument), repeats)
  else
    do k = 1, size(SCHEMES)
      call time_run(trim(SCHEMES(k)), repeats)
    end do
    call time_phases()
  end if

contains

  !> Whole runs; the flowing phase costs more than the first steps.
  subroutine time_run(scheme, repeats)
    character(len=*), intent(in) :: scheme
    integer, intent(in) :: repeats
    type(variation_t) :: variation
    type(stopwatch_t) :: watch
    type(blind_observer_t) :: observer
    type(outcome_t) :: outcome
    real(wp) :: wall_started
    integer :: repeat

    config%solver%scheme = scheme
    wall_started = wall_seconds()
    do repeat = 1, repeats
      call reset_outcome(outcome, 1, 1_i8, size(scene%profile_x))
      call watch%start()
      call simulate(config, scene, variation, watch, observer, outcome)
      call watch%stop()
    end do
    print '(a5, f8.1, a, i7, a, f7.2, a, f8.3, a)', scheme, &
      1.0e9_wp*watch%least_seconds()/(outcome%values(STEPS)*scene%particles%count), &
      ' ns per point and step, grid included;', nint(outcome%values(STEPS)), ' steps,', &
      watch%least_seconds(), ' s, by the clock', (wall_seconds() - wall_started)/repeats, ' s'
  end subroutine time_run

  !> Each part by itself, on the state after a second of flow, the least of many sweeps. Parts run
  !> apart lose what the block in the cache saves. Strain and stress are those of a block at rest.
  subroutine time_phases()
    integer, parameter :: REPEATS = 200
    type(solver_t) :: solver, start
    type(losses_t) :: losses
    real(wp) :: ns(5), started, ended
    character(len=24), parameter :: NAMES(5) = [character(len=24) :: 'weights (twice)', 'gather', &
      'strain and stress', 'map to nodes', 'nodes']
    integer :: repeat, k, part

    config%solver%scheme = 'usl'
    start%materials = scene%materials
    start%particles = scene%particles
    call start%configure(config)
    call start%grid%init(config%grid, config%boundaries, 0.0_wp, minval(scene%particles%mass))
    call start%start()
    do k = 1, nint(1.0_wp/scene%first_step)
      call start%advance(scene%first_step)
    end do
    ns = huge(1.0_wp)
    do part = 1, size(ns)
      do repeat = 1, REPEATS
        solver = start
        call cpu_time(started)
        if (part == NODES) then
          call solver%grid%integrate_momentum(1.0e-3_wp, solver%gravity, solver%damping, losses)
        else
          do k = 1, size(solver%blocks)
            call do_part(solver, part, solver%blocks(k)%first, solver%blocks(k)%last)
          end do
        end if
        call cpu_time(ended)
        ns(part) = min(ns(part), 1.0e9_wp*(ended - started)/solver%particles%count)
      end do
    end do
    ! Both were timed with the weights that they want.
    ns([GATHER, MAP]) = ns([GATHER, MAP]) - ns(WEIGHTS)
    ns(WEIGHTS) = 2.0_wp*ns(WEIGHTS)
    do part = 1, size(ns)
      print '(2x, a, f7.1, a, f6.1, a)', NAMES(part), ns(part), ' ns  ', &
        100.0_wp*ns(part)/sum(ns), ' %'
    end do
  end subroutine time_phases

  !> One part of the work on the points `first` to `last`.
  subroutine do_part(solver, part, first, last)
    type(solver_t), intent(inout) :: solver
    integer, intent(in) :: part, first, last
    type(weights_t) :: w
    real(wp) :: value(BLOCK, 4), gradient(BLOCK, 4), work, wave_squared
    integer :: n

    n = last - first + 1
    associate (p => solver%particles, g => solver%grid, m => solver%materials(1))
      if (part == STRESS) then
        gradient = 0.0_wp
        work = 0.0_wp
        call update_stress(p, m, first, last, 1.0e-3_wp, gradient, work)
        wave_squared = wave_speed_squared(p, m, first, last)
        if (work + wave_squared > huge(1.0_wp)) print '(a)', 'not finite'
        return
      end if
      call solver%find_weights(first, last, w)
      call w%number_rows(n, g%x%last)
      if (part == GATHER) then
        call gather_motion_and_gradient(w, g%x%last, g%y%last, g%motion_store(g%motion_start), &
          value, gradient)
      else if (part == MAP) then
        call map_momentum_and_force(n, w, p%mass(first:last), p%vx(first:last), &
          p%vy(first:last), p%volume(first:last), p%sxx(first:last), p%syy(first:last), &
          p%sxy(first:last), g%last_node, g%total_store(g%total_start))
      end if
    end associate
  end subroutine do_part
end program bench_kernel
