!> From a standard Gaussian field to the property: values F^-1(Phi(z)), cut off at bounds.
module sg_marginal
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_kinds, only: wp
  use sg_special_functions, only: log_one_plus
  use sg_text, only: lower_case, to_text
  implicit none
  private

  public :: marginal_t

  type :: marginal_t
    private
    !> value = location + spread z, or the exponential of it.
    real(wp) :: location = 0.0_wp, spread = 0.0_wp
    real(wp) :: lower = 0.0_wp, upper = 0.0_wp
    logical :: is_lognormal = .false.
  contains
    procedure :: init
    procedure :: transform
  end type marginal_t

contains

  !> `mean` and `cov` (standard deviation over |mean|) are those of the property before it is cut
  !> off. Refused as bad input: unknown distribution, negative cov, lognormal with mean <= 0, bounds
  !> that do not enclose the mean.
  subroutine init(this, distribution, mean, cov, lower, upper, error)
    class(marginal_t), intent(out) :: this
    !> 'normal' or 'lognormal'.
    character(len=*), intent(in) :: distribution
    real(wp), intent(in) :: mean, cov, lower, upper
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: fault

    fault = ''
    if (.not. cov >= 0.0_wp) fault = 'cov must not be negative'
    if (.not. (lower <= mean .and. mean <= upper)) then
      fault = 'lower <= mean <= upper does not hold: '//to_text(lower)//', '//to_text(mean)// &
        ', '//to_text(upper)
    end if
    select case (lower_case(distribution))
    case ('normal')
      this%location = mean
      this%spread = cov*abs(mean)
    case ('lognormal')
      if (mean > 0.0_wp) then
        this%is_lognormal = .true.
        this%spread = sqrt(log_one_plus(cov**2))
        this%location = log(mean) - 0.5_wp*this%spread**2
      else
        fault = 'a lognormal law needs a positive mean'
      end if
    case default
      fault = "no distribution is called '"//trim(distribution)//"' (allowed: normal, lognormal)"
    end select
    this%lower = lower
    this%upper = upper
    if (len(fault) > 0) call raise(error, EXIT_BAD_INPUT, 'random field: '//fault, 'marginal')
  end subroutine init

  !> F^-1(Phi(z)), for both laws a closed form without loss in the tails; what lies outside
  !> [lower, upper] is set to the nearer bound and counted.
  pure subroutine transform(this, z, values, clipped)
    class(marginal_t), intent(in) :: this
    !> Standard Gaussian, [n].
    real(wp), intent(in) :: z(:)
    !> [n], unit of the property.
    real(wp), intent(out) :: values(:)
    integer, intent(out) :: clipped

    values = this%location + this%spread*z
    if (this%is_lognormal) values = exp(values)
    clipped = count(values < this%lower .or. values > this%upper)
    values = min(max(values, this%lower), this%upper)
  end subroutine transform
end module sg_marginal
