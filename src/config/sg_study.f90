!> The variants of a case that &study makes: every combination of the values it lists for keys of
!> other groups than the first random field's acf and cov, which are combined by the plan.
module sg_study
  use sg_config, only: config_t, study_list_t
  use sg_kinds, only: i8, wp
  use sg_namelist, only: namelist_t, nml_value_t
  use sg_number_text, only: parse_integer, parse_real
  use sg_schema, only: group_row, GROUPS, has_word, key_row, KEYS, KIND_INTEGER, KIND_REAL, &
    KIND_WORD
  use sg_study_keys, only: find_study_key
  use sg_text, only: lower_case, to_text
  implicit none
  private

  public :: variant_t, listed_keys, combination_count, choice_of, apply_choice, override_key
  public :: text_of_choice, suffix_of_choice

  !> One of them: a case of its own in all but the random numbers.
  type :: variant_t
    type(config_t) :: config
    !> Which value of each list it has, and the same as text: `damping=0.7, cell_size=0.25`; empty
    !> where nothing is listed.
    integer, allocatable :: choice(:)
    character(len=:), allocatable :: varied
    !> What it adds to the labels of its cases: `_damping0.7_cell_size0.25`.
    character(len=:), allocatable :: suffix
    !> Position of the variant that this one is the twin of on coarser cells; 0: of none.
    integer :: twin_of = 0
  contains
    procedure :: note => note_of_variant
  end type variant_t

  !> Properties that a field takes from the material of the same name: a listed mean is that of
  !> the homogeneous material, too.
  character(len=*), parameter :: NOMINAL = &
    'friction_angle cohesion undrained_strength young density dilation_angle'

