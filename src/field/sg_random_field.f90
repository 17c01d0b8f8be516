!> The random field of a material property: one value at each point's initial place.
module sg_random_field
  use sg_config, only: random_field_config_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_marginal, only: marginal_t
  use sg_sampler, only: create_sampler, gaussian_sampler_t
  implicit none
  private

  public :: random_field_t

  type :: random_field_t
    !> Its `description` and `jitter` belong in the log.
    class(gaussian_sampler_t), allocatable :: sampler
    type(marginal_t) :: marginal
  contains
    procedure :: init
    procedure :: set_cov
    procedure :: realize
  end type random_field_t

contains

  !> `acf` and `cov` are those of the study case; the rest is from &random_field.
  subroutine init(this, config, acf, cov, x, y, error)
    class(random_field_t), intent(inout) :: this
    type(random_field_config_t), intent(in) :: config
    !> One of ACF_NAMES of sg_autocorrelation.
    character(len=*), intent(in) :: acf
    real(wp), intent(in) :: cov
    !> Initial places of the points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    type(error_t), allocatable, intent(out) :: error

    call this%set_cov(config, cov, error)
    if (allocated(error)) return
    call create_sampler(config%method, acf, config%scale_x, config%scale_y, x, y, this%sampler, &
      error)
  end subroutine init

  !> Another coefficient of variation for the same Gaussian field, which need not be made anew.
  subroutine set_cov(this, config, cov, error)
    class(random_field_t), intent(inout) :: this
    type(random_field_config_t), intent(in) :: config
    real(wp), intent(in) :: cov
    type(error_t), allocatable, intent(out) :: error

    call this%marginal%init(config%distribution, config%mean, cov, config%lower, config%upper, &
      error)
  end subroutine set_cov

  !> The field of one realization: a function of its arguments alone.
  subroutine realize(this, seed, stream, realization, values, clipped_share, error)
    class(random_field_t), intent(in) :: this
    integer(i8), intent(in) :: seed
    !> FIELD_STREAM of sg_philox.
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    !> [n], in the order of the points, in the unit of the property.
    real(wp), intent(out) :: values(:)
    !> Share of the points whose value was set to a bound.
    real(wp), intent(out) :: clipped_share
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: z(:)
    integer :: clipped

    clipped_share = 0.0_wp
    allocate (z(size(values)))
    call this%sampler%sample(seed, stream, realization, z, error)
    if (allocated(error)) return
    call this%marginal%transform(z, values, clipped)
    clipped_share = real(clipped, wp)/size(values)
  end subroutine realize
end module sg_random_field
