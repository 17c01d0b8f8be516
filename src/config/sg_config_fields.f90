!> Which component of `config_t` belongs to which key: said once, for reading and for writing.
!> Within a group, a key that decides whether others apply comes before them.
module sg_config_fields
  use sg_config, only: config_t, NAME_LENGTH, study_list_t
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: config_visitor_t, visit_config

  !> Sees every key once; reads the value into the component or takes it from there.
  type, abstract :: config_visitor_t
  contains
    procedure(begin_group_interface), deferred :: begin_group
    procedure(visit_real_interface), deferred :: visit_real
    procedure(visit_pair_interface), deferred :: visit_pair
    procedure(visit_reals_interface), deferred :: visit_reals
    procedure(visit_integer_interface), deferred :: visit_integer
    procedure(visit_long_interface), deferred :: visit_long
    procedure(visit_integers_interface), deferred :: visit_integers
    procedure(visit_word_interface), deferred :: visit_word
    procedure(visit_words_interface), deferred :: visit_words
    procedure(visit_text_interface), deferred :: visit_text
    procedure(visit_study_lists_interface), deferred :: visit_study_lists
    generic :: visit => visit_real, visit_integer, visit_long, visit_word
    generic :: visit_list => visit_reals, visit_integers, visit_words
  end type config_visitor_t

  abstract interface
    !> The keys that follow are of the `occurrence`-th group of this name.
    subroutine begin_group_interface(this, group, occurrence)
      import :: config_visitor_t
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: group
      integer, intent(in) :: occurrence
    end subroutine begin_group_interface

    subroutine visit_real_interface(this, key, value)
      import :: config_visitor_t, wp
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      real(wp), intent(inout) :: value
    end subroutine visit_real_interface

    subroutine visit_pair_interface(this, key, value)
      import :: config_visitor_t, wp
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      real(wp), intent(inout) :: value(2)
    end subroutine visit_pair_interface

    subroutine visit_reals_interface(this, key, value)
      import :: config_visitor_t, wp
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      real(wp), allocatable, intent(inout) :: value(:)
    end subroutine visit_reals_interface

    subroutine visit_integer_interface(this, key, value)
      import :: config_visitor_t
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      integer, intent(inout) :: value
    end subroutine visit_integer_interface

    subroutine visit_long_interface(this, key, value)
      import :: config_visitor_t, i8
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      integer(i8), intent(inout) :: value
    end subroutine visit_long_interface

    subroutine visit_integers_interface(this, key, value)
      import :: config_visitor_t
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      integer, allocatable, intent(inout) :: value(:)
    end subroutine visit_integers_interface

    subroutine visit_word_interface(this, key, value)
      import :: config_visitor_t, NAME_LENGTH
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      character(len=NAME_LENGTH), intent(inout) :: value
    end subroutine visit_word_interface

    subroutine visit_words_interface(this, key, value)
      import :: config_visitor_t, NAME_LENGTH
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      character(len=NAME_LENGTH), allocatable, intent(inout) :: value(:)
    end subroutine visit_words_interface

    subroutine visit_text_interface(this, key, value)
      import :: config_visitor_t
      implicit none
      class(config_visitor_t), intent(inout) :: this
      character(len=*), intent(in) :: key
      character(len=:), allocatable, intent(inout) :: value
    end subroutine visit_text_interface

    !> The keys of other groups that &study lists.
    subroutine visit_study_lists_interface(this, lists)
      import :: config_visitor_t, study_list_t
      implicit none
      class(config_visitor_t), intent(inout) :: this
      type(study_list_t), allocatable, intent(inout) :: lists(:)
    end subroutine visit_study_lists_interface
  end interface

