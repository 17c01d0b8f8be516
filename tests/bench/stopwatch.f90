!> A monitor that says GO_ON and notes the processor time whenever it is asked, over repeated runs
!> of the same computation.
module stopwatch
  use sg_kinds, only: wp
  use sg_monitor, only: GO_ON, monitor_t
  implicit none
  private

  public :: stopwatch_t

  type, extends(monitor_t) :: stopwatch_t
    private
    !> Processor time at the last question, and the least between two questions in any run so far,
    !> s; questions of this run.
    real(wp) :: last = 0.0_wp
    real(wp), allocatable :: least(:)
    integer :: asked = 0
  contains
    procedure :: start
    procedure :: ask => note_and_go_on
    procedure :: stop => note_time
    procedure :: least_seconds
  end type stopwatch_t

contains

  !> A run begins.
  subroutine start(this)
    class(stopwatch_t), intent(inout) :: this

    if (.not. allocated(this%least)) allocate (this%least(0))
    this%asked = 0
    call cpu_time(this%last)
  end subroutine start

  function note_and_go_on(this) result(answer)
    class(stopwatch_t), intent(inout) :: this
    integer :: answer

    call this%stop()
    answer = GO_ON
  end function note_and_go_on

  !> A part of the run ends.
  subroutine note_time(this)
    class(stopwatch_t), intent(inout) :: this
    real(wp) :: now

    call cpu_time(now)
    this%asked = this%asked + 1
    if (this%asked > size(this%least)) this%least = [this%least, huge(1.0_wp)]
    this%least(this%asked) = min(this%least(this%asked), now - this%last)
    this%last = now
  end subroutine note_time

  !> Sum over the parts of a run of the least processor time of each, s.
  pure function least_seconds(this) result(seconds)
    class(stopwatch_t), intent(in) :: this
    real(wp) :: seconds
    seconds = sum(this%least)
  end function least_seconds
end module stopwatch
