!> What a run would take, without writing anything: `--check`.
module sg_estimate
  use sg_collapse, only: prepare_fields
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_field_properties, only: points_of_materials
  use sg_kinds, only: i8, wp
  use sg_monitor, only: patient_monitor_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: COLUMN_COUNT, outcome_t, reset_outcome, SECONDS, STEPS
  use sg_plan, only: plan_t
  use sg_random_fields, only: random_fields_t
  use sg_scene, only: build_scene, scene_t
  use sg_simulate, only: simulate
  use sg_text, only: text_of_duration, to_text
  use sg_threads, only: usable_cores
  use sg_variation, only: variation_t
  implicit none
  private

  public :: estimate_text

  !> Steps that are run to learn the speed of this machine.
  integer, parameter :: TRIAL_STEPS = 100
  !> The flowing phase costs up to this much more than the first steps.
  real(wp), parameter :: FLOW_FACTOR = 1.5_wp

contains

  !> The plan in words. Runs a hundred steps to learn the cost of one.
  subroutine estimate_text(config, plan, text, error)
    type(config_t), intent(in) :: config
    type(plan_t), intent(in) :: plan
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error
    type(scene_t) :: scene
    character(len=:), allocatable :: field
    real(wp) :: step_seconds, member_seconds, megabytes, limit
    integer(i8) :: steps_needed, members
    integer :: cells_x, cells_y

    call build_scene(config, scene, error)
    if (allocated(error)) return
    call describe_field(config, scene, field, error)
    if (allocated(error)) return
    cells_x = nint((config%grid%x_max - config%grid%x_min)/config%grid%cell_size)
    cells_y = nint((config%grid%y_max - config%grid%y_min)/config%grid%cell_size)
    limit = config%grid%cell_size/(scene%wave_speed + scene%speed)
    steps_needed = ceiling(config%solver%end_time/scene%first_step, i8)
    step_seconds = time_step_cost(config, scene)
    member_seconds = FLOW_FACTOR*step_seconds*real(steps_needed, wp)
    members = plan%total()
    megabytes = real(members, wp)*(8.0_wp*COLUMN_COUNT + 4.0_wp*cells_x + 32.0_wp)*2.0_wp*1.0e-6_wp
    text = 'case            '//trim(config%name)//line( &
      'points          '//to_text(scene%particles%count)//' in '//to_text(size(config%bodies))// &
      ' bodies')//line( &
      'cells           '//to_text(cells_x)//' x '//to_text(cells_y)//' of '// &
      to_text(config%grid%cell_size)//' m')//line( &
      'time step       '//to_text(scene%first_step, &
      4)//' s at the start; limit h/(c + v) = '//to_text(limit, 4)// &
      ' s, wave speed '//to_text(scene%wave_speed, 4)//' m/s')//line( &
      'kernel          '//trim(config%solver%scheme)//' with '//trim(config%solver%weighting)// &
      ' weights in '//trim(config%solver%precision)//' precision')//line( &
      'threads         '//to_text(config%solver%threads)//' in each rank, '// &
      to_text(usable_cores())//' cores for this one')//line( &
      'steps           '//to_text(steps_needed)//' or more to end_time = '// &
      to_text(config%solver%end_time)// &
      ' s, fewer if it comes to rest')//line( &
      'random field    '//field)//line( &
      'members         '//to_text(members)//' in '//to_text(size(plan%cases))//' cases: '// &
      case_list(plan))//line( &
      'one member      about '//text_of_duration(member_seconds)//' ('// &
      to_text(1.0e9_wp*step_seconds/scene%particles%count, &
      3)//' ns per point and step here and now)')//line( &
      'all             about '//to_text(members*member_seconds*config%solver%threads/3600.0_wp, &
      3)//' core-hours')//line( &
      'disk            about '//to_text(megabytes, 3)//' MB, snapshots not counted')//line( &
      'directory       '//config%output%directory)
    if (scene%first_step > limit) text = text//line( &
      'warning         the time step is above its limit: expect members to fail')
  end subroutine estimate_text

  pure function line(text) result(with_break)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: with_break
    with_break = new_line('a')//text
  end function line

  subroutine describe_field(config, scene, description, error)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    character(len=:), allocatable, intent(out) :: description
    type(error_t), allocatable, intent(out) :: error
    type(random_fields_t), allocatable :: fields(:)
    integer(i8) :: bytes

    description = 'none: the run is deterministic'
    if (.not. config%has_random_field) return
    call prepare_fields(config, points_of_materials(scene), fields, error)
    if (allocated(error)) return
    call fields(size(fields))%estimate(bytes, description, error)
    if (allocated(error) .or. size(fields) == 1) return
    description = description//' (for each of '//to_text(size(fields))//' functions)'
  end subroutine describe_field

  !> Seconds of one step, from the first steps of the homogeneous member.
  function time_step_cost(config, scene) result(step_seconds)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    real(wp) :: step_seconds
    type(config_t) :: short
    type(variation_t) :: variation
    type(patient_monitor_t) :: monitor
    type(blind_observer_t) :: observer
    type(outcome_t) :: outcome

    short = config
    short%solver%end_time = min(config%solver%end_time, TRIAL_STEPS*scene%first_step)
    call reset_outcome(outcome, 1, 1_i8, size(scene%profile_x))
    call simulate(short, scene, variation, monitor, observer, outcome)
    step_seconds = outcome%values(SECONDS)/max(outcome%values(STEPS), 1.0_wp)
  end function time_step_cost

  !> Labels with the number of members; the first few of many.
  pure function case_list(plan) result(text)
    type(plan_t), intent(in) :: plan
    character(len=:), allocatable :: text
    integer, parameter :: SHOWN = 6
    integer :: k

    text = ''
    do k = 1, min(SHOWN, size(plan%cases))
      if (k > 1) text = text//', '
      text = text//trim(plan%cases(k)%label)//' ('//to_text(plan%cases(k)%member_count)//')'
    end do
    if (size(plan%cases) > SHOWN) text = text//', ...'
  end function case_list
end module sg_estimate
