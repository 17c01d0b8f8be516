!> The random fields of a case in a file, without a simulation: `--write-fields`.
module sg_write_fields
  use sg_available_memory, only: require_memory
  use sg_collapse, only: collapse_model_t
  use sg_command_line, only: options_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_field_record, only: case_fields_t, field_record_t, write_field_file, write_fields_csv
  use sg_kinds, only: i8
  use sg_posix, only: file_exists
  use sg_random_fields, only: field_values_t
  use sg_text, only: ends_with, to_text
  implicit none
  private

  public :: write_fields

  !> Realizations that 'cholesky' makes at a time.
  integer, parameter :: BLOCK = 32

contains

  !> HDF5: the study cases (or the one that the options name), all realizations (or one). CSV: one
  !> realization of a case with one field.
  subroutine write_fields(model, options, error)
    type(collapse_model_t), intent(inout) :: model
    type(options_t), intent(in) :: options
    type(error_t), allocatable, intent(out) :: error
    type(field_record_t), allocatable :: records(:)
    type(case_fields_t), allocatable :: cases(:)
    integer, allocatable :: chosen(:)
    logical :: is_there
    integer :: i

    is_there = file_exists(options%write_fields)
    if (is_there .and. .not. options%overwrite) then
      call raise(error, EXIT_BAD_INPUT, options%write_fields//' is there already (allowed: '// &
        '--overwrite, or another name)', 'write_fields')
      return
    else if (.not. model%grounds(1)%config%has_random_field) then
      call raise(error, EXIT_BAD_INPUT, 'the case has no random field to write', 'write_fields')
      return
    end if
    associate (cases => model%plan%cases)
      chosen = pack([(i, i=1, size(cases))], (options%study_case == '' .or. &
        cases%label == options%study_case) .and. .not. cases%is_homogeneous .and. &
        (cases%control_of == 0 .or. options%study_case /= ''))
    end associate
    if (size(chosen) == 0) call raise(error, EXIT_BAD_INPUT, 'no study case with random fields '// &
      'is called '//options%study_case, 'write_fields')
    if (allocated(error)) return
    associate (variant => model%plan%cases(chosen(1))%variant)
      if (any(model%plan%cases(chosen)%variant /= variant)) then
        call raise(error, EXIT_BAD_INPUT, 'the fields of a study that varies more than acf and '// &
          'cov are written case by case: give --study-case', 'write_fields')
        return
      end if
      allocate (records, source=model%grounds(variant)%field_records())
    end associate
    if (ends_with(options%write_fields, '.csv') .and. (size(chosen) > 1 .or. &
      options%realization == 0 .or. size(records) > 1)) then
      call raise(error, EXIT_BAD_INPUT, 'a CSV file takes one realization of one field: give '// &
        '--realization (and --study-case), or a file .h5', 'write_fields')
      return
    end if
    allocate (cases(size(chosen)))
    do i = 1, size(chosen)
      call make_case(model, chosen(i), options%realization, records, cases(i), error)
      if (allocated(error)) return
    end do
    if (ends_with(options%write_fields, '.csv')) then
      call write_fields_csv(options%write_fields, records(1)%name, records(1)%x, records(1)%y, &
        cases(1)%fields(1)%values(:, 1), error)
    else
      call write_field_file(options%write_fields, records, cases, error)
    end if
  end subroutine write_fields

  !> Only a factor of all points is worth taking several realizations together.
  pure logical function uses_cholesky(record)
    type(field_record_t), intent(in) :: record
    integer :: j

    uses_cholesky = any([(record%made_by(j)%method == 'cholesky', j=1, size(record%made_by))])
  end function uses_cholesky

  !> The fields of one study case: one realization, or all if `realization` is 0.
  subroutine make_case(model, case_index, realization, records, fields, error)
    type(collapse_model_t), intent(inout) :: model
    integer, intent(in) :: case_index, realization
    type(field_record_t), intent(in) :: records(:)
    type(case_fields_t), intent(out) :: fields
    type(error_t), allocatable, intent(out) :: error
    type(field_values_t), allocatable :: values(:, :)
    integer(i8) :: first, last, done
    integer :: k, m, most, n

    associate (one => model%plan%cases(case_index))
      first = max(int(realization, i8), 1_i8)
      last = one%member_count
      if (realization > 0) last = first
      if (last > one%member_count) then
        call raise(error, EXIT_BAD_INPUT, 'case '//trim(one%label)//' has realizations 1 to '// &
          to_text(one%member_count), 'write_fields')
        return
      end if
      fields%label = trim(one%label)
    end associate
    call require_memory(8*(last - first + 1)*sum([(size(records(k)%x, kind=i8), k=1, &
      size(records))]), 'the fields of all realizations', 'write fewer realizations', error)
    if (allocated(error)) return
    allocate (fields%fields(size(records)))
    do k = 1, size(records)
      allocate (fields%fields(k)%values(size(records(k)%x), last - first + 1))
    end do
    fields%ids = [(done, done=first, last)]
    most = merge(BLOCK, 1, any([(uses_cholesky(records(k)), k=1, size(records))]))
    done = 0
    do while (done < size(fields%ids))
      n = int(min(int(most, i8), size(fields%ids) - done))
      call model%make_fields(case_index, first + done, n, values, error)
      if (allocated(error)) return
      do m = 1, n
        do k = 1, size(records)
          fields%fields(k)%values(:, done + m) = values(k, m)%values
        end do
      end do
      done = done + n
    end do
  end subroutine make_case
end module sg_write_fields
