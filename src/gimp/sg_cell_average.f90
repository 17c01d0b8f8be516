!> The remedy for volumetric locking: the volumetric strain rate of a point is the mean over its cell,
!> weighted by volume (selective smoothing as in Mast, Mackenzie-Helnwein, Arduino, Miller & Shin
!> 2012, here of the strain only). The correction is spread over the two strains of the plane, so that
!> plane strain stays exact.
module sg_cell_average
  use sg_kinds, only: wp
  use sg_weighting, only: axis_t, BLOCK
  implicit none
  private

  public :: cell_average_t

  type :: cell_average_t
    private
    type(axis_t) :: x, y
    !> Sum of volume times rate, and of volume: [2, cells along x, cells along y].
    real(wp), allocatable :: total(:, :, :)
  contains
    procedure :: clear
    procedure :: add
    procedure :: replace_divergence
  end type cell_average_t

contains

  subroutine clear(this, x, y)
    class(cell_average_t), intent(inout) :: this
    type(axis_t), intent(in) :: x, y

    this%x = x
    this%y = y
    if (.not. allocated(this%total)) allocate (this%total(2, 0:x%last, 0:y%last))
    this%total = 0.0_wp
  end subroutine clear

  !> Adds points with the velocity gradient(:, p) = (d vx/dx, d vy/dx, d vx/dy, d vy/dy), 1/s.
  pure subroutine add(this, n, x, y, volume, gradient)
    class(cell_average_t), intent(inout) :: this
    integer, intent(in) :: n
    !> m, m, m^2
    real(wp), intent(in) :: x(n), y(n), volume(n)
    real(wp), intent(in) :: gradient(4, BLOCK)
    integer :: p, i, j

    do p = 1, n
      i = cell_of(x(p), this%x)
      j = cell_of(y(p), this%y)
      this%total(:, i, j) = this%total(:, i, j) + volume(p)*[gradient(1, p) + gradient(4, p), &
        1.0_wp]
    end do
  end subroutine add

  !> Gives the gradients of the points the divergence of their cells.
  pure subroutine replace_divergence(this, n, x, y, gradient)
    class(cell_average_t), intent(in) :: this
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), y(n)
    real(wp), intent(inout) :: gradient(4, BLOCK)
    real(wp) :: change
    integer :: p, i, j

    do p = 1, n
      i = cell_of(x(p), this%x)
      j = cell_of(y(p), this%y)
      change = 0.5_wp*(this%total(1, i, j)/this%total(2, i, j) - gradient(1, p) - gradient(4, p))
      gradient(1, p) = gradient(1, p) + change
      gradient(4, p) = gradient(4, p) + change
    end do
  end subroutine replace_divergence

  !> Cell of a position, held within the grid.
  pure function cell_of(position, axis) result(cell)
    real(wp), intent(in) :: position
    type(axis_t), intent(in) :: axis
    integer :: cell
    cell = min(max(floor((position - axis%origin)*axis%inverse_cell), 0), axis%last)
  end function cell_of
end module sg_cell_average
