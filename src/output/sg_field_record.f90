!> Random fields in files: what ensemble.h5 says of them, and files of nothing but fields, which can
!> be written and taken as input.
module sg_field_record
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_field_supply, only: field_supply_t
  use sg_hdf5_file, only: hdf5_file_t
  use sg_kinds, only: i4, i8, wp
  use sg_number_table, only: number_table_t, read_number_table
  use sg_posix, only: replace_file, write_file
  use sg_text, only: ends_with, to_text
  implicit none
  private

  public :: case_fields_t, field_file_t, field_record_t, made_by_t
  public :: write_field_file, write_field_records, write_fields_csv

  !> How far a point of a file may be from that of the scene, in m: rounding of decimal numbers.
  real(wp), parameter :: SAME_PLACE = 1.0e-6_wp

  !> How a field is made for one autocorrelation function.
  type :: made_by_t
    character(len=:), allocatable :: acf, method
    real(wp), allocatable :: jitters(:)
    integer :: ring(2) = 0
  end type made_by_t

  !> A field: its points, its law at each of them, and how it is made.
  type :: field_record_t
    character(len=:), allocatable :: name, property, material, units
    !> Position among the fields, which says which random numbers it has.
    integer :: index = 0
    !> [points], in m, and in the unit of the property.
    real(wp), allocatable :: x(:), y(:), width(:), height(:), mean(:), sd(:)
    type(made_by_t), allocatable :: made_by(:)
    !> Measurements: x, y, value, error; [4, measurements].
    real(wp), allocatable :: data(:, :)
  end type field_record_t

  !> Realizations of the fields of one study case.
  type :: case_fields_t
    character(len=:), allocatable :: label
    !> [realizations].
    integer(i8), allocatable :: ids(:)
    !> One for each field.
    type(matrix_t), allocatable :: fields(:)
  end type case_fields_t

  type :: matrix_t
    !> [points, realizations].
    real(wp), allocatable :: values(:, :)
  end type matrix_t

  !> Fields of a file as input.
  type, extends(field_supply_t) :: field_file_t
    private
    character(len=:), allocatable :: path, dataset
    !> Realizations that the file holds, in its order.
    integer(i8), allocatable :: ids(:)
    !> The one field of a CSV file, the same in all realizations.
    real(wp), allocatable :: values(:)
  contains
    procedure :: open_fields
    procedure :: read => read_fields
  end type field_file_t

