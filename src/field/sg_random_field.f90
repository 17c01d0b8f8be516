!> The random field of one property: its points, its law at each of them, its correlation. What
!> makes Gaussian fields of several together is in sg_random_fields.
module sg_random_field
  use sg_config, only: random_field_config_t
  use sg_correlation, only: correlation_t
  use sg_errors, only: error_t
  use sg_kinds, only: wp
  use sg_marginal, only: marginal_t
  use sg_polygon, only: polygon_contains
  use sg_text, only: to_text
  implicit none
  private

  public :: field_points_t, random_field_t

  !> The points of a material at the start.
  type :: field_points_t
    !> Places and sizes, in m, and the body of each, [n].
    real(wp), allocatable :: x(:), y(:), width(:), height(:)
    integer, allocatable :: body(:)
  end type field_points_t

  !> Laws of one coefficient of variation.
  type :: kept_laws_t
    real(wp) :: cov = 0.0_wp
    real(wp), allocatable :: mean(:), sd(:)
    integer, allocatable :: law(:)
    type(marginal_t), allocatable :: laws(:)
  end type kept_laws_t

  type :: random_field_t
    type(random_field_config_t) :: config
    type(correlation_t) :: correlation
    !> Points of the field among those of its material, and their places in m, [n].
    integer, allocatable :: points(:)
    real(wp), allocatable :: x(:), y(:)
    !> Width and height of its points, in m; of the first, where they differ.
    real(wp) :: cell(2) = 0.0_wp
    !> Mean and standard deviation at each point, [n], in the unit of the property.
    real(wp), allocatable :: mean(:), sd(:)
    !> Law of each point, [n], and the different laws.
    integer, allocatable :: law(:)
    type(marginal_t), allocatable :: laws(:)
    !> Height at which depths begin, in m.
    real(wp) :: datum = 0.0_wp
    !> Laws of other coefficients of variation than the present one, whose place there is empty:
    !> members of a study go through all of them in turn.
    type(kept_laws_t), allocatable, private :: kept(:)
    integer, private :: present = 0
  contains
    procedure :: place
    procedure :: set_cov
    procedure, private :: make_laws
    procedure, private :: exchange_laws
    procedure :: moments_at
    procedure :: law_at
    procedure :: transform
  end type random_field_t

