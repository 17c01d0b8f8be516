!> What the checks of a configuration work on: the configuration, the file it came from, and the
!> list of faults.
module sg_check_desk
  use sg_config, only: config_t
  use sg_fault_list, only: did_you_mean, fault_list_t, quoted
  use sg_namelist, only: namelist_t
  use sg_schema, only: count_words, key_row, KEYS, word_at
  use sg_text, only: joined
  implicit none
  private

  public :: desk_t, check_material_name

  type :: desk_t
    type(config_t) :: config
    type(namelist_t) :: nml
    type(fault_list_t) :: faults
  contains
    procedure :: good
    procedure :: fault
  end type desk_t

contains

  !> Whether all the keys (words between blanks) have values: checked ones or defaults.
  logical function good(this, group, occurrence, names)
    class(desk_t), intent(in) :: this
    character(len=*), intent(in) :: group
    integer, intent(in) :: occurrence
    character(len=*), intent(in) :: names
    integer :: g, e, i

    good = .true.
    g = this%nml%locate(group, occurrence)
    do i = 1, count_words(names)
      e = 0
      if (g > 0) e = this%nml%groups(g)%find(word_at(names, i))
      if (e > 0) then
        good = good .and. this%nml%groups(g)%entries(e)%usable
      else
        good = good .and. len_trim(KEYS(key_row(group, word_at(names, i)))%default) > 0
      end if
    end do
  end function good

  !> Reports a fault at a key (which may be absent).
  subroutine fault(this, group, occurrence, key, what)
    class(desk_t), intent(inout) :: this
    character(len=*), intent(in) :: group
    integer, intent(in) :: occurrence
    character(len=*), intent(in) :: key, what

    call this%faults%add(this%nml%line_of(group, occurrence, key), '&'//group//' '//key, what)
  end subroutine fault

  subroutine check_material_name(desk, group, i, name, material_index)
    type(desk_t), intent(inout) :: desk
    character(len=*), intent(in) :: group
    integer, intent(in) :: i
    character(len=*), intent(in) :: name
    integer, intent(in) :: material_index
    character(len=:), allocatable :: hint
    integer :: j

    if (material_index > 0 .or. size(desk%config%materials) == 0) return
    ! The name of a material that is itself faulty cannot be compared.
    do j = 1, size(desk%config%materials)
      if (.not. desk%good('material', j, 'name')) return
    end do
    hint = 'allowed: '//joined(desk%config%materials%name, ', ')
    if (len(did_you_mean(name, desk%config%materials%name, '')) > 0) then
      hint = hint//'; '//did_you_mean(name, desk%config%materials%name, '')
    end if
    call desk%fault(group, i, 'material', 'there is no material '//quoted(name)//' ('//hint//')')
  end subroutine check_material_name
end module sg_check_desk
