!> Exact fields on an evenly spaced lattice by circulant embedding (Dietrich and Newsam 1997). The
!> lattice is wrapped into a torus large enough that the correlation matrix of its sites is
!> positive; its eigenvectors are those of the Hartley transform H, cas(k x) = cos(k x) + sin(k x),
!> so a field is X = H sqrt(Lambda/m) Xi, cut down to the lattice. With the real transform every
!> white noise number serves the one field; a complex one would draw twice as many and throw half
!> away.
!>
!> A product of functions of x and y has a torus of two rings, whose lengths are found one by one;
!> its transform is a product, too: cas(k x) cas(l y). Any other correlation takes cas(k x + l y).
module sg_circulant_sampler
  use sg_available_memory, only: require_memory
  use sg_correlation, only: correlation_t
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_fourier, only: hartley_transform_t
  use sg_gaussian_sampler, only: gaussian_sampler_t
  use sg_kinds, only: i8, wp
  use sg_lattice, only: find_spacing, lattice_t
  use sg_text, only: to_text
  implicit none
  private

  public :: circulant_sampler_t, circulant_memory, find_ring_spectrum, smallest_torus

  !> Doublings of the smallest ring that are tried.
  integer, parameter :: MOST_DOUBLINGS = 4
  !> Negative eigenvalues down to this share of the largest are rounding (the transform of a ring
  !> of m numbers errs by about epsilon log2(m) of the largest result) and count as zero.
  real(wp), parameter :: ROUNDING = 100.0_wp*epsilon(1.0_wp)

  type, extends(gaussian_sampler_t) :: circulant_sampler_t
    private
    type(hartley_transform_t) :: transform
    !> Square roots of the eigenvalues over the number of sites: [m_x, m_y].
    real(wp), allocatable :: root(:, :)
    !> Place of each point on the rings, [n].
    integer, allocatable :: place_x(:), place_y(:)
    !> The same of each measurement.
    integer, allocatable :: seen_x(:), seen_y(:)
    !> First site and spacing along x and y, in m, and number of sites.
    real(wp) :: corner(2), spacing(2)
    integer :: sites(2)
  contains
    procedure :: init
    procedure :: sample
    procedure :: observe
    procedure :: observed
    procedure :: overlap
    procedure, private :: field_on_torus
  end type circulant_sampler_t

