!> G(z) = -ln(-ln Phi(z)): a standard Gumbel value for a standard Gaussian one. -G(-z) is the
!> logarithm of a standard exponential value, from which Weibull values come.
module sg_double_log
  use sg_kinds, only: wp
  use sg_special_functions, only: exp_minus_one, log_one_plus, normal_cdf, normal_quantile, &
    normal_upper_quantile, normal_upper_tail, zeta_minus_one
  implicit none
  private

  public :: double_log, double_log_slope, invert_double_log, find_weibull_exponent
  public :: LEAST_WEIBULL_EXPONENT, MOST_WEIBULL_EXPONENT

  !> Range of 1/shape of a Weibull law: cov from 1.3e-6 to 3.7e5.
  real(wp), parameter :: LEAST_WEIBULL_EXPONENT = 1.0e-6_wp, MOST_WEIBULL_EXPONENT = 20.0_wp

contains

  !> G(z), |z| < 37; full accuracy in both tails.
  pure function double_log(z) result(g)
    real(wp), intent(in) :: z
    real(wp) :: g

    if (z <= 0.0_wp) then
      g = -log(-log(normal_cdf(z)))
    else
      g = -log(-log_one_plus(-normal_upper_tail(z)))
    end if
  end function double_log

  !> dG/dz = phi/(Phi (-ln Phi)).
  pure function double_log_slope(z) result(slope)
    real(wp), intent(in) :: z
    real(wp), parameter :: ROOT_TWO_PI = 2.5066282746310005024_wp
    real(wp) :: slope, density, q

    density = exp(-0.5_wp*z**2)/ROOT_TWO_PI
    if (z <= 0.0_wp) then
      slope = -density/(normal_cdf(z)*log(normal_cdf(z)))
    else
      q = normal_upper_tail(z)
      slope = -density/((1.0_wp - q)*log_one_plus(-q))
    end if
  end function double_log_slope

  !> The z with G(z) = g; `found` is false where it lies beyond what a probability can express.
  pure subroutine invert_double_log(g, z, found)
    real(wp), intent(in) :: g
    real(wp), intent(out) :: z
    logical, intent(out) :: found
    real(wp) :: e

    z = 0.0_wp
    found = g > -6.5_wp .and. g < 700.0_wp
    if (.not. found) return
    e = exp(-g)
    if (e > 0.5_wp) then
      z = normal_quantile(exp(-e))
    else
      z = normal_upper_quantile(-exp_minus_one(-e))
    end if
  end subroutine invert_double_log

  !> 1/shape of the Weibull law from 0 with this coefficient of variation: the root s of
  !> Gamma(1 + 2 s)/Gamma(1 + s)^2 = 1 + cov^2. `found` is false outside the range above.
  pure subroutine find_weibull_exponent(cov, s, found)
    real(wp), intent(in) :: cov
    real(wp), intent(out) :: s
    logical, intent(out) :: found
    !> In ln s, for a derivative by differences.
    real(wp), parameter :: STEP = 1.0e-4_wp
    real(wp) :: goal, below, above, mismatch, rate
    integer :: k

    below = log(LEAST_WEIBULL_EXPONENT)
    above = log(MOST_WEIBULL_EXPONENT)
    goal = log(log_one_plus(cov**2))
    s = exp(0.5_wp*(below + above))
    found = log(log_excess(exp(below))) <= goal .and. goal <= log(log_excess(exp(above)))
    if (.not. found) return
    ! The interval in ln s is halved until Newton's method is safe.
    do k = 1, 20
      mismatch = log(log_excess(exp(0.5_wp*(below + above)))) - goal
      if (mismatch > 0.0_wp) then
        above = 0.5_wp*(below + above)
      else
        below = 0.5_wp*(below + above)
      end if
    end do
    s = exp(0.5_wp*(below + above))
    do k = 1, 4
      mismatch = log(log_excess(s)) - goal
      rate = log(log_excess(s*exp(STEP))/log_excess(s*exp(-STEP)))/(2.0_wp*STEP)
      s = s*exp(-mismatch/rate)
    end do
  end subroutine find_weibull_exponent

  !> ln(Gamma(1 + 2 s)/Gamma(1 + s)^2). For small s the series
  !> ln Gamma(1 + x) = -ln(1 + x) + (1 - gamma) x + sum of (zeta(n) - 1) (-x)^n/n
  !> does without the difference of two nearly equal numbers.
  pure function log_excess(s) result(excess)
    real(wp), intent(in) :: s
    real(wp) :: excess
    integer :: n

    if (s > 0.2_wp) then
      excess = log_gamma(1.0_wp + 2.0_wp*s) - 2.0_wp*log_gamma(1.0_wp + s)
      return
    end if
    excess = 0.0_wp
    do n = 24, 2, -1
      excess = excess + zeta_minus_one(n)*(2.0_wp**n - 2.0_wp)*(-s)**n/n
    end do
    excess = excess + log_one_plus(s**2/(1.0_wp + 2.0_wp*s))
  end function log_excess
end module sg_double_log
