!> Fields on a tensor grid from two small Cholesky factors. The correlation is a product of a
!> function of x and one of y, so C = C_y (x) C_x, its factor is L_y (x) L_x, and a field is
!> X = L_x Xi L_y^T with Xi [nx, ny] of white noise: the same as with the full factor.
module sg_kronecker_sampler
  use sg_correlation, only: correlation_t
  use sg_correlation_factor, only: factor_correlation, text_of_jitter
  use sg_errors, only: error_t
  use sg_gaussian_sampler, only: gaussian_sampler_t, lower_row
  use sg_kinds, only: i8, wp
  use sg_lattice, only: lattice_t
  use sg_linear_algebra, only: multiply_from_left, multiply_from_right_transposed, solve_lower
  use sg_text, only: to_text
  implicit none
  private

  public :: kronecker_sampler_t, kronecker_memory

  type, extends(gaussian_sampler_t) :: kronecker_sampler_t
    private
    !> Coordinates of columns and rows, in m.
    real(wp), allocatable :: x(:), y(:)
    !> [nx, nx] and [ny, ny], lower triangles.
    real(wp), allocatable :: factor_x(:, :), factor_y(:, :)
    !> Column and row of each point, [n].
    integer, allocatable :: column(:), row(:)
    !> The field at measurement d is along_x(:, d)^T Xi along_y(:, d) and the remainder: [nx,
    !> measurements], [ny, measurements].
    real(wp), allocatable :: along_x(:, :), along_y(:, :)
  contains
    procedure :: init
    procedure :: sample
    procedure :: observe
    procedure :: observed
    procedure :: overlap
  end type kronecker_sampler_t

contains

  !> `correlation` must be a product.
  subroutine init(this, correlation, lattice, error)
    class(kronecker_sampler_t), intent(out) :: this
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    type(error_t), allocatable, intent(out) :: error

    this%correlation = correlation
    this%x = lattice%x
    this%y = lattice%y
    allocate (this%factor_x(size(lattice%x), size(lattice%x)), this%jitters(2))
    allocate (this%factor_y(size(lattice%y), size(lattice%y)))
    call correlation%fill_axis(1, lattice%x, this%factor_x)
    call factor_correlation(this%factor_x, this%jitters(1), error)
    if (allocated(error)) return
    call correlation%fill_axis(2, lattice%y, this%factor_y)
    call factor_correlation(this%factor_y, this%jitters(2), error)
    if (allocated(error)) return
    this%column = lattice%column
    this%row = lattice%row
    this%noise_count = size(lattice%x)*size(lattice%y)
    this%memory = kronecker_memory(lattice)
    this%method = 'kronecker'
    this%description = 'kronecker: two Cholesky factors of '//to_text(size(lattice%x))//' x '// &
      to_text(size(lattice%x))//' and '//to_text(size(lattice%y))//' x '// &
      to_text(size(lattice%y))//text_of_jitter(this%jitter())
  end subroutine init

  !> Bytes: two factors, the noise of every site, the site of each point.
  pure function kronecker_memory(lattice) result(bytes)
    type(lattice_t), intent(in) :: lattice
    integer(i8) :: bytes, nx, ny

    nx = size(lattice%x)
    ny = size(lattice%y)
    bytes = 8*(nx**2 + ny**2 + nx*ny) + 8*size(lattice%column, kind=i8)
  end function kronecker_memory

  subroutine sample(this, noise, z, error)
    class(kronecker_sampler_t), intent(in) :: this
    real(wp), contiguous, intent(inout) :: noise(:, :)
    real(wp), contiguous, intent(out) :: z(:, :)
    type(error_t), allocatable, intent(out) :: error
    integer :: member

    do member = 1, size(z, 2)
      call sample_one(this, size(this%x), size(this%y), noise(:, member), z(:, member))
    end do
  end subroutine sample

  subroutine sample_one(this, nx, ny, field, z)
    class(kronecker_sampler_t), intent(in) :: this
    integer, intent(in) :: nx, ny
    real(wp), intent(inout) :: field(nx, ny)
    real(wp), intent(out) :: z(:)
    integer :: i

    call multiply_from_left(this%factor_x, field)
    call multiply_from_right_transposed(this%factor_y, field)
    do i = 1, size(z)
      z(i) = field(this%column(i), this%row(i))
    end do
  end subroutine sample_one

  !> The factor of points and measurements together is [L 0; B S] with B = C_dp L^-T, whose rows
  !> are Kronecker products, too.
  subroutine observe(this, x, y)
    class(kronecker_sampler_t), intent(inout) :: this
    real(wp), intent(inout) :: x(:), y(:)
    integer :: d, i

    allocate (this%along_x(size(this%x), size(x)), this%along_y(size(this%y), size(x)))
    do d = 1, size(x)
      this%along_x(:, d) = [(this%correlation%along(1, x(d) - this%x(i)), i=1, size(this%x))]
      this%along_y(:, d) = [(this%correlation%along(2, y(d) - this%y(i)), i=1, size(this%y))]
    end do
    call solve_lower(this%factor_x, this%along_x)
    call solve_lower(this%factor_y, this%along_y)
    ! On a line of points the factor has the row already, with the jitter that solving would
    ! amplify.
    do d = 1, size(x)
      i = minloc(abs(this%x - x(d)), dim=1)
      if (this%is_at(1, this%x(i) - x(d))) this%along_x(:, d) = lower_row(this%factor_x, i)
      i = minloc(abs(this%y - y(d)), dim=1)
      if (this%is_at(2, this%y(i) - y(d))) this%along_y(:, d) = lower_row(this%factor_y, i)
    end do
    call this%keep_remainder(x, y, matmul(transpose(this%along_x), this%along_x) &
      *matmul(transpose(this%along_y), this%along_y))
  end subroutine observe

  subroutine observed(this, noise, extra, z, error)
    class(kronecker_sampler_t), intent(in) :: this
    real(wp), contiguous, intent(in) :: noise(:)
    real(wp), intent(in) :: extra(:)
    real(wp), intent(out) :: z(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: d, j, nx

    nx = size(this%x)
    z = matmul(this%remainder, extra(:size(this%remainder, 2)))
    do d = 1, size(z)
      do j = 1, size(this%y)
        z(d) = z(d) + this%along_y(j, d)*dot_product(this%along_x(:, d), &
          noise((j - 1)*nx + 1:j*nx))
      end do
    end do
  end subroutine observed

  function overlap(this, other) result(rho)
    class(kronecker_sampler_t), intent(in) :: this
    class(gaussian_sampler_t), intent(in) :: other
    real(wp) :: rho
    integer :: i

    rho = 0.0_wp
    select type (other)
    class is (kronecker_sampler_t)
      rho = sum([(dot_product(this%factor_x(i, :i), other%factor_x(i, :i)), i=1, size(this%x))]) &
        *sum([(dot_product(this%factor_y(i, :i), other%factor_y(i, :i)), i=1, size(this%y))]) &
        /this%noise_count
    end select
  end function overlap
end module sg_kronecker_sampler
