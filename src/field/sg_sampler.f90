!> Chooses and makes the sampler of a Gaussian field: where a new method goes.
module sg_sampler
  use sg_autocorrelation, only: autocorrelation_t
  use sg_available_memory, only: require_memory, text_of_bytes
  use sg_cholesky_sampler, only: cholesky_memory, cholesky_sampler_t
  use sg_circulant_sampler, only: circulant_memory, circulant_sampler_t
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

contains

  !> A sampler for the points (x, y). Refused as bad input: an unknown name, scales that are not
  !> positive, no points, points that the method cannot take, more memory than the machine has left
  !> (ranks on one machine each need their own: see estimate_sampler_memory).
  subroutine create_sampler(method, acf, scale_x, scale_y, x, y, sampler, error)
    !> 'auto', 'kronecker', 'cholesky' or 'circulant'.
    character(len=*), intent(in) :: method
    !> One of ACF_NAMES.
    character(len=*), intent(in) :: acf
    !> Scales of fluctuation in m, > 0.
    real(wp), intent(in) :: scale_x, scale_y
    !> Points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    class(gaussian_sampler_t), allocatable, intent(out) :: sampler
    type(error_t), allocatable, intent(out) :: error
    type(autocorrelation_t) :: correlation
    type(lattice_t) :: lattice
    character(len=:), allocatable :: chosen, reason
    integer(i8) :: bytes

    call correlation%init(acf, error)
    if (allocated(error)) return
    if (.not. (scale_x > 0.0_wp .and. scale_y > 0.0_wp)) then
      call raise(error, EXIT_BAD_INPUT, 'the scales of fluctuation must be positive', &
        'create_sampler')
      return
    end if
    call choose_method(method, x, y, lattice, chosen, reason, bytes, error)
    if (allocated(error)) return
    call require_memory(bytes, "method='"//chosen//"' for the random field at "// &
      to_text(size(x))//' points', cheaper_way(chosen, lattice), error)
    if (allocated(error)) return
    call use_one_blas_thread()
    call make_sampler(chosen, correlation, [scale_x, scale_y], x, y, lattice, sampler, error)
    if (allocated(error)) return
    sampler%description = sampler%description//reason
  end subroutine create_sampler

  !> Bytes that one rank needs for the field, and what method it will be, without making it.
  !> For 'circulant' the smallest embedding is assumed.
  subroutine estimate_sampler_memory(method, x, y, bytes, description, error)
    character(len=*), intent(in) :: method
    !> Points, [n], in m.
    real(wp), intent(in) :: x(:), y(:)
    integer(i8), intent(out) :: bytes
    character(len=:), allocatable, intent(out) :: description
    type(error_t), allocatable, intent(out) :: error
    type(lattice_t) :: lattice
    character(len=:), allocatable :: chosen, reason

    call choose_method(method, x, y, lattice, chosen, reason, bytes, error)
    if (allocated(error)) return
    description = chosen//reason//', '//text_of_bytes(bytes)
  end subroutine estimate_sampler_memory

  !> The method that `method` stands for, why, and the bytes it takes.
  subroutine choose_method(method, x, y, lattice, chosen, reason, bytes, error)
    character(len=*), intent(in) :: method
    real(wp), intent(in) :: x(:), y(:)
    type(lattice_t), intent(out) :: lattice
    character(len=:), allocatable, intent(out) :: chosen, reason
    integer(i8), intent(out) :: bytes
    type(error_t), allocatable, intent(out) :: error

    bytes = 0
    if (size(x) == 0) then
      call raise(error, EXIT_BAD_INPUT, 'the random field has no points: its material is in no '// &
        'body', 'choose_method')
      return
    end if
    call lattice%init(x, y)
    chosen = lower_case(trim(method))
    reason = ''
    if (chosen == 'auto') then
      chosen = 'cholesky'
      if (lattice%is_lattice) chosen = 'kronecker'
      reason = ' (auto: '//text_of_lattice(lattice)//')'
    else if (chosen /= 'cholesky' .and. .not. lattice%is_lattice) then
      call raise(error, EXIT_BAD_INPUT, "method='"//chosen//"' needs points on a lattice; "// &
        text_of_lattice(lattice)//": use method='cholesky'", 'choose_method')
      return
    end if
    select case (chosen)
    case ('kronecker')
      bytes = kronecker_memory(lattice)
    case ('cholesky')
      bytes = cholesky_memory(size(x))
    case ('circulant')
      bytes = smallest_circulant_memory(lattice)
    case default
      call raise(error, EXIT_BAD_INPUT, "no method is called '"//chosen// &
        "' (allowed: auto, kronecker, cholesky, circulant)", 'choose_method')
    end select
  end subroutine choose_method

  subroutine make_sampler(method, correlation, scales, x, y, lattice, sampler, error)
    character(len=*), intent(in) :: method
    type(autocorrelation_t), intent(in) :: correlation
    real(wp), intent(in) :: scales(2), x(:), y(:)
    type(lattice_t), intent(in) :: lattice
    class(gaussian_sampler_t), allocatable, intent(out) :: sampler
    type(error_t), allocatable, intent(out) :: error
    type(kronecker_sampler_t), allocatable :: kronecker
    type(cholesky_sampler_t), allocatable :: cholesky
    type(circulant_sampler_t), allocatable :: circulant

    select case (method)
    case ('kronecker')
      allocate (kronecker)
      call kronecker%init(correlation, scales(1), scales(2), lattice, error)
      call move_alloc(kronecker, sampler)
    case ('cholesky')
      allocate (cholesky)
      call cholesky%init(correlation, scales, x, y, lattice, error)
      call move_alloc(cholesky, sampler)
    case ('circulant')
      allocate (circulant)
      call circulant%init(correlation, scales(1), scales(2), lattice, error)
      call move_alloc(circulant, sampler)
    case default
      call raise(error, EXIT_BAD_INPUT, 'there is no method '//method, 'make_sampler')
    end select
  end subroutine make_sampler

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

  function smallest_circulant_memory(lattice) result(bytes)
    type(lattice_t), intent(in) :: lattice
    integer(i8) :: bytes
    integer, allocatable :: place_x(:), place_y(:)
    real(wp) :: spacing

    call find_spacing(lattice%x, spacing, place_x)
    call find_spacing(lattice%y, spacing, place_y)
    bytes = circulant_memory(max(2*(maxval(place_x) - 1), 1), max(2*(maxval(place_y) - 1), 1), &
      size(lattice%column))
  end function smallest_circulant_memory

  pure function cheaper_way(method, lattice) result(text)
    character(len=*), intent(in) :: method
    type(lattice_t), intent(in) :: lattice
    character(len=:), allocatable :: text

    text = 'use fewer points'
    if (lattice%is_lattice .and. method /= 'kronecker') text = "use method='kronecker'"
  end function cheaper_way
end module sg_sampler
