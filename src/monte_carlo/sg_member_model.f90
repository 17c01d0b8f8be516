!> What the Monte Carlo layer knows of a simulation: it turns (case, id) into a row.
module sg_member_model
  implicit none
  private

  public :: member_model_t

  type, abstract :: member_model_t
  contains
    procedure(run_interface), deferred :: run
  end type member_model_t

  abstract interface
    !> Computes one member. The outcome depends on `case_index` and `id` alone (column `seconds`
    !> apart), never on the rank or on what was computed before. A failed member is data: its status
    !> and reason. When the monitor answers ABANDON, `outcome%status` is STATUS_ABANDONED and the
    !> rest of the outcome means nothing.
    subroutine run_interface(this, case_index, id, monitor, outcome)
      use sg_kinds, only: i8
      use sg_monitor, only: monitor_t
      use sg_outcome, only: outcome_t
      import :: member_model_t
      implicit none
      class(member_model_t), intent(inout) :: this
      !> Position in the plan, from 1.
      integer, intent(in) :: case_index
      !> Realization, from 1.
      integer(i8), intent(in) :: id
      class(monitor_t), intent(inout) :: monitor
      type(outcome_t), intent(out) :: outcome
    end subroutine run_interface
  end interface
end module sg_member_model
