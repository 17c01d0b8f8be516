!> The text of a case file, taken apart: groups, keys and values with their line numbers, all still
!> text. The scanner fills it, checks mark what can be used, `sg_read_config` takes values out of
!> it; for `resolved.nml` it goes the other way.
module sg_namelist
  implicit none
  private

  public :: namelist_t, nml_group_t, nml_entry_t, nml_value_t

  type :: nml_value_t
    character(len=:), allocatable :: text
    !> It stood in quotes (which `text` has not).
    logical :: quoted = .false.
    integer :: line = 0
  end type nml_value_t

  !> A key with its values.
  type :: nml_entry_t
    character(len=:), allocatable :: key
    integer :: line = 0
    integer :: number = 0
    type(nml_value_t), allocatable :: values(:)
    !> Its syntax is wrong and has been reported: no further complaints.
    logical :: spoilt = .false.
    !> It has passed the checks of the schema.
    logical :: usable = .false.
  contains
    procedure :: add_value
  end type nml_entry_t

  type :: nml_group_t
    character(len=:), allocatable :: name
    integer :: line = 0
    integer :: number = 0
    type(nml_entry_t), allocatable :: entries(:)
  contains
    procedure :: add_entry
    procedure :: find
  end type nml_group_t

  type :: namelist_t
    integer :: number = 0
    type(nml_group_t), allocatable :: groups(:)
    !> Number of lines of the file.
    integer :: lines = 1
  contains
    procedure :: add_group
    procedure :: count => count_groups
    procedure :: locate
    procedure :: line_of
  end type namelist_t

contains

  subroutine add_value(this, text, quoted, line)
    class(nml_entry_t), intent(inout) :: this
    character(len=*), intent(in) :: text
    logical, intent(in) :: quoted
    integer, intent(in) :: line
    type(nml_value_t), allocatable :: more(:)

    if (.not. allocated(this%values)) allocate (this%values(2))
    if (this%number == size(this%values)) then
      allocate (more(2*this%number))
      more(:this%number) = this%values
      call move_alloc(more, this%values)
    end if
    this%number = this%number + 1
    this%values(this%number)%text = text
    this%values(this%number)%quoted = quoted
    this%values(this%number)%line = line
  end subroutine add_value

  !> Adds a key without values; it is entry `this%number` then.
  subroutine add_entry(this, key, line)
    class(nml_group_t), intent(inout) :: this
    character(len=*), intent(in) :: key
    integer, intent(in) :: line
    type(nml_entry_t), allocatable :: more(:)

    if (.not. allocated(this%entries)) allocate (this%entries(8))
    if (this%number == size(this%entries)) then
      allocate (more(2*this%number))
      more(:this%number) = this%entries
      call move_alloc(more, this%entries)
    end if
    this%number = this%number + 1
    this%entries(this%number)%key = key
    this%entries(this%number)%line = line
  end subroutine add_entry

  !> Index of the first entry of a key, 0 if the group has not got it.
  pure integer function find(this, key) result(entry)
    class(nml_group_t), intent(in) :: this
    character(len=*), intent(in) :: key
    integer :: i

    entry = 0
    do i = 1, this%number
      if (this%entries(i)%key == key) then
        entry = i
        return
      end if
    end do
  end function find

  !> Adds an empty group; it is group `this%number` then.
  subroutine add_group(this, name, line)
    class(namelist_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    integer, intent(in) :: line
    type(nml_group_t), allocatable :: more(:)

    if (.not. allocated(this%groups)) allocate (this%groups(16))
    if (this%number == size(this%groups)) then
      allocate (more(2*this%number))
      more(:this%number) = this%groups
      call move_alloc(more, this%groups)
    end if
    this%number = this%number + 1
    this%groups(this%number)%name = name
    this%groups(this%number)%line = line
  end subroutine add_group

  !> How many groups have this name.
  pure integer function count_groups(this, name) result(number)
    class(namelist_t), intent(in) :: this
    character(len=*), intent(in) :: name
    integer :: i

    number = 0
    do i = 1, this%number
      if (this%groups(i)%name == name) number = number + 1
    end do
  end function count_groups

  !> Index of the group that is the `occurrence`-th of its name, 0 if there is none.
  pure integer function locate(this, name, occurrence) result(group)
    class(namelist_t), intent(in) :: this
    character(len=*), intent(in) :: name
    integer, intent(in) :: occurrence
    integer :: i, seen

    group = 0
    seen = 0
    do i = 1, this%number
      if (this%groups(i)%name /= name) cycle
      seen = seen + 1
      if (seen == occurrence) then
        group = i
        return
      end if
    end do
  end function locate

  !> Line of a key; without the key that of its group; without the group the last of the file.
  pure integer function line_of(this, name, occurrence, key) result(line)
    class(namelist_t), intent(in) :: this
    character(len=*), intent(in) :: name
    integer, intent(in) :: occurrence
    character(len=*), intent(in) :: key
    integer :: group, entry

    line = this%lines
    group = this%locate(name, occurrence)
    if (group == 0) return
    line = this%groups(group)%line
    entry = this%groups(group)%find(key)
    if (entry > 0) line = this%groups(group)%entries(entry)%line
  end function line_of
end module sg_namelist
