!> From a standard Gaussian field to the property: values F^-1(Phi(z)), cut off at bounds.
module sg_marginal
  use sg_double_log, only: double_log, double_log_slope, find_weibull_exponent, &
    invert_double_log, LEAST_WEIBULL_EXPONENT, MOST_WEIBULL_EXPONENT
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_kinds, only: wp
  use sg_quantile_table, only: CHUNK, quantile_table_t
  use sg_special_functions, only: log_one_plus, normal_cdf, normal_quantile, &
    normal_upper_quantile, normal_upper_tail
  use sg_text, only: joined, lower_case, to_text
  use sg_truncated_normal, only: truncated_normal_t
  implicit none
  private

  public :: marginal_t, LAW_NAMES

  !> Laws, by their place in this list.
  character(len=*), parameter :: LAW_NAMES(8) = [character(len=16) :: 'normal', 'lognormal', &
    'truncated_normal', 'beta', 'gamma', 'gumbel', 'weibull', 'uniform']
  integer, parameter :: LAW_NORMAL = 1, LAW_LOGNORMAL = 2, LAW_TRUNCATED_NORMAL = 3, &
    LAW_BETA = 4, LAW_GAMMA = 5, LAW_GUMBEL = 6, LAW_WEIBULL = 7, LAW_UNIFORM = 8

  !> Least probability that the bounds must leave of a normal law.
  real(wp), parameter :: LEAST_MASS = 1.0e-12_wp
  !> In standard deviations from the mean: no bound.
  real(wp), parameter :: FAR_AWAY = 40.0_wp

  type :: marginal_t
    private
    integer :: law = LAW_NORMAL
    !> value = location + spread y(z): normal (parent) mean and sd, lognormal those of the
    !> logarithm, gumbel mode and scale, uniform lower end and width; spread alone: gamma mean,
    !> weibull scale.
    real(wp) :: location = 0.0_wp, spread = 0.0_wp
    real(wp) :: lower = 0.0_wp, upper = 0.0_wp
    !> weibull: 1/shape.
    real(wp) :: exponent = 0.0_wp
    type(truncated_normal_t) :: truncated
    !> gamma and beta; without memory for the other laws.
    type(quantile_table_t) :: table
  contains
    procedure :: init
    procedure :: transform
    procedure :: to_gaussian
    procedure :: slope
    procedure, private :: set_law
    procedure, private :: set_beta
    procedure, private :: set_gamma
    procedure, private :: set_truncated
    procedure, private :: closed_form
    procedure, private :: transform_by_table
    procedure, private :: find_gaussian
  end type marginal_t

