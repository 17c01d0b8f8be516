!> A member of the ensemble as the paper has it: a random field of strength, the collapse of the
!> body, one row.
module sg_collapse
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_field_properties, only: compose_properties, points_of_materials, refuse_hidden, &
    units_of
  use sg_field_record, only: field_file_t, field_record_t, made_by_t
  use sg_kinds, only: i8, wp
  use sg_materials, only: MODEL_MOHR_COULOMB
  use sg_member_model, only: member_model_t
  use sg_monitor, only: monitor_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: FAILURE_STEP, FIELD_CLIPPED, FIELD_MAX, FIELD_MEAN, FIELD_MIN, outcome_t, &
    reset_outcome, STATUS_ABANDONED, STATUS_FIELD_FAILED, STATUS_OK, STATUS_TIME_LIMIT, &
    status_text, STEPS
  use sg_posix, only: write_file
  use sg_resolved, only: resolved_text
  use sg_snapshot, only: snapshot_name
  use sg_philox, only: fill_uniform, NOISE_STREAM
  use sg_plan, only: plan_t
  use sg_property, only: PROPERTY_FRICTION_ANGLE
  use sg_random_field, only: field_points_t
  use sg_random_fields, only: field_values_t, follows_study, random_fields_t, &
    refuse_changed_files
  use sg_recorder, only: recorder_t
  use sg_scene, only: build_scene, scene_t
  use sg_simulate, only: simulate
  use sg_text, only: to_text
  use sg_variation, only: variation_t
  implicit none
  private

  public :: collapse_model_t, prepare_fields

  !> Homogeneous members beyond the first: CFL number within +-20 %, lines of the grid shifted by up
  !> to a cell at the toe, properties within 1e-6. None of it means anything physically; the spread
  !> it makes is the noise floor.
  real(wp), parameter :: STEP_SPREAD = 0.2_wp
  real(wp), parameter :: PROPERTY_SPREAD = 1.0e-6_wp

  type, extends(member_model_t) :: collapse_model_t
    type(config_t) :: config
    type(plan_t) :: plan
    type(scene_t) :: scene
    !> The points of each material, and the fields for each ACF of the study; the coefficient of
    !> variation is set for each member.
    type(field_points_t), allocatable :: points(:)
    type(random_fields_t), allocatable :: fields(:)
    !> Record every member, with snapshots at their interval (replays).
    logical :: record_all = .false.
    !> Record none, whatever the configuration says (replays without snapshots).
    logical :: record_nothing = .false.
  contains
    procedure :: init => init_collapse
    procedure :: run => run_collapse
    procedure :: field_method
    procedure :: field_records
    procedure :: make_fields
    procedure, private :: choose_fields
    procedure, private :: vary_homogeneous
    procedure, private :: vary_by_field
    procedure, private :: is_recorded
    procedure, private :: keep_capsule
  end type collapse_model_t

