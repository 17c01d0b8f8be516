!> What every method of drawing a Gaussian field has in common.
module sg_gaussian_sampler
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: gaussian_sampler_t

  !> Draws a Gaussian field of mean 0, variance 1 and a given autocorrelation at fixed points. The
  !> field is a function of (seed, stream, realization): nothing changes from one call to the next.
  type, abstract :: gaussian_sampler_t
    !> 'kronecker', 'cholesky' or 'circulant'.
    character(len=:), allocatable :: method
    !> One sentence: what is done, why, and with what concessions.
    character(len=:), allocatable :: description
    !> What had to be added to the diagonal of a correlation matrix to factor it; 0 if nothing.
    real(wp) :: jitter = 0.0_wp
    !> Bytes held between calls and, at most, within one.
    integer(i8) :: memory = 0
  contains
    procedure(sample_interface), deferred :: sample
  end type gaussian_sampler_t

  abstract interface
    subroutine sample_interface(this, seed, stream, realization, z, error)
      import :: gaussian_sampler_t, error_t, i8, wp
      implicit none
      class(gaussian_sampler_t), intent(in) :: this
      integer(i8), intent(in) :: seed
      !> FIELD_STREAM of sg_philox.
      integer, intent(in) :: stream
      integer(i8), intent(in) :: realization
      !> Values at the points, [n], in the order in which the points were given.
      real(wp), intent(out) :: z(:)
      type(error_t), allocatable, intent(out) :: error
    end subroutine sample_interface
  end interface
end module sg_gaussian_sampler
