!> From the text of a case file to the typed configuration. The text is scanned and checked against
!> the schema, then the components of `config_t` are filled, then checked together. All faults are
!> reported at once.
module sg_read_config
  use sg_angles, only: DEGREE
  use sg_check_config, only: check_config
  use sg_check_keys, only: check_keys, check_study_keys
  use sg_config, only: config_t, NAME_LENGTH, random_field_config_t, study_list_t
  use sg_config_fields, only: config_visitor_t, visit_config
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_fault_list, only: fault_list_t
  use sg_kinds, only: i8, wp
  use sg_namelist, only: namelist_t, nml_value_t
  use sg_number_text, only: parse_integer, parse_real
  use sg_posix, only: hash_of_file, working_directory
  use sg_scan, only: scan_namelist
  use sg_schema, only: count_words, key_row, KEYS, KIND_WORD, word_at
  use sg_study, only: apply_choice, choice_of, combination_count, listed_keys, override_key, &
    suffix_of_choice, text_of_choice, variant_t
  use sg_text, only: lower_case, to_text
  implicit none
  private

  public :: read_config, read_variants

  !> Takes values from a scanned case file, or defaults where it has none.
  type, extends(config_visitor_t) :: reader_t
    type(namelist_t) :: nml
    character(len=20) :: group_name = ''
    !> Index of the present group, 0 if the file has not got it.
    integer :: group = 0
    logical :: is_deterministic = .false.
  contains
    procedure :: values_of
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
  end type reader_t

  !> Of labels of twice NAME_LENGTH, with acf, cov and `_control` before and behind.
  integer, parameter :: LONGEST_SUFFIX = 2*NAME_LENGTH - 32
  !> More variants of a case are a mistake.
  integer(i8), parameter :: MOST_VARIANTS = 1000_i8

