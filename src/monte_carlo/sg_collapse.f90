!> A member of the ensemble as the paper has it: a random field of strength, the collapse of the
!> body, one row.
module sg_collapse
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_ground, only: build_grounds, ground_t
  use sg_kinds, only: i8, wp
  use sg_linear_functional, only: take_functionals
  use sg_materials, only: MODEL_MOHR_COULOMB
  use sg_member_model, only: member_model_t
  use sg_monitor, only: monitor_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: FAILURE_STEP, FIELD_CLIPPED, FIELD_MAX, FIELD_MEAN, FIELD_MIN, &
    LOG_WEIGHT, outcome_t, reset_outcome, SECONDS, STATUS_ABANDONED, STATUS_FIELD_FAILED, &
    STATUS_OK, STATUS_TIME_LIMIT, status_text, STEPS
  use sg_philox, only: fill_uniform, NOISE_STREAM
  use sg_plan, only: plan_t
  use sg_posix, only: write_file
  use sg_property, only: PROPERTY_FRICTION_ANGLE
  use sg_random_fields, only: field_values_t
  use sg_recorder, only: recorder_t
  use sg_resolved, only: resolved_text
  use sg_simulate, only: simulate
  use sg_snapshot, only: snapshot_name
  use sg_study, only: variant_t
  use sg_text, only: to_text
  use sg_variation, only: variation_t
  implicit none
  private

  public :: collapse_model_t

  !> Homogeneous members beyond the first: CFL number within +-20 %, lines of the grid shifted by up
  !> to a cell at the toe, properties within 1e-6. None of it means anything physically; the spread
  !> it makes is the noise floor.
  real(wp), parameter :: STEP_SPREAD = 0.2_wp
  real(wp), parameter :: PROPERTY_SPREAD = 1.0e-6_wp

  type, extends(member_model_t) :: collapse_model_t
    type(plan_t) :: plan
    !> One for each variant of the case; there are several in a study of
    !> other keys than acf and cov, and where there are control variates.
    type(ground_t), allocatable :: grounds(:)
    !> Record every member, with snapshots at their interval (replays).
    logical :: record_all = .false.
    !> Record none, whatever the configuration says (replays without snapshots).
    logical :: record_nothing = .false.
  contains
    procedure :: init => init_collapse
    procedure :: run => run_collapse
    procedure :: make_fields
    procedure :: profile_size
    procedure :: field_ground
    procedure, private :: vary_homogeneous
    procedure, private :: vary_by_field
    procedure, private :: record_member
    procedure, private :: keep_capsule
  end type collapse_model_t

