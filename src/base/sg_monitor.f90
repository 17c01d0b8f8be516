!> What a long computation asks, now and then, of whoever started it: may I go on?
!> It lets the solver be interrupted and lets rank 0 serve other ranks while it computes, without
!> the solver knowing of MPI, signals or files.
module sg_monitor
  implicit none
  private

  public :: monitor_t, patient_monitor_t
  public :: GO_ON, ABANDON, OUT_OF_TIME

  !> Answers of a monitor.
  integer, parameter :: GO_ON = 0
  !> The run is to end: drop this member, it will be computed again later.
  integer, parameter :: ABANDON = 1
  !> This member has used up its own time limit: record it as failed.
  integer, parameter :: OUT_OF_TIME = 2

  type, abstract :: monitor_t
  contains
    procedure(ask_interface), deferred :: ask
  end type monitor_t

  abstract interface
    !> Called every few milliseconds of computing; one of GO_ON, ABANDON, OUT_OF_TIME.
    function ask_interface(this) result(answer)
      import :: monitor_t
      implicit none
      class(monitor_t), intent(inout) :: this
      integer :: answer
    end function ask_interface
  end interface

  !> Always says GO_ON.
  type, extends(monitor_t) :: patient_monitor_t
  contains
    procedure :: ask => always_go_on
  end type patient_monitor_t

contains

  function always_go_on(this) result(answer)
    class(patient_monitor_t), intent(inout) :: this
    integer :: answer

    answer = GO_ON
  end function always_go_on
end module sg_monitor
