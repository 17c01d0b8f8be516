!> Conditions on the velocity of nodes: the four walls and boxes of prescribed velocity.
!>
!> A wall holds the nodes on and behind it. With v = (v_n, v_t), n pointing into the material:
!>   held      v = prescribed velocity, in the components that are held (fixed: both, roller: the
!>             normal one, of 0)
!>   contact   only where the material presses on the wall, v_n < 0: v_n = 0, and friction takes at
!>             most mu times the normal impulse off v_t (Coulomb; it sticks where that suffices)
!>
!> Each condition keeps the impulse it gave (kg/s per metre) and all together the energy they took.
module sg_boundary
  use sg_config, only: boundary_config_t, EDGE_TOLERANCE
  use sg_kinds, only: dp, wp
  implicit none
  private

  public :: condition_t, create_wall, create_prescribed, apply_conditions, hold_conditions

  integer, parameter :: KIND_HELD = 1
  integer, parameter :: KIND_CONTACT = 2

  integer, parameter :: TOUCH_NONE = 0
  integer, parameter :: TOUCH_SLIPS = 1
  integer, parameter :: TOUCH_STICKS = 2

  type :: condition_t
    integer :: kind = KIND_HELD
    !> Nodes i_first, i_last, j_first, j_last; none at first.
    integer :: box(4) = [0, -1, 0, -1]
    !> Held components and their velocity in m/s.
    logical :: held(2) = .false.
    real(wp) :: velocity(2) = 0.0_wp
    !> Contact: component of the normal, its sign towards the material, Coulomb's coefficient.
    integer :: normal = 0
    real(wp) :: sign = 1.0_wp
    real(wp) :: friction = 0.0_wp
    !> Not one of the four walls: what it pushes with is reported as reaction.
    logical :: is_prescribed = .false.
    !> Contact: what became of the nodes of the box in the last step, one of the TOUCH_ constants.
    integer, allocatable :: touch(:, :)
    !> Momentum given to the nodes in the last step, kg/s.
    real(dp) :: impulse(2) = 0.0_dp
  contains
    procedure :: is_contact
  end type condition_t

