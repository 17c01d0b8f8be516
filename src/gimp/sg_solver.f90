!> One explicit step of the material point method, for the three orders in which stresses can be
!> updated.
!>
!>   usl   momentum first, stress last: both with the grid of the step. One sweep over the points
!> serves the end of
!>         one step and the start of the next.
!>   musl  as usl, but strains follow from the velocity mapped back from the updated points (Sulsky
!> et al. 1995).
!>   usf   stress first, from the velocity at the start of the step (Bardenhagen 2002).
!>
!> All are made of the same sweep with other parts of it switched on.
!>
!> With several threads a sweep has two parts: points are moved, a range of blocks to each thread,
!> then mapped, a strip of rows of nodes to each thread. A thread maps all points that reach its
!> strip, in their order, and throws away what they bring elsewhere. So every node receives the same
!> numbers in the same order however many threads there are: results are the same to the last bit.
module sg_solver
  use sg_blocks, only: block_t, cut_into_blocks, share_out_rows, strip_t
  use sg_cell_average, only: cell_average_t
  use sg_config, only: config_t
  use sg_grid, only: grid_t, losses_t, tally_t
  use sg_kinds, only: dp, wp
  use sg_manufactured, only: manufactured_force
  use sg_materials, only: material_t, MODEL_NEO_HOOKEAN
  use sg_neo_hookean, only: find_stretch
  use sg_particles, only: body_points_t, particles_t
  use sg_stress_update, only: can_crack, update_stress, wave_speed_squared
  use sg_transfer, only: gather_motion, gather_motion_and_gradient, map_body_force, map_force, &
    map_gradient, map_momentum, map_momentum_and_force
  use sg_weighting, only: axis_weights_interface, BLOCK, bspline_axis_weights, &
    cpgimp_axis_weights, gimp_axis_weights, linear_axis_weights, weights_t
  implicit none
  private

  public :: solver_t

  integer, parameter :: SCHEME_USL = 1
  integer, parameter :: SCHEME_MUSL = 2
  integer, parameter :: SCHEME_USF = 3

  !> The parts of a sweep over the points, in the order in which they run.
  type :: sweep_t
    !> v_p takes the increment of the grid (FLIP) or its velocity (PIC).
    logical :: update_velocity = .false.
    !> Velocity gradient, strain, stress, volume.
    logical :: update_stress = .false.
    !> First component of `motion` that moves the points: 1 or 3; 0 leaves them where they are.
    integer :: move_with = 0
    logical :: map_momentum = .false.
    logical :: map_force = .false.
    !> Only adds up the volumetric strain rate, or the pressure, in the cells (anti-locking).
    logical :: average_divergence = .false., average_pressure = .false.
  contains
    procedure :: points_part
    procedure :: nodes_part
  end type sweep_t

  type :: solver_t
    integer :: scheme
    procedure(axis_weights_interface), pointer, nopass :: axis_weights => null()
    !> Points carry the gradient of their velocity to the nodes (TPIC, with flip = 0).
    logical :: carries_gradient = .false.
    !> Share of FLIP (1 - share is PIC), gravity in m/s^2, damping in 1/s.
    real(wp) :: flip, gravity(2), damping
    !> Points keep that gradient, whether it is carried or not.
    logical :: keeps_gradient = .false.
    !> A fixed time step asks for no wave speed.
    logical :: finds_wave_speed = .true.
    !> The grid visits all its nodes, not only those in the window around the points.
    logical :: visits_all_nodes = .false.
    !> Points map to and gather from the nodes of their stencils with weight zero, too.
    logical :: weighs_all_nodes = .false.
    !> The domains of the points follow their stretch (cpGIMP).
    logical :: stretches_domains = .false.
    type(material_t), allocatable :: materials(:)
    !> Volumetric strain rates and pressures are those of the cells (sg_cell_average).
    logical :: averages_cells = .false.
    type(cell_average_t) :: cells
    !> Amplitude of the manufactured solution in m, 0: none; time in s.
    real(wp) :: amplitude = 0.0_wp
    real(dp) :: time = 0.0_dp
    type(grid_t) :: grid
    type(particles_t) :: particles
    type(block_t), allocatable :: blocks(:)
    !> What a sweep found out about each block; of size 0 for one thread.
    type(tally_t), allocatable :: tallies(:)
    !> What the last step found out about the points.
    type(tally_t) :: tally
    !> Work of the stresses, and energy taken by damping and by the walls since the start, J/m.
    real(dp) :: internal_work = 0.0_dp, damping_work = 0.0_dp, wall_work = 0.0_dp
    !> Work of body forces other than gravity, J/m.
    real(dp) :: force_work = 0.0_dp
  contains
    procedure :: configure
    procedure :: start
    procedure :: advance
    procedure, private :: do_needless
    procedure, private :: limit_grid
    procedure, private :: sweep_points
    procedure, private :: sweep_in_threads
    procedure, private :: sweep_block
    procedure :: find_weights
    procedure, private :: stretch_domains
    procedure, private :: sweep_stress
    procedure, private :: average_pressure
    procedure, private :: average_block
    procedure, private :: push_points
  end type solver_t

