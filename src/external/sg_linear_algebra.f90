!> Dense algebra of LAPACK and BLAS, on one thread. Lower factors are stored in full square
!> matrices, whose upper triangle is not read.
module sg_linear_algebra
  use, intrinsic :: ieee_arithmetic, only: ieee_get_underflow_mode, ieee_set_underflow_mode, &
    ieee_support_underflow_control
  use, intrinsic :: iso_c_binding, only: c_int
  use sg_kinds, only: wp
  implicit none
  private

  public :: factor_cholesky, factor_semidefinite, multiply_from_left
  public :: multiply_from_right_transposed, multiply_vector, solve_lower, solve_factored
  public :: use_one_blas_thread, count_blas_threads

  interface
    subroutine dpotrf(uplo, n, a, lda, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: info
    end subroutine dpotrf

    subroutine dpstrf(uplo, n, a, lda, piv, rank, tol, work, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, lda
      real(wp), intent(inout) :: a(lda, *)
      integer, intent(out) :: piv(*), rank
      real(wp), intent(in) :: tol
      real(wp), intent(inout) :: work(*)
      integer, intent(out) :: info
    end subroutine dpstrf

    subroutine dpotrs(uplo, n, nrhs, a, lda, b, ldb, info)
      import :: wp
      implicit none
      character, intent(in) :: uplo
      integer, intent(in) :: n, nrhs, lda, ldb
      real(wp), intent(in) :: a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
      integer, intent(out) :: info
    end subroutine dpotrs

    subroutine dtrsm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
      import :: wp
      implicit none
      character, intent(in) :: side, uplo, transa, diag
      integer, intent(in) :: m, n, lda, ldb
      real(wp), intent(in) :: alpha, a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
    end subroutine dtrsm

    subroutine dtrmm(side, uplo, transa, diag, m, n, alpha, a, lda, b, ldb)
      import :: wp
      implicit none
      character, intent(in) :: side, uplo, transa, diag
      integer, intent(in) :: m, n, lda, ldb
      real(wp), intent(in) :: alpha, a(lda, *)
      real(wp), intent(inout) :: b(ldb, *)
    end subroutine dtrmm

    subroutine dtrmv(uplo, trans, diag, n, a, lda, x, incx)
      import :: wp
      implicit none
      character, intent(in) :: uplo, trans, diag
      integer, intent(in) :: n, lda, incx
      real(wp), intent(in) :: a(lda, *)
      real(wp), intent(inout) :: x(*)
    end subroutine dtrmv

    !> BLAS libraries with threads of their own are held to one: ranks fill the cores already.
    subroutine use_one_blas_thread() bind(c, name='sgimp_use_one_blas_thread')
      implicit none
    end subroutine use_one_blas_thread

    !> Threads that BLAS uses; 0 when it does not say.
    function count_blas_threads() result(number) bind(c, name='sgimp_blas_threads')
      import :: c_int
      implicit none
      integer(c_int) :: number
    end function count_blas_threads
  end interface

contains

  !> A = L L^T in the lower triangle of `a`; the strict upper triangle is left as it was.
  !> `failed_row` is 0, or the order of the first leading minor that is not positive.
  !> Numbers below the smallest normal one count as zero meanwhile: correlations that die out fast
  !> are full of them, and they make the factorization five times slower.
  subroutine factor_cholesky(a, failed_row)
    !> [n, n], the lower triangle in, L out.
    real(wp), contiguous, intent(inout) :: a(:, :)
    integer, intent(out) :: failed_row
    logical :: gradual

    gradual = .true.
    if (ieee_support_underflow_control(1.0_wp)) then
      call ieee_get_underflow_mode(gradual)
      call ieee_set_underflow_mode(.false.)
    end if
    call dpotrf('L', size(a, 1), a, max(size(a, 1), 1), failed_row)
    ! A negative info names a bad argument; there is no way to pass one from here.
    failed_row = abs(failed_row)
    if (ieee_support_underflow_control(1.0_wp)) call ieee_set_underflow_mode(gradual)
  end subroutine factor_cholesky

  !> A = F F^T with F [n, rank] by complete pivoting, for a symmetric A that is positive
  !> semidefinite to `tolerance`: pivots below it end the factorization and count as zero.
  subroutine factor_semidefinite(a, tolerance, factor)
    !> [n, n]; destroyed.
    real(wp), contiguous, intent(inout) :: a(:, :)
    real(wp), intent(in) :: tolerance
    real(wp), allocatable, intent(out) :: factor(:, :)
    real(wp) :: work(2*size(a, 1))
    integer :: pivot(size(a, 1)), i, rank, info

    rank = 0
    ! dpstrf takes the first pivot unseen.
    if (size(a, 1) > 0) then
      if (maxval([(a(i, i), i=1, size(a, 1))]) > tolerance) call dpstrf('L', size(a, 1), a, &
        size(a, 1), pivot, rank, tolerance, work, info)
    end if
    allocate (factor(size(a, 1), rank))
    if (rank == 0) return
    factor = 0.0_wp
    do i = 1, size(a, 1)
      factor(pivot(i), :min(i, rank)) = a(i, :min(i, rank))
    end do
  end subroutine factor_semidefinite

  !> B <- L^-1 B with L [m, m] lower triangular, B [m, n].
  subroutine solve_lower(l, b)
    real(wp), contiguous, intent(in) :: l(:, :)
    real(wp), contiguous, intent(inout) :: b(:, :)

    call dtrsm('L', 'L', 'N', 'N', size(b, 1), size(b, 2), 1.0_wp, l, size(l, 1), b, size(b, 1))
  end subroutine solve_lower

  !> x <- (L L^T)^-1 x with L [n, n] lower triangular.
  subroutine solve_factored(l, x)
    real(wp), contiguous, intent(in) :: l(:, :)
    real(wp), contiguous, intent(inout) :: x(:)
    integer :: info

    ! A negative info names a bad argument; there is no way to pass one from here.
    call dpotrs('L', size(x), 1, l, max(size(l, 1), 1), x, max(size(x), 1), info)
  end subroutine solve_factored

  !> B <- L B with L [m, m] lower triangular, B [m, n].
  subroutine multiply_from_left(l, b)
    real(wp), contiguous, intent(in) :: l(:, :)
    real(wp), contiguous, intent(inout) :: b(:, :)

    call dtrmm('L', 'L', 'N', 'N', size(b, 1), size(b, 2), 1.0_wp, l, size(l, 1), b, size(b, 1))
  end subroutine multiply_from_left

  !> B <- B L^T with L [n, n] lower triangular, B [m, n].
  subroutine multiply_from_right_transposed(l, b)
    real(wp), contiguous, intent(in) :: l(:, :)
    real(wp), contiguous, intent(inout) :: b(:, :)

    call dtrmm('R', 'L', 'T', 'N', size(b, 1), size(b, 2), 1.0_wp, l, size(l, 1), b, size(b, 1))
  end subroutine multiply_from_right_transposed

  !> x <- L x with L [n, n] lower triangular.
  subroutine multiply_vector(l, x)
    real(wp), contiguous, intent(in) :: l(:, :)
    real(wp), contiguous, intent(inout) :: x(:)

    call dtrmv('L', 'N', 'N', size(x), l, size(l, 1), x, 1)
  end subroutine multiply_vector
end module sg_linear_algebra
