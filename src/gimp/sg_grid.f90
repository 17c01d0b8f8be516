!> The background grid: square cells, nodes that live for one step, and the walls.
!>
!> Nodes are counted from 0; two layers of nodes lie outside the walls, so that the weighting
!> function of a point at a wall has its full stencil. Only nodes in the window around the points
!> are touched. Whoever reads the sums last clears them, so that they are zero when points are next
!> mapped.
!>
!> With threads, each has a strip of rows of nodes. What is summed over nodes is summed along rows
!> first, so that no sum knows how the rows were shared out.
module sg_grid
  use sg_boundary, only: apply_conditions, condition_t, create_prescribed, create_wall, &
    hold_conditions
  use sg_config, only: boundary_config_t, grid_config_t
  use sg_kinds, only: dp, wp
  use sg_memory, only: aligned_start, ALIGNMENT_SLACK
  use sg_rounding, only: COARSENESS
  use sg_weighting, only: axis_t, NO_WALL
  implicit none
  private

  public :: grid_t, losses_t, tally_t

  !> Spare nodes of a thread: three are used, the fourth fills the cache line in single precision.
  integer, parameter :: SPARE = 4
  !> Layers of nodes outside each wall.
  integer, parameter :: GHOST = 2
  !> Share of the smallest point mass below which a node counts as empty. Momentum over mass is
  !> accurate however small both are; a weight S below this means that the point reaches the node by
  !> less than the rounding of its position.
  real(wp), parameter :: EMPTY_NODE = 1.0e-30_wp*COARSENESS**2

  !> What a pass over the points finds out about them.
  type :: tally_t
    real(wp) :: x_min, x_max, y_min, y_max
    !> Largest speed squared and largest wave speed squared in (m/s)^2.
    real(wp) :: speed_squared, wave_squared
    !> Kinetic energy in J/m.
    real(dp) :: kinetic_energy
    !> Kinetic energy of the motion of the points, with the velocities they are moved with, J/m. A
    !> point can keep a velocity that the grid does not see; it moves nothing, and so does not count
    !> when rest is looked for.
    real(dp) :: motion_energy
    !> Work of the stresses and of body forces other than gravity in this step, J/m.
    real(dp) :: internal_work, force_work
  contains
    procedure :: reset => reset_tally
    procedure :: add => add_tally
  end type tally_t

  !> Energy that left the nodes in a step, J/m.
  type :: losses_t
    !> To the damping force, and to walls and prescribed velocities (negative: they put some in).
    real(dp) :: damping = 0.0_dp, walls = 0.0_dp
  end type losses_t

  type :: grid_t
    real(wp) :: cell_size
    type(axis_t) :: x, y
    !> Walls that hold, walls with contact (at a corner friction must not slip where the other wall
    !> holds), then the prescribed velocities, applied in this order.
    type(condition_t), allocatable :: conditions(:)
    !> The last condition is a gate.
    logical :: has_gate = .false.
    !> Mass below which a node counts as empty, kg/m.
    real(wp) :: least_mass
    !> Storage of the nodes. What counts begins at element `total_start` and `motion_start` on a
    !> cache line, as total(8, 0:nx, 0:ny) and motion(8, 0:nx, 0:ny), see sg_transfer; hand over
    !> total_store(total_start).
    real(wp), allocatable :: total_store(:), motion_store(:)
    integer :: total_start, motion_start
    !> Last node of total_store. Those from `first_spare` on lie nowhere, SPARE for each thread:
    !> what it leaves to other threads is thrown away there.
    integer :: last_node, first_spare
    integer :: threads = 1
    !> Window of nodes that points can have touched: i_first, i_last, j_first, j_last.
    integer :: window(4)
  contains
    procedure :: init => init_grid
    procedure :: set_window
    procedure :: rows_of
    procedure :: spare_node
    procedure :: integrate_momentum
    procedure :: find_velocity
    procedure :: remap_velocity
    procedure :: reaction
    procedure :: clear
    procedure :: set_gate
    procedure :: open_gate
  end type grid_t