contains

  !> Finds the points of the field. `error`: correlation as for sg_correlation.
  subroutine place(this, config, acf, points, error)
    class(random_field_t), intent(inout) :: this
    type(random_field_config_t), intent(in) :: config
    !> One of ACF_NAMES of sg_autocorrelation.
    character(len=*), intent(in) :: acf
    !> Of its material.
    type(field_points_t), intent(in) :: points
    type(error_t), allocatable, intent(out) :: error
    integer :: i

    this%config = config
    this%points = pack([(i, i=1, size(points%x))], [(is_covered(config, points, i), i=1, &
      size(points%x))])
    this%x = points%x(this%points)
    this%y = points%y(this%points)
    if (size(this%points) > 0) then
      this%cell = [points%width(this%points(1)), points%height(this%points(1))]
      this%datum = maxval(this%y + 0.5_wp*points%height(this%points))
    end if
    if (size(config%datum) > 0) this%datum = config%datum(1)
    call this%correlation%init(acf, [config%scale_x, config%scale_y], error, config%smoothness, &
      config%form == 'radial', config%rotation)
    if (allocated(error) .or. config%averaging /= 'cell') return
    call this%correlation%average_over(this%cell, error)
  end subroutine place

  pure logical function is_covered(config, points, i)
    type(random_field_config_t), intent(in) :: config
    type(field_points_t), intent(in) :: points
    integer, intent(in) :: i

    is_covered = config%body_index == 0 .or. points%body(i) == config%body_index
    if (is_covered .and. size(config%region) > 0) is_covered = polygon_contains(config%region, &
      points%x(i), points%y(i))
  end function is_covered

  !> The laws for a coefficient of variation; one that is not above 0 leaves that of the case or its
  !> standard deviation. The Gaussian field stays as it is.
  subroutine set_cov(this, cov, error)
    class(random_field_t), intent(inout) :: this
    real(wp), intent(in) :: cov
    type(error_t), allocatable, intent(out) :: error
    integer :: k

    if (cov > 0.0_wp) this%config%cov = [cov]
    call find_place(cov, this%kept, k)
    ! The present laws go to their place, those asked for come from theirs if they were there.
    if (this%present > 0) call this%exchange_laws(this%present)
    this%present = k
    call this%exchange_laws(k)
    if (.not. allocated(this%laws)) call this%make_laws(error)
  end subroutine set_cov

  !> Place `k` of a coefficient of variation among those that laws are kept of; a new one if it has
  !> none.
  subroutine find_place(cov, kept, k)
    real(wp), intent(in) :: cov
    type(kept_laws_t), allocatable, intent(inout) :: kept(:)
    integer, intent(out) :: k
    type(kept_laws_t), allocatable :: more(:)

    if (.not. allocated(kept)) allocate (kept(0))
    do k = 1, size(kept)
      if (.not. abs(kept(k)%cov - cov) > 0.0_wp) return
    end do
    allocate (more(size(kept) + 1))
    more(:size(kept)) = kept
    more(k)%cov = cov
    call move_alloc(more, kept)
  end subroutine find_place

  !> Exchanges the present laws with those in place k, of which either may be none.
  subroutine exchange_laws(this, k)
    class(random_field_t), intent(inout) :: this
    integer, intent(in) :: k
    type(kept_laws_t) :: here

    call move_alloc(this%mean, here%mean)
    call move_alloc(this%sd, here%sd)
    call move_alloc(this%law, here%law)
    call move_alloc(this%laws, here%laws)
    associate (other => this%kept(k))
      call move_alloc(other%mean, this%mean)
      call move_alloc(other%sd, this%sd)
      call move_alloc(other%law, this%law)
      call move_alloc(other%laws, this%laws)
      call move_alloc(here%mean, other%mean)
      call move_alloc(here%sd, other%sd)
      call move_alloc(here%law, other%law)
      call move_alloc(here%laws, other%laws)
    end associate
  end subroutine exchange_laws

  !> Moments at all points and the laws that they make.
  subroutine make_laws(this, error)
    class(random_field_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    integer, allocatable :: first(:)
    integer :: i, k

    allocate (this%mean(size(this%x)), this%sd(size(this%x)), this%law(size(this%x)))
    allocate (first(0))
    do i = 1, size(this%x)
      call this%moments_at(this%y(i), this%mean(i), this%sd(i))
      ! Most points have the law of the one before.
      k = 0
      if (i > 1) then
        k = this%law(i - 1)
        if (abs(this%mean(i) - this%mean(i - 1)) > 0.0_wp .or. &
          abs(this%sd(i) - this%sd(i - 1)) > 0.0_wp) k = 0
      end if
      this%law(i) = k
      if (k > 0) cycle
      do k = 1, size(first)
        if (.not. abs(this%mean(i) - this%mean(first(k))) > 0.0_wp .and. &
          .not. abs(this%sd(i) - this%sd(first(k))) > 0.0_wp) exit
      end do
      if (k > size(first)) first = [first, i]
      this%law(i) = k
    end do
    allocate (this%laws(size(first)))
    do k = 1, size(first)
      call init_law(this, this%mean(first(k)), this%sd(first(k)), this%laws(k), error)
      if (allocated(error)) return
    end do
  end subroutine make_laws

  subroutine init_law(this, mean, sd, law, error)
    class(random_field_t), intent(in) :: this
    real(wp), intent(in) :: mean, sd
    type(marginal_t), intent(out) :: law
    type(error_t), allocatable, intent(out) :: error

    call law%init(this%config%distribution, mean, sd, this%config%bounds(1), &
      this%config%bounds(2), error)
    if (allocated(error)) error%message = 'random field '//trim(this%config%name)// &
      ', where its mean is '//to_text(mean, 4)//' and its standard deviation '//to_text(sd, 4)// &
      ': '//error%message
  end subroutine init_law

  !> Mean and standard deviation at the height y, in the unit of the property: linear in the depth
  !> below the datum.
  pure subroutine moments_at(this, y, mean, sd)
    class(random_field_t), intent(in) :: this
    real(wp), intent(in) :: y
    real(wp), intent(out) :: mean, sd

    mean = this%config%mean + this%config%mean_gradient*(this%datum - y)
    if (size(this%config%cov) > 0) then
      sd = this%config%cov(1)*abs(mean)
    else
      sd = this%config%sd(1) + this%config%sd_gradient*(this%datum - y)
    end if
  end subroutine moments_at

  !> The law at any height.
  subroutine law_at(this, y, law, error)
    class(random_field_t), intent(in) :: this
    real(wp), intent(in) :: y
    type(marginal_t), intent(out) :: law
    type(error_t), allocatable, intent(out) :: error
    real(wp) :: mean, sd

    call this%moments_at(y, mean, sd)
    call init_law(this, mean, sd, law, error)
  end subroutine law_at

  !> From Gaussian values to those of the property, [n]; `clipped` counts those set to a bound.
  subroutine transform(this, z, values, clipped)
    class(random_field_t), intent(in) :: this
    real(wp), contiguous, intent(in) :: z(:)
    real(wp), contiguous, intent(out) :: values(:)
    integer, intent(out) :: clipped
    integer :: first, last, here

    clipped = 0
    ! Runs of points with one law: rows of a body, or all of it.
    first = 1
    do while (first <= size(z))
      last = first
      do while (last < size(z))
        if (this%law(last + 1) /= this%law(first)) exit
        last = last + 1
      end do
      call this%laws(this%law(first))%transform(z(first:last), values(first:last), here)
      clipped = clipped + here
      first = last + 1
    end do
  end subroutine transform
end module sg_random_field
