!> A member without a simulation: its runouts are weighted means S = a^T v of the first random field
!> v. Where that is normal, so is S, with mean a^T mu and variance a^T C a; so all that is behind a
!> member (fields, messages, journal, files, statistics) can be checked against what is known
!> exactly (`&solver model='linear_functional'`).
module sg_linear_functional
  use sg_ground, only: ground_t
  use sg_kinds, only: sp, wp
  use sg_outcome, only: COLUMNS, outcome_t, RUNOUT_CONNECTED, RUNOUT_MAX, RUNOUT_Q99, &
    RUNOUT_Q995, SECONDS, SETTLED, STATUS_OK, WALL_TOUCHED
  use sg_random_fields, only: field_values_t
  use sg_timer, only: wall_seconds
  implicit none
  private

  public :: take_functionals

contains

  !> runout_max: the mean over the points; runout_q99: the value at the first point; runout_q995 and
  !> runout_connected: means with weights that grow in proportion to the distance from the left and
  !> from the lower edge of the points. In the unit of the field. All other columns are 0.
  subroutine take_functionals(ground, values, outcome)
    type(ground_t), intent(in) :: ground
    !> Of each field.
    type(field_values_t), intent(in) :: values(:)
    type(outcome_t), intent(inout) :: outcome
    real(wp) :: begin

    begin = wall_seconds()
    outcome%status = STATUS_OK
    outcome%values = 0.0_wp
    where (COLUMNS%name(:7) == 'failure') outcome%values = -1.0_wp
    outcome%height = 0.0_sp
    associate (field => ground%fields(1)%fields(1), v => values(1)%values)
      outcome%values(RUNOUT_MAX) = sum(v)/size(v)
      outcome%values(RUNOUT_Q99) = v(1)
      outcome%values(RUNOUT_Q995) = weighted_mean(v, field%x - minval(field%x))
      outcome%values(RUNOUT_CONNECTED) = weighted_mean(v, field%y - minval(field%y))
    end associate
    outcome%values(SETTLED) = 1.0_wp
    outcome%values(SECONDS) = wall_seconds() - begin
  end subroutine take_functionals

  !> The plain mean where all weights are 0 (points in one column or row).
  pure real(wp) function weighted_mean(values, weights)
    real(wp), intent(in) :: values(:), weights(:)

    weighted_mean = sum(values)/size(values)
    if (sum(weights) > 0.0_wp) weighted_mean = sum(values*weights)/sum(weights)
  end function weighted_mean
end module sg_linear_functional