contains

  !> Takes the choices of the configuration; particles and materials are there already, the grid
  !> follows.
  subroutine configure(this, config)
    class(solver_t), intent(inout) :: this
    type(config_t), intent(in) :: config

    select case (config%solver%scheme)
    case ('usl')
      this%scheme = SCHEME_USL
    case ('usf')
      this%scheme = SCHEME_USF
    case default
      this%scheme = SCHEME_MUSL
    end select
    select case (config%solver%weighting)
    case ('linear')
      this%axis_weights => linear_axis_weights
    case ('cpgimp')
      this%axis_weights => cpgimp_axis_weights
    case ('bspline')
      this%axis_weights => bspline_axis_weights
    case default
      this%axis_weights => gimp_axis_weights
    end select
    this%stretches_domains = config%solver%weighting == 'cpgimp'
    if (this%stretches_domains .or. any(this%materials%model == MODEL_NEO_HOOKEAN)) then
      call this%particles%track_deformation()
    end if
    if (any(this%materials%softens)) call this%particles%track_plastic_strain()
    if (can_crack(this%particles, this%materials)) call this%particles%track_cracks()
    this%averages_cells = config%solver%anti_locking == 'cell_average'
    if (config%loading%body_force == 'manufactured') this%amplitude = &
      real(config%loading%amplitude, wp)
    this%carries_gradient = config%solver%transfer == 'tpic'
    this%keeps_gradient = this%carries_gradient
    this%flip = merge(0.0_wp, real(config%solver%flip, wp), this%carries_gradient)
    this%finds_wave_speed = .not. config%solver%time_step > 0.0_dp
    this%gravity = real(config%loading%gravity, wp)
    this%damping = real(config%loading%damping, wp)
    call this%do_needless(config%solver%needless)
    ! Points may dilate where their material does not.
    if (size(this%particles%dilation_angle) > 0) this%materials%divides_always = .true.
    if (this%keeps_gradient) call this%particles%carry_gradient()
  end subroutine configure

  !> Switches on the work that the scene can do without and that is asked for by `words`. Each word
  !> has its place here; `ledger` is that of sg_simulation.
  subroutine do_needless(this, words)
    class(solver_t), intent(inout) :: this
    character(len=*), intent(in) :: words(:)

    this%visits_all_nodes = any(words == 'empty_nodes')
    this%weighs_all_nodes = any(words == 'zero_weights')
    this%finds_wave_speed = this%finds_wave_speed .or. any(words == 'wave_speed')
    this%keeps_gradient = this%keeps_gradient .or. any(words == 'velocity_gradient')
    this%materials%closes_all_gaps = any(words == 'gaps')
    this%materials%divides_always = any(words == 'dilation')
    if (any(words == 'exact_return')) this%materials%most_violation = -huge(1.0_wp)
    if (any(words == 'cracks')) call this%particles%track_cracks()
    if (any(words == 'deformation')) call this%particles%track_deformation()
    if (any(words == 'plastic_strain')) call this%particles%track_plastic_strain()
  end subroutine do_needless

  !> Maps the initial state to the nodes.
  subroutine start(this)
    class(solver_t), intent(inout) :: this

    this%time = 0.0_wp
    this%internal_work = 0.0_wp
    this%force_work = 0.0_wp
    this%damping_work = 0.0_wp
    this%wall_work = 0.0_wp
    this%blocks = cut_into_blocks(this%particles%bodies%first, this%particles%bodies%last)
    if (allocated(this%tallies)) deallocate (this%tallies)
    allocate (this%tallies(merge(size(this%blocks), 0, this%grid%threads > 1)))
    call note_all(this)
    call this%average_pressure()
    call this%sweep_points(sweep_t(map_momentum=.true., map_force=this%scheme /= SCHEME_USF), &
      0.0_wp)
    call this%limit_grid()
  end subroutine start

  !> Leaves to the grid the nodes that points can reach; those it visits are all of them before.
  subroutine limit_grid(this)
    class(solver_t), intent(inout) :: this

    if (.not. this%visits_all_nodes) call this%grid%set_window(this%tally)
  end subroutine limit_grid

  !> Bounds, energy and speeds of the initial state.
  subroutine note_all(this)
    type(solver_t), intent(inout) :: this
    type(tally_t) :: tally
    integer :: k

    call this%tally%reset()
    do k = 1, size(this%blocks)
      call tally%reset()
      associate (p => this%particles, first => this%blocks(k)%first, last => this%blocks(k)%last)
        tally%x_min = minval(p%x(first:last))
        tally%x_max = maxval(p%x(first:last))
        tally%y_min = minval(p%y(first:last))
        tally%y_max = maxval(p%y(first:last))
        tally%speed_squared = maxval(p%vx(first:last)**2 + p%vy(first:last)**2)
        tally%kinetic_energy = 0.5_wp*sum(p%mass(first:last)*(p%vx(first:last)**2 &
          + p%vy(first:last)**2))
        tally%motion_energy = tally%kinetic_energy
        tally%wave_squared = wave_speed_squared(p, &
          this%materials(p%bodies(this%blocks(k)%body)%material), first, last)
      end associate
      this%blocks(k)%rows = this%grid%rows_of(tally)
      call this%tally%add(tally)
    end do
  end subroutine note_all

  !> One step of `seconds`.
  subroutine advance(this, seconds)
    class(solver_t), intent(inout) :: this
    real(dp), intent(in) :: seconds
    real(wp) :: time_step
    type(losses_t) :: losses

    time_step = real(seconds, wp)
    call this%tally%reset()
    ! Forces mapped in this step, of stresses too, are those of its end.
    this%time = this%time + seconds
    select case (this%scheme)
    case (SCHEME_USL)
      call this%grid%integrate_momentum(time_step, this%gravity, this%damping, losses)
      call this%sweep_stress(sweep_t(update_velocity=.true., update_stress=.true., move_with=3, &
                                     map_momentum=.true., map_force=.true.), time_step)
    case (SCHEME_MUSL)
      call this%grid%integrate_momentum(time_step, this%gravity, this%damping, losses)
      call this%sweep_points(sweep_t(update_velocity=.true., map_momentum=.true.), time_step)
      call this%grid%remap_velocity()
      ! That of the gradients counts when they are mapped for good.
      this%tally%kinetic_energy = 0.0_wp
      call this%sweep_stress(sweep_t(update_stress=.true., move_with=1, map_momentum=.true., &
        map_force=.true.), &
                             time_step)
    case default ! SCHEME_USF
      call this%grid%find_velocity()
      call this%sweep_stress(sweep_t(update_stress=.true., map_force=.true.), time_step)
      call this%grid%integrate_momentum(time_step, this%gravity, this%damping, losses)
      call this%sweep_points(sweep_t(update_velocity=.true., move_with=3, map_momentum=.true.), &
        time_step)
    end select
    this%damping_work = this%damping_work + losses%damping
    this%wall_work = this%wall_work + losses%walls
    this%internal_work = this%internal_work + this%tally%internal_work
    this%force_work = this%force_work + this%tally%force_work
    call this%limit_grid()
  end subroutine advance

  !> A sweep that updates stress. Where cells are averaged, in four passes: rates in the cells,
  !> stress, pressure in the cells, forces.
  subroutine sweep_stress(this, sweep, time_step)
    class(solver_t), intent(inout) :: this
    type(sweep_t), intent(in) :: sweep
    real(wp), intent(in) :: time_step
    type(sweep_t) :: part

    if (.not. this%averages_cells) then
      call this%sweep_points(sweep, time_step)
      return
    end if
    call this%cells%clear(this%grid%x, this%grid%y)
    call this%sweep_points(sweep_t(average_divergence=.true.), 0.0_wp)
    part = sweep
    part%map_momentum = .false.
    part%map_force = .false.
    call this%sweep_points(part, time_step)
    call this%average_pressure()
    call this%sweep_points(sweep_t(map_momentum=sweep%map_momentum, map_force=sweep%map_force), &
      time_step)
  end subroutine sweep_stress

  subroutine average_pressure(this)
    class(solver_t), intent(inout) :: this

    if (.not. this%averages_cells) return
    call this%cells%clear(this%grid%x, this%grid%y)
    call this%sweep_points(sweep_t(average_pressure=.true.), 0.0_wp)
  end subroutine average_pressure

  !> Goes once over all points.
  subroutine sweep_points(this, sweep, time_step)
    class(solver_t), intent(inout) :: this
    type(sweep_t), intent(in) :: sweep
    real(wp), intent(in) :: time_step
    type(tally_t) :: tally
    integer :: k

    if (this%grid%threads > 1) then
      call this%sweep_in_threads(sweep, time_step)
      return
    end if
    associate (all_rows => strip_t([0, this%grid%y%last], this%grid%first_spare))
      do k = 1, size(this%blocks)
        call tally%reset()
        call this%sweep_block(sweep, time_step, this%blocks(k), all_rows, tally)
        call this%tally%add(tally)
      end do
    end associate
  end subroutine sweep_points

  !> The same in two parts. Tallies of blocks are added in the order of the blocks.
  subroutine sweep_in_threads(this, sweep, time_step)
    class(solver_t), intent(inout) :: this
    type(sweep_t), intent(in) :: sweep
    real(wp), intent(in) :: time_step
    type(tally_t) :: tally
    type(strip_t) :: strips(this%grid%threads), no_rows
    type(sweep_t) :: part
    integer :: k, thread
    logical :: is_idle, is_home

    part = sweep%points_part()
    is_idle = .not. (part%update_velocity .or. part%update_stress .or. part%move_with > 0)
    no_rows = strip_t([0, -1], this%grid%first_spare)
    !$omp parallel do num_threads(this%grid%threads) schedule(static) private(tally)
    do k = 1, size(this%blocks)
      call tally%reset()
      if (.not. is_idle) call this%sweep_block(part, time_step, this%blocks(k), no_rows, tally)
      if (part%move_with > 0) this%blocks(k)%rows = this%grid%rows_of(tally)
      this%tallies(k) = tally
    end do
    part = sweep%nodes_part()
    strips%spare = [(this%grid%spare_node(thread), thread=1, size(strips))]
    call share_out_rows(this%blocks, this%grid%y%last, strips)
    !$omp parallel do num_threads(this%grid%threads) schedule(static) private(k, tally, is_home)
    do thread = 1, this%grid%threads
      do k = 1, size(this%blocks)
        associate (here => strips(thread)%rows, reached => this%blocks(k)%rows)
          if (reached(1) > here(2) .or. reached(2) < here(1)) cycle
          ! Of the threads that map this block one keeps its tally.
          is_home = reached(1) >= here(1)
          call tally%reset()
          if (is_home) tally = this%tallies(k)
          call this%sweep_block(part, time_step, this%blocks(k), strips(thread), tally)
          if (is_home) this%tallies(k) = tally
        end associate
      end do
    end do
    do k = 1, size(this%blocks)
      call this%tally%add(this%tallies(k))
    end do
  end subroutine sweep_in_threads

  !> What `this` does to points, whose blocks know nothing of one another.
  pure function points_part(this) result(part)
    class(sweep_t), intent(in) :: this
    type(sweep_t) :: part

    part = sweep_t(update_velocity=this%update_velocity, update_stress=this%update_stress, &
      move_with=this%move_with)
  end function points_part

  !> What `this` adds to nodes and cells.
  pure function nodes_part(this) result(part)
    class(sweep_t), intent(in) :: this
    type(sweep_t) :: part

    part = sweep_t(map_momentum=this%map_momentum, map_force=this%map_force, &
      average_divergence=this%average_divergence, average_pressure=this%average_pressure)
  end function nodes_part

  !> One block of points; maps to the nodes of `strip`, adds to `tally`.
  subroutine sweep_block(this, sweep, time_step, points, strip, tally)
    class(solver_t), intent(inout) :: this
    type(sweep_t), intent(in) :: sweep
    real(wp), intent(in) :: time_step
    type(block_t), intent(in) :: points
    type(strip_t), intent(in) :: strip
    type(tally_t), intent(inout) :: tally
    type(weights_t) :: w
    real(wp) :: value(BLOCK, 4), gradient(BLOCK, 4), change(BLOCK)
    logical :: keep_gradient
    integer :: first, last, n

    first = points%first
    last = points%last
    n = last - first + 1
    associate (p => this%particles, g => this%grid, body => this%particles%bodies(points%body))
      if (sweep%average_pressure) then
        call this%cells%add(n, p%x(first:last), p%y(first:last), p%volume(first:last), &
          0.5_wp*(p%sxx(first:last) + p%syy(first:last)), strip%rows)
        return
      end if
      call this%find_weights(first, last, w)
      keep_gradient = this%keeps_gradient .and. sweep%update_velocity
      if (sweep%update_stress .or. sweep%average_divergence .or. keep_gradient) then
        call gather_motion_and_gradient(w, g%x%last, g%y%last, &
          g%motion_store(g%motion_start), value, gradient)
      else if (sweep%update_velocity) then
        call gather_motion(w, g%x%last, g%y%last, g%motion_store(g%motion_start), value)
      end if
      if (sweep%average_divergence) then
        call this%cells%add(n, p%x(first:last), p%y(first:last), p%volume(first:last), &
          gradient(:n, 1) + gradient(:n, 4), strip%rows)
        return
      end if
      if (keep_gradient) p%velocity_gradient(:, first:last) = transpose(gradient(:n, :))
      if (sweep%update_velocity) then
        call update_velocity(n, this%flip, value, p%vx(first:last), p%vy(first:last))
      end if
      if (sweep%update_stress) then
        if (this%averages_cells) then
          change(:n) = 0.5_wp*(this%cells%mean(n, p%x(first:last), p%y(first:last)) &
            - (gradient(:n, 1) + gradient(:n, 4)))
          gradient(:n, 1) = gradient(:n, 1) + change(:n)
          gradient(:n, 4) = gradient(:n, 4) + change(:n)
        end if
        call update_stress(p, this%materials(body%material), first, last, time_step, gradient, &
          tally%internal_work)
        if (this%finds_wave_speed) tally%wave_squared = wave_speed_squared(p, &
          this%materials(body%material), first, last)
      end if
      if (sweep%move_with > 0) then
        call move_points(n, time_step, sweep%move_with, value, p%mass(first:last), &
          p%vx(first:last), p%vy(first:last), p%x(first:last), p%y(first:last), tally)
        ! Only now: what was mapped with a domain has to be gathered with it, or momentum is lost.
        if (this%stretches_domains) call this%stretch_domains(body, first, last)
      end if
      if (.not. (sweep%map_momentum .or. sweep%map_force)) return
      if (sweep%move_with > 0) call this%find_weights(first, last, w)
      call w%number_rows(n, g%x%last)
      if (points%rows(1) < strip%rows(1) .or. points%rows(2) > strip%rows(2)) then
        call w%keep_rows(n, strip%rows(1), strip%rows(2), strip%spare)
      end if
      if (this%averages_cells .and. sweep%map_force) then
        call this%average_block(sweep, first, last, w)
      else if (sweep%map_momentum .and. sweep%map_force) then
        call map_momentum_and_force(n, w, p%mass(first:last), p%vx(first:last), p%vy(first:last), &
          p%volume(first:last), p%sxx(first:last), p%syy(first:last), p%sxy(first:last), &
          g%last_node, g%total_store(g%total_start))
      else if (sweep%map_momentum) then
        call map_momentum(n, w, p%mass(first:last), p%vx(first:last), p%vy(first:last), &
          g%last_node, g%total_store(g%total_start))
      else if (sweep%map_force) then
        call map_force(n, w, p%volume(first:last), p%sxx(first:last), p%syy(first:last), &
                       p%sxy(first:last), g%last_node, g%total_store(g%total_start))
      end if
      if (sweep%map_momentum .and. this%carries_gradient) call map_gradient(n, w, &
        p%mass(first:last), p%x(first:last), p%y(first:last), p%velocity_gradient(:, first:last), &
        g%x, g%y, g%last_node, g%total_store(g%total_start), tally%kinetic_energy)
      if (sweep%map_force .and. this%amplitude > 0.0_wp) call this%push_points(time_step, &
        this%materials(body%material), first, last, w, tally%force_work)
    end associate
  end subroutine sweep_block

  !> Maps a block whose forces come from the pressure of the cells.
  subroutine average_block(this, sweep, first, last, w)
    class(solver_t), intent(inout) :: this
    type(sweep_t), intent(in) :: sweep
    integer, intent(in) :: first, last
    type(weights_t), intent(in) :: w
    real(wp) :: change(BLOCK)
    integer :: n

    n = last - first + 1
    associate (p => this%particles, g => this%grid)
      change(:n) = this%cells%mean(n, p%x(first:last), p%y(first:last)) &
        - 0.5_wp*(p%sxx(first:last) + p%syy(first:last))
      if (sweep%map_momentum) call map_momentum(n, w, p%mass(first:last), p%vx(first:last), &
        p%vy(first:last), g%last_node, g%total_store(g%total_start))
      call map_force(n, w, p%volume(first:last), p%sxx(first:last) + change(:n), p%syy(first:last) &
        + change(:n), p%sxy(first:last), g%last_node, g%total_store(g%total_start))
    end associate
  end subroutine average_block

  !> Adds the body force of the manufactured solution, which knows of one density, to the nodes.
  !> Adds its work in J/m to `work`.
  subroutine push_points(this, time_step, material, first, last, w, work)
    class(solver_t), intent(inout) :: this
    real(wp), intent(in) :: time_step
    type(material_t), intent(in) :: material
    integer, intent(in) :: first, last
    type(weights_t), intent(in) :: w
    real(dp), intent(inout) :: work
    real(wp) :: bx(BLOCK), by(BLOCK)
    integer :: n

    n = last - first + 1
    associate (p => this%particles, g => this%grid)
      call manufactured_force(n, material, this%amplitude, this%time, p%x_start(first:last), &
        p%y_start(first:last), bx, by)
      call map_body_force(n, w, p%mass(first), bx, by, g%last_node, &
        g%total_store(g%total_start))
      work = work + time_step*p%mass(first)*sum(p%vx(first:last)*bx(:n) &
        + p%vy(first:last)*by(:n))
    end associate
  end subroutine push_points

  !> Weights of the points `first` to `last` at their present place.
  pure subroutine find_weights(this, first, last, w)
    class(solver_t), intent(in) :: this
    integer, intent(in) :: first, last
    type(weights_t), intent(inout) :: w
    integer :: n

    n = last - first + 1
    associate (p => this%particles, g => this%grid)
      call this%axis_weights(n, p%x(first:last), p%width(first:last), g%x, w%i, w%sx, w%gx)
      call this%axis_weights(n, p%y(first:last), p%height(first:last), g%y, w%j, w%sy, w%gy)
      call w%find_stencils(n, g%x%last, this%weighs_all_nodes)
    end associate
  end subroutine find_weights

  !> cpGIMP: the domains of the points take their stretch.
  subroutine stretch_domains(this, body, first, last)
    class(solver_t), intent(inout) :: this
    type(body_points_t), intent(in) :: body
    integer, intent(in) :: first, last
    real(wp) :: stretch_x(BLOCK), stretch_y(BLOCK)
    integer :: n

    n = last - first + 1
    associate (p => this%particles)
      call find_stretch(n, p%fxx(first:last), p%fxy(first:last), p%fyx(first:last), &
        p%fyy(first:last), stretch_x, stretch_y)
      p%width(first:last) = body%width*stretch_x(:n)
      p%height(first:last) = body%height*stretch_y(:n)
    end associate
  end subroutine stretch_domains

  !> v_p = flip (v_p + sum S dv_i) + (1 - flip) sum S v_i.
  pure subroutine update_velocity(n, flip, value, vx, vy)
    integer, intent(in) :: n
    real(wp), intent(in) :: flip, value(BLOCK, 4)
    real(wp), intent(inout) :: vx(n), vy(n)
    integer :: p

    !$omp simd
    do p = 1, n
      vx(p) = flip*(vx(p) + value(p, 1)) + (1.0_wp - flip)*value(p, 3)
      vy(p) = flip*(vy(p) + value(p, 2)) + (1.0_wp - flip)*value(p, 4)
    end do
  end subroutine update_velocity

  !> x_p += v dt with v = value(:, k:k+1); adds to the tally.
  pure subroutine move_points(n, time_step, k, value, mass, vx, vy, x, y, tally)
    integer, intent(in) :: n, k
    real(wp), intent(in) :: time_step, value(BLOCK, 4), mass(n), vx(n), vy(n)
    real(wp), intent(inout) :: x(n), y(n)
    type(tally_t), intent(inout) :: tally
    real(wp) :: x_min, x_max, y_min, y_max, motion, energy, speed_squared, squared
    integer :: p

    x_min = tally%x_min; x_max = tally%x_max
    y_min = tally%y_min; y_max = tally%y_max
    speed_squared = tally%speed_squared
    motion = 0.0_wp
    energy = 0.0_wp
    !$omp simd private(squared) reduction(min:x_min, y_min) &
    !$omp& reduction(max:x_max, y_max, speed_squared) reduction(+:motion, energy)
    do p = 1, n
      x(p) = x(p) + time_step*value(p, k)
      y(p) = y(p) + time_step*value(p, k + 1)
      motion = motion + mass(p)*(value(p, k)*value(p, k) + value(p, k + 1)*value(p, k + 1))
      x_min = min(x_min, x(p))
      x_max = max(x_max, x(p))
      y_min = min(y_min, y(p))
      y_max = max(y_max, y(p))
      squared = vx(p)*vx(p) + vy(p)*vy(p)
      speed_squared = max(speed_squared, squared)
      energy = energy + mass(p)*squared
    end do
    tally%x_min = x_min; tally%x_max = x_max
    tally%y_min = y_min; tally%y_max = y_max
    tally%speed_squared = speed_squared
    tally%motion_energy = tally%motion_energy + 0.5_wp*motion
    tally%kinetic_energy = tally%kinetic_energy + 0.5_wp*energy
  end subroutine move_points
end module sg_solver
