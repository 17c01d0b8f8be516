!> What the keys of the rule that ends a case early must satisfy together.
module sg_check_stop_rule
  use sg_check_desk, only: desk_t
  use sg_fault_list, only: quoted
  use sg_kinds, only: wp
  use sg_text, only: to_text
  implicit none
  private

  public :: check_stop_rule

  character(len=*), parameter :: GROUP = 'monte_carlo'

contains

  subroutine check_stop_rule(desk)
    type(desk_t), intent(inout) :: desk

    if (.not. desk%good(GROUP, 1, 'stop_rule sampling')) return
    associate (given => desk%config%monte_carlo)
      if (given%stop_rule == 'count') return
      if (given%sampling == 'latin_hypercube') then
        call desk%fault(GROUP, 1, 'stop_rule', quoted(given%stop_rule)//' would end a Latin '// &
          'hypercube, which is stratified over all realizations, in the middle (allowed: '// &
          'stop_rule = ''count'', or another sampling)')
      else if (given%sampling == 'importance') then
        call desk%fault(GROUP, 1, 'stop_rule', quoted(given%stop_rule)//' looks at members '// &
          'that all count the same, not at weighted ones (allowed: stop_rule = ''count'', or '// &
          'another sampling)')
      else if (given%sampling == 'antithetic') then
        call check_even(desk, 'stop_minimum', given%stop_minimum)
        call check_even(desk, 'stop_batch', given%stop_batch)
      end if
      if (given%stop_rule == 'precision') call check_half_width(desk)
      if (.not. desk%good(GROUP, 1, 'realizations stop_minimum')) return
      if (given%stop_minimum > given%realizations) call desk%fault(GROUP, 1, 'stop_minimum', &
        to_text(given%stop_minimum)//' is beyond the last realization: the rule would never be '// &
        'looked at (allowed: up to realizations = '//to_text(given%realizations)//')')
    end associate
  end subroutine check_stop_rule

  !> The rule is looked at after whole pairs.
  subroutine check_even(desk, key, number)
    type(desk_t), intent(inout) :: desk
    character(len=*), intent(in) :: key
    integer, intent(in) :: number

    if (.not. desk%good(GROUP, 1, key) .or. mod(number, 2) == 0) return
    call desk%fault(GROUP, 1, key, to_text(number)//' is odd, and antithetic members come in '// &
      'pairs (allowed: even numbers)')
  end subroutine check_even

  !> One of the two keys is given, and a probability is below 1.
  subroutine check_half_width(desk)
    type(desk_t), intent(inout) :: desk
    integer :: g

    g = desk%nml%locate(GROUP, 1)
    associate (given => desk%config%monte_carlo, keys => desk%nml%groups(g))
      if (keys%find('half_width') > 0 .eqv. keys%find('relative_half_width') > 0) then
        call desk%fault(GROUP, 1, 'half_width', '''precision'' needs half_width or '// &
          'relative_half_width, one of the two')
      else if (size(given%half_width) == 1 .and. desk%good(GROUP, 1, 'stop_statistic')) then
        if (given%stop_statistic == 'exceedance' .and. given%half_width(1) >= 0.5_wp) call &
          desk%fault(GROUP, 1, 'half_width', to_text(given%half_width(1))//' is no precision '// &
          'of a probability (allowed: below 0.5)')
      end if
    end associate
  end subroutine check_half_width
end module sg_check_stop_rule
