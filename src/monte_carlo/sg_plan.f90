!> What is to be computed: study cases times realizations, in one pool.
module sg_plan
  use sg_config, only: NAME_LENGTH
  use sg_kinds, only: i8, wp
  use sg_schema, only: KEYS
  use sg_study, only: suffix_of_choice, text_of_choice, variant_t
  use sg_text, only: to_text
  implicit none
  private

  public :: plan_t, study_case_t, create_plan, case_label

  !> One study case: the members of one ensemble.
  type :: study_case_t
    !> `deterministic`, `base`, or like `snx_cov0.05`; with what the variant adds, and `_control`.
    character(len=2*NAME_LENGTH) :: label = ''
    !> Empty for the homogeneous case.
    character(len=NAME_LENGTH) :: acf = ''
    !> Coefficient of variation and mean (in the unit of the property) of the random field.
    real(wp) :: cov = 0.0_wp, mean = 0.0_wp
    !> Of the random field, too: its law, and scales of fluctuation in m.
    character(len=NAME_LENGTH) :: distribution = ''
    real(wp) :: scale_x = 0.0_wp, scale_y = 0.0_wp
    logical :: is_homogeneous = .false.
    !> Position of its variant; what that has beside acf and cov, as text.
    integer :: variant = 1
    character(len=3*NAME_LENGTH) :: varied = ''
    !> Positions of the homogeneous case that is its noise floor, and of the case that it is the
    !> twin of on coarser cells; 0 for none.
    integer :: noise_case = 0, control_of = 0
    !> Members are 1 to `member_count`. In study cases equal ids share the same Xi; in the
    !> homogeneous case member 1 is nominal and the others are jittered.
    integer(i8) :: member_count = 0
  contains
    procedure :: role
  end type study_case_t

  type :: plan_t
    type(study_case_t), allocatable :: cases(:)
    !> Members with other ids are left to other runs (job arrays).
    integer(i8) :: first = 1, last = huge(1_i8)
  contains
    procedure :: total
    procedure :: members_in_order
    procedure :: holds
    procedure :: members_of
    procedure :: range_of
    procedure :: is_part
    procedure :: find_case
  end type plan_t

