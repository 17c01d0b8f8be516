!> Measured values of a property, and fields that agree with them: conditional simulation by kriging
!> the residual of an unconditional field, in Gaussian space (Journel & Huijbregts 1978):
!>
!>   z_c(x) = z(x) + sum_d R c(x - x_d) w_d,   G w = z_d - z(x_d) - e_d,
!>   G = R c(x_d - x_e) + diag(error^2),
!>
!> with c the correlation of the fields and R that between the field and the one of the datum. Exact
!> at data without error.
module sg_measurements
  use sg_correlation, only: correlation_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: wp
  use sg_linear_algebra, only: factor_cholesky, solve_factored
  use sg_number_table, only: number_table_t, read_number_table
  implicit none
  private

  public :: measurements_t, kriging_t

  !> Data of all fields of an ensemble.
  type :: measurements_t
    !> Files they came from, one for each field that has any, and for each datum which and its row.
    type(number_table_t), allocatable :: tables(:)
    integer, allocatable :: table(:), row(:)
    !> Field that was measured.
    integer, allocatable :: field(:)
    !> Place in m, value and standard deviation of its error in the unit of the property.
    real(wp), allocatable :: x(:), y(:), value(:), error(:)
    !> y of the file: the place may be moved to a site of the field, the law of the value stays.
    real(wp), allocatable :: height(:)
    !> Standard normal value, and the deviation of the error there.
    real(wp), allocatable :: z(:), z_error(:)
  contains
    procedure :: init
    procedure :: add
    procedure :: refuse
    procedure :: of_field
  end type measurements_t

  !> The factor of G.
  type :: kriging_t
    real(wp), allocatable :: factor(:, :)
  contains
    procedure :: prepare
    procedure :: weights
  end type kriging_t

contains

  !> None yet.
  subroutine init(this)
    class(measurements_t), intent(out) :: this

    allocate (this%tables(0), this%table(0), this%row(0), this%field(0))
    allocate (this%x(0), this%y(0), this%value(0), this%error(0), this%z(0), this%z_error(0))
    allocate (this%height(0))
  end subroutine init

  !> Those of a CSV file with the first line x,y,value,error. What is wrong is told with file and
  !> line.
  subroutine add(this, path, field, error)
    class(measurements_t), intent(inout) :: this
    character(len=*), intent(in) :: path
    integer, intent(in) :: field
    type(error_t), allocatable, intent(out) :: error
    type(number_table_t) :: table
    integer :: i, n

    call read_number_table(path, ['x,y,value,error'], table, error)
    if (allocated(error)) return
    n = size(table%line)
    if (n == 0) call raise(error, EXIT_BAD_INPUT, path//': there are no measurements', 'add')
    do i = 1, n
      if (table%values(4, i) < 0.0_wp) call raise(error, EXIT_BAD_INPUT, table%fault(i, &
        'the standard deviation of an error is 0 or more'), 'add')
    end do
    if (allocated(error)) return
    this%tables = [this%tables, table]
    this%table = [this%table, spread(size(this%tables), 1, n)]
    this%row = [this%row, (i, i=1, n)]
    this%field = [this%field, spread(field, 1, n)]
    this%x = [this%x, table%values(1, :)]
    this%y = [this%y, table%values(2, :)]
    this%height = [this%height, table%values(2, :)]
    this%value = [this%value, table%values(3, :)]
    this%error = [this%error, table%values(4, :)]
    this%z = [this%z, spread(0.0_wp, 1, n)]
    this%z_error = [this%z_error, spread(0.0_wp, 1, n)]
  end subroutine add

  !> Those of one field as they were read: x, y, value, error; [4, measurements].
  pure function of_field(this, field) result(values)
    class(measurements_t), intent(in) :: this
    integer, intent(in) :: field
    real(wp), allocatable :: values(:, :)
    integer :: d

    allocate (values(4, 0))
    do d = 1, size(this%tables)
      if (any(this%table == d .and. this%field == field)) values = this%tables(d)%values
    end do
  end function of_field

  !> Adds what is wrong with a datum to `error`, one line for each.
  subroutine refuse(this, datum, what, error)
    class(measurements_t), intent(in) :: this
    integer, intent(in) :: datum
    character(len=*), intent(in) :: what
    type(error_t), allocatable, intent(inout) :: error
    character(len=:), allocatable :: message

    message = this%tables(this%table(datum))%fault(this%row(datum), what)
    if (allocated(error)) then
      error%message = error%message//new_line('a')//message
    else
      call raise(error, EXIT_BAD_INPUT, message, 'measurements')
    end if
  end subroutine refuse

  !> Factors G for the data as they are. Two exact data at the same place, for instance, make it
  !> singular: refused as bad input, with the datum that adds nothing to those before it.
  subroutine prepare(this, data, correlations, between, error)
    class(kriging_t), intent(inout) :: this
    type(measurements_t), intent(in) :: data
    !> Of each field, and between the fields: [fields], [fields, fields].
    type(correlation_t), intent(in) :: correlations(:)
    real(wp), intent(in) :: between(:, :)
    type(error_t), allocatable, intent(out) :: error
    integer :: d, e, failed_row

    if (allocated(this%factor)) deallocate (this%factor)
    allocate (this%factor(size(data%x), size(data%x)))
    do e = 1, size(data%x)
      do d = 1, size(data%x)
        this%factor(d, e) = between(data%field(d), data%field(e))
        if (abs(this%factor(d, e)) > 0.0_wp) this%factor(d, e) = this%factor(d, e) &
          *correlations(data%field(d))%at(data%x(d) - data%x(e), data%y(d) - data%y(e))
      end do
      this%factor(e, e) = this%factor(e, e) + data%z_error(e)**2
    end do
    call factor_cholesky(this%factor, failed_row)
    if (failed_row > 0) call data%refuse(failed_row, 'this measurement is determined by those '// &
      'before it: at the same place, or too near for so smooth a field (allowed: an error '// &
      'above 0, or fewer measurements)', error)
  end subroutine prepare

  !> w of the residuals z_d - z(x_d) - e_d.
  subroutine weights(this, residuals)
    class(kriging_t), intent(in) :: this
    !> Residuals in, weights out.
    real(wp), contiguous, intent(inout) :: residuals(:)

    call solve_factored(this%factor, residuals)
  end subroutine weights
end module sg_measurements
