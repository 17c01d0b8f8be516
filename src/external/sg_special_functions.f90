!> Special functions of the GNU Scientific Library.
module sg_special_functions
  use, intrinsic :: iso_c_binding, only: c_double, c_funptr, c_int
  implicit none
  private

  public :: normal_cdf, normal_upper_tail, normal_quantile, normal_upper_quantile, log_one_plus
  public :: exp_minus_one, log_one_plus_minus, student_quantile
  public :: gamma_star, zeta_minus_one
  public :: gamma_cdf, gamma_upper_tail, beta_cdf, beta_upper_tail, set_error_handler_off

  public :: log_bessel_k, log_gamma_function

  interface
    !> x of P(x) = p for Student's t with `freedom` degrees of freedom.
    pure function student_quantile(p, freedom) result(x) bind(c, name='gsl_cdf_tdist_Pinv')
      import :: c_double
      implicit none
      real(c_double), value :: p, freedom
      real(c_double) :: x
    end function student_quantile

    !> P(x), the standard normal distribution function.
    pure function normal_cdf(x) result(p) bind(c, name='gsl_cdf_ugaussian_P')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: p
    end function normal_cdf

    !> Q(x) = 1 - P(x), accurate where P(x) is near 1.
    pure function normal_upper_tail(x) result(q) bind(c, name='gsl_cdf_ugaussian_Q')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: q
    end function normal_upper_tail

    !> The x with P(x) = p, 0 < p < 1.
    pure function normal_quantile(p) result(x) bind(c, name='gsl_cdf_ugaussian_Pinv')
      import :: c_double
      implicit none
      real(c_double), value :: p
      real(c_double) :: x
    end function normal_quantile

    !> The x with Q(x) = q, 0 < q < 1.
    pure function normal_upper_quantile(q) result(x) bind(c, name='gsl_cdf_ugaussian_Qinv')
      import :: c_double
      implicit none
      real(c_double), value :: q
      real(c_double) :: x
    end function normal_upper_quantile

    !> ln Gamma(x), x > 0.
    pure function log_gamma_function(x) result(y) bind(c, name='gsl_sf_lngamma')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: y
    end function log_gamma_function

    !> ln K_nu(x), the modified Bessel function of the second kind, nu >= 0, x > 0.
    pure function log_bessel_k(nu, x) result(y) bind(c, name='gsl_sf_bessel_lnKnu')
      import :: c_double
      implicit none
      real(c_double), value :: nu, x
      real(c_double) :: y
    end function log_bessel_k

    !> ln(1 + x), accurate for small x.
    pure function log_one_plus(x) result(y) bind(c, name='gsl_log1p')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: y
    end function log_one_plus

    !> exp(x) - 1, accurate for small x.
    pure function exp_minus_one(x) result(y) bind(c, name='gsl_expm1')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: y
    end function exp_minus_one

    !> ln(1 + x) - x, accurate for small x; x > -1.
    pure function log_one_plus_minus(x) result(y) bind(c, name='gsl_sf_log_1plusx_mx')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: y
    end function log_one_plus_minus

    !> Gamma(x)/(sqrt(2 pi) x^(x - 1/2) exp(-x)), x > 0: what Stirling's formula leaves.
    pure function gamma_star(x) result(y) bind(c, name='gsl_sf_gammastar')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: y
    end function gamma_star

    !> Riemann's zeta(n) - 1.
    pure function zeta_minus_one(n) result(y) bind(c, name='gsl_sf_zetam1_int')
      import :: c_double, c_int
      implicit none
      integer(c_int), value :: n
      real(c_double) :: y
    end function zeta_minus_one

    !> P(x) of the gamma law; near the middle of narrow laws (shape beyond 1000) not accurate.
    !> For this and the next three, call `set_error_handler_off` before.
    pure function gamma_cdf(x, shape, scale) result(p) bind(c, name='gsl_cdf_gamma_P')
      import :: c_double
      implicit none
      real(c_double), value :: x, shape, scale
      real(c_double) :: p
    end function gamma_cdf

    !> Q(x) = 1 - P(x) of the gamma law.
    pure function gamma_upper_tail(x, shape, scale) result(q) bind(c, name='gsl_cdf_gamma_Q')
      import :: c_double
      implicit none
      real(c_double), value :: x, shape, scale
      real(c_double) :: q
    end function gamma_upper_tail

    !> P(x) of the beta law on [0, 1], density in proportion to x^(a - 1) (1 - x)^(b - 1); NaN where
    !> its continued fraction does not converge (a or b of 1e5 or so).
    pure function beta_cdf(x, a, b) result(p) bind(c, name='gsl_cdf_beta_P')
      import :: c_double
      implicit none
      real(c_double), value :: x, a, b
      real(c_double) :: p
    end function beta_cdf

    !> Q(x) = 1 - P(x) of the beta law.
    pure function beta_upper_tail(x, a, b) result(q) bind(c, name='gsl_cdf_beta_Q')
      import :: c_double
      implicit none
      real(c_double), value :: x, a, b
      real(c_double) :: q
    end function beta_upper_tail

    function gsl_set_error_handler_off() result(handler) &
      bind(c, name='gsl_set_error_handler_off')
      import :: c_funptr
      implicit none
      type(c_funptr) :: handler
    end function gsl_set_error_handler_off
  end interface

contains

  !> From now on a function of the library that fails gives NaN, or what it has; without this call
  !> the library aborts the program.
  subroutine set_error_handler_off()
    type(c_funptr) :: handler

    handler = gsl_set_error_handler_off()
  end subroutine set_error_handler_off
end module sg_special_functions
