!> One member again, by itself: the same numbers as in the ensemble, bit for bit.
module sg_replay
  use, intrinsic :: iso_fortran_env, only: output_unit
  use sg_collapse, only: collapse_model_t
  use sg_command_line, only: options_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: i8
  use sg_monitor, only: patient_monitor_t
  use sg_outcome, only: COLUMN_COUNT, COLUMNS, outcome_t, status_text
  use sg_snapshot, only: snapshot_name
  use sg_text, only: to_text
  implicit none
  private

  public :: replay_member

contains

  !> Computes the member that the options name and prints its row; with --snapshots its states are
  !> written too.
  subroutine replay_member(model, options, error)
    type(collapse_model_t), intent(inout) :: model
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(patient_monitor_t) :: monitor
    type(outcome_t) :: outcome
    character(len=:), allocatable :: label
    integer(i8) :: id
    integer :: case_index, k

    id = int(options%realization, i8)
    label = options%study_case
    if (label == '') then
      case_index = size(model%plan%cases)
      if (case_index > 2) then
        call raise(error, EXIT_BAD_INPUT, &
          '--realization of a study needs --study-case, one of: '//labels(model), &
                   'replay_member')
        return
      end if
      label = trim(model%plan%cases(case_index)%label)
    end if
    case_index = model%plan%find_case(label)
    if (case_index == 0) then
      call raise(error, EXIT_BAD_INPUT, &
        'no study case is called '//label//' (there are: '//labels(model)//')', &
                 'replay_member')
      return
    end if
    if (.not. model%plan%holds(case_index, id)) then
      call raise(error, EXIT_BAD_INPUT, 'case '//label//' has realizations 1 to '// &
                 to_text(model%plan%cases(case_index)%member_count), 'replay_member')
      return
    end if
    model%record_all = options%snapshots
    model%record_nothing = .not. options%snapshots
    call model%run(case_index, id, monitor, outcome)
    write (output_unit, '(a)') snapshot_name(label, id)//': '//status_text(outcome%status)
    if (outcome%reason /= '') write (output_unit, '(a)') '  '//outcome%reason
    do k = 1, COLUMN_COUNT
      write (output_unit, '(2x, a24, 1x, a, 1x, a)') COLUMNS(k)%name, &
        to_text(outcome%values(k)), trim(COLUMNS(k)%units)
    end do
    if (options%snapshots) write (output_unit, &
      '(a)') '  written to '//model%config%output%directory//'/snapshots'
  end subroutine replay_member

  function labels(model) result(text)
    type(collapse_model_t), intent(in) :: model
    character(len=:), allocatable :: text
    integer :: k

    text = trim(model%plan%cases(1)%label)
    do k = 2, size(model%plan%cases)
      text = text//', '//trim(model%plan%cases(k)%label)
    end do
  end function labels
end module sg_replay