contains

  !> Fills `config` from `text`, a whole case file; of keys that &study lists it has the first
  !> value.
  !> On faults `error` has code EXIT_BAD_INPUT and as message all faults, one a line, each
  !> `file:line: &group key: what is wrong`.
  subroutine read_config(text, file_name, config, error)
    character(len=*), intent(in) :: text
    !> For messages only.
    character(len=*), intent(in) :: file_name
    type(config_t), intent(out) :: config
    type(error_t), allocatable, intent(out) :: error
    type(namelist_t) :: nml
    type(fault_list_t) :: faults
    type(study_list_t), allocatable :: lists(:)

    call scan_text(text, file_name, nml, lists, faults, error)
    if (allocated(error)) return
    call apply_choice(lists, choice_of(lists, 1), nml)
    call take_config(nml, file_name, config, faults)
    if (faults%number > 0) call raise(error, EXIT_BAD_INPUT, faults%text(file_name), file_name)
  end subroutine read_config

  !> The case with every combination of what &study lists beyond acf and cov (one where it lists
  !> nothing), and behind them the twins of all on coarser cells, where &control_variate asks for
  !> them. Faults as in `read_config`, with the combination that has them.
  subroutine read_variants(text, file_name, variants, error)
    character(len=*), intent(in) :: text, file_name
    type(variant_t), allocatable, intent(out) :: variants(:)
    type(error_t), allocatable, intent(out) :: error
    type(namelist_t) :: nml
    type(fault_list_t) :: faults, more
    type(study_list_t), allocatable :: lists(:)
    integer :: v, number

    call scan_text(text, file_name, nml, lists, faults, error)
    if (allocated(error)) return
    call check_lists(nml, lists, faults)
    number = 1
    if (combination_count(lists) <= MOST_VARIANTS) number = int(combination_count(lists))
    allocate (variants(number*merge(2, 1, nml%count('control_variate') > 0)))
    do v = 1, size(variants)
      associate (variant => variants(v))
        variant%choice = choice_of(lists, mod(v - 1, number) + 1)
        variant%varied = text_of_choice(lists, variant%choice)
        variant%suffix = suffix_of_choice(lists, variant%choice)
        if (v > number) variant%twin_of = v - number
        more = fault_list_t()
        call take_variant(nml, lists, variant, file_name, more)
        call faults%add_of(more, variant%note())
      end associate
    end do
    call faults%settle(size(variants))
    if (faults%number > 0) call raise(error, EXIT_BAD_INPUT, faults%text(file_name), file_name)
  end subroutine read_variants

  subroutine take_variant(nml, lists, variant, file_name, faults)
    type(namelist_t), intent(in) :: nml
    type(study_list_t), intent(in) :: lists(:)
    type(variant_t), intent(inout) :: variant
    character(len=*), intent(in) :: file_name
    type(fault_list_t), intent(inout) :: faults
    type(namelist_t) :: own
    integer :: e, g

    own = nml
    call apply_choice(lists, variant%choice, own)
    if (variant%twin_of > 0) then
      g = own%locate('control_variate', 1)
      e = own%groups(g)%find('cell_size')
      if (e == 0) return
      if (own%groups(g)%entries(e)%number /= 1) return
      call override_key(own, 'grid', 1, 'cell_size', own%groups(g)%entries(e)%values(1))
    end if
    call take_config(own, file_name, variant%config, faults)
    associate (config => variant%config)
      if (variant%twin_of > 0 .or. .not. config%has_control_variate) return
      if (.not. config%control_variate%cell_size > 0.0_wp) return
      if (config%control_variate%cell_size <= config%grid%cell_size) call faults%add( &
        nml%line_of('control_variate', 1, 'cell_size'), '&control_variate cell_size', &
        to_text(config%control_variate%cell_size)//' m is not above cell_size of &grid, '// &
        to_text(config%grid%cell_size)//' m (allowed: coarser cells)')
    end associate
  end subroutine take_variant

  !> Text, keys that &study lists, and their values.
  subroutine scan_text(text, file_name, nml, lists, faults, error)
    character(len=*), intent(in) :: text, file_name
    type(namelist_t), intent(out) :: nml
    type(study_list_t), allocatable, intent(out) :: lists(:)
    type(fault_list_t), intent(inout) :: faults
    type(error_t), allocatable, intent(out) :: error

    if (index(text, achar(0)) > 0) then
      call raise(error, EXIT_BAD_INPUT, file_name// &
        ':1: this is no text file, it holds zero bytes '// &
        '(a case file is plain ASCII or UTF-8)', file_name)
      return
    end if
    call scan_namelist(text, nml, faults)
    call check_study_keys(nml, faults)
    call listed_keys(nml, lists)
  end subroutine scan_text

  !> Values listed twice, a study that no machine finishes, and labels that would be cut off.
  subroutine check_lists(nml, lists, faults)
    type(namelist_t), intent(in) :: nml
    type(study_list_t), intent(in) :: lists(:)
    type(fault_list_t), intent(inout) :: faults
    integer :: i, k, v

    do k = 1, size(lists)
      do i = 2, size(lists(k)%values)
        if (all(lists(k)%values(:i - 1) /= lists(k)%values(i))) cycle
        call faults%add(nml%line_of('study', 1, trim(lists(k)%name)), '&study '// &
          trim(lists(k)%name), trim(lists(k)%values(i))//' is listed twice')
        exit
      end do
    end do
    if (combination_count(lists) > MOST_VARIANTS) then
      call faults%add(nml%line_of('study', 1, ''), '&study', 'makes '// &
        to_text(combination_count(lists))//' combinations (allowed: up to '// &
        to_text(MOST_VARIANTS)//')')
      return
    end if
    do v = 1, int(combination_count(lists))
      if (len(suffix_of_choice(lists, choice_of(lists, v))) <= LONGEST_SUFFIX) cycle
      call faults%add(nml%line_of('study', 1, ''), '&study', 'lists so many keys that the '// &
        'labels of its cases get longer than '//to_text(2*NAME_LENGTH)//' characters')
      return
    end do
  end subroutine check_lists

  !> Checks the keys, fills `config` from `nml` and checks that, too.
  subroutine take_config(nml, file_name, config, faults)
    type(namelist_t), intent(in) :: nml
    character(len=*), intent(in) :: file_name
    type(config_t), intent(out) :: config
    type(fault_list_t), intent(inout) :: faults
    type(reader_t) :: reader

    reader%nml = nml
    call check_keys(reader%nml, faults)
    config%has_random_field = reader%nml%count('random_field') > 0
    config%has_study = reader%nml%count('study') > 0
    config%has_control_variate = config%has_random_field .and. &
      reader%nml%count('control_variate') > 0
    reader%is_deterministic = .not. config%has_random_field
    allocate (config%materials(reader%nml%count('material')))
    allocate (config%bodies(reader%nml%count('body')))
    allocate (config%boundaries(reader%nml%count('boundary')))
    allocate (config%random_fields(reader%nml%count('random_field')))
    allocate (config%cross_correlations(merge(reader%nml%count('cross_correlation'), 0, &
      config%has_random_field)))
    call visit_config(config, reader)
    call complete(config, file_name)
    call check_config(config, reader%nml, faults)
  end subroutine take_config

  !> Values that follow from others.
  subroutine complete(config, file_name)
    type(config_t), intent(inout) :: config
    character(len=*), intent(in) :: file_name
    character(len=*), parameter :: NAME_MARK = '<name>'
    integer :: i, mark

    do i = 1, size(config%bodies)
      config%bodies(i)%material_index = index_of(config%bodies(i)%material, config%materials%name)
      if (config%bodies(i)%file /= '') config%bodies(i)%file = &
        path_beside(file_name, config%bodies(i)%file)
    end do
    mark = index(config%output%directory, NAME_MARK)
    if (mark > 0) config%output%directory = config%output%directory(:mark - 1)// &
      trim(config%name)//config%output%directory(mark + len(NAME_MARK):)
    do i = 1, size(config%random_fields)
      call complete_field(config, file_name, config%random_fields(i))
    end do
    do i = 1, size(config%cross_correlations)
      config%cross_correlations(i)%fields = 0
      if (size(config%cross_correlations(i)%between) /= 2) cycle
      config%cross_correlations(i)%fields = [index_of(config%cross_correlations(i)%between(1), &
        config%random_fields%name), index_of(config%cross_correlations(i)%between(2), &
        config%random_fields%name)]
    end do
    if (.not. config%has_study) then
      allocate (config%study%acf(0), config%study%cov(0), config%study%lists(0))
    end if
    if (config%has_random_field) call complete_study(config)
  end subroutine complete

  subroutine complete_field(config, file_name, field)
    type(config_t), intent(in) :: config
    character(len=*), intent(in) :: file_name
    type(random_field_config_t), intent(inout) :: field

    if (field%name == '') field%name = field%property
    field%material_index = index_of(field%material, config%materials%name)
    field%body_index = index_of(field%body, config%bodies%name)
    if (field%data /= '') field%data = path_beside(file_name, field%data)
    if (field%file /= '') field%file = path_beside(file_name, field%file)
    if (field%data /= '' .and. field%data_content == '') field%data_content = &
      hash_of_file(field%data)
    if (field%file /= '' .and. field%file_content == '') field%file_content = &
      hash_of_file(field%file)
    if (size(field%lower) == 0) field%lower = [usual_lower(field)]
    if (size(field%upper) == 0) field%upper = usual_upper(field%property)
    field%bounds = [field%lower(1), huge(1.0_wp)]
    if (size(field%upper) > 0) field%bounds(2) = field%upper(1)
  end subroutine complete_field

  !> Bounds that a property has where the case gives none. Stiffness and density must not vanish.
  pure real(wp) function usual_lower(field) result(lower)
    type(random_field_config_t), intent(in) :: field

    select case (field%property)
    case ('friction_angle')
      lower = 1.0_wp
    case ('tan_friction_angle')
      lower = tan(1.0_wp*DEGREE)
    case ('young', 'density')
      lower = 0.01_wp*field%mean
    case default
      lower = 0.0_wp
    end select
  end function usual_lower

  !> Size 0 for none.
  pure function usual_upper(property) result(upper)
    character(len=*), intent(in) :: property
    real(wp), allocatable :: upper(:)

    select case (property)
    case ('friction_angle', 'dilation_angle')
      upper = [60.0_wp]
    case ('tan_friction_angle')
      upper = [tan(60.0_wp*DEGREE)]
    case default
      allocate (upper(0))
    end select
  end function usual_upper

  !> The study varies the first field; without one, or without a list, that is as it is. A list
  !> takes the place of what the first field has.
  subroutine complete_study(config)
    type(config_t), intent(inout) :: config

    associate (field => config%random_fields(1), study => config%study)
      if (size(study%acf) == 0) then
        study%acf = [field%acf]
      else if (len_trim(field%acf) == 0) then
        field%acf = study%acf(1)
      end if
      if (size(study%cov) == 0) then
        study%cov = [0.0_wp]
        if (size(field%cov) > 0) study%cov = field%cov
      else if (size(field%cov) == 0 .and. size(field%sd) == 0) then
        field%cov = [study%cov(1)]
      end if
    end associate
  end subroutine complete_study

  !> `path` as it counts from the directory of `file_name`, made absolute so that resolved.nml can
  !> stand elsewhere.
  function path_beside(file_name, path) result(absolute)
    character(len=*), intent(in) :: file_name, path
    character(len=:), allocatable :: absolute

    absolute = file_name(:index(file_name, '/', back=.true.))//path
    if (path(1:1) == '/') absolute = path
    if (absolute(1:1) /= '/') absolute = working_directory()//'/'//absolute
  end function path_beside

  !> The first of `names` that is `name`, or 0.
  pure integer function index_of(name, names) result(i)
    character(len=*), intent(in) :: name, names(:)

    do i = 1, size(names)
      if (names(i) == name) return
    end do
    i = 0
  end function index_of

  subroutine begin_group(this, group, occurrence)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: group
    integer, intent(in) :: occurrence

    this%group_name = group
    this%group = this%nml%locate(group, occurrence)
  end subroutine begin_group

  !> The values of a key, from the file or by default; none for a key without either.
  subroutine values_of(this, key, values)
    class(reader_t), intent(in) :: this
    character(len=*), intent(in) :: key
    !> Not allocated before (intent(out) would say so, but makes gfortran 12 warn in vain).
    type(nml_value_t), allocatable, intent(inout) :: values(:)
    character(len=:), allocatable :: default
    integer :: entry, row, i

    row = key_row(this%group_name, key)
    entry = 0
    if (this%group > 0) entry = this%nml%groups(this%group)%find(key)
    if (entry > 0) then
      if (this%nml%groups(this%group)%entries(entry)%usable) then
        values = this%nml%groups(this%group)%entries(entry)%values( &
          :this%nml%groups(this%group)%entries(entry)%number)
        if (KEYS(row)%kind == KIND_WORD) then
          do i = 1, size(values)
            values(i)%text = lower_case(values(i)%text)
          end do
        end if
        return
      end if
    end if
    default = trim(KEYS(row)%default)
    if (this%is_deterministic .and. len_trim(KEYS(row)%default_deterministic) > 0) then
      default = trim(KEYS(row)%default_deterministic)
    end if
    allocate (values(count_words(default)))
    do i = 1, size(values)
      values(i)%text = word_at(default, i)
    end do
  end subroutine values_of

  pure real(wp) function real_of(value)
    type(nml_value_t), intent(in) :: value
    character(len=:), allocatable :: fault

    call parse_real(value%text, real_of, fault)
  end function real_of

  pure integer(i8) function long_of(value)
    type(nml_value_t), intent(in) :: value
    character(len=:), allocatable :: fault

    call parse_integer(value%text, long_of, fault)
  end function long_of

  subroutine visit_real(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    real(wp), intent(inout) :: value
    type(nml_value_t), allocatable :: values(:)

    call this%values_of(key, values)
    value = 0.0_wp
    if (size(values) > 0) value = real_of(values(1))
  end subroutine visit_real

  subroutine visit_pair(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    real(wp), intent(inout) :: value(2)
    real(wp), allocatable :: list(:)

    call this%visit_reals(key, list)
    value = 0.0_wp
    if (size(list) == 2) value = list
  end subroutine visit_pair

  subroutine visit_reals(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    real(wp), allocatable, intent(inout) :: value(:)
    type(nml_value_t), allocatable :: values(:)
    integer :: i

    call this%values_of(key, values)
    value = [(real_of(values(i)), i=1, size(values))]
  end subroutine visit_reals

  subroutine visit_integer(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer, intent(inout) :: value
    integer(i8) :: long

    call this%visit_long(key, long)
    value = int(long)
  end subroutine visit_integer

  subroutine visit_long(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer(i8), intent(inout) :: value
    type(nml_value_t), allocatable :: values(:)

    call this%values_of(key, values)
    value = 0_i8
    if (size(values) > 0) value = long_of(values(1))
  end subroutine visit_long

  subroutine visit_integers(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer, allocatable, intent(inout) :: value(:)
    type(nml_value_t), allocatable :: values(:)
    integer :: i

    call this%values_of(key, values)
    value = [(int(long_of(values(i))), i=1, size(values))]
  end subroutine visit_integers

  subroutine visit_word(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    character(len=NAME_LENGTH), intent(inout) :: value
    type(nml_value_t), allocatable :: values(:)

    call this%values_of(key, values)
    value = ''
    if (size(values) > 0) value = values(1)%text
  end subroutine visit_word

  subroutine visit_words(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    character(len=NAME_LENGTH), allocatable, intent(inout) :: value(:)
    type(nml_value_t), allocatable :: values(:)
    integer :: i

    call this%values_of(key, values)
    if (allocated(value)) deallocate (value)
    allocate (value(size(values)))
    do i = 1, size(values)
      value(i) = values(i)%text
    end do
  end subroutine visit_words

  subroutine visit_text(this, key, value)
    class(reader_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    character(len=:), allocatable, intent(inout) :: value
    type(nml_value_t), allocatable :: values(:)

    call this%values_of(key, values)
    value = ''
    if (size(values) > 0) value = trim(values(1)%text)
  end subroutine visit_text

  subroutine visit_study_lists(this, lists)
    class(reader_t), intent(inout) :: this
    type(study_list_t), allocatable, intent(inout) :: lists(:)

    call listed_keys(this%nml, lists)
  end subroutine visit_study_lists
end module sg_read_config
