!> The ground of one variant of a case: what all its members share, built once on each rank. The
!> scene, and the random fields with their factors. Variants that differ in nothing that fields know
!> of, or only in cells and points, share the fields of the finest of them: coarser ones see their
!> means over the domains of their points (sg_restriction).
module sg_ground
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_field_properties, only: compose_properties, points_of_materials, refuse_hidden, units_of
  use sg_field_record, only: field_file_t, field_record_t, made_by_t
  use sg_kinds, only: i8, wp
  use sg_random_field, only: field_points_t
  use sg_random_fields, only: field_values_t, follows_study, random_fields_t, refuse_changed_files
  use sg_restriction, only: restriction_t
  use sg_scene, only: build_scene, scene_t
  use sg_schema, only: has_word, KEYS
  use sg_study, only: variant_t
  use sg_variation, only: property_values_t
  implicit none
  private

  public :: ground_t, build_grounds, prepare_grounds

  type :: ground_t
    type(config_t) :: config
    type(scene_t) :: scene
    !> The points of each material, and the fields for each ACF of the study; the coefficient of
    !> variation is set for each member.
    type(field_points_t), allocatable :: points(:)
    type(random_fields_t), allocatable :: fields(:)
    !> Position of the ground whose fields these are; its own, if it has factors itself.
    integer :: source = 0
    !> From the points of the source to its own, for each field; not allocated where they are the
    !> same.
    type(restriction_t), allocatable :: restrictions(:)
  contains
    procedure :: acf_index
    procedure :: restrict
    procedure :: mean_properties
    procedure :: properties_of
    procedure :: field_method
    procedure :: field_records
  end type ground_t

  !> Groups that random fields do not know of, and keys that say how finely they are seen.
  character(len=*), parameter :: NO_FIELD_GROUPS = 'loading solver boundary'
  character(len=*), parameter :: RESOLUTION_KEYS = 'cell_size points_per_cell'

