!> Fields that were made elsewhere: where they come from is no concern of those who use them.
module sg_field_supply
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: field_supply_t

  type, abstract :: field_supply_t
  contains
    procedure(read_interface), deferred :: read
  end type field_supply_t

  abstract interface
    subroutine read_interface(this, realization, values, error)
      import :: error_t, field_supply_t, i8, wp
      implicit none
      class(field_supply_t), intent(in) :: this
      integer(i8), intent(in) :: realization
      !> [points of the field], in the unit of the property.
      real(wp), contiguous, intent(out) :: values(:)
      type(error_t), allocatable, intent(out) :: error
    end subroutine read_interface
  end interface
end module sg_field_supply
