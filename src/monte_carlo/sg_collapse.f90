!> A member of the ensemble as the paper has it: a random field of strength, the collapse of the
!> body, one row.
module sg_collapse
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_materials, only: MODEL_MOHR_COULOMB
  use sg_member_model, only: member_model_t
  use sg_monitor, only: monitor_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: FAILURE_STEP, FIELD_CLIPPED, outcome_t, reset_outcome, STATUS_ABANDONED, &
    STATUS_FIELD_FAILED, STATUS_OK, STATUS_TIME_LIMIT, status_text, STEPS
  use sg_posix, only: write_file
  use sg_resolved, only: resolved_text
  use sg_snapshot, only: snapshot_name
  use sg_philox, only: FIELD_STREAM, fill_uniform, NOISE_STREAM
  use sg_plan, only: plan_t
  use sg_property, only: PROPERTY_FRICTION_ANGLE
  use sg_random_field, only: random_field_t
  use sg_recorder, only: recorder_t
  use sg_scene, only: build_scene, scene_t
  use sg_simulate, only: simulate
  use sg_text, only: to_text
  use sg_variation, only: variation_t
  implicit none
  private

  public :: collapse_model_t

  !> Homogeneous members beyond the first: CFL number within +-20 %, lines of the grid shifted by up
  !> to a cell at the toe, friction within 1e-6. None of it means anything physically; the spread it
  !> makes is the noise floor.
  real(wp), parameter :: STEP_SPREAD = 0.2_wp
  real(wp), parameter :: FRICTION_SPREAD = 1.0e-6_wp

  type, extends(member_model_t) :: collapse_model_t
    type(config_t) :: config
    type(plan_t) :: plan
    type(scene_t) :: scene
    !> One Gaussian field for each ACF of the study; the coefficient of variation is set for each
    !> member.
    type(random_field_t), allocatable :: fields(:)
    !> Record every member, with snapshots at their interval (replays).
    logical :: record_all = .false.
    !> Record none, whatever the configuration says (replays without snapshots).
    logical :: record_nothing = .false.
  contains
    procedure :: init => init_collapse
    procedure :: run => run_collapse
    procedure :: field_method
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
    real(wp), allocatable :: x(:), y(:)

    this%config = config
    this%plan = plan
    call build_scene(config, this%scene, error)
    if (allocated(error)) return
    if (.not. config%has_random_field) return
    call this%scene%points_of(config%random_field%material_index, x, y)
    allocate (this%fields(size(config%study%acf)))
    do k = 1, size(this%fields)
      call this%fields(k)%init(config%random_field, trim(config%study%acf(k)), &
        config%study%cov(1), x, y, error)
      if (allocated(error)) return
    end do
  end subroutine init_collapse

  !> How the fields are sampled, with the jitter of each factor that needed one; empty without a
  !> field.
  function field_method(this) result(text)
    class(collapse_model_t), intent(in) :: this
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    if (.not. allocated(this%fields)) return
    text = this%fields(1)%sampler%description
    do k = 1, size(this%fields)
      if (.not. this%fields(k)%sampler%jitter > 0.0_wp) cycle
      text = text//'; '//trim(this%config%study%acf(k))//' is near-singular, jitter '// &
        to_text(this%fields(k)%sampler%jitter, 2)//' on the diagonal'
    end do
  end function field_method

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
    real(wp) :: clipped

    call reset_outcome(outcome, case_index, id, size(this%scene%profile_x))
    clipped = 0.0_wp
    if (this%plan%cases(case_index)%is_homogeneous) then
      call this%vary_homogeneous(case_index, id, variation)
    else
      call this%vary_by_field(case_index, id, variation, clipped, error)
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
    outcome%values(FIELD_CLIPPED) = clipped
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

  !> Member 1 is nominal, the others differ by what means nothing. With a random field, the
  !> strength is its mean.
  subroutine vary_homogeneous(this, case_index, id, variation)
    class(collapse_model_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(variation_t), intent(inout) :: variation
    real(wp) :: u(3), friction
    integer :: material

    friction = 1.0_wp
    if (id > 1) then
      call fill_uniform(this%config%monte_carlo%seed, NOISE_STREAM, id, 0_i8, u)
      variation%step_factor = 1.0_wp + STEP_SPREAD*(2.0_wp*u(1) - 1.0_wp)
      if (this%scene%is_clear_of_far_walls) variation%cell_stretch = u(2) &
        *this%config%grid%cell_size/(this%scene%extent(2) - this%config%grid%x_min)
      friction = 1.0_wp + FRICTION_SPREAD*(2.0_wp*u(3) - 1.0_wp)
    end if
    material = this%config%bodies(1)%material_index
    if (this%config%has_random_field) material = this%config%random_field%material_index
    if (this%config%has_random_field) then
      friction = friction*this%plan%cases(case_index)%mean
    else if (id > 1 .and. this%scene%materials(material)%model == MODEL_MOHR_COULOMB) then
      friction = friction*this%scene%materials(material)%friction_angle
    else
      return
    end if
    allocate (variation%properties(1))
    associate (one => variation%properties(1))
      one%property = PROPERTY_FRICTION_ANGLE
      one%material = material
      allocate (one%values(this%scene%point_count(material)), source=friction)
    end associate
  end subroutine vary_homogeneous

  !> The friction angles of realization `id`.
  subroutine vary_by_field(this, case_index, id, variation, clipped, error)
    class(collapse_model_t), intent(inout) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    type(variation_t), intent(inout) :: variation
    real(wp), intent(out) :: clipped
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    clipped = 0.0_wp
    associate (one => this%plan%cases(case_index), field => this%config%random_field)
      do k = 1, size(this%fields)
        if (this%config%study%acf(k) == one%acf) exit
      end do
      call this%fields(k)%set_cov(field, one%cov, error)
      if (allocated(error)) return
      allocate (variation%properties(1))
      variation%properties(1)%property = PROPERTY_FRICTION_ANGLE
      variation%properties(1)%material = field%material_index
      allocate (variation%properties(1)%values(this%scene%point_count(field%material_index)))
      call this%fields(k)%realize(this%config%monte_carlo%seed, FIELD_STREAM, id, &
                                  variation%properties(1)%values, clipped, error)
    end associate
  end subroutine vary_by_field

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
