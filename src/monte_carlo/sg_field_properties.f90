!> Between random fields and the points of a scene: which points there are, and which properties
!> they get.
module sg_field_properties
  use sg_angles, only: DEGREE
  use sg_config, only: config_t, nominal_value
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: wp
  use sg_property, only: property_index, PROPERTY_FRICTION_ANGLE, PROPERTY_UNITS
  use sg_random_field, only: field_points_t, random_field_t
  use sg_random_fields, only: field_values_t
  use sg_scene, only: scene_t
  use sg_variation, only: property_values_t
  implicit none
  private

  public :: points_of_materials, compose_properties, refuse_hidden, units_of

contains

  !> The points of each material, in the order of points_of of the scene.
  function points_of_materials(scene) result(points)
    type(scene_t), intent(in) :: scene
    type(field_points_t), allocatable :: points(:)
    integer :: body, material, n

    allocate (points(size(scene%materials)))
    do material = 1, size(points)
      associate (p => points(material))
        call scene%points_of(material, p%x, p%y)
        allocate (p%width(0), p%height(0), p%body(0))
        do body = 1, size(scene%particles%bodies)
          associate (b => scene%particles%bodies(body))
            if (b%material /= material) cycle
            n = b%last - b%first + 1
            p%width = [p%width, spread(b%width, 1, n)]
            p%height = [p%height, spread(b%height, 1, n)]
            p%body = [p%body, spread(body, 1, n)]
          end associate
        end do
      end associate
    end do
  end function points_of_materials

  !> The properties that the values of the fields make: what no field covers is as the material
  !> says, and of several fields of a property at a point the last one counts.
  subroutine compose_properties(config, fields, values, points, properties)
    type(config_t), intent(in) :: config
    type(random_field_t), intent(in) :: fields(:)
    !> One for each field.
    type(field_values_t), intent(in) :: values(:)
    type(field_points_t), intent(in) :: points(:)
    type(property_values_t), allocatable, intent(out) :: properties(:)
    type(property_values_t) :: list(size(fields))
    integer :: found, k, material, property, used

    used = 0
    do k = 1, size(fields)
      material = fields(k)%config%material_index
      property = property_made_by(fields(k))
      do found = 1, used
        if (list(found)%property == property .and. list(found)%material == material) exit
      end do
      if (found > used) then
        used = found
        list(found)%property = property
        list(found)%material = material
        allocate (list(found)%values(size(points(material)%x)), &
          source=nominal_value(config%materials(material), trim(fields(k)%config%property)))
      end if
      associate (all => list(found)%values)
        if (fields(k)%config%property == 'tan_friction_angle') then
          all(fields(k)%points) = angle_of(values(k)%values)
        else
          all(fields(k)%points) = values(k)%values
        end if
      end associate
    end do
    properties = list(:used)
  end subroutine compose_properties

  !> The property that a field becomes; its tangent is a friction angle, too.
  pure integer function property_made_by(field) result(property)
    type(random_field_t), intent(in) :: field

    property = property_index(trim(field%config%property))
    if (property == 0) property = PROPERTY_FRICTION_ANGLE
  end function property_made_by

  !> A field that counts nowhere, as later ones of its property cover all its points, is bad input.
  subroutine refuse_hidden(fields, error)
    type(random_field_t), intent(in) :: fields(:)
    type(error_t), allocatable, intent(out) :: error
    logical, allocatable :: counts(:)
    integer :: k, l

    do k = 1, size(fields)
      allocate (counts(maxval(fields(k)%points)), source=.false.)
      counts(fields(k)%points) = .true.
      do l = k + 1, size(fields)
        if (fields(l)%config%material_index /= fields(k)%config%material_index) cycle
        if (property_made_by(fields(l)) /= property_made_by(fields(k))) cycle
        counts(pack(fields(l)%points, fields(l)%points <= size(counts))) = .false.
      end do
      if (.not. any(counts)) then
        call raise(error, EXIT_BAD_INPUT, 'random field '//trim(fields(k)%config%name)// &
          ' counts nowhere: later fields of the same property cover all its points', &
          'refuse_hidden')
        return
      end if
      deallocate (counts)
    end do
  end subroutine refuse_hidden

  !> Unit of the values of a field of this property.
  pure function units_of(property) result(units)
    character(len=*), intent(in) :: property
    character(len=:), allocatable :: units

    units = '1' ! tan_friction_angle
    if (property_index(property) > 0) units = trim(PROPERTY_UNITS(property_index(property)))
  end function units_of

  !> Angle in degrees of a tangent.
  elemental real(wp) function angle_of(tangent)
    real(wp), intent(in) :: tangent

    angle_of = atan(tangent)/DEGREE
  end function angle_of
end module sg_field_properties
