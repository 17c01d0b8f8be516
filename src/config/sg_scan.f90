!> Takes the text of a case file apart into groups, keys and values, strictly: whatever Fortran's
!> own namelist READ would skip, guess or overwrite in silence becomes a fault here.
!>
!> Understood: `&group`, `key = value, ...`, `/` or `&end`, comments from `!` on, text in single or
!> double quotes (doubled inside), repeat counts (`3*1.0`), values on several lines, several groups
!> on a line, names in any case, tabs, CRLF and a byte order mark; in &study also keys of other
!> groups, as `grid%x_max` and `body(2)%height`.
module sg_scan
  use sg_fault_list, only: fault_list_t, quoted
  use sg_kinds, only: i8
  use sg_namelist, only: namelist_t, nml_entry_t
  use sg_number_text, only: parse_integer
  use sg_schema, only: key_row
  use sg_text, only: lower_case, to_text
  implicit none
  private

  public :: scan_namelist

  integer, parameter :: AT_END = 0, WORD = 1, STRING = 2, EQUALS = 3, COMMA = 4, SLASH = 5
  integer, parameter :: GROUP = 6, BRACKET = 7

  character, parameter :: TAB = achar(9), LINE_FEED = achar(10), RETURN_CHAR = achar(13)
  character(len=*), parameter :: BLANKS = ' '//TAB//RETURN_CHAR
  character(len=*), parameter :: ENDS_OF_WORD = BLANKS//LINE_FEED//',=/!&()''"'
  character(len=*), parameter :: NAME_CHARACTERS = 'abcdefghijklmnopqrstuvwxyz0123456789_'
  integer(i8), parameter :: MOST_REPEATS = 10000_i8

  type :: token_t
    integer :: kind = AT_END
    integer :: line = 1
    !> Position of its first character.
    integer :: start = 1
    character(len=:), allocatable :: text
    logical :: spoilt = .false.
  end type token_t

  type :: scanner_t
    character(len=:), allocatable :: text
    integer :: position = 1
    integer :: line = 1
    type(fault_list_t) :: faults
    !> The group being read, as `&name`, and the key, for messages.
    character(len=:), allocatable :: where
  contains
    procedure :: next
    procedure :: peek
    procedure :: skip_blanks
    procedure :: rest_of_line
  end type scanner_t

