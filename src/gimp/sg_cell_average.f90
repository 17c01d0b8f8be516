!> The remedy for volumetric locking: the volumetric strain rate of a point is the mean over its
!> cell, and so is the pressure in the plane that its forces come from, both weighted by volume: the
!> two are conjugate, so that forces do the work that strains receive. (Cell-based averaging as in
!> Mast, Mackenzie-Helnwein, Arduino, Miller & Shin 2012; the correction is shared by the two
!> directions of the plane, so that plane strain stays exact.)
module sg_cell_average
  use sg_kinds, only: wp
  use sg_weighting, only: axis_t
  implicit none
  private

  public :: cell_average_t

  type :: cell_average_t
    private
    type(axis_t) :: x, y
    !> Sum of volume times quantity, and of volume: [2, cells along x, cells along y].
    real(wp), allocatable :: total(:, :, :)
  contains
    procedure :: clear
    procedure :: add
    procedure :: mean
  end type cell_average_t

contains

  !> Begins anew on the grid with these axes.
  subroutine clear(this, x, y)
    class(cell_average_t), intent(inout) :: this
    type(axis_t), intent(in) :: x, y

    this%x = x
    this%y = y
    if (.not. allocated(this%total)) allocate (this%total(2, 0:x%last, 0:y%last))
    this%total = 0.0_wp
  end subroutine clear

  !> Adds `n` points at (x, y), m, of `volume`, m^2, with their `quantity`: those in the rows of
  !> cells rows(1) to rows(2).
  pure subroutine add(this, n, x, y, volume, quantity, rows)
    class(cell_average_t), intent(inout) :: this
    integer, intent(in) :: n, rows(2)
    real(wp), intent(in) :: x(n), y(n), volume(n), quantity(n)
    integer :: p, i, j

    do p = 1, n
      i = cell_of(x(p), this%x)
      j = cell_of(y(p), this%y)
      if (j < rows(1) .or. j > rows(2)) cycle
      this%total(:, i, j) = this%total(:, i, j) + volume(p)*[quantity(p), 1.0_wp]
    end do
  end subroutine add

  !> Means of the cells that the points lie in; these points have been added.
  pure function mean(this, n, x, y)
    class(cell_average_t), intent(in) :: this
    integer, intent(in) :: n
    real(wp), intent(in) :: x(n), y(n)
    real(wp) :: mean(n)
    integer :: p, i, j

    do p = 1, n
      i = cell_of(x(p), this%x)
      j = cell_of(y(p), this%y)
      mean(p) = this%total(1, i, j)/this%total(2, i, j)
    end do
  end function mean

  !> Cell of a position, held within the grid.
  pure function cell_of(position, axis) result(cell)
    real(wp), intent(in) :: position
    type(axis_t), intent(in) :: axis
    integer :: cell
    cell = floor(min(max((position - axis%origin)*axis%inverse_cell, 0.0_wp), real(axis%last, wp)))
  end function cell_of
end module sg_cell_average