contains

  !> Builds what all members share: scenes and the factors of the fields.
  subroutine init_collapse(this, variants, plan, error)
    class(collapse_model_t), intent(inout) :: this
    type(variant_t), intent(in) :: variants(:)
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error

    this%plan = plan
    call build_grounds(variants, this%grounds, error)
  end subroutine init_collapse

  !> Columns of the profile of a case.
  pure integer function profile_size(this, case_index)
    class(collapse_model_t), intent(in) :: this
    integer, intent(in) :: case_index

    profile_size = size(this%grounds(this%plan%cases(case_index)%variant)%scene%profile_x)
  end function profile_size

  !> Position of the ground whose fields the first variant has.
  pure integer function field_ground(this)
    class(collapse_model_t), intent(in) :: this

    field_ground = max(1, this%grounds(1)%source)
  end function field_ground

  !> One member; see member_model_t.
  subroutine run_collapse(this, case_index, id, monitor, outcome)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(out) :: outcome
    type(variation_t) :: variation
    type(blind_observer_t) :: nobody
    type(error_t), allocatable :: error
    type(field_values_t), allocatable :: values(:)

    call reset_outcome(outcome, case_index, id, this%profile_size(case_index))
    if (this%plan%cases(case_index)%is_homogeneous) then
      call this%vary_homogeneous(case_index, id, variation, values)
    else
      call this%vary_by_field(case_index, id, variation, values, error)
    end if
    if (allocated(error)) then
      outcome%status = STATUS_FIELD_FAILED
      outcome%values(SECONDS) = 0.0_wp
      outcome%reason = error%message
      return
    end if
    associate (ground => this%grounds(this%plan%cases(case_index)%variant))
      if (ground%config%solver%model == 'linear_functional') then
        call take_functionals(ground, values, outcome)
      else if (is_recorded(this, ground%config, id)) then
        call this%record_member(case_index, id, variation, monitor, outcome)
      else
        call simulate(ground%config, ground%scene, variation, monitor, nobody, outcome)
      end if
    end associate
    if (outcome%values(FAILURE_STEP) > 0.0_wp .and. .not. this%record_nothing) then
      call this%keep_capsule(case_index, id, variation, monitor, outcome)
    end if
    outcome%values(LOG_WEIGHT) = 0.0_wp
    if (allocated(values)) call describe_field(values(1), outcome)
  end subroutine run_collapse

  !> A member whose states and history are written. If they cannot be, the member counts all the
  !> same, and says so.
  subroutine record_member(this, case_index, id, variation, monitor, outcome)
    class(collapse_model_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(variation_t), intent(in) :: variation
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(inout) :: outcome
    type(recorder_t) :: recorder
    type(blind_observer_t) :: nobody
    type(error_t), allocatable :: error

    associate (one => this%plan%cases(case_index), &
      ground => this%grounds(this%plan%cases(case_index)%variant))
      associate (output => ground%config%output)
        call recorder%open(output%directory, 'snapshots', trim(one%label), id, &
          output%snapshot_interval, output%history_interval, error)
      end associate
      if (allocated(error)) then
        call simulate(ground%config, ground%scene, variation, monitor, nobody, outcome)
      else
        call simulate(ground%config, ground%scene, variation, monitor, recorder, outcome)
        if (outcome%status /= STATUS_ABANDONED) call recorder%close(error)
      end if
    end associate
    if (allocated(error) .and. outcome%status == STATUS_OK) outcome%reason = &
      'snapshots not written: '//error%message
  end subroutine record_member

  !> What a failed member leaves in DIR/failures: its first and its last good state (the step before
  !> the failure, computed again; of the relaxation if it failed there), and a case file that
  !> replays it. A capsule that cannot be written is told in the reason and hides nothing.
  subroutine keep_capsule(this, case_index, id, variation, monitor, outcome)
    class(collapse_model_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(variation_t), intent(in) :: variation
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(inout) :: outcome
    type(variation_t) :: shortened
    type(recorder_t) :: recorder
    type(outcome_t) :: again
    type(error_t), allocatable :: error
    character(len=:), allocatable :: label, path

    if (outcome%status == STATUS_TIME_LIMIT) return
    label = trim(this%plan%cases(case_index)%label)
    associate (ground => this%grounds(this%plan%cases(case_index)%variant), &
      output => this%grounds(1)%config%output)
      path = trim(output%directory)//'/failures/'//snapshot_name(label, id)
      call recorder%open(output%directory, 'failures', label, id, 0.0_wp, 0.0_wp, error)
      if (.not. allocated(error)) then
        shortened = variation
        if (outcome%values(STEPS) > 0.0_wp) then
          shortened%last_step = nint(outcome%values(FAILURE_STEP)) - 1
        else
          shortened%last_relaxation_step = nint(outcome%values(FAILURE_STEP)) - 1
        end if
        call reset_outcome(again, case_index, id, this%profile_size(case_index))
        call simulate(ground%config, ground%scene, shortened, monitor, recorder, again)
        if (again%status == STATUS_ABANDONED) return
        call recorder%close(error)
      end if
      if (.not. allocated(error)) call write_file(path//'.nml', '! Member '//to_text(id)//' of '// &
        label//' failed ('//status_text(outcome%status)//') in step '// &
        to_text(nint(outcome%values(FAILURE_STEP)))//': '//outcome%reason//new_line('a')// &
        '! Replay: sgimp THIS_FILE --realization '//to_text(id)//' --study-case '//label// &
        ' --snapshots --output DIR'//new_line('a')//resolved_text(this%grounds(1)%config), error)
    end associate
    if (allocated(error)) outcome%reason = outcome%reason//' (capsule not written: '// &
      error%message//')'
  end subroutine keep_capsule

  !> The columns that say what the first field was like.
  subroutine describe_field(field, outcome)
    type(field_values_t), intent(in) :: field
    type(outcome_t), intent(inout) :: outcome

    outcome%values(FIELD_MEAN) = sum(field%values)/size(field%values)
    outcome%values(FIELD_MIN) = minval(field%values)
    outcome%values(FIELD_MAX) = maxval(field%values)
    outcome%values(FIELD_CLIPPED) = field%clipped_share
    outcome%values(LOG_WEIGHT) = field%log_weight
  end subroutine describe_field

  !> Member 1 is nominal, the others differ by what means nothing. With random fields, properties
  !> have their means.
  subroutine vary_homogeneous(this, case_index, id, variation, values)
    class(collapse_model_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(variation_t), intent(inout) :: variation
    !> Not allocated without a random field.
    type(field_values_t), allocatable, intent(out) :: values(:)
    real(wp) :: u(3), strength
    integer :: material

    strength = 1.0_wp
    associate (ground => this%grounds(this%plan%cases(case_index)%variant))
      associate (config => ground%config, scene => ground%scene)
        if (id > 1) then
          call fill_uniform(config%monte_carlo%seed, NOISE_STREAM, id, 0_i8, u)
          variation%step_factor = 1.0_wp + STEP_SPREAD*(2.0_wp*u(1) - 1.0_wp)
          if (scene%is_clear_of_far_walls) variation%cell_stretch = u(2) &
            *config%grid%cell_size/(scene%extent(2) - config%grid%x_min)
          strength = 1.0_wp + PROPERTY_SPREAD*(2.0_wp*u(3) - 1.0_wp)
        end if
        if (config%has_random_field) then
          allocate (values, source=ground%mean_properties(strength))
          allocate (variation%properties, source=ground%properties_of(values))
          return
        end if
        material = config%bodies(1)%material_index
        if (id == 1 .or. scene%materials(material)%model /= MODEL_MOHR_COULOMB) return
        allocate (variation%properties(1))
        associate (one => variation%properties(1))
          one%property = PROPERTY_FRICTION_ANGLE
          one%material = material
          allocate (one%values(scene%point_count(material)), &
            source=strength*scene%materials(material)%friction_angle)
        end associate
      end associate
    end associate
  end subroutine vary_homogeneous

  !> The properties of realization `id`.
  subroutine vary_by_field(this, case_index, id, variation, values, error)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(variation_t), intent(inout) :: variation
    type(field_values_t), allocatable, intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    type(field_values_t), allocatable :: block(:, :)

    call this%make_fields(case_index, id, 1, block, error)
    if (allocated(error)) return
    values = block(:, 1)
    allocate (variation%properties, source=this%grounds(this%plan%cases(case_index)%variant) &
      %properties_of(values))
  end subroutine vary_by_field

  !> The fields of `count` realizations of a study case from `first` on, [fields, count].
  subroutine make_fields(this, case_index, first, count, values, error)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index, count
    integer(i8), intent(in) :: first
    type(field_values_t), allocatable, intent(out) :: values(:, :)
    type(error_t), allocatable, intent(out) :: error
    integer :: k, m, source

    associate (one => this%plan%cases(case_index))
      source = this%grounds(one%variant)%source
      k = this%grounds(source)%acf_index(trim(one%acf))
      associate (fields => this%grounds(source)%fields(k))
        call fields%set_cov(one%cov, error)
        if (.not. allocated(error)) call fields%realize_block(first, count, values, error)
      end associate
      if (allocated(error)) return
      do m = 1, count
        call this%grounds(one%variant)%restrict(values(:, m))
      end do
    end associate
  end subroutine make_fields

  !> Members that were asked for; without a random field the nominal run, if anything is to be
  !> recorded at all.
  pure function is_recorded(this, config, id) result(recorded)
    class(collapse_model_t), intent(in) :: this
    type(config_t), intent(in) :: config
    integer(i8), intent(in) :: id
    logical :: recorded

    associate (output => config%output)
      recorded = this%record_all .or. any(output%snapshot_members == id)
      if (.not. config%has_random_field .and. id == 1) then
        recorded = recorded .or. output%snapshot_interval > 0.0_wp &
          .or. output%history_interval > 0.0_wp
      end if
      recorded = recorded .and. .not. this%record_nothing
    end associate
  end function is_recorded
end module sg_collapse
