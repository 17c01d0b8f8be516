!> All random fields of one study case, made together: Gaussian fields of correlated noise, made to
!> agree with measurements, turned into values of the properties.
!>
!> Field k is z_k = A_k sum_j T_kj w_j: A_k its factor, w_j the white noise of stream j, T the
!> Cholesky factor of the matrix R of correlations between the fields. At the same point two fields
!> have the correlation R_kl if their autocorrelations are the same, else somewhat less (`overlap`
!> of the samplers). A realization is a function of (seed, id), with some sampling plans of the
!> number of members, too.
module sg_random_fields
  use sg_available_memory, only: require_memory
  use sg_config, only: config_t, NAME_LENGTH
  use sg_errors, only: error_t, EXIT_BAD_INPUT, raise
  use sg_field_supply, only: field_supply_t
  use sg_kinds, only: i8, wp
  use sg_linear_algebra, only: factor_cholesky
  use sg_marginal, only: marginal_t
  use sg_measurements, only: kriging_t, measurements_t
  use sg_philox, only: DATA_STREAM, field_stream_of
  use sg_posix, only: hash_of_file
  use sg_random_field, only: field_points_t, random_field_t
  use sg_sampler, only: create_sampler, estimate_sampler_memory, gaussian_sampler_t
  use sg_text, only: to_text
  use sg_tilt, only: tilt_t
  use sg_white_noise, only: noise_source_t, PLAN_ANTITHETIC, PLAN_LATIN_HYPERCUBE, PLAN_RANDOM
  implicit none
  private

  public :: field_values_t, follows_study, random_fields_t, refuse_changed_files

  !> The values of one field in one realization.
  type :: field_values_t
    !> [points of the field], in the unit of the property.
    real(wp), allocatable :: values(:)
    !> Share of the points whose value was set to a bound.
    real(wp) :: clipped_share = 0.0_wp
    !> ln of the likelihood ratio of the realization (importance sampling).
    real(wp) :: log_weight = 0.0_wp
  end type field_values_t

  type :: sampler_slot_t
    class(gaussian_sampler_t), allocatable :: sampler
  end type sampler_slot_t

  type :: supply_slot_t
    class(field_supply_t), allocatable :: supply
  end type supply_slot_t

  !> Correlation between points and data, [points of the field, data].
  type :: reach_t
    real(wp), allocatable :: values(:, :)
  end type reach_t

  type :: random_fields_t
    type(random_field_t), allocatable :: fields(:)
    !> Correlations between the Gaussian fields, and the lower Cholesky factor of their matrix.
    real(wp), allocatable :: between(:, :), mix(:, :)
    type(measurements_t) :: data
    type(noise_source_t) :: source
    !> Importance sampling: shift of the first field, in standard deviations of its mean.
    real(wp), private :: shift = 0.0_wp
    type(tilt_t), private :: tilt
    !> Sampler of each field, position in `samplers`; 0 for fields from a file.
    integer, allocatable :: sampler_of(:)
    type(sampler_slot_t), allocatable :: samplers(:)
    !> Method that each field asks for; 'cholesky' where fields of common noise would choose
    !> different ones by themselves.
    character(len=NAME_LENGTH), allocatable, private :: methods(:)
    !> Of the fields that are not sampled.
    type(supply_slot_t), allocatable :: supplies(:)
    type(kriging_t), private :: kriging
    type(reach_t), allocatable, private :: reach(:)
    !> COV that the laws of the first field are made for.
    real(wp), private :: cov = -1.0_wp
  contains
    procedure :: prepare
    procedure :: build
    procedure :: estimate
    procedure :: set_cov
    procedure :: realize
    procedure :: realize_block
    procedure :: describe
    procedure, private :: load_data
    procedure, private :: check_data
    procedure, private :: same_sampler
    procedure, private :: choose_methods
    procedure, private :: sample_gaussian
    procedure, private :: finish
  end type random_fields_t

  !> How far, in widths of a point, a measurement may be from the nearest point of its field: the
  !> steps of a slanted or round edge are less than one wide.
  real(wp), parameter :: NEAR = 1.0_wp

