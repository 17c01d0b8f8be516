!> Importance sampling of a Gaussian field: its white noise w, z = A w, is shifted along u = A^T a/
!> |A^T a|, a = 1/n for each of the n points, by `shift` standard deviations of the mean of z: the
!> direction in which a^T z grows most (Au & Beck 1999, for a linear limit state). So z is
!> shifted by shift C a/s with s^2 = a^T C a, and a member weighs exp(-shift a^T z/s - shift^2/2),
!> z before the shift.
module sg_tilt
  use sg_correlation, only: correlation_t
  use sg_kinds, only: wp
  use sg_lattice, only: find_spacing, lattice_t
  implicit none
  private

  public :: tilt_t

  type :: tilt_t
    private
    real(wp) :: shift = 0.0_wp
    !> C a/s at the points, [n], and s; allocated if there is a shift.
    real(wp), allocatable :: direction(:)
    real(wp) :: sd_of_mean = 1.0_wp
  contains
    procedure :: aim
    procedure :: apply
  end type tilt_t

contains

  !> Of a field with this correlation at the points (x, y), in m. Without a shift nothing is done.
  subroutine aim(this, shift, correlation, x, y)
    class(tilt_t), intent(out) :: this
    !> In standard deviations of the mean.
    real(wp), intent(in) :: shift
    type(correlation_t), intent(in) :: correlation
    real(wp), intent(in) :: x(:), y(:)

    this%shift = shift
    if (.not. abs(shift) > 0.0_wp) return
    this%direction = sums_of_rows(correlation, x, y)/size(x)
    this%sd_of_mean = sqrt(sum(this%direction)/size(x))
    this%direction = this%direction/this%sd_of_mean
  end subroutine aim

  !> Shifts a realization z; `log_weight` is the logarithm of its likelihood ratio, 0 without a
  !> shift.
  pure subroutine apply(this, z, log_weight)
    class(tilt_t), intent(in) :: this
    real(wp), intent(inout) :: z(:)
    real(wp), intent(out) :: log_weight

    log_weight = 0.0_wp
    if (.not. allocated(this%direction)) return
    log_weight = -this%shift*sum(z)/size(z)/this%sd_of_mean - 0.5_wp*this%shift**2
    z = z + this%shift*this%direction
  end subroutine apply

  !> Sums of the rows of the covariance matrix. On an even lattice without empty sites the
  !> correlation is asked for once for each displacement, elsewhere for each pair of points.
  function sums_of_rows(correlation, x, y) result(sums)
    type(correlation_t), intent(in) :: correlation
    real(wp), intent(in) :: x(:), y(:)
    real(wp) :: sums(size(x))
    type(lattice_t) :: lattice
    real(wp), allocatable :: total(:, :)
    integer :: i, j, nx, ny

    call lattice%init(x, y)
    nx = size(lattice%x)
    ny = size(lattice%y)
    if (size(x) /= nx*ny .or. .not. (is_even(lattice%x) .and. is_even(lattice%y))) then
      do i = 1, size(x)
        sums(i) = sum([(correlation%at(x(i) - x(j), y(i) - y(j)), j=1, size(x))])
      end do
      return
    end if
    ! total(i, j): of displacements from (-(nx - 1), -(ny - 1)) to (i, j) in steps of the lattice; a
    ! row is the sum over a window of nx x ny displacements.
    allocate (total(-nx:nx - 1, -ny:ny - 1))
    total(-nx, :) = 0.0_wp
    total(:, -ny) = 0.0_wp
    do j = 1 - ny, ny - 1
      do i = 1 - nx, nx - 1
        total(i, j) = total(i - 1, j) + total(i, j - 1) - total(i - 1, j - 1) &
          + correlation%at(step(lattice%x, i), step(lattice%y, j))
      end do
    end do
    do i = 1, size(x)
      associate (c => lattice%column(i), r => lattice%row(i))
        sums(i) = total(c - 1, r - 1) - total(c - 1 - nx, r - 1) - total(c - 1, r - 1 - ny) &
          + total(c - 1 - nx, r - 1 - ny)
      end associate
    end do
  end function sums_of_rows

  !> Whether coordinates, ascending, are evenly spaced without gaps.
  pure logical function is_even(row)
    real(wp), intent(in) :: row(:)
    integer, allocatable :: place(:)
    real(wp) :: spacing

    call find_spacing(row, spacing, place)
    is_even = spacing >= 0.0_wp .and. place(size(row)) == size(row)
  end function is_even

  !> Displacement by `number` places of an even row.
  pure real(wp) function step(row, number)
    real(wp), intent(in) :: row(:)
    integer, intent(in) :: number

    step = 0.0_wp
    if (size(row) > 1) step = number*(row(size(row)) - row(1))/(size(row) - 1)
  end function step
end module sg_tilt
