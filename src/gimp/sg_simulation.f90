!> One member from its initial state to rest: the time loop, the end conditions, the failures, the
!> measures.
module sg_simulation
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use sg_config, only: config_t
  use sg_kinds, only: dp, wp
  use sg_initial_stress, only: make_admissible
  use sg_materials, only: create_material, MODEL_NEO_HOOKEAN
  use sg_monitor, only: ABANDON, monitor_t, OUT_OF_TIME
  use sg_observer, only: blind_observer_t, history_row_t, observer_t, shown_particles_t
  use sg_origin, only: counted_from, kernel_origin
  use sg_outcome, only: ENERGY_ERROR, FAILURE_POINT, FAILURE_STEP, FAILURE_X, FAILURE_Y, &
    FIELD_MAX, FIELD_MEAN, FIELD_MIN, HEIGHT_MAX, HEIGHT_WALL, KINETIC_ENERGY_END, &
    KINETIC_ENERGY_RATIO, MASS_ERROR, outcome_t, RUNOUT_CONNECTED, RUNOUT_MAX, RUNOUT_Q99, &
    RUNOUT_Q995, SECONDS, SETTLE_TIME, SETTLED, STATUS_ABANDONED, STATUS_ENERGY_CREATED, &
    STATUS_EXTREME_STRAIN, STATUS_NOT_FINITE, STATUS_OK, STATUS_POINT_LOST, STATUS_RUNAWAY, &
    STATUS_STEP_COLLAPSE, STATUS_TIME_LIMIT, STEPS, WALL_TOUCHED
  use sg_particles, only: particles_t
  use sg_particle_copy, only: show_particles, take_particles
  use sg_runout, only: angular_momentum, connected_front, deposit_depth, elastic_energy, &
    farthest_edge, mass_front, potential_energy, surface_height
  use sg_scene, only: scene_t, set_properties
  use sg_solver, only: solver_t
  use sg_text, only: to_text
  use sg_timer, only: wall_seconds
  use sg_variation, only: variation_t
  implicit none
  private

  public :: simulate

  !> Steps between two questions to the monitor, in points moved: a few milliseconds of work.
  integer, parameter :: POINTS_PER_QUESTION = 100000
  !> A step below this share of the first one counts as collapsed.
  real(dp), parameter :: COLLAPSED_STEP = 1.0e-4_dp
  !> A point counts as lost once its centre is this share of a cell outside. At a closed wall it can
  !> come no farther than half its own width: there all nodes it reaches are held. A point without
  !> stress may sink in so far.
  real(dp), parameter :: OUTSIDE_MARGIN = 0.51_dp
  !> A speed this many times above all that the scene can explain (wave speed, fall through the
  !> domain, initial speed) counts as runaway.
  real(dp), parameter :: RUNAWAY_FACTOR = 10.0_dp
  !> Steps between two looks at the ledger of energy, at the most, and at the volumes of points.
  integer, parameter :: STEPS_PER_LEDGER = 16, STEPS_PER_STRAIN = 64
  !> Share of created energy at which a run has failed, above the least energy since the start.
  !> What is stable creates 1 to 2 % (tests/verification/conservation.py); what the half step
  !> between stress and velocity misreads, and stress in rate form gains, comes on top.
  real(dp), parameter :: MOST_CREATED = 0.05_dp
  !> Energies are known to this share of the potential energy and of modulus times volume. In single
  !> precision places and strains are rounded by half a unit in each of some ten thousand steps, one
  !> way or the other: a hundred roundings.
  real(dp), parameter :: ENERGY_ROUNDING = merge(1.0e-12_dp, real(100.0_wp*epsilon(1.0_wp), dp), &
    wp == dp)
  !> Volume of a point under stress, over that at its start, beyond which a run has failed.
  real(dp), parameter :: LEAST_VOLUME = 0.05_dp, LARGEST_VOLUME = 1.0_dp/LEAST_VOLUME
  !> "Stays below": for half a fundamental period of the body, 2 H/c, in which the kinetic energy of
  !> an elastic oscillation goes through its whole cycle: turning points do not pass for rest.
  real(dp), parameter :: SETTLE_PERIODS = 0.5_dp
  !> Nor does a grain that slides on alone, too small to be seen in the kinetic energy: at rest the
  !> farthest point advances slower than this share of the speed of a fall through half a cell.
  !> Friction mu stops that within a 200th of a cell/mu.
  real(dp), parameter :: STILL = 0.1_dp
  !> Share of the peak of kinetic energy at which a relaxation ends, at the least.
  real(dp), parameter :: RELAXED = 1.0e-6_dp

  !> The clock of a simulation and what it remembers of the past.
  type :: clock_t
    integer :: step = 0
    !> Step that the observer was last shown.
    integer :: shown_step = -1
    real(dp) :: time = 0.0_dp, time_step = 0.0_dp
    real(dp) :: peak_energy = 0.0_dp, speed_limit = 0.0_dp
    !> Of the member, whose modulus and density may not be those of the scene: fastest compression
    !> wave and the mean speed at which one crosses a body, m/s; mass, kg/m; and the time step that
    !> the CFL number allows at the start, or the fixed one, s.
    real(dp) :: wave_speed = 0.0_dp, mean_wave_speed = 0.0_dp, mass = 0.0_dp, first_step = 0.0_dp
    real(dp) :: calm_since = 0.0_dp, calm_needed = 0.0_dp
    !> Farthest point when the calm began, in m; the speed below which it counts as still, in m/s.
    real(dp) :: calm_front = 0.0_dp, still_speed = 0.0_dp
    real(dp) :: next_history = 0.0_dp, next_snapshot = 0.0_dp
    real(dp) :: energy_at_start = 0.0_dp, potential_at_start = 0.0_dp, elastic_at_start = 0.0_dp
    !> Of the ledger, J/m: work of walls (taken) and body forces at the last look, what they gave
    !> between looks, and the least energy so far, with what damping took, less what they gave.
    real(dp) :: seen_walls = 0.0_dp, seen_forces = 0.0_dp, given = 0.0_dp, least_energy = 0.0_dp
    !> Rise of the kinetic energy after which the ledger is looked at at once, and the energy that
    !> it is counted from: the least since the last look, J/m.
    real(dp) :: notable_rise = 0.0_dp, least_kinetic = 0.0_dp
    integer :: steps_per_ledger = STEPS_PER_LEDGER, steps_per_strain = STEPS_PER_STRAIN
    logical :: settled = .false.
  end type clock_t