contains

  !> Shows every key of `config` to the visitor. `materials` and `bodies` have their sizes and
  !> `has_random_field`, `has_study` their values already. Groups that the run has not got are left
  !> out.
  subroutine visit_config(config, visitor)
    type(config_t), intent(inout) :: config
    class(config_visitor_t), intent(inout) :: visitor
    integer :: i

    call visitor%begin_group('case', 1)
    call visitor%visit('name', config%name)
    call visitor%visit_text('title', config%title)
    call visit_grid(config, visitor)
    do i = 1, size(config%materials)
      call visit_material(config, i, visitor)
    end do
    do i = 1, size(config%bodies)
      call visit_body(config, i, visitor)
    end do
    do i = 1, size(config%boundaries)
      call visit_boundary(config, i, visitor)
    end do
    call visitor%begin_group('loading', 1)
    call visitor%visit_pair('gravity', config%loading%gravity)
    call visitor%visit('damping', config%loading%damping)
    call visitor%visit('initial_stress', config%loading%initial_stress)
    call visitor%visit('relaxation', config%loading%relaxation)
    call visitor%visit('relaxation_time', config%loading%relaxation_time)
    call visitor%visit('body_force', config%loading%body_force)
    call visitor%visit('amplitude', config%loading%amplitude)
    call visit_solver(config, visitor)
    do i = 1, size(config%random_fields)
      call visit_random_field(config, i, visitor)
    end do
    do i = 1, size(config%cross_correlations)
      call visitor%begin_group('cross_correlation', i)
      call visitor%visit_list('between', config%cross_correlations(i)%between)
      call visitor%visit('coefficient', config%cross_correlations(i)%coefficient)
    end do
    call visit_monte_carlo(config, visitor)
    if (config%has_study) then
      call visitor%begin_group('study', 1)
      call visitor%visit_list('acf', config%study%acf)
      call visitor%visit_list('cov', config%study%cov)
      call visitor%visit_study_lists(config%study%lists)
    end if
    if (config%has_control_variate) then
      call visitor%begin_group('control_variate', 1)
      call visitor%visit('cell_size', config%control_variate%cell_size)
      call visitor%visit('realizations', config%control_variate%realizations)
    end if
    call visit_output(config, visitor)
  end subroutine visit_config

  subroutine visit_grid(config, visitor)
    type(config_t), intent(inout) :: config
    class(config_visitor_t), intent(inout) :: visitor

    call visitor%begin_group('grid', 1)
    call visitor%visit('x_min', config%grid%x_min)
    call visitor%visit('x_max', config%grid%x_max)
    call visitor%visit('y_min', config%grid%y_min)
    call visitor%visit('y_max', config%grid%y_max)
    call visitor%visit('cell_size', config%grid%cell_size)
    call visitor%visit('left', config%grid%left)
    call visitor%visit('right', config%grid%right)
    call visitor%visit('bottom', config%grid%bottom)
    call visitor%visit('top', config%grid%top)
    call visitor%visit('left_friction', config%grid%left_friction)
    call visitor%visit('right_friction', config%grid%right_friction)
    call visitor%visit('bottom_friction', config%grid%bottom_friction)
    call visitor%visit('top_friction', config%grid%top_friction)
  end subroutine visit_grid

  subroutine visit_material(config, i, visitor)
    type(config_t), intent(inout) :: config
    integer, intent(in) :: i
    class(config_visitor_t), intent(inout) :: visitor

    associate (material => config%materials(i))
      call visitor%begin_group('material', i)
      call visitor%visit('name', material%name)
      call visitor%visit('model', material%model)
      call visitor%visit('density', material%density)
      call visitor%visit('young', material%young)
      call visitor%visit('poisson', material%poisson)
      call visitor%visit('friction_angle', material%friction_angle)
      call visitor%visit('dilation_angle', material%dilation_angle)
      call visitor%visit('cohesion', material%cohesion)
      call visitor%visit('tension_strength', material%tension_strength)
      call visitor%visit('cone', material%cone)
      call visitor%visit('undrained_strength', material%undrained_strength)
      call visitor%visit('softening', material%softening)
      call visitor%visit('residual_friction_angle', material%residual_friction_angle)
      call visitor%visit('residual_cohesion', material%residual_cohesion)
      call visitor%visit('softening_start', material%softening_start)
      call visitor%visit('softening_end', material%softening_end)
      call visitor%visit('dilation_end', material%dilation_end)
    end associate
  end subroutine visit_material

  subroutine visit_body(config, i, visitor)
    type(config_t), intent(inout) :: config
    integer, intent(in) :: i
    class(config_visitor_t), intent(inout) :: visitor

    associate (body => config%bodies(i))
      call visitor%begin_group('body', i)
      call visitor%visit('name', body%name)
      call visitor%visit('material', body%material)
      call visitor%visit('shape', body%shape)
      call visitor%visit('x', body%x)
      call visitor%visit('y', body%y)
      call visitor%visit('width', body%width)
      call visitor%visit('height', body%height)
      call visitor%visit('radius', body%radius)
      call visitor%visit_list('vertices', body%vertices)
      call visitor%visit('points_per_cell', body%points_per_cell)
      call visitor%visit_pair('velocity', body%velocity)
      call visitor%visit('angular_velocity', body%angular_velocity)
      call visitor%visit_text('file', body%file)
    end associate
  end subroutine visit_body

  subroutine visit_boundary(config, i, visitor)
    type(config_t), intent(inout) :: config
    integer, intent(in) :: i
    class(config_visitor_t), intent(inout) :: visitor

    associate (boundary => config%boundaries(i))
      call visitor%begin_group('boundary', i)
      call visitor%visit('name', boundary%name)
      call visitor%visit('x_min', boundary%x_min)
      call visitor%visit('x_max', boundary%x_max)
      call visitor%visit('y_min', boundary%y_min)
      call visitor%visit('y_max', boundary%y_max)
      call visitor%visit('components', boundary%components)
      call visitor%visit_pair('velocity', boundary%velocity)
    end associate
  end subroutine visit_boundary

  subroutine visit_solver(config, visitor)
    type(config_t), intent(inout) :: config
    class(config_visitor_t), intent(inout) :: visitor

    call visitor%begin_group('solver', 1)
    call visitor%visit('model', config%solver%model)
    call visitor%visit('weighting', config%solver%weighting)
    call visitor%visit('scheme', config%solver%scheme)
    call visitor%visit('transfer', config%solver%transfer)
    call visitor%visit('flip', config%solver%flip)
    call visitor%visit('anti_locking', config%solver%anti_locking)
    call visitor%visit('precision', config%solver%precision)
    call visitor%visit('threads', config%solver%threads)
    call visitor%visit('time_step', config%solver%time_step)
    call visitor%visit('cfl', config%solver%cfl)
    call visitor%visit('end_time', config%solver%end_time)
    call visitor%visit('settle', config%solver%settle)
    call visitor%visit_list('needless', config%solver%needless)
  end subroutine visit_solver

  subroutine visit_random_field(config, i, visitor)
    type(config_t), intent(inout) :: config
    integer, intent(in) :: i
    class(config_visitor_t), intent(inout) :: visitor

    associate (field => config%random_fields(i))
      call visitor%begin_group('random_field', i)
      call visitor%visit('name', field%name)
      call visitor%visit('property', field%property)
      call visitor%visit('material', field%material)
      call visitor%visit('body', field%body)
      call visitor%visit_list('region', field%region)
      call visitor%visit('distribution', field%distribution)
      call visitor%visit('mean', field%mean)
      call visitor%visit_list('cov', field%cov)
      call visitor%visit_list('sd', field%sd)
      call visitor%visit('mean_gradient', field%mean_gradient)
      call visitor%visit('sd_gradient', field%sd_gradient)
      call visitor%visit_list('datum', field%datum)
      call visitor%visit('acf', field%acf)
      call visitor%visit('smoothness', field%smoothness)
      call visitor%visit('form', field%form)
      call visitor%visit('scale_x', field%scale_x)
      call visitor%visit('scale_y', field%scale_y)
      call visitor%visit('rotation', field%rotation)
      call visitor%visit('averaging', field%averaging)
      call visitor%visit_list('lower', field%lower)
      call visitor%visit_list('upper', field%upper)
      call visitor%visit('method', field%method)
      call visitor%visit_text('data', field%data)
      call visitor%visit_text('data_content', field%data_content)
      call visitor%visit_text('file', field%file)
      call visitor%visit_text('file_content', field%file_content)
    end associate
  end subroutine visit_random_field

  subroutine visit_monte_carlo(config, visitor)
    type(config_t), intent(inout) :: config
    class(config_visitor_t), intent(inout) :: visitor

    call visitor%begin_group('monte_carlo', 1)
    call visitor%visit('realizations', config%monte_carlo%realizations)
    call visitor%visit('seed', config%monte_carlo%seed)
    call visitor%visit('sampling', config%monte_carlo%sampling)
    call visitor%visit('tilt', config%monte_carlo%tilt)
    call visitor%visit('stop_rule', config%monte_carlo%stop_rule)
    call visitor%visit('stop_runout', config%monte_carlo%stop_runout)
    call visitor%visit('stop_statistic', config%monte_carlo%stop_statistic)
    call visitor%visit('stop_threshold', config%monte_carlo%stop_threshold)
    call visitor%visit_list('half_width', config%monte_carlo%half_width)
    call visitor%visit_list('relative_half_width', config%monte_carlo%relative_half_width)
    call visitor%visit('successive_tolerance', config%monte_carlo%successive_tolerance)
    call visitor%visit('stop_minimum', config%monte_carlo%stop_minimum)
    call visitor%visit('stop_batch', config%monte_carlo%stop_batch)
    call visitor%visit('noise_members', config%monte_carlo%noise_members)
    call visitor%visit('max_failed_fraction', config%monte_carlo%max_failed_fraction)
    call visitor%visit('member_seconds', config%monte_carlo%member_seconds)
  end subroutine visit_monte_carlo

  subroutine visit_output(config, visitor)
    type(config_t), intent(inout) :: config
    class(config_visitor_t), intent(inout) :: visitor

    call visitor%begin_group('output', 1)
    call visitor%visit_text('directory', config%output%directory)
    call visitor%visit('snapshot_interval', config%output%snapshot_interval)
    call visitor%visit('history_interval', config%output%history_interval)
    call visitor%visit_list('snapshot_members', config%output%snapshot_members)
    call visitor%visit('report_seconds', config%output%report_seconds)
  end subroutine visit_output
end module sg_config_fields