contains

  !> Points, laws and measurements: what can be wrong with a case, but no factor of its points.
  subroutine prepare(this, config, acf, cov, points, error)
    class(random_fields_t), intent(inout) :: this
    type(config_t), intent(in) :: config
    !> Of the first field, and of others without one of their own.
    character(len=*), intent(in) :: acf
    !> Of the first field; 0: as the case has it.
    real(wp), intent(in) :: cov
    !> Of each material.
    type(field_points_t), intent(in) :: points(:)
    type(error_t), allocatable, intent(out) :: error
    integer :: k, failed_row

    associate (n => size(config%random_fields))
      allocate (this%fields(n), this%between(n, n), this%supplies(n), this%reach(n))
    end associate
    this%source = noise_source_t(config%monte_carlo%seed, plan_of(config%monte_carlo%sampling), &
      int(config%monte_carlo%realizations, i8))
    if (config%monte_carlo%sampling == 'importance') this%shift = config%monte_carlo%tilt
    this%between = 0.0_wp
    do k = 1, size(this%fields)
      this%between(k, k) = 1.0_wp
      associate (field => config%random_fields(k))
        if (follows_study(config, k)) then
          call this%fields(k)%place(field, acf, points(field%material_index), error)
        else
          call this%fields(k)%place(field, trim(field%acf), points(field%material_index), error)
        end if
        if (allocated(error)) return
        call refuse_empty(this%fields(k), points(field%material_index), error)
        if (allocated(error)) return
      end associate
    end do
    do k = 1, size(config%cross_correlations)
      associate (pair => config%cross_correlations(k)%fields)
        this%between(pair(1), pair(2)) = config%cross_correlations(k)%coefficient
        this%between(pair(2), pair(1)) = config%cross_correlations(k)%coefficient
      end associate
    end do
    this%mix = this%between
    call factor_cholesky(this%mix, failed_row)
    if (failed_row > 0) then
      call raise(error, EXIT_BAD_INPUT, 'the correlation matrix of the random fields is not '// &
        'positive definite', 'random_fields')
      return
    end if
    call this%choose_methods(error)
    if (.not. allocated(error)) call this%load_data(config, error)
    if (.not. allocated(error)) call this%set_cov(cov, error)
  end subroutine prepare

  !> Whether field k has the autocorrelation function of the study case.
  pure logical function follows_study(config, k)
    type(config_t), intent(in) :: config
    integer, intent(in) :: k

    follows_study = k == 1 .or. config%random_fields(k)%acf == ''
  end function follows_study

  pure integer function plan_of(sampling) result(plan)
    character(len=*), intent(in) :: sampling

    select case (sampling)
    case ('antithetic')
      plan = PLAN_ANTITHETIC
    case ('latin_hypercube')
      plan = PLAN_LATIN_HYPERCUBE
    case default
      plan = PLAN_RANDOM
    end select
  end function plan_of

  !> A field without points, or one of averages over cells that differ in size.
  subroutine refuse_empty(field, points, error)
    type(random_field_t), intent(in) :: field
    type(field_points_t), intent(in) :: points
    type(error_t), allocatable, intent(out) :: error

    if (size(field%points) == 0) then
      call raise(error, EXIT_BAD_INPUT, 'random field '//trim(field%config%name)// &
        ' has no points: its body or region holds none', 'random_fields')
    else if (field%config%averaging == 'cell' .and. (any(abs(points%width(field%points) &
      - field%cell(1)) > 1.0e-9_wp*field%cell(1)) .or. any(abs(points%height(field%points) &
      - field%cell(2)) > 1.0e-9_wp*field%cell(2)))) then
      call raise(error, EXIT_BAD_INPUT, 'random field '//trim(field%config%name)// &
        ": averaging='cell' needs points of one size (allowed: a field for each body)", &
        'random_fields')
    end if
  end subroutine refuse_empty

  !> Reads the measurements; those outside their field are refused, all at once.
  subroutine load_data(this, config, error)
    class(random_fields_t), intent(inout) :: this
    type(config_t), intent(in) :: config
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: miss
    integer :: d, k

    call this%data%init()
    do k = 1, size(this%fields)
      associate (field => config%random_fields(k))
        if (field%data /= '') call this%data%add(field%data, k, error)
        if (allocated(error)) return
      end associate
    end do
    do d = 1, size(this%data%x)
      associate (field => this%fields(this%data%field(d)))
        miss = minval(max(abs(field%x - this%data%x(d))/field%cell(1), &
          abs(field%y - this%data%y(d))/field%cell(2)))
        if (miss > NEAR) call this%data%refuse(d, 'the measurement at ('// &
          to_text(this%data%x(d))//', '//to_text(this%data%y(d))//') lies outside the body or '// &
          'region of field '//trim(field%config%name), error)
      end associate
    end do
  end subroutine load_data

  !> Files of measurements and fields that are not what the case file says they were.
  subroutine refuse_changed_files(config, error)
    type(config_t), intent(in) :: config
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    do k = 1, size(config%random_fields)
      associate (field => config%random_fields(k))
        call refuse_changed(field%data, field%data_content, 'data_content', error)
        if (.not. allocated(error)) call refuse_changed(field%file, field%file_content, &
          'file_content', error)
        if (allocated(error)) return
      end associate
    end do
  end subroutine refuse_changed_files

  subroutine refuse_changed(path, content, key, error)
    character(len=*), intent(in) :: path, content, key
    type(error_t), allocatable, intent(out) :: error

    if (path == '' .or. content == '') return
    if (hash_of_file(path) /= content) call raise(error, EXIT_BAD_INPUT, path// &
      ' is not the file that '//key//' of the case belongs to: it has changed since', &
      'random_fields')
  end subroutine refuse_changed

  !> Standard normal values of the measurements under the laws of now. Those that the laws do not
  !> hold are refused, all at once.
  subroutine check_data(this, error)
    class(random_fields_t), intent(inout) :: this
    type(error_t), allocatable, intent(inout) :: error
    type(marginal_t) :: law
    type(error_t), allocatable :: fault
    integer :: d

    do d = 1, size(this%data%x)
      associate (field => this%fields(this%data%field(d)))
        call field%law_at(this%data%height(d), law, fault)
        if (.not. allocated(fault)) call law%to_gaussian(this%data%value(d), this%data%z(d), fault)
        if (allocated(fault)) then
          call this%data%refuse(d, fault%message, error)
        else
          this%data%z_error(d) = this%data%error(d)/law%slope(this%data%z(d))
        end if
      end associate
    end do
  end subroutine check_data

  !> Laws of the first field for another coefficient of variation (0: as the case has it); the
  !> Gaussian fields, which take the time, stay.
  subroutine set_cov(this, cov, error)
    class(random_fields_t), intent(inout) :: this
    real(wp), intent(in) :: cov
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    if (.not. abs(this%cov - cov) > 0.0_wp) return
    ! The laws of the other fields are made once.
    do k = 1, merge(size(this%fields), 1, this%cov < 0.0_wp)
      call this%fields(k)%set_cov(merge(cov, 0.0_wp, k == 1), error)
      if (allocated(error)) return
    end do
    this%cov = cov
    call this%check_data(error)
    if (allocated(error) .or. size(this%data%x) == 0) return
    call this%kriging%prepare(this%data, this%fields%correlation, this%between, error)
  end subroutine set_cov

  !> Makes the samplers. Fields with the same correlation at the same points share one.
  subroutine build(this, error)
    class(random_fields_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    type(sampler_slot_t), allocatable :: slots(:)
    integer :: k, l, made

    allocate (this%sampler_of(size(this%fields)), source=0)
    allocate (slots(size(this%fields)))
    made = 0
    do k = 1, size(this%fields)
      if (this%fields(k)%config%file /= '') cycle
      do l = 1, k - 1
        if (this%same_sampler(k, l)) this%sampler_of(k) = this%sampler_of(l)
      end do
      if (this%sampler_of(k) > 0) cycle
      made = made + 1
      this%sampler_of(k) = made
      call create_sampler(trim(this%methods(k)), this%fields(k)%correlation, this%fields(k)%x, &
        this%fields(k)%y, slots(made)%sampler, error)
      if (allocated(error)) return
    end do
    if (size(this%data%x) > 0) then
      do k = 1, made
        call observe_fields(this, k, slots(k)%sampler)
      end do
    end if
    call move_alloc(slots, this%samplers)
    call this%tilt%aim(this%shift, this%fields(1)%correlation, this%fields(1)%x, this%fields(1)%y)
    call refuse_unequal_noise(this, error)
    if (allocated(error) .or. size(this%data%x) == 0) return
    call this%kriging%prepare(this%data, this%fields%correlation, this%between, error)
    if (.not. allocated(error)) call fill_reach(this, error)
  end subroutine build

  !> Tells a sampler the places of all data; where it moves them, those of its fields move.
  subroutine observe_fields(this, number, sampler)
    class(random_fields_t), intent(inout) :: this
    !> Position in `samplers`.
    integer, intent(in) :: number
    class(gaussian_sampler_t), intent(inout) :: sampler
    real(wp) :: x(size(this%data%x)), y(size(this%data%x))

    x = this%data%x
    y = this%data%y
    call sampler%observe(x, y)
    where (this%sampler_of(this%data%field) == number)
      this%data%x = x
      this%data%y = y
    end where
  end subroutine observe_fields

  pure logical function same_sampler(this, k, l) result(same)
    class(random_fields_t), intent(in) :: this
    integer, intent(in) :: k, l

    same = this%fields(l)%config%file == '' .and. this%methods(k) == this%methods(l)
    associate (a => this%fields(k)%correlation, b => this%fields(l)%correlation)
      same = same .and. a%acf%name == b%acf%name .and. (a%is_radial .eqv. b%is_radial)
      same = same .and. all(abs([a%scale - b%scale, a%cell - b%cell, a%rotation - b%rotation, &
        a%acf%smoothness - b%acf%smoothness]) <= 0.0_wp)
    end associate
    if (same) same = size(this%fields(k)%x) == size(this%fields(l)%x)
    if (same) same = all(abs(this%fields(k)%x - this%fields(l)%x) <= 0.0_wp) .and. &
      all(abs(this%fields(k)%y - this%fields(l)%y) <= 0.0_wp)
  end function same_sampler

  !> Fields of common noise, directly or by way of others, are made by one method: where they would
  !> choose different ones by themselves, by the one that takes all. Two that name different ones
  !> are refused.
  subroutine choose_methods(this, error)
    class(random_fields_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    logical :: linked(size(this%fields), size(this%fields)), is_product(size(this%fields))
    integer :: k, l

    this%methods = this%fields%config%method
    linked = abs(this%between) > 0.0_wp
    do k = 1, size(this%fields)
      is_product(k) = this%fields(k)%correlation%is_product()
      do l = 1, size(this%fields)
        if (linked(l, k)) linked(:, l) = linked(:, l) .or. linked(:, k)
      end do
    end do
    do k = 1, size(this%fields)
      if (this%methods(k) == 'auto' .and. any(linked(:, k) .and. (is_product .neqv. is_product(k) &
        .or. this%fields%config%method == 'cholesky'))) this%methods(k) = 'cholesky'
    end do
    do k = 1, size(this%fields)
      do l = 1, k - 1
        if (.not. linked(l, k) .or. this%methods(k) == this%methods(l)) cycle
        call raise(error, EXIT_BAD_INPUT, 'the correlated fields '// &
          trim(this%fields(l)%config%name)//' and '//trim(this%fields(k)%config%name)// &
          " need one method, not '"//trim(this%methods(l))//"' and '"//trim(this%methods(k))// &
          "' (allowed: method='auto', or the same in both)", 'random_fields')
        return
      end do
    end do
  end subroutine choose_methods

  subroutine refuse_unequal_noise(this, error)
    class(random_fields_t), intent(in) :: this
    type(error_t), allocatable, intent(out) :: error
    integer :: k, l

    do k = 1, size(this%fields)
      do l = 1, k - 1
        if (.not. abs(this%between(k, l)) > 0.0_wp) cycle
        associate (a => this%samplers(this%sampler_of(k))%sampler, &
          b => this%samplers(this%sampler_of(l))%sampler)
          if (a%method == b%method .and. a%noise_count == b%noise_count) cycle
          call raise(error, EXIT_BAD_INPUT, 'the correlated fields '// &
            trim(this%fields(k)%config%name)//' and '//trim(this%fields(l)%config%name)// &
            ' take different noise ('//a%method//' with '//to_text(a%noise_count)//' numbers, '// &
            b%method//' with '//to_text(b%noise_count)//"): give both method='cholesky'", &
            'random_fields')
          return
        end associate
      end do
    end do
  end subroutine refuse_unequal_noise

  subroutine fill_reach(this, error)
    class(random_fields_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    integer :: d, i, k

    call require_memory(16_i8*size(this%data%x)*sum([(size(this%fields(k)%x, kind=i8), k=1, &
      size(this%fields))]), 'the correlation between points and '//to_text(size(this%data%x))// &
      ' measurements', 'use fewer of either', error)
    if (allocated(error)) return

    do k = 1, size(this%fields)
      associate (field => this%fields(k), data => this%data)
        allocate (this%reach(k)%values(size(field%x), size(data%x)), source=0.0_wp)
        do d = 1, size(data%x)
          if (.not. abs(this%between(k, data%field(d))) > 0.0_wp) cycle
          this%reach(k)%values(:, d) = this%between(k, data%field(d)) &
            *[(field%correlation%at(field%x(i) - data%x(d), field%y(i) - data%y(d)), i=1, &
            size(field%x))]
        end do
      end associate
    end do
  end subroutine fill_reach

  !> Bytes that one rank needs for the factors, and what they will be, without making them.
  subroutine estimate(this, bytes, description, error)
    class(random_fields_t), intent(in) :: this
    integer(i8), intent(out) :: bytes
    character(len=:), allocatable, intent(out) :: description
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: one
    integer(i8) :: more
    integer :: k, l

    bytes = 0
    description = ''
    do k = 1, size(this%fields)
      associate (field => this%fields(k))
        one = 'from '//field%config%file
        if (field%config%file == '') then
          call estimate_sampler_memory(trim(this%methods(k)), field%correlation, field%x, field%y, &
            more, one, error)
          if (allocated(error)) return
          if (any([(this%same_sampler(k, l), l=1, k - 1)])) then
            one = one//', shared with a field before'
          else
            bytes = bytes + more
          end if
        end if
        if (k > 1) description = description//new_line('a')//'                '
        if (size(this%fields) > 1) description = description//trim(field%config%name)//': '
        description = description//one
      end associate
    end do
    if (size(this%data%x) > 0) description = description//new_line('a')//'                '// &
      to_text(size(this%data%x))//' measurements'
  end subroutine estimate

  !> The fields of one realization: a function of its arguments and the configuration alone.
  subroutine realize(this, realization, results, error)
    class(random_fields_t), intent(in) :: this
    integer(i8), intent(in) :: realization
    !> One for each field.
    type(field_values_t), allocatable, intent(out) :: results(:)
    type(error_t), allocatable, intent(out) :: error
    type(field_values_t), allocatable :: block(:, :)

    call this%realize_block(realization, 1, block, error)
    if (.not. allocated(error)) results = block(:, 1)
  end subroutine realize

  !> The fields of `number` realizations from `first` on, the same to rounding: a factor of all
  !> points is read once for all of them.
  subroutine realize_block(this, first, number, results, error)
    class(random_fields_t), intent(in) :: this
    integer(i8), intent(in) :: first
    integer, intent(in) :: number
    !> [fields, number].
    type(field_values_t), allocatable, intent(out) :: results(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: z(:, :)
    real(wp) :: residuals(size(this%data%x), number)
    integer :: k, m

    allocate (results(size(this%fields), number))
    do m = 1, number
      call this%source%fill(DATA_STREAM, first + m - 1, residuals(:, m))
      residuals(:, m) = this%data%z - this%data%z_error*residuals(:, m)
    end do
    do k = 1, size(this%fields)
      allocate (z(size(this%fields(k)%x), number))
      if (this%sampler_of(k) == 0) then
        do m = 1, number
          call this%supplies(k)%supply%read(first + m - 1, z(:, m), error)
          if (allocated(error)) return
          if (.not. all(abs(z(:, m)) <= huge(1.0_wp))) then
            call raise(error, EXIT_BAD_INPUT, this%fields(k)%config%file//': realization '// &
              to_text(first + m - 1)//' of field '//trim(this%fields(k)%config%name)// &
              ' holds a value that is not finite', 'realize_block')
            return
          end if
        end do
      else
        call this%sample_gaussian(k, first, z, residuals, error)
      end if
      if (allocated(error)) return
      do m = 1, number
        if (k == 1) call this%tilt%apply(z(:, m), results(k, m)%log_weight)
        results(k, m)%values = z(:, m)
      end do
      deallocate (z)
    end do
    do m = 1, number
      if (size(residuals, 1) > 0) call this%kriging%weights(residuals(:, m))
      do k = 1, size(this%fields)
        if (this%sampler_of(k) > 0) then
          call this%finish(k, residuals(:, m), results(k, m))
        else
          associate (bounds => this%fields(k)%config%bounds, one => results(k, m))
            one%clipped_share = real(count(one%values < bounds(1) .or. one%values > bounds(2)), &
              wp)/size(one%values)
            one%values = min(max(one%values, bounds(1)), bounds(2))
          end associate
        end if
      end do
    end do
  end subroutine realize_block

  !> The unconditional Gaussian field k; takes its values at its data off the residuals.
  subroutine sample_gaussian(this, k, first, z, residuals, error)
    class(random_fields_t), intent(in) :: this
    integer, intent(in) :: k
    integer(i8), intent(in) :: first
    !> [points of the field, realizations].
    real(wp), contiguous, intent(out) :: z(:, :)
    !> [data, realizations].
    real(wp), intent(inout) :: residuals(:, :)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: noise(:, :), seen(:)
    integer :: m

    associate (sampler => this%samplers(this%sampler_of(k))%sampler)
      allocate (noise(sampler%noise_count, size(z, 2)))
      do m = 1, size(z, 2)
        call mix_noise(this, k, first + m - 1, noise(:, m))
        if (.not. any(this%data%field == k)) cycle
        allocate (seen(size(residuals, 1)))
        call sampler%observed(noise(:, m), open_noise(this, k, first + m - 1), seen, error)
        if (allocated(error)) return
        where (this%data%field == k) residuals(:, m) = residuals(:, m) - seen
        deallocate (seen)
      end do
      call sampler%sample(noise, z, error)
    end associate
  end subroutine sample_gaussian

  !> sum_j T_kj w_j.
  subroutine mix_noise(this, k, realization, noise)
    class(random_fields_t), intent(in) :: this
    integer, intent(in) :: k
    integer(i8), intent(in) :: realization
    real(wp), contiguous, intent(out) :: noise(:)
    real(wp), allocatable :: more(:)
    integer :: j

    if (count(abs(this%mix(k, :k)) > 0.0_wp) == 1) then
      call this%source%fill(field_stream_of(k), realization, noise)
      return
    end if
    allocate (more(size(noise)))
    noise = 0.0_wp
    do j = 1, k
      if (.not. abs(this%mix(k, j)) > 0.0_wp) cycle
      call this%source%fill(field_stream_of(j), realization, more)
      noise = noise + this%mix(k, j)*more
    end do
  end subroutine mix_noise

  !> Noise of what the points of field k leave open at the data, [data]. In the stream of the data
  !> it comes after their errors, field by field; it is mixed as that of the points is.
  function open_noise(this, k, realization) result(noise)
    class(random_fields_t), intent(in) :: this
    integer, intent(in) :: k
    integer(i8), intent(in) :: realization
    real(wp) :: noise(size(this%data%x))
    real(wp) :: stream(size(this%data%x)*(1 + size(this%fields)))
    integer :: j

    call this%source%fill(DATA_STREAM, realization, stream)
    noise = 0.0_wp
    do j = 1, k
      noise = noise + this%mix(k, j)*stream(j*size(noise) + 1:(j + 1)*size(noise))
    end do
  end function open_noise

  !> From the unconditional Gaussian field k to values: adds what the data say beyond it, then turns
  !> it into the property.
  subroutine finish(this, k, weights, field)
    class(random_fields_t), intent(in) :: this
    integer, intent(in) :: k
    real(wp), intent(in) :: weights(:)
    type(field_values_t), intent(inout) :: field
    real(wp) :: z(size(field%values))
    integer :: clipped

    z = field%values
    if (size(weights) > 0) z = z + matmul(this%reach(k)%values, weights)
    call this%fields(k)%transform(z, field%values, clipped)
    field%clipped_share = real(clipped, wp)/size(z)
  end subroutine finish

  !> How the fields are sampled, with what was conceded.
  function describe(this) result(text)
    class(random_fields_t), intent(in) :: this
    character(len=:), allocatable :: text
    integer :: k, l

    text = ''
    do k = 1, size(this%fields)
      if (k > 1) text = text//'; '
      if (size(this%fields) > 1) text = text//trim(this%fields(k)%config%name)//': '
      if (this%sampler_of(k) == 0) then
        text = text//'from '//this%fields(k)%config%file
      else
        text = text//this%samplers(this%sampler_of(k))%sampler%description
      end if
      do l = 1, k - 1
        if (.not. abs(this%between(k, l)) > 0.0_wp) cycle
        if (this%sampler_of(k) == this%sampler_of(l)) cycle
        text = text//'; its correlation with '//trim(this%fields(l)%config%name)// &
          ' at the same point is '//to_text(this%between(k, l)*this%samplers(this%sampler_of(k)) &
          %sampler%overlap(this%samplers(this%sampler_of(l))%sampler), 3)//' instead of '// &
          to_text(this%between(k, l))//', since their autocorrelations differ'
      end do
    end do
    if (size(this%data%x) > 0) text = text//'; conditioned on '//to_text(size(this%data%x))// &
      ' measurements'
  end function describe
end module sg_random_fields