contains

  !> Runs one member. `outcome` comes reset and named; a failure is a status in it, never an error.
  !> Asked to abandon,
  !> it returns with STATUS_ABANDONED.
  subroutine simulate(config, scene, variation, monitor, observer, outcome)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    class(monitor_t), intent(inout) :: monitor
    class(observer_t), intent(inout) :: observer
    type(outcome_t), intent(inout) :: outcome
    type(solver_t) :: solver
    type(clock_t) :: clock
    real(dp) :: started

    started = wall_seconds()
    call prepare(config, scene, variation, observer, solver)
    if (config%loading%relaxation /= 'none') call relax(config, scene, variation, monitor, &
      observer, solver, outcome)
    if (outcome%status /= STATUS_OK .or. variation%last_relaxation_step < huge(1)) then
      outcome%values(STEPS) = 0.0_dp
      return
    end if
    call start_clock(config, scene, solver, clock)
    if (observer%wants_ends) call show_state(solver, observer, clock)
    call watch(config, solver, observer, clock)
    call march(config, scene, variation, monitor, observer, solver, clock, outcome)
    if (outcome%status == STATUS_ABANDONED) return
    if (observer%wants_ends) call show_state(solver, observer, clock)
    outcome%values(STEPS) = clock%step
    if (outcome%status == STATUS_OK) call measure(config, scene, variation, solver, clock, outcome)
    outcome%values(SECONDS) = wall_seconds() - started
  end subroutine simulate

  !> Steps until the end, rest or a failure.
  subroutine march(config, scene, variation, monitor, observer, solver, clock, outcome)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    class(monitor_t), intent(inout) :: monitor
    class(observer_t), intent(inout) :: observer
    type(solver_t), intent(inout) :: solver
    type(clock_t), intent(inout) :: clock
    type(outcome_t), intent(inout) :: outcome
    integer :: steps_per_question

    steps_per_question = max(1, POINTS_PER_QUESTION/solver%particles%count)
    do while (clock%time < config%solver%end_time .and. .not. clock%settled &
      .and. clock%step < variation%last_step .and. outcome%status == STATUS_OK)
      clock%time_step = next_step(config, scene, variation, solver, clock)
      call solver%advance(clock%time_step)
      clock%step = clock%step + 1
      clock%time = clock%time + clock%time_step
      call check_step(config, scene, variation, solver, clock, outcome)
      if (outcome%status /= STATUS_OK) exit
      call note_calm(config, solver, clock)
      call watch(config, solver, observer, clock)
      if (mod(clock%step, steps_per_question) == 0) call ask_monitor(monitor, clock, outcome)
    end do
  end subroutine march

  !> The quasi-static stage before time 0: gravity acts on the body under the damping that is
  !> critical for its slowest wave, 2 omega = pi c/H, held at its toe if it is gated. Ends at rest
  !> or after relaxation_time; then the gate is gone and the points have their first velocities.
  subroutine relax(config, scene, variation, monitor, observer, solver, outcome)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    class(monitor_t), intent(inout) :: monitor
    class(observer_t), intent(inout) :: observer
    type(solver_t), intent(inout) :: solver
    type(outcome_t), intent(inout) :: outcome
    type(config_t) :: stage
    type(variation_t) :: whole
    type(clock_t) :: clock
    type(blind_observer_t) :: nobody
    real(wp) :: vx(solver%particles%count), vy(solver%particles%count)
    logical :: is_shown

    stage = config
    stage%solver%end_time = config%loading%relaxation_time
    stage%solver%settle = max(config%solver%settle, RELAXED)
    whole = variation
    whole%last_step = variation%last_relaxation_step
    vx = solver%particles%vx
    vy = solver%particles%vy
    solver%particles%vx = 0.0_wp
    solver%particles%vy = 0.0_wp
    call solver%grid%clear()
    call solver%start()
    if (config%loading%relaxation == 'gated') call solver%grid%set_gate(scene%toe &
      - solver%particles%origin(1))
    call start_clock(stage, scene, solver, clock)
    solver%damping = real(acos(-1.0_dp)*clock%mean_wave_speed/(scene%extent(4) &
      - scene%extent(3)), wp)
    is_shown = observer%wants_ends .and. variation%last_relaxation_step < huge(1)
    if (is_shown) call show_state(solver, observer, clock)
    call march(stage, scene, whole, monitor, nobody, solver, clock, outcome)
    if (is_shown) call show_state(solver, observer, clock)
    if (outcome%status /= STATUS_OK) then
      if (outcome%status /= STATUS_ABANDONED) outcome%reason = 'before time 0, in the '// &
        'relaxation: '//outcome%reason
      return
    end if
    call solver%grid%open_gate()
    solver%damping = real(config%loading%damping, wp)
    solver%particles%vx = vx
    solver%particles%vy = vy
    solver%particles%plastic_strain = 0.0_wp
    solver%particles%velocity_gradient = 0.0_wp
    call solver%grid%clear()
    call solver%start()
  end subroutine relax

  !> Points, strengths, grid and the first mapping.
  subroutine prepare(config, scene, variation, observer, solver)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    class(observer_t), intent(in) :: observer
    type(solver_t), intent(out) :: solver
    type(config_t) :: here
    integer :: k

    solver%materials = [(create_material(config%materials(k)), k=1, size(config%materials))]
    call place_points(config, scene, variation, solver%particles)
    if (observer%wants_plastic_strain) call solver%particles%track_plastic_strain()
    call solver%configure(config)
    if (config%loading%initial_stress == 'geostatic') then
      call make_admissible(solver%particles, solver%materials)
    end if
    here = counted_from(config, solver%particles%origin)
    call solver%grid%init(here%grid, here%boundaries, variation%cell_stretch, &
      minval(solver%particles%mass), config%solver%threads)
    call solver%start()
  end subroutine prepare

  !> The points of the scene with the properties of the member, for the kernel. What they are copied
  !> through is gone before the grid is there.
  subroutine place_points(config, scene, variation, particles)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    type(particles_t), intent(out) :: particles
    type(shown_particles_t) :: first

    first = scene%particles
    if (allocated(variation%properties)) then
      call set_properties(config, scene%materials, variation%properties, first)
    end if
    call take_particles(first, kernel_origin(config), particles)
  end subroutine place_points

  subroutine start_clock(config, scene, solver, clock)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(inout) :: clock
    real(dp) :: fall

    call measure_member(config, scene, solver, clock)
    clock%peak_energy = solver%tally%kinetic_energy ! at the start both are the same
    clock%calm_needed = SETTLE_PERIODS*4.0_dp*max(scene%extent(2) - scene%extent(1), &
      scene%extent(4) - scene%extent(3))/clock%mean_wave_speed
    clock%calm_front = solver%tally%x_max
    clock%still_speed = STILL*sqrt(norm2(config%loading%gravity)*config%grid%cell_size)
    fall = norm2(config%loading%gravity) &
      *(config%grid%x_max - config%grid%x_min + config%grid%y_max - config%grid%y_min)
    clock%speed_limit = RUNAWAY_FACTOR*(clock%wave_speed + scene%speed + sqrt(2.0_dp*fall))
    clock%potential_at_start = potential_energy(solver%particles, config%loading%gravity)
    clock%energy_at_start = solver%tally%kinetic_energy + clock%potential_at_start
    clock%elastic_at_start = elastic_energy(solver%particles, solver%materials)
    clock%least_energy = clock%energy_at_start + clock%elastic_at_start
    if (any(config%solver%needless == 'ledger')) then
      clock%steps_per_ledger = 1
      clock%steps_per_strain = 1
    end if
  end subroutine start_clock

  !> Wave speeds, mass and first time step: those of the scene, unless modulus or density varies.
  !> The mean of a body is its points over the sum of their 1/c, the time a wave takes.
  subroutine measure_member(config, scene, solver, clock)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(inout) :: clock
    real(dp), allocatable :: speed(:)
    integer :: body

    clock%wave_speed = scene%wave_speed
    clock%mean_wave_speed = scene%wave_speed
    clock%mass = scene%mass
    clock%first_step = scene%first_step
    if (size(solver%particles%young) + size(solver%particles%density) == 0) return
    clock%wave_speed = 0.0_dp
    clock%mean_wave_speed = 0.0_dp
    clock%mass = sum(real(solver%particles%mass, dp))
    do body = 1, size(solver%particles%bodies)
      associate (s => solver%particles, b => solver%particles%bodies(body), &
        material => scene%materials(solver%particles%bodies(body)%material))
        allocate (speed(b%last - b%first + 1), source=sqrt((material%lame &
          + 2.0_dp*material%shear)/material%density))
        if (size(s%young) > 0) speed = speed*sqrt(s%young(b%first:b%last)/material%young)
        if (size(s%density) > 0) speed = speed*sqrt(material%density/s%density(b%first:b%last))
        clock%wave_speed = max(clock%wave_speed, maxval(speed))
        clock%mean_wave_speed = max(clock%mean_wave_speed, size(speed)/sum(1.0_dp/speed))
        deallocate (speed)
      end associate
    end do
    if (.not. scene%fixed_step > 0.0_dp) clock%first_step = config%solver%cfl &
      *config%grid%cell_size/(clock%wave_speed + scene%speed)
  end subroutine measure_member

  !> CFL h/(c + v) with the present wave and point speeds, or the fixed step; never past the end.
  function next_step(config, scene, variation, solver, clock) result(time_step)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(in) :: clock
    real(dp) :: time_step

    if (scene%fixed_step > 0.0_dp) then
      time_step = scene%fixed_step
    else
      ! Points that all float free carry no stress and have no wave speed: then that of the first
      ! state holds.
      time_step = config%solver%cfl*solver%grid%cell_size/(sqrt(solver%tally%speed_squared) &
        + max(real(sqrt(solver%tally%wave_squared), dp), 0.5_dp*clock%wave_speed))
    end if
    time_step = min(time_step*variation%step_factor, config%solver%end_time - clock%time)
  end function next_step

  !> Looks for what has no cure: a state that is not finite, a point outside, a runaway speed, a
  !> collapsing step.
  !> All is read off the tally of the step; only a failure costs a search.
  subroutine check_step(config, scene, variation, solver, clock, outcome)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(inout) :: clock
    type(outcome_t), intent(inout) :: outcome
    real(dp) :: margin, x_first, x_last, y_first, y_last, corner(2)
    integer :: p
    logical :: is_last

    margin = OUTSIDE_MARGIN*solver%grid%cell_size
    corner = [config%grid%x_min, config%grid%y_min] - solver%particles%origin
    x_first = corner(1) - margin
    x_last = corner(1) + margin + &
      (config%grid%x_max - config%grid%x_min)*(1.0_dp + variation%cell_stretch)
    y_first = corner(2) - margin
    y_last = corner(2) + margin + &
      (config%grid%y_max - config%grid%y_min)*(1.0_dp + variation%cell_stretch)
    associate (t => solver%tally, s => solver%particles)
      if (.not. abs(t%kinetic_energy) <= huge(1.0_dp) &
        .or. .not. abs(t%internal_work) <= huge(1.0_dp)) then
        p = minloc(merge(1, 0, abs(s%vx + s%vy + s%sxx + s%syy + s%szz &
          + s%sxy) <= huge(1.0_dp)), dim=1)
        call fail(STATUS_NOT_FINITE, p, &
          'velocity or stress is not a finite number: the time step is too long or '// &
                  'the material too soft for its load')
      else if (t%x_min < x_first .or. t%x_max > x_last .or. t%y_min < y_first &
               .or. t%y_max > y_last) then
        p = minloc(merge(0, 1, s%x < x_first .or. s%x > x_last .or. s%y < y_first .or. &
                         s%y > y_last), dim=1)
        call fail(STATUS_POINT_LOST, p, &
          'point left the grid: make the grid larger or close the wall')
      else if (t%speed_squared > clock%speed_limit**2) then
        p = maxloc(s%vx**2 + s%vy**2, dim=1)
        call fail(STATUS_RUNAWAY, p, 'speed of '//to_text(real(sqrt(t%speed_squared), &
          dp), 4)//' m/s is above all that the '// &
                  'scene can explain: the time step is too long')
      else if (clock%time_step < COLLAPSED_STEP*clock%first_step &
        .and. clock%time < config%solver%end_time) then
        p = maxloc(s%volume/s%mass, dim=1)
        call fail(STATUS_STEP_COLLAPSE, p, 'time step fell to '//to_text(clock%time_step, 4)//' s')
      else
        clock%least_kinetic = min(clock%least_kinetic, t%kinetic_energy)
        is_last = clock%time >= config%solver%end_time
        if (mod(clock%step, clock%steps_per_ledger) == 0 .or. is_last &
          .or. t%kinetic_energy > clock%least_kinetic + clock%notable_rise) call check_ledger()
        if (outcome%status == STATUS_OK .and. (mod(clock%step, clock%steps_per_strain) == 0 &
          .or. is_last)) call check_strain()
      end if
    end associate

  contains

    !> Nothing passive can raise the mechanical energy, with what damping took, above its least
    !> value so far by more than walls and body forces gave. (What walls take is not counted on:
    !> they take kinetic energy of the grid, the points may have lost less.)
    subroutine check_ledger()
      real(dp) :: potential, energy, created, scale, rounding, most

      potential = potential_energy(solver%particles, config%loading%gravity)
      clock%given = clock%given + max(clock%seen_walls - solver%wall_work, 0.0_dp) &
        + max(solver%force_work - clock%seen_forces, 0.0_dp)
      clock%seen_walls = solver%wall_work
      clock%seen_forces = solver%force_work
      energy = solver%tally%kinetic_energy + potential + elastic_energy(solver%particles, &
        solver%materials) + solver%damping_work - clock%given
      clock%least_energy = min(clock%least_energy, energy)
      scale = energy_scale(potential, solver, clock)
      rounding = ENERGY_ROUNDING*(abs(potential) + clock%wave_speed**2*clock%mass)
      created = (energy - clock%least_energy - rounding)/scale
      clock%least_kinetic = solver%tally%kinetic_energy
      clock%notable_rise = MOST_CREATED*scale
      if (.not. created > MOST_CREATED) return
      most = MOST_CREATED + misread_energy(config, solver, clock) + compression(solver)
      if (.not. created > most) return
      call fail(STATUS_ENERGY_CREATED, maxloc(solver%particles%vx**2 + solver%particles%vy**2, &
        dim=1), 'the scheme made energy from nothing, '//to_text(created, 3)//' of what was '// &
        'there: lower the cfl number, or use scheme = ''musl'' and weighting = ''gimp''; the '// &
        'point is the fastest one')
    end subroutine check_ledger

    !> No material here means anything once a point that carries stress has lost or gained most of
    !> its volume.
    subroutine check_strain()
      real(dp) :: ratio
      integer :: point

      call find_extreme_volume(solver, point, ratio)
      if (ratio >= LEAST_VOLUME .and. ratio <= LARGEST_VOLUME) return
      call fail(STATUS_EXTREME_STRAIN, point, 'volume under stress is '//to_text(ratio, 3)// &
        ' of that at the start: the material is too soft for its load, or the scheme unstable')
    end subroutine check_strain

    subroutine fail(status, point, reason)
      integer, intent(in) :: status, point
      character(len=*), intent(in) :: reason

      outcome%status = status
      outcome%reason = reason
      outcome%values(FAILURE_STEP) = clock%step
      outcome%values(FAILURE_POINT) = point
      outcome%values(FAILURE_X) = solver%particles%origin(1) + solver%particles%x(point)
      outcome%values(FAILURE_Y) = solver%particles%origin(2) + solver%particles%y(point)
    end subroutine fail
  end subroutine check_step

  !> At rest once the kinetic energy of the motion has stayed below its share of the peak for long
  !> enough and the farthest point has stood still meanwhile.
  subroutine note_calm(config, solver, clock)
    type(config_t), intent(in) :: config
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(inout) :: clock
    real(dp) :: calm
    logical :: is_calm

    clock%peak_energy = max(clock%peak_energy, solver%tally%motion_energy)
    is_calm = solver%tally%motion_energy < config%solver%settle*clock%peak_energy
    calm = clock%time - clock%calm_since
    if (is_calm .and. calm < clock%calm_needed) return
    clock%settled = is_calm .and. solver%tally%x_max - clock%calm_front <= clock%still_speed*calm
    if (clock%settled) return
    clock%calm_since = clock%time
    clock%calm_front = solver%tally%x_max
  end subroutine note_calm

  subroutine ask_monitor(monitor, clock, outcome)
    class(monitor_t), intent(inout) :: monitor
    type(clock_t), intent(in) :: clock
    type(outcome_t), intent(inout) :: outcome

    select case (monitor%ask())
    case (ABANDON)
      outcome%status = STATUS_ABANDONED
    case (OUT_OF_TIME)
      outcome%status = STATUS_TIME_LIMIT
      outcome%reason = 'wall clock limit of a member reached at '//to_text(clock%time, &
        4)//' s of simulated time'
      outcome%values(FAILURE_STEP) = clock%step
    case default ! GO_ON
    end select
  end subroutine ask_monitor

  !> Calls the observer when its time has come.
  subroutine watch(config, solver, observer, clock)
    type(config_t), intent(in) :: config
    type(solver_t), intent(in) :: solver
    class(observer_t), intent(inout) :: observer
    type(clock_t), intent(inout) :: clock

    if (observer%history_interval > 0.0_dp .and. clock%time >= clock%next_history) then
      call observer%note_history(history_row(config, solver, clock))
      clock%next_history = (floor(clock%time/observer%history_interval) &
        + 1)*observer%history_interval
    end if
    if (observer%snapshot_interval > 0.0_dp .and. clock%time >= clock%next_snapshot) then
      call show_state(solver, observer, clock)
      clock%next_snapshot = (floor(clock%time/observer%snapshot_interval) + 1)* &
        observer%snapshot_interval
    end if
  end subroutine watch

  !> Shows the present state to the observer, unless it has seen it.
  subroutine show_state(solver, observer, clock)
    type(solver_t), intent(in) :: solver
    class(observer_t), intent(inout) :: observer
    type(clock_t), intent(inout) :: clock
    type(shown_particles_t) :: shown

    if (clock%shown_step == clock%step) return
    call show_particles(solver%particles, shown)
    call observer%note_state(clock%step, clock%time, shown)
    clock%shown_step = clock%step
  end subroutine show_state

  function history_row(config, solver, clock) result(row)
    type(config_t), intent(in) :: config
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(in) :: clock
    type(history_row_t) :: row
    real(dp) :: front(1), potential

    associate (s => solver%particles)
      row%time = clock%time
      row%kinetic_energy = solver%tally%kinetic_energy
      row%elastic_energy = elastic_energy(s, solver%materials)
      potential = potential_energy(s, config%loading%gravity)
      row%potential_energy = potential - sum(real(s%mass, dp))*dot_product(config%loading%gravity, &
        s%origin)
      row%plastic_work = solver%internal_work - (row%elastic_energy - clock%elastic_at_start)
      row%damping_work = solver%damping_work
      row%wall_work = solver%wall_work
      row%dissipated = row%plastic_work + row%damping_work + row%wall_work
      row%energy_error = energy_imbalance(potential, solver, clock)
      row%reaction = 0.0_dp
      if (clock%step > 0) row%reaction = solver%grid%reaction(clock%time_step)
      row%momentum = [sum(real(s%mass, dp)*s%vx), sum(real(s%mass, dp)*s%vy)]
      row%angular_momentum = angular_momentum(s)
      row%centre = s%origin + [sum(real(s%mass, dp)*s%x), sum(real(s%mass, dp)*s%y)] &
        /sum(real(s%mass, dp))
      row%front_max = farthest_edge(s)
      front = mass_front(s, [0.995_dp])
      row%front_q995 = front(1)
      row%height_max = surface_height(s, -huge(1.0_dp), huge(1.0_dp), config%grid%y_min)
    end associate
  end function history_row

  !> Energy that appeared from nowhere since the start (negative: vanished): the change of kinetic
  !> and potential energy, and what stresses, damping and walls took, as a share of the largest of
  !> the potential energy released, the peak of kinetic energy, the elastic energy at the start and
  !> the work of forces.
  !> `potential` is the present potential energy, J/m.
  pure function energy_imbalance(potential, solver, clock) result(share)
    real(dp), intent(in) :: potential
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(in) :: clock
    real(dp) :: share

    share = (solver%tally%kinetic_energy + potential + solver%internal_work + solver%damping_work &
      + solver%wall_work - solver%force_work - clock%energy_at_start) &
      /energy_scale(potential, solver, clock)
  end function energy_imbalance

  !> What errors of energy are measured by, J/m.
  pure function energy_scale(potential, solver, clock) result(scale)
    real(dp), intent(in) :: potential
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(in) :: clock
    real(dp) :: scale

    scale = max(abs(clock%potential_at_start - potential), clock%peak_energy, &
      clock%elastic_at_start, abs(solver%force_work), abs(solver%wall_work), tiny(1.0_dp))
  end function energy_scale

  !> Share of the energy of a swing by which kinetic + elastic energy reads wrong between two looks,
  !> since velocity and stress are known half a step apart: omega dt, where a body swings with
  !> omega = pi c/(2 L) across its shorter side L, of a cell or more.
  pure function misread_energy(config, solver, clock) result(share)
    type(config_t), intent(in) :: config
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(in) :: clock
    real(dp) :: share
    real(dp) :: side
    integer :: body

    side = huge(1.0_dp)
    do body = 1, size(solver%particles%bodies)
      associate (b => solver%particles%bodies(body), s => solver%particles)
        side = min(side, &
          real(maxval(s%x(b%first:b%last)) - minval(s%x(b%first:b%last)) + b%width, dp), &
          real(maxval(s%y(b%first:b%last)) - minval(s%y(b%first:b%last)) + b%height, dp))
      end associate
    end do
    side = max(side, config%grid%cell_size)
    share = 0.5_dp*acos(-1.0_dp)*clock%mean_wave_speed*clock%first_step/side
  end function misread_energy

  !> Share of its volume that the most compressed point has lost, among those whose stress follows
  !> from its rate: it stores energy to first order in strain only.
  pure function compression(solver) result(share)
    type(solver_t), intent(in) :: solver
    real(dp) :: share
    integer :: body

    share = 0.0_dp
    do body = 1, size(solver%particles%bodies)
      associate (b => solver%particles%bodies(body), s => solver%particles)
        if (solver%materials(b%material)%model == MODEL_NEO_HOOKEAN) cycle
        if (size(s%density) > 0) then
          share = max(share, real(1.0_wp - minval(s%density(b%first:b%last) &
            *s%volume(b%first:b%last)/s%mass(b%first:b%last)), dp))
          cycle
        end if
        share = max(share, 1.0_dp - solver%materials(b%material)%density &
          *minval(s%volume(b%first:b%last)/s%mass(b%first:b%last)))
      end associate
    end do
  end function compression

  !> The point under stress whose volume is farthest from that at its start, as their `ratio`.
  pure subroutine find_extreme_volume(solver, point, ratio)
    type(solver_t), intent(in) :: solver
    integer, intent(out) :: point
    real(dp), intent(out) :: ratio
    real(dp) :: here
    real(wp) :: density
    integer :: body, p

    point = 1
    ratio = 1.0_dp
    associate (s => solver%particles)
      do body = 1, size(s%bodies)
        do p = s%bodies(body)%first, s%bodies(body)%last
          if (s%gap(p) > 0.0_dp) cycle
          density = solver%materials(s%bodies(body)%material)%density
          if (size(s%density) > 0) density = s%density(p)
          here = density*s%volume(p)/s%mass(p)
          if (max(here, 1.0_dp/here) <= max(ratio, 1.0_dp/ratio)) cycle
          ratio = here
          point = p
        end do
      end do
    end associate
  end subroutine find_extreme_volume

  !> The columns of a member that ended well.
  subroutine measure(config, scene, variation, solver, clock, outcome)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    type(variation_t), intent(in) :: variation
    type(solver_t), intent(in) :: solver
    type(clock_t), intent(in) :: clock
    type(outcome_t), intent(inout) :: outcome
    real(dp) :: front(2), point_depth, cell, right_wall
    real(dp), allocatable :: angles(:)
    logical :: touched

    cell = config%grid%cell_size
    associate (s => solver%particles, v => outcome%values, g => config%grid)
      v(RUNOUT_MAX) = farthest_edge(s) - scene%toe
      front = mass_front(s, [0.99_dp, 0.995_dp])
      v(RUNOUT_Q99) = front(1) - scene%toe
      v(RUNOUT_Q995) = front(2) - scene%toe
      outcome%height = deposit_depth(s, solver%materials, g%x_min, cell, size(scene%profile_x))
      ! Half the height of a point (CONTRACT; with 2 x 2 points a cell a single one in a column).
      point_depth = 0.5_dp*minval(s%bodies%height, mask=s%bodies%is_measured)
      v(RUNOUT_CONNECTED) = connected_front(outcome%height, g%x_min, cell, &
                                            scene%extent(1) + 0.5_dp*cell, point_depth) - scene%toe
      v(HEIGHT_MAX) = surface_height(s, -huge(1.0_dp), huge(1.0_dp), g%y_min) - g%y_min
      v(HEIGHT_WALL) = surface_height(s, scene%extent(1), scene%extent(1) + cell, g%y_min) - g%y_min
      v(SETTLED) = merge(1.0_dp, 0.0_dp, clock%settled)
      if (clock%settled) v(SETTLE_TIME) = clock%calm_since
      v(KINETIC_ENERGY_END) = solver%tally%motion_energy
      v(KINETIC_ENERGY_RATIO) = solver%tally%motion_energy/max(clock%peak_energy, tiny(1.0_dp))
      right_wall = g%x_min + (g%x_max - g%x_min)*(1.0_dp + variation%cell_stretch)
      touched = scene%extent(2) < g%x_max - cell .and. v(RUNOUT_MAX) + scene%toe > right_wall - cell
      touched = touched .or. (scene%extent(1) > g%x_min + cell .and. s%origin(1) + minval(s%x, &
        mask=s%is_measured()) < g%x_min + cell)
      v(WALL_TOUCHED) = merge(1.0_dp, 0.0_dp, touched)
      v(ENERGY_ERROR) = energy_imbalance(potential_energy(s, config%loading%gravity), solver, clock)
      v(MASS_ERROR) = sum(real(s%mass, dp))/clock%mass - 1.0_dp
      angles = pack(real(s%friction_angle, dp), s%is_measured() .and. &
        ieee_is_finite(s%friction_angle))
      if (size(angles) > 0) then
        v(FIELD_MEAN) = sum(angles)/size(angles)
        v(FIELD_MIN) = minval(angles)
        v(FIELD_MAX) = maxval(angles)
      end if
    end associate
  end subroutine measure
end module sg_simulation
