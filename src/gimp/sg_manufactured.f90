!> A manufactured solution on the unit square, to measure the error of the solver against
!> (VERIFICATION case 7; the idea is of Steffen, Wallstedt, Guilkey, Kirby & Berzins 2008):
!>   u_x = G sin(pi X) sin(c pi t),  u_y = G sin(pi Y) sin(c pi t + pi),  c = sqrt(E/rho)
!> for the neo-Hookean law. With F = 1 + du/dX of the axis and J = F_xx F_yy the force per mass is
!>   b = (pi^2 u/rho) (lambda/F^2 (1 - ln J) + mu (1 + 1/F^2) - E)
module sg_manufactured
  use sg_kinds, only: dp, wp
  use sg_materials, only: material_t
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: manufactured_force, manufactured_velocity

  real(dp), parameter :: PI = acos(-1.0_dp)

contains

  !> Young's modulus from Lame's constants, Pa.
  pure function young(material) result(modulus)
    type(material_t), intent(in) :: material
    real(dp) :: modulus
    modulus = material%shear*(3.0_wp*material%lame + 2.0_wp*material%shear)/(material%lame &
      + material%shear)
  end function young

  !> Velocity at time 0 of the point that starts at (x, y), m/s. `amplitude` is G in m.
  elemental subroutine manufactured_velocity(material, amplitude, x, y, vx, vy)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: amplitude, x, y
    real(wp), intent(out) :: vx, vy
    real(dp) :: rate

    rate = PI*sqrt(young(material)/material%density)
    vx = real(amplitude*rate*sin(PI*x), wp)
    vy = real(-amplitude*rate*sin(PI*y), wp)
  end subroutine manufactured_velocity

  !> Force per mass, m/s^2, on the points that started at (x, y), at `time` in s.
  pure subroutine manufactured_force(n, material, amplitude, time, x, y, bx, by)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: amplitude, x(n), y(n)
    real(dp), intent(in) :: time
    real(wp), intent(inout) :: bx(BLOCK), by(BLOCK)
    real(dp) :: swing, modulus, ux, uy, fx, fy, log_j
    integer :: p

    modulus = young(material)
    swing = amplitude*sin(PI*sqrt(modulus/material%density)*time)
    do p = 1, n
      ux = swing*sin(PI*x(p))
      uy = -swing*sin(PI*y(p))
      fx = 1.0_dp + PI*swing*cos(PI*x(p))
      fy = 1.0_dp - PI*swing*cos(PI*y(p))
      log_j = log(fx*fy)
      bx(p) = real(PI**2*ux/material%density*(material%lame/fx**2*(1.0_dp - log_j) &
        + material%shear*(1.0_dp + 1.0_dp/fx**2) - modulus), wp)
      by(p) = real(PI**2*uy/material%density*(material%lame/fy**2*(1.0_dp - log_j) &
        + material%shear*(1.0_dp + 1.0_dp/fy**2) - modulus), wp)
    end do
  end subroutine manufactured_force
end module sg_manufactured
