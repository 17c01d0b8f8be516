!> Independent standard normal numbers, each a function of its address.
module sg_white_noise
  use sg_kinds, only: i8, wp
  use sg_normal_quantile, only: to_normal
  use sg_philox, only: fill_uniform
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

    call fill_in_order(seed, stream, realization, size(values), values)
  end subroutine fill_white_noise

  !> The same for the elements in their order in memory, [n].
  subroutine fill_in_order(seed, stream, realization, n, values)
    integer(i8), intent(in) :: seed
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    integer, intent(in) :: n
    real(wp), intent(out) :: values(n)

    call fill_uniform(seed, stream, realization, 0_i8, values)
    call to_normal(values)
  end subroutine fill_in_order
end module sg_white_noise
