!> Cost of random fields, made as the Monte-Carlo driver makes them: for each autocorrelation
!> function and method, and where the time goes.
!> Usage: bench_fields CASE.nml [fields [dense fields]], or bench_fields CASE.nml fields METHOD for
!> the correlation of the case and one method only. Every figure is in seconds of processor
!> time per 1000 fields, the least and the most of five repeats; the parts run apart, so their sum
!> is not the whole. Dense fields: repeats of method='cholesky' (0: none), whose matrix of n x n
!> numbers must fit in memory, one by one and MEMBERS_AT_ONCE together. Judges nothing.
program bench_fields
  use case_file, only: read_case, stop_on_error
  use sg_autocorrelation, only: ACF_NAMES
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_field_properties, only: points_of_materials
  use sg_kinds, only: i8, wp
  use sg_linear_algebra, only: multiply_from_left, multiply_from_right_transposed
  use sg_marginal, only: marginal_t
  use sg_philox, only: FIELD_STREAM, fill_uniform, fill_words
  use sg_random_field, only: field_points_t
  use sg_random_fields, only: field_values_t, random_fields_t
  use sg_scene, only: build_scene, scene_t
  use sg_special_functions, only: normal_quantile
  use sg_white_noise, only: fill_white_noise, noise_source_t, PLAN_LATIN_HYPERCUBE
  implicit none

  integer, parameter :: REPEATS = 5, MEMBERS_AT_ONCE = 16
  character(len=26), parameter :: PART_NAMES(9) = [character(len=26) :: 'random words', &
    'uniform numbers', 'normal numbers by GSL', 'normal numbers', 'triangular products', &
    'products, 16 members', 'normal marginal', 'lognormal marginal', 'normal numbers, hypercube']
  !> Of 'matern', unless the case has another.
  real(wp), parameter :: SMOOTHNESS = 1.2_wp

  type :: parts_t
    integer(i8), allocatable :: words(:)
    !> Factor and noise of one member, noise of MEMBERS_AT_ONCE side by side and on top of one
    !> another.
    real(wp), allocatable :: factor(:, :), noise(:, :), wide(:, :), tall(:, :)
    real(wp), allocatable :: z(:)
    type(marginal_t) :: normal, lognormal
    type(noise_source_t) :: hypercube
  end type parts_t

  type(config_t) :: config
  type(scene_t) :: scene
  type(error_t), allocatable :: error
  type(field_points_t), allocatable :: points(:)
  real(wp), allocatable :: values(:)
  character(len=:), allocatable :: only
  integer :: fields, dense_fields, k

  call read_arguments()
  call build_scene(config, scene, error)
  call stop_on_error(error)
  allocate (points, source=points_of_materials(scene))
  allocate (values(size(points(config%random_fields(1)%material_index)%x)))
  print '(a, i0)', 'points ', size(values)
  if (only /= '') then
    call time_method(only, trim(config%random_fields(1)%acf), fields, 1)
  else
    do k = 1, size(ACF_NAMES)
      call time_method('kronecker', ACF_NAMES(k), fields, 1)
    end do
    do k = 1, size(ACF_NAMES)
      call time_method('circulant', ACF_NAMES(k), fields, 1)
    end do
    if (dense_fields > 0) then
      call time_method('cholesky', trim(config%random_fields(1)%acf), dense_fields, 1)
      call time_method('cholesky', trim(config%random_fields(1)%acf), MEMBERS_AT_ONCE, &
        MEMBERS_AT_ONCE)
    end if
    call time_parts()
  end if

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
    only = ''
    if (verify(trim(argument), '0123456789') > 0) then
      only = trim(argument)
    else if (argument /= '') then
      read (argument, *) dense_fields
    end if
    associate (field => config%random_fields(1))
      if (.not. field%smoothness > 0.0_wp) field%smoothness = SMOOTHNESS
    end associate
  end subroutine read_arguments

  !> Making the factors (once per rank), and the fields of `count` members, so many at a time.
  subroutine time_method(method, acf, count, together)
    character(len=*), intent(in) :: method, acf
    integer, intent(in) :: count, together
    type(random_fields_t) :: made
    type(field_values_t), allocatable :: results(:, :)
    character(len=:), allocatable :: name
    character(len=:), allocatable :: description
    real(wp) :: started, ended, seconds(REPEATS), setup
    integer(i8) :: bytes, id
    integer :: repeat

    config%random_fields(1)%method = method
    call cpu_time(started)
    call made%prepare(config, trim(acf), config%study%cov(1), points, error)
    call stop_on_error(error)
    call made%build(error)
    call stop_on_error(error)
    call cpu_time(ended)
    call made%estimate(bytes, description, error)
    call stop_on_error(error)
    setup = ended - started
    do repeat = 1, REPEATS
      call cpu_time(started)
      do id = 1, count, together
        call made%realize_block(id, together, results, error)
        call stop_on_error(error)
      end do
      call cpu_time(ended)
      seconds(repeat) = (ended - started)*1000/count
    end do
    name = method
    if (together > 1) name = method//'_together'
    print '(a, 1x, a, 2(a, f9.3), a, f8.3, a, i0)', name, trim(acf), ' least ', &
      minval(seconds), ' most ', maxval(seconds), ' setup ', setup, ' bytes ', bytes
  end subroutine time_method

  !> The steps of a Kronecker field, and other ways to do two of them, each by itself. Factors of
  !> ones do as well as any.
  subroutine time_parts()
    type(parts_t) :: parts
    real(wp) :: started, ended, seconds(REPEATS)
    integer(i8) :: id
    integer :: part, repeat, members

    call prepare_parts(parts)
    do part = 1, size(PART_NAMES)
      members = merge(MEMBERS_AT_ONCE, 1, part == 6)
      do repeat = 1, REPEATS
        call cpu_time(started)
        do id = 1, fields
          call do_part(part, id, parts)
        end do
        call cpu_time(ended)
        seconds(repeat) = (ended - started)*1000/fields/members
      end do
      print '(a, 2(a, f9.3))', 'part '//PART_NAMES(part), ' least ', minval(seconds), ' most ', &
        maxval(seconds)
    end do
  end subroutine time_parts

  subroutine prepare_parts(parts)
    type(parts_t), intent(out) :: parts
    real(wp) :: sd
    integer :: n

    n = nint(sqrt(real(size(values), wp)))
    allocate (parts%words(n*n), parts%factor(n, n), parts%noise(n, n), parts%z(n*n))
    parts%noise = 1.0_wp
    allocate (parts%wide(n, n*MEMBERS_AT_ONCE), parts%tall(n*MEMBERS_AT_ONCE, n))
    parts%factor = 1.0_wp/n
    parts%wide = 1.0_wp
    parts%tall = 1.0_wp
    parts%hypercube = noise_source_t(1_i8, PLAN_LATIN_HYPERCUBE, int(fields, i8))
    associate (law => config%random_fields(1))
      sd = 0.1_wp*law%mean
      call parts%normal%init('normal', law%mean, sd, law%bounds(1), law%bounds(2), error)
      call stop_on_error(error)
      call parts%lognormal%init('lognormal', law%mean, sd, law%bounds(1), law%bounds(2), error)
      call stop_on_error(error)
    end associate
  end subroutine prepare_parts

  subroutine do_part(part, id, parts)
    !> Index into PART_NAMES.
    integer, intent(in) :: part
    integer(i8), intent(in) :: id
    type(parts_t), intent(inout) :: parts
    integer :: clipped, i

    select case (part)
    case (1)
      call fill_words(1_i8, FIELD_STREAM, id, 0_i8, parts%words)
    case (2)
      call fill_uniform(1_i8, FIELD_STREAM, id, 0_i8, parts%z)
    case (3)
      call fill_uniform(1_i8, FIELD_STREAM, id, 0_i8, parts%z)
      parts%z = [(normal_quantile(parts%z(i)), i=1, size(parts%z))]
    case (4)
      call fill_white_noise(1_i8, FIELD_STREAM, id, parts%z)
    case (5)
      call multiply_from_left(parts%factor, parts%noise)
      call multiply_from_right_transposed(parts%factor, parts%noise)
      parts%noise = parts%noise + 1.0_wp
    case (6)
      call multiply_from_left(parts%factor, parts%wide)
      parts%wide = parts%wide + 1.0_wp
      call multiply_from_right_transposed(parts%factor, parts%tall)
      parts%tall = parts%tall + 1.0_wp
    case (7)
      call parts%normal%transform(parts%z, values, clipped)
    case (8)
      call parts%lognormal%transform(parts%z, values, clipped)
    case default
      call parts%hypercube%fill(FIELD_STREAM, id, parts%z)
    end select
  end subroutine do_part
end program bench_fields