contains

  !> The keys of other groups that &study lists and that have passed their checks, with their values
  !> in their shortest form; in the order of the schema, whatever that of the file: results are kept
  !> by the position of their case.
  subroutine listed_keys(nml, lists)
    type(namelist_t), intent(in) :: nml
    type(study_list_t), allocatable, intent(out) :: lists(:)
    type(study_list_t), allocatable :: found(:)
    character(len=:), allocatable :: fault
    integer :: e, g, i, k, used

    allocate (lists(0))
    g = nml%locate('study', 1)
    if (g == 0) return
    associate (group => nml%groups(g))
      allocate (found(group%number))
      used = 0
      do e = 1, group%number
        if (key_row('study', group%entries(e)%key) > 0 .or. .not. group%entries(e)%usable) cycle
        used = used + 1
        associate (one => found(used), entry => group%entries(e))
          one%name = entry%key
          call find_study_key(nml, entry%key, one%row, one%occurrence, fault)
          allocate (one%values(entry%number))
          do i = 1, entry%number
            one%values(i) = shortest(KEYS(one%row)%kind, entry%values(i)%text)
          end do
        end associate
      end do
    end associate
    lists = found(:used)
    do k = 2, used
      do i = k, 2, -1
        if (.not. comes_before(lists(i), lists(i - 1))) exit
        lists(i - 1:i) = lists([i, i - 1])
      end do
    end do
  end subroutine listed_keys

  pure logical function comes_before(one, other)
    type(study_list_t), intent(in) :: one, other

    comes_before = one%row < other%row .or. (one%row == other%row .and. &
      one%occurrence < other%occurrence)
  end function comes_before

  pure function shortest(kind_of_key, text) result(short)
    integer, intent(in) :: kind_of_key
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: short
    character(len=:), allocatable :: fault
    real(wp) :: value
    integer(i8) :: whole

    select case (kind_of_key)
    case (KIND_REAL)
      call parse_real(text, value, fault)
      short = to_text(value)
    case (KIND_INTEGER)
      call parse_integer(text, whole, fault)
      short = to_text(whole)
    case default
      short = lower_case(text)
    end select
  end function shortest

  pure integer(i8) function combination_count(lists) result(number)
    type(study_list_t), intent(in) :: lists(:)
    integer :: k

    number = 1
    do k = 1, size(lists)
      number = number*size(lists(k)%values)
    end do
  end function combination_count

  !> Which value of each list combination `number`, from 1 on, has; the last list runs fastest.
  pure function choice_of(lists, number) result(choice)
    type(study_list_t), intent(in) :: lists(:)
    integer, intent(in) :: number
    integer :: choice(size(lists))
    integer :: k, rest

    rest = number - 1
    do k = size(lists), 1, -1
      choice(k) = mod(rest, size(lists(k)%values)) + 1
      rest = rest/size(lists(k)%values)
    end do
  end function choice_of

  !> Puts the chosen values into their groups.
  subroutine apply_choice(lists, choice, nml)
    type(study_list_t), intent(in) :: lists(:)
    integer, intent(in) :: choice(:)
    type(namelist_t), intent(inout) :: nml
    type(nml_value_t) :: value
    character(len=:), allocatable :: mean
    integer :: k

    do k = 1, size(lists)
      associate (group => nml%groups(nml%locate('study', 1)))
        value = group%entries(group%find(trim(lists(k)%name)))%values(choice(k))
        value%text = trim(lists(k)%values(choice(k)))
      end associate
      associate (key => KEYS(lists(k)%row), number => lists(k)%occurrence)
        if (key%group == 'random_field' .and. key%name == 'mean') then
          mean = first_value(nml, 'random_field', number, 'mean')
          if (mean == '') mean = trim(lists(k)%values(1))
          call override_nominal(nml, number, mean, value)
        end if
        call override_key(nml, trim(key%group), number, trim(key%name), value)
      end associate
    end do
  end subroutine apply_choice

  !> Where the material has had the `mean` of field `k`, as property of the homogeneous ground, it
  !> has the new one, too. Not where the field is only for a part of the material.
  subroutine override_nominal(nml, k, mean, value)
    type(namelist_t), intent(inout) :: nml
    integer, intent(in) :: k
    character(len=*), intent(in) :: mean
    type(nml_value_t), intent(in) :: value
    character(len=:), allocatable :: material, property, present_value
    integer :: m

    if (first_value(nml, 'random_field', k, 'region') /= '') return
    if (first_value(nml, 'random_field', k, 'body') /= '') return
    material = first_value(nml, 'random_field', k, 'material')
    property = lower_case(first_value(nml, 'random_field', k, 'property'))
    if (property == '') property = trim(KEYS(key_row('random_field', 'property'))%default)
    if (.not. has_word(NOMINAL, property)) return
    do m = 1, nml%count('material')
      if (first_value(nml, 'material', m, 'name') /= material) cycle
      present_value = first_value(nml, 'material', m, property)
      if (shortest(KIND_REAL, present_value) /= shortest(KIND_REAL, mean)) cycle
      call override_key(nml, 'material', m, property, value)
    end do
  end subroutine override_nominal

  !> Empty where the file has not got it.
  function first_value(nml, group, occurrence, key) result(text)
    type(namelist_t), intent(in) :: nml
    character(len=*), intent(in) :: group, key
    integer, intent(in) :: occurrence
    character(len=:), allocatable :: text
    integer :: e, g

    text = ''
    g = nml%locate(group, occurrence)
    if (g == 0) return
    e = nml%groups(g)%find(key)
    if (e == 0) return
    if (nml%groups(g)%entries(e)%number > 0) text = nml%groups(g)%entries(e)%values(1)%text
  end function first_value

  !> Gives a key one value, instead of what it has. A group that is not there is made.
  subroutine override_key(nml, group, occurrence, key, value)
    type(namelist_t), intent(inout) :: nml
    character(len=*), intent(in) :: group, key
    integer, intent(in) :: occurrence
    type(nml_value_t), intent(in) :: value
    integer :: e, g

    g = nml%locate(group, occurrence)
    if (g == 0) then
      call nml%add_group(group, value%line)
      g = nml%number
    end if
    e = nml%groups(g)%find(key)
    if (e == 0) then
      call nml%groups(g)%add_entry(key, value%line)
      e = nml%groups(g)%number
    end if
    associate (entry => nml%groups(g)%entries(e))
      entry%number = 0
      entry%line = value%line
      entry%spoilt = .false.
      call entry%add_value(value%text, value%quoted, value%line)
    end associate
  end subroutine override_key

  !> Said behind what is wrong with a variant: which one it is; empty where there is only one.
  pure function note_of_variant(this) result(note)
    class(variant_t), intent(in) :: this
    character(len=:), allocatable :: note

    note = ''
    if (this%varied /= '') note = ' [with '//this%varied//']'
    if (this%twin_of > 0) note = ' [as control variate]'//note
  end function note_of_variant

  !> A list in labels: its key alone; with its group where that is not the first of its name, or
  !> where another list has the same key: `body2.height`.
  pure function short_name(lists, k) result(name)
    type(study_list_t), intent(in) :: lists(:)
    integer, intent(in) :: k
    character(len=:), allocatable :: name

    associate (key => KEYS(lists(k)%row))
      name = trim(key%name)
      if (lists(k)%occurrence == 1 .and. count(KEYS(lists%row)%name == key%name) == 1) return
      name = trim(key%group)//'.'//name
      if (GROUPS(group_row(trim(key%group)))%repeatable) name = trim(key%group)// &
        to_text(lists(k)%occurrence)//'.'//trim(key%name)
    end associate
  end function short_name

  !> `damping=0.7, scheme=usl`, of the lists that are `wanted` (all by default).
  pure function text_of_choice(lists, choice, wanted) result(text)
    type(study_list_t), intent(in) :: lists(:)
    integer, intent(in) :: choice(:)
    logical, intent(in), optional :: wanted(:)
    character(len=:), allocatable :: text

    text = chosen(lists, choice, ', ', '=', '=', wanted)
    if (text /= '') text = text(3:)
  end function text_of_choice

  !> The same for labels, where numbers stand close to their key and words behind a dash:
  !> `_damping0.7_scheme-usl`.
  pure function suffix_of_choice(lists, choice, wanted) result(text)
    type(study_list_t), intent(in) :: lists(:)
    integer, intent(in) :: choice(:)
    logical, intent(in), optional :: wanted(:)
    character(len=:), allocatable :: text

    text = chosen(lists, choice, '_', '', '-', wanted)
  end function suffix_of_choice

  !> Keys and values, with `before` before each key and a mark before its number or word.
  pure function chosen(lists, choice, before, number_mark, word_mark, wanted) result(text)
    type(study_list_t), intent(in) :: lists(:)
    integer, intent(in) :: choice(:)
    character(len=*), intent(in) :: before, number_mark, word_mark
    logical, intent(in), optional :: wanted(:)
    character(len=:), allocatable :: text, mark
    integer :: k

    text = ''
    do k = 1, size(lists)
      if (present(wanted)) then
        if (.not. wanted(k)) cycle
      end if
      mark = number_mark
      if (KEYS(lists(k)%row)%kind == KIND_WORD) mark = word_mark
      text = text//before//short_name(lists, k)//mark//trim(lists(k)%values(choice(k)))
    end do
  end function chosen
end module sg_study
