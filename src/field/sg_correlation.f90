!> Correlation of a Gaussian field between two points of the plane: an autocorrelation function,
!> scales of fluctuation along the bedding and across it, the slope of the bedding, and whether
!> values are those of points or averages over their cells.
module sg_correlation
  use sg_angles, only: DEGREE
  use sg_autocorrelation, only: autocorrelation_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: wp
  implicit none
  private

  public :: correlation_t

  !> Gauss-Legendre rule of 8 points on (-1, 1), the positive half (Abramowitz & Stegun 1964, Table
  !> 25.4): exact for polynomials of degree 15.
  real(wp), parameter :: NODES(4) = [0.1834346424956498_wp, 0.5255324099163290_wp, &
    0.7966664774136267_wp, 0.9602898564975363_wp]
  real(wp), parameter :: SHARES(4) = [0.3626837833783620_wp, 0.3137066458778873_wp, &
    0.2223810344533745_wp, 0.1012285362903763_wp]
  !> Length of a panel of the rule, in scales of fluctuation: exp(-4 t) over half a scale is a
  !> polynomial of degree 15 to 1e-17.
  real(wp), parameter :: PANEL_LENGTH = 0.5_wp
  !> Halvings of the panel at lag 0: what 1 - t^0.6 (nu = 0.3) is off by in the last one is 1e-14.
  integer, parameter :: HALVINGS = 30

  type :: correlation_t
    type(autocorrelation_t) :: acf
    !> Scales of fluctuation along the bedding and across it, in m.
    real(wp) :: scale(2) = 1.0_wp
    !> Of the bedding, from x, counter-clockwise.
    real(wp) :: rotation = 0.0_wp
    !> rho(sqrt(tx^2 + ty^2)) instead of rho(tx) rho(ty).
    logical :: is_radial = .false.
    !> Width and height of the cells that are averaged over, in m; 0: values of points.
    real(wp) :: cell(2) = 0.0_wp
    !> Cosine and sine of the rotation.
    real(wp), private :: cosine = 1.0_wp, sine = 0.0_wp
  contains
    procedure :: init
    procedure :: average_over
    procedure :: is_product
    procedure :: at
    procedure :: along
    procedure :: variance
    procedure :: fill_axis
  end type correlation_t

