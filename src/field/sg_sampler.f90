!> Chooses and makes the sampler of a Gaussian field: where a new method goes.
module sg_sampler
  use sg_available_memory, only: require_memory, text_of_bytes
  use sg_cholesky_sampler, only: cholesky_memory, cholesky_sampler_t
  use sg_circulant_sampler, only: circulant_memory, circulant_sampler_t, smallest_torus
  use sg_correlation, only: correlation_t
  use sg_errors, only: error_t, raise, EXIT_BAD_INPUT
  use sg_gaussian_sampler, only: gaussian_sampler_t
  use sg_kinds, only: i8, wp
  use sg_kronecker_sampler, only: kronecker_memory, kronecker_sampler_t
  use sg_lattice, only: find_spacing, lattice_t
  use sg_linear_algebra, only: use_one_blas_thread
  use sg_text, only: lower_case, to_text
  implicit none
  private

  public :: gaussian_sampler_t, create_sampler, estimate_sampler_memory

  !> Points up to which 'auto' takes the full factor where no product serves: 72 MB, less than a
  !> second to factor.
  integer, parameter :: MOST_DENSE_POINTS = 3000
  !> Points to a scale of fluctuation from which on they resolve it: two to four are the usual
  !> advice (Der Kiureghian & Ke 1988, with a quarter to a half of the correlation length between
  !> them).
  real(wp), parameter :: POINTS_PER_SCALE = 2.0_wp

