!> What every method of drawing a Gaussian field has in common.
module sg_gaussian_sampler
  use sg_correlation, only: correlation_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_linear_algebra, only: factor_semidefinite
  implicit none
  private

  public :: gaussian_sampler_t, lower_row

  !> Share of a scale of fluctuation within which a measurement is at a point: rounding of decimals.
  real(wp), parameter :: SAME_PLACE = 1.0e-9_wp

  !> Share of the variance below which what the points leave open at a datum is rounding.
  real(wp), parameter :: NOTHING_LEFT = 1.0e-12_wp

  !> Turns independent standard normal numbers into Gaussian fields of mean 0 and a given
  !> correlation at fixed points, and, where it was told of some, at the places of measurements.
  type, abstract :: gaussian_sampler_t
    type(correlation_t) :: correlation
    !> 'kronecker', 'cholesky' or 'circulant'.
    character(len=:), allocatable :: method
    !> One sentence: what is done, why, and with what concessions.
    character(len=:), allocatable :: description
    !> What had to be added to the diagonals of the correlation matrices to factor them; 0 if
    !> nothing. One for each factor; size 0 where there is none.
    real(wp), allocatable :: jitters(:)
    !> Sites of the rings along x and y of 'circulant'; 0 otherwise.
    integer :: ring(2) = 0
    !> Normal numbers that a field takes.
    integer :: noise_count = 0
    !> Bytes held between calls and, at most, within one.
    integer(i8) :: memory = 0
    !> Factor of what the field at the measurements has beyond what the points determine,
    !> [measurements, rank].
    real(wp), allocatable :: remainder(:, :)
  contains
    procedure(sample_interface), deferred :: sample
    procedure(observe_interface), deferred :: observe
    procedure(observed_interface), deferred :: observed
    procedure(overlap_interface), deferred :: overlap
    procedure :: keep_remainder
    procedure :: jitter
    procedure :: is_at
  end type gaussian_sampler_t

  abstract interface
    !> One field for each column of noise.
    subroutine sample_interface(this, noise, z, error)
      import :: gaussian_sampler_t, error_t, wp
      implicit none
      class(gaussian_sampler_t), intent(in) :: this
      !> Independent standard normal numbers, [noise_count, members]; used up.
      real(wp), contiguous, intent(inout) :: noise(:, :)
      !> Values at the points, [n, members], in the order in which the points were given.
      real(wp), contiguous, intent(out) :: z(:, :)
      type(error_t), allocatable, intent(out) :: error
    end subroutine sample_interface

    !> From now on `observed` gives the field at these places too. A method that knows the field at
    !> its sites only moves them to the nearest.
    subroutine observe_interface(this, x, y)
      import :: gaussian_sampler_t, wp
      implicit none
      class(gaussian_sampler_t), intent(inout) :: this
      !> [measurements], in m.
      real(wp), intent(inout) :: x(:), y(:)
    end subroutine observe_interface

    !> The field at the measurements that belongs to this noise.
    subroutine observed_interface(this, noise, extra, z, error)
      import :: gaussian_sampler_t, error_t, wp
      implicit none
      class(gaussian_sampler_t), intent(in) :: this
      !> Before `sample` uses it up, [noise_count].
      real(wp), contiguous, intent(in) :: noise(:)
      !> More independent standard normal numbers, [measurements].
      real(wp), intent(in) :: extra(:)
      !> [measurements].
      real(wp), intent(out) :: z(:)
      type(error_t), allocatable, intent(out) :: error
    end subroutine observed_interface

    !> Correlation, at the same point, of two fields made of the same noise by two samplers of the
    !> same method at the same points, as the mean over the points: 1 if their correlations are the
    !> same.
    function overlap_interface(this, other) result(rho)
      import :: gaussian_sampler_t, wp
      implicit none
      class(gaussian_sampler_t), intent(in) :: this, other
      real(wp) :: rho
    end function overlap_interface
  end interface

contains

  !> S with S S^T = C_dd - B B^T, `known` being B B^T: what the points leave open at the
  !> measurements. Nothing, for measurements at points.
  subroutine keep_remainder(this, x, y, known)
    class(gaussian_sampler_t), intent(inout) :: this
    !> [measurements], in m.
    real(wp), intent(in) :: x(:), y(:)
    !> [measurements, measurements].
    real(wp), intent(in) :: known(:, :)
    real(wp) :: left(size(x), size(x))
    integer :: i, j

    do j = 1, size(x)
      do i = 1, size(x)
        left(i, j) = this%correlation%at(x(i) - x(j), y(i) - y(j)) - known(i, j)
      end do
    end do
    call factor_semidefinite(left, max(NOTHING_LEFT, 10.0_wp*this%jitter()) &
      *this%correlation%variance(), this%remainder)
  end subroutine keep_remainder

  !> Whether a distance along an axis, in m, is none.
  pure logical function is_at(this, axis, distance)
    class(gaussian_sampler_t), intent(in) :: this
    integer, intent(in) :: axis
    real(wp), intent(in) :: distance

    is_at = abs(distance) <= SAME_PLACE*this%correlation%scale(axis)
  end function is_at

  !> Row i of a lower triangular matrix [n, n].
  pure function lower_row(factor, i) result(row)
    real(wp), intent(in) :: factor(:, :)
    integer, intent(in) :: i
    real(wp) :: row(size(factor, 1))

    row = 0.0_wp
    row(:i) = factor(i, :i)
  end function lower_row

  !> The largest of the jitters.
  pure real(wp) function jitter(this)
    class(gaussian_sampler_t), intent(in) :: this

    jitter = 0.0_wp
    if (size(this%jitters) > 0) jitter = maxval(this%jitters)
  end function jitter
end module sg_gaussian_sampler
