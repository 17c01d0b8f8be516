!> A scene: everything that all members of an ensemble share. It is built once and never changes.
module sg_scene
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use sg_angles, only: DEGREE
  use sg_bodies, only: body_lattice_t, fill_body, is_inside
  use sg_config, only: config_t, EDGE_TOLERANCE
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_initial_stress, only: set_geostatic_stress
  use sg_kinds, only: wp
  use sg_manufactured, only: manufactured_velocity
  use sg_materials, only: cone_strength, create_material, material_t, MODEL_DRUCKER_PRAGER, &
    MODEL_MOHR_COULOMB, mohr_coulomb_strength
  use sg_particles, only: body_points_t, particles_t
  use sg_property, only: PROPERTY_COHESION, PROPERTY_DENSITY, PROPERTY_DILATION_ANGLE, &
    PROPERTY_FRICTION_ANGLE, PROPERTY_UNDRAINED_STRENGTH, PROPERTY_YOUNG
  use sg_text, only: to_text
  use sg_variation, only: property_values_t
  implicit none
  private

  public :: scene_t, build_scene, set_properties

  type :: scene_t
    type(material_t), allocatable :: materials(:)
    !> Points at their first place with their first velocity and the stress of the ground, if any.
    type(particles_t) :: particles
    !> Position of the toe that runouts are measured from: the right end of the measured bodies, in
    !> m.
    real(wp) :: toe
    !> Extent of the measured bodies in m: x_min, x_max, y_min, y_max.
    real(wp) :: extent(4)
    !> Total mass in kg/m.
    real(wp) :: mass
    !> Fastest compression wave and largest initial speed, m/s.
    real(wp) :: wave_speed, speed
    !> Time step that the CFL number allows at the start, and fixed step (0: none), in s.
    real(wp) :: first_step, fixed_step
    !> Centres of the columns of cells, in m, [number of cells along x].
    real(wp), allocatable :: profile_x(:)
    !> No body is within a cell of the right or the upper wall, which stretched cells move.
    logical :: is_clear_of_far_walls
  contains
    procedure :: point_count
    procedure :: points_of
  end type scene_t