contains

  !> A sampler for the points (x, y). Refused as bad input: no points, points or a correlation that
  !> the method cannot take, more memory than the machine has left (ranks on one machine each need
  !> their own: see estimate_sampler_memory).
  subroutine create_sampler(method, correlation, x, y, sampler, error)
    !> 'auto', 'kronecker', 'cholesky' or 'circulant'.
    character(len=*), intent(in) :: method
    type(correlation_t), intent(in) :: correlation
    !> Points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    class(gaussian_sampler_t), allocatable, intent(out) :: sampler
    type(error_t), allocatable, intent(out) :: error
    type(lattice_t) :: lattice
    character(len=:), allocatable :: chosen, reason
    type(error_t), allocatable :: refusal
    integer(i8) :: bytes

    call choose_method(method, correlation, x, y, lattice, chosen, reason, bytes, error)
    if (allocated(error)) return
    call require_memory(bytes, "method='"//chosen//"' for the random field at "// &
      to_text(size(x))//' points', cheaper_way(chosen, correlation, lattice), error)
    if (allocated(error)) return
    call use_one_blas_thread()
    call make_sampler(chosen, correlation, x, y, lattice, sampler, error)
    if (allocated(error) .and. method == 'auto' .and. chosen == 'circulant') then
      ! No torus is long enough: the full matrix always does, if there is room for it.
      call move_alloc(error, refusal)
      if (allocated(sampler)) deallocate (sampler)
      call require_memory(cholesky_memory(size(x)), "method='cholesky' for the random field at "// &
        to_text(size(x))//' points (since '//refusal%message//')', 'use fewer points', error)
      if (allocated(error)) return
      call make_sampler('cholesky', correlation, x, y, lattice, sampler, error)
      reason = ' (auto: no torus is long enough)'
    end if
    if (allocated(error)) return
    sampler%description = sampler%description//reason//text_of_resolution(correlation, lattice)
  end subroutine create_sampler

  !> Bytes that one rank needs for the field, and what method it will be, without making it.
  !> For 'circulant' the smallest embedding is assumed.
  subroutine estimate_sampler_memory(method, correlation, x, y, bytes, description, error)
    character(len=*), intent(in) :: method
    type(correlation_t), intent(in) :: correlation
    !> Points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    integer(i8), intent(out) :: bytes
    character(len=:), allocatable, intent(out) :: description
    type(error_t), allocatable, intent(out) :: error
    type(lattice_t) :: lattice
    character(len=:), allocatable :: chosen, reason

    call choose_method(method, correlation, x, y, lattice, chosen, reason, bytes, error)
    if (allocated(error)) return
    description = chosen//reason//', '//text_of_bytes(bytes)// &
      text_of_resolution(correlation, lattice)
  end subroutine estimate_sampler_memory

  !> The method that `method` stands for, why, and the bytes it takes.
  subroutine choose_method(method, correlation, x, y, lattice, chosen, reason, bytes, error)
    character(len=*), intent(in) :: method
    type(correlation_t), intent(in) :: correlation
    real(wp), intent(in) :: x(:), y(:)
    type(lattice_t), intent(out) :: lattice
    character(len=:), allocatable, intent(out) :: chosen, reason
    integer(i8), intent(out) :: bytes
    type(error_t), allocatable, intent(out) :: error

    bytes = 0
    if (size(x) == 0) then
      call raise(error, EXIT_BAD_INPUT, 'the random field has no points: its material is in no '// &
        'body, or its region holds none', 'choose_method')
      return
    end if
    call lattice%init(x, y)
    chosen = lower_case(trim(method))
    reason = ''
    if (chosen == 'auto') then
      call choose_by_itself(correlation, lattice, size(x), chosen, reason)
    else if (chosen /= 'cholesky' .and. .not. lattice%is_lattice) then
      call raise(error, EXIT_BAD_INPUT, "method='"//chosen//"' needs points on a lattice; "// &
        text_of_lattice(lattice)//": use method='cholesky'", 'choose_method')
      return
    else if (chosen == 'kronecker' .and. .not. correlation%is_product()) then
      call raise(error, EXIT_BAD_INPUT, "method='kronecker' needs a product of functions of x "// &
        "and y, which a radial or rotated correlation is not: use method='circulant' or "// &
        "'cholesky'", 'choose_method')
      return
    end if
    select case (chosen)
    case ('kronecker')
      bytes = kronecker_memory(lattice)
    case ('cholesky')
      bytes = cholesky_memory(size(x))
    case ('circulant')
      bytes = smallest_circulant_memory(correlation, lattice)
    case default
      call raise(error, EXIT_BAD_INPUT, "no method is called '"//chosen// &
        "' (allowed: auto, kronecker, cholesky, circulant)", 'choose_method')
    end select
  end subroutine choose_method

  !> What 'auto' stands for: two small factors where both points and correlation are products; else
  !> the full factor while it is small, and a torus where the points lie evenly.
  subroutine choose_by_itself(correlation, lattice, points, chosen, reason)
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    integer, intent(in) :: points
    character(len=:), allocatable, intent(out) :: chosen, reason

    if (lattice%is_lattice .and. correlation%is_product()) then
      chosen = 'kronecker'
      reason = ' (auto: '//text_of_lattice(lattice)//')'
    else if (lattice%is_lattice .and. lattice%is_even() .and. points > MOST_DENSE_POINTS) then
      chosen = 'circulant'
      reason = ' (auto: '//text_of_lattice(lattice)//', the correlation is no product)'
    else
      chosen = 'cholesky'
      reason = ' (auto: '//text_of_lattice(lattice)//')'
      if (lattice%is_lattice) reason = ' (auto: the correlation is no product)'
    end if
  end subroutine choose_by_itself

  subroutine make_sampler(method, correlation, x, y, lattice, sampler, error)
    character(len=*), intent(in) :: method
    type(correlation_t), intent(in) :: correlation
    real(wp), intent(in) :: x(:), y(:)
    type(lattice_t), intent(in) :: lattice
    class(gaussian_sampler_t), allocatable, intent(out) :: sampler
    type(error_t), allocatable, intent(out) :: error
    type(kronecker_sampler_t), allocatable :: kronecker
    type(cholesky_sampler_t), allocatable :: cholesky
    type(circulant_sampler_t), allocatable :: circulant

    select case (method)
    case ('kronecker')
      allocate (kronecker)
      call kronecker%init(correlation, lattice, error)
      call move_alloc(kronecker, sampler)
    case ('cholesky')
      allocate (cholesky)
      call cholesky%init(correlation, x, y, lattice, error)
      call move_alloc(cholesky, sampler)
    case ('circulant')
      allocate (circulant)
      call circulant%init(correlation, lattice, error)
      call move_alloc(circulant, sampler)
    case default
      call raise(error, EXIT_BAD_INPUT, 'there is no method '//method, 'make_sampler')
    end select
  end subroutine make_sampler

  !> A warning where a scale of fluctuation is short against the spacing of the points; else empty.
  pure function text_of_resolution(correlation, lattice) result(text)
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    character(len=:), allocatable :: text
    real(wp) :: gap(2), points
    integer :: n

    text = ''
    if (.not. lattice%is_lattice) return
    gap = 0.0_wp
    n = size(lattice%x)
    if (n > 1) gap(1) = minval(lattice%x(2:) - lattice%x(:n - 1))
    n = size(lattice%y)
    if (n > 1) gap(2) = minval(lattice%y(2:) - lattice%y(:n - 1))
    if (.not. maxval(gap/correlation%scale) > 0.0_wp) return
    points = 1.0_wp/maxval(gap/correlation%scale)
    if (points >= POINTS_PER_SCALE) return
    text = '; warning: only '//to_text(points, 2)//' points to a scale of fluctuation ('// &
      to_text(nint(POINTS_PER_SCALE))//' or more resolve it)'
    if (.not. any(correlation%cell > 0.0_wp)) text = text//', values of points stand for whole '// &
      "cells, whose mean varies less (averaging='cell')"
  end function text_of_resolution

  pure function text_of_lattice(lattice) result(text)
    type(lattice_t), intent(in) :: lattice
    character(len=:), allocatable :: text

    if (lattice%is_lattice) then
      text = 'the points lie on a lattice of '//to_text(size(lattice%x))//' x '// &
        to_text(size(lattice%y))
    else
      text = to_text(size(lattice%column))//' points have '//to_text(size(lattice%x))// &
        ' different x and '//to_text(size(lattice%y))//' different y'
    end if
  end function text_of_lattice

  function smallest_circulant_memory(correlation, lattice) result(bytes)
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    integer(i8) :: bytes
    integer, allocatable :: place_x(:), place_y(:)
    real(wp) :: spacing
    integer :: ring(2)

    call find_spacing(lattice%x, spacing, place_x)
    call find_spacing(lattice%y, spacing, place_y)
    ring = smallest_torus(correlation, [maxval(place_x), maxval(place_y)])
    bytes = circulant_memory(ring(1), ring(2), size(lattice%column))
  end function smallest_circulant_memory

  pure function cheaper_way(method, correlation, lattice) result(text)
    character(len=*), intent(in) :: method
    type(correlation_t), intent(in) :: correlation
    type(lattice_t), intent(in) :: lattice
    character(len=:), allocatable :: text

    text = 'use fewer points'
    if (.not. lattice%is_lattice .or. method == 'kronecker') return
    if (correlation%is_product()) then
      text = "use method='kronecker'"
    else if (method == 'cholesky') then
      text = "use method='circulant'"
    end if
  end function cheaper_way
end module sg_sampler
