!> The command line: words in, options out.
module sg_command_line
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_fault_list, only: did_you_mean
  use sg_kinds, only: i8, wp
  use sg_text, only: ends_with, lower_case
  implicit none
  private

  public :: options_t, parse_command_line, usage_text

  type :: options_t
    !> The case file; empty where none is needed.
    character(len=:), allocatable :: case_file
    logical :: check = .false., dry = .false., keys = .false., json = .false., defaults = .false.
    logical :: snapshots = .false., overwrite = .false., version = .false., help = .false.
    !> Group for --keys; empty for all.
    character(len=:), allocatable :: keys_group
    !> Member to replay; 0 for none, and the case it belongs to; empty for the only one.
    integer :: realization = 0
    character(len=:), allocatable :: study_case
    !> First and last id that this run computes; all by default.
    integer(i8) :: members(2) = [1_i8, huge(1_i8)]
    !> Directory instead of that of the case file; empty for none.
    character(len=:), allocatable :: output
    !> File that the random fields are written to, instead of running; empty for none.
    character(len=:), allocatable :: write_fields
    !> Wall clock limit of the whole run in s; 0 for none.
    real(wp) :: walltime = 0.0_wp
  end type options_t

  character(len=*), parameter :: KNOWN(15) = [character(len=14) :: '--check', '--dry', '--keys', &
    '--json', '--defaults', '--write-fields', '--members', &
    '--realization', '--study-case', '--snapshots', '--output', '--overwrite', '--walltime', &
    '--version', '--help']

