!> ensemble.h5: all results of a run, written whole from memory under a temporary name and put in
!> the place of the old one, so that the file that is there can always be opened.
module sg_ensemble
  use sg_errors, only: error_t
  use sg_field_record, only: field_record_t, write_field_records
  use sg_hdf5_file, only: hdf5_file_t
  use sg_kinds, only: i4, i8, sp, wp
  use sg_outcome, only: COLUMN_COUNT, COLUMNS, FIELD_MAX, FIELD_MEAN, FIELD_MIN, outcome_t
  use sg_posix, only: replace_file
  use sg_version, only: COMPILER, COMPILER_FLAGS, GIT_DIRTY, GIT_HASH, LIBRARIES, VERSION
  implicit none
  private

  public :: case_geometry_t, case_results_t, run_record_t, write_ensemble, ENSEMBLE_NAME

  character(len=*), parameter :: ENSEMBLE_NAME = 'ensemble.h5'
  integer, parameter :: REASON_LENGTH = 160

  !> Where the bodies of a case stand and how its grid lies, in m.
  type :: case_geometry_t
    !> Initial toe, from which runouts are measured, extent of the measured bodies, and the spacing
    !> of points.
    real(wp) :: toe = 0.0_wp, initial_height = 0.0_wp, initial_width = 0.0_wp
    real(wp) :: point_spacing = 0.0_wp
    real(wp) :: x_min = 0.0_wp, x_max = 0.0_wp, y_min = 0.0_wp, y_max = 0.0_wp
    real(wp) :: cell_size = 0.0_wp
    !> Cell centres of the columns of the profile; `outcome%height` has the same size.
    real(wp), allocatable :: profile_x(:)
    !> The random fields at its points are those that the file describes.
    logical :: has_recorded_fields = .true.
  end type case_geometry_t

  !> The members of one study case that are there, at the position of their id.
  type :: case_results_t
    character(len=:), allocatable :: label, acf, distribution
    !> As in sg_plan: what it is there for, what its variant is, and the labels of the homogeneous
    !> case that is its noise floor and of the case that it is the twin of; empty for none.
    character(len=:), allocatable :: role, varied, noise_case, control_of
    type(case_geometry_t) :: geometry
    !> Of the property of the first random field.
    character(len=:), allocatable :: field_units
    real(wp) :: cov = 0.0_wp, mean = 0.0_wp, scale_x = 0.0_wp, scale_y = 0.0_wp
    !> The case ended early, by its rule.
    logical :: stop_rule_met = .false.
    !> [members]
    logical, allocatable :: present(:)
    integer(i4), allocatable :: status(:)
    !> [COLUMN_COUNT, members] and [columns of the profile, members]
    real(wp), allocatable :: values(:, :)
    real(sp), allocatable :: height(:, :)
    character(len=REASON_LENGTH), allocatable :: reason(:)
  contains
    procedure :: init
    procedure :: put
    procedure :: shorten
  end type case_results_t

  !> What the root of the file says of the run.
  type :: run_record_t
    character(len=:), allocatable :: case_text, resolved, host, started, ended, state, config_hash
    !> How the fields were sampled, and the plan of the members; empty for a deterministic run.
    character(len=:), allocatable :: field_method, sampling
    integer(i8) :: seed = 0
    integer :: ranks = 1, realizations = 0
    !> The keys that results depend on, one a line, and the ids that this run was to compute; empty
    !> for all.
    character(len=:), allocatable :: identity, members
    !> The random fields; size 0 for a deterministic run.
    type(field_record_t), allocatable :: fields(:)
  end type run_record_t

