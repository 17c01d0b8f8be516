!> The schema for people and for programs: `--keys`, `--keys --json` and `--defaults`.
module sg_key_listing
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_fault_list, only: did_you_mean
  use sg_schema, only: ANY_NUMBER, count_words, group_row, GROUPS, key_t, KEYS, KIND_INTEGER, &
    KIND_NAME, &
    KIND_REAL, KIND_TEXT, KIND_WORD, word_at
  use sg_text, only: to_text
  implicit none
  private

  public :: print_keys, print_defaults

  character(len=1), parameter :: BREAK = new_line('a')

contains

  !> Every key of `group` (empty: of all groups) with type, unit, default, range and meaning;
  !> `json` for programs.
  !> An unknown group is bad input.
  subroutine print_keys(group, json, text, error)
    character(len=*), intent(in) :: group
    logical, intent(in) :: json
    character(len=:), allocatable, intent(out) :: text
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: hint
    integer :: g, k

    text = ''
    if (group /= '') then
      if (group_row(group) == 0) then
        hint = did_you_mean(group, GROUPS%name, '')
        if (hint /= '') hint = ' ('//hint//')'
        call raise(error, EXIT_BAD_INPUT, &
          'there is no group '//group//hint//'; allowed: '//group_names(), 'print_keys')
        return
      end if
    end if
    if (json) text = '['
    do g = 1, size(GROUPS)
      if (group /= '' .and. GROUPS(g)%name /= group) cycle
      if (.not. json) text = text//'&'//trim(GROUPS(g)%name)//'  '//trim(GROUPS(g)%meaning)//BREAK
      do k = 1, size(KEYS)
        if (KEYS(k)%group /= GROUPS(g)%name) cycle
        if (json) then
          if (text /= '[') text = text//','
          text = text//BREAK//json_row(KEYS(k))
        else
          text = text//key_lines(KEYS(k))
        end if
      end do
      if (.not. json) text = text//BREAK
    end do
    if (json) text = text//BREAK//']'
  end subroutine print_keys

  function group_names() result(names)
    character(len=:), allocatable :: names
    integer :: g

    names = trim(GROUPS(1)%name)
    do g = 2, size(GROUPS)
      names = names//', '//trim(GROUPS(g)%name)
    end do
  end function group_names

  !> Two or more lines for one key.
  function key_lines(key) result(text)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: text
    character(len=26) :: name

    name = trim(key%name)
    text = '  '//name//type_text(key)
    if (key%unit /= '') text = text//', '//trim(key%unit)
    if (key%range /= '(,)') text = text//', in '//trim(key%range)
    if (key%choices /= '') text = text//', one of: '//trim(key%choices)
    if (key%default /= '') then
      text = text//'; default '//trim(key%default)
    else if (key%required) then
      text = text//'; required'
    end if
    if (key%default_deterministic /= '') then
      text = text//' ('//trim(key%default_deterministic)//' without &random_field)'
    end if
    if (key%when /= '') text = text//'; only for '//trim(key%when)//': '//trim(key%when_is)
    if (key%needs /= '') text = text//'; only with &'//trim(key%needs)
    text = text//BREAK//repeat(' ', 28)//trim(key%meaning)//BREAK
  end function key_lines

  pure function type_text(key) result(text)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: text

    select case (key%kind)
    case (KIND_REAL)
      text = 'real'
    case (KIND_INTEGER)
      text = 'integer'
    case (KIND_WORD)
      text = 'word'
    case (KIND_NAME)
      text = 'name'
    case default
      text = 'text'
    end select
    if (key%size == ANY_NUMBER) then
      text = text//' list'
    else if (key%size > 1) then
      text = to_text(key%size)//' x '//text
    end if
  end function type_text

  function json_row(key) result(text)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: text

    text = '  {"group": '//json_text(key%group)//', "key": '//json_text(key%name)//', "type": '// &
      json_text(type_text(key))//', "unit": '//json_text(key%unit)//', "default": '// &
      json_text(key%default)// &
      ', "range": '//json_text(key%range)//', "choices": '//json_text(key%choices)// &
      ', "required": '//to_text(key%required)//', "meaning": '// &
      json_text(key%meaning)//'}'
  end function json_row

  !> A JSON string; the schema holds no control characters.
  pure function json_text(text) result(quoted_text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: quoted_text
    integer :: i

    quoted_text = '"'
    do i = 1, len_trim(text)
      if (text(i:i) == '"' .or. text(i:i) == '\') quoted_text = quoted_text//'\'
      quoted_text = quoted_text//text(i:i)
    end do
    quoted_text = quoted_text//'"'
  end function json_text

  !> A case file with every key that applies to a column of sand over a random field, as a start for
  !> one's own; it runs as it is. Defaults go before the values of the paper.
  function print_defaults() result(text)
    character(len=:), allocatable :: text
    integer :: g, k

    text = '! A column of sand over a random field: each key that applies, with its default '// &
      'where it has one,'//BREAK// &
      '! else with the value of the paper. sgimp --keys tells which may be left out.'//BREAK
    do g = 1, size(GROUPS)
      if (.not. GROUPS(g)%in_example) cycle
      text = text//BREAK//'! '//trim(GROUPS(g)%meaning)//BREAK//'&'//trim(GROUPS(g)%name)//BREAK
      do k = 1, size(KEYS)
        if (KEYS(k)%group /= GROUPS(g)%name) cycle
        if (.not. belongs_to_example(KEYS(k))) cycle
        text = text//'  '//trim(KEYS(k)%name)//' = '//value_text(KEYS(k))//'  ! '// &
          trim(KEYS(k)%meaning)
        if (KEYS(k)%unit /= '' .and. KEYS(k)%unit /= '1') text = text//' ('//trim(KEYS(k)%unit)//')'
        text = text//BREAK
      end do
      text = text//'/'//BREAK
    end do
  end function print_defaults

  !> Keys of another model, shape or wall, and those that have neither default nor example, stay
  !> out of the example.
  pure function belongs_to_example(key) result(belongs)
    type(key_t), intent(in) :: key
    logical :: belongs
    integer :: k

    belongs = .true.
    if (key%when /= '') then
      do k = 1, size(KEYS)
        if (KEYS(k)%group /= key%group .or. KEYS(k)%name /= key%when) cycle
        belongs = index(' '//trim(key%when_is)//' ', ' '//trim(word_at(first_value(KEYS(k)), &
          1))//' ') > 0
      end do
    end if
    if (first_value(key) == '' .and. key%kind /= KIND_TEXT) belongs = .false.
  end function belongs_to_example

  pure function first_value(key) result(value)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: value

    value = trim(key%default)
    if (value == '') value = trim(key%example)
  end function first_value

  !> The value as it stands in a case file: words in quotes, lists with commas.
  pure function value_text(key) result(text)
    type(key_t), intent(in) :: key
    character(len=:), allocatable :: text
    character(len=:), allocatable :: value
    integer :: k

    value = first_value(key)
    if (key%kind == KIND_TEXT) then
      text = "'"//value//"'"
      return
    end if
    text = ''
    do k = 1, count_words(value)
      if (k > 1) text = text//', '
      if (key%kind == KIND_WORD .or. key%kind == KIND_NAME) then
        text = text//"'"//word_at(value, k)//"'"
      else
        text = text//word_at(value, k)
      end if
    end do
  end function value_text
end module sg_key_listing
