!> Keeps an eye on the cases of a run by the rule that ends them early, as members come in.
module sg_case_watch
  use sg_ensemble, only: case_results_t
  use sg_kinds, only: i8
  use sg_outcome, only: STATUS_OK
  use sg_stop_rule, only: judgement_t, RULE_COUNT, RULE_PRECISION, stop_rule_t
  use sg_text, only: to_text
  implicit none
  private

  public :: case_watch_t

  !> Members of which something is forecast.
  integer, parameter :: FEWEST = 10

  type :: case_watch_t
    type(stop_rule_t) :: rule
    !> Of each case: ids from 1 on without a gap, and what the last look at them has found.
    integer, allocatable :: prefix(:)
    type(judgement_t), allocatable :: judgements(:)
  contains
    procedure :: init
    procedure :: look
    procedure :: is_over
    procedure :: forecast
    procedure :: in_words
    procedure :: as_json
  end type case_watch_t

contains

  subroutine init(this, rule, cases)
    class(case_watch_t), intent(inout) :: this
    type(stop_rule_t), intent(in) :: rule
    !> Number of cases.
    integer, intent(in) :: cases

    this%rule = rule
    allocate (this%prefix(cases), this%judgements(cases))
    this%prefix = 0
    this%judgements%forecast = rule%most
  end subroutine init

  !> After a member was put into the results of a case: where the rule is met, they end there.
  !> Homogeneous cases and control variates run all their members.
  subroutine look(this, case_index, results)
    class(case_watch_t), intent(inout) :: this
    integer, intent(in) :: case_index
    type(case_results_t), intent(inout) :: results

    if (this%rule%rule == RULE_COUNT) return
    associate (n => this%prefix(case_index), judgement => this%judgements(case_index))
      do while (n < size(results%present))
        if (.not. results%present(n + 1)) exit
        n = n + 1
      end do
      if (results%role /= 'study' .or. judgement%is_met) return
      call this%rule%follow(results%values(this%rule%column, :n), results%status(:n) == &
        STATUS_OK, judgement)
      if (judgement%is_met) call results%shorten(judgement%members)
    end associate
  end subroutine look

  !> No member of any case is missing; always false without a rule, where no member in flight can be
  !> one too many.
  pure logical function is_over(this, results)
    class(case_watch_t), intent(in) :: this
    type(case_results_t), intent(in) :: results(:)
    integer :: i

    is_over = this%rule%rule /= RULE_COUNT
    do i = 1, size(results)
      if (is_over) is_over = this%prefix(i) >= size(results(i)%present)
    end do
  end function is_over

  !> Members that all cases will have in the end, by what is known now: before the first look, by
  !> the ids without a gap if there are ten. Of a run of some members only, which no rule ends
  !> early, the plan knows.
  function forecast(this, results) result(number)
    class(case_watch_t), intent(in) :: this
    type(case_results_t), intent(in) :: results(:)
    integer(i8) :: number
    type(judgement_t) :: judgement
    integer :: i, expected

    number = 0
    do i = 1, size(results)
      associate (one => results(i))
        expected = size(one%present)
        if (this%rule%rule /= RULE_COUNT .and. one%role == 'study') then
          judgement = this%judgements(i)
          if (judgement%members == 0 .and. this%prefix(i) >= FEWEST) then
            judgement = this%rule%judge(one%values(this%rule%column, :this%prefix(i)), &
              one%status(:this%prefix(i)) == STATUS_OK)
            judgement%forecast = max(judgement%forecast, this%rule%minimum)
          end if
          expected = min(expected, max(judgement%forecast, count(one%present)))
        end if
        number = number + expected
      end associate
    end do
  end function forecast

  !> The state of a case for people, empty where no rule looks at it.
  function in_words(this, case_index, results) result(text)
    class(case_watch_t), intent(in) :: this
    integer, intent(in) :: case_index
    type(case_results_t), intent(in) :: results
    character(len=:), allocatable :: text

    text = ''
    if (this%rule%rule == RULE_COUNT .or. results%role /= 'study') return
    associate (judgement => this%judgements(case_index))
      text = 'successive'
      if (this%rule%rule == RULE_PRECISION) text = 'precision'
      if (judgement%members == 0) then
        text = text//' not looked at before member '//to_text(this%rule%minimum)
        return
      end if
      if (.not. judgement%is_met) text = text//' not'
      text = text//' met at '//to_text(judgement%members)//' of '//to_text(this%rule%most)//': '
      if (this%rule%rule == RULE_PRECISION) then
        text = text//this%rule%statistic_in_words()//' '//to_text(judgement%estimate, 4)// &
          ' in '//to_text(judgement%interval(1), 4)//' to '//to_text(judgement%interval(2), 4)// &
          ' (95 %), half of it '//to_text(judgement%half_width, 3)
      else
        text = text//this%rule%statistic_in_words()//' changed by '// &
          to_text(judgement%half_width, 3)
      end if
      text = text//', asked '//to_text(judgement%target, 3)
      if (.not. judgement%is_met .and. .not. all(results%present)) text = text//'; about '// &
        to_text(max(1, judgement%forecast - count(results%present)))//' members more'
    end associate
  end function in_words

  !> The same for programs: members of a JSON object, without what is not known.
  function as_json(this, case_index) result(text)
    class(case_watch_t), intent(in) :: this
    integer, intent(in) :: case_index
    character(len=:), allocatable :: text

    associate (judgement => this%judgements(case_index))
      text = '"met":'//to_text(judgement%is_met)//',"members":'//to_text(judgement%members)// &
        ',"forecast":'//to_text(judgement%forecast)
      if (judgement%half_width < huge(judgement%half_width)) text = text//',"estimate":'// &
        to_text(judgement%estimate)//',"half_width":'//to_text(judgement%half_width)// &
        ',"target":'//to_text(judgement%target)
    end associate
  end function as_json
end module sg_case_watch
