!> The only user of HDF5: files with groups, attributes and plain datasets, written whole or read.
!> Paths in a file are like /cases/base/id. A Fortran array a(m, n) appears in C and Python as [n,
!> m].
module sg_hdf5_file
  use, intrinsic :: iso_c_binding, only: c_char, c_loc, c_ptr
  use hdf5, only: h5aclose_f, h5acreate_f, h5awrite_f, h5dclose_f, h5dcreate_f, &
    h5dget_space_f, h5dont_atexit_f, h5dopen_f, h5dread_f, h5dwrite_f, h5eset_auto_f, &
    h5fclose_f, h5fcreate_f, h5fopen_f, h5gclose_f, h5gcreate_f, h5gget_obj_info_idx_f, &
    h5gn_members_f, h5kind_to_type, h5oclose_f, h5oopen_f, h5open_f, h5sclose_f, h5screate_f, &
    h5screate_simple_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_ndims_f, &
    h5sselect_hyperslab_f, h5tclose_f, h5tcopy_f, h5tset_size_f, h5tset_strpad_f, &
    H5F_ACC_RDONLY_F, H5F_ACC_TRUNC_F, H5S_SCALAR_F, H5S_SELECT_SET_F, H5T_NATIVE_CHARACTER, &
    H5T_STR_NULLPAD_F, H5_INTEGER_KIND, H5_REAL_KIND, hid_t, hsize_t, size_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, EXIT_INTERNAL, raise
  use sg_hdf5_reason, only: system_reason
  use sg_kinds, only: i4, i8, sp, wp
  implicit none
  private

  public :: hdf5_file_t

  !> Errors are kept and told by `close`, so that a file is written without a test in every line;
  !> after the first one, the other calls do nothing.
  type :: hdf5_file_t
    private
    integer(hid_t) :: id = -1
    logical :: is_open = .false.
    logical :: failed = .false.
    character(len=:), allocatable :: path, failure
  contains
    procedure :: create
    procedure :: open_old
    procedure :: close
    procedure :: only_member
    procedure :: extents_of
    procedure :: read_part
    procedure :: make_group
    procedure, private :: write_real_1, write_real_2, write_single_1, write_single_2
    procedure, private :: write_integer_1, write_long_1, write_texts
    !> `write(name, values, units)`: a dataset of rank 1 or 2; units is an attribute of it.
    generic :: write => write_real_1, write_real_2, write_single_1, write_single_2, &
      write_integer_1, write_long_1, write_texts
    procedure :: write_scalar
    procedure, private :: attribute_text, attribute_integer, attribute_long, attribute_real
    !> `set(path, name, value)`: an attribute of a group or dataset.
    generic :: set => attribute_text, attribute_integer, attribute_long, attribute_real
  end type hdf5_file_t

