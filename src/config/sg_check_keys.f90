!> Checks of a scanned case file against the schema, key by key. What several keys must satisfy
!> together is in `sg_check_config`.
module sg_check_keys
  use sg_config, only: NAME_LENGTH
  use sg_fault_list, only: did_you_mean, fault_list_t, quoted
  use sg_kinds, only: i8, wp
  use sg_namelist, only: namelist_t, nml_entry_t, nml_group_t
  use sg_number_text, only: parse_integer, parse_real, range_holds, range_in_words
  use sg_schema, only: ANY_NUMBER, count_words, group_row, GROUPS, has_word, key_row, key_t, KEYS, &
    KIND_INTEGER, KIND_NAME, KIND_REAL, KIND_WORD, listed, word_at
  use sg_study_keys, only: can_be_listed, find_study_key
  use sg_text, only: lower_case, to_text
  implicit none
  private

  public :: check_keys, check_study_keys, why_not

  character(len=*), parameter :: NAME_CHARACTERS = &
    'abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.'

contains

  !> Adds what is wrong to `faults`, and marks every key that can be used.
  subroutine check_keys(nml, faults)
    type(namelist_t), intent(inout) :: nml
    type(fault_list_t), intent(inout) :: faults
    integer :: g, row

    do row = 1, size(GROUPS)
      call check_group_presence(nml, row, faults)
    end do
    do g = 1, nml%number
      if (group_is_known(nml, g, faults)) call check_group(nml, g, faults)
    end do
  end subroutine check_keys

  !> The keys of other groups that &study lists: adds what is wrong to `faults` and marks those that
  !> can be used. Comes before `check_keys`, which leaves them alone: their first values must stand
  !> in their groups by then.
  subroutine check_study_keys(nml, faults)
    type(namelist_t), intent(inout) :: nml
    type(fault_list_t), intent(inout) :: faults
    integer :: e, g

    g = nml%locate('study', 1)
    if (g == 0) return
    do e = 1, nml%groups(g)%number
      if (key_row('study', nml%groups(g)%entries(e)%key) > 0) cycle
      if (nml%groups(g)%entries(e)%spoilt) cycle
      call check_study_key(nml, g, e, faults)
    end do
  end subroutine check_study_keys

  subroutine check_study_key(nml, g, e, faults)
    type(namelist_t), intent(inout) :: nml
    integer, intent(in) :: g, e
    type(fault_list_t), intent(inout) :: faults
    type(key_t) :: key
    character(len=:), allocatable :: name, fault, ignored
    integer :: row, occurrence, first, first_row, first_occurrence

    name = nml%groups(g)%entries(e)%key
    call find_study_key(nml, name, row, occurrence, fault)
    ! The same key may have been listed under another name.
    do first = 1, e
      call find_study_key(nml, nml%groups(g)%entries(first)%key, first_row, first_occurrence, &
        ignored)
      if (first_row == row .and. first_occurrence == occurrence) exit
    end do
    if (len(fault) > 0) then
      call faults%add(nml%groups(g)%entries(e)%line, '&study '//name, fault)
    else if (row == 0) then
      call report_unknown(nml%groups(g), e, faults)
    else if (first < e) then
      call faults%add(nml%groups(g)%entries(e)%line, '&study '//name, &
        'given twice; the first one, '//nml%groups(g)%entries(first)%key//', is in line '// &
        to_text(nml%groups(g)%entries(first)%line))
    else
      key = KEYS(row)
      key%group = 'study'
      key%name = name
      key%size = ANY_NUMBER
      call check_entry(key, nml%groups(g)%entries(e), faults)
    end if
  end subroutine check_study_key

  !> A group that is required, by itself or by another group, and missing. One that a misspelt group
  !> was meant to be is not reported a second time.
  subroutine check_group_presence(nml, row, faults)
    type(namelist_t), intent(in) :: nml
    integer, intent(in) :: row
    type(fault_list_t), intent(inout) :: faults
    character(len=:), allocatable :: name, cause
    integer :: g, k

    name = trim(GROUPS(row)%name)
    if (nml%count(name) > 0) return
    cause = ''
    do k = 1, size(KEYS)
      if (KEYS(k)%group /= name .or. .not. KEYS(k)%required .or. KEYS(k)%needs == '') cycle
      if (nml%count(KEYS(k)%needs) > 0) cause = ', and &'//trim(KEYS(k)%needs)// &
        ' needs its key '// &
        trim(KEYS(k)%name)
    end do
    if (.not. GROUPS(row)%required .and. len(cause) == 0) return
    do g = 1, nml%number
      if (group_row(nml%groups(g)%name) > 0) cycle
      if (did_you_mean(nml%groups(g)%name, GROUPS%name, '&') == 'did you mean &'//name//'?') return
    end do
    call faults%add(nml%lines, '&'//name, 'this group is missing'//cause//' ('// &
      'sgimp --defaults shows an example)')
  end subroutine check_group_presence

  logical function group_is_known(nml, g, faults) result(known)
    type(namelist_t), intent(in) :: nml
    integer, intent(in) :: g
    type(fault_list_t), intent(inout) :: faults
    character(len=:), allocatable :: name, hint
    integer :: row, first

    name = nml%groups(g)%name
    row = group_row(name)
    known = row > 0
    if (.not. known) then
      hint = did_you_mean(name, GROUPS%name, '&')
      if (len(hint) == 0) hint = 'allowed: '//all_groups()
      call faults%add(nml%groups(g)%line, '&'//name, 'there is no such group ('//hint//')')
      return
    end if
    first = nml%locate(name, 1)
    if (first < g .and. .not. GROUPS(row)%repeatable) then
      call faults%add(nml%groups(g)%line, '&'//name, 'this group may be given only once; the '// &
        'first one is in line '//to_text(nml%groups(first)%line))
    end if
    if (len_trim(GROUPS(row)%needs) > 0 .and. nml%count(GROUPS(row)%needs) == 0) then
      call faults%add(nml%groups(g)%line, '&'//name, 'this group makes sense only with &'// &
        trim(GROUPS(row)%needs)//', which is not given')
    end if
  end function group_is_known

  function all_groups() result(text)
    character(len=:), allocatable :: text
    integer :: row

    text = '&'//trim(GROUPS(1)%name)
    do row = 2, size(GROUPS)
      text = text//', &'//trim(GROUPS(row)%name)
    end do
  end function all_groups

  subroutine check_group(nml, g, faults)
    type(namelist_t), intent(inout) :: nml
    integer, intent(in) :: g
    type(fault_list_t), intent(inout) :: faults
    integer :: e, row, first

    do e = 1, nml%groups(g)%number
      row = key_row(nml%groups(g)%name, nml%groups(g)%entries(e)%key)
      if (row == 0) then
        if (.not. nml%groups(g)%entries(e)%spoilt .and. nml%groups(g)%name /= 'study') then
          call report_unknown(nml%groups(g), e, faults)
        end if
        cycle
      end if
      first = nml%groups(g)%find(nml%groups(g)%entries(e)%key)
      if (first < e) then
        if (.not. nml%groups(g)%entries(e)%spoilt) then
          call faults%add(nml%groups(g)%entries(e)%line, where_is(KEYS(row)), &
            'given twice; the first one is in line '//to_text(nml%groups(g)%entries(first)%line))
        end if
        cycle
      end if
      call check_entry(KEYS(row), nml%groups(g)%entries(e), faults)
    end do
    do row = 1, size(KEYS)
      if (KEYS(row)%group == nml%groups(g)%name) call check_presence(nml, g, KEYS(row), faults)
    end do
  end subroutine check_group

  pure function where_is(key) result(where)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: where
    where = '&'//trim(key%group)//' '//trim(key%name)
  end function where_is

  subroutine report_unknown(group, e, faults)
    type(nml_group_t), intent(in) :: group
    integer, intent(in) :: e
    type(fault_list_t), intent(inout) :: faults
    character(len=:), allocatable :: key, hint
    integer :: row

    key = group%entries(e)%key
    hint = key_meant(group%name, key)
    if (len(hint) == 0 .and. group%name == 'study') hint = did_you_mean(key, pack(KEYS%name, &
      can_be_listed(KEYS)), '')
    if (len(hint) == 0) then
      do row = size(KEYS), 1, -1
        if (KEYS(row)%name == key) hint = 'did you mean '//trim(key)//' of &'// &
          trim(KEYS(row)%group)//'?'
      end do
    end if
    if (len(hint) == 0 .and. group%name == 'study') hint = 'any key of one number or word may '// &
      'be listed; sgimp --keys has them all'
    if (len(hint) == 0) hint = 'sgimp --keys '//group%name//' lists those there are'
    call faults%add(group%entries(e)%line, '&'//group%name//' '//key, &
      'there is no such key in this group ('//hint//')')
  end subroutine report_unknown

  !> `did you mean X?` for the name of a key that the group has not got, or empty.
  function key_meant(group_name, key) result(hint)
    character(len=*), intent(in) :: group_name, key
    character(len=:), allocatable :: hint

    hint = did_you_mean(key, pack(KEYS%name, KEYS%group == group_name), '')
  end function key_meant

  !> A key that is required and missing, or given and without meaning here. One that a misspelt key
  !> was meant to be is not reported a second time.
  subroutine check_presence(nml, g, key, faults)
    type(namelist_t), intent(inout) :: nml
    integer, intent(in) :: g
    type(key_t), intent(in) :: key
    type(fault_list_t), intent(inout) :: faults
    character(len=:), allocatable :: reason
    integer :: e, i, supplier

    e = nml%groups(g)%find(key%name)
    reason = why_not(nml, nml%groups(g), key)
    if (e > 0) then
      if (len(reason) > 0 .and. .not. nml%groups(g)%entries(e)%spoilt) then
        nml%groups(g)%entries(e)%usable = .false.
        ! Where the deciding word is refused, that is the fault.
        if (.not. decider_is_good(nml%groups(g), key)) return
        call faults%add(nml%groups(g)%entries(e)%line, where_is(key), 'does not apply here: '// &
          reason)
      end if
    else if (key%required .and. len(reason) == 0 .and. decider_is_good(nml%groups(g), key)) then
      do i = 1, nml%groups(g)%number
        if (key_row(nml%groups(g)%name, nml%groups(g)%entries(i)%key) > 0) cycle
        if (key_meant(nml%groups(g)%name, nml%groups(g)%entries(i)%key) == &
          'did you mean '//trim(key%name)//'?') return
      end do
      supplier = 0
      if (len_trim(key%supplied_by) > 0) supplier = nml%locate(key%supplied_by, 1)
      if (supplier > 0) then
        if (nml%groups(supplier)%find(key%name) > 0) return
      end if
      call faults%add(nml%groups(g)%line, where_is(key), 'this key is missing'//about(key))
    end if
  end subroutine check_presence

  !> Whether the key that decides if this one applies has an accepted value (or there is no such
  !> key).
  pure logical function decider_is_good(group, key) result(good)
    type(nml_group_t), intent(in) :: group
    type(key_t), intent(in) :: key
    integer :: e

    good = .true.
    if (len_trim(key%when) == 0) return
    e = group%find(key%when)
    if (e > 0) then
      good = group%entries(e)%usable
    else
      good = len_trim(KEYS(key_row(key%group, key%when))%default) > 0
    end if
  end function decider_is_good

  !> What a missing key would be, in brackets.
  function about(key) result(text)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: text

    text = ' ('//trim(key%meaning)
    if (len_trim(key%choices) > 0) then
      text = text//'; allowed: '//listed(key%choices)
    else if (len(range_in_words(key%range)) > 0) then
      text = text//'; allowed: '//allowed_numbers(key)
    else if (len_trim(key%unit) > 0 .and. key%unit /= '1') then
      text = text//', in '//trim(key%unit)
    end if
    text = text//')'
  end function about

  !> Why a key makes no sense in this group, empty if it does. Keys that decide it and are faulty
  !> themselves are taken as good.
  function why_not(nml, group, key) result(reason)
    type(namelist_t), intent(in) :: nml
    type(nml_group_t), intent(in) :: group
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: reason
    character(len=:), allocatable :: word
    type(key_t) :: decider
    integer :: e

    reason = ''
    if (len_trim(key%needs) > 0 .and. nml%count(key%needs) == 0) then
      reason = 'it makes sense only with &'//trim(key%needs)//', which is not given'
    else if (len_trim(key%when) > 0) then
      decider = KEYS(key_row(key%group, key%when))
      e = group%find(key%when)
      word = trim(decider%default)
      if (e > 0) then
        if (group%entries(e)%spoilt .or. group%entries(e)%number /= 1) return
        word = lower_case(group%entries(e)%values(1)%text)
        if (.not. has_word(decider%choices, word)) return
      else if (len(word) == 0) then
        return
      end if
      if (has_word(key%when_is, word)) return
      reason = 'only with '//trim(key%when)//' = '//alternatives(key%when_is)
    end if
  end function why_not

  !> Words as `'a' or 'b'`.
  pure function alternatives(words) result(text)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: text
    integer :: i

    text = quoted(word_at(words, 1))
    do i = 2, count_words(words)
      text = text//' or '//quoted(word_at(words, i))
    end do
  end function alternatives

  !> Number and types of the values of a key.
  subroutine check_entry(key, entry, faults)
    type(key_t), intent(in) :: key
    type(nml_entry_t), intent(inout) :: entry
    type(fault_list_t), intent(inout) :: faults
    character(len=:), allocatable :: fault
    integer :: i

    if (entry%spoilt) return
    entry%usable = .true.
    if (key%size /= ANY_NUMBER .and. entry%number /= key%size) then
      entry%usable = .false.
      call faults%add(entry%line, where_is(key), 'takes '//values_in_words(key%size)//', not '// &
        to_text(entry%number)//hint_at_text(entry))
    end if
    if (.not. entry%usable) return
    do i = 1, entry%number
      fault = fault_of_value(key, entry%values(i)%text, entry%values(i)%quoted)
      if (len(fault) == 0) cycle
      entry%usable = .false.
      call faults%add(entry%values(i)%line, where_is(key), fault)
    end do
  end subroutine check_entry

  pure function values_in_words(number) result(text)
    integer, intent(in) :: number
    character(len=:), allocatable :: text

    if (number == 1) then
      text = 'one value'
    else
      text = to_text(number)//' values'
    end if
  end function values_in_words

  !> The usual cause of too many values: text of several words without quotes.
  pure function hint_at_text(entry) result(hint)
    type(nml_entry_t), intent(in) :: entry
    character(len=:), allocatable :: hint

    hint = ''
    if (entry%number > 1) then
      if (.not. entry%values(1)%quoted .and. verify(entry%values(1)%text, &
        '+-.0123456789eEdD') > 0) then
        hint = ' (text must be in quotes)'
      end if
    end if
  end function hint_at_text

  function fault_of_value(key, text, in_quotes) result(fault)
    type(key_t), intent(in) :: key
    character(len=*), intent(in) :: text
    logical, intent(in) :: in_quotes
    character(len=:), allocatable :: fault

    select case (key%kind)
    case (KIND_REAL, KIND_INTEGER)
      fault = fault_of_number(key, text, in_quotes)
    case default
      if (.not. in_quotes) then
        fault = 'text must be in quotes: '//quoted(text)
        if (key%kind == KIND_WORD .and. .not. has_word(key%choices, lower_case(text))) then
          fault = fault//' (allowed: '//listed(key%choices)//')'
        end if
      else if (key%kind == KIND_WORD) then
        fault = fault_of_word(key, lower_case(text))
      else if (key%kind == KIND_NAME) then
        fault = fault_of_name(text)
      else
        fault = ''
        if (len_trim(text) == 0 .and. len_trim(key%default) > 0) fault = 'must not be empty'
      end if
    end select
  end function fault_of_value

  function fault_of_number(key, text, in_quotes) result(fault)
    type(key_t), intent(in) :: key
    character(len=*), intent(in) :: text
    logical, intent(in) :: in_quotes
    character(len=:), allocatable :: fault
    real(wp) :: value
    integer(i8) :: whole

    if (key%kind == KIND_INTEGER) then
      call parse_integer(text, whole, fault)
      value = real(whole, wp)
    else
      call parse_real(text, value, fault)
    end if
    if (len(fault) > 0) then
      fault = quoted(text)//' '//fault
    else if (in_quotes) then
      fault = 'a number stands without quotes: '//trim(text)
    else if (.not. range_holds(key%range, value)) then
      fault = trim(text)//' is out of range'
    end if
    if (len(fault) > 0) fault = fault//' (allowed: '//allowed_numbers(key)//')'
  end function fault_of_number

  function allowed_numbers(key) result(text)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: text

    text = 'a number'
    if (key%kind == KIND_INTEGER) text = 'a whole number'
    if (len(range_in_words(key%range)) > 0) text = text//', '//range_in_words(key%range)
    if (len_trim(key%unit) > 0 .and. key%unit /= '1' .and. key%unit /= '*') then
      text = text//', in '//trim(key%unit)
    end if
  end function allowed_numbers

  function fault_of_word(key, word) result(fault)
    type(key_t), intent(in) :: key
    character(len=*), intent(in) :: word
    character(len=:), allocatable :: fault
    character(len=24) :: candidates(count_words(key%choices))
    character(len=:), allocatable :: hint
    integer :: i

    fault = ''
    if (has_word(key%choices, word)) return
    do i = 1, size(candidates)
      candidates(i) = word_at(key%choices, i)
    end do
    fault = quoted(word)//' is unknown (allowed: '//listed(key%choices)
    hint = did_you_mean(word, candidates, '')
    if (len(hint) > 0) fault = fault//'; '//hint
    fault = fault//')'
  end function fault_of_word

  pure function fault_of_name(text) result(fault)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: fault

    fault = ''
    if (len_trim(text) == 0) then
      fault = 'must not be empty'
    else if (verify(trim(text), NAME_CHARACTERS) > 0 .or. scan(text(1:1), '-.') > 0) then
      ! Names become parts of paths; '..' and '-x' would be something else there.
      fault = quoted(text)//' is no name (allowed: letters, digits and _, and after the first '// &
        'character also - and .)'
    else if (len_trim(text) > NAME_LENGTH) then
      fault = quoted(text)//' is too long (allowed: '//to_text(NAME_LENGTH)//' characters)'
    end if
  end function fault_of_name
end module sg_check_keys
