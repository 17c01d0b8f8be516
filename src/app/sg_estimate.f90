!> What a run would take, without writing anything: `--check`.
module sg_estimate
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_ground, only: ground_t, prepare_grounds
  use sg_kinds, only: i8, wp
  use sg_monitor, only: patient_monitor_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: COLUMN_COUNT, outcome_t, reset_outcome, SECONDS, STEPS
  use sg_plan, only: plan_t
  use sg_scene, only: scene_t
  use sg_simulate, only: simulate
  use sg_stop_rule, only: make_stop_rule, RULE_COUNT, stop_rule_t
  use sg_study, only: variant_t
  use sg_text, only: text_of_duration, to_text
  use sg_threads, only: usable_cores
  use sg_variation, only: variation_t
  implicit none
  private

  public :: estimate_text, listing_text

  !> Steps that are run to learn the speed of this machine.
  integer, parameter :: TRIAL_STEPS = 100
  !> Of a long list, so many are shown.
  integer, parameter :: SHOWN = 6
  !> The flowing phase costs up to this much more than the first steps.
  real(wp), parameter :: FLOW_FACTOR = 1.5_wp

contains

  !> The plan in words. Runs a hundred steps of each variant to learn the cost of one.
  subroutine estimate_text(variants, plan, text, error)
    type(variant_t), intent(in) :: variants(:)
    type(plan_t), intent(in) :: plan
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error
    type(ground_t), allocatable :: grounds(:)
    type(stop_rule_t) :: rule
    character(len=:), allocatable :: bound, field, more
    real(wp) :: seconds(size(variants)), core_seconds, megabytes
    integer(i8) :: members
    integer :: k, v

    call prepare_grounds(variants, grounds, error)
    if (.not. allocated(error)) call describe_fields(grounds, field, error)
    if (allocated(error)) return
    do v = 1, size(variants)
      call describe_variant(variants(v)%config, grounds(v)%scene, field, more, seconds(v))
      if (v == 1) then
        text = more
      else if (v > SHOWN) then
        if (v == SHOWN + 1) text = text//line('                ... and '//to_text(size(variants) &
          - SHOWN)//' variants more')
      else
        text = text//line('another variant '//trim(adjustl(variants(v)%varied//merge( &
          ' (control variate)', '                  ', variants(v)%twin_of > 0)))//': '// &
          to_text(grounds(v)%scene%particles%count)//' points, one member about '// &
          text_of_duration(seconds(v)))
      end if
    end do
    members = plan%total()
    rule = make_stop_rule(variants(1)%config%monte_carlo)
    bound = 'about '
    if (rule%rule /= RULE_COUNT) bound = 'at most about '
    megabytes = 0.0_wp
    core_seconds = 0.0_wp
    do k = 1, size(plan%cases)
      associate (grid => variants(plan%cases(k)%variant)%config%grid, &
        threads => variants(plan%cases(k)%variant)%config%solver%threads)
        core_seconds = core_seconds + real(plan%members_of(k)*threads, wp) &
          *seconds(plan%cases(k)%variant)
        megabytes = megabytes + real(plan%members_of(k), wp)*(8.0_wp*COLUMN_COUNT + 4.0_wp &
          *(grid%x_max - grid%x_min)/grid%cell_size + 32.0_wp)*2.0_wp*1.0e-6_wp
      end associate
    end do
    text = text//line( &
      'members         '//to_text(members)//' in '//to_text(size(plan%cases))//' cases: '// &
      case_list(plan))//line( &
      'stop rule       '//rule%in_words())//line( &
      'all             '//bound//to_text(core_seconds/3600.0_wp, 3)//' core-hours')//line( &
      'disk            about '//to_text(megabytes, 3)//' MB, snapshots not counted')//line( &
      'directory       '//variants(1)%config%output%directory)
  end subroutine estimate_text

  !> One variant in words, and the seconds that a member of it takes here and now.
  subroutine describe_variant(config, scene, field, text, member_seconds)
    type(config_t), intent(in) :: config
    type(scene_t), intent(in) :: scene
    !> What is said of the random fields.
    character(len=*), intent(in) :: field
    character(len=:), allocatable, intent(out) :: text
    real(wp), intent(out) :: member_seconds
    real(wp) :: step_seconds, limit
    integer(i8) :: steps_needed
    integer :: cells_x, cells_y

    cells_x = nint((config%grid%x_max - config%grid%x_min)/config%grid%cell_size)
    cells_y = nint((config%grid%y_max - config%grid%y_min)/config%grid%cell_size)
    limit = config%grid%cell_size/(scene%wave_speed + scene%speed)
    steps_needed = ceiling(config%solver%end_time/scene%first_step, i8)
    step_seconds = time_step_cost(config, scene)
    member_seconds = FLOW_FACTOR*step_seconds*real(steps_needed, wp)
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
      'one member      about '//text_of_duration(member_seconds)//' ('// &
      to_text(1.0e9_wp*step_seconds/scene%particles%count, &
      3)//' ns per point and step here and now)')
    if (scene%first_step > limit) text = text//line( &
      'warning         the time step is above its limit: expect members to fail')
  end subroutine describe_variant

  !> Every case of the plan with its members: `--dry`.
  pure function listing_text(plan) result(text)
    type(plan_t), intent(in) :: plan
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    do k = 1, size(plan%cases)
      associate (one => plan%cases(k))
        text = text//trim(one%label)//': '//to_text(plan%members_of(k))//' members'
        if (one%varied /= '') text = text//', '//trim(one%varied)
        if (one%control_of > 0) text = text//', control variate of '// &
          trim(plan%cases(one%control_of)%label)
        text = text//new_line('a')
      end associate
    end do
    text = text//to_text(plan%total())//' members in '//to_text(size(plan%cases))//' cases'
  end function listing_text

  pure function line(text) result(with_break)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: with_break
    with_break = new_line('a')//text
  end function line

  !> How the fields are made, for the first of the grounds that have fields of their own.
  subroutine describe_fields(grounds, description, error)
    type(ground_t), intent(in) :: grounds(:)
    character(len=:), allocatable, intent(out) :: description
    type(error_t), allocatable, intent(out) :: error
    integer(i8) :: bytes
    integer :: own, v

    description = 'none: the run is deterministic'
    if (grounds(1)%source == 0) return
    own = count([(grounds(v)%source == v, v=1, size(grounds))])
    associate (fields => grounds(grounds(1)%source)%fields)
      call fields(size(fields))%estimate(bytes, description, error)
      if (allocated(error)) return
      if (size(fields) > 1) description = description//' (for each of '//to_text(size(fields))// &
        ' functions)'
    end associate
    if (own > 1) description = description//' (and for '//to_text(own - 1)// &
      ' other grounds of the study)'
  end subroutine describe_fields

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
    integer :: k

    text = ''
    do k = 1, min(SHOWN, size(plan%cases))
      if (k > 1) text = text//', '
      text = text//trim(plan%cases(k)%label)//' ('//to_text(plan%members_of(k))//')'
    end do
    if (size(plan%cases) > SHOWN) text = text//', ...'
  end function case_list
end module sg_estimate