contains

  !> The grounds of all variants. Nothing random happens here.
  subroutine build_grounds(variants, grounds, error)
    type(variant_t), intent(in) :: variants(:)
    type(ground_t), allocatable, intent(out) :: grounds(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: k, v

    call prepare_grounds(variants, grounds, error)
    if (allocated(error) .or. .not. variants(1)%config%has_random_field) return
    do v = 1, size(variants)
      if (grounds(v)%source /= v) cycle
      do k = 1, size(grounds(v)%fields)
        call grounds(v)%fields(k)%build(error)
        if (.not. allocated(error)) cycle
        error%message = error%message//variants(v)%note()
        return
      end do
    end do
    do v = 1, size(variants)
      if (grounds(v)%source /= v) call set_restrictions(grounds(grounds(v)%source), grounds(v))
    end do
  end subroutine build_grounds

  !> The same without factors of fields, and without what others than their sources need of them.
  subroutine prepare_grounds(variants, grounds, error)
    type(variant_t), intent(in) :: variants(:)
    type(ground_t), allocatable, intent(out) :: grounds(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: v

    allocate (grounds(size(variants)))
    do v = 1, size(variants)
      grounds(v)%config = variants(v)%config
      call build_scene(grounds(v)%config, grounds(v)%scene, error)
      if (allocated(error)) error%message = error%message//variants(v)%note()
      if (allocated(error)) return
      grounds(v)%points = points_of_materials(grounds(v)%scene)
    end do
    if (.not. variants(1)%config%has_random_field) return
    do v = 1, size(variants)
      grounds(v)%source = source_of(variants, grounds, v)
      call prepare_fields(grounds(v)%config, grounds(v)%points, grounds(v)%source == v, &
        grounds(v)%fields, error)
      if (allocated(error)) error%message = error%message//variants(v)%note()
      if (allocated(error)) return
    end do
  end subroutine prepare_grounds

  !> The finest of the variants that have the fields of variant `v`, and of those the first.
  pure integer function source_of(variants, grounds, v) result(source)
    type(variant_t), intent(in) :: variants(:)
    type(ground_t), intent(in) :: grounds(:)
    integer, intent(in) :: v
    integer :: w

    source = v
    do w = 1, size(variants)
      if (.not. same_fields(variants(v), variants(w))) cycle
      associate (here => grounds(source)%scene%particles%count, &
        there => grounds(w)%scene%particles%count)
        if (there > here .or. (there == here .and. w < source)) source = w
      end associate
    end do
  end function source_of

  pure logical function same_fields(one, other) result(same)
    type(variant_t), intent(in) :: one, other
    integer :: k

    same = .true.
    do k = 1, size(one%choice)
      associate (key => KEYS(one%config%study%lists(k)%row))
        same = same .and. (one%choice(k) == other%choice(k) .or. has_word(NO_FIELD_GROUPS, &
          key%group) .or. has_word(RESOLUTION_KEYS, key%name))
      end associate
    end do
  end function same_fields

  !> How `ground` sees the fields of `source`.
  subroutine set_restrictions(source, ground)
    type(ground_t), intent(in) :: source
    type(ground_t), intent(inout) :: ground
    integer :: k

    if (have_same_points(source, ground)) return
    allocate (ground%restrictions(size(ground%fields(1)%fields)))
    do k = 1, size(ground%restrictions)
      associate (fine => source%fields(1)%fields(k), coarse => ground%fields(1)%fields(k))
        associate (p => source%points(fine%config%material_index), &
          q => ground%points(coarse%config%material_index))
          call ground%restrictions(k)%init(fine%x, fine%y, p%width(fine%points), &
            p%height(fine%points), coarse%x, coarse%y, q%width(coarse%points), &
            q%height(coarse%points))
        end associate
      end associate
    end do
  end subroutine set_restrictions

  pure logical function have_same_points(one, other) result(same)
    type(ground_t), intent(in) :: one, other

    associate (a => one%scene%particles, b => other%scene%particles)
      same = a%count == b%count
      if (same) same = all(abs(a%x - b%x) <= 0.0_wp) .and. all(abs(a%y - b%y) <= 0.0_wp)
    end associate
  end function have_same_points

  !> The fields for each ACF of the study, without their factors; what is wrong with them in any
  !> case is told here, and not by members that fail.
  subroutine prepare_fields(config, points, opens_files, fields, error)
    type(config_t), intent(in) :: config
    !> Of each material.
    type(field_points_t), intent(in) :: points(:)
    !> Fields that are not sampled come from their files.
    logical, intent(in) :: opens_files
    type(random_fields_t), allocatable, intent(out) :: fields(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: j, k

    call refuse_changed_files(config, error)
    if (allocated(error)) return
    allocate (fields(size(config%study%acf)))
    do k = 1, size(fields)
      call fields(k)%prepare(config, trim(config%study%acf(k)), config%study%cov(1), points, error)
      if (.not. allocated(error)) call refuse_hidden(fields(k)%fields, error)
      do j = size(config%study%cov), 1, -1
        if (.not. allocated(error)) call fields(k)%set_cov(config%study%cov(j), error)
      end do
      if (opens_files .and. .not. allocated(error)) call open_files(fields(k), &
        max(config%monte_carlo%realizations, config%control_variate%realizations), error)
      if (allocated(error)) return
    end do
  end subroutine prepare_fields

  !> Opens the files of the fields that are not sampled.
  subroutine open_files(fields, realizations, error)
    type(random_fields_t), intent(inout) :: fields
    integer, intent(in) :: realizations
    type(error_t), allocatable, intent(out) :: error
    type(field_file_t), allocatable :: file
    integer :: k

    do k = 1, size(fields%fields)
      associate (field => fields%fields(k))
        if (field%config%file == '') cycle
        allocate (file)
        call file%open_fields(field%config%file, trim(field%config%name), field%x, field%y, &
          realizations, error)
        if (allocated(error)) return
        call move_alloc(file, fields%supplies(k)%supply)
      end associate
    end do
  end subroutine open_files

  !> Position of an autocorrelation function among those of the study.
  pure integer function acf_index(this, acf) result(k)
    class(ground_t), intent(in) :: this
    character(len=*), intent(in) :: acf

    do k = 1, size(this%config%study%acf) - 1
      if (this%config%study%acf(k) == acf) return
    end do
  end function acf_index

  !> The values of the source, one for each field, become those at the points of this ground.
  subroutine restrict(this, values)
    class(ground_t), intent(in) :: this
    type(field_values_t), intent(inout) :: values(:)
    integer :: k

    if (.not. allocated(this%restrictions)) return
    do k = 1, size(values)
      values(k)%values = this%restrictions(k)%apply(values(k)%values)
    end do
  end subroutine restrict

  !> The values that fields with their mean everywhere have, times `factor`.
  function mean_properties(this, factor) result(values)
    class(ground_t), intent(in) :: this
    real(wp), intent(in) :: factor
    type(field_values_t), allocatable :: values(:)
    integer :: k

    allocate (values(size(this%fields(1)%fields)))
    do k = 1, size(values)
      values(k)%values = factor*this%fields(1)%fields(k)%mean
    end do
  end function mean_properties

  !> The properties that the values of the fields make at the points.
  function properties_of(this, values) result(properties)
    class(ground_t), intent(in) :: this
    !> One for each field.
    type(field_values_t), intent(in) :: values(:)
    type(property_values_t), allocatable :: properties(:)

    call compose_properties(this%config, this%fields(1)%fields, values, this%points, properties)
  end function properties_of

  !> How the fields are sampled, with what was conceded for each ACF; empty without a field.
  function field_method(this) result(text)
    class(ground_t), intent(in) :: this
    character(len=:), allocatable :: text
    integer :: k

    text = ''
    if (.not. allocated(this%fields)) return
    text = this%fields(1)%describe()
    do k = 2, size(this%fields)
      if (this%fields(k)%describe() /= this%fields(1)%describe()) text = text//'; '// &
        trim(this%config%study%acf(k))//': '//this%fields(k)%describe()
    end do
  end function field_method

  !> The fields, for files; size 0 without one.
  function field_records(this) result(records)
    class(ground_t), intent(in) :: this
    type(field_record_t), allocatable :: records(:)
    integer :: j, k

    if (.not. allocated(this%fields)) then
      allocate (records(0))
      return
    end if
    allocate (records(size(this%fields(1)%fields)))
    do k = 1, size(records)
      associate (r => records(k), field => this%fields(1)%fields(k))
        r%index = k
        r%name = trim(field%config%name)
        r%property = trim(field%config%property)
        r%material = trim(field%config%material)
        r%units = units_of(r%property)
        r%x = field%x
        r%y = field%y
        r%width = this%points(field%config%material_index)%width(field%points)
        r%height = this%points(field%config%material_index)%height(field%points)
        r%mean = field%mean
        r%sd = field%sd
        r%data = this%fields(1)%data%of_field(k)
        allocate (r%made_by(merge(size(this%fields), 1, follows_study(this%config, k))))
        do j = 1, size(r%made_by)
          r%made_by(j) = way_of(this%fields(j), k)
        end do
      end associate
    end do
  end function field_records

  !> How field `k` is made.
  function way_of(fields, k) result(way)
    type(random_fields_t), intent(in) :: fields
    integer, intent(in) :: k
    type(made_by_t) :: way

    way%acf = trim(fields%fields(k)%correlation%acf%name)
    way%method = 'restricted'
    allocate (way%jitters(0))
    if (.not. allocated(fields%sampler_of)) return
    way%method = 'file'
    if (fields%sampler_of(k) == 0) return
    associate (sampler => fields%samplers(fields%sampler_of(k))%sampler)
      way%method = sampler%method
      way%jitters = sampler%jitters
      way%ring = sampler%ring
    end associate
  end function way_of
end module sg_ground
