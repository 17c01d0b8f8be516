!> Small helpers for text: numbers to strings and back is all that Fortran leaves to do.
module sg_text
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: to_text, lower_case, edit_distance, text_of_duration, joined, ends_with

  !> Shortest text of a value: integers without blanks, reals so that reading gives back the same
  !> bits, logicals as true and false.
  interface to_text
    module procedure integer_to_text
    module procedure long_to_text
    module procedure real_to_text
    module procedure real_to_text_digits
    module procedure logical_to_text
  end interface to_text

contains

  !> The words without their trailing blanks, with `between` between them; empty without words.
  pure function joined(words, between) result(text)
    character(len=*), intent(in) :: words(:), between
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    do k = 1, size(words)
      if (k > 1) text = text//between
      text = text//trim(words(k))
    end do
  end function joined

  pure logical function ends_with(text, ending)
    character(len=*), intent(in) :: text, ending

    ends_with = len(text) >= len(ending)
    if (ends_with) ends_with = text(len(text) - len(ending) + 1:) == ending
  end function ends_with

  pure function integer_to_text(value) result(text)
    integer, intent(in) :: value
    character(len=:), allocatable :: text
    text = long_to_text(int(value, i8))
  end function integer_to_text

  pure function long_to_text(value) result(text)
    integer(i8), intent(in) :: value
    character(len=:), allocatable :: text
    character(len=24) :: buffer
    write (buffer, '(i0)') value
    text = trim(buffer)
  end function long_to_text

  pure function logical_to_text(value) result(text)
    logical, intent(in) :: value
    character(len=:), allocatable :: text
    if (value) then
      text = 'true'
    else
      text = 'false'
    end if
  end function logical_to_text

  !> The fewest significant digits (at most 17) that read back to the same number.
  pure function real_to_text(value) result(text)
    real(wp), intent(in) :: value
    character(len=:), allocatable :: text
    integer :: digits, fewest, status
    real(wp) :: back

    fewest = 1
    ! Rounded to fewer digits, the largest numbers would overflow when they are read.
    if (abs(value) > 1.7e308_wp) fewest = 17
    do digits = fewest, 17
      text = real_to_text_digits(value, digits)
      read (text, *, iostat=status) back
      if (status == 0 .and. back == value) return
    end do
  end function real_to_text

  !> `digits` significant digits, without trailing zeros; plain notation from 1e-4 to 1e7, else with
  !> exponent.
  pure function real_to_text_digits(value, digits) result(text)
    real(wp), intent(in) :: value
    integer, intent(in) :: digits
    character(len=:), allocatable :: text
    character(len=40) :: buffer
    character(len=16) :: form
    integer :: exponent_10, mark, decimals

    if (value == 0.0_wp) then
      text = '0'
      return
    end if
    write (form, '(a, i0, a)') '(es40.', max(digits - 1, 0), 'e3)'
    write (buffer, form) value
    text = trim(adjustl(buffer))
    mark = index(text, 'E')
    if (mark == 0) return ! NaN or Infinity
    read (text(mark + 1:), *) exponent_10
    if (exponent_10 >= -4 .and. exponent_10 < 7) then
      decimals = max(digits - 1 - exponent_10, 0)
      write (form, '(a, i0, a)') '(f40.', decimals, ')'
      write (buffer, form) value
      text = without_trailing_zeros(trim(adjustl(buffer)))
      if (text(1:1) == '.') text = '0'//text
      if (len(text) > 1) then
        if (text(1:2) == '-.') text = '-0'//text(2:)
      end if
    else
      text = without_trailing_zeros(text(:mark - 1))//'e'//integer_to_text(exponent_10)
    end if
  end function real_to_text_digits

  pure function without_trailing_zeros(text) result(short)
    character(len=*), intent(in) :: text
    character(len=:), allocatable :: short
    integer :: last

    last = len(text)
    if (index(text, '.') > 0) then
      last = verify(text, '0', back=.true.)
      if (text(last:last) == '.') last = last - 1
    end if
    short = text(:last)
  end function without_trailing_zeros

  pure function lower_case(text) result(lower)
    character(len=*), intent(in) :: text
    character(len=len(text)) :: lower
    integer :: i, code

    do i = 1, len(text)
      code = iachar(text(i:i))
      if (code >= iachar('A') .and. code <= iachar('Z')) code = code + 32
      lower(i:i) = achar(code)
    end do
  end function lower_case

  !> Number of insertions, deletions, substitutions and swaps of neighbours that turn `a` into `b`
  !> (optimal string alignment distance), for "did you mean".
  pure function edit_distance(a, b) result(distance)
    character(len=*), intent(in) :: a, b
    integer :: distance
    integer :: table(0:len(a), 0:len(b))
    integer :: i, j, cost

    table(:, 0) = [(i, i=0, len(a))]
    table(0, :) = [(j, j=0, len(b))]
    do j = 1, len(b)
      do i = 1, len(a)
        cost = merge(0, 1, a(i:i) == b(j:j))
        table(i, j) = min(table(i - 1, j) + 1, table(i, j - 1) + 1, table(i - 1, j - 1) + cost)
        if (is_swap(i, j)) table(i, j) = min(table(i, j), table(max(i - 2, 0), max(j - 2, 0)) + 1)
      end do
    end do
    distance = table(len(a), len(b))

  contains

    pure function is_swap(i, j) result(swapped)
      integer, intent(in) :: i, j
      logical :: swapped
      swapped = .false.
      if (i > 1 .and. j > 1) swapped = a(i:i) == b(j - 1:j - 1) .and. a(i - 1:i - 1) == b(j:j)
    end function is_swap
  end function edit_distance

  !> A duration in seconds as people say it: `42 s`, `3 min 05 s`, `2 h 07 min`, `4 d 03 h`.
  pure function text_of_duration(seconds) result(text)
    real(wp), intent(in) :: seconds
    character(len=:), allocatable :: text
    character(len=32) :: buffer
    integer(i8) :: s

    if (.not. seconds < 1.0e15_wp) then
      text = 'unknown'
      return
    end if
    s = nint(seconds, i8)
    if (s < 60) then
      write (buffer, '(i0, a)') s, ' s'
    else if (s < 3600) then
      write (buffer, '(i0, a, i2.2, a)') s/60, ' min ', mod(s, 60_i8), ' s'
    else if (s < 86400) then
      write (buffer, '(i0, a, i2.2, a)') s/3600, ' h ', mod(s, 3600_i8)/60, ' min'
    else
      write (buffer, '(i0, a, i2.2, a)') s/86400, ' d ', mod(s, 86400_i8)/3600, ' h'
    end if
    text = trim(buffer)
  end function text_of_duration
end module sg_text