contains

  !> Refused as bad input: an unknown name, scales that are not positive, a radial form that is no
  !> correlation in the plane.
  subroutine init(this, acf, scale, error, smoothness, is_radial, rotation)
    class(correlation_t), intent(out) :: this
    !> One of ACF_NAMES of sg_autocorrelation.
    character(len=*), intent(in) :: acf
    !> In m.
    real(wp), intent(in) :: scale(2)
    type(error_t), allocatable, intent(out) :: error
    !> Of acf 'matern' alone.
    real(wp), intent(in), optional :: smoothness
    logical, intent(in), optional :: is_radial
    !> In degrees.
    real(wp), intent(in), optional :: rotation

    call this%acf%init(acf, error, smoothness)
    if (allocated(error)) return
    if (.not. all(scale > 0.0_wp)) then
      call raise(error, EXIT_BAD_INPUT, 'the scales of fluctuation must be positive', 'correlation')
      return
    end if
    this%scale = scale
    if (present(rotation)) this%rotation = modulo(rotation, 180.0_wp)
    if (abs(this%rotation - 90.0_wp) <= 0.0_wp) then
      ! Beds that stand upright: along and across change places.
      this%scale = scale([2, 1])
      this%rotation = 0.0_wp
    end if
    this%cosine = cos(this%rotation*DEGREE)
    this%sine = sin(this%rotation*DEGREE)
    if (present(is_radial)) this%is_radial = is_radial .and. .not. this%acf%is_product_of_itself
    if (this%is_radial .and. .not. this%acf%is_planar) call raise(error, EXIT_BAD_INPUT, &
      "form='radial' does not exist for acf='"//trim(this%acf%name)//"': as a function of the "// &
      "distance it is no correlation in the plane (allowed: form='product')", 'correlation')
  end subroutine init

  !> Values are averages over cells of this size from now on; a correlation that is no product of
  !> functions of x and y is refused as bad input.
  subroutine average_over(this, cell, error)
    class(correlation_t), intent(inout) :: this
    !> Width and height in m, > 0.
    real(wp), intent(in) :: cell(2)
    type(error_t), allocatable, intent(out) :: error

    if (.not. this%is_product()) then
      call raise(error, EXIT_BAD_INPUT, "averaging='cell' is for form='product' without rotation", &
        'correlation')
      return
    end if
    this%cell = cell
  end subroutine average_over

  !> Is it a function of the lag along x times one of that along y?
  pure logical function is_product(this)
    class(correlation_t), intent(in) :: this

    is_product = .not. this%is_radial .and. .not. abs(this%sine) > 0.0_wp
  end function is_product

  !> Correlation (of averages: covariance) of two values whose places are (dx, dy) apart, in m.
  pure function at(this, dx, dy) result(rho)
    class(correlation_t), intent(in) :: this
    real(wp), intent(in) :: dx, dy
    real(wp) :: rho, t(2)

    if (this%is_product()) then
      rho = this%along(1, dx)*this%along(2, dy)
      return
    end if
    t = abs([this%cosine*dx + this%sine*dy, this%cosine*dy - this%sine*dx])/this%scale
    if (this%is_radial) then
      rho = this%acf%rho(norm2(t))
    else
      rho = this%acf%rho(t(1))*this%acf%rho(t(2))
    end if
  end function at

  !> Variance of a value: 1, or what averaging leaves of it.
  pure real(wp) function variance(this)
    class(correlation_t), intent(in) :: this

    variance = this%at(0.0_wp, 0.0_wp)
  end function variance

  !> The factor of a product that belongs to the lag `tau` in m along one axis, 1 for x, 2 for y.
  pure function along(this, axis, tau) result(rho)
    class(correlation_t), intent(in) :: this
    integer, intent(in) :: axis
    real(wp), intent(in) :: tau
    real(wp) :: rho

    if (this%cell(axis) > 0.0_wp) then
      rho = averaged(this%acf, abs(tau)/this%scale(axis), this%cell(axis)/this%scale(axis))
    else
      rho = this%acf%rho(abs(tau)/this%scale(axis))
    end if
  end function along

  !> C(i, j) = along(x_i - x_j), exactly symmetric.
  pure subroutine fill_axis(this, axis, coordinates, matrix)
    class(correlation_t), intent(in) :: this
    !> 1 for x, 2 for y.
    integer, intent(in) :: axis
    !> [n], in m.
    real(wp), intent(in) :: coordinates(:)
    !> [n, n].
    real(wp), intent(out) :: matrix(:, :)
    integer :: i, j

    do j = 1, size(coordinates)
      do i = j, size(coordinates)
        matrix(i, j) = this%along(axis, coordinates(i) - coordinates(j))
        matrix(j, i) = matrix(i, j)
      end do
    end do
  end subroutine fill_axis

  !> Covariance of the averages over two intervals of length `width` whose centres are `lag` apart,
  !> in scales of fluctuation: the integral of (1 - |u|) rho(|lag + width u|) over u from -1 to 1
  !> (Vanmarcke 1983). For lag 0 it is the variance reduction Gamma^2(width).
  pure function averaged(acf, lag, width) result(covariance)
    type(autocorrelation_t), intent(in) :: acf
    real(wp), intent(in) :: lag, width
    real(wp) :: covariance, ends(6)
    integer :: i, k

    ! Between these the integrand is smooth: its own kink, those of rho.
    ends = [-1.0_wp, 0.0_wp, 1.0_wp, -lag/width, (acf%kink - lag)/width, -(acf%kink + lag)/width]
    ends = min(max(ends, -1.0_wp), 1.0_wp)
    do i = 2, size(ends)
      do k = i, 2, -1
        if (ends(k) < ends(k - 1)) ends(k - 1:k) = ends(k:k - 1:-1)
      end do
    end do
    covariance = 0.0_wp
    do i = 2, size(ends)
      if (.not. ends(i) > ends(i - 1)) cycle
      if (.not. abs(ends(i - 1) + lag/width) > 0.0_wp) then
        covariance = covariance + from_cusp(ends(i - 1), ends(i))
      else if (.not. abs(ends(i) + lag/width) > 0.0_wp) then
        covariance = covariance + from_cusp(ends(i), ends(i - 1))
      else
        covariance = covariance + integral(ends(i - 1), ends(i))
      end if
    end do

  contains

    !> Of the integrand between u = cusp, where the lag is 0, and the other end: the functions may
    !> begin there like t^(2 nu), so pieces get shorter towards it.
    pure function from_cusp(cusp, other) result(total)
      real(wp), intent(in) :: cusp, other
      real(wp) :: total, outer, middle
      integer :: halving

      total = 0.0_wp
      outer = other
      do halving = 1, HALVINGS
        middle = 0.5_wp*(cusp + outer)
        total = total + integral(min(middle, outer), max(middle, outer))
        outer = middle
      end do
      total = total + integral(min(cusp, outer), max(cusp, outer))
    end function from_cusp

    !> Of the integrand between a and b, in equal panels.
    pure function integral(a, b) result(total)
      real(wp), intent(in) :: a, b
      real(wp) :: total, middle, half, u
      integer :: panels, panel, node

      total = 0.0_wp
      panels = ceiling((b - a)*width/PANEL_LENGTH)
      half = 0.5_wp*(b - a)/max(panels, 1)
      do panel = 1, panels
        middle = a + (2*panel - 1)*half
        do node = 1, size(NODES)
          u = middle - half*NODES(node)
          total = total + half*SHARES(node)*(1.0_wp - abs(u))*acf%rho(abs(lag + width*u))
          u = middle + half*NODES(node)
          total = total + half*SHARES(node)*(1.0_wp - abs(u))*acf%rho(abs(lag + width*u))
        end do
      end do
    end function integral
  end function averaged
end module sg_correlation
