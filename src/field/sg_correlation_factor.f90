!> Cholesky factor of a correlation matrix, which may be singular to rounding: smooth functions on
!> a fine grid are.
module sg_correlation_factor
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_kinds, only: wp
  use sg_linear_algebra, only: factor_cholesky
  use sg_text, only: to_text
  implicit none
  private

  public :: factor_correlation, text_of_jitter

  !> Jitters tried: 0, then this one and tenfold, up to the limit, beyond which it could be seen in
  !> the field (its share of the variance).
  real(wp), parameter :: SMALLEST_JITTER = 1.0e-14_wp
  real(wp), parameter :: LARGEST_JITTER = 1.0e-6_wp

contains

  !> C + jitter I = L L^T with the smallest jitter of the ladder for which LAPACK factors it.
  subroutine factor_correlation(matrix, jitter, error)
    !> [n, n]: C in, with a diagonal of order 1; L out, its strict upper triangle still that of C.
    real(wp), contiguous, intent(inout) :: matrix(:, :)
    real(wp), intent(out) :: jitter
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: diagonal(size(matrix, 1))
    integer :: failed_row, j, step

    jitter = 0.0_wp
    diagonal = [(matrix(j, j), j=1, size(diagonal))]
    call factor_cholesky(matrix, failed_row)
    step = 0
    do while (failed_row /= 0)
      jitter = SMALLEST_JITTER*10.0_wp**step
      step = step + 1
      if (jitter > 2.0_wp*LARGEST_JITTER) then
        call raise(error, EXIT_BAD_INPUT, 'the correlation matrix of the random field is not '// &
          'positive definite, even with '//to_text(LARGEST_JITTER)//' added to its diagonal '// &
          '(row '//to_text(failed_row)//' of '//to_text(size(matrix, 1))//'): use a smaller '// &
          'scale of fluctuation or fewer points', 'factor_correlation')
        return
      end if
      ! The upper triangle still holds the matrix.
      do j = 1, size(matrix, 1)
        matrix(j, j) = diagonal(j) + jitter
        matrix(j + 1:, j) = matrix(j, j + 1:)
      end do
      call factor_cholesky(matrix, failed_row)
    end do
  end subroutine factor_correlation

  !> What to say of a jitter: nothing if there is none.
  pure function text_of_jitter(jitter) result(text)
    real(wp), intent(in) :: jitter
    character(len=:), allocatable :: text

    text = ''
    if (jitter > 0.0_wp) text = '; the correlation matrix is singular to rounding, '// &
      to_text(jitter, 2)//' was added to its diagonal'
  end function text_of_jitter
end module sg_correlation_factor
