!> Heart of the small test runner that stands in for pFUnit: it counts tests and failures and
!> compares values. The names that tests use are those of pFUnit. The counters are module variables,
!> against the house rule, because asserts are free procedures, as in pFUnit.
module funit_core
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  use, intrinsic :: iso_c_binding, only: c_funloc, c_funptr, c_int
  use, intrinsic :: iso_fortran_env, only: int64, output_unit, real32, real64
  implicit none
  private

  public :: SourceLocation, anyExceptions
  public :: assertTrue, assertFalse, assertAll, assertAny, assertNone, assertNotAll, assertFail
  public :: assertIsNaN, assertIsFinite, assertSameShape, assertEqual
  public :: compare_integers, compare_reals, compare_logicals
  public :: EQUAL, NOT_EQUAL, LESS, LESS_OR_EQUAL, GREATER, GREATER_OR_EQUAL, RELATIVELY_EQUAL
  public :: funit_open, funit_close, funit_is_wanted, funit_begin, funit_end, funit_end_with
  public :: funit_report, funit_failures_here, funit_set_rank, funit_finished

  type :: SourceLocation
    character(len=128) :: file_name = '<unknown file>'
    integer :: line_number = 0
  end type SourceLocation

  integer, parameter :: EQUAL = 1, NOT_EQUAL = 2, LESS = 3, LESS_OR_EQUAL = 4
  integer, parameter :: GREATER = 5, GREATER_OR_EQUAL = 6, RELATIVELY_EQUAL = 7
  character(len=*), parameter :: RELATION_NAMES(7) = [character(len=24) :: &
    'equal to', 'different from', &
    'less than', 'less than or equal to', 'greater than', 'greater than or equal to', &
    'relatively equal to']

  interface assertTrue
    module procedure assert_true, assert_true_all
  end interface assertTrue
  interface assertFalse
    module procedure assert_false, assert_false_all
  end interface assertFalse
  interface assertIsNaN
    module procedure assert_is_nan_32, assert_is_nan_64
  end interface assertIsNaN
  interface assertIsFinite
    module procedure assert_is_finite_32, assert_is_finite_64
  end interface assertIsFinite
  interface assertEqual
    module procedure assert_equal_text, assert_equal_text_one_many, assert_equal_text_many
  end interface assertEqual

  interface
    function c_atexit(handler) bind(C, name='atexit') result(status)
      import :: c_funptr, c_int
      implicit none
      type(c_funptr), value :: handler
      integer(c_int) :: status
    end function c_atexit
    subroutine c_exit_now(status) bind(C, name='_exit')
      import :: c_int
      implicit none
      integer(c_int), value :: status
    end subroutine c_exit_now
  end interface

  integer :: tests_run = 0
  integer :: tests_failed = 0
  integer :: failures_here = 0
  integer :: rank = -1
  logical :: finished = .false.
  character(len=256) :: current_test = ''
  character(len=256) :: filter = ''

