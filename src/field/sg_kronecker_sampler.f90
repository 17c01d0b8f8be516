!> Fields on a tensor grid from two small Cholesky factors. The correlation is a product of a
!> function of x and one of y, so C = C_y (x) C_x, its factor is L_y (x) L_x, and a field is
!> X = L_x Xi L_y^T with Xi [nx, ny] of white noise: the same as with the full factor.
module sg_kronecker_sampler
  use sg_autocorrelation, only: autocorrelation_t
  use sg_correlation_factor, only: factor_correlation, text_of_jitter
  use sg_errors, only: error_t
  use sg_gaussian_sampler, only: gaussian_sampler_t
  use sg_kinds, only: i8, wp
  use sg_lattice, only: lattice_t
  use sg_linear_algebra, only: multiply_from_left, multiply_from_right_transposed
  use sg_text, only: to_text
  use sg_white_noise, only: fill_white_noise
  implicit none
  private

  public :: kronecker_sampler_t, kronecker_memory

  type, extends(gaussian_sampler_t) :: kronecker_sampler_t
    private
    !> [nx, nx] and [ny, ny], lower triangles.
    real(wp), allocatable :: factor_x(:, :), factor_y(:, :)
    !> Column and row of each point, [n].
    integer, allocatable :: column(:), row(:)
  contains
    procedure :: init
    procedure :: sample
  end type kronecker_sampler_t

contains

  subroutine init(this, acf, scale_x, scale_y, lattice, error)
    class(kronecker_sampler_t), intent(out) :: this
    type(autocorrelation_t), intent(in) :: acf
    !> Scales of fluctuation in m.
    real(wp), intent(in) :: scale_x, scale_y
    type(lattice_t), intent(in) :: lattice
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: jitter_x, jitter_y

    allocate (this%factor_x(size(lattice%x), size(lattice%x)))
    allocate (this%factor_y(size(lattice%y), size(lattice%y)))
    call acf%fill_matrix(lattice%x, scale_x, this%factor_x)
    call factor_correlation(this%factor_x, jitter_x, error)
    if (allocated(error)) return
    call acf%fill_matrix(lattice%y, scale_y, this%factor_y)
    call factor_correlation(this%factor_y, jitter_y, error)
    if (allocated(error)) return
    this%column = lattice%column
    this%row = lattice%row
    this%jitter = max(jitter_x, jitter_y)
    this%memory = kronecker_memory(lattice)
    this%method = 'kronecker'
    this%description = 'kronecker: two Cholesky factors of '//to_text(size(lattice%x))//' x '// &
      to_text(size(lattice%x))//' and '//to_text(size(lattice%y))//' x '// &
      to_text(size(lattice%y))//text_of_jitter(this%jitter)
  end subroutine init

  !> Bytes: two factors, the noise of every site, the site of each point.
  pure function kronecker_memory(lattice) result(bytes)
    type(lattice_t), intent(in) :: lattice
    integer(i8) :: bytes, nx, ny

    nx = size(lattice%x)
    ny = size(lattice%y)
    bytes = 8*(nx**2 + ny**2 + nx*ny) + 8*size(lattice%column, kind=i8)
  end function kronecker_memory

  subroutine sample(this, seed, stream, realization, z, error)
    class(kronecker_sampler_t), intent(in) :: this
    integer(i8), intent(in) :: seed
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    real(wp), intent(out) :: z(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: field(:, :)
    integer :: i

    allocate (field(size(this%factor_x, 1), size(this%factor_y, 1)))
    call fill_white_noise(seed, stream, realization, field)
    call multiply_from_left(this%factor_x, field)
    call multiply_from_right_transposed(this%factor_y, field)
    do i = 1, size(z)
      z(i) = field(this%column(i), this%row(i))
    end do
  end subroutine sample
end module sg_kronecker_sampler