contains

  pure subroutine reset_tally(this)
    class(tally_t), intent(inout) :: this

    this%x_min = huge(1.0_wp)
    this%x_max = -huge(1.0_wp)
    this%y_min = huge(1.0_wp)
    this%y_max = -huge(1.0_wp)
    this%kinetic_energy = 0.0_wp
    this%speed_squared = 0.0_wp
    this%wave_squared = 0.0_wp
    this%motion_energy = 0.0_wp
    this%internal_work = 0.0_wp
    this%force_work = 0.0_wp
  end subroutine reset_tally

  !> Adds what was found out about other points.
  pure subroutine add_tally(this, other)
    class(tally_t), intent(inout) :: this
    type(tally_t), intent(in) :: other

    this%x_min = min(this%x_min, other%x_min)
    this%x_max = max(this%x_max, other%x_max)
    this%y_min = min(this%y_min, other%y_min)
    this%y_max = max(this%y_max, other%y_max)
    this%speed_squared = max(this%speed_squared, other%speed_squared)
    this%wave_squared = max(this%wave_squared, other%wave_squared)
    this%kinetic_energy = this%kinetic_energy + other%kinetic_energy
    this%motion_energy = this%motion_energy + other%motion_energy
    this%internal_work = this%internal_work + other%internal_work
    this%force_work = this%force_work + other%force_work
  end subroutine add_tally

  !> `stretch` scales the cells (and with them the far walls) about the lower left corner: 0 for
  !> none.
  !> `least_point_mass` is the mass of the lightest point, in kg/m. `threads` share the nodes, one
  !> where it is absent.
  subroutine init_grid(this, config, boundaries, stretch, least_point_mass, threads)
    class(grid_t), intent(out) :: this
    type(grid_config_t), intent(in) :: config
    type(boundary_config_t), intent(in) :: boundaries(:)
    real(dp), intent(in) :: stretch
    real(wp), intent(in) :: least_point_mass
    integer, intent(in), optional :: threads
    real(dp) :: cell
    type(condition_t) :: walls(4)
    logical :: may_lift(4)
    integer :: nodes, k

    if (present(threads)) this%threads = threads
    cell = config%cell_size*(1.0_dp + stretch)
    this%cell_size = real(cell, wp)
    this%x = create_axis(config%x_min, config%x_max, config%cell_size, cell, &
      config%left, config%right)
    this%y = create_axis(config%y_min, config%y_max, config%cell_size, cell, &
      config%bottom, config%top)
    associate (nx => this%x%last, ny => this%y%last)
      walls(1) = create_wall(config%left, config%left_friction, [0, GHOST, 0, ny], 1, 1.0_wp)
      walls(2) = create_wall(config%right, config%right_friction, [nx - GHOST, nx, 0, ny], 1, &
        -1.0_wp)
      walls(3) = create_wall(config%bottom, config%bottom_friction, [0, nx, 0, GHOST], 2, 1.0_wp)
      walls(4) = create_wall(config%top, config%top_friction, [0, nx, ny - GHOST, ny], 2, -1.0_wp)
      may_lift = walls%is_contact()
      this%conditions = [pack(walls, mask=.not. may_lift), pack(walls, mask=may_lift)]
      do k = 1, size(boundaries)
        this%conditions = [this%conditions, create_prescribed(boundaries(k), [config%x_min, &
          config%y_min] - GHOST*cell, cell)]
      end do
      this%window = [0, nx, 0, ny]
      this%first_spare = (nx + 1)*(ny + 1)
    end associate
    nodes = this%first_spare + SPARE*this%threads
    this%last_node = nodes - 1
    this%least_mass = EMPTY_NODE*least_point_mass
    allocate (this%total_store(8*nodes + ALIGNMENT_SLACK), this%motion_store(8*nodes &
      + ALIGNMENT_SLACK))
    this%total_store = 0.0_wp
    this%motion_store = 0.0_wp
    this%total_start = aligned_start(this%total_store)
    this%motion_start = aligned_start(this%motion_store)
  end subroutine init_grid

  !> Nodes from `low` to `high` with the ghost layers. `nominal` is the cell of the case file, which
  !> says how many there are, `cell` the one in use, both in m.
  pure function create_axis(low, high, nominal, cell, first_wall, last_wall) result(axis)
    real(dp), intent(in) :: low, high, nominal, cell
    character(len=*), intent(in) :: first_wall, last_wall
    type(axis_t) :: axis

    axis%origin = real(low - GHOST*cell, wp)
    axis%inverse_cell = real(1.0_dp/cell, wp)
    axis%last = nint((high - low)/nominal) + 2*GHOST
    axis%last_base = axis%last - 2
    axis%first_wall = merge(NO_WALL, GHOST, first_wall == 'free')
    axis%last_wall = merge(NO_WALL, axis%last - GHOST, last_wall == 'free')
  end function create_axis

  !> The window that covers the stencils of all points of the tally; one node more on every side,
  !> since the domain of a point is up to a cell wide.
  pure subroutine set_window(this, tally)
    class(grid_t), intent(inout) :: this
    type(tally_t), intent(in) :: tally

    this%window(1) = max(node_below(tally%x_min, this%x) - 1, 0)
    this%window(2) = min(node_below(tally%x_max, this%x) + 2, this%x%last)
    this%window(3:4) = this%rows_of(tally)
  end subroutine set_window

  !> First and last row of nodes that the stencils of the points of the tally can reach.
  pure function rows_of(this, tally) result(rows)
    class(grid_t), intent(in) :: this
    type(tally_t), intent(in) :: tally
    integer :: rows(2)

    ! Within the grid also where a position is not a number.
    rows = [min(max(node_below(tally%y_min, this%y) - 1, 0), this%y%last_base), &
      max(min(node_below(tally%y_max, this%y) + 2, this%y%last), 0)]
  end function rows_of

  !> The first of the three nodes where thread number `thread`, from 1, throws things away.
  pure function spare_node(this, thread) result(node)
    class(grid_t), intent(in) :: this
    integer, intent(in) :: thread
    integer :: node
    node = this%first_spare + SPARE*(thread - 1)
  end function spare_node

  !> The last node that is not above `position`, held within the grid.
  pure function node_below(position, axis) result(node)
    real(wp), intent(in) :: position
    type(axis_t), intent(in) :: axis
    integer :: node
    node = floor(min(max((position - axis%origin)*axis%inverse_cell, 0.0_wp), &
      real(axis%last, wp)))
  end function node_below

  !> a_i = (f_int + f_ext)/m_i - c_d v_i (Eq. 14); v_i += a_i dt; walls. Leaves motion = (v_new -
  !> v_old, v_new thrice),
  !> where v_old is the velocity before any wall, so that points also take the impulse of the wall.
  !> Clears the sums.
  subroutine integrate_momentum(this, time_step, gravity, damping, losses)
    class(grid_t), intent(inout) :: this
    !> In s, m/s^2, 1/s.
    real(wp), intent(in) :: time_step, gravity(2), damping
    type(losses_t), intent(out) :: losses
    real(dp) :: damping_work(0:this%y%last)
    integer :: thread, row

    associate (total => this%total_store(this%total_start:), &
      motion => this%motion_store(this%motion_start:))
      if (this%threads == 1) then ! also to one thread a parallel region costs something
        call integrate_nodes(this%window, this%least_mass, time_step, gravity, damping, &
          this%x%last, this%y%last, total, motion, damping_work)
      else
        !$omp parallel do num_threads(this%threads) schedule(static)
        do thread = 1, this%threads
          call integrate_nodes(strip(this, thread), this%least_mass, time_step, gravity, damping, &
            this%x%last, this%y%last, total, motion, damping_work)
        end do
      end if
      call apply_conditions(this%conditions, this%window, this%least_mass, this%x%last, &
        this%y%last, total, motion, losses%walls)
    end associate
    do row = this%window(3), this%window(4)
      losses%damping = losses%damping + damping_work(row)
    end do
    losses%damping = losses%damping*damping*time_step
    call clear_sums(this)
  end subroutine integrate_momentum

  !> The part of the window that `thread` has in loops over nodes.
  pure function strip(this, thread) result(window)
    type(grid_t), intent(in) :: this
    integer, intent(in) :: thread
    integer :: window(4)

    window = this%window
    associate (first => this%window(3), rows => this%window(4) - this%window(3) + 1)
      window(3) = first + (thread - 1)*rows/this%threads
      window(4) = first + thread*rows/this%threads - 1
    end associate
  end function strip

  !> `damping_work` is kept row by row, without the factor damping*time_step.
  pure subroutine integrate_nodes(window, least_mass, time_step, gravity, damping, nx, ny, total, &
    motion, damping_work)
    integer, intent(in) :: window(4), nx, ny
    real(wp), intent(in) :: least_mass, time_step, gravity(2), damping
    real(wp), intent(in) :: total(8, 0:nx, 0:ny)
    real(wp), intent(inout) :: motion(8, 0:nx, 0:ny)
    real(dp), intent(inout) :: damping_work(0:ny)
    real(wp) :: mass, inverse_mass, vx, vy, dvx, dvy
    integer :: i, j

    do j = window(3), window(4)
      damping_work(j) = 0.0_dp
      do i = window(1), window(2)
        mass = total(1, i, j)
        if (mass > least_mass) then
          inverse_mass = 1.0_wp/mass
          vx = total(2, i, j)*inverse_mass
          vy = total(3, i, j)*inverse_mass
          dvx = time_step*((total(5, i, j) + total(7, i, j))*inverse_mass + gravity(1) &
            - damping*vx)
          dvy = time_step*((total(6, i, j) + total(8, i, j))*inverse_mass + gravity(2) &
            - damping*vy)
          motion(1:2, i, j) = [dvx, dvy]
          motion(3:8, i, j) = [vx + dvx, vy + dvy, vx + dvx, vy + dvy, vx + dvx, &
            vy + dvy]
          damping_work(j) = damping_work(j) + mass*(vx*(vx + 0.5_wp*dvx) + vy*(vy + 0.5_wp*dvy))
        else
          motion(:, i, j) = 0.0_wp
        end if
      end do
    end do
  end subroutine integrate_nodes

  !> motion(3:8) = p_i/m_i, thrice, with walls, before the stresses are updated (scheme usf). Keeps
  !> the sums.
  subroutine find_velocity(this)
    class(grid_t), intent(inout) :: this
    integer :: thread

    associate (total => this%total_store(this%total_start:), &
      motion => this%motion_store(this%motion_start:))
      if (this%threads == 1) then
        call divide_momentum(this%window, this%least_mass, this%x%last, this%y%last, total, motion)
      else
        !$omp parallel do num_threads(this%threads) schedule(static)
        do thread = 1, this%threads
          call divide_momentum(strip(this, thread), this%least_mass, this%x%last, this%y%last, &
            total, motion)
        end do
      end if
      call hold_conditions(this%conditions, this%window, this%x%last, this%y%last, motion)
    end associate
  end subroutine find_velocity

  !> motion = (v_i, p_i/m_i): the velocity that moves the points stays, beside the one mapped back
  !> from the updated points, from which strains follow (scheme musl). Clears the sums.
  subroutine remap_velocity(this)
    class(grid_t), intent(inout) :: this

    call this%find_velocity()
    call clear_sums(this)
  end subroutine remap_velocity

  !> motion = (old motion(3:4), p_i/m_i).
  pure subroutine divide_momentum(window, least_mass, nx, ny, total, motion)
    integer, intent(in) :: window(4), nx, ny
    real(wp), intent(in) :: least_mass
    real(wp), intent(in) :: total(8, 0:nx, 0:ny)
    real(wp), intent(inout) :: motion(8, 0:nx, 0:ny)
    real(wp) :: v(2)
    integer :: i, j

    do j = window(3), window(4)
      do i = window(1), window(2)
        motion(1:2, i, j) = motion(3:4, i, j)
        if (total(1, i, j) > least_mass) then
          v = total(2:3, i, j)/total(1, i, j)
          motion(3:8, i, j) = [v, v, v]
        else
          motion(3:8, i, j) = 0.0_wp
        end if
      end do
    end do
  end subroutine divide_momentum

  !> Clears the sums of the nodes in the window.
  subroutine clear_sums(this)
    type(grid_t), intent(inout) :: this
    integer :: thread

    if (this%threads == 1) then
      call clear_nodes(this%window, this%x%last, this%y%last, this%total_store(this%total_start:))
    else
      !$omp parallel do num_threads(this%threads) schedule(static)
      do thread = 1, this%threads
        call clear_nodes(strip(this, thread), this%x%last, this%y%last, &
          this%total_store(this%total_start:))
      end do
    end if
  end subroutine clear_sums

  pure subroutine clear_nodes(window, nx, ny, total)
    integer, intent(in) :: window(4), nx, ny
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny)

    total(:, window(1):window(2), window(3):window(4)) = 0.0_wp
  end subroutine clear_nodes

  !> Clears the sums of all nodes.
  subroutine clear(this)
    class(grid_t), intent(inout) :: this

    this%total_store = 0.0_wp
    this%window = [0, this%x%last, 0, this%y%last]
  end subroutine clear

  !> A roller at the line of nodes nearest to `x` (m), which holds all to the right of it too, until
  !> open_gate.
  subroutine set_gate(this, x)
    class(grid_t), intent(inout) :: this
    real(dp), intent(in) :: x

    this%conditions = [this%conditions, create_wall('roller', 0.0_dp, [nint((x - this%x%origin) &
      *this%x%inverse_cell), this%x%last, 0, this%y%last], 1, -1.0_wp)]
    this%has_gate = .true.
  end subroutine set_gate

  subroutine open_gate(this)
    class(grid_t), intent(inout) :: this

    if (this%has_gate) this%conditions = this%conditions(:size(this%conditions) - 1)
    this%has_gate = .false.
  end subroutine open_gate

  !> Force of the prescribed velocities on the material in the last step, in N/m.
  pure function reaction(this, time_step) result(force)
    class(grid_t), intent(in) :: this
    real(dp), intent(in) :: time_step
    real(dp) :: force(2)
    integer :: c

    force = 0.0_wp
    do c = 1, size(this%conditions)
      if (this%conditions(c)%is_prescribed) force = force + this%conditions(c)%impulse/time_step
    end do
  end function reaction
end module sg_grid
