!> The standard normal law between two bounds: from a standard Gaussian number and back.
module sg_truncated_normal
  use sg_kinds, only: wp
  use sg_special_functions, only: normal_cdf, normal_quantile, normal_upper_quantile, &
    normal_upper_tail
  implicit none
  private

  public :: truncated_normal_t

  !> Steps from a bound for which the series below are exact to the last digits, as a multiple of
  !> 1/max(1, |bound|). Longer ones are differences of two places, which lose no digits then.
  real(wp), parameter :: NEAR = 0.1_wp

  type :: truncated_normal_t
    !> Bounds of the standard law.
    real(wp) :: alpha = 0.0_wp, beta = 0.0_wp
    !> Its probability below alpha, between the bounds and above beta.
    real(wp) :: below = 0.0_wp, mass = 0.0_wp, above = 0.0_wp
  contains
    procedure :: init
    procedure :: find
    procedure :: to_gaussian
    procedure :: slope
  end type truncated_normal_t

contains

  !> The caller looks at `mass`; what follows needs some.
  subroutine init(this, alpha, beta, width)
    class(truncated_normal_t), intent(out) :: this
    !> `width` is beta - alpha, perhaps with more digits.
    real(wp), intent(in) :: alpha, beta, width

    this%alpha = alpha
    this%beta = beta
    this%below = normal_cdf(alpha)
    this%above = normal_upper_tail(beta)
    if (alpha > 0.0_wp) then
      this%mass = normal_upper_tail(alpha) - this%above
    else if (beta < 0.0_wp) then
      this%mass = normal_cdf(beta) - this%below
    else
      this%mass = 1.0_wp - this%below - this%above
    end if
    if (width < NEAR/max(1.0_wp, abs(alpha))) this%mass = mass_of_step(alpha, width)
  end subroutine init

  !> The value y that has the probability Phi(z) below it, as its distance from `from`, which is
  !> alpha, beta or (elsewhere) 0.
  pure subroutine find(this, z, from, distance)
    class(truncated_normal_t), intent(in) :: this
    real(wp), intent(in) :: z
    integer, intent(out) :: from
    real(wp), intent(out) :: distance
    real(wp) :: p, q

    p = normal_cdf(z)*this%mass
    q = normal_upper_tail(z)*this%mass
    if (p*max(1.0_wp, abs(this%alpha)) < NEAR*density(this%alpha)) then
      from = -1
      distance = step_of_mass(this%alpha, p)
    else if (q*max(1.0_wp, abs(this%beta)) < NEAR*density(this%beta)) then
      from = 1
      distance = -step_of_mass(-this%beta, q)
    else
      from = 0
      p = this%below + p
      q = this%above + q
      if (p <= q) then
        distance = normal_quantile(p)
      else
        distance = normal_upper_quantile(q)
      end if
    end if
  end subroutine find

  !> The z of a value `low` above alpha and `high` below beta; y is the value itself. `found` is
  !> false where z lies beyond what a probability can express.
  pure subroutine to_gaussian(this, y, low, high, z, found)
    class(truncated_normal_t), intent(in) :: this
    real(wp), intent(in) :: y, low, high
    real(wp), intent(out) :: z
    logical, intent(out) :: found
    real(wp) :: p, q

    if (low < NEAR/max(1.0_wp, abs(this%alpha))) then
      p = mass_of_step(this%alpha, low)
    else if (this%alpha > 0.0_wp) then
      p = normal_upper_tail(this%alpha) - normal_upper_tail(y)
    else
      p = normal_cdf(y) - this%below
    end if
    if (high < NEAR/max(1.0_wp, abs(this%beta))) then
      q = mass_of_step(-this%beta, high)
    else if (this%beta < 0.0_wp) then
      q = normal_cdf(this%beta) - normal_cdf(y)
    else
      q = normal_upper_tail(y) - this%above
    end if
    z = 0.0_wp
    found = p > 0.0_wp .and. q > 0.0_wp
    if (.not. found) return
    if (p <= q) then
      z = normal_quantile(p/this%mass)
    else
      z = normal_upper_quantile(q/this%mass)
    end if
  end subroutine to_gaussian

  !> dy/dz at z, where the value is y.
  pure function slope(this, z, y) result(dy_dz)
    class(truncated_normal_t), intent(in) :: this
    real(wp), intent(in) :: z, y
    real(wp) :: dy_dz

    dy_dz = this%mass*exp(0.5_wp*(y - z)*(y + z))
  end function slope

  !> The standard normal density.
  elemental function density(y) result(phi)
    real(wp), intent(in) :: y
    real(wp), parameter :: ROOT_TWO_PI = 2.5066282746310005024_wp
    real(wp) :: phi

    phi = exp(-0.5_wp*y**2)/ROOT_TWO_PI
  end function density

  !> Phi(a + w) - Phi(a) for a small step w > 0: Taylor's series, whose derivatives are Hermite
  !> polynomials He_k times the density.
  elemental function mass_of_step(a, w) result(mass)
    real(wp), intent(in) :: a, w
    real(wp) :: mass, term, term_before, next
    integer :: k

    ! term = (-w)^k He_k(a)/(k + 1)!
    term_before = 0.0_wp
    term = 1.0_wp
    mass = 0.0_wp
    do k = 0, 10
      mass = mass + term
      next = (-a*w*term - w**2*term_before*k/(k + 1))/(k + 2)
      term_before = term
      term = next
    end do
    mass = density(a)*w*mass
  end function mass_of_step

  !> The small w with Phi(a + w) - Phi(a) = mass, by Newton's method.
  elemental function step_of_mass(a, mass) result(w)
    real(wp), intent(in) :: a, mass
    real(wp) :: w
    integer :: k

    w = mass/density(a)
    w = w*(1.0_wp + 0.5_wp*a*w)
    do k = 1, 3
      w = w - (mass_of_step(a, w) - mass)/density(a + w)
    end do
  end function step_of_mass
end module sg_truncated_normal