contains

  !> The plan of the variants of a case (one without a study of other keys): the homogeneous cases
  !> first, then for each variant every combination of acf and cov of &study, ACFs outermost; twins
  !> on coarser cells behind the cases that they belong to.
  subroutine create_plan(variants, plan)
    type(variant_t), intent(in) :: variants(:)
    type(plan_t), intent(out) :: plan
    type(study_case_t) :: cases(size(variants)*(1 + most_cases(variants)))
    integer :: noise_of(size(variants)), first_of(size(variants))
    integer :: i, j, n, v, w

    n = 0
    noise_of = 0
    do v = 1, size(variants)
      if (variants(v)%twin_of > 0) cycle
      do w = v - 1, 1, -1
        if (.not. any(differs(variants(v), variants(w)))) noise_of(v) = noise_of(w)
      end do
      if (noise_of(v) > 0) cycle
      n = n + 1
      cases(n) = homogeneous_case(variants, v)
      noise_of(v) = n
    end do
    do v = 1, size(variants)
      if (.not. variants(v)%config%has_random_field) cycle
      first_of(v) = n + 1
      associate (study => variants(v)%config%study)
        do i = 1, size(study%acf)
          do j = 1, size(study%cov)
            n = n + 1
            cases(n) = study_case(variants(v), v, trim(study%acf(i)), study%cov(j))
            if (variants(v)%twin_of == 0) then
              cases(n)%noise_case = noise_of(v)
            else
              cases(n)%control_of = first_of(variants(v)%twin_of) + n - first_of(v)
            end if
          end do
        end do
      end associate
    end do
    plan%cases = cases(:n)
  end subroutine create_plan

  !> Study cases of one variant.
  pure integer function most_cases(variants)
    type(variant_t), intent(in) :: variants(:)

    most_cases = 0
    if (variants(1)%config%has_random_field) most_cases = size(variants(1)%config%study%acf) &
      *size(variants(1)%config%study%cov)
  end function most_cases

  !> By which keys that &study lists the homogeneous ground of two variants differs. It does not
  !> know of those of random fields that leave their means alone.
  pure function differs(one, other) result(by)
    type(variant_t), intent(in) :: one, other
    logical :: by(size(one%choice))
    integer :: k

    by = one%choice /= other%choice
    do k = 1, size(by)
      associate (key => KEYS(one%config%study%lists(k)%row))
        if (key%group == 'cross_correlation' .or. (key%group == 'random_field' .and. &
          index(key%name, 'mean') == 0 .and. key%name /= 'datum' .and. key%name /= 'property')) then
          by(k) = .false.
        end if
      end associate
    end do
  end function differs

  pure function study_case(variant, v, acf, cov) result(one)
    type(variant_t), intent(in) :: variant
    integer, intent(in) :: v
    character(len=*), intent(in) :: acf
    real(wp), intent(in) :: cov
    type(study_case_t) :: one

    one%variant = v
    one%varied = variant%varied
    one%acf = acf
    one%cov = cov
    associate (config => variant%config)
      one%mean = config%random_fields(1)%mean
      one%distribution = config%random_fields(1)%distribution
      one%scale_x = config%random_fields(1)%scale_x
      one%scale_y = config%random_fields(1)%scale_y
      one%member_count = config%monte_carlo%realizations
      one%label = 'base'
      if (config%has_study) one%label = case_label(acf, cov)
      one%label = trim(one%label)//variant%suffix
      if (variant%twin_of == 0) return
      one%label = trim(one%label)//'_control'
      one%member_count = config%control_variate%realizations
    end associate
  end function study_case

  !> The members with the mean value everywhere. What its label says of the variant is what the
  !> homogeneous ground depends on.
  function homogeneous_case(variants, v) result(one)
    type(variant_t), intent(in) :: variants(:)
    integer, intent(in) :: v
    type(study_case_t) :: one
    logical :: by(size(variants(v)%choice))
    integer :: w

    by = .false.
    do w = 1, size(variants)
      by = by .or. differs(variants(v), variants(w))
    end do
    one%variant = v
    associate (lists => variants(v)%config%study%lists, choice => variants(v)%choice)
      one%varied = text_of_choice(lists, choice, by)
      one%label = 'deterministic'//suffix_of_choice(lists, choice, by)
    end associate
    one%is_homogeneous = .true.
    associate (config => variants(v)%config)
      one%member_count = max(1, config%monte_carlo%noise_members)
      if (config%has_random_field) then
        one%mean = config%random_fields(1)%mean
      else if (size(config%materials) > 0) then
        one%mean = config%materials(1)%friction_angle
      end if
    end associate
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

  !> `study`, `homogeneous` or `control`.
  pure function role(this) result(word)
    class(study_case_t), intent(in) :: this
    character(len=:), allocatable :: word

    word = 'study'
    if (this%is_homogeneous) word = 'homogeneous'
    if (this%control_of > 0) word = 'control'
  end function role

  !> Number of members of all cases that this run is to compute.
  pure function total(this) result(number)
    class(plan_t), intent(in) :: this
    integer(i8) :: number
    integer :: k

    number = 0
    do k = 1, size(this%cases)
      number = number + this%members_of(k)
    end do
  end function total

  !> Members of one case that this run is to compute: how many, and first and last id.
  pure integer(i8) function members_of(this, case_index) result(number)
    class(plan_t), intent(in) :: this
    integer, intent(in) :: case_index

    number = max(0_i8, min(this%last, this%cases(case_index)%member_count) - this%first + 1)
  end function members_of

  pure function range_of(this, case_index) result(range)
    class(plan_t), intent(in) :: this
    integer, intent(in) :: case_index
    integer(i8) :: range(2)

    range(1) = min(this%first, this%cases(case_index)%member_count + 1)
    range(2) = range(1) + this%members_of(case_index) - 1
  end function range_of

  !> This run computes only some of the members.
  pure logical function is_part(this)
    class(plan_t), intent(in) :: this

    is_part = this%first > 1 .or. this%last < maxval(this%cases%member_count)
  end function is_part

  !> Case and id of all members that this run is to compute, [2, total], in the order of execution:
  !> the homogeneous cases, then id by id over the others, so that all progress together.
  pure subroutine members_in_order(this, members)
    class(plan_t), intent(in) :: this
    integer(i8), allocatable, intent(out) :: members(:, :)
    integer(i8) :: id, number
    integer :: k

    allocate (members(2, this%total()))
    number = 0
    do k = 1, size(this%cases)
      if (.not. this%cases(k)%is_homogeneous) cycle
      do id = this%first, min(this%last, this%cases(k)%member_count)
        number = number + 1
        members(:, number) = [int(k, i8), id]
      end do
    end do
    do id = this%first, min(this%last, maxval(this%cases%member_count))
      do k = 1, size(this%cases)
        if (this%cases(k)%is_homogeneous .or. id > this%cases(k)%member_count) cycle
        number = number + 1
        members(:, number) = [int(k, i8), id]
      end do
    end do
  end subroutine members_in_order

  !> Whether the member is part of the ensemble, computed by this run or by another.
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