contains

  !> Number of points of a material.
  pure function point_count(this, material) result(count)
    class(scene_t), intent(in) :: this
    integer, intent(in) :: material
    integer :: count

    associate (b => this%particles%bodies)
      count = sum(b%last - b%first + 1, mask=b%material == material)
    end associate
  end function point_count

  !> Initial places of the points of a material, [point_count], in m and in the order of
  !> property_values_t.
  pure subroutine points_of(this, material, x, y)
    class(scene_t), intent(in) :: this
    integer, intent(in) :: material
    real(wp), allocatable, intent(out) :: x(:), y(:)
    integer :: body

    allocate (x(0), y(0))
    do body = 1, size(this%particles%bodies)
      associate (b => this%particles%bodies(body))
        if (b%material /= material) cycle
        x = [x, this%particles%x_start(b%first:b%last)]
        y = [y, this%particles%y_start(b%first:b%last)]
      end associate
    end do
  end subroutine points_of

  !> Builds the scene of a configuration that passed its checks. A body without a single point is
  !> an error.
  subroutine build_scene(config, scene, error)
    type(config_t), intent(in) :: config
    type(scene_t), intent(out) :: scene
    type(error_t), allocatable, intent(out) :: error
    type(body_lattice_t), allocatable :: lattices(:)
    integer :: k, count, columns

    allocate (scene%materials(size(config%materials)), lattices(size(config%bodies)))
    do k = 1, size(config%materials)
      scene%materials(k) = create_material(config%materials(k))
    end do
    do k = 1, size(config%bodies)
      call fill_body(config%bodies(k), config%grid%cell_size, lattices(k), error)
      if (allocated(error)) return
      if (lattices(k)%count == 0) then
        call raise(error, EXIT_BAD_INPUT, &
          'no material point lies in body '//trim(config%bodies(k)%name)// &
                   '; it is smaller than the spacing of the points', 'build_scene')
        return
      end if
    end do
    call refuse_strays(config, lattices, error)
    if (allocated(error)) return
    count = sum(lattices%count)
    call scene%particles%init(count)
    allocate (scene%particles%bodies(size(lattices)))
    count = 0
    do k = 1, size(lattices)
      call place_body(config, lattices(k), k, count + 1, scene)
      count = count + lattices(k)%count
    end do
    call set_strength(scene%materials, scene%particles)
    call measure_scene(config, lattices, scene)
    if (config%loading%initial_stress == 'geostatic') then
      call set_geostatic_stress(scene%particles, scene%materials, config%loading%gravity)
    end if
    columns = nint((config%grid%x_max - config%grid%x_min)/config%grid%cell_size)
    scene%profile_x = [(config%grid%x_min + (k - 0.5_wp)*config%grid%cell_size, k=1, columns)]
  end subroutine build_scene

  !> Points outside the grid would be lost at once; where bodies overlap, mass would count twice.
  subroutine refuse_strays(config, lattices, error)
    type(config_t), intent(in) :: config
    type(body_lattice_t), intent(in) :: lattices(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: a, b, p, number

    do b = 1, size(lattices)
      associate (l => lattices(b), g => config%grid)
        number = count(l%x < g%x_min .or. l%x > g%x_max .or. l%y < g%y_min .or. l%y > g%y_max)
        if (number > 0) then
          call raise(error, EXIT_BAD_INPUT, to_text(number)//' points of body '// &
            trim(config%bodies(b)%name)//' lie outside the grid', 'build_scene')
          return
        end if
        if (max(l%width, l%height) > g%cell_size*(1.0_wp + EDGE_TOLERANCE)) then
          call raise(error, EXIT_BAD_INPUT, 'points of body '//trim(config%bodies(b)%name)// &
            ' are wider or higher than a cell', 'build_scene')
          return
        end if
        do a = 1, size(lattices)
          if (a == b) cycle
          number = count([(is_inside(config%bodies(a), l%x(p), l%y(p)), p=1, l%count)])
          if (number == 0) cycle
          call raise(error, EXIT_BAD_INPUT, 'bodies '//trim(config%bodies(a)%name)//' and '// &
            trim(config%bodies(b)%name)//' overlap: '//to_text(number)//' points of the second '// &
            'lie in the first, and their mass would count twice', 'build_scene')
          return
        end do
      end associate
    end do
  end subroutine refuse_strays

  !> Puts the points of body `k` into the arrays from `first` on.
  subroutine place_body(config, lattice, k, first, scene)
    type(config_t), intent(in) :: config
    type(body_lattice_t), intent(in) :: lattice
    integer, intent(in) :: k, first
    type(scene_t), intent(inout) :: scene
    integer :: last, material

    last = first + lattice%count - 1
    material = config%bodies(k)%material_index
    associate (p => scene%particles)
      p%bodies(k)%first = first
      p%bodies(k)%last = last
      p%bodies(k)%material = material
      p%bodies(k)%width = lattice%width
      p%bodies(k)%height = lattice%height
      if (config%has_random_field) then
        p%bodies(k)%is_measured = any(config%random_fields%material_index == material)
      end if
      p%x(first:last) = lattice%x
      p%y(first:last) = lattice%y
      p%x_start(first:last) = lattice%x
      p%y_start(first:last) = lattice%y
      p%width(first:last) = lattice%width
      p%height(first:last) = lattice%height
      p%vx(first:last) = lattice%vx
      p%vy(first:last) = lattice%vy
      if (config%loading%body_force == 'manufactured') call manufactured_velocity( &
        scene%materials(material), config%loading%amplitude, lattice%x, lattice%y, &
        p%vx(first:last), p%vy(first:last))
      p%volume(first:last) = lattice%width*lattice%height
      p%mass(first:last) = lattice%width*lattice%height*scene%materials(material)%density
      p%friction_angle(first:last) = ieee_value(1.0_wp, ieee_quiet_nan)
      if (scene%materials(material)%model == MODEL_MOHR_COULOMB) then
        p%friction_angle(first:last) = scene%materials(material)%friction_angle
      end if
    end associate
  end subroutine place_body

  !> Gives points the `properties` of a member. With their density changes the stress of the ground,
  !> where `config` asks for it.
  subroutine set_properties(config, materials, properties, particles)
    type(config_t), intent(in) :: config
    type(material_t), intent(in) :: materials(:)
    type(property_values_t), intent(in) :: properties(:)
    type(particles_t), intent(inout) :: particles
    integer :: k

    do k = 1, size(properties)
      associate (p => particles, one => properties(k))
        select case (one%property)
        case (PROPERTY_FRICTION_ANGLE)
          call place_values(materials, p%bodies, one, p%friction_angle)
        case (PROPERTY_COHESION)
          call place_values(materials, p%bodies, one, p%cohesion)
        case (PROPERTY_UNDRAINED_STRENGTH)
          call place_values(materials, p%bodies, one, p%undrained_strength)
        case (PROPERTY_YOUNG)
          call place_values(materials, p%bodies, one, p%young)
        case (PROPERTY_DENSITY)
          call place_values(materials, p%bodies, one, p%density)
        case default ! PROPERTY_DILATION_ANGLE
          call place_values(materials, p%bodies, one, p%dilation_angle)
        end select
      end associate
    end do
    call set_strength(materials, particles)
    if (size(particles%dilation_angle) > 0) then
      ! A point whose dilation angle is above its friction angle would give energy back as it flows.
      particles%dilation_angle = min(particles%dilation_angle, particles%friction_angle)
      particles%sin_dilation = sin(particles%dilation_angle*DEGREE)
    end if
    if (size(particles%density) > 0) then
      particles%mass = particles%volume*particles%density
      if (config%loading%initial_stress == 'geostatic') then
        call set_geostatic_stress(particles, materials, config%loading%gravity)
      end if
    end if
  end subroutine set_properties

  !> Puts the values of `one` into `field`, [number of points], which has those of the materials
  !> before, and is made if it has size 0.
  subroutine place_values(materials, bodies, one, field)
    type(material_t), intent(in) :: materials(:)
    type(body_points_t), intent(in) :: bodies(:)
    type(property_values_t), intent(in) :: one
    real(wp), allocatable, intent(inout) :: field(:)
    integer :: body, done, count

    if (size(field) == 0) then
      deallocate (field)
      allocate (field(bodies(size(bodies))%last))
      do body = 1, size(bodies)
        field(bodies(body)%first:bodies(body)%last) = &
          value_of(materials(bodies(body)%material), one%property)
      end do
    end if
    done = 0
    do body = 1, size(bodies)
      associate (b => bodies(body))
        if (b%material /= one%material) cycle
        count = b%last - b%first + 1
        field(b%first:b%last) = one%values(done + 1:done + count)
        done = done + count
      end associate
    end do
  end subroutine place_values

  !> What a material says of a property; not a number where it has none.
  function value_of(material, property) result(value)
    type(material_t), intent(in) :: material
    integer, intent(in) :: property
    real(wp) :: value

    value = ieee_value(1.0_wp, ieee_quiet_nan)
    select case (property)
    case (PROPERTY_YOUNG)
      value = material%young
    case (PROPERTY_DENSITY)
      value = material%density
    case (PROPERTY_FRICTION_ANGLE)
      if (material%model == MODEL_MOHR_COULOMB) value = material%friction_angle
    case (PROPERTY_DILATION_ANGLE)
      if (material%model == MODEL_MOHR_COULOMB) value = material%dilation_angle
    case (PROPERTY_COHESION)
      if (any(material%model == [MODEL_MOHR_COULOMB, MODEL_DRUCKER_PRAGER]) &
        .and. .not. material%is_undrained) value = material%cohesion
    case default ! PROPERTY_UNDRAINED_STRENGTH
      if (material%is_undrained) value = material%cohesion
    end select
  end function value_of

  !> Strength of all Mohr-Coulomb points, and of Drucker-Prager ones where strength varies, from
  !> their friction angle and cohesion.
  subroutine set_strength(materials, particles)
    type(material_t), intent(in) :: materials(:)
    type(particles_t), intent(inout) :: particles
    real(wp), allocatable :: cohesion(:)
    integer :: body

    do body = 1, size(particles%bodies)
      associate (p => particles, first => particles%bodies(body)%first, &
        last => particles%bodies(body)%last, material => materials(particles%bodies(body)%material))
        allocate (cohesion(last - first + 1), source=material%cohesion)
        if (material%is_undrained) then
          if (size(p%undrained_strength) > 0) cohesion = p%undrained_strength(first:last)
        else if (size(p%cohesion) > 0) then
          cohesion = p%cohesion(first:last)
        end if
        select case (material%model)
        case (MODEL_MOHR_COULOMB)
          call mohr_coulomb_strength(material, p%friction_angle(first:last), cohesion, &
            p%sin_friction(first:last), p%cohesion_term(first:last), p%tension_limit(first:last))
        case (MODEL_DRUCKER_PRAGER)
          call cone_strength(material, cohesion, p%cohesion_term(first:last), &
            p%tension_limit(first:last))
        case default ! elastic
        end select
        deallocate (cohesion)
      end associate
    end do
  end subroutine set_strength

  !> Extent, mass, speeds and the first time step.
  subroutine measure_scene(config, lattices, scene)
    type(config_t), intent(in) :: config
    type(body_lattice_t), intent(in) :: lattices(:)
    type(scene_t), intent(inout) :: scene
    real(wp) :: box(4)
    integer :: k

    scene%extent = [huge(1.0_wp), -huge(1.0_wp), huge(1.0_wp), -huge(1.0_wp)]
    scene%speed = sqrt(maxval(scene%particles%vx**2 + scene%particles%vy**2))
    scene%wave_speed = 0.0_wp
    do k = 1, size(config%bodies)
      box = lattices(k)%box
      if (.not. scene%particles%bodies(k)%is_measured) box = scene%extent
      scene%extent(1::2) = min(scene%extent(1::2), box(1::2))
      scene%extent(2::2) = max(scene%extent(2::2), box(2::2))
      associate (material => scene%materials(config%bodies(k)%material_index))
        scene%wave_speed = max(scene%wave_speed, sqrt((material%lame &
          + 2.0_wp*material%shear)/material%density))
      end associate
    end do
    scene%toe = scene%extent(2)
    scene%is_clear_of_far_walls = all(scene%particles%x < config%grid%x_max &
      - config%grid%cell_size) .and. all(scene%particles%y < config%grid%y_max &
      - config%grid%cell_size)
    scene%mass = sum(scene%particles%mass)
    scene%fixed_step = config%solver%time_step
    scene%first_step = scene%fixed_step
    if (.not. scene%fixed_step > 0.0_wp) then
      scene%first_step = config%solver%cfl*config%grid%cell_size/(scene%wave_speed + scene%speed)
    end if
  end subroutine measure_scene
end module sg_scene
