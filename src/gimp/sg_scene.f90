!> A scene: everything that all members of an ensemble share. It is built once and never changes.
module sg_scene
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use sg_bodies, only: body_lattice_t, fill_body, is_inside
  use sg_config, only: config_t, EDGE_TOLERANCE
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_initial_stress, only: set_geostatic_stress
  use sg_kinds, only: wp
  use sg_manufactured, only: manufactured_velocity
  use sg_materials, only: create_material, material_t, MODEL_MOHR_COULOMB, mohr_coulomb_strength
  use sg_particles, only: particles_t
  use sg_text, only: to_text
  implicit none
  private

  public :: scene_t, build_scene, set_friction_angle

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
  !> set_friction_angle.
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
        p%bodies(k)%is_measured = material == config%random_field%material_index
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

  !> Gives the points of `material` their friction angles, [number of such points in order], in
  !> degrees.
  subroutine set_friction_angle(materials, material, friction_angle, particles)
    type(material_t), intent(in) :: materials(:)
    integer, intent(in) :: material
    real(wp), intent(in) :: friction_angle(:)
    type(particles_t), intent(inout) :: particles
    integer :: body, done, count

    done = 0
    do body = 1, size(particles%bodies)
      associate (b => particles%bodies(body))
        if (b%material /= material) cycle
        count = b%last - b%first + 1
        particles%friction_angle(b%first:b%last) = friction_angle(done + 1:done + count)
        done = done + count
      end associate
    end do
    call set_strength(materials, particles)
  end subroutine set_friction_angle

  !> Strength of all Mohr-Coulomb points from their friction angle.
  subroutine set_strength(materials, particles)
    type(material_t), intent(in) :: materials(:)
    type(particles_t), intent(inout) :: particles
    integer :: body

    do body = 1, size(particles%bodies)
      associate (b => particles%bodies(body))
        if (materials(b%material)%model /= MODEL_MOHR_COULOMB) cycle
        call mohr_coulomb_strength(materials(b%material), &
          particles%friction_angle(b%first:b%last), materials(b%material)%cohesion, &
                                   particles%sin_friction(b%first:b%last), &
                                   particles%cohesion_term(b%first:b%last), &
                                   particles%tension_limit(b%first:b%last))
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