contains

  !> Group /random_fields of ensemble.h5.
  subroutine write_field_records(file, records)
    type(hdf5_file_t), intent(inout) :: file
    type(field_record_t), intent(in) :: records(:)
    character(len=:), allocatable :: group
    integer :: j, k

    if (size(records) == 0) return
    call file%make_group('/random_fields')
    do k = 1, size(records)
      associate (r => records(k))
        group = '/random_fields/'//r%name
        call file%make_group(group)
        call file%set(group, 'index', int(r%index, i4))
        call file%set(group, 'property', r%property)
        call file%set(group, 'material', r%material)
        call file%set(group, 'units', r%units)
        call file%write(group//'/x', r%x, 'm')
        call file%write(group//'/y', r%y, 'm')
        call file%write(group//'/width', once(r%width), 'm')
        call file%write(group//'/height', once(r%height), 'm')
        call file%write(group//'/mean', once(r%mean), r%units)
        call file%write(group//'/sd', once(r%sd), r%units)
        if (size(r%data, 2) > 0) then
          call file%make_group(group//'/data')
          call file%write(group//'/data/x', r%data(1, :), 'm')
          call file%write(group//'/data/y', r%data(2, :), 'm')
          call file%write(group//'/data/value', r%data(3, :), r%units)
          call file%write(group//'/data/error', r%data(4, :), r%units)
        end if
        do j = 1, size(r%made_by)
          associate (m => r%made_by(j))
            call file%make_group(group//'/'//m%acf)
            call file%set(group//'/'//m%acf, 'method', m%method)
            call file%write(group//'/'//m%acf//'/jitter', m%jitters, '1')
            call file%write(group//'/'//m%acf//'/ring', m%ring, '1')
          end associate
        end do
      end associate
    end do
  end subroutine write_field_records

  !> What is the same at all points, [1]; else the values, [points].
  pure function once(values) result(short)
    real(wp), intent(in) :: values(:)
    real(wp), allocatable :: short(:)

    short = values
    if (all(abs(values - values(1)) <= 0.0_wp)) short = values(:1)
  end function once

  !> A file of fields: /points/<name>/{x, y} and /cases/<label>/{id, <name>}, <name> being [points,
  !> realizations] as in Fortran.
  subroutine write_field_file(path, records, cases, error)
    character(len=*), intent(in) :: path
    type(field_record_t), intent(in) :: records(:)
    type(case_fields_t), intent(in) :: cases(:)
    type(error_t), allocatable, intent(out) :: error
    type(hdf5_file_t) :: file
    character(len=:), allocatable :: group
    integer :: i, k

    call file%create(path//'.new', error)
    if (allocated(error)) return
    call file%make_group('/points')
    do k = 1, size(records)
      group = '/points/'//records(k)%name
      call file%make_group(group)
      call file%write(group//'/x', records(k)%x, 'm')
      call file%write(group//'/y', records(k)%y, 'm')
    end do
    call file%make_group('/cases')
    do i = 1, size(cases)
      group = '/cases/'//cases(i)%label
      call file%make_group(group)
      call file%write(group//'/id', cases(i)%ids, '1')
      do k = 1, size(records)
        call file%write(group//'/'//records(k)%name, cases(i)%fields(k)%values, records(k)%units)
      end do
    end do
    call file%close(error)
    if (.not. allocated(error)) call replace_file(path//'.new', path, error)
  end subroutine write_field_file

  !> One realization of one field as x,y,<name>, with all digits: reading it gives the same bits.
  subroutine write_fields_csv(path, name, x, y, values, error)
    character(len=*), intent(in) :: path, name
    real(wp), intent(in) :: x(:), y(:), values(:)
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: FORM = '(2(es23.16e3, ","), es23.16e3)'
    character(len=:), allocatable :: text
    character(len=71) :: row
    integer :: i, used

    used = len(name) + 5
    allocate (character(len=used + size(x)*(len(row) + 1)) :: text)
    text(:used) = 'x,y,'//name//new_line('a')
    do i = 1, size(x)
      write (row, FORM) x(i), y(i), values(i)
      text(used + 1:used + len(row) + 1) = row//new_line('a')
      used = used + len(row) + 1
    end do
    call write_file(path, text, error)
  end subroutine write_fields_csv

  !> Opens a file of fields for the points (x, y) of the scene, which must be those of the file, in
  !> the same order.
  subroutine open_fields(this, path, name, x, y, realizations, error)
    class(field_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name
    real(wp), intent(in) :: x(:), y(:)
    !> Realizations 1 to this one must be there.
    integer, intent(in) :: realizations
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: file_x(:), file_y(:)
    integer(i8) :: id

    this%path = path
    if (ends_with(path, '.csv')) then
      call read_csv(path, name, file_x, file_y, this%values, error)
    else
      call look_into(this, path, name, file_x, file_y, error)
    end if
    if (allocated(error)) return
    if (size(file_x) /= size(x)) then
      call raise(error, EXIT_BAD_INPUT, path//' has '//to_text(size(file_x))//' points of '// &
        'field '//name//', the scene has '//to_text(size(x)), 'open_fields')
    else if (maxval(max(abs(file_x - x), abs(file_y - y))) > SAME_PLACE) then
      call raise(error, EXIT_BAD_INPUT, 'the points of '//path//' are not those of field '// &
        name//' in the scene: point '//to_text(maxloc(max(abs(file_x - x), abs(file_y - y)), &
        dim=1))//' is elsewhere', 'open_fields')
    end if
    if (allocated(error) .or. allocated(this%values)) return
    do id = 1, realizations
      if (any(this%ids == id)) cycle
      call raise(error, EXIT_BAD_INPUT, path//' has no realization '//to_text(id)//' of field '// &
        name//'; the run asks for 1 to '//to_text(realizations), 'open_fields')
      return
    end do
  end subroutine open_fields

  subroutine read_csv(path, name, x, y, values, error)
    character(len=*), intent(in) :: path, name
    real(wp), allocatable, intent(out) :: x(:), y(:), values(:)
    type(error_t), allocatable, intent(out) :: error
    type(number_table_t) :: table

    call read_number_table(path, ['x,y,'//name], table, error)
    if (allocated(error)) return
    x = table%values(1, :)
    y = table%values(2, :)
    values = table%values(3, :)
  end subroutine read_csv

  !> Finds the case and the points of a file written by --write-fields.
  subroutine look_into(this, path, name, x, y, error)
    class(field_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name
    real(wp), allocatable, intent(out) :: x(:), y(:)
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: late
    type(hdf5_file_t) :: file
    character(len=:), allocatable :: label
    integer(i8), allocatable :: extents(:)
    real(wp), allocatable :: ids(:)

    call file%open_old(path, error)
    if (allocated(error)) return
    label = file%only_member('/cases')
    this%dataset = '/cases/'//label//'/'//name
    allocate (extents(0))
    if (label /= '') extents = file%extents_of(this%dataset)
    if (size(extents) /= 2) then
      call raise(error, EXIT_BAD_INPUT, path//' holds no field '//name//' of one study case '// &
        '(dataset /cases/<label>/'//name//'; --write-fields with --study-case writes one)', &
        'open_fields')
    else
      allocate (x(extents(1)), y(extents(1)), ids(extents(2)))
      call file%read_part('/cases/'//label//'/id', 0_i8, ids, error)
      this%ids = nint(ids, i8)
      if (.not. allocated(error)) call file%read_part('/points/'//name//'/x', 0_i8, x, error)
      if (.not. allocated(error)) call file%read_part('/points/'//name//'/y', 0_i8, y, error)
    end if
    call file%close(late)
    if (.not. allocated(error) .and. allocated(late)) call move_alloc(late, error)
  end subroutine look_into

  subroutine read_fields(this, realization, values, error)
    class(field_file_t), intent(in) :: this
    integer(i8), intent(in) :: realization
    real(wp), contiguous, intent(out) :: values(:)
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: late
    type(hdf5_file_t) :: file
    integer :: column

    if (allocated(this%values)) then
      values = this%values
      return
    end if
    values = 0.0_wp
    column = findloc(this%ids, realization, dim=1)
    if (column == 0) then
      call raise(error, EXIT_BAD_INPUT, this%path//' has no realization '//to_text(realization), &
        'read_fields')
      return
    end if
    call file%open_old(this%path, error)
    if (allocated(error)) return
    call file%read_part(this%dataset, int(column, i8), values, error)
    call file%close(late)
    if (.not. allocated(error) .and. allocated(late)) call move_alloc(late, error)
  end subroutine read_fields
end module sg_field_record