contains

  !> Reads the command line: `-f TEXT` runs only the tests whose `module.name` contains TEXT.
  subroutine funit_open()
    character(len=256) :: argument
    integer :: i, status

    do i = 1, command_argument_count()
      call get_command_argument(i, argument)
      if (argument == '-f' .or. argument == '--filter') call get_command_argument(i + 1, filter)
    end do
    status = c_atexit(c_funloc(refuse_early_exit))
    if (status /= 0) error stop 1
  end subroutine funit_open

  !> A `stop` inside a test would end the program with exit code 0 and without the summary.
  subroutine refuse_early_exit() bind(C)
    if (finished) return
    write (output_unit, '(3a)') 'FAILED: the program was stopped inside ', trim(current_test), '.'
    flush (output_unit)
    call c_exit_now(1_c_int)
  end subroutine refuse_early_exit

  !> The summary line and the exit code.
  subroutine funit_close(file_count)
    integer, intent(in) :: file_count
    logical :: passed

    passed = funit_report(file_count)
    call funit_finished()
    if (.not. passed) stop 1
  end subroutine funit_close

  !> Prints the summary line; whether all went well. A run without tests is a failure.
  function funit_report(file_count) result(passed)
    integer, intent(in) :: file_count
    logical :: passed

    passed = tests_failed == 0 .and. tests_run > 0
    if (tests_run == 0) then
      write (output_unit, '(3a)') 'FAILED: no test matches "', trim(filter), '".'
    else if (passed) then
      write (output_unit, '(a, i0, a, i0, a)') &
        'PASSED: ', tests_run, ' tests of ', file_count, ' files.'
    else
      write (output_unit, '(a, i0, a, i0, a, i0, a)') &
        'FAILED: ', tests_failed, ' of ', tests_run, ' tests of ', file_count, ' files.'
    end if
    flush (output_unit)
  end function funit_report

  !> From here on the program may end.
  subroutine funit_finished()
    finished = .true.
  end subroutine funit_finished

  function funit_is_wanted(name) result(wanted)
    character(len=*), intent(in) :: name
    logical :: wanted
    wanted = filter == '' .or. index(name, trim(filter)) > 0
  end function funit_is_wanted

  subroutine funit_begin(name)
    character(len=*), intent(in) :: name
    current_test = name
    failures_here = 0
  end subroutine funit_begin

  subroutine funit_end()
    call funit_end_with(failures_here)
  end subroutine funit_end

  !> Ends a test that failed `failure_count` times, on all ranks together.
  subroutine funit_end_with(failure_count)
    integer, intent(in) :: failure_count

    tests_run = tests_run + 1
    if (failure_count > 0) then
      tests_failed = tests_failed + 1
    end if
    if (rank <= 0) then
      if (failure_count > 0) write (output_unit, '(2a)') 'failed  ', trim(current_test)
      if (failure_count == 0) write (output_unit, '(2a)') 'ok      ', trim(current_test)
      flush (output_unit)
    end if
    failures_here = 0
  end subroutine funit_end_with

  function funit_failures_here() result(count)
    integer :: count
    count = failures_here
  end function funit_failures_here

  !> The rank that is named in messages.
  subroutine funit_set_rank(new_rank)
    integer, intent(in) :: new_rank
    rank = new_rank
  end subroutine funit_set_rank

  !> Whether an assert of the current test has failed on this rank.
  function anyExceptions() result(any_failed)
    logical :: any_failed
    any_failed = failures_here > 0
  end function anyExceptions

  !> Records and prints a failure at once, so that it is seen even if the other ranks hang.
  subroutine fail(what, message, location)
    character(len=*), intent(in) :: what
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    type(SourceLocation) :: place
    character(len=32) :: on_rank

    failures_here = failures_here + 1
    on_rank = ''
    if (rank >= 0) write (on_rank, '(a, i0)') ' on rank ', rank
    if (present(location)) place = location
    write (output_unit, '(2a, i0, 6a)', advance='no') &
      trim(place%file_name), ':', place%line_number, ': ', trim(current_test), trim(on_rank), &
      ': ', what, ' '
    if (present(message)) write (output_unit, '(3a)', advance='no') '(', message, ')'
    write (output_unit, '(a)') ''
    flush (output_unit)
  end subroutine fail

  ! Logical conditions.

  subroutine assert_true(condition, message, location)
    logical, intent(in) :: condition
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (.not. condition) call fail('expected true, got false', message, location)
  end subroutine assert_true

  subroutine assert_true_all(condition, message, location)
    logical, intent(in) :: condition(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (.not. all(condition)) call fail('expected all true', message, location)
  end subroutine assert_true_all

  subroutine assert_false(condition, message, location)
    logical, intent(in) :: condition
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (condition) call fail('expected false, got true', message, location)
  end subroutine assert_false

  subroutine assert_false_all(condition, message, location)
    logical, intent(in) :: condition(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (any(condition)) call fail('expected all false', message, location)
  end subroutine assert_false_all

  subroutine assertAll(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    call assert_true_all(conditions, message, location)
  end subroutine assertAll

  subroutine assertAny(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (.not. any(conditions)) call fail('expected at least one true', message, location)
  end subroutine assertAny

  subroutine assertNone(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    call assert_false_all(conditions, message, location)
  end subroutine assertNone

  subroutine assertNotAll(conditions, message, location)
    logical, intent(in) :: conditions(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (all(conditions)) call fail('expected at least one false', message, location)
  end subroutine assertNotAll

  subroutine assertFail(message, location)
    character(len=*), intent(in) :: message
    type(SourceLocation), intent(in), optional :: location
    call fail(message, location=location)
  end subroutine assertFail

  subroutine assertSameShape(shape_a, shape_b, message, location)
    integer, intent(in) :: shape_a(:), shape_b(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    logical :: same

    same = size(shape_a) == size(shape_b)
    if (same) same = all(shape_a == shape_b)
    if (.not. same) then
      call fail('shapes '//shape_text(shape_a)//' and '//shape_text(shape_b)//' differ', &
        message, location)
    end if
  end subroutine assertSameShape

  ! Kinds of numbers.

  subroutine assert_is_nan_32(x, message, location)
    real(real32), intent(in) :: x
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    call assert_is_nan_64(real(x, real64), message, location)
  end subroutine assert_is_nan_32

  subroutine assert_is_nan_64(x, message, location)
    real(real64), intent(in) :: x
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (.not. ieee_is_nan(x)) call fail('expected NaN, got '//real_text(x), message, location)
  end subroutine assert_is_nan_64

  subroutine assert_is_finite_32(x, message, location)
    real(real32), intent(in) :: x
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    call assert_is_finite_64(real(x, real64), message, location)
  end subroutine assert_is_finite_32

  subroutine assert_is_finite_64(x, message, location)
    real(real64), intent(in) :: x
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (.not. ieee_is_finite(x)) then
      call fail('expected a finite number, got '//real_text(x), message, location)
    end if
  end subroutine assert_is_finite_64

  ! Text: as in pFUnit, blanks at both ends do not count.

  subroutine assert_equal_text(expected, actual, message, location)
    character(len=*), intent(in) :: expected, actual
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    if (trim(adjustl(expected)) /= trim(adjustl(actual))) then
      call fail('expected "'//trim(expected)//'", got "'//trim(actual)//'"', message, location)
    end if
  end subroutine assert_equal_text

  subroutine assert_equal_text_one_many(expected, actual, message, location)
    character(len=*), intent(in) :: expected, actual(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    integer :: i
    do i = 1, size(actual)
      call assert_equal_text(expected, actual(i), message, location)
    end do
  end subroutine assert_equal_text_one_many

  subroutine assert_equal_text_many(expected, actual, message, location)
    character(len=*), intent(in) :: expected(:), actual(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    integer :: i
    call assertSameShape(shape(expected), shape(actual), message, location)
    do i = 1, min(size(expected), size(actual))
      call assert_equal_text(expected(i), actual(i), message, location)
    end do
  end subroutine assert_equal_text_many

  ! Comparisons of flat arrays; the shapes are those of the arguments of the assert. An expected
  ! scalar stands for all elements. Stops at the first element that fails.

  subroutine compare_integers(relation, expected, expected_shape, actual, actual_shape, &
      message, location)
    integer, intent(in) :: relation
    integer(int64), intent(in) :: expected(:), actual(:)
    integer, intent(in) :: expected_shape(:), actual_shape(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    logical :: holds
    integer :: i, j

    if (.not. conform(expected_shape, actual_shape, message, location)) return
    do i = 1, size(actual)
      j = min(i, size(expected))
      select case (relation)
      case (EQUAL)
        holds = expected(j) == actual(i)
      case (NOT_EQUAL)
        holds = expected(j) /= actual(i)
      case (LESS)
        holds = expected(j) < actual(i)
      case (LESS_OR_EQUAL)
        holds = expected(j) <= actual(i)
      case (GREATER)
        holds = expected(j) > actual(i)
      case default
        holds = expected(j) >= actual(i)
      end select
      if (.not. holds) then
        call fail_comparison(relation, integer_text(expected(j)), integer_text(actual(i)), &
          place_text(i, actual_shape), message, location)
        return
      end if
    end do
  end subroutine compare_integers

  subroutine compare_reals(relation, expected, expected_shape, actual, actual_shape, tolerance, &
      message, location)
    integer, intent(in) :: relation
    real(real64), intent(in) :: expected(:), actual(:), tolerance
    integer, intent(in) :: expected_shape(:), actual_shape(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    character(len=:), allocatable :: note
    integer :: i, j

    if (.not. conform(expected_shape, actual_shape, message, location)) return
    do i = 1, size(actual)
      j = min(i, size(expected))
      if (.not. real_relation_holds(relation, expected(j), actual(i), tolerance)) then
        note = place_text(i, actual_shape)
        if (relation == EQUAL) then
          note = note//', difference '//real_text(actual(i) - expected(j))//', tolerance '// &
            real_text(tolerance)
        else if (relation == RELATIVELY_EQUAL) then
          note = note//', relative difference '// &
            real_text(abs(actual(i) - expected(j))/max(abs(expected(j)), tiny(1.0_real64)))// &
            ', tolerance '//real_text(tolerance)
        end if
        call fail_comparison(relation, real_text(expected(j)), real_text(actual(i)), note, &
          message, location)
        return
      end if
    end do
  end subroutine compare_reals

  !> Every relation is false for NaN, except NOT_EQUAL.
  pure function real_relation_holds(relation, expected, actual, tolerance) result(holds)
    integer, intent(in) :: relation
    real(real64), intent(in) :: expected, actual, tolerance
    logical :: holds

    if (ieee_is_nan(expected) .or. ieee_is_nan(actual)) then
      ! Also keeps quiet NaNs from trapping in the comparisons below.
      holds = relation == NOT_EQUAL
      return
    end if
    select case (relation)
    case (EQUAL)
      holds = expected == actual
      if (.not. holds .and. ieee_is_finite(expected) .and. ieee_is_finite(actual)) then
        holds = abs(actual - expected) <= tolerance
      end if
    case (NOT_EQUAL)
      holds = expected /= actual
    case (LESS)
      holds = expected < actual
    case (LESS_OR_EQUAL)
      holds = expected <= actual
    case (GREATER)
      holds = expected > actual
    case (GREATER_OR_EQUAL)
      holds = expected >= actual
    case default
      holds = .false.
      if (ieee_is_finite(expected) .and. ieee_is_finite(actual)) then
        holds = abs(actual - expected) <= tolerance*abs(expected)
      end if
    end select
  end function real_relation_holds

  subroutine compare_logicals(relation, expected, expected_shape, actual, actual_shape, &
      message, location)
    integer, intent(in) :: relation
    logical, intent(in) :: expected(:), actual(:)
    integer, intent(in) :: expected_shape(:), actual_shape(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    call compare_integers(relation, merge(1_int64, 0_int64, expected), expected_shape, &
      merge(1_int64, 0_int64, actual), actual_shape, message, location)
  end subroutine compare_logicals

  function conform(expected_shape, actual_shape, message, location) result(same)
    integer, intent(in) :: expected_shape(:), actual_shape(:)
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    logical :: same

    same = size(expected_shape) == 0
    if (same) return
    same = all(expected_shape == actual_shape)
    if (.not. same) call assertSameShape(expected_shape, actual_shape, message, location)
  end function conform

  subroutine fail_comparison(relation, expected, actual, note, message, location)
    integer, intent(in) :: relation
    character(len=*), intent(in) :: expected, actual, note
    character(len=*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location

    if (relation == EQUAL .or. relation == RELATIVELY_EQUAL) then
      call fail('expected '//expected//', got '//actual//note, message, location)
    else
      call fail(expected//' is not '//trim(RELATION_NAMES(relation))//' '//actual//note, &
        message, location)
    end if
  end subroutine fail_comparison

  !> ` at (2,1)` for the third element of a 2 x 2 array; empty for a scalar.
  pure function place_text(position, extents) result(text)
    integer, intent(in) :: position
    integer, intent(in) :: extents(:)
    character(len=:), allocatable :: text
    integer :: d, rest, subscripts(size(extents))

    text = ''
    if (size(extents) == 0) return
    rest = position - 1
    do d = 1, size(extents)
      subscripts(d) = mod(rest, extents(d)) + 1
      rest = rest/extents(d)
    end do
    text = ' at '//shape_text(subscripts)
  end function place_text

  pure function shape_text(extents) result(text)
    integer, intent(in) :: extents(:)
    character(len=:), allocatable :: text
    integer :: d

    text = '('
    do d = 1, size(extents)
      if (d > 1) text = text//','
      text = text//integer_text(int(extents(d), int64))
    end do
    text = text//')'
  end function shape_text

  pure function integer_text(value) result(text)
    integer(int64), intent(in) :: value
    character(len=:), allocatable :: text
    character(len=24) :: buffer
    write (buffer, '(i0)') value
    text = trim(buffer)
  end function integer_text

  pure function real_text(value) result(text)
    real(real64), intent(in) :: value
    character(len=:), allocatable :: text
    character(len=40) :: buffer
    write (buffer, '(g0)') value
    text = trim(adjustl(buffer))
  end function real_text
end module funit_core
