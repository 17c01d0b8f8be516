!> The configuration written back as a case file with every key that applies, and the comparison of
!> two such files.
module sg_resolved
  use sg_check_keys, only: why_not
  use sg_config, only: config_t, NAME_LENGTH, study_list_t
  use sg_config_fields, only: config_visitor_t, visit_config
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_namelist, only: namelist_t, nml_entry_t
  use sg_number_text, only: range_holds
  use sg_read_config, only: read_config
  use sg_schema, only: key_row, KEYS, KIND_INTEGER, KIND_REAL, KIND_WORD
  use sg_text, only: to_text
  implicit none
  private

  public :: resolved_text, identity_text, compare_configs

  !> Collects the values of a configuration as the text of a case file.
  type, extends(config_visitor_t) :: writer_t
    type(namelist_t) :: nml
    character(len=20) :: group_name = ''
  contains
    procedure :: take
    procedure :: take_one
    procedure :: begin_group
    procedure :: visit_real
    procedure :: visit_pair
    procedure :: visit_reals
    procedure :: visit_integer
    procedure :: visit_long
    procedure :: visit_integers
    procedure :: visit_word
    procedure :: visit_words
    procedure :: visit_text
    procedure :: visit_study_lists
  end type writer_t

contains

  !> A complete case file: every key that applies, one a line; reading it gives the same
  !> configuration to the last bit.
  function resolved_text(config) result(text)
    type(config_t), intent(in) :: config
    character(len=:), allocatable :: text
    type(namelist_t) :: nml
    integer :: g, e

    call write_namelist(config, nml)
    text = '! Every key of this run with its value. Running this file gives the same results.'// &
      new_line('a')
    do g = 1, nml%number
      text = text//'&'//nml%groups(g)%name//new_line('a')
      do e = 1, nml%groups(g)%number
        text = text//'  '//nml%groups(g)%entries(e)%key//' = '// &
          values_text(nml%groups(g)%entries(e))//new_line('a')
      end do
      text = text//'/'//new_line('a')
    end do
  end function resolved_text

  !> The keys that results depend on, one a line as `group(number)%key = value`: the same text means
  !> the same results for the same member. To be hashed, not to be read back.
  function identity_text(config) result(text)
    type(config_t), intent(in) :: config
    character(len=:), allocatable :: text
    type(namelist_t) :: nml
    integer :: g, e

    call write_namelist(config, nml)
    text = ''
    do g = 1, nml%number
      associate (group => nml%groups(g))
        do e = 1, group%number
          if (.not. matters(group%name, group%entries(e)%key)) cycle
          text = text//group%name//'('//to_text(occurrence(nml, g))//')%'// &
            group%entries(e)%key//' = '//values_text(group%entries(e))//new_line('a')
        end do
      end associate
    end do
  end function identity_text

  !> Whether results depend on a key; on one of another group that &study lists they do.
  pure logical function matters(group, key)
    character(len=*), intent(in) :: group, key
    integer :: row

    row = key_row(group, key)
    matters = .true.
    if (row > 0) matters = KEYS(row)%identity
  end function matters

  pure integer function occurrence(nml, g)
    type(namelist_t), intent(in) :: nml
    integer, intent(in) :: g
    integer :: i

    occurrence = 0
    do i = 1, g
      if (nml%groups(i)%name == nml%groups(g)%name) occurrence = occurrence + 1
    end do
  end function occurrence

  !> What stands between continuing an old run with a new case file: a line `&group key: old -> new`
  !> for every key that results depend on and that differs; empty if there is none.
  subroutine compare_configs(old_text, new_text, differences, error)
    character(len=*), intent(in) :: old_text, new_text
    character(len=:), allocatable, intent(out) :: differences
    type(error_t), allocatable, intent(out) :: error
    type(config_t) :: old_config, new_config
    type(namelist_t) :: old, new
    integer :: g, other

    differences = ''
    call read_config(old_text, 'old case', old_config, error)
    if (allocated(error)) return
    call read_config(new_text, 'new case', new_config, error)
    if (allocated(error)) return
    call write_namelist(old_config, old)
    call write_namelist(new_config, new)
    do g = 1, old%number
      other = new%locate(old%groups(g)%name, occurrence(old, g))
      call compare_groups(old, g, new, other, .false., differences)
    end do
    do g = 1, new%number
      other = old%locate(new%groups(g)%name, occurrence(new, g))
      call compare_groups(new, g, old, other, .true., differences)
    end do
    ! What a member of a Latin hypercube is depends on how many there are.
    associate (then => old_config%monte_carlo, now => new_config%monte_carlo)
      if (then%sampling /= 'latin_hypercube' .or. then%realizations == now%realizations) return
      if (len(differences) > 0) differences = differences//new_line('a')
      differences = differences//'&monte_carlo realizations: '//to_text(then%realizations)// &
        ' -> '//to_text(now%realizations)//' (a Latin hypercube has a fixed size)'
    end associate
  end subroutine compare_configs

  !> Compares group `g` of `here` with group `o` of `there` (0: not there). `backwards`: `here` is
  !> the new file, and only what the old one has not got is of interest.
  subroutine compare_groups(here, g, there, o, backwards, differences)
    type(namelist_t), intent(in) :: here, there
    integer, intent(in) :: g, o
    logical, intent(in) :: backwards
    character(len=:), allocatable, intent(inout) :: differences
    character(len=:), allocatable :: place, mine, yours
    integer :: e, f

    associate (group => here%groups(g))
      place = '&'//group%name
      if (here%count(group%name) > 1) place = place//' '//to_text(occurrence(here, g))
      do e = 1, group%number
        if (.not. matters(group%name, group%entries(e)%key)) cycle
        mine = values_text(group%entries(e))
        yours = '(not set)'
        f = 0
        if (o > 0) f = there%groups(o)%find(group%entries(e)%key)
        if (f > 0) yours = values_text(there%groups(o)%entries(f))
        if (mine == yours .or. (backwards .and. f > 0)) cycle
        if (backwards) then
          call append(place//' '//group%entries(e)%key//': '//yours//' -> '//mine)
        else
          call append(place//' '//group%entries(e)%key//': '//mine//' -> '//yours)
        end if
      end do
    end associate

  contains

    subroutine append(line)
      character(len=*), intent(in) :: line
      if (len(differences) > 0) differences = differences//new_line('a')
      differences = differences//line
    end subroutine append
  end subroutine compare_groups

  subroutine write_namelist(config, nml)
    type(config_t), intent(in) :: config
    type(namelist_t), intent(out) :: nml
    type(config_t) :: copy
    type(writer_t) :: writer

    copy = config
    call visit_config(copy, writer)
    nml = writer%nml
  end subroutine write_namelist

  pure function values_text(entry) result(text)
    type(nml_entry_t), intent(in) :: entry
    character(len=:), allocatable :: text
    integer :: i

    text = ''
    do i = 1, entry%number
      if (i > 1) text = text//', '
      if (entry%values(i)%quoted) then
        text = text//''''//doubled(entry%values(i)%text)//''''
      else
        text = text//entry%values(i)%text
      end if
    end do
  end function values_text

  !> Text with every single quote doubled.
  pure function doubled(text) result(twice)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: twice
    integer :: i

    twice = ''
    do i = 1, len(text)
      twice = twice//text(i:i)
      if (text(i:i) == '''') twice = twice//text(i:i)
    end do
  end function doubled

  subroutine begin_group(this, group, occurrence)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: group
    integer, intent(in) :: occurrence

    this%group_name = group
    call this%nml%add_group(group, occurrence)
  end subroutine begin_group

  !> Keeps a key with its values, unless it does not apply or is not set.
  subroutine take(this, key, values)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    !> Blanks at the end do not count.
    character(len=*), intent(in) :: values(:)
    integer :: row, i

    row = key_row(this%group_name, key)
    associate (group => this%nml%groups(this%nml%number))
      if (size(values) == 0) return
      if (len(why_not(this%nml, group, KEYS(row))) > 0) return
      call group%add_entry(key, 0)
      do i = 1, size(values)
        call group%entries(group%number)%add_value(trim(values(i)), &
          KEYS(row)%kind /= KIND_REAL .and. KEYS(row)%kind /= KIND_INTEGER, 0)
      end do
    end associate
  end subroutine take

  !> A value of its own. (No array constructor around a text of deferred length: gfortran 12 frees
  !> it twice.)
  subroutine take_one(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key, value
    character(len=len(value)) :: values(1)

    values(1) = value
    call this%take(key, values)
  end subroutine take_one

  subroutine visit_real(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    real(wp), intent(inout) :: value
    integer :: row

    row = key_row(this%group_name, key)
    ! A key without default that is out of its range has not been given.
    if (len_trim(KEYS(row)%default) == 0 .and. .not. range_holds(KEYS(row)%range, value)) return
    call this%take_one(key, to_text(value))
  end subroutine visit_real

  subroutine visit_pair(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    real(wp), intent(inout) :: value(2)
    character(len=32) :: texts(2)

    texts(1) = to_text(value(1))
    texts(2) = to_text(value(2))
    call this%take(key, texts)
  end subroutine visit_pair

  subroutine visit_reals(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    real(wp), allocatable, intent(inout) :: value(:)
    character(len=32) :: texts(size(value))
    integer :: i

    do i = 1, size(value)
      texts(i) = to_text(value(i))
    end do
    call this%take(key, texts)
  end subroutine visit_reals

  subroutine visit_integer(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer, intent(inout) :: value

    call this%take_one(key, to_text(value))
  end subroutine visit_integer

  subroutine visit_long(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer(i8), intent(inout) :: value

    call this%take_one(key, to_text(value))
  end subroutine visit_long

  subroutine visit_integers(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer, allocatable, intent(inout) :: value(:)
    character(len=32) :: texts(size(value))
    integer :: i

    do i = 1, size(value)
      texts(i) = to_text(value(i))
    end do
    call this%take(key, texts)
  end subroutine visit_integers

  subroutine visit_word(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    character(len=NAME_LENGTH), intent(inout) :: value

    ! A name that has not been given, and needs not.
    if (value == '') return
    call this%take_one(key, value)
  end subroutine visit_word

  subroutine visit_words(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    character(len=NAME_LENGTH), allocatable, intent(inout) :: value(:)

    call this%take(key, value)
  end subroutine visit_words

  subroutine visit_text(this, key, value)
    class(writer_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    character(len=:), allocatable, intent(inout) :: value

    call this%take_one(key, value)
  end subroutine visit_text

  subroutine visit_study_lists(this, lists)
    class(writer_t), intent(inout) :: this
    type(study_list_t), allocatable, intent(inout) :: lists(:)
    integer :: i, k

    associate (group => this%nml%groups(this%nml%number))
      do k = 1, size(lists)
        call group%add_entry(trim(lists(k)%name), 0)
        do i = 1, size(lists(k)%values)
          call group%entries(group%number)%add_value(trim(lists(k)%values(i)), &
            KEYS(lists(k)%row)%kind == KIND_WORD, 0)
        end do
      end do
    end associate
  end subroutine visit_study_lists
end module sg_resolved
