!> Autocorrelation functions: the five of Table 1 of the paper, and others. Each is a function rho
!> of t = tau/delta alone, delta being the scale of fluctuation: 2 * integral of rho over tau >= 0
!> equals delta.
module sg_autocorrelation
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_kinds, only: wp
  use sg_special_functions, only: log_bessel_k, log_gamma_function
  use sg_text, only: lower_case
  implicit none
  private

  public :: autocorrelation_t, ACF_NAMES, PAPER_ACFS

  character(len=9), parameter :: ACF_NAMES(9) = [character(len=9) :: 'snx', 'sqx', 'smk', 'csx', &
    'bin', 'matern32', 'matern52', 'matern', 'spherical']
  !> The first so many are those of the paper.
  integer, parameter :: PAPER_ACFS = 5

  !> Scales of fluctuation over the radius of the sphere.
  real(wp), parameter :: SPHERE = 0.75_wp

  type :: autocorrelation_t
    character(len=len(ACF_NAMES)) :: name = ''
    !> Lag in scales of fluctuation at which the function has a kink, beside 0; 0: none.
    real(wp) :: kink = 0.0_wp
    !> The radial function rho(sqrt(tx^2 + ty^2)) is a correlation in the plane.
    logical :: is_planar = .true.
    !> rho(tx) rho(ty) = rho(sqrt(tx^2 + ty^2)).
    logical :: is_product_of_itself = .false.
    !> Of 'matern' alone.
    real(wp) :: smoothness = 0.0_wp
  contains
    procedure :: init
    procedure :: rho
  end type autocorrelation_t

contains

  !> By name, one of ACF_NAMES; another is refused as bad input, and so is 'matern' without a
  !> positive smoothness.
  subroutine init(this, name, error, smoothness)
    class(autocorrelation_t), intent(out) :: this
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error
    !> Of 'matern' alone.
    real(wp), intent(in), optional :: smoothness

    this%name = trim(lower_case(name))
    if (.not. any(ACF_NAMES == this%name)) then
      call raise(error, EXIT_BAD_INPUT, "no autocorrelation function is called '"//trim(name)// &
        "' (allowed: snx, sqx, smk, csx, bin, matern32, matern52, matern, spherical)", &
        'autocorrelation')
      return
    end if
    select case (this%name)
    case ('sqx')
      this%is_product_of_itself = .true.
    case ('bin')
      this%kink = 1.0_wp
      this%is_planar = .false.
    case ('spherical')
      this%kink = 1.0_wp/SPHERE
    case ('matern')
      if (present(smoothness)) this%smoothness = smoothness
      if (.not. this%smoothness > 0.0_wp) call raise(error, EXIT_BAD_INPUT, &
        "acf='matern' needs a smoothness above 0", 'autocorrelation')
    case default ! nothing special
    end select
  end subroutine init

  !> Correlation at the lag t >= 0, in scales of fluctuation.
  pure function rho(this, t)
    class(autocorrelation_t), intent(in) :: this
    real(wp), intent(in) :: t
    real(wp) :: rho

    select case (this%name)
    case ('snx')
      rho = single_exponential(t)
    case ('sqx')
      rho = squared_exponential(t)
    case ('smk', 'matern32')
      rho = second_order_markov(t)
    case ('csx')
      rho = cosine_exponential(t)
    case ('bin')
      rho = binary_noise(t)
    case ('matern52')
      rho = matern_five_halves(t)
    case ('matern')
      rho = matern(t, this%smoothness)
    case default
      rho = spherical(t)
    end select
  end function rho

  !> SNX: exp(-2 t).
  pure function single_exponential(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho
    rho = exp(-2.0_wp*t)
  end function single_exponential

  !> SQX: exp(-pi t^2). (The paper prints delta = sqrt(pi) b; it is sqrt(pi)/b.)
  pure function squared_exponential(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho
    real(wp), parameter :: PI = acos(-1.0_wp)
    rho = exp(-PI*t**2)
  end function squared_exponential

  !> SMK: (1 + 4 t) exp(-4 t).
  pure function second_order_markov(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho
    rho = (1.0_wp + 4.0_wp*t)*exp(-4.0_wp*t)
  end function second_order_markov

  !> CSX (the paper's "CSK"): exp(-t) cos(t).
  pure function cosine_exponential(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho
    rho = exp(-t)*cos(t)
  end function cosine_exponential

  !> BIN: 1 - t up to t = 1, then 0.
  pure function binary_noise(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho
    rho = max(1.0_wp - t, 0.0_wp)
  end function binary_noise

  !> Matern with nu = 5/2.
  pure function matern_five_halves(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho, z
    z = 16.0_wp/3.0_wp*t
    rho = (1.0_wp + z + z**2/3.0_wp)*exp(-z)
  end function matern_five_halves

  !> Matern: 2^(1 - nu)/Gamma(nu) z^nu K_nu(z) with z = 2 sqrt(pi) Gamma(nu + 1/2)/Gamma(nu) t,
  !> through logarithms, so that large nu do not overflow (Rasmussen & Williams 2006, Eq. 4.14, with
  !> the length replaced by the scale of fluctuation).
  pure function matern(t, smoothness) result(rho)
    real(wp), intent(in) :: t, smoothness
    real(wp) :: rho, z
    real(wp), parameter :: PI = acos(-1.0_wp)
    !> Lag below which the function is 1 to rounding, for nu >= 1/2.
    real(wp), parameter :: NONE = 1.0e-300_wp

    rho = 1.0_wp
    z = 2.0_wp*sqrt(PI)*exp(log_gamma_function(smoothness + 0.5_wp) &
      - log_gamma_function(smoothness))*t
    if (z < NONE) return
    rho = min(1.0_wp, exp((1.0_wp - smoothness)*log(2.0_wp) - log_gamma_function(smoothness) &
      + smoothness*log(z) + log_bessel_k(smoothness, z)))
  end function matern

  !> Spherical: 1 - 3 r/2 + r^3/2 for r = 3 t/4 up to 1, then 0.
  pure function spherical(t) result(rho)
    real(wp), intent(in) :: t
    real(wp) :: rho, r
    r = min(SPHERE*t, 1.0_wp)
    rho = 1.0_wp - 1.5_wp*r + 0.5_wp*r**3
  end function spherical
end module sg_autocorrelation
