!> Snapshots of one member: DIR/snapshots/<label>_r000417.h5 with /history and /step_NNNNNN, and an
!> .xdmf beside it that opens in ParaView. Written under a temporary name and renamed at the end, so
!> that a file that is there is complete.
module sg_snapshot
  use sg_errors, only: error_t
  use sg_hdf5_file, only: hdf5_file_t
  use sg_kinds, only: i4, i8, wp
  use sg_posix, only: make_directory, replace_file, write_file
  use sg_text, only: to_text
  implicit none
  private

  public :: snapshot_t, point_state_t, varied_property_t, history_t, snapshot_name

  !> A property of the points that the member varies, [np].
  type :: varied_property_t
    character(len=:), allocatable :: name, units
    real(wp), allocatable :: values(:)
  end type varied_property_t

  !> The points at one time; SI units, friction angle in degrees.
  type :: point_state_t
    integer :: step = 0
    real(wp) :: time = 0.0_wp
    !> [2, np]
    real(wp), allocatable :: position(:, :), velocity(:, :), displacement(:, :)
    !> [4, np]: xx, yy, zz, xy
    real(wp), allocatable :: stress(:, :)
    !> [np]
    real(wp), allocatable :: volume(:), friction_angle(:), plastic_strain(:)
    !> Those beside the friction angle.
    type(varied_property_t), allocatable :: varied(:)
    integer(i4), allocatable :: material(:)
  end type point_state_t

  !> One row for each time, n rows; energies in J/m, momentum in kg/s, angular momentum in kg m/s
  !> (per metre of width), centre of mass and fronts in m.
  type :: history_t
    !> [n]
    real(wp), allocatable :: time(:)
    real(wp), allocatable :: kinetic_energy(:), elastic_energy(:), potential_energy(:)
    real(wp), allocatable :: dissipated(:), angular_momentum(:)
    !> [2, n]
    real(wp), allocatable :: momentum(:, :), centre(:, :)
    !> [2, n] force of prescribed velocities on the material, N/m
    real(wp), allocatable :: reaction(:, :)
    !> [n] energy taken by plastic flow, damping and walls, J/m; energy_error is a share
    real(wp), allocatable :: plastic_work(:), damping_work(:), wall_work(:), energy_error(:)
    !> [n]
    real(wp), allocatable :: front_max(:), front_q995(:), height_max(:)
  end type history_t

  !> `open`, then any number of `add_state` and at most one `add_history`, then `close`.
  type :: snapshot_t
    private
    type(hdf5_file_t) :: file
    character(len=:), allocatable :: directory, name, grids
  contains
    procedure :: open
    procedure :: add_state
    procedure :: add_history
    procedure :: close
  end type snapshot_t

