!> Points between the double precision of scenes and observers and that of the kernel. Where the
!> kernel is double too, these are plain copies.
module sg_particle_copy
  use sg_kinds, only: dp, wp
  use sg_observer, only: shown_particles_t
  use sg_particles, only: particles_t
  implicit none
  private

  public :: take_particles, show_particles

contains

  !> Points of a scene, for the kernel, which counts positions from `origin` (m).
  subroutine take_particles(from, origin, to)
    type(shown_particles_t), intent(in) :: from
    real(dp), intent(in) :: origin(2)
    type(particles_t), intent(out) :: to

    to%count = from%count
    to%origin = origin
    allocate (to%bodies(size(from%bodies)))
    to%bodies%first = from%bodies%first
    to%bodies%last = from%bodies%last
    to%bodies%material = from%bodies%material
    to%bodies%width = real(from%bodies%width, wp)
    to%bodies%height = real(from%bodies%height, wp)
    to%bodies%is_measured = from%bodies%is_measured
    to%x = real(from%x - origin(1), wp)
    to%y = real(from%y - origin(2), wp)
    to%vx = real(from%vx, wp)
    to%vy = real(from%vy, wp)
    to%x_start = real(from%x_start - origin(1), wp)
    to%y_start = real(from%y_start - origin(2), wp)
    to%mass = real(from%mass, wp)
    to%volume = real(from%volume, wp)
    to%width = real(from%width, wp)
    to%height = real(from%height, wp)
    to%sxx = real(from%sxx, wp)
    to%syy = real(from%syy, wp)
    to%szz = real(from%szz, wp)
    to%sxy = real(from%sxy, wp)
    to%gap = real(from%gap, wp)
    to%crack = real(from%crack, wp)
    to%sin_friction = real(from%sin_friction, wp)
    to%cohesion_term = real(from%cohesion_term, wp)
    to%tension_limit = real(from%tension_limit, wp)
    to%fxx = real(from%fxx, wp)
    to%fxy = real(from%fxy, wp)
    to%fyx = real(from%fyx, wp)
    to%fyy = real(from%fyy, wp)
    to%velocity_gradient = real(from%velocity_gradient, wp)
    to%friction_angle = real(from%friction_angle, wp)
    to%cohesion = real(from%cohesion, wp)
    to%undrained_strength = real(from%undrained_strength, wp)
    to%young = real(from%young, wp)
    to%density = real(from%density, wp)
    to%dilation_angle = real(from%dilation_angle, wp)
    to%sin_dilation = real(from%sin_dilation, wp)
    to%plastic_strain = real(from%plastic_strain, wp)
  end subroutine take_particles

  !> Points of the kernel, for an observer, who counts positions from (0, 0).
  subroutine show_particles(from, to)
    type(particles_t), intent(in) :: from
    type(shown_particles_t), intent(out) :: to

    to%count = from%count
    allocate (to%bodies(size(from%bodies)))
    to%bodies%first = from%bodies%first
    to%bodies%last = from%bodies%last
    to%bodies%material = from%bodies%material
    to%bodies%width = real(from%bodies%width, dp)
    to%bodies%height = real(from%bodies%height, dp)
    to%bodies%is_measured = from%bodies%is_measured
    to%x = real(from%x, dp) + from%origin(1)
    to%y = real(from%y, dp) + from%origin(2)
    to%vx = real(from%vx, dp)
    to%vy = real(from%vy, dp)
    to%x_start = real(from%x_start, dp) + from%origin(1)
    to%y_start = real(from%y_start, dp) + from%origin(2)
    to%mass = real(from%mass, dp)
    to%volume = real(from%volume, dp)
    to%width = real(from%width, dp)
    to%height = real(from%height, dp)
    to%sxx = real(from%sxx, dp)
    to%syy = real(from%syy, dp)
    to%szz = real(from%szz, dp)
    to%sxy = real(from%sxy, dp)
    to%gap = real(from%gap, dp)
    to%crack = real(from%crack, dp)
    to%sin_friction = real(from%sin_friction, dp)
    to%cohesion_term = real(from%cohesion_term, dp)
    to%tension_limit = real(from%tension_limit, dp)
    to%fxx = real(from%fxx, dp)
    to%fxy = real(from%fxy, dp)
    to%fyx = real(from%fyx, dp)
    to%fyy = real(from%fyy, dp)
    to%velocity_gradient = real(from%velocity_gradient, dp)
    to%friction_angle = real(from%friction_angle, dp)
    to%cohesion = real(from%cohesion, dp)
    to%undrained_strength = real(from%undrained_strength, dp)
    to%young = real(from%young, dp)
    to%density = real(from%density, dp)
    to%dilation_angle = real(from%dilation_angle, dp)
    to%sin_dilation = real(from%sin_dilation, dp)
    to%plastic_strain = real(from%plastic_strain, dp)
  end subroutine show_particles
end module sg_particle_copy
