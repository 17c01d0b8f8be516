!> Fields at any points from the Cholesky factor of the full correlation matrix, as in the paper:
!> z = L xi. Points on a lattice are taken in lattice order, x fastest, so that on a full rectangle
!> the field is that of the Kronecker method.
module sg_cholesky_sampler
  use sg_autocorrelation, only: autocorrelation_t
  use sg_correlation_factor, only: factor_correlation, text_of_jitter
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_gaussian_sampler, only: gaussian_sampler_t
  use sg_kinds, only: i8, wp
  use sg_lattice, only: lattice_t
  use sg_linear_algebra, only: multiply_vector
  use sg_text, only: to_text
  use sg_white_noise, only: fill_white_noise
  implicit none
  private

  public :: cholesky_sampler_t, cholesky_memory

  type, extends(gaussian_sampler_t) :: cholesky_sampler_t
    private
    !> [n, n], lower triangle.
    real(wp), allocatable :: factor(:, :)
    !> Point of each row of the factor.
    integer, allocatable :: order(:)
  contains
    procedure :: init
    procedure :: sample
  end type cholesky_sampler_t

contains

  subroutine init(this, acf, scales, x, y, lattice, error)
    class(cholesky_sampler_t), intent(out) :: this
    type(autocorrelation_t), intent(in) :: acf
    !> Scales of fluctuation along x and y, in m.
    real(wp), intent(in) :: scales(2)
    !> Points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    type(lattice_t), intent(in) :: lattice
    type(error_t), allocatable, intent(out) :: error
    integer :: i, status

    allocate (this%factor(size(x), size(x)), stat=status)
    if (status /= 0) then
      call raise(error, EXIT_BAD_INPUT, 'no memory for the correlation matrix of '// &
        to_text(size(x))//" points: use method='kronecker'", 'cholesky_sampler')
      return
    end if
    if (lattice%is_lattice) then
      allocate (this%order(size(x)))
      call lattice%find_order(this%order)
      call fill_on_lattice(acf, scales, lattice, this%order, this%factor)
    else
      this%order = [(i, i=1, size(x))]
      call fill_anywhere(acf, scales, x, y, this%factor)
    end if
    call factor_correlation(this%factor, this%jitter, error)
    if (allocated(error)) return
    this%memory = cholesky_memory(size(x))
    this%method = 'cholesky'
    this%description = 'cholesky: factor of the full matrix of '//to_text(size(x))//' points'// &
      text_of_jitter(this%jitter)
  end subroutine init

  !> Bytes: the full matrix, and what is small beside it.
  pure function cholesky_memory(n) result(bytes)
    integer, intent(in) :: n
    integer(i8) :: bytes

    bytes = 8*int(n, i8)**2 + 12*int(n, i8)
  end function cholesky_memory

  !> Correlation matrix [n, n] of the points in lattice order, out of the two one-dimensional ones.
  subroutine fill_on_lattice(acf, scales, lattice, order, matrix)
    type(autocorrelation_t), intent(in) :: acf
    real(wp), intent(in) :: scales(2)
    type(lattice_t), intent(in) :: lattice
    integer, intent(in) :: order(:)
    real(wp), intent(out) :: matrix(:, :)
    real(wp), allocatable :: matrix_x(:, :), matrix_y(:, :)
    integer :: i, j, column, row

    allocate (matrix_x(size(lattice%x), size(lattice%x)))
    allocate (matrix_y(size(lattice%y), size(lattice%y)))
    call acf%fill_matrix(lattice%x, scales(1), matrix_x)
    call acf%fill_matrix(lattice%y, scales(2), matrix_y)
    do j = 1, size(order)
      column = lattice%column(order(j))
      row = lattice%row(order(j))
      do i = 1, size(order)
        matrix(i, j) = matrix_x(lattice%column(order(i)), column) &
          *matrix_y(lattice%row(order(i)), row)
      end do
    end do
  end subroutine fill_on_lattice

  !> Correlation matrix [n, n] of the points as they come.
  subroutine fill_anywhere(acf, scales, x, y, matrix)
    type(autocorrelation_t), intent(in) :: acf
    real(wp), intent(in) :: scales(2), x(:), y(:)
    real(wp), intent(out) :: matrix(:, :)
    integer :: i, j

    do j = 1, size(x)
      matrix(j, j) = 1.0_wp
      do i = j + 1, size(x)
        matrix(i, j) = acf%rho(abs(x(i) - x(j))/scales(1))*acf%rho(abs(y(i) - y(j))/scales(2))
        matrix(j, i) = matrix(i, j)
      end do
    end do
  end subroutine fill_anywhere

  subroutine sample(this, seed, stream, realization, z, error)
    class(cholesky_sampler_t), intent(in) :: this
    integer(i8), intent(in) :: seed
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    real(wp), intent(out) :: z(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: field(:, :)

    allocate (field(size(this%order), 1))
    call fill_white_noise(seed, stream, realization, field)
    call multiply_vector(this%factor, field(:, 1))
    z(this%order) = field(:, 1)
  end subroutine sample
end module sg_cholesky_sampler