contains

  !> Room for `members` members of a study case; none is there yet.
  subroutine init(this, members, geometry)
    class(case_results_t), intent(inout) :: this
    integer(i8), intent(in) :: members
    type(case_geometry_t), intent(in) :: geometry

    this%geometry = geometry
    this%role = 'study'
    this%varied = ''
    this%noise_case = ''
    this%control_of = ''
    allocate (this%present(members), this%status(members), this%reason(members))
    allocate (this%values(COLUMN_COUNT, members), this%height(size(geometry%profile_x), members))
    this%present = .false.
  end subroutine init

  !> Keeps a member; the first one of an id counts. Ids outside the plan are left alone.
  subroutine put(this, outcome)
    class(case_results_t), intent(inout) :: this
    type(outcome_t), intent(in) :: outcome
    integer :: columns

    associate (id => outcome%id)
      if (id < 1 .or. id > size(this%present)) return
      if (this%present(id)) return
      this%present(id) = .true.
      this%status(id) = int(outcome%status, i4)
      this%values(:, id) = outcome%values
      this%height(:, id) = 0.0_sp
      if (allocated(outcome%height)) then
        columns = min(size(outcome%height), size(this%height, 1))
        this%height(:columns, id) = outcome%height(:columns)
      end if
      this%reason(id) = ''
      if (allocated(outcome%reason)) this%reason(id) = outcome%reason
    end associate
  end subroutine put

  !> The case ends with member `members`, by its rule; what is there beyond does not belong to it.
  subroutine shorten(this, members)
    class(case_results_t), intent(inout) :: this
    integer, intent(in) :: members

    this%stop_rule_met = .true.
    this%present = this%present(:members)
    this%status = this%status(:members)
    this%values = this%values(:, :members)
    this%height = this%height(:, :members)
    this%reason = this%reason(:members)
  end subroutine shorten

  subroutine write_ensemble(directory, record, results, error)
    character(len=*), intent(in) :: directory
    type(run_record_t), intent(in) :: record
    type(case_results_t), intent(in) :: results(:)
    type(error_t), allocatable, intent(out) :: error
    type(hdf5_file_t) :: file
    character(len=:), allocatable :: path
    integer :: i

    path = directory//'/'//ENSEMBLE_NAME
    call file%create(path//'.new', error)
    if (allocated(error)) return
    call write_provenance(file, record)
    call file%make_group('/geometry')
    call write_geometry(file, '/geometry', results(1)%geometry)
    call write_field_records(file, record%fields)
    call file%make_group('/cases')
    do i = 1, size(results)
      call write_case(file, results(i), i)
    end do
    call file%close(error)
    if (.not. allocated(error)) call replace_file(path//'.new', path, error)
  end subroutine write_ensemble

  subroutine write_provenance(file, record)
    type(hdf5_file_t), intent(inout) :: file
    type(run_record_t), intent(in) :: record

    call file%set('/', 'program', 'sgimp')
    call file%set('/', 'version', VERSION)
    call file%set('/', 'git_hash', GIT_HASH)
    call file%set('/', 'git_dirty', merge(1_i4, 0_i4, GIT_DIRTY))
    call file%set('/', 'compiler', COMPILER)
    call file%set('/', 'compiler_flags', COMPILER_FLAGS)
    call file%set('/', 'libraries', LIBRARIES)
    if (record%field_method /= '') call file%set('/', 'field_method', record%field_method)
    if (record%sampling /= '') call file%set('/', 'sampling', record%sampling)
    call file%set('/', 'host', record%host)
    call file%set('/', 'ranks', int(record%ranks, i4))
    call file%set('/', 'started', record%started)
    call file%set('/', 'ended', record%ended)
    call file%set('/', 'seed', record%seed)
    call file%set('/', 'config_hash', record%config_hash)
    call file%set('/', 'state', record%state)
    call file%set('/', 'realizations', int(record%realizations, i4))
    call set_text(file, 'namelist', record%case_text)
    call set_text(file, 'resolved_namelist', record%resolved)
    call set_text(file, 'identity', record%identity)
    call file%set('/', 'members', record%members)
  end subroutine write_provenance

  !> An attribute of the root or, where the text is too long for one (64 KiB), a dataset there.
  subroutine set_text(file, name, text)
    type(hdf5_file_t), intent(inout) :: file
    character(len=*), intent(in) :: name, text

    if (len(text) < 60000) then
      call file%set('/', name, text)
    else
      call file%write('/'//name, [text])
    end if
  end subroutine set_text

  !> As attributes of a group.
  subroutine write_geometry(file, group, geometry)
    type(hdf5_file_t), intent(inout) :: file
    character(len=*), intent(in) :: group
    type(case_geometry_t), intent(in) :: geometry

    call file%set(group, 'toe', geometry%toe)
    call file%set(group, 'initial_height', geometry%initial_height)
    call file%set(group, 'initial_width', geometry%initial_width)
    call file%set(group, 'x_min', geometry%x_min)
    call file%set(group, 'x_max', geometry%x_max)
    call file%set(group, 'y_min', geometry%y_min)
    call file%set(group, 'y_max', geometry%y_max)
    call file%set(group, 'cell_size', geometry%cell_size)
    call file%set(group, 'point_spacing', geometry%point_spacing)
  end subroutine write_geometry

  subroutine write_case(file, results, order)
    type(hdf5_file_t), intent(inout) :: file
    type(case_results_t), intent(in) :: results
    integer, intent(in) :: order
    character(len=:), allocatable :: group
    integer, allocatable :: rows(:)
    integer :: i

    group = '/cases/'//results%label
    rows = pack([(i, i=1, size(results%present))], results%present)
    call file%make_group(group)
    call file%set(group, 'label', results%label)
    call file%set(group, 'role', results%role)
    call file%set(group, 'varied', results%varied)
    call file%set(group, 'noise_case', results%noise_case)
    call file%set(group, 'control_of', results%control_of)
    call write_geometry(file, group, results%geometry)
    call file%set(group, 'has_recorded_fields', merge(1_i4, 0_i4, &
      results%geometry%has_recorded_fields))
    call file%set(group, 'acf', results%acf)
    call file%set(group, 'cov', results%cov)
    call file%set(group, 'mean', results%mean)
    call file%set(group, 'distribution', results%distribution)
    call file%set(group, 'scale_x', results%scale_x)
    call file%set(group, 'scale_y', results%scale_y)
    call file%set(group, 'is_homogeneous', merge(1_i4, 0_i4, results%role == 'homogeneous'))
    call file%set(group, 'planned', int(size(results%present), i4))
    call file%set(group, 'stop_rule_met', merge(1_i4, 0_i4, results%stop_rule_met))
    call file%set(group, 'order', int(order, i4))
    call file%write(group//'/id', int(rows, i8), '1')
    call file%write(group//'/status', results%status(rows), '1')
    do i = 1, COLUMN_COUNT
      if (any(i == [FIELD_MEAN, FIELD_MIN, FIELD_MAX]) .and. allocated(results%field_units)) then
        call write_column(file, group, i, results%field_units, results%values(i, rows))
      else
        call write_column(file, group, i, trim(COLUMNS(i)%units), results%values(i, rows))
      end if
    end do
    call file%write(group//'/reason', results%reason(rows), '1')
    call file%make_group(group//'/profile')
    call file%write(group//'/profile/x', results%geometry%profile_x, 'm')
    call file%write(group//'/profile/height', results%height(:, rows), 'm')
  end subroutine write_case

  subroutine write_column(file, group, column, units, values)
    type(hdf5_file_t), intent(inout) :: file
    character(len=*), intent(in) :: group
    integer, intent(in) :: column
    character(len=*), intent(in) :: units
    real(wp), intent(in) :: values(:)
    character(len=:), allocatable :: name

    name = group//'/'//trim(COLUMNS(column)%name)
    if (COLUMNS(column)%is_integer) then
      call file%write(name, nint(values, i8), units)
    else
      call file%write(name, values, units)
    end if
  end subroutine write_column
end module sg_ensemble
