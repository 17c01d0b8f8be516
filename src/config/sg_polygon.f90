!> Whether a list of corners is a polygon that can be filled.
module sg_polygon
  use sg_kinds, only: wp
  implicit none
  private

  public :: corners_are_distinct, polygon_area, polygon_contains, polygon_is_simple

  !> Corners, and sides, nearer than this share of the polygon's size count as touching.
  real(wp), parameter :: TOUCH = 1.0e-9_wp

contains

  !> Numbers of the first two corners that are the same point, or 0.
  pure subroutine corners_are_distinct(corners, first, second)
    !> (2, n)
    real(wp), intent(in) :: corners(:, :)
    integer, intent(out) :: first, second
    integer :: i, j

    do j = 2, size(corners, 2)
      do i = 1, j - 1
        if (all(abs(corners(:, i) - corners(:, j)) <= TOUCH*extent(corners))) then
          first = i
          second = j
          return
        end if
      end do
    end do
    first = 0
    second = 0
  end subroutine corners_are_distinct

  pure real(wp) function extent(corners)
    real(wp), intent(in) :: corners(:, :)
    extent = maxval(maxval(corners, dim=2) - minval(corners, dim=2))
  end function extent

  !> Is (x, y) in the polygon? By the number of edges crossed to the right (even-odd rule).
  pure logical function polygon_contains(vertices, x, y) result(inside)
    !> x1, y1, x2, y2, ...
    real(wp), intent(in) :: vertices(:)
    real(wp), intent(in) :: x, y
    real(wp) :: x1, y1, x2, y2
    integer :: k, corners

    inside = .false.
    corners = size(vertices)/2
    do k = 1, corners
      x1 = vertices(2*k - 1)
      y1 = vertices(2*k)
      x2 = vertices(2*mod(k, corners) + 1)
      y2 = vertices(2*mod(k, corners) + 2)
      if ((y1 > y) .eqv. (y2 > y)) cycle
      if (x < x1 + (y - y1)/(y2 - y1)*(x2 - x1)) inside = .not. inside
    end do
  end function polygon_contains

  !> Area without sign; 0 if it is no more than rounding.
  pure real(wp) function polygon_area(corners) result(area)
    real(wp), intent(in) :: corners(:, :)
    real(wp) :: a(2), b(2)
    integer :: i, n

    n = size(corners, 2)
    area = 0.0_wp
    do i = 2, n - 1
      a = corners(:, i) - corners(:, 1)
      b = corners(:, i + 1) - corners(:, 1)
      area = area + 0.5_wp*cross(a, b)
    end do
    area = abs(area)
    if (area <= TOUCH*extent(corners)**2) area = 0.0_wp
  end function polygon_area

  pure real(wp) function cross(a, b)
    real(wp), intent(in) :: a(2), b(2)
    cross = a(1)*b(2) - a(2)*b(1)
  end function cross

  !> Numbers of two sides that cross or touch without being neighbours, or that are neighbours and
  !> fold back; 0 if there are none. Side i goes from corner i to the next one.
  pure subroutine polygon_is_simple(corners, first, second)
    !> (2, n), distinct
    real(wp), intent(in) :: corners(:, :)
    integer, intent(out) :: first, second
    integer :: i, j, n
    logical :: bad

    n = size(corners, 2)
    do i = 1, n - 1
      do j = i + 1, n
        if (j == i + 1) then
          bad = folds_back(corners(:, i), corners(:, j), corners(:, 1 + mod(j, n)))
        else if (i == 1 .and. j == n) then
          bad = folds_back(corners(:, n), corners(:, 1), corners(:, 2))
        else
          bad = sides_meet(corners(:, i), corners(:, i + 1), corners(:, j), &
            corners(:, 1 + mod(j, n)), TOUCH*extent(corners)**2)
        end if
        if (bad) then
          first = i
          second = j
          return
        end if
      end do
    end do
    first = 0
    second = 0
  end subroutine polygon_is_simple

  !> The way a, b, c turns round by 180 degrees at b.
  pure logical function folds_back(a, b, c)
    real(wp), intent(in) :: a(2), b(2), c(2)
    real(wp) :: u(2), v(2)

    u = b - a
    v = c - b
    folds_back = abs(cross(u, v)) <= TOUCH*norm2(u)*norm2(v) .and. dot_product(u, v) < 0.0_wp
  end function folds_back

  !> Segments a-b and c-d have a point in common.
  pure logical function sides_meet(a, b, c, d, small)
    real(wp), intent(in) :: a(2), b(2), c(2), d(2)
    !> Areas below this count as 0.
    real(wp), intent(in) :: small
    integer :: abc, abd, cda, cdb

    abc = side_of(cross(b - a, c - a), small)
    abd = side_of(cross(b - a, d - a), small)
    cda = side_of(cross(d - c, a - c), small)
    cdb = side_of(cross(d - c, b - c), small)
    sides_meet = (abc*abd < 0 .and. cda*cdb < 0) .or. &
      (abc == 0 .and. is_between(c, a, b)) .or. (abd == 0 .and. is_between(d, a, b)) .or. &
      (cda == 0 .and. is_between(a, c, d)) .or. (cdb == 0 .and. is_between(b, c, d))
  end function sides_meet

  pure integer function side_of(area, small)
    real(wp), intent(in) :: area, small
    side_of = 0
    if (area > small) side_of = 1
    if (area < -small) side_of = -1
  end function side_of

  !> Point p, known to lie on the line through a and b, lies in the box of a and b.
  pure logical function is_between(p, a, b)
    real(wp), intent(in) :: p(2), a(2), b(2)
    is_between = all(p >= min(a, b)) .and. all(p <= max(a, b))
  end function is_between
end module sg_polygon
