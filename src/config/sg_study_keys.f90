!> Keys of other groups in &study: any key of one number or one word. `damping` where one group
!> has a key of that name, else `grid%x_max`; where a group is given several times, the first random
!> field is meant, of others the number must be said: `body(2)%height`.
module sg_study_keys
  use sg_namelist, only: namelist_t
  use sg_schema, only: group_row, GROUPS, key_t, KEYS, KIND_INTEGER, KIND_REAL, KIND_WORD
  use sg_text, only: to_text
  implicit none
  private

  public :: find_study_key, can_be_listed

  !> Groups whose keys do not change what a member is, or say what the study is itself.
  character(len=*), parameter :: OTHER_GROUPS(5) = [character(len=16) :: 'case', 'monte_carlo', &
    'study', 'control_variate', 'output']

contains

  !> The key that `name` (in lower case) means. `row` in KEYS is 0 where there is none; `fault` then
  !> says why, or is empty where the name is not known.
  subroutine find_study_key(nml, name, row, occurrence, fault)
    type(namelist_t), intent(in) :: nml
    character(len=*), intent(in) :: name
    integer, intent(out) :: row, occurrence
    character(len=:), allocatable, intent(out) :: fault
    character(len=:), allocatable :: group, key
    integer, allocatable :: rows(:)
    integer :: k

    row = 0
    call take_apart(name, group, occurrence, key)
    fault = ''
    rows = pack([(k, k=1, size(KEYS))], KEYS%name == key .and. can_be_listed(KEYS) .and. &
      (KEYS%group == group .or. group == ''))
    if (size(rows) == 0) return
    if (size(rows) > 1) then
      fault = 'several groups have this key (write '//trim(KEYS(rows(1))%group)//'%'//key
      do k = 2, size(rows)
        fault = fault//' or '//trim(KEYS(rows(k))%group)//'%'//key
      end do
      fault = fault//')'
      return
    end if
    associate (owner => KEYS(rows(1))%group)
      if (owner == 'random_field' .and. occurrence < 2 .and. (key == 'acf' .or. key == 'cov')) then
        fault = 'of the first field this is &study '//key//' (write '//key//')'
      end if
      if (GROUPS(group_row(owner))%repeatable) then
        k = nml%count(trim(owner))
        if (k == 0) then
          fault = 'there is no &'//trim(owner)//' group'
        else if (occurrence > k) then
          fault = 'the last &'//trim(owner)//' group is number '//to_text(k)
        else if (occurrence == 0 .and. k > 1 .and. owner /= 'random_field') then
          fault = 'there are '//to_text(k)//' &'//trim(owner)//' groups (write '//trim(owner)// &
            '(1)%'//key//' for the first one)'
        end if
      else if (occurrence > 1) then
        fault = '&'//trim(owner)//' is given only once'
      end if
    end associate
    occurrence = max(1, occurrence)
    if (len(fault) == 0) row = rows(1)
  end subroutine find_study_key

  !> `group(occurrence)%key`; what is not there is empty or 0.
  pure subroutine take_apart(name, group, occurrence, key)
    character(len=*), intent(in) :: name
    character(len=:), allocatable, intent(out) :: group, key
    integer, intent(out) :: occurrence
    integer :: mark, bracket, status

    mark = index(name, '%')
    group = name(:max(0, mark - 1))
    key = trim(name(mark + 1:))
    if (mark == 1) key = ''
    occurrence = 0
    bracket = index(group, '(')
    if (bracket == 0) return
    read (group(bracket + 1:max(bracket, len(group) - 1)), *, iostat=status) occurrence
    if (status /= 0 .or. occurrence < 1) key = ''
    group = group(:bracket - 1)
  end subroutine take_apart

  !> Whether &study may list a key.
  elemental logical function can_be_listed(key)
    type(key_t), intent(in) :: key

    can_be_listed = key%size == 1 .and. .not. any(OTHER_GROUPS == key%group) .and. &
      (key%kind == KIND_REAL .or. key%kind == KIND_INTEGER .or. key%kind == KIND_WORD)
  end function can_be_listed
end module sg_study_keys
