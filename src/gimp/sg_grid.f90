!> The background grid: square cells, nodes that live for one step, and the walls.
!>
!> Nodes are counted from 0; two layers of nodes lie outside the walls, so that the weighting
!> function of a point at a wall has its full stencil. Only nodes in the window around the points
!> are touched. Whoever reads the sums last clears them, so that they are zero when points are next
!> mapped.
module sg_grid
  use sg_config, only: grid_config_t
  use sg_kinds, only: wp
  use sg_memory, only: aligned_start, ALIGNMENT_SLACK
  implicit none
  private

  public :: grid_t, tally_t

  !> Layers of nodes outside each wall.
  integer, parameter :: GHOST = 2
  !> Share of the smallest point mass below which a node counts as empty. Momentum over mass is
  !> accurate however small both are; a weight S below this means that the point reaches the node by
  !> less than the rounding of its position.
  real(wp), parameter :: EMPTY_NODE = 1.0e-30_wp

  integer, parameter :: WALL_FREE = 0
  integer, parameter :: WALL_ROLLER = 1
  integer, parameter :: WALL_FIXED = 2

  !> What a pass over the points finds out about them.
  type :: tally_t
    real(wp) :: x_min, x_max, y_min, y_max
    !> Kinetic energy in J/m, largest speed squared and largest wave speed squared in (m/s)^2.
    real(wp) :: kinetic_energy, speed_squared, wave_squared
    !> Kinetic energy of the motion of the points, with the velocities they are moved with, J/m. A
    !> point can keep a velocity that the grid does not see; it moves nothing, and so does not count
    !> when rest is looked for.
    real(wp) :: motion_energy
    !> Work of the stresses in this step, J/m.
    real(wp) :: internal_work
  contains
    procedure :: reset => reset_tally
  end type tally_t

  type :: grid_t
    real(wp) :: cell_size, inverse_cell
    !> Position of node (0, 0) in m.
    real(wp) :: x_origin, y_origin
    !> Last node in each direction, and the largest first node of a stencil of three.
    integer :: nx, ny, last_base_x, last_base_y
    !> Nodes of the walls.
    integer :: left_node, right_node, bottom_node, top_node
    integer :: left, right, bottom, top
    !> Mass below which a node counts as empty, kg/m.
    real(wp) :: least_mass
    !> Storage of the nodes. What counts begins at element `total_start` and `motion_start` on a
    !> cache line, as total(8, 0:nx, 0:ny) and motion(4, 0:nx, 0:ny), see sg_transfer; hand over
    !> total_store(total_start).
    real(wp), allocatable :: total_store(:), motion_store(:)
    integer :: total_start, motion_start
    !> Window of nodes that points can have touched.
    integer :: i_first, i_last, j_first, j_last
  contains
    procedure :: init => init_grid
    procedure :: set_window
    procedure :: integrate_momentum
    procedure :: find_velocity
    procedure :: remap_velocity
    procedure, private :: hold_walls
  end type grid_t

