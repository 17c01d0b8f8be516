!> What is to be computed: study cases times realizations, in one pool.
module sg_plan
  use sg_config, only: config_t, NAME_LENGTH
  use sg_kinds, only: i8, wp
  use sg_text, only: to_text
  implicit none
  private

  public :: plan_t, study_case_t, create_plan, case_label

  !> One study case: the members of one ensemble.
  type :: study_case_t
    !> `deterministic`, `base`, or like `snx_cov0.05`.
    character(len=NAME_LENGTH) :: label = ''
    !> Empty for the homogeneous case.
    character(len=NAME_LENGTH) :: acf = ''
    !> Coefficient of variation and mean (in the unit of the property) of the random field.
    real(wp) :: cov = 0.0_wp, mean = 0.0_wp
    logical :: is_homogeneous = .false.
    !> Members are 1 to `member_count`. In study cases equal ids share the same Xi; in the
    !> homogeneous case member 1 is nominal and the others are jittered.
    integer(i8) :: member_count = 0
  end type study_case_t

  type :: plan_t
    type(study_case_t), allocatable :: cases(:)
  contains
    procedure :: total
    procedure :: member
    procedure :: holds
    procedure :: find_case
  end type plan_t

contains

  !> The plan of a configuration: the homogeneous case first, then every combination of &study, ACFs
  !> outermost.
  subroutine create_plan(config, plan)
    type(config_t), intent(in) :: config
    type(plan_t), intent(out) :: plan
    integer :: i, j, next

    next = 1
    if (.not. config%has_random_field) then
      allocate (plan%cases(1))
      plan%cases(1) = homogeneous_case(config)
      return
    end if
    allocate (plan%cases(1 + size(config%study%acf)*size(config%study%cov)))
    plan%cases(1) = homogeneous_case(config)
    do i = 1, size(config%study%acf)
      do j = 1, size(config%study%cov)
        next = next + 1
        associate (c => plan%cases(next))
          c%acf = config%study%acf(i)
          c%cov = config%study%cov(j)
          c%mean = config%random_fields(1)%mean
          c%member_count = config%monte_carlo%realizations
          c%label = 'base'
          if (config%has_study) c%label = case_label(c%acf, c%cov)
        end associate
      end do
    end do
  end subroutine create_plan

  !> The members with the mean value everywhere.
  pure function homogeneous_case(config) result(one)
    type(config_t), intent(in) :: config
    type(study_case_t) :: one

    one%label = 'deterministic'
    one%is_homogeneous = .true.
    one%member_count = max(1, config%monte_carlo%noise_members)
    if (config%has_random_field) then
      one%mean = config%random_fields(1)%mean
    else if (size(config%materials) > 0) then
      one%mean = config%materials(1)%friction_angle
    end if
  end function homogeneous_case

  !> `snx_cov0.05`: at least two decimals, more where the value has them; `snx` without a COV.
  pure function case_label(acf, cov) result(label)
    character(len=*), intent(in) :: acf
    real(wp), intent(in) :: cov
    character(len=:), allocatable :: label
    character(len=:), allocatable :: number
    integer :: mark

    label = trim(acf)
    if (.not. cov > 0.0_wp) return
    number = to_text(cov)
    if (scan(number, 'eE') == 0) then
      mark = index(number, '.')
      if (mark == 0) then
        number = number//'.00'
      else if (len(number) - mark < 2) then
        number = number//'0'
      end if
    end if
    label = trim(acf)//'_cov'//number
  end function case_label

  !> Number of members of all cases.
  pure function total(this) result(number)
    class(plan_t), intent(in) :: this
    integer(i8) :: number

    number = sum(this%cases%member_count)
  end function total

  !> Member number `position` (from 1 to `total`) in the order of execution: the homogeneous case,
  !> then id by id over the study cases, so that all cases progress together.
  pure subroutine member(this, position, case_index, id)
    class(plan_t), intent(in) :: this
    integer(i8), intent(in) :: position
    integer, intent(out) :: case_index
    integer(i8), intent(out) :: id
    integer(i8) :: rest
    integer :: first, width

    rest = position
    case_index = 1
    id = rest
    do case_index = 1, size(this%cases)
      if (.not. this%cases(case_index)%is_homogeneous) exit
      id = rest
      if (rest <= this%cases(case_index)%member_count) return
      rest = rest - this%cases(case_index)%member_count
    end do
    ! All study cases have the same number of members.
    first = case_index
    width = size(this%cases) - first + 1
    id = (rest - 1)/width + 1
    case_index = first + int(mod(rest - 1, int(width, i8)))
  end subroutine member

  !> Whether the member is part of the plan.
  pure function holds(this, case_index, id) result(yes)
    class(plan_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8), intent(in) :: id
    logical :: yes

    yes = case_index >= 1 .and. case_index <= size(this%cases) .and. id >= 1
    if (yes) yes = id <= this%cases(case_index)%member_count
  end function holds

  !> Position of the case with this label, or 0.
  pure function find_case(this, label) result(case_index)
    class(plan_t), intent(in) :: this
    character(len=*), intent(in) :: label
    integer :: case_index

    do case_index = 1, size(this%cases)
      if (this%cases(case_index)%label == label) return
    end do
    case_index = 0
  end function find_case
end module sg_plan
