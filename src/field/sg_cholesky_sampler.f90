!> Fields at any points from the Cholesky factor of the full correlation matrix, as in the paper:
!> z = L xi. Points on a lattice are taken in lattice order, x fastest, so that on a full rectangle
!> the field is that of the Kronecker method.
module sg_cholesky_sampler
  use sg_correlation, only: correlation_t
  use sg_correlation_factor, only: factor_correlation, text_of_jitter
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_gaussian_sampler, only: gaussian_sampler_t, lower_row
  use sg_kinds, only: i8, wp
  use sg_lattice, only: lattice_t
  use sg_linear_algebra, only: multiply_from_left, multiply_vector, solve_lower
  use sg_text, only: to_text
  implicit none
  private

  public :: cholesky_sampler_t, cholesky_memory

  type, extends(gaussian_sampler_t) :: cholesky_sampler_t
    private
    !> [n, n], lower triangle.
    real(wp), allocatable :: factor(:, :)
    !> Point of each row of the factor.
    integer, allocatable :: order(:)
    !> Places of the rows, [n], in m.
    real(wp), allocatable :: x(:), y(:)
    !> The field at measurement d is weights(:, d)^T xi and the remainder, [n, measurements].
    real(wp), allocatable :: weights(:, :)
  contains
    procedure :: init
    procedure :: sample
    procedure :: observe
    procedure :: observed
    procedure :: overlap
  end type cholesky_sampler_t

contains

  subroutine init(this, correlation, x, y, lattice, error)
    class(cholesky_sampler_t), intent(out) :: this
    type(correlation_t), intent(in) :: correlation
    !> Points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    type(lattice_t), intent(in) :: lattice
    type(error_t), allocatable, intent(out) :: error
    integer :: i, status

    this%correlation = correlation
    allocate (this%jitters(1))
    allocate (this%factor(size(x), size(x)), stat=status)
    if (status /= 0) then
      call raise(error, EXIT_BAD_INPUT, 'no memory for the correlation matrix of '// &
        to_text(size(x))//" points: use method='kronecker'", 'cholesky_sampler')
      return
    end if
    if (lattice%is_lattice) then
      allocate (this%order(size(x)))
      call lattice%find_order(this%order)
    else
      this%order = [(i, i=1, size(x))]
    end if
    this%x = x(this%order)
    this%y = y(this%order)
    if (lattice%is_lattice .and. correlation%is_product()) then
      call fill_on_lattice(correlation, lattice, this%order, this%factor)
    else
      call fill_anywhere(correlation, this%x, this%y, this%factor)
    end if
    call factor_correlation(this%factor, this%jitters(1), error)
    if (allocated(error)) return
    this%noise_count = size(x)
    this%memory = cholesky_memory(size(x))
    this%method = 'cholesky'
    this%description = 'cholesky: factor of the full matrix of '//to_text(size(x))//' points'// &
      text_of_jitter(this%jitter())
  end subroutine init

  !> Bytes: the full matrix, and what is small beside it.
  pure function cholesky_memory(n) result(bytes)
    integer, intent(in) :: n
    integer(i8) :: bytes

    bytes = 8*int(n, i8)**2 + 28*int(n, i8)
  end function cholesky_memory

  !> Correlation matrix [n, n] of the points in lattice order, out of the two one-dimensional ones.
  subroutine fill_on_lattice(correlation, lattice, order, matrix)
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    integer, intent(in) :: order(:)
    real(wp), intent(out) :: matrix(:, :)
    real(wp), allocatable :: matrix_x(:, :), matrix_y(:, :)
    integer :: i, j, column, row

    allocate (matrix_x(size(lattice%x), size(lattice%x)))
    allocate (matrix_y(size(lattice%y), size(lattice%y)))
    call correlation%fill_axis(1, lattice%x, matrix_x)
    call correlation%fill_axis(2, lattice%y, matrix_y)
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
  subroutine fill_anywhere(correlation, x, y, matrix)
    type(correlation_t), intent(in) :: correlation
    real(wp), intent(in) :: x(:), y(:)
    real(wp), intent(out) :: matrix(:, :)
    integer :: i, j

    do j = 1, size(x)
      do i = j, size(x)
        matrix(i, j) = correlation%at(x(i) - x(j), y(i) - y(j))
        matrix(j, i) = matrix(i, j)
      end do
    end do
  end subroutine fill_anywhere

  subroutine sample(this, noise, z, error)
    class(cholesky_sampler_t), intent(in) :: this
    real(wp), contiguous, intent(inout) :: noise(:, :)
    real(wp), contiguous, intent(out) :: z(:, :)
    type(error_t), allocatable, intent(out) :: error

    if (size(noise, 2) == 1) then
      call multiply_vector(this%factor, noise(:, 1))
    else
      call multiply_from_left(this%factor, noise)
    end if
    z(this%order, :) = noise
  end subroutine sample

  !> The factor of points and measurements together is [L 0; B S] with B = C_dp L^-T.
  subroutine observe(this, x, y)
    class(cholesky_sampler_t), intent(inout) :: this
    real(wp), intent(inout) :: x(:), y(:)
    integer :: d, i

    allocate (this%weights(size(this%x), size(x)))
    do d = 1, size(x)
      this%weights(:, d) = [(this%correlation%at(x(d) - this%x(i), y(d) - this%y(i)), i=1, &
        size(this%x))]
    end do
    call solve_lower(this%factor, this%weights)
    ! At a point the factor has the row already, with the jitter that solving would amplify.
    do d = 1, size(x)
      i = minloc((this%x - x(d))**2 + (this%y - y(d))**2, dim=1)
      if (.not. this%is_at(1, this%x(i) - x(d)) .or. .not. this%is_at(2, this%y(i) - y(d))) cycle
      this%weights(:, d) = lower_row(this%factor, i)
    end do
    call this%keep_remainder(x, y, matmul(transpose(this%weights), this%weights))
  end subroutine observe

  subroutine observed(this, noise, extra, z, error)
    class(cholesky_sampler_t), intent(in) :: this
    real(wp), contiguous, intent(in) :: noise(:)
    real(wp), intent(in) :: extra(:)
    real(wp), intent(out) :: z(:)
    type(error_t), allocatable, intent(out) :: error

    z = matmul(noise, this%weights) + matmul(this%remainder, extra(:size(this%remainder, 2)))
  end subroutine observed

  function overlap(this, other) result(rho)
    class(cholesky_sampler_t), intent(in) :: this
    class(gaussian_sampler_t), intent(in) :: other
    real(wp) :: rho
    integer :: i

    rho = 0.0_wp
    select type (other)
    class is (cholesky_sampler_t)
      rho = sum([(dot_product(this%factor(i, :i), other%factor(i, :i)), i=1, size(this%x))]) &
        /size(this%x)
    end select
  end function overlap
end module sg_cholesky_sampler
