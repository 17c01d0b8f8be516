!> The quantile of a gamma or a beta law as a function of a standard Gaussian number, from a table.
!>
!> With gamma, t(z) = ln(value/mean); with beta on [0, 1], t(z) = ln(value/(1 - value)). Both are
!> smooth, nearly linear where the law is nearly normal, and keep the digits of small values and of
!> small distances from 1. The table has a polynomial for each piece of [-REACH, REACH], through t
!> at Chebyshev nodes; pieces are halved until the last terms of all polynomials vanish. At a node
!> the nearer tail of the law is made equal to that of the normal law by Newton's method on its
!> logarithm. Since the density of t is log-concave, so are both tails, and Newton converges from
!> wherever it starts.
module sg_quantile_table
  use sg_kinds, only: wp
  use sg_special_functions, only: beta_cdf, exp_minus_one, gamma_cdf, gamma_star, &
    gamma_upper_tail, log_one_plus, log_one_plus_minus, normal_cdf, normal_upper_tail, &
    set_error_handler_off
  implicit none
  private

  public :: quantile_table_t, CHUNK

  !> Numbers that `interpolate` takes at once: always as many, so that none is left over for an
  !> arithmetic without vectors, whose results could differ in the last bit.
  integer, parameter :: CHUNK = 64
  !> Beyond, t goes on as a straight line. A multiple of half the longest piece.
  real(wp), parameter :: REACH = 8.5_wp
  !> Pieces per unit of z: the first attempt, the last.
  integer, parameter :: COARSEST = 2, FINEST = 128
  integer, parameter :: DEGREE = 9
  !> Largest shapes of a gamma law (beyond, a table takes too long) and of a beta law (beyond, the
  !> library's tails are not accurate, or none). A gamma law is narrow from NARROW on.
  real(wp), parameter :: MOST_GAMMA = 1.0e6_wp, MOST_BETA = 1.0e5_wp, NARROW = 200.0_wp
  !> Last term of a polynomial that is as good as none, and that is still accepted where roundings
  !> (of the tails of narrow laws) allow no less.
  real(wp), parameter :: GOOD = 1.0e-14_wp, PASSABLE = 1.0e-11_wp
  real(wp), parameter :: ROOT_TWO_PI = 2.5066282746310005024_wp

  type :: quantile_table_t
    private
    logical :: is_beta = .false.
    !> Shapes: gamma a; beta a, b.
    real(wp) :: a = 0.0_wp, b = 0.0_wp
    !> Logarithm of the constant factor of the density of t.
    real(wp) :: log_factor = 0.0_wp
    integer :: per_unit = 0
    !> dt/dz at -REACH and REACH.
    real(wp) :: first_slope = 0.0_wp, last_slope = 0.0_wp
    !> [0:DEGREE, pieces]: of the powers of the place in a piece, from -1 to 1.
    real(wp), allocatable :: coefficients(:, :)
  contains
    procedure :: init_gamma
    procedure :: init_beta
    procedure :: interpolate
    procedure :: slope
    procedure :: tail
    procedure, private :: refine
    procedure, private :: fill
    procedure, private :: solve
    procedure, private :: density
  end type quantile_table_t

contains

  !> `resolved` is false where the law is too narrow or too wide for the table.
  subroutine init_gamma(this, a, resolved)
    class(quantile_table_t), intent(out) :: this
    real(wp), intent(in) :: a
    logical, intent(out) :: resolved

    this%a = a
    this%log_factor = a*log(a) - a - log_gamma(a)
    resolved = a <= MOST_GAMMA
    if (.not. resolved) return
    call this%refine(0.0_wp, resolved)
  end subroutine init_gamma

  subroutine init_beta(this, a, b, resolved)
    class(quantile_table_t), intent(out) :: this
    real(wp), intent(in) :: a, b
    logical, intent(out) :: resolved

    this%is_beta = .true.
    this%a = a
    this%b = b
    this%log_factor = log_gamma(a + b) - log_gamma(a) - log_gamma(b)
    resolved = max(a, b) <= MOST_BETA
    if (.not. resolved) return
    call this%refine(log(a/b), resolved)
  end subroutine init_beta

  !> t(z).
  pure subroutine interpolate(this, z, t)
    class(quantile_table_t), intent(in) :: this
    real(wp), intent(in) :: z(CHUNK)
    real(wp), intent(out) :: t(CHUNK)

    call interpolate_chunk(this%coefficients, size(this%coefficients, 2), this%per_unit, z, t)
    if (maxval(abs(z)) > REACH) then
      t = t + this%first_slope*min(z + REACH, 0.0_wp) + this%last_slope*max(z - REACH, 0.0_wp)
    end if
  end subroutine interpolate

  !> z beyond +-REACH counts as +-REACH.
  pure subroutine interpolate_chunk(coefficients, pieces, per_unit, z, t)
    integer, intent(in) :: pieces, per_unit
    real(wp), intent(in) :: coefficients(0:DEGREE, 0:pieces - 1), z(CHUNK)
    real(wp), intent(out) :: t(CHUNK)
    real(wp) :: inside, s, half
    integer :: i, k, piece

    half = 0.5_wp/per_unit
    do i = 1, CHUNK
      inside = min(max(z(i), -REACH), REACH)
      piece = max(0, min(int((inside + REACH)*per_unit), pieces - 1))
      ! The middle of a piece is a short binary fraction: no digit of z is lost.
      s = (inside - ((2*piece + 1)*half - REACH))*(2*per_unit)
      t(i) = coefficients(DEGREE, piece)
      do k = DEGREE - 1, 0, -1
        t(i) = t(i)*s + coefficients(k, piece)
      end do
    end do
  end subroutine interpolate_chunk

  !> dt/dz, of the polynomials.
  pure function slope(this, z) result(dt_dz)
    class(quantile_table_t), intent(in) :: this
    real(wp), intent(in) :: z
    real(wp) :: dt_dz, s
    integer :: k, piece

    if (z < -REACH) then
      dt_dz = this%first_slope
    else if (z > REACH) then
      dt_dz = this%last_slope
    else
      piece = min(int((z + REACH)*this%per_unit) + 1, size(this%coefficients, 2))
      s = (z - ((2*piece - 1)*(0.5_wp/this%per_unit) - REACH))*(2*this%per_unit)
      dt_dz = DEGREE*this%coefficients(DEGREE, piece)
      do k = DEGREE - 1, 1, -1
        dt_dz = dt_dz*s + k*this%coefficients(k, piece)
      end do
      dt_dz = dt_dz*(2*this%per_unit)
    end if
  end function slope

  !> Tables with shorter and shorter pieces, until the last terms vanish. `start` is a place where
  !> neither tail is small.
  subroutine refine(this, start, resolved)
    class(quantile_table_t), intent(inout) :: this
    real(wp), intent(in) :: start
    logical, intent(out) :: resolved
    real(wp) :: median, rest, before, steepness

    call set_error_handler_off()
    median = start
    call this%solve(0.0_wp, median, steepness, resolved)
    if (.not. resolved) return
    before = huge(1.0_wp)
    this%per_unit = COARSEST
    do
      call this%fill(median, rest, resolved)
      if (.not. resolved) return
      if (rest <= GOOD + 4.0_wp*epsilon(1.0_wp)*maxval(abs(this%coefficients(0, :)))) exit
      if (rest <= PASSABLE .and. rest > 0.125_wp*before) exit
      if (this%per_unit == FINEST) exit
      before = rest
      this%per_unit = 2*this%per_unit
    end do
    resolved = rest <= PASSABLE
    this%first_slope = this%slope(-REACH)
    this%last_slope = this%slope(REACH)
  end subroutine refine

  !> Polynomials for all pieces, from the median outwards: t at one node is where the search for the
  !> next one starts. `rest` is the greatest of the last terms.
  subroutine fill(this, median, rest, solved)
    class(quantile_table_t), intent(inout) :: this
    real(wp), intent(in) :: median
    real(wp), intent(out) :: rest
    logical, intent(out) :: solved
    real(wp) :: place(0:DEGREE), values(0:DEGREE), terms(0:DEGREE), powers(0:DEGREE, 0:DEGREE)
    real(wp) :: z, z_before, t, steepness, half
    integer :: pieces, piece, direction, j, k, m

    pieces = nint(2.0_wp*REACH*this%per_unit)
    half = 0.5_wp/this%per_unit
    if (allocated(this%coefficients)) deallocate (this%coefficients)
    allocate (this%coefficients(0:DEGREE, pieces))
    call tabulate_chebyshev(place, powers)
    rest = 0.0_wp
    do direction = -1, 1, 2
      z_before = 0.0_wp
      t = median
      steepness = 0.0_wp
      do m = 1, pieces/2
        piece = pieces/2 + merge(m, 1 - m, direction > 0)
        do j = 0, DEGREE
          k = merge(DEGREE - j, j, direction > 0)
          z = (2*piece - 1)*half - REACH + half*place(k)
          t = t + steepness*(z - z_before)
          call this%solve(z, t, steepness, solved)
          if (.not. solved) return
          values(k) = t
          z_before = z
        end do
        terms = chebyshev_terms(values)
        rest = max(rest, abs(terms(DEGREE)), 0.125_wp*abs(terms(DEGREE - 1)))
        this%coefficients(:, piece) = matmul(powers, terms)
      end do
    end do
  end subroutine fill

  !> Newton's method for t(z), from the t given; `steepness` is dt/dz there.
  subroutine solve(this, z, t, steepness, solved)
    class(quantile_table_t), intent(in) :: this
    real(wp), intent(in) :: z
    real(wp), intent(inout) :: t
    real(wp), intent(out) :: steepness
    logical, intent(out) :: solved
    !> A step from here on is squared by the next one to less than a rounding.
    real(wp), parameter :: LAST_STEP = 1.0e-8_wp
    real(wp) :: goal, probability, density, mismatch
    integer :: step
    logical :: upper

    upper = z > 0.0_wp
    if (upper) then
      goal = normal_upper_tail(z)
    else
      goal = normal_cdf(z)
    end if
    steepness = 0.0_wp
    solved = .false.
    do step = 1, 100
      probability = this%tail(t, upper)
      density = this%density(t)
      if (.not. (probability > 0.0_wp .and. density > 0.0_wp)) return
      mismatch = log(probability/goal)
      t = t + merge(mismatch, -mismatch, upper)*(probability/density)
      solved = abs(mismatch) < LAST_STEP
      if (solved) exit
    end do
    steepness = exp(-0.5_wp*z**2)/(ROOT_TWO_PI*density)
  end subroutine solve

  !> Probability of values above (or below) that of t.
  pure function tail(this, t, upper) result(probability)
    class(quantile_table_t), intent(in) :: this
    real(wp), intent(in) :: t
    logical, intent(in) :: upper
    real(wp) :: probability

    if (this%is_beta) then
      if (upper) then
        probability = beta_cdf(logistic(-t), this%b, this%a)
      else
        probability = beta_cdf(logistic(t), this%a, this%b)
      end if
    else if (this%a >= NARROW) then
      probability = tail_of_narrow_gamma(this%a, t, upper)
    else if (upper) then
      probability = gamma_upper_tail(this%a*exp(t), this%a, 1.0_wp)
    else
      probability = gamma_cdf(this%a*exp(t), this%a, 1.0_wp)
    end if
  end function tail

  !> The same for a gamma law with a large shape a. With x = a exp(t) and the factor
  !> x^a exp(-x)/Gamma(a + 1) the sums are 1 + x/(a + 1) + x^2/((a + 1) (a + 2)) + ... below and
  !> a/x (1 + (a - 1)/x + (a - 1) (a - 2)/x^2 + ...) above; the latter diverges in the end, but its
  !> terms vanish before that.
  pure function tail_of_narrow_gamma(a, t, upper) result(probability)
    real(wp), intent(in) :: a, t
    logical, intent(in) :: upper
    real(wp) :: probability
    real(wp) :: x, term, total
    integer :: n

    x = a*exp(t)
    term = 1.0_wp
    if (upper) term = a/x
    total = 0.0_wp
    n = 0
    do while (term > 1.0e-17_wp*total .and. n < a - 1.0_wp)
      total = total + term
      n = n + 1
      if (upper) then
        term = term*((a - n)/x)
      else
        term = term*(x/(a + n))
      end if
    end do
    probability = exp(a*log_one_plus_minus(exp_minus_one(t)))*total &
      /(ROOT_TWO_PI*sqrt(a)*gamma_star(a))
  end function tail_of_narrow_gamma

  !> Density of t.
  pure function density(this, t) result(f)
    class(quantile_table_t), intent(in) :: this
    real(wp), intent(in) :: t
    real(wp) :: f

    if (this%is_beta) then
      f = exp(this%log_factor + this%a*log_logistic(t) + this%b*log_logistic(-t))
    else
      f = exp(this%log_factor + this%a*(1.0_wp + t - exp(t)))
    end if
  end function density

  !> 1/(1 + exp(-t)).
  elemental function logistic(t) result(x)
    real(wp), intent(in) :: t
    real(wp) :: x

    if (t < 0.0_wp) then
      x = exp(t)/(1.0_wp + exp(t))
    else
      x = 1.0_wp/(1.0_wp + exp(-t))
    end if
  end function logistic

  elemental function log_logistic(t) result(y)
    real(wp), intent(in) :: t
    real(wp) :: y

    y = min(t, 0.0_wp) - log_one_plus(exp(-abs(t)))
  end function log_logistic

  !> Zeros of T_10 and the coefficients of T_0 to T_9: column k holds those of T_k.
  pure subroutine tabulate_chebyshev(place, powers)
    real(wp), intent(out) :: place(0:DEGREE), powers(0:DEGREE, 0:DEGREE)
    integer :: k

    do k = 0, DEGREE
      place(k) = cos(angle(k))
    end do
    powers = 0.0_wp
    powers(0, 0) = 1.0_wp
    powers(1, 1) = 1.0_wp
    do k = 2, DEGREE
      powers(1:, k) = 2.0_wp*powers(:DEGREE - 1, k - 1)
      powers(:, k) = powers(:, k) - powers(:, k - 2)
    end do
  end subroutine tabulate_chebyshev

  !> Coefficients of the Chebyshev polynomials whose sum goes through the values at the zeros.
  pure function chebyshev_terms(values) result(terms)
    real(wp), intent(in) :: values(0:DEGREE)
    real(wp) :: terms(0:DEGREE)
    real(wp) :: middle
    integer :: j, k

    ! Without their common part the values leave fewer roundings.
    middle = values((DEGREE - 1)/2)
    do k = 0, DEGREE
      terms(k) = 0.0_wp
      do j = 0, DEGREE
        terms(k) = terms(k) + (values(j) - middle)*cos(k*angle(j))
      end do
      terms(k) = terms(k)*2.0_wp/(DEGREE + 1)
    end do
    terms(0) = 0.5_wp*terms(0) + middle
  end function chebyshev_terms

  !> Whose cosine is the zero number k of T_10.
  elemental function angle(k) result(theta)
    integer, intent(in) :: k
    real(wp), parameter :: PI = 3.14159265358979323846_wp
    real(wp) :: theta

    theta = PI*(2*k + 1)/(2*(DEGREE + 1))
  end function angle
end module sg_quantile_table
