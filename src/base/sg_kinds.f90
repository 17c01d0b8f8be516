!> Kinds used everywhere.
module sg_kinds
  use, intrinsic :: iso_fortran_env, only: int32, int64, int8, real32, real64
  implicit none
  private

  public :: wp, sp, dp, i1, i4, i8

  !> Working precision of state, geometry and statistics; the kernel in single precision has sp
  !> under this name (cmake/SgimpPrecision.cmake).
  integer, parameter :: wp = real64
  !> Single precision: bulky output, and what the kernel works with when asked to.
  integer, parameter :: sp = real32
  !> Double precision, whatever the kernel works with.
  integer, parameter :: dp = real64
  !> A byte.
  integer, parameter :: i1 = int8
  integer, parameter :: i4 = int32
  integer, parameter :: i8 = int64
end module sg_kinds
