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

  type :: case_watch_t
    type(stop_rule_t) :: rule
    !> Of each case: ids from 1 on without a gap, and what the last look at them has found.
    integer, allocatable :: prefix(:)
    type(judgement_t), allocatable :: judgements(:)
  contains
    procedure :: init
    procedure :: look
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

  !> After a member was put into the results of a case: where the rule is met, they end there. Cases
  !> that are homogeneous or have ended are left alone.
  subroutine look(this, case_index, results)
    class(case_watch_t), intent(inout) :: this
    integer, intent(in) :: case_index
    type(case_results_t), intent(inout) :: results

    if (this%rule%rule == RULE_COUNT .or. results%is_homogeneous) return
    associate (n => this%prefix(case_index), judgement => this%judgements(case_index))
      if (judgement%is_met) return
      do while (n < size(results%present))
        if (.not. results%present(n + 1)) exit
        n = n + 1
      end do
      call this%rule%follow(results%values(this%rule%column, :n), results%status(:n) == &
        STATUS_OK, judgement)
      if (judgement%is_met) call results%shorten(judgement%members)
    end associate
  end subroutine look

  !> Members that all cases will have in the end, by what is known now.
  function forecast(this, results) result(number)
    class(case_watch_t), intent(in) :: this
    type(case_results_t), intent(in) :: results(:)
    integer(i8) :: number
    integer :: i, expected

    number = 0
    do i = 1, size(results)
      expected = size(results(i)%present)
      if (this%rule%rule /= RULE_COUNT .and. .not. results(i)%is_homogeneous) then
        expected = min(expected, max(this%judgements(i)%forecast, count(results(i)%present)))
      end if
      number = number + expected
    end do
  end function forecast

  !> The state of a case for people, empty where no rule looks at it.
  function in_words(this, case_index, results) result(text)
    class(case_watch_t), intent(in) :: this
    integer, intent(in) :: case_index
    type(case_results_t), intent(in) :: results
    character(len=:), allocatable :: text

    text = ''
    if (this%rule%rule == RULE_COUNT .or. results%is_homogeneous) return
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
