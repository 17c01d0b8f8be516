!> What the keys of the random fields, and those of the materials they vary, must satisfy together.
module sg_check_random_fields
  use sg_angles, only: DEGREE
  use sg_check_desk, only: check_material_name, desk_t
  use sg_config, only: nominal_value, random_field_config_t
  use sg_fault_list, only: quoted
  use sg_kinds, only: wp
  use sg_linear_algebra, only: factor_cholesky
  use sg_polygon, only: corners_are_distinct, polygon_area, polygon_is_simple
  use sg_schema, only: has_word, listed
  use sg_special_functions, only: normal_cdf, normal_upper_tail
  use sg_text, only: to_text
  implicit none
  private

  public :: check_random_fields

  character(len=*), parameter :: GROUP = 'random_field'
  !> A friction angle of 90 degrees has no Mohr-Coulomb pyramid.
  real(wp), parameter :: RIGHT_ANGLE = 90.0_wp
  !> Share of a distribution below which nothing of it is left between its ends: values of
  !> Phi^-1 beyond are rounding.
  real(wp), parameter :: NOTHING = 1.0e-12_wp

contains

  subroutine check_random_fields(desk)
    type(desk_t), intent(inout) :: desk
    integer :: k

    do k = 1, size(desk%config%random_fields)
      call check_name(desk, k)
      call check_place(desk, k)
      call check_material(desk, k)
      call check_moments(desk, k)
      call check_bounds(desk, k)
      call check_trend(desk, k)
      call check_law(desk, k)
      call check_correlation(desk, k)
    end do
    call check_cross_correlations(desk)
    call check_importance(desk)
  end subroutine check_random_fields

  !> The weights of importance sampling are those of one Gaussian field that is free.
  subroutine check_importance(desk)
    type(desk_t), intent(inout) :: desk
    character(len=*), parameter :: MONTE_CARLO = 'monte_carlo', KEY = 'sampling'
    integer :: k

    if (.not. desk%good(MONTE_CARLO, 1, KEY)) return
    if (desk%config%monte_carlo%sampling /= 'importance') return
    associate (fields => desk%config%random_fields)
      if (any([(fields(k)%data /= '' .or. fields(k)%file /= '', k=1, size(fields))])) then
        call desk%fault(MONTE_CARLO, 1, KEY, '''importance'' shifts fields that are sampled '// &
          'and know of no measurements (allowed: without data and file)')
      else if (size(desk%config%cross_correlations) > 0) then
        call desk%fault(MONTE_CARLO, 1, KEY, '''importance'' shifts the first field, which '// &
          'must not be correlated with others (allowed: without &cross_correlation)')
      end if
    end associate
  end subroutine check_importance

  subroutine check_name(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k
    integer :: other

    associate (fields => desk%config%random_fields)
      if (fields(k)%name == 'id') then
        call desk%fault(GROUP, k, 'name', "'id' is what the numbers of realizations are called "// &
          'in files of fields')
      end if
      do other = 1, k - 1
        if (fields(other)%name /= fields(k)%name) cycle
        call desk%fault(GROUP, k, 'name', 'a field in line '// &
          to_text(desk%nml%line_of(GROUP, other, 'name'))//' is called '// &
          quoted(fields(k)%name)//' already (without a name, a field is called like its property)')
        return
      end do
    end associate
  end subroutine check_name

  !> Material, body and region.
  subroutine check_place(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k
    real(wp), allocatable :: corners(:, :)
    integer :: i, first, second
    logical :: is_used

    associate (field => desk%config%random_fields(k), bodies => desk%config%bodies)
      if (field%body /= '' .and. field%body_index == 0) then
        call desk%fault(GROUP, k, 'body', 'there is no body '//quoted(field%body))
      else if (field%body_index > 0 .and. desk%good(GROUP, k, 'material')) then
        if (bodies(field%body_index)%material /= field%material) call desk%fault(GROUP, k, 'body', &
          quoted(field%body)//' is of material '//quoted(bodies(field%body_index)%material)// &
          ', not of '//quoted(field%material))
      end if
      if (size(field%region) > 0) then
        if (mod(size(field%region), 2) == 1 .or. size(field%region) < 6) then
          call desk%fault(GROUP, k, 'region', 'a polygon has pairs x, y, three or more of them')
        else
          corners = reshape(field%region, [2, size(field%region)/2])
          call corners_are_distinct(corners, first, second)
          if (first > 0 .or. .not. polygon_area(corners) > 0.0_wp) then
            call desk%fault(GROUP, k, 'region', 'two corners are the same point or there is no '// &
              'area between them')
          else
            call polygon_is_simple(corners, first, second)
            if (first > 0) call desk%fault(GROUP, k, 'region', 'sides '//to_text(first)//' and '// &
              to_text(second)//' of the polygon cross or touch')
          end if
        end if
      end if
      if (.not. desk%good(GROUP, k, 'material')) return
      call check_material_name(desk, GROUP, k, field%material, field%material_index)
      if (field%material_index == 0) return
      is_used = .false.
      do i = 1, size(bodies)
        ! A body whose material is faulty may be meant to be of this one.
        is_used = is_used .or. bodies(i)%material == field%material .or. &
          bodies(i)%material_index == 0 .or. .not. desk%good('body', i, 'material')
      end do
      if (.not. is_used) call desk%fault(GROUP, k, 'material', 'no &body is of material '// &
        quoted(field%material))
    end associate
  end subroutine check_place

  !> The material has the property, with the value that the homogeneous case runs with.
  subroutine check_material(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k
    character(len=:), allocatable :: models
    integer :: m

    associate (field => desk%config%random_fields(k))
      m = field%material_index
      if (m == 0) return
      if (.not. desk%good('material', m, 'model') .or. .not. desk%good(GROUP, k, 'property')) return
      models = models_with(field%property)
      if (.not. has_word(models, desk%config%materials(m)%model)) then
        call desk%fault(GROUP, k, 'material', quoted(field%material)//' is '// &
          trim(desk%config%materials(m)%model)//' and has no '//in_words(field%property)// &
          ' to vary (allowed: a material with model = '//listed(models)//')')
        return
      end if
      if (has_word('young density', field%property) .and. &
        desk%config%loading%body_force /= 'none') then
        call desk%fault(GROUP, k, 'property', 'the manufactured solution is that of one '// &
        in_words(field%property)//' (allowed: body_force = ''none'')')
      end if
      call check_mean(desk, k, m)
      call check_dilation(desk, k, m)
    end associate
  end subroutine check_material

  !> Models whose points may differ in a property.
  pure function models_with(property) result(models)
    character(len=*), intent(in) :: property
    character(len=:), allocatable :: models

    select case (property)
    case ('undrained_strength')
      models = 'tresca von_mises'
    case ('young', 'density')
      models = 'linear_elastic neo_hookean mohr_coulomb drucker_prager von_mises tresca'
    case ('cohesion')
      models = 'mohr_coulomb drucker_prager'
    case default
      models = 'mohr_coulomb'
    end select
  end function models_with

  pure function in_words(property) result(words)
    character(len=*), intent(in) :: property
    character(len=:), allocatable :: words
    integer :: i

    words = trim(property)
    do i = 1, len(words)
      if (words(i:i) == '_') words(i:i) = ' '
    end do
  end function in_words

  !> A field that covers all of its material has the same mean as the homogeneous case.
  subroutine check_mean(desk, k, m)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k, m
    real(wp) :: value
    character(len=:), allocatable :: property

    associate (field => desk%config%random_fields(k), material => desk%config%materials(m))
      if (abs(field%mean_gradient) > 0.0_wp) return
      if (field%body /= '' .or. size(field%region) > 0) return
      property = trim(field%property)
      if (property == 'tan_friction_angle') return
      value = nominal_value(material, property)
      if (.not. desk%good(GROUP, k, 'mean') .or. .not. desk%good('material', m, property)) return
      if (abs(field%mean - value) > 0.0_wp) call desk%fault(GROUP, k, 'mean', &
        to_text(field%mean)//' differs from '//property//' = '//to_text(value)// &
        ' of material '//quoted(material%name)//' (line '// &
        to_text(desk%nml%line_of('material', m, property))//'), with which the '// &
        'homogeneous case runs (allowed: the same value in both)')
    end associate
  end subroutine check_mean

  !> Friction angles do not fall below the dilation angle, unless that varies, too: then it follows.
  subroutine check_dilation(desk, k, m)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k, m
    real(wp) :: least

    associate (field => desk%config%random_fields(k), material => desk%config%materials(m))
      if (.not. desk%good('material', m, 'dilation_angle')) return
      if (any(desk%config%random_fields%property == 'dilation_angle')) return
      select case (field%property)
      case ('friction_angle')
        least = field%bounds(1)
      case ('tan_friction_angle')
        least = atan(field%bounds(1))/DEGREE
      case default
        return
      end select
      if (material%dilation_angle > least) call desk%fault(GROUP, k, 'lower', &
        'friction angles down to '//to_text(least)//' fall below dilation_angle = '// &
        to_text(material%dilation_angle)//' of material '//quoted(material%name)// &
        ' (allowed: lower of at least dilation_angle)')
    end associate
  end subroutine check_dilation

  !> One of cov and sd, and trends that fit.
  subroutine check_moments(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k

    associate (field => desk%config%random_fields(k))
      if (is_given(desk, GROUP, k, 'cov') .and. is_given(desk, GROUP, k, 'sd')) then
        call desk%fault(GROUP, k, 'sd', 'cov is given, too (allowed: one of them)')
      else if (k == 1 .and. is_given(desk, GROUP, k, 'sd') .and. desk%config%has_study) then
        if (any(desk%config%study%cov > 0.0_wp)) call desk%fault(GROUP, k, 'sd', '&study lists '// &
          'cov, which takes its place (allowed: one of them)')
      else if (size(field%cov) == 0 .and. size(field%sd) == 0 .and. .not. is_given(desk, GROUP, k, &
        'cov') .and. .not. is_given(desk, GROUP, k, 'sd')) then
        call desk%fault(GROUP, k, 'cov', 'this key is missing (Coefficient of variation; '// &
          'allowed: cov, or sd, the standard deviation)')
      end if
      if (size(field%cov) == 0) return
      if (desk%good(GROUP, k, 'mean mean_gradient') .and. .not. has_trend(field) .and. &
        .not. abs(field%mean) > 0.0_wp) call desk%fault(GROUP, k, 'cov', 'of a mean of 0 makes '// &
        'no standard deviation (allowed: sd instead of cov)')
      if (abs(field%sd_gradient) > 0.0_wp) call desk%fault(GROUP, k, 'sd_gradient', 'with cov, '// &
        'the standard deviation follows the mean (allowed: sd and sd_gradient)')
    end associate
  end subroutine check_moments

  logical function is_given(desk, group_name, occurrence, key)
    type(desk_t), intent(in) :: desk
    character(len=*), intent(in) :: group_name, key
    integer, intent(in) :: occurrence
    integer :: g

    g = desk%nml%locate(group_name, occurrence)
    is_given = .false.
    if (g > 0) is_given = desk%nml%groups(g)%find(key) > 0
  end function is_given

  !> lower < mean < upper, within what the property can be.
  subroutine check_bounds(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k

    associate (field => desk%config%random_fields(k))
      if (.not. desk%good(GROUP, k, 'property mean')) return
      associate (lower => field%bounds(1), upper => field%bounds(2))
        if (.not. lower < upper) then
          call desk%fault(GROUP, k, 'upper', to_text(upper)//' is not above lower = '// &
            to_text(lower))
        else if (field%distribution /= 'truncated_normal' .and. .not. has_trend(field)) then
          if (.not. lower < field%mean) call desk%fault(GROUP, k, 'lower', &
            to_text(lower)//' is not below mean = '//to_text(field%mean))
          if (.not. field%mean < upper) call desk%fault(GROUP, k, 'upper', &
            to_text(upper)//' is not above mean = '//to_text(field%mean))
        end if
        select case (field%property)
        case ('friction_angle', 'dilation_angle')
          if (.not. upper < RIGHT_ANGLE) call desk%fault(GROUP, k, 'upper', to_text(upper)// &
            ' is no '//in_words(field%property)//' (allowed: less than 90 deg)')
        case ('young', 'density')
          if (.not. lower > 0.0_wp) call desk%fault(GROUP, k, 'lower', to_text(lower)// &
            ' is no '//in_words(field%property)//' (allowed: more than 0)')
        case default ! any
        end select
        if (lower < 0.0_wp) call desk%fault(GROUP, k, 'lower', to_text(lower)// &
          ' is no '//in_words(field%property)//' (allowed: 0 or more)')
      end associate
    end associate
  end subroutine check_bounds

  pure logical function has_trend(field)
    type(random_field_config_t), intent(in) :: field

    has_trend = abs(field%mean_gradient) > 0.0_wp
  end function has_trend

  !> Mean and standard deviation stay what they must be down to the lowest place and up to the
  !> highest. Points lie between, so that a mean may vanish at the surface.
  subroutine check_trend(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k
    real(wp) :: heights(2), datum, least, mean, sd
    integer :: i

    associate (field => desk%config%random_fields(k))
      if (.not. desk%good(GROUP, k, 'mean mean_gradient sd_gradient distribution')) return
      if (.not. (abs(field%mean_gradient) > 0.0_wp .or. abs(field%sd_gradient) > 0.0_wp)) return
      call find_heights(desk, k, heights)
      if (.not. heights(1) < heights(2)) return
      datum = heights(2)
      if (size(field%datum) > 0) datum = field%datum(1)
      least = field%bounds(1)
      if (has_word('lognormal gamma weibull', field%distribution)) least = max(least, 0.0_wp)
      do i = 1, 2
        mean = field%mean + field%mean_gradient*(datum - heights(i))
        if (field%distribution /= 'truncated_normal' .and. .not. (mean >= least .and. &
          mean <= field%bounds(2))) then
          call desk%fault(GROUP, k, 'mean_gradient', 'at y = '//to_text(heights(i))// &
            ' the mean is '//to_text(mean, 4)//' (allowed: '//to_text(least, 4)//' to '// &
            upper_text(field%bounds(2))//')')
          exit
        end if
        if (size(field%sd) == 0) cycle
        sd = field%sd(1) + field%sd_gradient*(datum - heights(i))
        if (.not. sd > 0.0_wp) then
          call desk%fault(GROUP, k, 'sd_gradient', 'at y = '//to_text(heights(i))// &
            ' the standard deviation is '//to_text(sd, 4)//' (allowed: more than 0)')
          exit
        end if
      end do
    end associate
  end subroutine check_trend

  pure function upper_text(upper) result(text)
    real(wp), intent(in) :: upper
    character(len=:), allocatable :: text

    text = to_text(upper, 4)
    if (upper >= huge(upper)) text = 'any'
  end function upper_text

  !> Lowest and highest place that a field reaches; the same twice where that is not known from the
  !> case file alone.
  subroutine find_heights(desk, k, heights)
    type(desk_t), intent(in) :: desk
    integer, intent(in) :: k
    real(wp), intent(out) :: heights(2)
    integer :: i

    heights = [huge(1.0_wp), -huge(1.0_wp)]
    associate (field => desk%config%random_fields(k))
      do i = 1, size(desk%config%bodies)
        associate (body => desk%config%bodies(i))
          if (body%material_index /= field%material_index .or. field%material_index == 0) cycle
          if (field%body_index > 0 .and. field%body_index /= i) cycle
          select case (body%shape)
          case ('rectangle')
            if (.not. desk%good('body', i, 'y height')) exit
            heights = [min(heights(1), body%y), max(heights(2), body%y + body%height)]
          case ('disc')
            if (.not. desk%good('body', i, 'y radius')) exit
            heights = [min(heights(1), body%y - body%radius), max(heights(2), body%y + body%radius)]
          case ('polygon')
            if (.not. desk%good('body', i, 'vertices') .or. size(body%vertices) < 6) exit
            heights = [min(heights(1), minval(body%vertices(2::2))), &
              max(heights(2), maxval(body%vertices(2::2)))]
          case default
            exit
          end select
        end associate
      end do
      if (i <= size(desk%config%bodies)) then
        heights = 0.0_wp
      else if (size(field%region) > 1) then
        heights = [max(heights(1), minval(field%region(2::2))), &
          min(heights(2), maxval(field%region(2::2)))]
      end if
    end associate
  end subroutine find_heights

  !> The distribution exists with these moments and ends.
  subroutine check_law(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k
    real(wp) :: sd, left, right

    associate (field => desk%config%random_fields(k))
      if (.not. desk%good(GROUP, k, 'distribution mean')) return
      sd = largest_sd(desk, k)
      associate (lower => field%bounds(1), upper => field%bounds(2), mean => field%mean)
        select case (field%distribution)
        case ('lognormal', 'gamma', 'weibull')
          if (mean > 0.0_wp .or. has_trend(field)) return
          call desk%fault(GROUP, k, 'mean', to_text(mean)//' is no mean of a '// &
            trim(field%distribution)//' distribution (allowed: more than 0)')
        case ('beta')
          if (upper >= huge(upper)) then
            call desk%fault(GROUP, k, 'upper', 'a beta distribution needs both ends, lower and '// &
              'upper')
          else if (lower < mean .and. mean < upper .and. sd**2 >= (mean - lower) &
            *(upper - mean)) then
            call desk%fault(GROUP, k, 'distribution', 'a standard deviation of '//to_text(sd)// &
              ' is too large for a beta distribution between '//to_text(lower)//' and '// &
              to_text(upper)//' (allowed: less than '//to_text(sqrt((mean - lower) &
              *(upper - mean)), 4)//')')
          end if
        case ('truncated_normal')
          if (.not. sd > 0.0_wp .or. .not. lower < upper) return
          left = (lower - mean)/sd
          right = min((upper - mean)/sd, huge(1.0_wp))
          if (left > 0.0_wp) then
            left = normal_upper_tail(left) - normal_upper_tail(right)
          else
            left = normal_cdf(right) - normal_cdf(left)
          end if
          if (left < NOTHING) call desk%fault(GROUP, k, 'distribution', 'between lower = '// &
            to_text(lower)//' and upper = '//to_text(upper)//' nothing is left of a normal '// &
            'distribution with mean '//to_text(mean)//' and standard deviation '//to_text(sd)// &
            ' (its share is '//to_text(left, 2)//')')
        case default ! any
        end select
      end associate
    end associate
  end subroutine check_law

  !> At the datum, for the largest COV of the study; 0 if it is not known.
  pure real(wp) function largest_sd(desk, k) result(sd)
    type(desk_t), intent(in) :: desk
    integer, intent(in) :: k

    sd = 0.0_wp
    associate (field => desk%config%random_fields(k))
      if (size(field%sd) > 0) then
        sd = field%sd(1)
      else if (k == 1 .and. size(desk%config%study%cov) > 0) then
        sd = maxval(desk%config%study%cov)*abs(field%mean)
      else if (size(field%cov) > 0) then
        sd = field%cov(1)*abs(field%mean)
      end if
    end associate
  end function largest_sd

  !> The correlation exists, and its averages and conditions can be had.
  subroutine check_correlation(desk, k)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: k
    logical :: is_binary

    associate (field => desk%config%random_fields(k))
      if (.not. desk%good(GROUP, k, 'form averaging rotation distribution')) return
      is_binary = field%acf == 'bin'
      if (k == 1 .or. field%acf == '') is_binary = is_binary .or. &
        any(desk%config%study%acf == 'bin')
      if (field%form == 'radial' .and. is_binary) call desk%fault(GROUP, k, 'form', &
        '''radial'' does not exist for acf = ''bin'': as a function of distance it is no '// &
        'correlation in the plane (allowed: ''product'')')
      if (field%averaging == 'cell' .and. (field%form == 'radial' .or. abs(field%rotation) &
        > 0.0_wp)) call desk%fault(GROUP, k, 'averaging', '''cell'' is for form = ''product'' '// &
        'without rotation (allowed: ''none'')')
      if (field%averaging == 'cell' .and. &
        .not. has_word('normal lognormal', field%distribution)) then
        call desk%fault(GROUP, k, 'averaging', 'averages of a '//trim(field%distribution)// &
        ' field have another distribution (allowed: ''none'', or distribution = ''normal'' or '// &
        '''lognormal'', whose averages are geometric)')
      end if
      if (field%file /= '' .and. field%data /= '') call desk%fault(GROUP, k, 'data', &
        'fields from a file are what they are (allowed: data or file)')
      if (field%file /= '' .and. (is_given(desk, 'study', 1, 'acf') .or. is_given(desk, 'study', &
        1, 'cov'))) call desk%fault(GROUP, k, 'file', &
        'fields from a file are no study of correlation functions (allowed: without &study)')
    end associate
  end subroutine check_correlation

  !> Pairs of different fields at the same points, each once, and a matrix that can be.
  subroutine check_cross_correlations(desk)
    type(desk_t), intent(inout) :: desk
    real(wp) :: matrix(size(desk%config%random_fields), size(desk%config%random_fields))
    integer :: i, k, failed_row
    logical :: all_good

    matrix = 0.0_wp
    do k = 1, size(matrix, 1)
      matrix(k, k) = 1.0_wp
    end do
    all_good = .true.
    do i = 1, size(desk%config%cross_correlations)
      call check_pair(desk, i, matrix, all_good)
    end do
    if (size(desk%config%cross_correlations) == 0 .or. .not. all_good) return
    call factor_cholesky(matrix, failed_row)
    if (failed_row > 0) call desk%fault('cross_correlation', size(desk%config%cross_correlations), &
      'coefficient', 'no fields can have these correlations: their matrix is not positive '// &
      'definite (it fails at '//quoted(desk%config%random_fields(failed_row)%name)// &
      '; allowed: smaller coefficients)')
  end subroutine check_cross_correlations

  subroutine check_pair(desk, i, matrix, all_good)
    type(desk_t), intent(inout) :: desk
    integer, intent(in) :: i
    real(wp), intent(inout) :: matrix(:, :)
    logical, intent(inout) :: all_good
    character(len=*), parameter :: PAIR = 'cross_correlation'
    character(len=:), allocatable :: fault
    integer :: k

    associate (cross => desk%config%cross_correlations(i), fields => desk%config%random_fields)
      all_good = all_good .and. desk%good(PAIR, i, 'between coefficient')
      if (.not. desk%good(PAIR, i, 'between coefficient')) return
      fault = ''
      do k = 1, 2
        if (cross%fields(k) == 0) fault = 'there is no field '//quoted(cross%between(k))
      end do
      if (len(fault) == 0) then
        associate (first => fields(cross%fields(1)), second => fields(cross%fields(2)))
          if (cross%fields(1) == cross%fields(2)) then
            fault = 'a field is not correlated with itself'
          else if (abs(matrix(cross%fields(1), cross%fields(2))) > 0.0_wp) then
            fault = 'these two are given twice'
          else if (.not. at_same_points(first, second)) then
            fault = 'the two fields are not at the same points (allowed: the same material, '// &
              'body and region)'
          else if (first%file /= '' .or. second%file /= '') then
            fault = 'fields from a file are what they are'
          else if ((first%data /= '' .or. second%data /= '') .and. &
            .not. have_same_correlation(first, second, acf_of(desk, cross%fields(1)), &
            acf_of(desk, cross%fields(2)))) then
            fault = 'with measurements, fields that are correlated have the same '// &
              'autocorrelation (allowed: equal acf, smoothness, form, scales, rotation, averaging)'
          end if
        end associate
      end if
      if (len(fault) > 0) then
        all_good = .false.
        call desk%fault(PAIR, i, 'between', fault)
        return
      end if
      matrix(cross%fields(1), cross%fields(2)) = cross%coefficient
      matrix(cross%fields(2), cross%fields(1)) = cross%coefficient
    end associate
  end subroutine check_pair

  pure logical function at_same_points(a, b) result(same)
    type(random_field_config_t), intent(in) :: a, b

    same = a%material == b%material .and. a%body == b%body .and. size(a%region) == size(b%region)
    if (same) same = all(abs(a%region - b%region) <= 0.0_wp)
  end function at_same_points

  !> Autocorrelation function of field k; 'study' where there are several.
  pure function acf_of(desk, k) result(acf)
    type(desk_t), intent(in) :: desk
    integer, intent(in) :: k
    character(len=:), allocatable :: acf

    acf = trim(desk%config%random_fields(k)%acf)
    if (k > 1 .and. acf /= '') return
    acf = 'study'
    if (size(desk%config%study%acf) == 1) acf = trim(desk%config%study%acf(1))
  end function acf_of

  pure logical function have_same_correlation(a, b, acf_a, acf_b) result(same)
    type(random_field_config_t), intent(in) :: a, b
    character(len=*), intent(in) :: acf_a, acf_b

    same = acf_a == acf_b .and. a%form == b%form .and. a%averaging == b%averaging &
      .and. all(abs([a%smoothness - b%smoothness, a%scale_x - b%scale_x, a%scale_y - b%scale_y, &
      a%rotation - b%rotation]) <= 0.0_wp)
  end function have_same_correlation
end module sg_check_random_fields
