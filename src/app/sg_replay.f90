!> One member again, by itself: the same numbers as in the ensemble, bit for bit.
module sg_replay
  use, intrinsic :: iso_fortran_env, only: output_unit
  use sg_collapse, only: collapse_model_t
  use sg_command_line, only: options_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_field_record, only: field_record_t
  use sg_kinds, only: i8
  use sg_monitor, only: patient_monitor_t
  use sg_outcome, only: COLUMN_COUNT, COLUMNS, FIELD_MAX, FIELD_MEAN, FIELD_MIN, outcome_t, &
    status_text
  use sg_plan, only: plan_t
  use sg_snapshot, only: snapshot_name
  use sg_text, only: joined, to_text
  implicit none
  private

  public :: choose_member, replay_member

contains

  !> Finds the member that the options name in the plan: the position of its case.
  subroutine choose_member(plan, options, case_index, error)
    type(plan_t), intent(in) :: plan
    type(options_t), intent(in) :: options
    integer, intent(out) :: case_index
    type(error_t), allocatable, intent(out) :: error
    logical :: several

    if (options%study_case == '') then
      case_index = size(plan%cases)
      several = count(plan%cases%is_homogeneous) > 1 .or. count(.not. plan%cases%is_homogeneous) > 1
      if (several) call raise(error, EXIT_BAD_INPUT, &
        '--realization of a study needs --study-case, one of: '//labels(plan), 'choose_member')
    else
      case_index = plan%find_case(options%study_case)
      if (case_index == 0) call raise(error, EXIT_BAD_INPUT, 'no study case is called '// &
        options%study_case//' (there are: '//labels(plan)//')', 'choose_member')
    end if
    if (allocated(error)) return
    if (.not. plan%holds(case_index, int(options%realization, i8))) call raise(error, &
      EXIT_BAD_INPUT, 'case '//trim(plan%cases(case_index)%label)//' has realizations 1 to '// &
      to_text(plan%cases(case_index)%member_count), 'choose_member')
  end subroutine choose_member

  !> Computes the member that the options name, of the case `case_index`, and prints its row; with
  !> --snapshots its states are written too.
  subroutine replay_member(model, options, case_index)
    type(collapse_model_t), intent(inout) :: model
    type(options_t), intent(in) :: options
    integer, intent(in) :: case_index
    type(patient_monitor_t) :: monitor
    type(outcome_t) :: outcome
    type(field_record_t), allocatable :: fields(:)
    character(len=:), allocatable :: units
    integer(i8) :: id
    integer :: k

    id = int(options%realization, i8)
    model%record_all = options%snapshots
    model%record_nothing = .not. options%snapshots
    call model%run(case_index, id, monitor, outcome)
    write (output_unit, '(a)') snapshot_name( &
      trim(model%plan%cases(case_index)%label), id)//': '//status_text(outcome%status)
    if (outcome%reason /= '') write (output_unit, '(a)') '  '//outcome%reason
    allocate (fields, source=model%grounds(model%field_ground())%field_records())
    do k = 1, COLUMN_COUNT
      units = trim(COLUMNS(k)%units)
      if (any(k == [FIELD_MEAN, FIELD_MIN, FIELD_MAX]) .and. size(fields) > 0) units = &
        fields(1)%units
      write (output_unit, '(2x, a24, 1x, a, 1x, a)') COLUMNS(k)%name, to_text(outcome%values(k)), &
        units
    end do
    if (options%snapshots) write (output_unit, &
      '(a)') '  written to '//model%grounds(1)%config%output%directory//'/snapshots'
  end subroutine replay_member

  pure function labels(plan) result(text)
    type(plan_t), intent(in) :: plan
    character(len=:), allocatable :: text

    text = joined(plan%cases%label, ', ')
  end function labels
end module sg_replay