contains

  subroutine init(this, correlation, lattice, error)
    class(circulant_sampler_t), intent(out) :: this
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: place_x(:), place_y(:)

    this%correlation = correlation
    allocate (this%jitters(0))
    call place_axis(lattice%x, 'x', this%spacing(1), place_x, error)
    if (allocated(error)) return
    call place_axis(lattice%y, 'y', this%spacing(2), place_y, error)
    if (allocated(error)) return
    this%corner = [lattice%x(1), lattice%y(1)]
    this%sites = [maxval(place_x), maxval(place_y)]
    this%place_x = place_x(lattice%column)
    this%place_y = place_y(lattice%row)
    if (correlation%is_product()) then
      call embed_product(correlation, this%sites, this%spacing, this%root, error)
    else
      call embed_plane(correlation, this%sites, this%spacing, size(lattice%column), this%root, &
        error)
    end if
    if (allocated(error)) return
    this%ring = shape(this%root)
    this%noise_count = size(this%root)
    this%memory = circulant_memory(this%ring(1), this%ring(2), size(this%place_x))
    call require_memory(this%memory, "method='circulant' with rings of "// &
      to_text(this%ring(1))//' x '//to_text(this%ring(2))//' sites', &
      "use method='kronecker'", error)
    if (allocated(error)) return
    call this%transform%init(this%ring(1), this%ring(2), error)
    if (allocated(error)) return
    this%method = 'circulant'
    this%description = 'circulant: '//to_text(size(lattice%x))//' x '//to_text(size(lattice%y))// &
      ' sites embedded in rings of '//to_text(this%ring(1))//' x '// &
      to_text(this%ring(2))
  end subroutine init

  !> Bytes for rings of m_x and m_y sites: noise, its transform, the roots, the sites of n points.
  pure function circulant_memory(m_x, m_y, n) result(bytes)
    integer, intent(in) :: m_x, m_y, n
    integer(i8) :: bytes

    bytes = 24*int(m_x, i8)*m_y + 8*int(n, i8)
  end function circulant_memory

  !> Lengths of the smallest rings for so many sites along x and y. Around a ring of 2 (sites - 1)
  !> the longest lag comes from both sides at once, which a correlation that knows left from right
  !> does not allow.
  pure function smallest_torus(correlation, sites) result(ring)
    type(correlation_t), intent(in) :: correlation
    integer, intent(in) :: sites(2)
    integer :: ring(2)

    ring = max(2*(sites - 1), 1)
    if (.not. correlation%is_product()) ring = 2*sites
  end function smallest_torus

  !> Spacing and places of the coordinates of one axis, which must be even.
  subroutine place_axis(coordinates, axis, spacing, place, error)
    real(wp), intent(in) :: coordinates(:)
    character, intent(in) :: axis
    real(wp), intent(out) :: spacing
    integer, allocatable, intent(out) :: place(:)
    type(error_t), allocatable, intent(out) :: error

    call find_spacing(coordinates, spacing, place)
    if (spacing < 0.0_wp) call raise(error, EXIT_BAD_INPUT, "method='circulant' needs evenly "// &
      'spaced points, those along '//axis//" are not: use method='kronecker' or 'cholesky'", &
      'circulant_sampler')
  end subroutine place_axis

  !> The shortest ring with a positive spectrum along each axis: 2 (sites - 1) sites, doubled while
  !> it is not.
  subroutine embed_product(correlation, sites, spacing, root, error)
    type(correlation_t), intent(in) :: correlation
    integer, intent(in) :: sites(2)
    real(wp), intent(in) :: spacing(2)
    !> [m_x, m_y]: sqrt(eigenvalue/(m_x m_y)).
    real(wp), allocatable, intent(out) :: root(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: root_x(:), root_y(:)
    integer :: shortest(2), j

    shortest = smallest_torus(correlation, sites)
    call embed_axis(correlation, 1, shortest(1), spacing(1), root_x, error)
    if (allocated(error)) return
    call embed_axis(correlation, 2, shortest(2), spacing(2), root_y, error)
    if (allocated(error)) return
    call require_memory(circulant_memory(size(root_x), size(root_y), 0), &
      "method='circulant' with rings of "//to_text(size(root_x))//' x '// &
      to_text(size(root_y))//' sites', "use method='kronecker'", error)
    if (allocated(error)) return
    allocate (root(size(root_x), size(root_y)))
    do j = 1, size(root_y)
      root(:, j) = root_x*root_y(j)
    end do
  end subroutine embed_product

  subroutine embed_axis(correlation, axis, shortest, spacing, root, error)
    type(correlation_t), intent(in) :: correlation
    integer, intent(in) :: axis, shortest
    real(wp), intent(in) :: spacing
    !> [m]: sqrt(eigenvalue/m).
    real(wp), allocatable, intent(out) :: root(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: spectrum(:)
    real(wp) :: least
    integer :: doublings, length

    do doublings = 0, MOST_DOUBLINGS
      length = shortest*2**doublings
      call find_ring_spectrum(correlation, axis, length, spacing, spectrum, error)
      if (allocated(error)) return
      if (doublings == 0) least = minval(spectrum)
      if (minval(spectrum) >= -ROUNDING*maxval(spectrum)) then
        root = sqrt(max(spectrum, 0.0_wp)/length)
        return
      end if
    end do
    call refuse(correlation, 'along '//merge('x', 'y', axis == 1), to_text(shortest), &
      to_text(length), least, minval(spectrum), &
      "use method='kronecker', or a smaller scale of fluctuation", error)
  end subroutine embed_axis

  subroutine refuse(correlation, where, shortest, longest, least, last, advice, error)
    type(correlation_t), intent(in) :: correlation
    character(len=*), intent(in) :: where, shortest, longest, advice
    !> Smallest eigenvalues for the shortest and the longest rings.
    real(wp), intent(in) :: least, last
    type(error_t), allocatable, intent(out) :: error

    call raise(error, EXIT_BAD_INPUT, "method='circulant' cannot embed "// &
      trim(correlation%acf%name)//' '//where//': rings of '//shortest//' to '//longest// &
      ' sites have eigenvalues down to '//to_text(least, 3)//' and '//to_text(last, 3)// &
      ': '//advice, 'circulant_sampler')
  end subroutine refuse

  !> Eigenvalues [length] of the correlation matrix of a ring of equal steps of `spacing` metres
  !> along an axis; the lag is the shorter way round.
  subroutine find_ring_spectrum(correlation, axis, length, spacing, spectrum, error)
    type(correlation_t), intent(in) :: correlation
    integer, intent(in) :: axis, length
    real(wp), intent(in) :: spacing
    real(wp), allocatable, intent(out) :: spectrum(:)
    type(error_t), allocatable, intent(out) :: error
    type(hartley_transform_t) :: transform
    real(wp), allocatable :: ring(:, :), eigenvalues(:, :)
    integer :: i

    allocate (ring(length, 1), eigenvalues(length, 1))
    do i = 1, length
      ring(i, 1) = correlation%along(axis, min(i - 1, length - i + 1)*spacing)
    end do
    call transform%init(length, 1, error)
    if (allocated(error)) return
    call transform%execute(ring, eigenvalues, error)
    if (allocated(error)) return
    spectrum = eigenvalues(:, 1)
  end subroutine find_ring_spectrum

  !> The same for a correlation that is no product: both rings are doubled together.
  subroutine embed_plane(correlation, sites, spacing, points, root, error)
    type(correlation_t), intent(in) :: correlation
    integer, intent(in) :: sites(2), points
    real(wp), intent(in) :: spacing(2)
    real(wp), allocatable, intent(out) :: root(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: torus(:, :), spectrum(:, :)
    type(hartley_transform_t) :: transform
    real(wp) :: least
    integer :: doublings, ring(2), shortest(2), k, l

    shortest = smallest_torus(correlation, sites)
    do doublings = 0, MOST_DOUBLINGS
      ring = shortest*2**doublings
      call require_memory(circulant_memory(ring(1), ring(2), points), "method='circulant' with "// &
        'rings of '//to_text(ring(1))//' x '//to_text(ring(2))//' sites', 'use '// &
        "method='cholesky', fewer points or a smaller scale of fluctuation", error)
      if (allocated(error)) return
      if (allocated(torus)) deallocate (torus, spectrum)
      allocate (torus(ring(1), ring(2)), spectrum(ring(1), ring(2)))
      call fill_torus(correlation, spacing, torus)
      call transform%init(ring(1), ring(2), error)
      if (allocated(error)) return
      call transform%execute(torus, spectrum, error)
      if (allocated(error)) return
      if (doublings == 0) least = minval(spectrum)
      if (minval(spectrum) < -ROUNDING*maxval(spectrum)) cycle
      ! sum c cas(k x) cas(l y) = sum c cos(k x - l y), as c(-x, -y) = c(x, y).
      allocate (root(ring(1), ring(2)))
      do l = 1, ring(2)
        do k = 1, ring(1)
          root(k, l) = sqrt(max(spectrum(k, opposite(l, ring(2))), 0.0_wp)/size(root))
        end do
      end do
      return
    end do
    call refuse(correlation, 'in the plane', to_text(shortest(1))//' x '//to_text(shortest(2)), &
      to_text(ring(1))//' x '//to_text(ring(2)), least, minval(spectrum), &
      "use method='cholesky', or a smaller scale of fluctuation", error)
  end subroutine embed_plane

  !> Correlation of the first site of a torus with all others, the shorter way round; half way
  !> round, where both ways are as long, the mean of the two.
  pure subroutine fill_torus(correlation, spacing, torus)
    type(correlation_t), intent(in) :: correlation
    real(wp), intent(in) :: spacing(2)
    real(wp), intent(out) :: torus(:, :)
    real(wp) :: there(2), back(2)
    integer :: i, j

    do j = 1, size(torus, 2)
      call lags(j - 1, size(torus, 2), there(2), back(2))
      do i = 1, size(torus, 1)
        call lags(i - 1, size(torus, 1), there(1), back(1))
        torus(i, j) = 0.25_wp*(correlation%at(there(1)*spacing(1), there(2)*spacing(2)) &
          + correlation%at(back(1)*spacing(1), there(2)*spacing(2)) &
          + correlation%at(there(1)*spacing(1), back(2)*spacing(2)) &
          + correlation%at(back(1)*spacing(1), back(2)*spacing(2)))
      end do
    end do

  contains

    pure subroutine lags(steps, length, there, back)
      integer, intent(in) :: steps, length
      real(wp), intent(out) :: there, back

      there = steps
      if (2*steps > length) there = steps - length
      back = there
      if (2*steps == length) back = -there
    end subroutine lags
  end subroutine fill_torus

  !> Position of the wave number that is the negative of the one at position k on a ring of m.
  pure integer function opposite(k, m)
    integer, intent(in) :: k, m

    opposite = modulo(1 - k, m) + 1
  end function opposite

  subroutine sample(this, noise, z, error)
    class(circulant_sampler_t), intent(in) :: this
    real(wp), contiguous, intent(inout) :: noise(:, :)
    real(wp), contiguous, intent(out) :: z(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: torus(:, :)
    integer :: member, i

    allocate (torus(this%ring(1), this%ring(2)))
    do member = 1, size(z, 2)
      call this%field_on_torus(noise(:, member), torus, error)
      if (allocated(error)) return
      do i = 1, size(z, 1)
        z(i, member) = at_site(this, torus, this%place_x(i), this%place_y(i))
      end do
    end do
  end subroutine sample

  !> The Hartley transform, product of those of the axes, of the noise under the roots.
  subroutine field_on_torus(this, noise, torus, error)
    class(circulant_sampler_t), intent(in) :: this
    real(wp), intent(inout) :: noise(this%ring(1), this%ring(2))
    real(wp), contiguous, intent(out) :: torus(:, :)
    type(error_t), allocatable, intent(out) :: error

    noise = noise*this%root
    call this%transform%execute(noise, torus, error)
  end subroutine field_on_torus

  !> The field at a site; of cas(k x + l y) out of the transforms with cas(+-k x) cas(+-l y).
  pure function at_site(this, torus, i, j) result(z)
    class(circulant_sampler_t), intent(in) :: this
    real(wp), intent(in) :: torus(:, :)
    integer, intent(in) :: i, j
    real(wp) :: z
    integer :: i_back, j_back

    if (this%correlation%is_product()) then
      z = torus(i, j)
      return
    end if
    i_back = opposite(i, this%ring(1))
    j_back = opposite(j, this%ring(2))
    z = 0.5_wp*(torus(i, j) + torus(i_back, j) + torus(i, j_back) - torus(i_back, j_back))
  end function at_site

  !> Measurements are moved to the nearest site, where the field is known.
  subroutine observe(this, x, y)
    class(circulant_sampler_t), intent(inout) :: this
    real(wp), intent(inout) :: x(:), y(:)

    this%seen_x = nearest_sites(x, 1)
    this%seen_y = nearest_sites(y, 2)
    x = this%corner(1) + (this%seen_x - 1)*this%spacing(1)
    y = this%corner(2) + (this%seen_y - 1)*this%spacing(2)
    allocate (this%remainder(size(x), 0))

  contains

    pure function nearest_sites(places, axis) result(sites)
      real(wp), intent(in) :: places(:)
      integer, intent(in) :: axis
      integer :: sites(size(places))

      sites = 1
      if (this%spacing(axis) > 0.0_wp) sites = min(max(1 + nint((places - this%corner(axis)) &
        /this%spacing(axis)), 1), this%sites(axis))
    end function nearest_sites
  end subroutine observe

  subroutine observed(this, noise, extra, z, error)
    class(circulant_sampler_t), intent(in) :: this
    real(wp), contiguous, intent(in) :: noise(:)
    real(wp), intent(in) :: extra(:)
    real(wp), intent(out) :: z(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: torus(:, :), copy(:)
    integer :: d

    allocate (torus(this%ring(1), this%ring(2)))
    copy = noise
    call this%field_on_torus(copy, torus, error)
    if (allocated(error)) return
    z = [(at_site(this, torus, this%seen_x(d), this%seen_y(d)), d=1, size(z))]
    z = z + matmul(this%remainder, extra(:size(this%remainder, 2)))
  end subroutine observed

  function overlap(this, other) result(rho)
    class(circulant_sampler_t), intent(in) :: this
    class(gaussian_sampler_t), intent(in) :: other
    real(wp) :: rho

    rho = 0.0_wp
    select type (other)
    class is (circulant_sampler_t)
      if (all(this%ring == other%ring)) rho = sum(this%root*other%root)
    end select
  end function overlap
end module sg_circulant_sampler