contains

  !> Bad input: an unknown option, a missing or wrong value, no case file or more than one.
  subroutine parse_command_line(words, options, error)
    character(len=*), intent(in) :: words(:)
    type(options_t), intent(out) :: options
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    options%case_file = ''
    options%keys_group = ''
    options%study_case = ''
    options%output = ''
    options%write_fields = ''
    k = 1
    do while (k <= size(words) .and. .not. allocated(error))
      call take_word(words, k, options, error)
      k = k + 1
    end do
    if (allocated(error)) return
    if (options%help .or. options%version) return
    if (options%json .and. .not. options%keys) then
      call fail('--json belongs to --keys', error)
      return
    end if
    if (options%keys .or. options%defaults) return
    if (options%case_file == '') then
      call fail('no case file given. Usage: sgimp CASE.nml [options]; see sgimp --help', error)
    else if (options%realization == 0 .and. options%snapshots) then
      call fail('--snapshots belongs to --realization', error)
    else if (options%realization == 0 .and. options%study_case /= '' .and. &
      options%write_fields == '') then
      call fail('--study-case belongs to --realization or --write-fields', error)
    end if
  end subroutine parse_command_line

  !> Takes word `k`, and the value behind it where the option has one: `--option value` or
  !> `--option=value`.
  subroutine take_word(words, k, options, error)
    character(len=*), intent(in) :: words(:)
    integer, intent(inout) :: k
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(inout) :: error
    character(len=:), allocatable :: option
    integer :: equals

    option = trim(words(k))
    equals = 0
    if (index(option, '--') == 1) equals = index(option, '=')
    if (equals > 0) option = option(:equals - 1)
    select case (option)
    case ('--study-case', '--output', '--realization', '--walltime', '--write-fields', '--members')
      if (equals > 0) then
        call take_value(option, trim(words(k) (equals + 1:)), options, error)
      else if (k == size(words)) then
        call take_value(option, '', options, error)
      else
        k = k + 1
        call take_value(option, trim(words(k)), options, error)
      end if
    case default
      if (equals > 0 .and. any(KNOWN == option)) then
        call fail(option//' takes no value: '//trim(words(k)), error)
        return
      end if
      call take_flag(option, options, error)
      if (option /= '--keys' .or. k == size(words)) return
      if (words(k + 1) (1:1) == '-' .or. words(k + 1) == '') return
      k = k + 1
      options%keys_group = lower_case(trim(words(k)))
      if (options%keys_group(1:1) == '&') options%keys_group = options%keys_group(2:)
    end select
  end subroutine take_word

  !> An option without a value, or the case file.
  subroutine take_flag(option, options, error)
    character(len=*), intent(in) :: option
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(inout) :: error

    select case (option)
    case ('--check')
      options%check = .true.
    case ('--dry')
      options%dry = .true.
    case ('--keys')
      options%keys = .true.
    case ('--json')
      options%json = .true.
    case ('--defaults')
      options%defaults = .true.
    case ('--snapshots')
      options%snapshots = .true.
    case ('--overwrite')
      options%overwrite = .true.
    case ('--version', '-V')
      options%version = .true.
    case ('--help', '-h')
      options%help = .true.
    case default
      call take_case_file(option, options, error)
    end select
  end subroutine take_flag

  !> The value of an option. One that is empty or looks like an option has been forgotten; taken as
  !> it is, it would start a run that was not asked for.
  subroutine take_value(option, value, options, error)
    character(len=*), intent(in) :: option, value
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(inout) :: error
    integer :: status

    if (value == '' .or. index(value, '-') == 1) then
      call fail(option//' needs '//what_it_needs(option)//instead_of(value), error)
      return
    end if
    select case (option)
    case ('--study-case')
      options%study_case = value
    case ('--output')
      options%output = value
    case ('--write-fields')
      options%write_fields = value
      if (.not. ends_with(value, '.h5') .and. .not. ends_with(value, '.csv')) then
        call fail(option//' needs '//what_it_needs(option)//instead_of(value), error)
      end if
    case ('--walltime')
      call read_duration(value, options%walltime, error)
    case ('--members')
      call read_range(value, options%members, error)
    case default ! --realization
      read (value, *, iostat=status) options%realization
      if (status /= 0 .or. options%realization < 1 .or. verify(value, '0123456789') > 0) then
        call fail(option//' needs '//what_it_needs(option)//instead_of(value), error)
      end if
    end select
  end subroutine take_value

  pure function what_it_needs(option) result(text)
    character(len=*), intent(in) :: option
    character(len=:), allocatable :: text

    select case (option)
    case ('--study-case')
      text = 'the label of a case'
    case ('--output')
      text = 'a directory'
    case ('--write-fields')
      text = 'the name of a file, .h5 or .csv'
    case ('--walltime')
      text = 'HH:MM:SS above zero'
    case ('--members')
      text = 'first and last id, as 1-250'
    case default ! --realization
      text = 'a whole number from 1 on'
    end select
  end function what_it_needs

  pure function instead_of(value) result(text)
    character(len=*), intent(in) :: value
    character(len=:), allocatable :: text

    text = ''
    if (value == '') return
    text = ', not '//value
  end function instead_of

  !> A word that is no option is the case file; there is only one.
  subroutine take_case_file(word, options, error)
    character(len=*), intent(in) :: word
    type(options_t), intent(inout) :: options
    type(error_t), allocatable, intent(inout) :: error

    if (word == '') then
      call fail('an empty word is no case file', error)
    else if (word(1:1) == '-') then
      call fail('unknown option '//word//suggestion(word)//'; see sgimp --help', error)
    else if (options%case_file /= '') then
      call fail('one case file, please: both '//options%case_file//' and '//word//' are given', &
        error)
    else
      options%case_file = word
    end if
  end subroutine take_case_file

  function suggestion(word) result(text)
    character(len=*), intent(in) :: word
    character(len=:), allocatable :: text

    text = did_you_mean(word, KNOWN, '')
    if (text /= '') text = ' ('//text//')'
  end function suggestion

  !> Two whole numbers with a dash between them.
  subroutine read_range(text, range, error)
    character(len=*), intent(in) :: text
    integer(i8), intent(out) :: range(2)
    type(error_t), allocatable, intent(inout) :: error
    integer :: dash, status

    range = [1_i8, huge(1_i8)]
    dash = index(text, '-')
    status = verify(text, '0123456789-')
    if (dash < 2 .or. dash == len(text) .or. index(text(dash + 1:), '-') > 0) status = 1
    if (status == 0) read (text(:dash - 1), *, iostat=status) range(1)
    if (status == 0) read (text(dash + 1:), *, iostat=status) range(2)
    if (status == 0 .and. range(1) > 0 .and. range(1) <= range(2)) return
    call fail('--members needs '//what_it_needs('--members')//instead_of(text), error)
  end subroutine read_range

  !> Hours:minutes:seconds, minutes:seconds, or seconds.
  subroutine read_duration(text, seconds, error)
    character(len=*), intent(in) :: text
    real(wp), intent(out) :: seconds
    type(error_t), allocatable, intent(inout) :: error
    integer :: first, mark, number, status

    seconds = 0.0_wp
    first = 1
    status = verify(text, '0123456789:')
    if (count_colons(text) > 2 .or. index(text//'/', ':/') > 0) status = 1
    do while (first <= len(text) .and. status == 0)
      mark = index(text(first:)//':', ':')
      read (text(first:first + mark - 2), *, iostat=status) number
      seconds = 60.0_wp*seconds + number
      first = first + mark
    end do
    if (status /= 0 .or. .not. seconds > 0.0_wp) then
      call fail('--walltime needs '//what_it_needs('--walltime')//instead_of(text), error)
    end if
  end subroutine read_duration

  pure integer function count_colons(text) result(number)
    character(len=*), intent(in) :: text
    integer :: i

    number = count([(text(i:i) == ':', i=1, len(text))])
  end function count_colons

  subroutine fail(message, error)
    character(len=*), intent(in) :: message
    type(error_t), allocatable, intent(inout) :: error
    call raise(error, EXIT_BAD_INPUT, message, 'command line')
  end subroutine fail

  !> What --help prints.
  pure function usage_text() result(text)
    character(len=:), allocatable :: text
    character(len=*), parameter :: N = new_line('a')

    text = 'Runout of landslides and granular flows over random fields of soil strength.'//N//N// &
      'Usage:  mpirun -n RANKS sgimp CASE.nml [options]     run, or go on where a '// &
      'run was stopped'//N// &
      '        sgimp --keys [GROUP] [--json]                every key: type, unit, '// &
      'default, range, meaning'//N// &
      '        sgimp --defaults                             a case file to start from'//N//N// &
      '  --check                 check the case and say what it would take; writes nothing'//N// &
      '  --dry                   list the cases of the study and their members; runs nothing'//N// &
      '  --members FIRST-LAST    compute these ids only, as one job of an array '// &
      '(sgimp-post merge)'//N// &
      '  --output DIR            directory of the results, instead of the one in the case file'// &
      N// &
      '  --overwrite             throw away what the directory holds'//N// &
      '  --walltime HH:MM:SS     end cleanly within this time; the same command goes on later'// &
      N// &
      '  --realization I         compute one member again, by itself, and print its row'//N// &
      '    --study-case LABEL    of this case of a study, as snx_cov0.05 or deterministic'//N// &
      '    --snapshots           and write its states to DIR/snapshots'//N// &
      '  --write-fields FILE     write the random fields and run nothing: all realizations into'// &
      ' FILE.h5,'//N// &
      '                          or one (--realization, --study-case) into FILE.csv'//N// &
      '  --version, --help'//N//N// &
      'Exit codes: 0 complete; 1 internal error; 2 bad input; 3 stopped early, resumable;'//N// &
      '4 complete, but more failed members than allowed.'//N// &
      'To stop a run cleanly: touch DIR/STOP, or send SIGUSR1 or SIGTERM.'
  end function usage_text
end module sg_command_line
