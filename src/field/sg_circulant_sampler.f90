!> Exact fields on an evenly spaced lattice by circulant embedding (Dietrich and Newsam 1997). Each
!> axis is wrapped into a ring long enough that the correlation matrix of the ring is positive; its
!> eigenvectors are those of the Hartley transform H, so a field is
!> X = H_x sqrt(Lambda_x) Xi sqrt(Lambda_y) H_y / sqrt(m_x m_y), cut down to the lattice. With the
!> real transform every white noise number serves the one field; a complex one would draw twice as
!> many and throw half away.
module sg_circulant_sampler
  use sg_autocorrelation, only: autocorrelation_t
  use sg_available_memory, only: require_memory
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_fourier, only: hartley_transform_t
  use sg_gaussian_sampler, only: gaussian_sampler_t
  use sg_kinds, only: i8, wp
  use sg_lattice, only: find_spacing, lattice_t
  use sg_text, only: to_text
  use sg_white_noise, only: fill_white_noise
  implicit none
  private

  public :: circulant_sampler_t, circulant_memory, find_ring_spectrum

  !> Doublings of the smallest ring that are tried.
  integer, parameter :: MOST_DOUBLINGS = 4
  !> Negative eigenvalues down to this share of the largest are rounding (the transform of a ring
  !> of m numbers errs by about epsilon log2(m) of the largest result) and count as zero.
  real(wp), parameter :: ROUNDING = 100.0_wp*epsilon(1.0_wp)

  type, extends(gaussian_sampler_t) :: circulant_sampler_t
    private
    type(hartley_transform_t) :: transform
    !> Square roots of the eigenvalues over the length of the ring: [m_x], [m_y].
    real(wp), allocatable :: root_x(:), root_y(:)
    !> Place of each point on the rings, [n].
    integer, allocatable :: place_x(:), place_y(:)
  contains
    procedure :: init
    procedure :: sample
  end type circulant_sampler_t

contains

  subroutine init(this, acf, scale_x, scale_y, lattice, error)
    class(circulant_sampler_t), intent(out) :: this
    type(autocorrelation_t), intent(in) :: acf
    !> Scales of fluctuation in m.
    real(wp), intent(in) :: scale_x, scale_y
    type(lattice_t), intent(in) :: lattice
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: place(:)

    call embed_axis(acf, lattice%x, scale_x, 'x', this%root_x, place, error)
    if (allocated(error)) return
    this%place_x = place(lattice%column)
    call embed_axis(acf, lattice%y, scale_y, 'y', this%root_y, place, error)
    if (allocated(error)) return
    this%place_y = place(lattice%row)
    this%memory = circulant_memory(size(this%root_x), size(this%root_y), size(this%place_x))
    call require_memory(this%memory, "method='circulant' with rings of "// &
      to_text(size(this%root_x))//' x '//to_text(size(this%root_y))//' sites', &
      "use method='kronecker'", error)
    if (allocated(error)) return
    call this%transform%init(size(this%root_x), size(this%root_y), error)
    if (allocated(error)) return
    this%method = 'circulant'
    this%description = 'circulant: '//to_text(size(lattice%x))//' x '//to_text(size(lattice%y))// &
      ' sites embedded in rings of '//to_text(size(this%root_x))//' x '// &
      to_text(size(this%root_y))
  end subroutine init

  !> Bytes for rings of m_x and m_y sites: noise, its transform, the roots, the sites of n points.
  pure function circulant_memory(m_x, m_y, n) result(bytes)
    integer, intent(in) :: m_x, m_y, n
    integer(i8) :: bytes

    bytes = 16*int(m_x, i8)*m_y + 8*(int(m_x, i8) + m_y + n)
  end function circulant_memory

  !> The shortest ring with a positive spectrum: 2 (sites - 1) sites, doubled while it is not.
  subroutine embed_axis(acf, coordinates, scale, axis, root, place, error)
    type(autocorrelation_t), intent(in) :: acf
    real(wp), intent(in) :: coordinates(:), scale
    character, intent(in) :: axis
    !> [m]: sqrt(eigenvalue/m).
    real(wp), allocatable, intent(out) :: root(:)
    !> [size(coordinates)]: place on the ring.
    integer, allocatable, intent(out) :: place(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: spectrum(:)
    real(wp) :: spacing, least
    integer :: doublings, length, shortest

    call find_spacing(coordinates, spacing, place)
    if (spacing < 0.0_wp) then
      call raise(error, EXIT_BAD_INPUT, "method='circulant' needs evenly spaced points, those "// &
        'along '//axis//" are not: use method='kronecker'", 'circulant_sampler')
      return
    end if
    shortest = max(2*(maxval(place) - 1), 1)
    do doublings = 0, MOST_DOUBLINGS
      length = shortest*2**doublings
      call find_ring_spectrum(acf, length, spacing/scale, spectrum, error)
      if (allocated(error)) return
      if (doublings == 0) least = minval(spectrum)
      if (minval(spectrum) >= -ROUNDING*maxval(spectrum)) then
        root = sqrt(max(spectrum, 0.0_wp)/length)
        return
      end if
    end do
    call raise(error, EXIT_BAD_INPUT, "method='circulant' cannot embed "//acf%name//' along '// &
      axis//': rings of '//to_text(shortest)//' to '//to_text(length)//' sites have '// &
      'eigenvalues down to '//to_text(least, 3)//' and '//to_text(minval(spectrum), 3)// &
      ": use method='kronecker', or a smaller scale of fluctuation", 'circulant_sampler')
  end subroutine embed_axis

  !> Eigenvalues [length] of the correlation matrix of a ring of equal steps, `step` scales of
  !> fluctuation each; the lag is the shorter way round.
  subroutine find_ring_spectrum(acf, length, step, spectrum, error)
    type(autocorrelation_t), intent(in) :: acf
    integer, intent(in) :: length
    real(wp), intent(in) :: step
    real(wp), allocatable, intent(out) :: spectrum(:)
    type(error_t), allocatable, intent(out) :: error
    type(hartley_transform_t) :: transform
    real(wp), allocatable :: ring(:, :), eigenvalues(:, :)
    integer :: i

    allocate (ring(length, 1), eigenvalues(length, 1))
    do i = 1, length
      ring(i, 1) = acf%rho(min(i - 1, length - i + 1)*step)
    end do
    call transform%init(length, 1, error)
    if (allocated(error)) return
    call transform%execute(ring, eigenvalues, error)
    if (allocated(error)) return
    spectrum = eigenvalues(:, 1)
  end subroutine find_ring_spectrum

  subroutine sample(this, seed, stream, realization, z, error)
    class(circulant_sampler_t), intent(in) :: this
    integer(i8), intent(in) :: seed
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    real(wp), intent(out) :: z(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: noise(:, :), field(:, :)
    integer :: i, j

    allocate (noise(size(this%root_x), size(this%root_y)))
    allocate (field, mold=noise)
    call fill_white_noise(seed, stream, realization, noise)
    do j = 1, size(noise, 2)
      noise(:, j) = noise(:, j)*this%root_x*this%root_y(j)
    end do
    call this%transform%execute(noise, field, error)
    if (allocated(error)) return
    do i = 1, size(z)
      z(i) = field(this%place_x(i), this%place_y(i))
    end do
  end subroutine sample
end module sg_circulant_sampler
