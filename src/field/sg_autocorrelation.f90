!> The five autocorrelation functions of Table 1 of the paper. Each is a product of one function
!> rho of the lag along x and the same of the lag along y, and rho depends on t = tau/delta alone,
!> delta being the scale of fluctuation: 2 * integral of rho over tau >= 0 equals delta.
module sg_autocorrelation
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_kinds, only: wp
  use sg_text, only: lower_case
  implicit none
  private

  public :: autocorrelation_t, ACF_NAMES

  character(len=3), parameter :: ACF_NAMES(5) = ['snx', 'sqx', 'smk', 'csx', 'bin']

  abstract interface
    !> Correlation at the lag t >= 0, in scales of fluctuation.
    pure function rho_interface(t) result(rho)
      import :: wp
      implicit none
      real(wp), intent(in) :: t
      real(wp) :: rho
    end function rho_interface
  end interface

  type :: autocorrelation_t
    character(len=3) :: name = ''
    procedure(rho_interface), pointer, nopass :: rho => null()
  contains
    procedure :: init
    procedure :: fill_matrix
  end type autocorrelation_t

contains

  !> By name, one of ACF_NAMES; another is refused as bad input.
  subroutine init(this, name, error)
    class(autocorrelation_t), intent(out) :: this
    character(len=*), intent(in) :: name
    type(error_t), allocatable, intent(out) :: error

    select case (lower_case(name))
    case ('snx')
      this%rho => single_exponential
    case ('sqx')
      this%rho => squared_exponential
    case ('smk')
      this%rho => second_order_markov
    case ('csx')
      this%rho => cosine_exponential
    case ('bin')
      this%rho => binary_noise
    case default
      call raise(error, EXIT_BAD_INPUT, "no autocorrelation function is called '"//trim(name)// &
        "' (allowed: snx, sqx, smk, csx, bin)", 'autocorrelation')
      return
    end select
    this%name = lower_case(name)
  end subroutine init

  !> C(i, j) = rho(|x_i - x_j|/scale), exactly symmetric with unit diagonal.
  pure subroutine fill_matrix(this, coordinates, scale, matrix)
    class(autocorrelation_t), intent(in) :: this
    !> [n], in m.
    real(wp), intent(in) :: coordinates(:)
    !> Scale of fluctuation in m, > 0.
    real(wp), intent(in) :: scale
    !> [n, n].
    real(wp), intent(out) :: matrix(:, :)
    integer :: i, j

    do j = 1, size(coordinates)
      matrix(j, j) = 1.0_wp
      do i = j + 1, size(coordinates)
        matrix(i, j) = this%rho(abs(coordinates(i) - coordinates(j))/scale)
        matrix(j, i) = matrix(i, j)
      end do
    end do
  end subroutine fill_matrix

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
end module sg_autocorrelation
