!> Special functions of the GNU Scientific Library.
module sg_special_functions
  use, intrinsic :: iso_c_binding, only: c_double
  implicit none
  private

  public :: normal_cdf, normal_upper_tail, normal_quantile, normal_upper_quantile, log_one_plus
  public :: student_quantile

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

    !> ln(1 + x), accurate for small x.
    pure function log_one_plus(x) result(y) bind(c, name='gsl_log1p')
      import :: c_double
      implicit none
      real(c_double), value :: x
      real(c_double) :: y
    end function log_one_plus
  end interface
end module sg_special_functions
