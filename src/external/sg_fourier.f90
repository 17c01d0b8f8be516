!> Fourier transforms of FFTW.
module sg_fourier
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_double_complex, &
    c_float, c_float_complex, c_funptr, c_int, c_int32_t, c_intptr_t, c_null_ptr, c_ptr, c_size_t
  use sg_errors, only: error_t, raise, EXIT_INTERNAL
  use sg_kinds, only: wp
  implicit none
  private

  public :: hartley_transform_t

  include 'fftw3.f03'

  !> Plan of a two-dimensional discrete Hartley transform, the Fourier transform of real arrays
  !> with cas = cos + sin in place of the complex exponential, one axis after the other:
  !>
  !>   out(k, l) = sum_i sum_j in(i, j) cas(2 pi i k/m) cas(2 pi j l/n).
  !>
  !> It is its own inverse up to the factor m n, and its columns are eigenvectors of every
  !> symmetric circulant matrix: the transform of such a matrix' first row is its spectrum.
  !> A plan belongs to one variable: do not assign one to another.
  type :: hartley_transform_t
    private
    type(c_ptr) :: plan = c_null_ptr
    integer :: m = 0, n = 0
  contains
    procedure :: init => init_hartley
    procedure :: execute => execute_hartley
    procedure :: free => free_hartley
    final :: finalize_hartley
  end type hartley_transform_t

contains

  !> Plan for arrays [m, n]. The plan is estimated, never measured, and assumes no alignment, so
  !> that every run and every array gives the same rounding.
  subroutine init_hartley(this, m, n, error)
    class(hartley_transform_t), intent(inout) :: this
    integer, intent(in) :: m, n
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: input(:, :), output(:, :)

    call this%free()
    allocate (input(m, n), output(m, n))
    ! C counts dimensions from the slowest.
    this%plan = fftw_plan_r2r_2d(int(n, c_int), int(m, c_int), input, output, FFTW_DHT, &
      FFTW_DHT, ior(ior(FFTW_ESTIMATE, FFTW_UNALIGNED), FFTW_DESTROY_INPUT))
    if (.not. c_associated(this%plan)) then
      call raise(error, EXIT_INTERNAL, 'FFTW could not plan a transform', 'init_hartley')
      return
    end if
    this%m = m
    this%n = n
  end subroutine init_hartley

  !> The transform of `input` [m, n] in `output` [m, n], without a factor. `input` is overwritten.
  subroutine execute_hartley(this, input, output, error)
    class(hartley_transform_t), intent(in) :: this
    real(wp), contiguous, intent(inout) :: input(:, :)
    real(wp), contiguous, intent(out) :: output(:, :)
    type(error_t), allocatable, intent(out) :: error

    if (.not. c_associated(this%plan) .or. any(shape(input) /= [this%m, this%n]) &
      .or. any(shape(output) /= [this%m, this%n])) then
      call raise(error, EXIT_INTERNAL, 'an array does not fit the plan', 'execute_hartley')
      return
    end if
    call fftw_execute_r2r(this%plan, input, output)
  end subroutine execute_hartley

  subroutine free_hartley(this)
    class(hartley_transform_t), intent(inout) :: this

    if (c_associated(this%plan)) call fftw_destroy_plan(this%plan)
    this%plan = c_null_ptr
    this%m = 0
    this%n = 0
  end subroutine free_hartley

  subroutine finalize_hartley(this)
    type(hartley_transform_t), intent(inout) :: this

    call this%free()
  end subroutine finalize_hartley
end module sg_fourier
