!> Material points ("particles") and the bodies they belong to, as one array per quantity.
!> Points of a body are consecutive, so that a loop over a body needs no look-up of its material.
!> Plane strain: quantities are per metre of thickness. Stress is positive in tension.
module sg_particles
  use sg_kinds, only: dp, wp
  implicit none
  private

  public :: particles_t, body_points_t

  !> The points of one body.
  type :: body_points_t
    !> First and last point in the arrays of `particles_t`.
    integer :: first, last
    !> Index into the materials of the scene.
    integer :: material
    !> Full width and height of a point at the start, in m.
    real(wp) :: width, height
    !> Its points are what runouts, heights and the profile are measured on.
    logical :: is_measured = .true.
  end type body_points_t

  type :: particles_t
    integer :: count = 0
    type(body_points_t), allocatable :: bodies(:)
    !> Place that positions are counted from, in m.
    real(dp) :: origin(2) = 0.0_dp
    !> Position and velocity, [count], in m and m/s.
    real(wp), allocatable :: x(:), y(:), vx(:), vy(:)
    !> Initial position, [count], in m.
    real(wp), allocatable :: x_start(:), y_start(:)
    !> Mass in kg/m, the same for all points of a body unless their density varies, and current
    !> volume in m^2 (per metre of thickness), [count].
    real(wp), allocatable :: mass(:), volume(:)
    !> Full width and height of the domain of a point, [count], in m; they change with cpGIMP only.
    real(wp), allocatable :: width(:), height(:)
    !> Cauchy stress, [count], in Pa.
    real(wp), allocatable :: sxx(:), syy(:), szz(:), sxy(:)
    !> Volumetric opening of a point that carries no stress, [count]; a strain >= 0.
    real(wp), allocatable :: gap(:)
    !> Stress that open cracks have taken (sg_cracks), xx, yy, zz, xy in Pa, [4, count]; size 0
    !> where no point can crack. The volume of a cracked point leaves the cracks out.
    real(wp), allocatable :: crack(:, :)
    !> Mohr-Coulomb strength, [count]: sine of the friction angle, 2 c cos(phi) in Pa, and the
    !> largest principal stress that the point can carry, min(tension strength, c cot(phi)), in Pa.
    !> Drucker-Prager points whose strength varies have their k and limit of mean stress here.
    real(wp), allocatable :: sin_friction(:), cohesion_term(:), tension_limit(:)
    !> Deformation gradient, [count]; size 0 where neither material nor weights need it.
    real(wp), allocatable :: fxx(:), fxy(:), fyx(:), fyy(:)
    !> Gradient of the velocity, [4, count], in 1/s: d vx/dx, d vy/dx, d vx/dy, d vy/dy; size 0 but
    !> for transfers that carry it.
    real(wp), allocatable :: velocity_gradient(:, :)
    !> Friction angle as it was given, [count], in degrees; for softening and output.
    real(wp), allocatable :: friction_angle(:)
    !> Properties that the member varies, [count]: Pa, kg/m^3 and degrees (the dilation angle at
    !> most the friction angle), not a number where the material has no such property. Size 0 for
    !> what is the same in each material, which is then the one to ask.
    real(wp), allocatable :: cohesion(:), undrained_strength(:), young(:), density(:)
    real(wp), allocatable :: dilation_angle(:)
    !> Sine of that dilation angle, [count] or size 0.
    real(wp), allocatable :: sin_dilation(:)
    !> Equivalent deviatoric plastic strain, [count]; size 0 where no material needs it and nobody
    !> asked for it.
    real(wp), allocatable :: plastic_strain(:)
  contains
    procedure :: init => init_particles
    procedure :: is_measured
    procedure :: track_cracks
    procedure :: track_plastic_strain
    procedure :: track_deformation
    procedure :: carry_gradient
  end type particles_t

contains

  !> All arrays at the length `count` and zero, but for those that must be asked for.
  subroutine init_particles(this, count)
    class(particles_t), intent(out) :: this
    integer, intent(in) :: count

    this%count = count
    allocate (this%x(count), this%y(count), this%vx(count), this%vy(count))
    allocate (this%x_start(count), this%y_start(count), this%mass(count), this%volume(count))
    allocate (this%sxx(count), this%syy(count), this%szz(count), this%sxy(count))
    allocate (this%gap(count), this%sin_friction(count), this%cohesion_term(count))
    allocate (this%tension_limit(count), this%friction_angle(count))
    allocate (this%width(count), this%height(count))
    allocate (this%velocity_gradient(4, 0), this%crack(4, 0))
    allocate (this%plastic_strain(0), this%fxx(0), this%fxy(0), this%fyx(0), this%fyy(0))
    allocate (this%cohesion(0), this%undrained_strength(0), this%young(0), this%density(0))
    allocate (this%dilation_angle(0), this%sin_dilation(0))
    this%x = 0.0_wp; this%y = 0.0_wp; this%vx = 0.0_wp; this%vy = 0.0_wp
    this%x_start = 0.0_wp; this%y_start = 0.0_wp; this%mass = 0.0_wp; this%volume = 0.0_wp
    this%sxx = 0.0_wp; this%syy = 0.0_wp; this%szz = 0.0_wp; this%sxy = 0.0_wp
    this%gap = 0.0_wp; this%sin_friction = 0.0_wp; this%cohesion_term = 0.0_wp
    this%tension_limit = 0.0_wp; this%friction_angle = 0.0_wp
    this%width = 0.0_wp; this%height = 0.0_wp
  end subroutine init_particles

  !> Mask of the points of measured bodies, [count].
  pure function is_measured(this) result(mask)
    class(particles_t), intent(in) :: this
    logical :: mask(this%count)
    integer :: body

    do body = 1, size(this%bodies)
      mask(this%bodies(body)%first:this%bodies(body)%last) = this%bodies(body)%is_measured
    end do
  end function is_measured

  !> Keeps cracks from now on, from none.
  subroutine track_cracks(this)
    class(particles_t), intent(inout) :: this

    if (size(this%crack) > 0) return
    deallocate (this%crack)
    allocate (this%crack(4, this%count))
    this%crack = 0.0_wp
  end subroutine track_cracks

  !> Keeps the plastic strain from now on, from 0.
  subroutine track_plastic_strain(this)
    class(particles_t), intent(inout) :: this

    if (size(this%plastic_strain) > 0) return
    deallocate (this%plastic_strain)
    allocate (this%plastic_strain(this%count))
    this%plastic_strain = 0.0_wp
  end subroutine track_plastic_strain

  !> Keeps the deformation gradient from now on, from the identity.
  subroutine track_deformation(this)
    class(particles_t), intent(inout) :: this

    if (size(this%fxx) > 0) return
    deallocate (this%fxx, this%fxy, this%fyx, this%fyy)
    allocate (this%fxx(this%count), this%fxy(this%count), this%fyx(this%count), &
      this%fyy(this%count))
    this%fxx = 1.0_wp
    this%fxy = 0.0_wp
    this%fyx = 0.0_wp
    this%fyy = 1.0_wp
  end subroutine track_deformation

  !> Keeps the gradient of the velocity from now on, from 0.
  subroutine carry_gradient(this)
    class(particles_t), intent(inout) :: this

    deallocate (this%velocity_gradient)
    allocate (this%velocity_gradient(4, this%count))
    this%velocity_gradient = 0.0_wp
  end subroutine carry_gradient
end module sg_particles
