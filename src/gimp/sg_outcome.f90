!> What is kept of one member: a row of numbers, the final profile and, if it failed, where and why.
!> The columns are a table, so that journal, results file and log need not know what they mean.
module sg_outcome
  use sg_kinds, only: i8, sp, wp
  implicit none
  private

  public :: outcome_t, column_t, COLUMNS, COLUMN_COUNT, reset_outcome
  public :: status_text
  public :: STATUS_OK, STATUS_NOT_FINITE, STATUS_POINT_LOST, STATUS_STEP_COLLAPSE, STATUS_TIME_LIMIT
  public :: STATUS_RUNAWAY, STATUS_FIELD_FAILED, STATUS_ENERGY_CREATED, STATUS_EXTREME_STRAIN
  public :: STATUS_ABANDONED
  public :: RUNOUT_MAX, RUNOUT_Q99, RUNOUT_Q995, RUNOUT_CONNECTED, HEIGHT_MAX, HEIGHT_WALL
  public :: SETTLE_TIME, SETTLED, KINETIC_ENERGY_END, KINETIC_ENERGY_RATIO, WALL_TOUCHED
  public :: ENERGY_ERROR, MASS_ERROR
  public :: FIELD_MEAN, FIELD_MIN, FIELD_MAX, FIELD_CLIPPED, STEPS, SECONDS
  public :: FAILURE_STEP, FAILURE_POINT, FAILURE_X, FAILURE_Y, LOG_WEIGHT

  integer, parameter :: STATUS_OK = 0
  !> Asked to stop before it ended: computed again later, never recorded.
  integer, parameter :: STATUS_ABANDONED = -1
  integer, parameter :: STATUS_NOT_FINITE = 1
  integer, parameter :: STATUS_POINT_LOST = 2
  integer, parameter :: STATUS_STEP_COLLAPSE = 3
  integer, parameter :: STATUS_TIME_LIMIT = 4
  integer, parameter :: STATUS_RUNAWAY = 5
  integer, parameter :: STATUS_FIELD_FAILED = 6
  integer, parameter :: STATUS_ENERGY_CREATED = 7
  integer, parameter :: STATUS_EXTREME_STRAIN = 8

  !> Positions in `outcome_t%values`, in the order of COLUMNS.
  integer, parameter :: RUNOUT_MAX = 1, RUNOUT_Q99 = 2, RUNOUT_Q995 = 3, RUNOUT_CONNECTED = 4
  integer, parameter :: HEIGHT_MAX = 5, HEIGHT_WALL = 6, SETTLE_TIME = 7, SETTLED = 8
  integer, parameter :: KINETIC_ENERGY_END = 9, KINETIC_ENERGY_RATIO = 10, WALL_TOUCHED = 11
  integer, parameter :: ENERGY_ERROR = 12, MASS_ERROR = 13
  integer, parameter :: FIELD_MEAN = 14, FIELD_MIN = 15, FIELD_MAX = 16, FIELD_CLIPPED = 17
  integer, parameter :: STEPS = 18, SECONDS = 19
  integer, parameter :: FAILURE_STEP = 20, FAILURE_POINT = 21, FAILURE_X = 22, FAILURE_Y = 23
  !> Of importance sampling: ln of the likelihood ratio; 0 for members that all count the same.
  integer, parameter :: LOG_WEIGHT = 24
  integer, parameter :: COLUMN_COUNT = 24

  type :: column_t
    character(len=24) :: name
    !> SI unit, `1` for a pure number.
    character(len=8) :: units
    !> Written as integers (flags and counts).
    logical :: is_integer
  end type column_t

  type(column_t), parameter :: COLUMNS(COLUMN_COUNT) = [ &
    column_t('runout_max', 'm', .false.), &
    column_t('runout_q99', 'm', .false.), &
    column_t('runout_q995', 'm', .false.), &
    column_t('runout_connected', 'm', .false.), &
    column_t('height_max', 'm', .false.), &
    column_t('height_wall', 'm', .false.), &
    column_t('settle_time', 's', .false.), &
    column_t('settled', '1', .true.), &
    column_t('kinetic_energy_end', 'J/m', .false.), &
    column_t('kinetic_energy_ratio', '1', .false.), &
    column_t('wall_touched', '1', .true.), &
    column_t('energy_error', '1', .false.), &
    column_t('mass_error', '1', .false.), &
    column_t('field_mean', 'degree', .false.), &
    column_t('field_min', 'degree', .false.), &
    column_t('field_max', 'degree', .false.), &
    column_t('field_clipped', '1', .false.), &
    column_t('steps', '1', .true.), &
    column_t('seconds', 's', .false.), &
    column_t('failure_step', '1', .true.), &
    column_t('failure_point', '1', .true.), &
    column_t('failure_x', 'm', .false.), &
    column_t('failure_y', 'm', .false.), &
    column_t('log_weight', '1', .false.)]

  !> One member. A failed one keeps what is known of it; what is not known is NaN (integers: -1).
  type :: outcome_t
    !> Position of the study case in the plan, from 1.
    integer :: case_index = 0
    !> Realization, from 1.
    integer(i8) :: id = 0
    integer :: status = STATUS_OK
    real(wp) :: values(COLUMN_COUNT) = 0.0_wp
    !> Depth of the final deposit in every column of cells, in m; the plan fixes its length.
    real(sp), allocatable :: height(:)
    !> Empty unless the member failed; one line.
    character(len=:), allocatable :: reason
  end type outcome_t

contains

  !> A row of which nothing is known yet: NaN (integers -1), and `columns` NaN in the profile.
  pure subroutine reset_outcome(outcome, case_index, id, profile_columns)
    use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
    type(outcome_t), intent(out) :: outcome
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    integer, intent(in) :: profile_columns

    outcome%case_index = case_index
    outcome%id = id
    outcome%values = ieee_value(1.0_wp, ieee_quiet_nan)
    where (COLUMNS%is_integer) outcome%values = -1.0_wp
    allocate (outcome%height(profile_columns))
    outcome%height = ieee_value(1.0_sp, ieee_quiet_nan)
    outcome%reason = ''
  end subroutine reset_outcome

  !> Short name of a status code, as in logs and reports.
  pure function status_text(status) result(text)
    integer, intent(in) :: status
    character(len=:), allocatable :: text

    select case (status)
    case (STATUS_OK)
      text = 'ok'
    case (STATUS_NOT_FINITE)
      text = 'not finite'
    case (STATUS_POINT_LOST)
      text = 'point lost'
    case (STATUS_STEP_COLLAPSE)
      text = 'time step collapsed'
    case (STATUS_TIME_LIMIT)
      text = 'time limit'
    case (STATUS_RUNAWAY)
      text = 'runaway speed'
    case (STATUS_FIELD_FAILED)
      text = 'field failed'
    case (STATUS_ENERGY_CREATED)
      text = 'energy created'
    case (STATUS_EXTREME_STRAIN)
      text = 'extreme strain'
    case default
      text = 'unknown'
    end select
  end function status_text
end module sg_outcome
