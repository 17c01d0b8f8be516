!> Numbers and intervals written as text, read strictly: what Fortran's READ lets through in silence
!> (NaN, 1d400, 3*1, trailing text) is refused here.
module sg_number_text
  use sg_kinds, only: i8, wp
  use sg_text, only: lower_case
  implicit none
  private

  public :: parse_real, parse_integer, range_holds, range_in_words

  character(len=*), parameter :: DIGITS = '0123456789'

contains

  !> Value of a real number in the notation of Fortran or C: 1, -.5, 2.6e6, 1d-3. `fault` says what
  !> is wrong with it, or is empty; `value` is 0 then.
  pure subroutine parse_real(text, value, fault)
    character(len=*), intent(in) :: text
    real(wp), intent(out) :: value
    character(len=:), allocatable, intent(out) :: fault
    character(len=:), allocatable :: low, mantissa
    integer(i8) :: power
    integer :: mark, status

    value = 0.0_wp
    fault = ''
    low = lower_case(trim(text))
    if (is_not_finite(low)) then
      fault = 'is not a finite number'
      return
    end if
    mark = scan(low, 'edq')
    power = 0
    if (mark > 0) then
      call parse_integer(low(mark + 1:), power, fault)
      mantissa = low(:mark - 1)
      low(mark:mark) = 'e'
    else
      mantissa = low
    end if
    if (.not. is_decimal(mantissa) .or. fault == 'is not a whole number') then
      fault = 'is not a number'
      return
    end if
    if (verify(mantissa, '+-.0') == 0) then
      fault = ''
      return
    end if
    ! Checked by hand, because reading an overflow raises a floating point exception.
    power = max(-100000_i8, min(power, 100000_i8)) + leading_power(mantissa)
    if (len(fault) > 0) power = merge(-400_i8, 400_i8, low(mark + 1:mark + 1) == '-')
    if (power > 307) then
      fault = 'is too large for a real number'
    else if (power < -307) then
      fault = 'is too small for a real number'
    else
      read (low, *, iostat=status) value
      if (status /= 0) fault = 'is not a number'
    end if
  end subroutine parse_real

  pure logical function is_not_finite(low)
    character(len=*), intent(in) :: low
    character(len=:), allocatable :: bare

    bare = low
    if (len(bare) > 0) then
      if (scan(bare(1:1), '+-') == 1) bare = bare(2:)
    end if
    is_not_finite = bare == 'nan' .or. bare == 'inf' .or. bare == 'infinity' .or. &
      index(bare, 'nan(') == 1
  end function is_not_finite

  !> [sign] digits with at most one point, and at least one digit.
  pure logical function is_decimal(text)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: bare
    integer :: point

    bare = text
    if (len(bare) > 0) then
      if (scan(bare(1:1), '+-') == 1) bare = bare(2:)
    end if
    point = index(bare, '.')
    if (point > 0) bare = bare(:point - 1)//bare(point + 1:)
    is_decimal = len(bare) > 0 .and. verify(bare, DIGITS) == 0
  end function is_decimal

  !> Power of ten of the first digit that is not 0.
  pure integer function leading_power(mantissa) result(power)
    character(len=*), intent(in) :: mantissa
    integer :: point, first

    point = index(mantissa, '.')
    if (point == 0) point = len(mantissa) + 1
    first = scan(mantissa, '123456789')
    power = point - first
    if (first < point) power = power - 1
  end function leading_power

  !> Value of a whole number; `fault` as for reals.
  pure subroutine parse_integer(text, value, fault)
    character(len=*), intent(in) :: text
    integer(i8), intent(out) :: value
    character(len=:), allocatable, intent(out) :: fault
    character(len=:), allocatable :: bare
    integer :: first, i
    integer(i8) :: digit

    value = 0_i8
    fault = ''
    bare = trim(text)
    first = 1
    if (len(bare) > 0) then
      if (scan(bare(1:1), '+-') == 1) first = 2
    end if
    if (len(bare) < first) then
      fault = 'is not a whole number'
    else if (verify(bare(first:), DIGITS) /= 0) then
      fault = 'is not a whole number'
    else
      do i = first, len(bare)
        digit = iachar(bare(i:i)) - iachar('0')
        if (value > (huge(value) - digit)/10_i8) then
          fault = 'is too large for a whole number'
          value = 0_i8
          return
        end if
        value = 10_i8*value + digit
      end do
      if (bare(1:1) == '-') value = -value
    end if
  end subroutine parse_integer

  !> Bounds of an interval of the schema as text; empty where there is none.
  pure subroutine range_bounds(range, lower, upper)
    character(len=*), intent(in) :: range
    character(len=:), allocatable, intent(out) :: lower, upper
    integer :: comma

    comma = index(range, ',')
    lower = range(2:comma - 1)
    upper = range(comma + 1:len_trim(range) - 1)
  end subroutine range_bounds

  !> Whether the interval (for instance '(0,1.5]') holds the value.
  pure logical function range_holds(range, value) result(holds)
    character(len=*), intent(in) :: range
    real(wp), intent(in) :: value
    character(len=:), allocatable :: lower, upper, fault
    real(wp) :: bound

    call range_bounds(range, lower, upper)
    holds = .true.
    if (len(lower) > 0) then
      call parse_real(lower, bound, fault)
      holds = value > bound .or. (range(1:1) == '[' .and. value == bound)
    end if
    if (len(upper) > 0) then
      call parse_real(upper, bound, fault)
      holds = holds .and. (value < bound .or. (index(range, ']') > 0 .and. value == bound))
    end if
  end function range_holds

  !> The interval as a user would say it; empty for no bounds.
  pure function range_in_words(range) result(words)
    character(len=*), intent(in) :: range
    character(len=:), allocatable :: words
    character(len=:), allocatable :: lower, upper
    logical :: takes_lower, takes_upper

    call range_bounds(range, lower, upper)
    takes_lower = range(1:1) == '['
    takes_upper = index(range, ']') > 0
    words = ''
    if (len(lower) > 0 .and. len(upper) > 0) then
      if (takes_lower .and. takes_upper) then
        words = lower//' to '//upper
      else if (takes_lower) then
        words = lower//' or more, less than '//upper
      else if (takes_upper) then
        words = 'more than '//lower//', up to '//upper
      else
        words = 'more than '//lower//', less than '//upper
      end if
    else if (len(lower) > 0) then
      words = 'more than '//lower
      if (takes_lower) words = lower//' or more'
    else if (len(upper) > 0) then
      words = 'less than '//upper
      if (takes_upper) words = 'at most '//upper
    end if
  end function range_in_words
end module sg_number_text
