!> Sorting, by GSL.
module sg_sorting
  use, intrinsic :: iso_c_binding, only: c_double, c_size_t
  use sg_kinds, only: wp
  implicit none
  private

  public :: sort_index

  interface
    subroutine gsl_sort_index(order, values, stride, count) bind(c, name='gsl_sort_index')
      import :: c_double, c_size_t
      implicit none
      integer(c_size_t), intent(out) :: order(*)
      real(c_double), intent(in) :: values(*)
      integer(c_size_t), value :: stride, count
    end subroutine gsl_sort_index
  end interface

contains

  !> Positions (from 1) that bring `values` into rising order; the same values always give the same
  !> order.
  function sort_index(values) result(order)
    real(wp), intent(in) :: values(:)
    integer :: order(size(values))
    integer(c_size_t), allocatable :: zero_based(:)

    allocate (zero_based(size(values)))
    if (size(values) > 0) then
      call gsl_sort_index(zero_based, values, 1_c_size_t, size(values, kind=c_size_t))
    end if
    order = int(zero_based) + 1
  end function sort_index
end module sg_sorting
