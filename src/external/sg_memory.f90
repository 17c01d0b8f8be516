!> Where arrays lie in memory.
module sg_memory
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  use sg_kinds, only: wp
  implicit none
  private

  public :: aligned_start, ALIGNMENT_SLACK

  !> Bytes of a cache line.
  integer, parameter :: LINE = 64
  !> Bytes of an element.
  integer, parameter :: ELEMENT = storage_size(1.0_wp)/8
  !> Elements to allocate beyond what is needed, so that an aligned start can be chosen.
  integer, parameter :: ALIGNMENT_SLACK = LINE/ELEMENT - 1

contains

  !> Position of the first element of `store` that begins a cache line.
  function aligned_start(store) result(start)
    real(wp), intent(in), target, contiguous :: store(:)
    integer :: start
    integer(c_intptr_t) :: address

    address = transfer(c_loc(store(1)), address)
    start = 1 + int(modulo(-address, int(LINE, c_intptr_t)))/ELEMENT
  end function aligned_start
end module sg_memory
