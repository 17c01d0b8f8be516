!> Bodies: shapes filled with points on a regular lattice.
module sg_bodies
  use sg_config, only: body_config_t
  use sg_errors, only: error_t
  use sg_kinds, only: wp
  use sg_point_file, only: read_point_file
  use sg_polygon, only: polygon_contains
  implicit none
  private

  public :: body_lattice_t, fill_body, is_inside

  !> The points of one body: positions [count] in m, and full width and height of a point in m.
  type :: body_lattice_t
    integer :: count = 0
    real(wp), allocatable :: x(:), y(:)
    real(wp) :: width, height
    !> Box around the body: x_min, x_max, y_min, y_max in m.
    real(wp) :: box(4)
    !> Velocity of each point in m/s, [count].
    real(wp), allocatable :: vx(:), vy(:)
  end type body_lattice_t

contains

  !> Lower left and upper right corner of the box around a body: (x_min, x_max, y_min, y_max) in m.
  pure function body_extent(body) result(box)
    type(body_config_t), intent(in) :: body
    real(wp) :: box(4)

    select case (body%shape)
    case ('disc')
      box = [body%x - body%radius, body%x + body%radius, body%y - body%radius, body%y + body%radius]
    case ('polygon')
      box(1:2) = [minval(body%vertices(1::2)), maxval(body%vertices(1::2))]
      box(3:4) = [minval(body%vertices(2::2)), maxval(body%vertices(2::2))]
    case default
      box = [body%x, body%x + body%width, body%y, body%y + body%height]
    end select
  end function body_extent

  !> Points at the centres of the lattice cells whose centre lies in the body, x fastest. The
  !> lattice starts at the lower left corner of the body's box; its spacing is `cell_size` over the
  !> points per cell, or a little less where the box is no multiple of it.
  !> Velocities are those of the body with its spin about the centre of its box. `error`: the file
  !> of points cannot be read.
  subroutine fill_body(body, cell_size, lattice, error)
    type(body_config_t), intent(in) :: body
    real(wp), intent(in) :: cell_size
    type(body_lattice_t), intent(out) :: lattice
    type(error_t), allocatable, intent(out) :: error

    if (body%shape == 'points') then
      call read_point_file(body%file, lattice%x, lattice%y, lattice%width, lattice%height, &
        lattice%vx, lattice%vy, error)
      if (allocated(error)) return
      lattice%count = size(lattice%x)
      lattice%box = [minval(lattice%x) - 0.5_wp*lattice%width, maxval(lattice%x) &
        + 0.5_wp*lattice%width, minval(lattice%y) - 0.5_wp*lattice%height, maxval(lattice%y) &
        + 0.5_wp*lattice%height]
    else
      lattice%box = body_extent(body)
      call fill_shape(body, cell_size, lattice%box, lattice)
      allocate (lattice%vx(lattice%count), lattice%vy(lattice%count))
      lattice%vx = 0.0_wp
      lattice%vy = 0.0_wp
    end if
    lattice%vx = lattice%vx + body%velocity(1) - body%angular_velocity*(lattice%y &
      - 0.5_wp*(lattice%box(3) + lattice%box(4)))
    lattice%vy = lattice%vy + body%velocity(2) + body%angular_velocity*(lattice%x &
      - 0.5_wp*(lattice%box(1) + lattice%box(2)))
  end subroutine fill_body

  pure subroutine fill_shape(body, cell_size, box, lattice)
    type(body_config_t), intent(in) :: body
    real(wp), intent(in) :: cell_size, box(4)
    type(body_lattice_t), intent(inout) :: lattice
    real(wp) :: x, y
    integer :: columns, rows, i, j, count

    columns = whole_number(box(2) - box(1))
    rows = whole_number(box(4) - box(3))
    lattice%width = (box(2) - box(1))/columns
    lattice%height = (box(4) - box(3))/rows
    allocate (lattice%x(columns*rows), lattice%y(columns*rows))
    count = 0
    do j = 1, rows
      do i = 1, columns
        x = box(1) + (i - 0.5_wp)*lattice%width
        y = box(3) + (j - 0.5_wp)*lattice%height
        if (.not. is_inside(body, x, y)) cycle
        count = count + 1
        lattice%x(count) = x
        lattice%y(count) = y
      end do
    end do
    lattice%count = count
    lattice%x = lattice%x(:count)
    lattice%y = lattice%y(:count)

  contains

    !> Number of lattice cells along a length: the ratio rounded up, but not for rounding errors.
    pure function whole_number(length) result(number)
      real(wp), intent(in) :: length
      integer :: number
      number = max(1, ceiling(length/cell_size*body%points_per_cell - 1.0e-9_wp))
    end function whole_number
  end subroutine fill_shape

  !> Is (x, y) in the body? A body given by points has no inside.
  pure function is_inside(body, x, y) result(inside)
    type(body_config_t), intent(in) :: body
    real(wp), intent(in) :: x, y
    logical :: inside

    select case (body%shape)
    case ('disc')
      inside = (x - body%x)**2 + (y - body%y)**2 <= body%radius**2
    case ('polygon')
      inside = polygon_contains(body%vertices, x, y)
    case ('points')
      inside = .false.
    case default
      inside = x > body%x .and. x < body%x + body%width .and. y > body%y &
        .and. y < body%y + body%height
    end select
  end function is_inside
end module sg_bodies