contains

  subroutine reset_tally(this)
    class(tally_t), intent(out) :: this

    this%x_min = huge(1.0_wp)
    this%x_max = -huge(1.0_wp)
    this%y_min = huge(1.0_wp)
    this%y_max = -huge(1.0_wp)
    this%kinetic_energy = 0.0_wp
    this%speed_squared = 0.0_wp
    this%wave_squared = 0.0_wp
    this%motion_energy = 0.0_wp
    this%internal_work = 0.0_wp
  end subroutine reset_tally

  !> `stretch` scales the cells (and with them the far walls) about the lower left corner: 0 for
  !> none.
  !> `least_point_mass` is the mass of the lightest point, in kg/m.
  subroutine init_grid(this, config, stretch, least_point_mass)
    class(grid_t), intent(out) :: this
    type(grid_config_t), intent(in) :: config
    real(wp), intent(in) :: stretch, least_point_mass
    integer :: cells_x, cells_y, nodes

    cells_x = nint((config%x_max - config%x_min)/config%cell_size)
    cells_y = nint((config%y_max - config%y_min)/config%cell_size)
    this%cell_size = config%cell_size*(1.0_wp + stretch)
    this%inverse_cell = 1.0_wp/this%cell_size
    this%x_origin = config%x_min - GHOST*this%cell_size
    this%y_origin = config%y_min - GHOST*this%cell_size
    this%nx = cells_x + 2*GHOST
    this%ny = cells_y + 2*GHOST
    this%last_base_x = this%nx - 2
    this%last_base_y = this%ny - 2
    this%left_node = GHOST
    this%right_node = GHOST + cells_x
    this%bottom_node = GHOST
    this%top_node = GHOST + cells_y
    this%left = wall_kind(config%left)
    this%right = wall_kind(config%right)
    this%bottom = wall_kind(config%bottom)
    this%top = wall_kind(config%top)
    this%least_mass = EMPTY_NODE*least_point_mass
    nodes = (this%nx + 1)*(this%ny + 1)
    allocate (this%total_store(8*nodes + ALIGNMENT_SLACK), this%motion_store(4*nodes &
      + ALIGNMENT_SLACK))
    this%total_store = 0.0_wp
    this%motion_store = 0.0_wp
    this%total_start = aligned_start(this%total_store)
    this%motion_start = aligned_start(this%motion_store)
    this%i_first = 0
    this%i_last = this%nx
    this%j_first = 0
    this%j_last = this%ny
  end subroutine init_grid

  pure function wall_kind(name) result(kind)
    character(len=*), intent(in) :: name
    integer :: kind

    select case (name)
    case ('fixed')
      kind = WALL_FIXED
    case ('roller')
      kind = WALL_ROLLER
    case default
      kind = WALL_FREE
    end select
  end function wall_kind

  !> The window that covers the stencils of all points of the tally; one node more on every side,
  !> since the domain of a point is up to a cell wide.
  pure subroutine set_window(this, tally)
    class(grid_t), intent(inout) :: this
    type(tally_t), intent(in) :: tally

    this%i_first = node_below(tally%x_min, this%x_origin, this%nx) - 1
    this%i_last = node_below(tally%x_max, this%x_origin, this%nx) + 2
    this%j_first = node_below(tally%y_min, this%y_origin, this%ny) - 1
    this%j_last = node_below(tally%y_max, this%y_origin, this%ny) + 2
    this%i_first = max(this%i_first, 0)
    this%i_last = min(this%i_last, this%nx)
    this%j_first = max(this%j_first, 0)
    this%j_last = min(this%j_last, this%ny)

  contains

    pure function node_below(position, origin, last) result(node)
      real(wp), intent(in) :: position, origin
      integer, intent(in) :: last
      integer :: node
      node = min(max(floor((position - origin)*this%inverse_cell), 0), last)
    end function node_below
  end subroutine set_window

  !> a_i = (f_int + f_ext)/m_i - c_d v_i (Eq. 14); v_i += a_i dt; walls. Leaves motion = (v_new -
  !> v_old, v_new),
  !> where v_old is the velocity before any wall, so that points also take the impulse of the wall.
  !> Clears the sums.
  !> `damping_work`: energy in J/m that damping took in this step.
  subroutine integrate_momentum(this, time_step, gravity, damping, damping_work)
    class(grid_t), intent(inout) :: this
    !> In s, m/s^2, 1/s.
    real(wp), intent(in) :: time_step, gravity(2), damping
    real(wp), intent(out) :: damping_work

    call integrate_nodes(this, time_step, gravity, damping, this%nx, this%ny, &
      this%total_store(this%total_start), &
                         this%motion_store(this%motion_start), damping_work)
    call this%hold_walls(with_increment=.true.)
  end subroutine integrate_momentum

  pure subroutine integrate_nodes(grid, time_step, gravity, damping, nx, ny, total, motion, &
    damping_work)
    type(grid_t), intent(in) :: grid
    real(wp), intent(in) :: time_step, gravity(2), damping
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny), motion(4, 0:nx, 0:ny)
    real(wp), intent(out) :: damping_work
    real(wp) :: mass, inverse_mass, vx, vy, dvx, dvy
    integer :: i, j

    damping_work = 0.0_wp
    do j = grid%j_first, grid%j_last
      do i = grid%i_first, grid%i_last
        mass = total(1, i, j)
        if (mass > grid%least_mass) then
          inverse_mass = 1.0_wp/mass
          vx = total(2, i, j)*inverse_mass
          vy = total(3, i, j)*inverse_mass
          dvx = time_step*(total(5, i, j)*inverse_mass + gravity(1) - damping*vx)
          dvy = time_step*(total(6, i, j)*inverse_mass + gravity(2) - damping*vy)
          motion(:, i, j) = [dvx, dvy, vx + dvx, vy + dvy]
          damping_work = damping_work + mass*(vx*(vx + 0.5_wp*dvx) + vy*(vy + 0.5_wp*dvy))
        else
          motion(:, i, j) = 0.0_wp
        end if
        total(:, i, j) = 0.0_wp
      end do
    end do
    damping_work = damping_work*damping*time_step
  end subroutine integrate_nodes

  !> motion(3:4) = p_i/m_i with walls, before the stresses are updated (scheme usf). Keeps the sums.
  subroutine find_velocity(this)
    class(grid_t), intent(inout) :: this

    call divide_momentum(this, this%nx, this%ny, this%total_store(this%total_start), &
                         this%motion_store(this%motion_start))
    call this%hold_walls(with_increment=.false.)
  end subroutine find_velocity

  !> motion = (v_i, p_i/m_i): the velocity that moves the points stays, beside the one mapped back
  !> from the updated points, from which strains follow (scheme musl). Clears the sums.
  subroutine remap_velocity(this)
    class(grid_t), intent(inout) :: this

    call divide_momentum(this, this%nx, this%ny, this%total_store(this%total_start), &
                         this%motion_store(this%motion_start))
    call clear_nodes(this, this%nx, this%ny, this%total_store(this%total_start))
    call this%hold_walls(with_increment=.false.)
  end subroutine remap_velocity

  !> motion = (old motion(3:4), p_i/m_i).
  pure subroutine divide_momentum(grid, nx, ny, total, motion)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: nx, ny
    real(wp), intent(in) :: total(8, 0:nx, 0:ny)
    real(wp), intent(inout) :: motion(4, 0:nx, 0:ny)
    integer :: i, j

    do j = grid%j_first, grid%j_last
      do i = grid%i_first, grid%i_last
        motion(1:2, i, j) = motion(3:4, i, j)
        if (total(1, i, j) > grid%least_mass) then
          motion(3:4, i, j) = total(2:3, i, j)/total(1, i, j)
        else
          motion(3:4, i, j) = 0.0_wp
        end if
      end do
    end do
  end subroutine divide_momentum

  pure subroutine clear_nodes(grid, nx, ny, total)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny)

    total(:, grid%i_first:grid%i_last, grid%j_first:grid%j_last) = 0.0_wp
  end subroutine clear_nodes

  !> Nodes on and behind a wall: a roller takes the normal component of motion(3:4), a fixed wall
  !> both.
  !> `with_increment` takes what is lost off motion(1:2) too.
  subroutine hold_walls(this, with_increment)
    class(grid_t), intent(inout) :: this
    logical, intent(in) :: with_increment

    if (this%left /= WALL_FREE) then
      call hold(this%i_first, min(this%left_node, this%i_last), this%j_first, this%j_last, .true., &
                this%left == WALL_FIXED)
    end if
    if (this%right /= WALL_FREE) then
      call hold(max(this%right_node, this%i_first), this%i_last, this%j_first, this%j_last, &
        .true., &
                this%right == WALL_FIXED)
    end if
    if (this%bottom /= WALL_FREE) then
      call hold(this%i_first, this%i_last, this%j_first, min(this%bottom_node, this%j_last), &
                this%bottom == WALL_FIXED, .true.)
    end if
    if (this%top /= WALL_FREE) then
      call hold(this%i_first, this%i_last, max(this%top_node, this%j_first), this%j_last, &
                this%top == WALL_FIXED, .true.)
    end if

  contains

    subroutine hold(i_first, i_last, j_first, j_last, hold_x, hold_y)
      integer, intent(in) :: i_first, i_last, j_first, j_last
      logical, intent(in) :: hold_x, hold_y

      call hold_nodes([i_first, i_last, j_first, j_last], [hold_x, hold_y], with_increment, &
        this%nx, this%ny, &
                      this%motion_store(this%motion_start))
    end subroutine hold
  end subroutine hold_walls

  !> Holds the components `held` of the nodes `box` = (i_first, i_last, j_first, j_last).
  pure subroutine hold_nodes(box, held, with_increment, nx, ny, motion)
    integer, intent(in) :: box(4)
    logical, intent(in) :: held(2), with_increment
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: motion(4, 0:nx, 0:ny)
    integer :: i, j, k

    do j = box(3), box(4)
      do i = box(1), box(2)
        do k = 1, 2
          if (.not. held(k)) cycle
          if (with_increment) motion(k, i, j) = motion(k, i, j) - motion(k + 2, i, j)
          motion(k + 2, i, j) = 0.0_wp
        end do
      end do
    end do
  end subroutine hold_nodes
end module sg_grid
