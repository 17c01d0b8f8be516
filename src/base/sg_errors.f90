!> The one error type. A routine that can fail takes, as its last argument,
!> `type(error_t), allocatable, intent(out) :: error` and returns at once when it is set; only the
!> main program turns it into an exit code.
module sg_errors
  implicit none
  private

  public :: error_t, raise
  public :: EXIT_OK, EXIT_INTERNAL, EXIT_BAD_INPUT, EXIT_STOPPED_EARLY, EXIT_TOO_MANY_FAILED

  integer, parameter :: EXIT_OK = 0
  integer, parameter :: EXIT_INTERNAL = 1
  integer, parameter :: EXIT_BAD_INPUT = 2
  integer, parameter :: EXIT_STOPPED_EARLY = 3
  integer, parameter :: EXIT_TOO_MANY_FAILED = 4

  type :: error_t
    !> Exit code that the program ends with: one of the EXIT_ constants.
    integer :: code = EXIT_INTERNAL
    !> What is wrong, in words a user can act on; may span lines.
    character(len=:), allocatable :: message
    !> Where it was noticed: `file:line` of a namelist, or the procedure.
    character(len=:), allocatable :: place
  end type error_t

contains

  !> Sets `error`.
  pure subroutine raise(error, code, message, place)
    type(error_t), allocatable, intent(inout) :: error
    integer, intent(in) :: code
    character(len=*), intent(in) :: message
    character(len=*), intent(in) :: place

    if (.not. allocated(error)) allocate (error)
    error%code = code
    error%message = message
    error%place = place
  end subroutine raise
end module sg_errors