contains

  !> `mean` and `sd` are those of the property before it is cut off at the bounds; truncated_normal:
  !> of the normal law that is truncated; beta: of the law between the bounds. `lower` = -huge and
  !> `upper` = huge mean none. Refused as bad input: unknown distribution, sd <= 0, bounds that do
  !> not enclose the mean (truncated_normal: that leave nothing) and what a law does not allow.
  subroutine init(this, distribution, mean, sd, lower, upper, error)
    class(marginal_t), intent(inout) :: this
    !> One of LAW_NAMES.
    character(len=*), intent(in) :: distribution
    real(wp), intent(in) :: mean, sd, lower, upper
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: fault

    this%law = number_of(distribution)
    this%lower = lower
    this%upper = upper
    fault = ''
    if (this%law == 0) then
      fault = "no distribution is called '"//trim(distribution)//"' (allowed: "// &
        joined(LAW_NAMES, ', ')//')'
    else if (.not. (sd > 0.0_wp .and. sd < huge(sd))) then
      fault = 'the standard deviation must be positive, not '//to_text(sd)
    else if (this%law == LAW_TRUNCATED_NORMAL) then
      if (.not. lower < upper) fault = 'lower < upper does not hold: '//to_text(lower)//', '// &
        to_text(upper)
    else if (.not. (lower <= mean .and. mean <= upper)) then
      fault = 'lower <= mean <= upper does not hold: '//to_text(lower)//', '//to_text(mean)// &
        ', '//to_text(upper)
    else if (is_positive(this%law) .and. .not. mean > 0.0_wp) then
      fault = 'a '//trim(LAW_NAMES(this%law))//' law needs a positive mean'
    end if
    if (len(fault) == 0) call this%set_law(mean, sd, fault)
    if (len(fault) > 0) call raise(error, EXIT_BAD_INPUT, fault, 'marginal')
  end subroutine init

  !> Constants of the law; `fault` is left alone or says what it does not allow.
  subroutine set_law(this, mean, sd, fault)
    class(marginal_t), intent(inout) :: this
    real(wp), intent(in) :: mean, sd
    character(len=:), allocatable, intent(inout) :: fault
    real(wp), parameter :: PI = 3.14159265358979323846_wp, EULER = 0.57721566490153286061_wp
    logical :: found

    select case (this%law)
    case (LAW_NORMAL)
      this%location = mean
      this%spread = sd
    case (LAW_LOGNORMAL)
      this%spread = sqrt(log_one_plus((sd/mean)**2))
      this%location = log(mean) - 0.5_wp*this%spread**2
    case (LAW_TRUNCATED_NORMAL)
      call this%set_truncated(mean, sd, fault)
    case (LAW_BETA)
      call this%set_beta(mean, sd, fault)
    case (LAW_GAMMA)
      call this%set_gamma(mean, sd, fault)
    case (LAW_GUMBEL)
      this%spread = sd*sqrt(6.0_wp)/PI
      this%location = mean - EULER*this%spread
    case (LAW_WEIBULL)
      call find_weibull_exponent(sd/mean, this%exponent, found)
      if (found) then
        this%spread = mean/gamma(1.0_wp + this%exponent)
      else
        fault = 'no weibull law with a shape between '//to_text(1.0_wp/MOST_WEIBULL_EXPONENT, 3) &
          //' and '//to_text(1.0_wp/LEAST_WEIBULL_EXPONENT, 3)// &
          ' has the coefficient of variation '//to_text(sd/mean)
      end if
    case default
      this%location = mean - sqrt(3.0_wp)*sd
      this%spread = 2.0_wp*sqrt(3.0_wp)*sd
    end select
  end subroutine set_law

  subroutine set_truncated(this, mean, sd, fault)
    class(marginal_t), intent(inout) :: this
    real(wp), intent(in) :: mean, sd
    character(len=:), allocatable, intent(inout) :: fault
    real(wp) :: alpha, beta, width

    this%location = mean
    this%spread = sd
    alpha = -FAR_AWAY
    beta = FAR_AWAY
    if (has_lower(this%lower)) alpha = max(alpha, min(beta, (this%lower - mean)/sd))
    if (has_upper(this%upper)) beta = max(alpha, min(beta, (this%upper - mean)/sd))
    width = beta - alpha
    if (has_lower(this%lower) .and. has_upper(this%upper)) width = (this%upper - this%lower)/sd
    call this%truncated%init(alpha, beta, width)
    if (.not. this%truncated%mass >= LEAST_MASS) then
      fault = 'between lower and upper lies only '//to_text(this%truncated%mass, 2)// &
        ' of the probability of the normal law (at least '//to_text(LEAST_MASS)//' must)'
    end if
  end subroutine set_truncated

  subroutine set_beta(this, mean, sd, fault)
    class(marginal_t), intent(inout) :: this
    real(wp), intent(in) :: mean, sd
    character(len=:), allocatable, intent(inout) :: fault
    real(wp) :: product, below, above, shapes(2)
    logical :: resolved

    if (.not. (has_lower(this%lower) .and. has_upper(this%upper))) then
      fault = 'a beta law needs lower and upper'
      return
    end if
    below = mean - this%lower
    above = this%upper - mean
    product = below*above
    if (.not. sd**2 < product) then
      fault = 'a beta law with this mean between lower and upper needs a standard deviation '// &
        'below '//to_text(sqrt(product), 4)//', not '//to_text(sd)
      return
    end if
    shapes = [below, above]/(below + above)*((product - sd**2)/sd**2)
    call this%table%init_beta(shapes(1), shapes(2), resolved)
    if (.not. resolved) then
      fault = 'the shapes '//to_text(shapes(1), 3)//' and '//to_text(shapes(2), 3)// &
        ' of the beta law are too extreme to be tabulated: its standard deviation is too '// &
        'near to 0 or to the most that the bounds allow'
    end if
  end subroutine set_beta

  subroutine set_gamma(this, mean, sd, fault)
    class(marginal_t), intent(inout) :: this
    real(wp), intent(in) :: mean, sd
    character(len=:), allocatable, intent(inout) :: fault
    logical :: resolved

    this%spread = mean
    call this%table%init_gamma((mean/sd)**2, resolved)
    if (.not. resolved) then
      fault = 'the coefficient of variation '//to_text(sd/mean)//' of the gamma law is too '// &
        'small or too large for it to be tabulated'
    end if
  end subroutine set_gamma

  !> F^-1(Phi(z)), for all laws without loss in the tails. What lies outside [lower, upper] is set
  !> to the nearer bound and counted; truncated_normal and beta end there and count nothing.
  pure subroutine transform(this, z, values, clipped)
    class(marginal_t), intent(in) :: this
    !> Standard Gaussian, [n].
    real(wp), intent(in) :: z(:)
    !> [n], unit of the property.
    real(wp), intent(out) :: values(:)
    integer, intent(out) :: clipped
    integer :: i

    select case (this%law)
    case (LAW_NORMAL, LAW_LOGNORMAL)
      values = this%location + this%spread*z
      if (this%law == LAW_LOGNORMAL) values = exp(values)
    case (LAW_BETA, LAW_GAMMA)
      call this%transform_by_table(z, values)
    case default
      ! Logarithms of vectors would differ from single ones in the last bit.
      !GCC$ novector
      do i = 1, size(z)
        values(i) = this%closed_form(z(i))
      end do
    end select
    clipped = 0
    if (all(this%law /= [LAW_BETA, LAW_TRUNCATED_NORMAL])) then
      clipped = count(values < this%lower .or. values > this%upper)
    end if
    values = min(max(values, this%lower), this%upper)
  end subroutine transform

  pure subroutine transform_by_table(this, z, values)
    class(marginal_t), intent(in) :: this
    real(wp), intent(in) :: z(:)
    real(wp), intent(out) :: values(:)
    real(wp) :: some(CHUNK), t(CHUNK), part, width
    integer :: first, i, n

    width = 0.0_wp
    if (this%law == LAW_BETA) width = this%upper - this%lower
    do first = 0, size(z) - 1, CHUNK
      n = min(CHUNK, size(z) - first)
      some(:n) = z(first + 1:first + n)
      some(n + 1:) = 0.0_wp
      call this%table%interpolate(some, t)
      if (this%law == LAW_GAMMA) then
        do i = 1, CHUNK
          t(i) = this%spread*exp(t(i))
        end do
      else
        do i = 1, CHUNK
          part = exp(-abs(t(i)))
          part = width*(part/(1.0_wp + part))
          t(i) = merge(this%lower + part, this%upper - part, t(i) < 0.0_wp)
        end do
      end if
      values(first + 1:first + n) = t(:n)
    end do
  end subroutine transform_by_table

  !> The value of one z, not cut off, for laws that have a formula.
  pure function closed_form(this, z) result(value)
    class(marginal_t), intent(in) :: this
    real(wp), intent(in) :: z
    real(wp) :: value, distance
    integer :: from

    select case (this%law)
    case (LAW_NORMAL)
      value = this%location + this%spread*z
    case (LAW_LOGNORMAL)
      value = exp(this%location + this%spread*z)
    case (LAW_GUMBEL)
      value = this%location + this%spread*double_log(z)
    case (LAW_WEIBULL)
      value = this%spread*exp(-this%exponent*double_log(-z))
    case (LAW_TRUNCATED_NORMAL)
      call this%truncated%find(z, from, distance)
      value = this%location
      if (from < 0) value = this%lower
      if (from > 0) value = this%upper
      value = value + this%spread*distance
    case default
      if (z <= 0.0_wp) then
        value = this%location + this%spread*normal_cdf(z)
      else
        value = this%location + this%spread - this%spread*normal_upper_tail(z)
      end if
    end select
  end function closed_form

  !> Phi^-1(F(value)). Refused as bad input: a value outside [lower, upper] or of no probability, as
  !> the ends of a law are.
  subroutine to_gaussian(this, value, z, error)
    class(marginal_t), intent(in) :: this
    real(wp), intent(in) :: value
    real(wp), intent(out) :: z
    type(error_t), allocatable, intent(out) :: error
    logical :: found

    z = 0.0_wp
    if (.not. (this%lower <= value .and. value <= this%upper)) then
      call raise(error, EXIT_BAD_INPUT, 'the value '//to_text(value)// &
        ' lies outside the bounds '//to_text(this%lower)//' and '//to_text(this%upper), 'marginal')
      return
    end if
    call this%find_gaussian(value, z, found)
    if (.not. found) call raise(error, EXIT_BAD_INPUT, 'a '// &
      trim(LAW_NAMES(this%law))//' law as given does not take the value '//to_text(value), &
      'marginal')
  end subroutine to_gaussian

  pure subroutine find_gaussian(this, value, z, found)
    class(marginal_t), intent(in) :: this
    real(wp), intent(in) :: value
    real(wp), intent(out) :: z
    logical, intent(out) :: found
    real(wp) :: t, x, y

    z = 0.0_wp
    found = value > 0.0_wp .or. .not. is_positive(this%law)
    if (.not. found) return
    select case (this%law)
    case (LAW_NORMAL)
      z = (value - this%location)/this%spread
    case (LAW_LOGNORMAL)
      z = (log(value) - this%location)/this%spread
    case (LAW_GUMBEL)
      call invert_double_log((value - this%location)/this%spread, z, found)
    case (LAW_WEIBULL)
      call invert_double_log(-log(value/this%spread)/this%exponent, z, found)
      z = -z
    case (LAW_TRUNCATED_NORMAL)
      x = FAR_AWAY
      y = FAR_AWAY
      if (has_lower(this%lower)) x = (value - this%lower)/this%spread
      if (has_upper(this%upper)) y = (this%upper - value)/this%spread
      call this%truncated%to_gaussian((value - this%location)/this%spread, x, y, z, found)
    case (LAW_GAMMA)
      t = log(value/this%spread)
      call quantile_of_tails(this%table%tail(t, .false.), this%table%tail(t, .true.), z, found)
    case (LAW_BETA)
      found = this%lower < value .and. value < this%upper
      if (.not. found) return
      t = log((value - this%lower)/(this%upper - value))
      call quantile_of_tails(this%table%tail(t, .false.), this%table%tail(t, .true.), z, found)
    case default
      x = (value - this%location)/this%spread
      y = (this%location + this%spread - value)/this%spread
      call quantile_of_tails(x, y, z, found)
    end select
  end subroutine find_gaussian

  !> dvalue/dz of `transform` without bounds.
  pure function slope(this, z) result(dvalue_dz)
    class(marginal_t), intent(in) :: this
    real(wp), intent(in) :: z
    real(wp) :: dvalue_dz
    real(wp), parameter :: ROOT_TWO_PI = 2.5066282746310005024_wp
    real(wp) :: some(CHUNK), t(CHUNK), part

    some = z
    select case (this%law)
    case (LAW_NORMAL)
      dvalue_dz = this%spread
    case (LAW_LOGNORMAL)
      dvalue_dz = this%spread*this%closed_form(z)
    case (LAW_GUMBEL)
      dvalue_dz = this%spread*double_log_slope(z)
    case (LAW_WEIBULL)
      dvalue_dz = this%closed_form(z)*this%exponent*double_log_slope(-z)
    case (LAW_TRUNCATED_NORMAL)
      dvalue_dz = this%spread*this%truncated%slope(z, (this%closed_form(z) - this%location) &
        /this%spread)
    case (LAW_GAMMA)
      call this%table%interpolate(some, t)
      dvalue_dz = this%spread*exp(t(1))*this%table%slope(z)
    case (LAW_BETA)
      call this%table%interpolate(some, t)
      part = exp(-abs(t(1)))
      dvalue_dz = (this%upper - this%lower)*(part/(1.0_wp + part)**2)*this%table%slope(z)
    case default
      dvalue_dz = this%spread*exp(-0.5_wp*z**2)/ROOT_TWO_PI
    end select
  end function slope

  !> z of the probabilities below and above it, from the smaller one.
  pure subroutine quantile_of_tails(p, q, z, found)
    real(wp), intent(in) :: p, q
    real(wp), intent(out) :: z
    logical, intent(out) :: found

    z = 0.0_wp
    found = p > 0.0_wp .and. q > 0.0_wp
    if (.not. found) return
    if (p <= q) then
      z = normal_quantile(p)
    else
      z = normal_upper_quantile(q)
    end if
  end subroutine quantile_of_tails

  !> Laws on (0, infinity).
  pure function is_positive(law) result(positive)
    integer, intent(in) :: law
    logical :: positive
    positive = any(law == [LAW_LOGNORMAL, LAW_GAMMA, LAW_WEIBULL])
  end function is_positive

  pure function has_lower(lower) result(has)
    real(wp), intent(in) :: lower
    logical :: has
    has = lower > -huge(lower)
  end function has_lower

  pure function has_upper(upper) result(has)
    real(wp), intent(in) :: upper
    logical :: has
    has = upper < huge(upper)
  end function has_upper

  !> Place in LAW_NAMES, 0 if it is not there.
  pure function number_of(distribution) result(law)
    character(len=*), intent(in) :: distribution
    integer :: law

    do law = size(LAW_NAMES), 1, -1
      if (lower_case(distribution) == LAW_NAMES(law)) return
    end do
  end function number_of
end module sg_marginal