contains

  !> A new file, in the place of any old one.
  subroutine create(this, path, error)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error
    integer :: status

    call start(this, path)
    if (.not. this%failed) then
      call h5fcreate_f(path, H5F_ACC_TRUNC_F, this%id, status)
      call look(this, status, 'the file')
    end if
    this%is_open = .not. this%failed
    if (this%failed) call raise(error, EXIT_INTERNAL, this%failure, 'hdf5_file_t%create')
  end subroutine create

  !> Starts the library, which prints its errors unless told otherwise. It may not tidy up when the
  !> program ends either: it has crashed then over a file that could not be closed (full disk).
  subroutine start(this, path)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path
    integer :: status

    this%failed = .false.
    this%path = path
    ! Fails from the second time on, and has been heard by then.
    call h5dont_atexit_f(status)
    call h5open_f(status)
    call look(this, status, 'the library')
    if (this%failed) return
    call h5eset_auto_f(0, status)
    call look(this, status, 'the library')
  end subroutine start

  !> An old file, to be read.
  subroutine open_old(this, path, error)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path
    type(error_t), allocatable, intent(out) :: error
    integer :: status

    call start(this, path)
    status = -1
    if (.not. this%failed) call h5fopen_f(path, H5F_ACC_RDONLY_F, this%id, status)
    this%is_open = status >= 0
    if (.not. this%is_open) call raise(error, EXIT_BAD_INPUT, path//' cannot be read, or is no '// &
      'HDF5 file', 'hdf5_file_t%open_old')
  end subroutine open_old

  !> Name of the one member of a group; empty if there are more or none.
  function only_member(this, group) result(name)
    class(hdf5_file_t), intent(in) :: this
    character(len=*), intent(in) :: group
    character(len=:), allocatable :: name
    character(len=256) :: buffer
    integer :: members, kind, status

    name = ''
    call h5gn_members_f(this%id, group, members, status)
    if (status < 0 .or. members /= 1) return
    call h5gget_obj_info_idx_f(this%id, group, 0, buffer, kind, status)
    if (status >= 0) name = trim(buffer)
  end function only_member

  !> Extents of a dataset as in Fortran; size 0 if there is no such dataset.
  function extents_of(this, name) result(extents)
    class(hdf5_file_t), intent(in) :: this
    character(len=*), intent(in) :: name
    integer(i8), allocatable :: extents(:)
    integer(hid_t) :: dataset, space
    integer(hsize_t), allocatable :: now(:), most(:)
    integer :: rank, status, ignored

    allocate (extents(0))
    call h5dopen_f(this%id, name, dataset, status)
    if (status < 0) return
    call h5dget_space_f(dataset, space, status)
    if (status >= 0) then
      call h5sget_simple_extent_ndims_f(space, rank, status)
      allocate (now(rank), most(rank))
      call h5sget_simple_extent_dims_f(space, now, most, status)
      if (status >= 0) extents = int(now, i8)
      call h5sclose_f(space, ignored)
    end if
    call h5dclose_f(dataset, ignored)
  end function extents_of

  !> The numbers of a dataset a(n), or the column a(:, column) of a(n, m).
  subroutine read_part(this, name, column, values, error)
    class(hdf5_file_t), intent(in) :: this
    character(len=*), intent(in) :: name
    !> 0: all of a(n).
    integer(i8), intent(in) :: column
    !> [n].
    real(wp), intent(out), target, contiguous :: values(:)
    type(error_t), allocatable, intent(out) :: error
    integer(hid_t) :: dataset, space, memory
    type(c_ptr) :: address
    integer :: status, ignored

    call h5dopen_f(this%id, name, dataset, status)
    if (status >= 0) then
      call h5dget_space_f(dataset, space, status)
      call h5screate_simple_f(1, [size(values, kind=hsize_t)], memory, ignored)
      if (status >= 0 .and. column > 0) call h5sselect_hyperslab_f(space, H5S_SELECT_SET_F, &
        [0_hsize_t, int(column - 1, hsize_t)], [size(values, kind=hsize_t), 1_hsize_t], status)
      address = c_loc(values)
      if (status >= 0) call h5dread_f(dataset, h5kind_to_type(wp, H5_REAL_KIND), address, status, &
        memory, space)
      call h5sclose_f(memory, ignored)
      call h5sclose_f(space, ignored)
      call h5dclose_f(dataset, ignored)
    end if
    if (status < 0) call raise(error, EXIT_BAD_INPUT, name//' of '//this%path//' cannot be read', &
      'hdf5_file_t%read_part')
  end subroutine read_part

  !> Closes the file; `error` tells the first thing that failed since `create`.
  subroutine close (this, error)
    class(hdf5_file_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    integer :: status

    if (this%is_open) then
      call h5fclose_f(this%id, status)
      call look(this, status, 'the end of the file')
    end if
    this%is_open = .false.
    if (this%failed) call raise(error, EXIT_INTERNAL, this%failure, 'hdf5_file_t%close')
  end subroutine close

  !> Keeps the first failure.
  subroutine look(this, status, what)
    class(hdf5_file_t), intent(inout) :: this
    integer, intent(in) :: status
    character(len=*), intent(in) :: what

    if (status >= 0 .or. this%failed) return
    this%failed = .true.
    this%failure = 'HDF5 cannot write '//what//' of '//this%path//system_reason()
  end subroutine look

  !> Its parent must exist.
  subroutine make_group(this, name)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    integer(hid_t) :: group
    integer :: status

    if (this%failed) return
    call h5gcreate_f(this%id, name, group, status)
    call look(this, status, name)
    if (this%failed) return
    call h5gclose_f(group, status)
    call look(this, status, name)
  end subroutine make_group

  subroutine write_real_1(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    real(wp), intent(in), target, contiguous :: values(:)
    character(len=*), intent(in), optional :: units

    call write_raw(this, name, h5kind_to_type(wp, H5_REAL_KIND), shape(values), c_loc(values), &
      units)
  end subroutine write_real_1

  subroutine write_real_2(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    real(wp), intent(in), target, contiguous :: values(:, :)
    character(len=*), intent(in), optional :: units

    call write_raw(this, name, h5kind_to_type(wp, H5_REAL_KIND), shape(values), c_loc(values), &
      units)
  end subroutine write_real_2

  subroutine write_single_1(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    real(sp), intent(in), target, contiguous :: values(:)
    character(len=*), intent(in), optional :: units

    call write_raw(this, name, h5kind_to_type(sp, H5_REAL_KIND), shape(values), c_loc(values), &
      units)
  end subroutine write_single_1

  subroutine write_single_2(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    real(sp), intent(in), target, contiguous :: values(:, :)
    character(len=*), intent(in), optional :: units

    call write_raw(this, name, h5kind_to_type(sp, H5_REAL_KIND), shape(values), c_loc(values), &
      units)
  end subroutine write_single_2

  subroutine write_integer_1(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    integer(i4), intent(in), target, contiguous :: values(:)
    character(len=*), intent(in), optional :: units

    call write_raw(this, name, h5kind_to_type(i4, H5_INTEGER_KIND), shape(values), c_loc(values), &
      units)
  end subroutine write_integer_1

  subroutine write_long_1(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    integer(i8), intent(in), target, contiguous :: values(:)
    character(len=*), intent(in), optional :: units

    call write_raw(this, name, h5kind_to_type(i8, H5_INTEGER_KIND), shape(values), c_loc(values), &
      units)
  end subroutine write_long_1

  !> Texts of one length, padded with null characters.
  subroutine write_texts(this, name, values, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    character(len=*), intent(in) :: values(:)
    character(len=*), intent(in), optional :: units
    character(kind=c_char, len=1), allocatable, target :: chars(:)
    integer(hid_t) :: kind
    integer :: i, j, length

    if (this%failed) return
    length = max(len(values), 1)
    allocate (chars(max(1, length*size(values))))
    chars = achar(0)
    do i = 1, size(values)
      do j = 1, len_trim(values(i))
        chars((i - 1)*length + j) = values(i) (j:j)
      end do
    end do
    call make_text_type(this, length, kind, name)
    if (this%failed) return
    call write_raw(this, name, kind, shape(values), c_loc(chars), units)
    call free_type(this, kind, name)
  end subroutine write_texts

  !> One number, a dataset of rank 0.
  subroutine write_scalar(this, name, value, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    real(wp), intent(in) :: value
    character(len=*), intent(in), optional :: units
    real(wp), target :: copy(1)
    integer :: none(0)

    copy = value
    call write_raw(this, name, h5kind_to_type(wp, H5_REAL_KIND), none, c_loc(copy), units)
  end subroutine write_scalar

  subroutine write_raw(this, name, kind, extents, address, units)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: name
    integer(hid_t), intent(in) :: kind
    !> As in Fortran; size 0 for a scalar.
    integer, intent(in) :: extents(:)
    type(c_ptr), value :: address
    character(len=*), intent(in), optional :: units
    integer(hid_t) :: space, dataset
    integer :: status, ignored

    if (this%failed) return
    if (size(extents) == 0) then
      call h5screate_f(H5S_SCALAR_F, space, status)
    else
      call h5screate_simple_f(size(extents), int(extents, hsize_t), space, status)
    end if
    call look(this, status, name)
    if (this%failed) return
    call h5dcreate_f(this%id, name, kind, space, dataset, status)
    call look(this, status, name)
    if (.not. this%failed) then
      if (product(extents) > 0) call h5dwrite_f(dataset, kind, address, status)
      call look(this, status, name)
      call h5dclose_f(dataset, ignored)
      call look(this, ignored, name)
    end if
    call h5sclose_f(space, ignored)
    call look(this, ignored, name)
    if (present(units)) call this%set(name, 'units', units)
  end subroutine write_raw

  subroutine make_text_type(this, length, kind, name)
    class(hdf5_file_t), intent(inout) :: this
    integer, intent(in) :: length
    integer(hid_t), intent(out) :: kind
    character(len=*), intent(in) :: name
    integer :: status

    kind = -1
    call h5tcopy_f(H5T_NATIVE_CHARACTER, kind, status)
    call look(this, status, name)
    if (this%failed) return
    call h5tset_size_f(kind, int(length, size_t), status)
    call look(this, status, name)
    call h5tset_strpad_f(kind, H5T_STR_NULLPAD_F, status)
    call look(this, status, name)
  end subroutine make_text_type

  subroutine free_type(this, kind, name)
    class(hdf5_file_t), intent(inout) :: this
    integer(hid_t), intent(in) :: kind
    character(len=*), intent(in) :: name
    integer :: status

    call h5tclose_f(kind, status)
    call look(this, status, name)
  end subroutine free_type

  subroutine attribute_text(this, path, name, value)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name, value
    character(kind=c_char, len=1), allocatable, target :: chars(:)
    integer(hid_t) :: kind
    integer :: i

    if (this%failed) return
    allocate (chars(max(1, len(value))))
    chars = achar(0)
    do i = 1, len(value)
      chars(i) = value(i:i)
    end do
    call make_text_type(this, size(chars), kind, path//'@'//name)
    if (this%failed) return
    call write_attribute(this, path, name, kind, c_loc(chars))
    call free_type(this, kind, path//'@'//name)
  end subroutine attribute_text

  subroutine attribute_integer(this, path, name, value)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name
    integer(i4), intent(in) :: value
    integer(i4), target :: copy

    copy = value
    call write_attribute(this, path, name, h5kind_to_type(i4, H5_INTEGER_KIND), c_loc(copy))
  end subroutine attribute_integer

  subroutine attribute_long(this, path, name, value)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name
    integer(i8), intent(in) :: value
    integer(i8), target :: copy

    copy = value
    call write_attribute(this, path, name, h5kind_to_type(i8, H5_INTEGER_KIND), c_loc(copy))
  end subroutine attribute_long

  subroutine attribute_real(this, path, name, value)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name
    real(wp), intent(in) :: value
    real(wp), target :: copy

    copy = value
    call write_attribute(this, path, name, h5kind_to_type(wp, H5_REAL_KIND), c_loc(copy))
  end subroutine attribute_real

  subroutine write_attribute(this, path, name, kind, address)
    class(hdf5_file_t), intent(inout) :: this
    character(len=*), intent(in) :: path, name
    integer(hid_t), intent(in) :: kind
    type(c_ptr), value :: address
    integer(hid_t) :: object, space, attribute
    integer :: status

    if (this%failed) return
    call h5oopen_f(this%id, path, object, status)
    call look(this, status, path)
    if (this%failed) return
    call h5screate_f(H5S_SCALAR_F, space, status)
    call look(this, status, path//'@'//name)
    if (.not. this%failed) then
      call h5acreate_f(object, name, kind, space, attribute, status)
      call look(this, status, path//'@'//name)
      if (.not. this%failed) then
        call h5awrite_f(attribute, kind, address, status)
        call look(this, status, path//'@'//name)
        call h5aclose_f(attribute, status)
        call look(this, status, path//'@'//name)
      end if
      call h5sclose_f(space, status)
      call look(this, status, path//'@'//name)
    end if
    call h5oclose_f(object, status)
    call look(this, status, path)
  end subroutine write_attribute
end module sg_hdf5_file