contains

  !> `snx_cov0.05_r000417`
  pure function snapshot_name(label, id) result(name)
    character(len=*), intent(in) :: label
    integer(i8), intent(in) :: id
    character(len=:), allocatable :: name
    character(len=20) :: digits

    if (id < 1000000_i8) then
      write (digits, '(i6.6)') id
    else
      write (digits, '(i0)') id
    end if
    name = trim(label)//'_r'//trim(digits)
  end function snapshot_name

  !> Begins the file of a member in `run_directory`/`folder`, which is made if need be.
  subroutine open (this, run_directory, folder, label, id, error)
    class(snapshot_t), intent(inout) :: this
    character(len=*), intent(in) :: run_directory, folder, label
    integer(i8), intent(in) :: id
    type(error_t), allocatable, intent(out) :: error

    this%directory = trim(run_directory)//'/'//folder//'/'
    this%name = snapshot_name(label, id)
    this%grids = ''
    call make_directory(this%directory, error)
    if (allocated(error)) return
    call this%file%create(this%directory//this%name//'.h5.new', error)
    if (allocated(error)) return
    call this%file%set('/', 'label', trim(label))
    call this%file%set('/', 'realization', id)
  end subroutine open

  subroutine add_state(this, state)
    class(snapshot_t), intent(inout) :: this
    type(point_state_t), intent(in) :: state
    character(len=20) :: digits
    character(len=:), allocatable :: group
    integer :: k

    write (digits, '(i0)') state%step
    if (state%step < 1000000) write (digits, '(i6.6)') state%step
    group = '/step_'//trim(digits)
    call this%file%make_group(group)
    call this%file%write_scalar(group//'/time', state%time, 's')
    call this%file%write(group//'/position', state%position, 'm')
    call this%file%write(group//'/velocity', state%velocity, 'm/s')
    call this%file%write(group//'/displacement', state%displacement, 'm')
    call this%file%write(group//'/stress', state%stress, 'Pa')
    call this%file%write(group//'/volume', state%volume, 'm2')
    call this%file%write(group//'/material', state%material, '1')
    call this%file%write(group//'/friction_angle', state%friction_angle, 'degree')
    call this%file%write(group//'/plastic_strain', state%plastic_strain, '1')
    do k = 1, size(state%varied)
      call this%file%write(group//'/'//state%varied(k)%name, state%varied(k)%values, &
        state%varied(k)%units)
    end do
    this%grids = this%grids//grid_text(this%name//'.h5', group, state)
  end subroutine add_state

  subroutine add_history(this, history)
    class(snapshot_t), intent(inout) :: this
    type(history_t), intent(in) :: history

    call this%file%make_group('/history')
    call this%file%write('/history/time', history%time, 's')
    call this%file%write('/history/kinetic_energy', history%kinetic_energy, 'J/m')
    call this%file%write('/history/elastic_energy', history%elastic_energy, 'J/m')
    call this%file%write('/history/potential_energy', history%potential_energy, 'J/m')
    call this%file%write('/history/dissipated', history%dissipated, 'J/m')
    call this%file%write('/history/plastic_work', history%plastic_work, 'J/m')
    call this%file%write('/history/damping_work', history%damping_work, 'J/m')
    call this%file%write('/history/wall_work', history%wall_work, 'J/m')
    call this%file%write('/history/energy_error', history%energy_error, '1')
    call this%file%write('/history/reaction', history%reaction, 'N/m')
    call this%file%write('/history/momentum', history%momentum, 'kg/s')
    call this%file%write('/history/angular_momentum', history%angular_momentum, 'kg m/s')
    call this%file%write('/history/centre', history%centre, 'm')
    call this%file%write('/history/front_max', history%front_max, 'm')
    call this%file%write('/history/front_q995', history%front_q995, 'm')
    call this%file%write('/history/height_max', history%height_max, 'm')
  end subroutine add_history

  !> Puts the finished files in their place; `error` tells the first write that failed.
  subroutine close (this, error)
    class(snapshot_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error

    call this%file%close(error)
    if (allocated(error)) return
    call replace_file(this%directory//this%name//'.h5.new', this%directory//this%name//'.h5', error)
    if (allocated(error)) return
    call write_file(this%directory//this%name//'.xdmf', xdmf_text(this%grids), error)
  end subroutine close

  pure function xdmf_text(grids) result(text)
    character(len=*), intent(in) :: grids
    character(len=:), allocatable :: text

    text = '<?xml version="1.0" ?>'//new_line('a')// &
           '<Xdmf Version="3.0"><Domain>'//new_line('a')// &
           '<Grid Name="points" GridType="Collection" CollectionType="Temporal">'//new_line('a')// &
           grids//'</Grid></Domain></Xdmf>'//new_line('a')
  end function xdmf_text

  !> The points of one time as an XDMF grid of vertices. Arrays of several numbers a point are
  !> called vectors, whatever their number: of a matrix ParaView's XDMF reader makes a single row.
  pure function grid_text(file, group, state) result(text)
    character(len=*), intent(in) :: file, group
    type(point_state_t), intent(in) :: state
    character(len=:), allocatable :: text, number
    integer :: k

    number = to_text(size(state%volume))
    text = '<Grid Name="'//group(2:)//'" GridType="Uniform">'//new_line('a')// &
           '<Time Value="'//to_text(state%time)//'"/>'//new_line('a')// &
           '<Topology TopologyType="Polyvertex" NumberOfElements="'//number// &
           '" NodesPerElement="1"/>'//new_line('a')// &
           '<Geometry GeometryType="XY">'//item('position', number//' 2', 'Float')// &
           '</Geometry>'//new_line('a')// &
           attribute('velocity', number//' 2', 'Float')// &
           attribute('displacement', number//' 2', 'Float')// &
           attribute('stress', number//' 4', 'Float')// &
           attribute('volume', number, 'Float')// &
           attribute('material', number, 'Int')// &
           attribute('friction_angle', number, 'Float')// &
           attribute('plastic_strain', number, 'Float')
    do k = 1, size(state%varied)
      text = text//attribute(state%varied(k)%name, number, 'Float')
    end do
    text = text//'</Grid>'//new_line('a')

  contains

    pure function attribute(name, dimensions, kind) result(part)
      character(len=*), intent(in) :: name, dimensions, kind
      character(len=:), allocatable :: part
      character(len=:), allocatable :: form

      form = 'Scalar'
      if (index(dimensions, ' ') > 0) form = 'Vector'
      part = '<Attribute Name="'//name//'" AttributeType="'//form//'" Center="Node">'// &
             item(name, dimensions, kind)//'</Attribute>'//new_line('a')
    end function attribute

    pure function item(name, dimensions, kind) result(part)
      character(len=*), intent(in) :: name, dimensions, kind
      character(len=:), allocatable :: part
      character(len=1) :: bytes

      bytes = merge('8', '4', kind == 'Float')
      part = '<DataItem Format="HDF" NumberType="'//kind//'" Precision="'//bytes// &
             '" Dimensions="'//dimensions//'">'//file//':'//group//'/'//name//'</DataItem>'
    end function item
  end function grid_text
end module sg_snapshot
