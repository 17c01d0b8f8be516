!> What several keys of a case must satisfy together. A check is made only where all keys it looks
!> at have passed on their own, so that one mistake gives one fault.
module sg_check_config
  use sg_check_desk, only: check_material_name, desk_t
  use sg_check_random_fields, only: check_random_fields
  use sg_check_stop_rule, only: check_stop_rule
  use sg_config, only: config_t, EDGE_TOLERANCE
  use sg_fault_list, only: fault_list_t, quoted
  use sg_kinds, only: wp
  use sg_namelist, only: namelist_t
  use sg_polygon, only: corners_are_distinct, polygon_area, polygon_is_simple
  use sg_text, only: to_text
  use sg_threads, only: has_threads
  implicit none
  private

  public :: check_config

  !> How far a length may be from a whole number of cells, in cells a cell: rounding of a decimal
  !> number is 1e-16, a mistake is not below 1e-3.
  real(wp), parameter :: WHOLE_TOLERANCE = 1.0e-6_wp
  !> More cells than this do not fit into memory: a misplaced decimal point.
  real(wp), parameter :: MOST_CELLS = 1.0e8_wp

contains

  !> Adds what is wrong to `faults`. `config` was filled from `nml`, with neutral values for keys
  !> that are missing or faulty.
  subroutine check_config(config, nml, faults)
    type(config_t), intent(in) :: config
    type(namelist_t), intent(in) :: nml
    type(fault_list_t), intent(inout) :: faults
    type(desk_t) :: desk
    integer :: i

    desk%config = config
    desk%nml = nml
    desk%faults = faults
    call check_grid(desk)
    do i = 1, size(config%materials)
      call check_material(desk, i)
    end do
    do i = 1, size(config%bodies)
      call check_body(desk, i)
    end do
    do i = 1, size(config%boundaries)
      call check_boundary(desk, i)
    end do
    call check_loading(desk)
    call check_solver(desk)
    if (config%has_random_field) call check_random_fields(desk)
    if (config%has_random_field) call check_stop_rule(desk)
    if (config%has_study) call check_study(desk)
    if (config%has_control_variate) call check_control_variate(desk)
    call check_output(desk)
    faults = desk%faults
  end subroutine check_config

  subroutine check_grid(desk)
    type(desk_t), intent(inout) :: desk
    logical :: fits

    fits = .true.
    call check_extent(desk, 'x_min', 'x_max', desk%config%grid%x_min, desk%config%grid%x_max, fits)
    call check_extent(desk, 'y_min', 'y_max', desk%config%grid%y_min, desk%config%grid%y_max, fits)
    if (.not. fits .or. .not. desk%good('grid', 1, 'x_min x_max y_min y_max cell_size')) return
    associate (grid => desk%config%grid)
      if ((grid%x_max - grid%x_min)/grid%cell_size*((grid%y_max - grid%y_min)/grid%cell_size) > &
        MOST_CELLS) then
        call desk%fault('grid', 1, 'cell_size', to_text(grid%cell_size)// &
          ' m makes more cells than '// &
          'any machine can hold (allowed: up to '//to_text(MOST_CELLS)//' cells)')
      end if
    end associate
  end subroutine check_grid

  !> The grid has a positive, whole number of cells along an axis.
  subroutine check_extent(desk, low_key, high_key, low, high, fits)
    type(desk_t), intent(inout) :: desk
    character(len=*), intent(in) :: low_key, high_key
    real(wp), intent(in) :: low, high
    logical, intent(inout) :: fits
    real(wp) :: cells

    if (.not. desk%good('grid', 1, low_key//' '//high_key)) return
    if (high <= low) then
      fits = .false.
      call desk%fault('grid', 1, high_key, to_text(high)//' is not above '//low_key//' = '// &
        to_text(low))
      return
    end if
    if (.not. desk%good('grid', 1, 'cell_size')) return
    cells = (high - low)/desk%config%grid%cell_size
    if (abs(cells - anint(cells)) > WHOLE_TOLERANCE*cells .or. cells < 0.5_wp) then
      call desk%fault('grid', 1, high_key, high_key//' - '//low_key//' = '//to_text(high - low, &
        9)// &
        ' m is '//to_text(cells, 6)//' cells of '//to_text(desk%config%grid%cell_size)// &
        ' m (allowed: a whole number of cells, for instance '//high_key//' = '// &
        to_text(low + max(anint(cells), 1.0_wp)*desk%config%grid%cell_size, 12)//')')
    end if
  end subroutine check_extent

  subroutine check_material(desk, i)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    integer :: j

    associate (material => desk%config%materials(i))
      if (desk%good('material', i, 'name')) then
        do j = 1, i - 1
          if (desk%config%materials(j)%name /= material%name) cycle
          call desk%fault('material', i, 'name', quoted(material%name)// &
            ' is taken by the material in '// &
            'line '//to_text(desk%nml%line_of('material', j, 'name')))
          exit
        end do
      end if
      if (desk%good('material', i, 'friction_angle dilation_angle')) then
        if (material%dilation_angle > material%friction_angle) call desk%fault('material', i, &
          'dilation_angle', to_text(material%dilation_angle)//' exceeds friction_angle = '// &
          to_text(material%friction_angle)//' (allowed: up to friction_angle)')
      end if
      if (material%model == 'mohr_coulomb' .and. desk%good('material', i, &
        'friction_angle cohesion tension_strength')) call check_apex(desk, i)
      if (material%softening == 'linear') call check_softening(desk, i)
    end associate
  end subroutine check_material

  !> Softening ends after it starts and takes strength away.
  subroutine check_softening(desk, i)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i

    associate (material => desk%config%materials(i))
      if (desk%good('material', i, 'softening_start softening_end')) then
        if (.not. material%softening_end > material%softening_start) call desk%fault('material', &
          i, 'softening_end', to_text(material%softening_end)//' is not above '// &
          'softening_start = '//to_text(material%softening_start))
      end if
      if (desk%good('material', i, 'friction_angle residual_friction_angle')) then
        if (material%residual_friction_angle > material%friction_angle) call desk%fault( &
          'material', i, 'residual_friction_angle', to_text(material%residual_friction_angle)// &
          ' exceeds friction_angle = '//to_text(material%friction_angle)// &
          ' (allowed: up to friction_angle)')
      end if
      if (desk%good('material', i, 'cohesion residual_cohesion')) then
        if (material%residual_cohesion > material%cohesion) call desk%fault('material', i, &
          'residual_cohesion', to_text(material%residual_cohesion)//' exceeds cohesion = '// &
          to_text(material%cohesion)//' (allowed: up to cohesion)')
      end if
    end associate
  end subroutine check_softening

  !> The tensile strength of a Mohr-Coulomb material ends at the apex of its pyramid.
  subroutine check_apex(desk, i)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    real(wp), parameter :: RADIANS = acos(-1.0_wp)/180.0_wp
    real(wp) :: apex

    associate (material => desk%config%materials(i))
      if (material%friction_angle <= 0.0_wp) return
      apex = material%cohesion/tan(material%friction_angle*RADIANS)
      if (material%tension_strength > apex*(1.0_wp + 1.0e-6_wp)) then
        call desk%fault('material', i, 'tension_strength', to_text(material%tension_strength)// &
          ' Pa is beyond the apex of the yield surface, cohesion/tan(friction_angle) = '// &
          to_text(apex, 6)//' Pa (allowed: up to that)')
      end if
    end associate
  end subroutine check_apex

  subroutine check_body(desk, i)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    integer :: j

    associate (body => desk%config%bodies(i))
      if (desk%good('body', i, 'name')) then
        do j = 1, i - 1
          if (desk%config%bodies(j)%name /= body%name) cycle
          call desk%fault('body', i, 'name', quoted(body%name)//' is taken by the body in line '// &
            to_text(desk%nml%line_of('body', j, 'name')))
          exit
        end do
      end if
      if (desk%good('body', i, 'material')) then
        call check_material_name(desk, 'body', i, body%material, body%material_index)
      end if
      if (.not. desk%good('body', i, 'shape')) return
      select case (body%shape)
      case ('rectangle')
        if (desk%good('body', i, 'x y width height')) call check_inside(desk, i, 'width', &
          [body%x, body%y], [body%x + body%width, body%y + body%height])
      case ('disc')
        if (desk%good('body', i, 'x y radius')) call check_inside(desk, i, 'radius', &
          [body%x, body%y] - body%radius, [body%x, body%y] + body%radius)
      case ('polygon')
        if (desk%good('body', i, 'vertices')) call check_polygon(desk, i)
      case default ! has been refused before
      end select
    end associate
  end subroutine check_body

  !> The box from `low` to `high` lies in the grid. `key` is where a fault is reported.
  subroutine check_inside(desk, i, key, low, high)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    character(len=*), intent(in) :: key
    real(wp), intent(in) :: low(2), high(2)
    real(wp) :: slack

    if (.not. desk%good('grid', 1, 'x_min x_max y_min y_max cell_size')) return
    associate (grid => desk%config%grid)
      if (grid%x_max <= grid%x_min .or. grid%y_max <= grid%y_min) return
      slack = EDGE_TOLERANCE*grid%cell_size
      if (low(1) < grid%x_min - slack .or. high(1) > grid%x_max + slack) then
        call desk%fault('body', i, key, 'the body reaches from x = '//to_text(low(1), 6)//' to '// &
          to_text(high(1), 6)//', out of the grid (allowed: '//to_text(grid%x_min)//' to '// &
          to_text(grid%x_max)//')')
      end if
      if (low(2) < grid%y_min - slack .or. high(2) > grid%y_max + slack) then
        call desk%fault('body', i, key_of_height(key), 'the body reaches from y = '// &
          to_text(low(2), 6)//' to '//to_text(high(2), 6)//', out of the grid (allowed: '// &
          to_text(grid%y_min)//' to '//to_text(grid%y_max)//')')
      end if
    end associate

  contains

    function key_of_height(key) result(name)
      character(len=*), intent(in) :: key
      character(len=:), allocatable :: name
      name = key
      if (key == 'width') name = 'height'
    end function key_of_height
  end subroutine check_inside

  subroutine check_polygon(desk, i)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    real(wp), allocatable :: corners(:, :)
    integer :: first, second

    associate (vertices => desk%config%bodies(i)%vertices)
      if (mod(size(vertices), 2) /= 0) then
        call desk%fault('body', i, 'vertices', to_text(size(vertices))//' values are no pairs '// &
          '(write x1, y1, x2, y2, ...)')
        return
      end if
      if (size(vertices) < 6) then
        call desk%fault('body', i, 'vertices', 'a polygon with '//to_text(size(vertices)/2)// &
          ' corners has no area (allowed: 3 corners or more, as x1, y1, x2, y2, ...)')
        return
      end if
      corners = reshape(vertices, [2, size(vertices)/2])
    end associate
    call corners_are_distinct(corners, first, second)
    if (first > 0) then
      call desk%fault('body', i, 'vertices', 'corners '//to_text(first)//' and '// &
        to_text(second)// &
        ' are the same point (the polygon closes by itself: do not repeat the first corner)')
      return
    end if
    call polygon_is_simple(corners, first, second)
    if (first > 0) then
      call desk%fault('body', i, 'vertices', 'the sides that start at corners '//to_text(first)// &
        ' and '//to_text(second)//' cross or touch (give the corners in order along the edge)')
      return
    end if
    if (.not. polygon_area(corners) > 0.0_wp) then
      call desk%fault('body', i, 'vertices', 'all corners lie on one line: the polygon has no area')
      return
    end if
    call check_inside(desk, i, 'vertices', minval(corners, dim=2), maxval(corners, dim=2))
  end subroutine check_polygon

  !> The box is no inside-out one and holds nodes of the grid.
  subroutine check_boundary(desk, i)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i

    associate (boundary => desk%config%boundaries(i))
      call check_side(desk, i, 'x_min', 'x_max', boundary%x_min, boundary%x_max)
      call check_side(desk, i, 'y_min', 'y_max', boundary%y_min, boundary%y_max)
    end associate
  end subroutine check_boundary

  subroutine check_side(desk, i, low_key, high_key, low, high)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    character(len=*), intent(in) :: low_key, high_key
    real(wp), intent(in) :: low, high
    real(wp) :: grid_low, grid_high, first

    if (.not. desk%good('boundary', i, low_key//' '//high_key)) return
    if (high < low) then
      call desk%fault('boundary', i, high_key, to_text(high)//' is below '//low_key//' = '// &
        to_text(low))
      return
    end if
    if (.not. desk%good('grid', 1, low_key//' '//high_key//' cell_size')) return
    associate (grid => desk%config%grid)
      grid_low = merge(grid%x_min, grid%y_min, low_key == 'x_min')
      grid_high = merge(grid%x_max, grid%y_max, low_key == 'x_min')
      first = grid_low + grid%cell_size*ceiling((low - grid_low)/grid%cell_size - EDGE_TOLERANCE)
      if (first > high + EDGE_TOLERANCE*grid%cell_size .or. high < grid_low - EDGE_TOLERANCE* &
        grid%cell_size .or. low > grid_high + EDGE_TOLERANCE*grid%cell_size) then
        call desk%fault('boundary', i, low_key, 'there is no node from '//to_text(low)//' to '// &
          to_text(high)//' (nodes lie at '//to_text(grid_low)//', '// &
          to_text(grid_low + grid%cell_size)//', ... '//to_text(grid_high)//')')
      end if
    end associate
  end subroutine check_side

  subroutine check_loading(desk)
    type(desk_t), intent(inout) :: desk

    if (.not. desk%good('loading', 1, 'gravity initial_stress')) return
    associate (loading => desk%config%loading)
      if (loading%initial_stress == 'geostatic' .and. &
        (loading%gravity(1) /= 0.0_wp .or. .not. loading%gravity(2) < 0.0_wp)) then
        call desk%fault('loading', 1, 'initial_stress', &
          '''geostatic'' needs gravity straight down, '// &
          'not gravity = '//to_text(loading%gravity(1))//', '//to_text(loading%gravity(2))// &
          ' (allowed: gravity = 0, negative; or ''none'')')
      end if
      if (loading%initial_stress == 'geostatic' .and. any(desk%config%materials%model == &
        'neo_hookean')) then
        call desk%fault('loading', 1, 'initial_stress', '''geostatic'' cannot be given to a '// &
          'neo_hookean material, whose stress follows from its deformation (allowed: ''none''; '// &
          'relaxation = ''open'' or ''gated'' brings it to rest)')
      end if
    end associate
  end subroutine check_loading

  subroutine check_solver(desk)
    type(desk_t), intent(inout) :: desk

    if (desk%good('solver', 1, 'transfer weighting')) then
      ! Their gradients jump between cells: bodies that meet fly apart (tests/verification).
      if (desk%config%solver%transfer == 'tpic' .and. desk%config%solver%weighting == 'linear') then
        call desk%fault('solver', 1, 'transfer', "'tpic' is not stable with weighting = 'linear'")
      end if
    end if
    if (desk%good('solver', 1, 'threads')) then
      if (desk%config%solver%threads > 1 .and. .not. has_threads()) call desk%fault('solver', 1, &
        'threads', 'this program was built without OpenMP (allowed: 1)')
    end if
    if (desk%good('solver', 1, 'model') .and. .not. desk%config%has_random_field) then
      if (desk%config%solver%model == 'linear_functional') call desk%fault('solver', 1, 'model', &
        "'linear_functional' is one of a random field (allowed: with &random_field)")
    end if
    if (.not. desk%good('solver', 1, 'time_step end_time')) return
    associate (solver => desk%config%solver)
      if (solver%time_step > solver%end_time) call desk%fault('solver', 1, 'time_step', &
        to_text(solver%time_step)//' is longer than the whole run, end_time = '// &
        to_text(solver%end_time))
    end associate
  end subroutine check_solver

  subroutine check_study(desk)
    type(desk_t), intent(inout) :: desk
    integer :: g, i, j

    g = desk%nml%locate('study', 1)
    if (desk%nml%groups(g)%number == 0) then
      call desk%faults%add(desk%nml%groups(g)%line, '&study', &
        'this group lists nothing (give acf, cov or other keys, or leave the group out)')
    end if
    associate (study => desk%config%study)
      if (desk%config%has_random_field .and. desk%good('study', 1, 'acf')) then
        do i = 2, size(study%acf)
          if (any(study%acf(:i - 1) == study%acf(i))) call desk%fault('study', 1, 'acf', &
            quoted(study%acf(i))//' is listed twice')
        end do
      end if
      if (desk%config%has_random_field .and. desk%good('study', 1, 'cov')) then
        do i = 2, size(study%cov)
          do j = 1, i - 1
            if (study%cov(i) == study%cov(j)) call desk%fault('study', 1, 'cov', &
              to_text(study%cov(i))//' is listed twice')
          end do
        end do
      end if
    end associate
  end subroutine check_study

  !> There are enough twins on coarser cells. (That they are coarser is seen where they are made.)
  subroutine check_control_variate(desk)
    type(desk_t), intent(inout) :: desk

    associate (control => desk%config%control_variate)
      if (desk%good('control_variate', 1, 'realizations') .and. desk%good('monte_carlo', 1, &
        'realizations')) then
        if (control%realizations < desk%config%monte_carlo%realizations) call desk%fault( &
          'control_variate', 1, 'realizations', to_text(control%realizations)// &
          ' are fewer than the cases have, '//to_text(desk%config%monte_carlo%realizations)// &
          ' (allowed: at least as many)')
      end if
      if (desk%good('monte_carlo', 1, 'sampling')) then
        if (desk%config%monte_carlo%sampling /= 'random') call desk%fault('control_variate', 1, &
          'realizations', 'members must be independent (allowed: sampling = ''random'')')
      end if
    end associate
  end subroutine check_control_variate

  subroutine check_output(desk)
    type(desk_t), intent(inout) :: desk
    integer :: i

    if (.not. desk%good('output', 1, 'snapshot_members')) return
    if (.not. desk%good('monte_carlo', 1, 'realizations')) return
    associate (members => desk%config%output%snapshot_members, &
      realizations => desk%config%monte_carlo%realizations)
      do i = 1, size(members)
        if (members(i) > realizations) call desk%fault('output', 1, 'snapshot_members', &
          to_text(members(i))//' is beyond the last realization (allowed: 1 to '// &
          to_text(realizations)//')')
        if (any(members(:i - 1) == members(i))) call desk%fault('output', 1, 'snapshot_members', &
          to_text(members(i))//' is listed twice')
      end do
    end associate
  end subroutine check_output
end module sg_check_config