contains

  !> Builds what all members share: the scene and the factors of the fields. Nothing random happens
  !> here.
  subroutine init_collapse(this, config, plan, error)
    class(collapse_model_t), intent(inout) :: this
    type(config_t), intent(in) :: config
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    this%config = config
    this%plan = plan
    call build_scene(config, this%scene, error)
    if (allocated(error)) return
    if (.not. config%has_random_field) return
    this%points = points_of_materials(this%scene)
    call prepare_fields(config, this%points, this%fields, error)
    do k = 1, size(config%study%acf)
      if (allocated(error)) return
      call this%fields(k)%build(error)
    end do
  end subroutine init_collapse

  !> The fields for each ACF of the study, without their factors; what is wrong with them in any
  !> case is told here, and not by members that fail.
  subroutine prepare_fields(config, points, fields, error)
    type(config_t), intent(in) :: config
    !> Of each material.
    type(field_points_t), intent(in) :: points(:)
    type(random_fields_t), allocatable, intent(out) :: fields(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: j, k

    call refuse_changed_files(config, error)
    if (allocated(error)) return
    allocate (fields(size(config%study%acf)))
    do k = 1, size(fields)
      call fields(k)%prepare(config, trim(config%study%acf(k)), config%study%cov(1), points, error)
      if (.not. allocated(error)) call refuse_hidden(fields(k)%fields, error)
      do j = size(config%study%cov), 1, -1
        if (.not. allocated(error)) call fields(k)%set_cov(config%study%cov(j), error)
      end do
      if (.not. allocated(error)) call open_files(fields(k), config%monte_carlo%realizations, &
        error)
      if (allocated(error)) return
    end do
  end subroutine prepare_fields

  !> How the fields are sampled, with what was conceded for each ACF; empty without a field.
  function field_method(this) result(text)
    class(collapse_model_t), intent(in) :: this
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    if (.not. allocated(this%fields)) return
    text = this%fields(1)%describe()
    do k = 2, size(this%fields)
      if (this%fields(k)%describe() /= this%fields(1)%describe()) text = text//'; '// &
        trim(this%config%study%acf(k))//': '//this%fields(k)%describe()
    end do
  end function field_method

  !> The fields, for files; size 0 without one.
  function field_records(this) result(records)
    class(collapse_model_t), intent(in) :: this
    type(field_record_t), allocatable :: records(:)
    integer :: j, k

    if (.not. allocated(this%fields)) then
      allocate (records(0))
      return
    end if
    allocate (records(size(this%fields(1)%fields)))
    do k = 1, size(records)
      associate (r => records(k), field => this%fields(1)%fields(k))
        r%index = k
        r%name = trim(field%config%name)
        r%property = trim(field%config%property)
        r%material = trim(field%config%material)
        r%units = units_of(r%property)
        r%x = field%x
        r%y = field%y
        r%width = this%points(field%config%material_index)%width(field%points)
        r%height = this%points(field%config%material_index)%height(field%points)
        r%mean = field%mean
        r%sd = field%sd
        r%data = this%fields(1)%data%of_field(k)
        allocate (r%made_by(merge(size(this%fields), 1, follows_study(this%config, k))))
        do j = 1, size(r%made_by)
          r%made_by(j) = way_of(this%fields(j), k)
        end do
      end associate
    end do
  end function field_records

  !> How field `k` is made.
  function way_of(fields, k) result(way)
    type(random_fields_t), intent(in) :: fields
    integer, intent(in) :: k
    type(made_by_t) :: way

    way%acf = trim(fields%fields(k)%correlation%acf%name)
    way%method = 'file'
    allocate (way%jitters(0))
    if (fields%sampler_of(k) == 0) return
    associate (sampler => fields%samplers(fields%sampler_of(k))%sampler)
      way%method = sampler%method
      way%jitters = sampler%jitters
      way%ring = sampler%ring
    end associate
  end function way_of

  !> Opens the files of the fields that are not sampled.
  subroutine open_files(fields, realizations, error)
    type(random_fields_t), intent(inout) :: fields
    integer, intent(in) :: realizations
    type(error_t), allocatable, intent(out) :: error
    type(field_file_t), allocatable :: file
    integer :: k

    do k = 1, size(fields%fields)
      associate (field => fields%fields(k))
        if (field%config%file == '') cycle
        allocate (file)
        call file%open_fields(field%config%file, trim(field%config%name), field%x, field%y, &
          realizations, error)
        if (allocated(error)) return
        call move_alloc(file, fields%supplies(k)%supply)
      end associate
    end do
  end subroutine open_files

  !> One member; see member_model_t.
  subroutine run_collapse(this, case_index, id, monitor, outcome)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    class(monitor_t), intent(inout) :: monitor
    type(outcome_t), intent(out) :: outcome
    type(variation_t) :: variation
    type(recorder_t) :: recorder
    type(blind_observer_t) :: nobody
    type(error_t), allocatable :: error
    type(field_values_t), allocatable :: values(:)

    call reset_outcome(outcome, case_index, id, size(this%scene%profile_x))
    if (this%plan%cases(case_index)%is_homogeneous) then
      call this%vary_homogeneous(id, variation, values)
    else
      call this%vary_by_field(case_index, id, variation, values, error)
    end if
    if (allocated(error)) then
      outcome%status = STATUS_FIELD_FAILED
      outcome%reason = error%message
      return
    end if
    if (this%is_recorded(id)) then
      associate (output => this%config%output)
        call recorder%open(output%directory, 'snapshots', &
          trim(this%plan%cases(case_index)%label), id, output%snapshot_interval, &
          output%history_interval, error)
      end associate
      if (allocated(error)) then
        call simulate(this%config, this%scene, variation, monitor, nobody, outcome)
      else
        call simulate(this%config, this%scene, variation, monitor, recorder, outcome)
        if (outcome%status /= STATUS_ABANDONED) call recorder%close(error)
      end if
      if (allocated(error) .and. outcome%status == STATUS_OK) outcome%reason = &
        'snapshots not written: '//error%message
    else
      call simulate(this%config, this%scene, variation, monitor, nobody, outcome)
    end if
    if (outcome%values(FAILURE_STEP) > 0.0_wp .and. .not. this%record_nothing) then
      call this%keep_capsule(case_index, id, variation, monitor, outcome)
    end if
    if (allocated(values)) call describe_field(values(1), outcome)
  end subroutine run_collapse

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
    associate (output => this%config%output)
      path = trim(output%directory)//'/failures/'//snapshot_name(label, id)
      call recorder%open(output%directory, 'failures', label, id, 0.0_wp, 0.0_wp, error)
      if (.not. allocated(error)) then
        shortened = variation
        if (outcome%values(STEPS) > 0.0_wp) then
          shortened%last_step = nint(outcome%values(FAILURE_STEP)) - 1
        else
          shortened%last_relaxation_step = nint(outcome%values(FAILURE_STEP)) - 1
        end if
        call reset_outcome(again, case_index, id, size(this%scene%profile_x))
        call simulate(this%config, this%scene, shortened, monitor, recorder, again)
        if (again%status == STATUS_ABANDONED) return
        call recorder%close(error)
      end if
      if (.not. allocated(error)) call write_file(path//'.nml', '! Member '//to_text(id)//' of '// &
        label//' failed ('//status_text(outcome%status)//') in step '// &
        to_text(nint(outcome%values(FAILURE_STEP)))//': '//outcome%reason//new_line('a')// &
        '! Replay: sgimp THIS_FILE --realization '//to_text(id)//' --study-case '//label// &
        ' --snapshots --output DIR'//new_line('a')//resolved_text(this%config), error)
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
  end subroutine describe_field

  !> Member 1 is nominal, the others differ by what means nothing. With random fields, properties
  !> have their means.
  subroutine vary_homogeneous(this, id, variation, values)
    class(collapse_model_t), intent(in) :: this
    integer(i8), intent(in) :: id
    type(variation_t), intent(inout) :: variation
    !> Not allocated without a random field.
    type(field_values_t), allocatable, intent(out) :: values(:)
    real(wp) :: u(3), strength
    integer :: k, material

    strength = 1.0_wp
    if (id > 1) then
      call fill_uniform(this%config%monte_carlo%seed, NOISE_STREAM, id, 0_i8, u)
      variation%step_factor = 1.0_wp + STEP_SPREAD*(2.0_wp*u(1) - 1.0_wp)
      if (this%scene%is_clear_of_far_walls) variation%cell_stretch = u(2) &
        *this%config%grid%cell_size/(this%scene%extent(2) - this%config%grid%x_min)
      strength = 1.0_wp + PROPERTY_SPREAD*(2.0_wp*u(3) - 1.0_wp)
    end if
    if (this%config%has_random_field) then
      allocate (values(size(this%fields(1)%fields)))
      do k = 1, size(values)
        values(k)%values = strength*this%fields(1)%fields(k)%mean
      end do
      call compose_properties(this%config, this%fields(1)%fields, values, this%points, &
        variation%properties)
      return
    end if
    material = this%config%bodies(1)%material_index
    if (id == 1 .or. this%scene%materials(material)%model /= MODEL_MOHR_COULOMB) return
    allocate (variation%properties(1))
    associate (one => variation%properties(1))
      one%property = PROPERTY_FRICTION_ANGLE
      one%material = material
      allocate (one%values(this%scene%point_count(material)), &
        source=strength*this%scene%materials(material)%friction_angle)
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
    integer :: k

    call this%choose_fields(case_index, k, error)
    if (.not. allocated(error)) call this%fields(k)%realize(id, values, error)
    if (allocated(error)) return
    call compose_properties(this%config, this%fields(1)%fields, values, this%points, &
      variation%properties)
  end subroutine vary_by_field

  !> The fields of `count` realizations of a study case from `first` on, [fields, count].
  subroutine make_fields(this, case_index, first, count, values, error)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index, count
    integer(i8), intent(in) :: first
    type(field_values_t), allocatable, intent(out) :: values(:, :)
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    call this%choose_fields(case_index, k, error)
    if (.not. allocated(error)) call this%fields(k)%realize_block(first, count, values, error)
  end subroutine make_fields

  !> The fields of a study case, in place `k`, with the laws of its coefficient of variation.
  subroutine choose_fields(this, case_index, k, error)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer, intent(out) :: k
    type(error_t), allocatable, intent(out) :: error

    associate (one => this%plan%cases(case_index))
      do k = 1, size(this%fields)
        if (this%config%study%acf(k) == one%acf) exit
      end do
      call this%fields(k)%set_cov(one%cov, error)
    end associate
  end subroutine choose_fields

  !> Members that were asked for; without a random field the nominal run, if anything is to be
  !> recorded at all.
  pure function is_recorded(this, id) result(recorded)
    class(collapse_model_t), intent(in) :: this
    integer(i8), intent(in) :: id
    logical :: recorded

    associate (output => this%config%output)
      recorded = this%record_all .or. any(output%snapshot_members == id)
      if (.not. this%config%has_random_field .and. id == 1) then
        recorded = recorded .or. output%snapshot_interval > 0.0_wp &
          .or. output%history_interval > 0.0_wp
      end if
      recorded = recorded .and. .not. this%record_nothing
    end associate
  end function is_recorded
end module sg_collapse
