!> What serial tests `use`: the asserts under pFUnit's names, and what the generated code calls.
module funit
  use funit_asserts, only: assertEqual, assertGreaterThan, assertGreaterThanOrEqual, &
    assertLessThan, assertLessThanOrEqual, assertNotEqual, assertRelativelyEqual
  use funit_core, only: SourceLocation, anyExceptions, assertAll, assertAny, assertEqual, &
    assertFail, assertFalse, assertIsFinite, assertIsNaN, assertNone, &
    assertNotAll, assertSameShape, assertTrue, funit_begin, funit_close, funit_end, &
    funit_is_wanted, funit_open
  implicit none
  public
end module funit