contains

  !> Fills `nml` from `text`. Faults of syntax are added to `faults`; what could be read is there.
  subroutine scan_namelist(text, nml, faults)
    character(len=*), intent(in) :: text
    type(namelist_t), intent(out) :: nml
    type(fault_list_t), intent(inout) :: faults
    type(scanner_t) :: scanner
    type(token_t) :: token
    character(len=:), allocatable :: closed
    integer :: closed_line

    scanner%text = text
    call move_faults(faults, scanner%faults)
    if (len(text) >= 3) then
      ! Byte order mark.
      if (text(1:3) == char(239)//char(187)//char(191)) scanner%position = 4
    end if
    closed = ''
    closed_line = 0
    do
      scanner%where = ''
      call scanner%skip_blanks()
      call scan_start(scanner, token)
      if (token%kind == AT_END) exit
      if (token%kind == GROUP .and. token%text /= 'end') then
        call scan_group(scanner, token, nml)
        closed = token%text
        closed_line = scanner%line
      else if (token%line == closed_line) then
        call scanner%faults%add(token%line, '&'//closed, &
          'text after the ''/'' that closes this '// &
          'group: '//quoted(token%text)//' (text that holds a ''/'' must be in quotes; '// &
          'comments start with ''!'')')
      else
        call scanner%faults%add(token%line, '', 'text outside any group: '//quoted(token%text)// &
          ' (a group starts with &name and ends with ''/''; comments start with ''!'')')
      end if
    end do
    nml%lines = scanner%line
    if (len(text) > 0) then
      if (text(len(text):) == LINE_FEED) nml%lines = max(1, nml%lines - 1)
    end if
    call move_faults(scanner%faults, faults)
  end subroutine scan_namelist

  subroutine move_faults(from, to)
    type(fault_list_t), intent(in) :: from
    type(fault_list_t), intent(out) :: to
    to = from
  end subroutine move_faults

  !> Between groups: the start of a group, the end, or the rest of a line of something else.
  subroutine scan_start(scanner, token)
    type(scanner_t), intent(inout) :: scanner
    type(token_t), intent(out) :: token
    character(len=:), allocatable :: rest
    integer :: ampersand

    token%line = scanner%line
    if (scanner%position > len(scanner%text)) return
    if (scanner%text(scanner%position:scanner%position) == '&') then
      call scanner%next(token)
      return
    end if
    token%kind = WORD
    rest = scanner%rest_of_line()
    ampersand = index(rest, '&')
    if (ampersand > 0) rest = rest(:ampersand - 1)
    scanner%position = scanner%position + len(rest)
    token%text = shortened(rest)
  end subroutine scan_start

  !> Reads a group up to its '/', its `&end`, or where that is missing.
  subroutine scan_group(scanner, start, nml)
    type(scanner_t), intent(inout) :: scanner
    type(token_t), intent(in) :: start
    type(namelist_t), intent(inout) :: nml
    type(token_t) :: token, following

    call nml%add_group(start%text, start%line)
    do
      scanner%where = '&'//start%text
      call scanner%peek(token)
      select case (token%kind)
      case (AT_END)
        call scanner%faults%add(start%line, scanner%where, &
          'the ''/'' that closes this group is '// &
          'missing; the file ends before it')
        return
      case (GROUP)
        if (token%text == 'end') then
          call scanner%next(token)
        else
          call scanner%faults%add(start%line, scanner%where, 'the ''/'' that closes this group '// &
            'is missing; &'//token%text//' starts in line '//to_text(token%line)//' before it')
        end if
        return
      case (SLASH)
        call scanner%next(token)
        return
      case (WORD)
        call scanner%next(token)
        call scanner%peek(following)
        if (following%kind == EQUALS .or. following%kind == BRACKET) then
          call scan_key(scanner, token, nml)
        else
          call scanner%faults%add(token%line, scanner%where, 'the ''='' after '// &
            quoted(token%text)//' is missing')
          if (is_key(start%text, token%text)) then
            call nml%groups(nml%number)%add_entry(lower_case(token%text), token%line)
            call scan_values(scanner, nml, spoilt=.true.)
          end if
        end if
      case default
        call scanner%next(token)
        call scanner%faults%add(token%line, scanner%where, quoted(token%text)// &
          ' stands where a '// &
          'key is expected (write: key = value)')
      end select
    end do
  end subroutine scan_group

  !> Reads what follows the name of a key: a '=' and the values.
  subroutine scan_key(scanner, name, nml)
    type(scanner_t), intent(inout) :: scanner
    type(token_t), intent(in) :: name
    type(namelist_t), intent(inout) :: nml
    type(token_t) :: token
    character(len=:), allocatable :: key
    logical :: spoilt, is_name, is_study

    key = lower_case(name%text)
    is_study = nml%groups(nml%number)%name == 'study'
    if (is_study) call take_group_number(scanner, key)
    scanner%where = scanner%where//' '//key
    spoilt = name%spoilt
    call scanner%next(token)
    if (token%kind == BRACKET) then
      spoilt = .true.
      call scanner%faults%add(token%line, scanner%where, 'single elements such as '//key// &
        token%text//' cannot be set; write the whole list: '//key//' = value, value, ...')
      call scanner%peek(token)
      if (token%kind == EQUALS) call scanner%next(token)
    end if
    if (is_study) then
      is_name = verify(key, NAME_CHARACTERS//'%()') == 0
    else
      is_name = verify(key, NAME_CHARACTERS) == 0
    end if
    if (.not. spoilt .and. .not. is_name) then
      spoilt = .true.
      call scanner%faults%add(name%line, scanner%where, 'this is no name of a key (letters, '// &
        'digits and _)')
    end if
    call nml%groups(nml%number)%add_entry(key, name%line)
    call scan_values(scanner, nml, spoilt)
  end subroutine scan_key

  !> In &study a key may be that of another group, `body(2)%height`: takes what follows `body`.
  subroutine take_group_number(scanner, key)
    type(scanner_t), intent(inout) :: scanner
    character(len=:), allocatable, intent(inout) :: key
    type(token_t) :: number, rest
    integer :: position, line

    position = scanner%position
    line = scanner%line
    call scanner%next(number)
    if (number%kind == BRACKET) then
      call scanner%next(rest)
      if (rest%kind == WORD .and. index(rest%text, '%') == 1) then
        key = key//number%text//lower_case(rest%text)
        return
      end if
    end if
    scanner%position = position
    scanner%line = line
  end subroutine take_group_number

  !> Reads values into the newest key of the newest group, up to the next key or the end of the
  !> group.
  subroutine scan_values(scanner, nml, spoilt)
    type(scanner_t), intent(inout) :: scanner
    type(namelist_t), intent(inout) :: nml
    logical, intent(in) :: spoilt
    type(token_t) :: token
    type(nml_entry_t) :: entry
    logical :: value_expected
    integer :: last

    last = nml%groups(nml%number)%number
    entry = nml%groups(nml%number)%entries(last)
    entry%spoilt = spoilt
    value_expected = .true.
    do
      call scanner%peek(token)
      select case (token%kind)
      case (AT_END, GROUP, SLASH)
        exit
      case (WORD)
        if (starts_key(scanner, nml%groups(nml%number)%name, token)) exit
        call scanner%next(token)
        entry%spoilt = entry%spoilt .or. token%spoilt
        call take_word(scanner, token, entry)
        value_expected = .false.
      case (STRING)
        call scanner%next(token)
        entry%spoilt = entry%spoilt .or. token%spoilt
        call entry%add_value(token%text, .true., token%line)
        value_expected = .false.
      case (COMMA)
        call scanner%next(token)
        if (value_expected) then
          if (.not. entry%spoilt) call scanner%faults%add(token%line, scanner%where, &
            'a value is missing before a comma')
          entry%spoilt = .true.
        end if
        value_expected = .true.
      case default
        call scanner%next(token)
        if (.not. entry%spoilt) call scanner%faults%add(token%line, scanner%where, &
          quoted(token%text)//' stands where a value is expected')
        entry%spoilt = .true.
      end select
    end do
    if (entry%number == 0 .and. .not. entry%spoilt) then
      call scanner%faults%add(entry%line, scanner%where, 'no value is given')
      entry%spoilt = .true.
    end if
    nml%groups(nml%number)%entries(last) = entry
  end subroutine scan_values

  !> A word begins the next key when a '=' or a '(' follows, or when it is the name of a key of the
  !> group (then the '=' has been forgotten, which is reported with the key).
  logical function starts_key(scanner, group_name, token)
    type(scanner_t), intent(inout) :: scanner
    character(len=*), intent(in) :: group_name
    type(token_t), intent(in) :: token
    type(token_t) :: skipped, following
    integer :: position, line, number

    position = scanner%position
    line = scanner%line
    number = scanner%faults%number
    call scanner%next(skipped)
    call scanner%next(following)
    scanner%position = position
    scanner%line = line
    scanner%faults%number = number
    starts_key = following%kind == EQUALS .or. is_key(group_name, token%text)
    if (following%kind == BRACKET) then
      starts_key = scan(lower_case(token%text(1:1)), NAME_CHARACTERS(:26)) == 1
    end if
  end function starts_key

  logical function is_key(group_name, text)
    character(len=*), intent(in) :: group_name, text
    is_key = key_row(group_name, lower_case(text)) > 0
  end function is_key

  !> A value without quotes, with its repeat count if it has one.
  subroutine take_word(scanner, token, entry)
    type(scanner_t), intent(inout) :: scanner
    type(token_t), intent(in) :: token
    type(nml_entry_t), intent(inout) :: entry
    type(token_t) :: string_token
    character(len=:), allocatable :: fault, value
    integer(i8) :: repeats, i
    integer :: star
    logical :: in_quotes

    star = index(token%text, '*')
    value = token%text
    repeats = 1
    in_quotes = .false.
    if (star > 1) then
      call parse_integer(token%text(:star - 1), repeats, fault)
      value = token%text(star + 1:)
      if (len(value) == 0) then
        call scanner%peek(string_token)
        if (string_token%kind == STRING .and. string_token%start == scanner%position) then
          call scanner%next(string_token)
          value = string_token%text
          in_quotes = .true.
        end if
      end if
      if (len(fault) > 0 .or. repeats < 1 .or. repeats > MOST_REPEATS .or. &
        (len(value) == 0 .and. .not. in_quotes)) then
        if (.not. entry%spoilt) call scanner%faults%add(token%line, scanner%where, &
          quoted(token%text)//' is no value with a repeat count (write for instance 3*0.05, '// &
          'with '// &
          'a count from 1 to '//to_text(MOST_REPEATS)//')')
        entry%spoilt = .true.
        return
      end if
    end if
    do i = 1, repeats
      call entry%add_value(value, in_quotes, token%line)
    end do
  end subroutine take_word

  !> Moves behind blanks, ends of lines and comments.
  subroutine skip_blanks(this)
    class(scanner_t), intent(inout) :: this
    character :: c

    do while (this%position <= len(this%text))
      c = this%text(this%position:this%position)
      if (c == LINE_FEED) then
        this%line = this%line + 1
        this%position = this%position + 1
      else if (index(BLANKS, c) > 0) then
        this%position = this%position + 1
      else if (c == '!') then
        this%position = this%position + len(this%rest_of_line())
      else
        return
      end if
    end do
  end subroutine skip_blanks

  !> From the present position to the end of the line, which is not part of it.
  function rest_of_line(this) result(rest)
    class(scanner_t), intent(in) :: this
    character(len=:), allocatable :: rest
    integer :: length

    length = index(this%text(this%position:), LINE_FEED) - 1
    if (length < 0) length = len(this%text) - this%position + 1
    rest = this%text(this%position:this%position + length - 1)
  end function rest_of_line

  !> The next token, without moving on and without a fault.
  subroutine peek(this, token)
    class(scanner_t), intent(inout) :: this
    type(token_t), intent(out) :: token
    integer :: position, line, number

    position = this%position
    line = this%line
    number = this%faults%number
    call this%next(token)
    this%position = position
    this%line = line
    this%faults%number = number
  end subroutine peek

  !> The next token; moves behind it.
  subroutine next(this, token)
    class(scanner_t), intent(inout) :: this
    type(token_t), intent(out) :: token
    character :: c
    integer :: length

    call this%skip_blanks()
    token%line = this%line
    token%start = this%position
    token%text = ''
    if (this%position > len(this%text)) return
    c = this%text(this%position:this%position)
    token%text = c
    length = 1
    select case (c)
    case ('=')
      token%kind = EQUALS
    case (',')
      token%kind = COMMA
    case ('/')
      token%kind = SLASH
    case ('''', '"')
      call take_string(this, c, token)
      return
    case ('(', ')')
      token%kind = BRACKET
      length = max(1, index(this%rest_of_line(), ')'))
      token%text = this%text(this%position:this%position + length - 1)
    case ('&')
      token%kind = GROUP
      length = word_length(this%text(this%position + 1:)) + 1
      token%text = lower_case(this%text(this%position + 1:this%position + length - 1))
    case default
      token%kind = WORD
      length = word_length(this%text(this%position:))
      token%text = this%text(this%position:this%position + length - 1)
      if (has_foreign(token%text)) then
        token%spoilt = .true.
        call this%faults%add(token%line, this%where, 'a character outside ASCII in '// &
          quoted(token%text)//' (typographic quotes, a long dash or a no-break blank, perhaps?)')
      end if
    end select
    this%position = this%position + length
  end subroutine next

  pure integer function word_length(text) result(length)
    character(len=*), intent(in) :: text
    length = scan(text, ENDS_OF_WORD) - 1
    if (length < 0) length = len(text)
  end function word_length

  !> Characters that are no printable ASCII.
  pure logical function has_foreign(text)
    character(len=*), intent(in) :: text
    integer :: i

    has_foreign = .false.
    do i = 1, len(text)
      has_foreign = has_foreign .or. iachar(text(i:i)) < 32 .or. iachar(text(i:i)) > 126
    end do
  end function has_foreign

  !> Text in quotes, which must end in the same line.
  subroutine take_string(scanner, quote, token)
    type(scanner_t), intent(inout) :: scanner
    character, intent(in) :: quote
    type(token_t), intent(inout) :: token
    character(len=:), allocatable :: line
    integer :: i

    token%kind = STRING
    token%text = ''
    line = scanner%rest_of_line()
    i = 2
    do while (i <= len(line))
      if (line(i:i) == quote) then
        if (line(i:min(i + 1, len(line))) /= quote//quote) then
          scanner%position = scanner%position + i
          return
        end if
        i = i + 1
      end if
      token%text = token%text//line(i:i)
      i = i + 1
    end do
    token%spoilt = .true.
    call scanner%faults%add(token%line, scanner%where, 'the quote '//quote//' that ends '// &
      shortened(line)//' is missing in this line')
    ! A '/' that ends the line closes the group; better that than complaints about all that follows.
    i = verify(line, BLANKS, back=.true.)
    if (line(i:i) /= '/') i = len(line) + 1
    scanner%position = scanner%position + i - 1
  end subroutine take_string

  !> Text for a message: one line, not too long.
  function shortened(text) result(short)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: short
    integer, parameter :: LONGEST = 40

    short = text
    if (len(short) > 0) then
      if (short(len(short):) == RETURN_CHAR) short = short(:len(short) - 1)
    end if
    short = trim(short)
    if (len(short) > LONGEST) short = short(:LONGEST)//'...'
  end function shortened
end module sg_scan
