!> Cost of random fields, made as the Monte-Carlo driver makes them: for each autocorrelation
!> function and method, and where the time goes.
!> Usage: bench_fields CASE.nml [fields [dense fields]]. Every figure is in seconds of processor
!> time per 1000 fields, the least and the most of five repeats; the parts run apart, so their sum
!> is not the whole. Dense fields: repeats of method='cholesky' (0: none), whose matrix of n x n
!> numbers must fit in memory. Judges nothing.
program bench_fields
  use case_file, only: read_case, stop_on_error
  use sg_autocorrelation, only: ACF_NAMES
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_linear_algebra, only: multiply_from_left, multiply_from_right_transposed
  use sg_philox, only: FIELD_STREAM, fill_uniform, fill_words
  use sg_random_field, only: random_field_t
  use sg_sampler, only: estimate_sampler_memory
  use sg_scene, only: build_scene, scene_t
  use sg_white_noise, only: fill_white_noise
  implicit none

  integer, parameter :: REPEATS = 5
  type(config_t) :: config
  type(scene_t) :: scene
  type(error_t), allocatable :: error
  real(wp), allocatable :: x(:), y(:), values(:)
  integer :: fields, dense_fields, k

  call read_arguments()
  call build_scene(config, scene, error)
  call stop_on_error(error)
  call scene%points_of(config%random_field%material_index, x, y)
  allocate (values(size(x)))
  print '(a, i0)', 'points ', size(x)
  do k = 1, size(ACF_NAMES)
    call time_method('kronecker', ACF_NAMES(k), fields)
  end do
  do k = 1, size(ACF_NAMES)
    call time_method('circulant', ACF_NAMES(k), fields)
  end do
  if (dense_fields > 0) call time_method('cholesky', config%random_field%acf, dense_fields)
  call time_parts()

contains

  subroutine read_arguments()
    character(len=512) :: argument

    call get_command_argument(1, argument)
    call read_case(trim(argument), config)
    if (.not. config%has_random_field) then
      print '(a)', 'the case has no &random_field'
      stop 2
    end if
    fields = 200
    call get_command_argument(2, argument)
    if (argument /= '') read (argument, *) fields
    dense_fields = 0
    call get_command_argument(3, argument)
    if (argument /= '') read (argument, *) dense_fields
  end subroutine read_arguments

  !> Making the factors (once per rank), and the fields of `count` members.
  subroutine time_method(method, acf, count)
    character(len=*), intent(in) :: method, acf
    integer, intent(in) :: count
    type(random_field_t) :: field
    character(len=:), allocatable :: description
    real(wp) :: started, ended, seconds(REPEATS), clipped, setup
    integer(i8) :: bytes, id
    integer :: repeat

    config%random_field%method = method
    call estimate_sampler_memory(method, x, y, bytes, description, error)
    call stop_on_error(error)
    call cpu_time(started)
    call field%init(config%random_field, trim(acf), config%random_field%cov, x, y, error)
    call stop_on_error(error)
    call cpu_time(ended)
    setup = ended - started
    do repeat = 1, REPEATS
      call cpu_time(started)
      do id = 1, count
        call field%realize(config%monte_carlo%seed, FIELD_STREAM, id, values, clipped, error)
        call stop_on_error(error)
      end do
      call cpu_time(ended)
      seconds(repeat) = (ended - started)*1000/count
    end do
    print '(a, 1x, a, 2(a, f9.3), a, f8.3, a, i0)', method, trim(acf), ' least ', &
      minval(seconds), ' most ', maxval(seconds), ' setup ', setup, ' bytes ', bytes
  end subroutine time_method

  !> The steps of a Kronecker field, each by itself. Factors of ones do as well as any.
  subroutine time_parts()
    integer(i8), allocatable :: words(:)
    real(wp), allocatable :: factor(:, :), noise(:, :)
    type(random_field_t) :: field
    real(wp) :: started, ended, seconds(5, REPEATS)
    integer(i8) :: id
    integer :: clipped, n, part, repeat
    character(len=17), parameter :: NAMES(5) = ['random words     ', 'uniform numbers  ', &
      'normal numbers   ', 'triangular       ', 'marginal         ']

    n = nint(sqrt(real(size(x), wp)))
    allocate (words(n*n), noise(n, n), factor(n, n))
    factor = 1.0_wp/n
    call field%set_cov(config%random_field, config%random_field%cov, error)
    call stop_on_error(error)
    do repeat = 1, REPEATS
      do part = 1, size(NAMES)
        call cpu_time(started)
        do id = 1, fields
          select case (part)
          case (1)
            call fill_words(1_i8, FIELD_STREAM, id, 0_i8, words)
          case (2)
            call fill_uniform(1_i8, FIELD_STREAM, id, 0_i8, values)
          case (3)
            call fill_white_noise(1_i8, FIELD_STREAM, id, noise)
          case (4)
            call multiply_from_left(factor, noise)
            call multiply_from_right_transposed(factor, noise)
            noise = noise + 1.0_wp
          case (5)
            call field%marginal%transform(noise(:, 1), values(:n), clipped)
          end select
        end do
        call cpu_time(ended)
        seconds(part, repeat) = (ended - started)*1000/fields
        if (part == 5) seconds(part, repeat) = seconds(part, repeat)*n
      end do
    end do
    do part = 1, size(NAMES)
      print '(a, 2(a, f9.3))', 'part '//NAMES(part), ' least ', minval(seconds(part, :)), &
        ' most ', maxval(seconds(part, :))
    end do
  end subroutine time_parts
end program bench_fields
