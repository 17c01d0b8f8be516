!> Material points from a CSV file: the shape 'points'.
module sg_point_file
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_kinds, only: wp
  use sg_number_table, only: number_table_t, read_number_table
  implicit none
  private

  public :: read_point_file

  character(len=*), parameter :: HEADINGS(2) = [character(len=22) :: 'x,y,width,height', &
    'x,y,width,height,vx,vy']

contains

  !> Reads points (m, m/s); velocities that the file has not got are 0. All have the same width and
  !> height, as one body needs. What is wrong is told with file and line.
  subroutine read_point_file(path, x, y, width, height, vx, vy, error)
    character(len=*), intent(in) :: path
    real(wp), allocatable, intent(out) :: x(:), y(:), vx(:), vy(:)
    real(wp), intent(out) :: width, height
    type(error_t), allocatable, intent(out) :: error
    type(number_table_t) :: table
    integer :: k

    width = 0.0_wp
    height = 0.0_wp
    call read_number_table(path, HEADINGS, table, error)
    if (allocated(error)) return
    if (size(table%line) == 0) then
      call raise(error, EXIT_BAD_INPUT, path//': there are no points', 'read_point_file')
      return
    end if
    associate (values => table%values)
      do k = 1, size(values, 2)
        if (.not. all(values(3:4, k) > 0.0_wp)) then
          call raise(error, EXIT_BAD_INPUT, table%fault(k, 'width and height must be above 0'), &
            'read_point_file')
        else if (any(abs(values(3:4, k) - values(3:4, 1)) > 0.0_wp)) then
          call raise(error, EXIT_BAD_INPUT, table%fault(k, 'all points of a body have the same '// &
            'width and height (use a body for each)'), 'read_point_file')
        end if
        if (allocated(error)) return
      end do
      x = values(1, :)
      y = values(2, :)
      width = values(3, 1)
      height = values(4, 1)
      allocate (vx(size(x)), vy(size(x)), source=0.0_wp)
      if (table%heading == 2) then
        vx = values(5, :)
        vy = values(6, :)
      end if
    end associate
  end subroutine read_point_file
end module sg_point_file
