!> Independent standard normal numbers, each a function of its address.
module sg_white_noise
  use sg_kinds, only: i8, wp
  use sg_philox, only: fill_uniform
  use sg_special_functions, only: normal_quantile
  implicit none
  private

  public :: fill_white_noise

contains

  !> The first numbers of (seed, stream, realization): the normal quantile of one uniform number
  !> each, so within +-8.2. For a grid, give the array [nx, ny]: x runs fastest.
  subroutine fill_white_noise(seed, stream, realization, values)
    integer(i8), intent(in) :: seed
    !> FIELD_STREAM or NOISE_STREAM of sg_philox.
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    !> [any, any].
    real(wp), contiguous, intent(out) :: values(:, :)
    integer :: i, j
    integer(i8) :: offset

    do j = 1, size(values, 2)
      offset = int(j - 1, i8)*size(values, 1)
      call fill_uniform(seed, stream, realization, offset, values(:, j))
      do i = 1, size(values, 1)
        values(i, j) = normal_quantile(values(i, j))
      end do
    end do
  end subroutine fill_white_noise
end module sg_white_noise