contains

  !> The wall of the kind `name` over the nodes `box`; `normal` = 1 or 2, `sign` = +1 for the left
  !> and the lower wall. Nothing is held by a free one.
  pure function create_wall(name, friction, box, normal, sign) result(wall)
    character(len=*), intent(in) :: name
    real(dp), intent(in) :: friction
    integer, intent(in) :: box(4), normal
    real(wp), intent(in) :: sign
    type(condition_t) :: wall

    wall%box = box
    wall%normal = normal
    wall%sign = sign
    select case (name)
    case ('fixed')
      wall%held = .true.
    case ('roller')
      wall%held(normal) = .true.
    case ('frictional')
      wall%kind = KIND_CONTACT
      wall%friction = real(friction, wp)
      allocate (wall%touch(box(1):box(2), box(3):box(4)))
      wall%touch = TOUCH_NONE
    case default ! free: no node
      wall%box = [0, -1, 0, -1]
    end select
  end function create_wall

  !> Does it act only where the material presses on it?
  elemental function is_contact(this)
    class(condition_t), intent(in) :: this
    logical :: is_contact
    is_contact = this%kind == KIND_CONTACT
  end function is_contact

  !> Prescribed velocity of the nodes in a box of the case file; `origin` is the place of node (0,
  !> 0) in m. A node that is outside by less than EDGE_TOLERANCE of a cell counts as inside.
  pure function create_prescribed(config, origin, cell_size) result(condition)
    type(boundary_config_t), intent(in) :: config
    real(dp), intent(in) :: origin(2), cell_size
    type(condition_t) :: condition

    condition%is_prescribed = .true.
    condition%box = [ceiling((config%x_min - origin(1))/cell_size - EDGE_TOLERANCE), &
      floor((config%x_max - origin(1))/cell_size + EDGE_TOLERANCE), &
      ceiling((config%y_min - origin(2))/cell_size - EDGE_TOLERANCE), &
      floor((config%y_max - origin(2))/cell_size + EDGE_TOLERANCE)]
    condition%held = [config%components /= 'y', config%components /= 'x']
    condition%velocity = real(config%velocity, wp)
  end function create_prescribed

  !> The nodes of `box` that lie in the window; both are i_first, i_last, j_first, j_last.
  pure function overlap(box, window) result(nodes)
    integer, intent(in) :: box(4), window(4)
    integer :: nodes(4)
    nodes = [max(box(1), window(1)), min(box(2), window(2)), max(box(3), window(3)), &
      min(box(4), window(4))]
  end function overlap

  !> Applies all conditions to the nodes of the window: motion = (v_new - v_old, v_new thrice),
  !> total(1) = mass. `taken`: energy that the nodes lost to them in this step, J/m.
  pure subroutine apply_conditions(conditions, window, least_mass, nx, ny, total, motion, taken)
    type(condition_t), intent(inout) :: conditions(:)
    !> i_first, i_last, j_first, j_last.
    integer, intent(in) :: window(4)
    real(wp), intent(in) :: least_mass
    integer, intent(in) :: nx, ny
    !> Comes without a negative number in total(4); the forces, total(5:6), are not kept.
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny), motion(8, 0:nx, 0:ny)
    real(dp), intent(out) :: taken
    real(wp) :: before(2), after(2)
    integer :: c, i, j, nodes(4)

    do c = 1, size(conditions)
      associate (this => conditions(c))
        this%impulse = 0.0_dp
        nodes = overlap(this%box, window)
        do j = nodes(3), nodes(4)
          do i = nodes(1), nodes(2)
            if (this%kind == KIND_CONTACT) this%touch(i, j) = TOUCH_NONE
            if (.not. total(1, i, j) > least_mass) cycle
            before = motion(3:4, i, j)
            ! What the node would do without any condition stays where its force was.
            if (total(4, i, j) >= 0.0_wp) total(4:6, i, j) = [-1.0_wp, before]
            call constrain(this, before, after)
            if (this%kind == KIND_CONTACT) this%touch(i, j) = touch_of(this, before, after)
            motion(3:8, i, j) = [after, after, after]
            motion(1:2, i, j) = motion(1:2, i, j) + (after - before)
            this%impulse = this%impulse + total(1, i, j)*(after - before)
          end do
        end do
      end associate
    end do
    call book_energy(conditions, window, nx, ny, total, motion, taken)
  end subroutine apply_conditions

  !> Energy that the nodes marked in total(4) lost to their conditions, each node once; takes the
  !> marks away. In each constrained component that is m/2 (old^2 - after^2) + m (free - old) after,
  !> free = total(5:6) being the velocity without any condition, after the one with all of them:
  !> forces work with the velocity that strains the points, the constrained one, so a wall at rest
  !> takes the kinetic energy that points carry into its nodes, and nothing else.
  pure subroutine book_energy(conditions, window, nx, ny, total, motion, taken)
    type(condition_t), intent(in) :: conditions(:)
    integer, intent(in) :: window(4), nx, ny
    real(wp), intent(inout) :: total(8, 0:nx, 0:ny)
    real(wp), intent(in) :: motion(8, 0:nx, 0:ny)
    real(dp), intent(out) :: taken
    real(wp) :: old(2), after(2)
    integer :: c, i, j, nodes(4)

    taken = 0.0_dp
    do c = 1, size(conditions)
      nodes = overlap(conditions(c)%box, window)
      do j = nodes(3), nodes(4)
        do i = nodes(1), nodes(2)
          if (.not. total(4, i, j) < 0.0_wp) cycle
          total(4, i, j) = 0.0_wp
          after = motion(3:4, i, j)
          old = after - motion(1:2, i, j)
          taken = taken + total(1, i, j)*sum(0.5_wp*(old**2 - after**2) + (total(5:6, i, j) &
            - old)*after, mask=abs(after - total(5:6, i, j)) > 0.0_wp)
        end do
      end do
    end do
  end subroutine book_energy

  !> What a wall with contact did to a node; one of the TOUCH_ constants.
  pure function touch_of(this, before, after) result(touch)
    type(condition_t), intent(in) :: this
    real(wp), intent(in) :: before(2), after(2)
    integer :: touch

    touch = TOUCH_NONE
    if (.not. this%sign*before(this%normal) < 0.0_wp) return
    touch = TOUCH_SLIPS
    if (this%friction > 0.0_wp .and. .not. abs(after(3 - this%normal)) > 0.0_wp) then
      touch = TOUCH_STICKS
    end if
  end function touch_of

  !> Velocity of one node after condition `this`.
  pure subroutine constrain(this, before, after)
    type(condition_t), intent(in) :: this
    real(wp), intent(in) :: before(2)
    real(wp), intent(out) :: after(2)
    real(wp) :: pressing
    integer :: tangent

    after = before
    if (this%kind == KIND_HELD) then
      where (this%held) after = this%velocity
    else
      pressing = max(-this%sign*before(this%normal), 0.0_wp)
      if (.not. pressing > 0.0_wp) return
      tangent = 3 - this%normal
      after(this%normal) = 0.0_wp
      after(tangent) = sign(max(abs(before(tangent)) - this%friction*pressing, 0.0_wp), &
        before(tangent))
    end if
  end subroutine constrain

  !> The velocities motion(3:8) from which strains follow, without impulse: held components, and
  !> those that a wall with contact held in the last momentum balance. (To cut off the motion into
  !> the wall alone would make a mean motion out of any noise.)
  pure subroutine hold_conditions(conditions, window, nx, ny, motion)
    type(condition_t), intent(in) :: conditions(:)
    integer, intent(in) :: window(4), nx, ny
    real(wp), intent(inout) :: motion(8, 0:nx, 0:ny)
    real(wp) :: v(2)
    integer :: c, i, j, nodes(4)

    do c = 1, size(conditions)
      associate (this => conditions(c))
        nodes = overlap(this%box, window)
        do j = nodes(3), nodes(4)
          do i = nodes(1), nodes(2)
            v = motion(3:4, i, j)
            if (this%kind == KIND_CONTACT) then
              if (this%touch(i, j) /= TOUCH_NONE) v(this%normal) = 0.0_wp
              if (this%touch(i, j) == TOUCH_STICKS) v(3 - this%normal) = 0.0_wp
            else
              where (this%held) v = this%velocity
            end if
            motion(3:8, i, j) = [v, v, v]
          end do
        end do
      end associate
    end do
  end subroutine hold_conditions
end module sg_boundary
