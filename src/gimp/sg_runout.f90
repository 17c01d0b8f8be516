!> What is measured on a state of the points: runout by four definitions, heights, profile,
!> energies.
!> Runouts are measured from the initial toe of the measured bodies, in m, towards +x: those of the
!> material that the random field varies, all bodies where there is none.
module sg_runout
  use sg_kinds, only: dp, sp, wp
  use sg_materials, only: material_t, MODEL_NEO_HOOKEAN
  use sg_neo_hookean, only: neo_hookean_energy
  use sg_particles, only: particles_t
  use sg_sorting, only: sort_index
  implicit none
  private

  public :: farthest_edge, mass_front, deposit_depth, connected_front, surface_height
  public :: elastic_energy, potential_energy, angular_momentum

contains

  !> Position of the farthest edge of any point, in m.
  pure function farthest_edge(particles) result(x)
    type(particles_t), intent(in) :: particles
    real(dp) :: x
    integer :: body

    x = -huge(1.0_dp)
    do body = 1, size(particles%bodies)
      associate (b => particles%bodies(body))
        if (.not. b%is_measured) cycle
        x = max(x, real(maxval(particles%x(b%first:b%last)), dp) + 0.5_wp*b%width &
          + particles%origin(1))
      end associate
    end do
  end function farthest_edge

  !> Positions behind which the given shares of the mass lie, in m: the centre of the point at which
  !> the mass summed from the right passes the rest.
  function mass_front(particles, shares) result(x)
    type(particles_t), intent(in) :: particles
    real(dp), intent(in) :: shares(:)
    real(dp) :: x(size(shares))
    real(dp), allocatable :: position(:), mass(:)
    integer, allocatable :: order(:)
    real(dp) :: total, summed
    integer :: k, s

    position = pack(particles%origin(1) + particles%x, particles%is_measured())
    mass = pack(real(particles%mass, dp), particles%is_measured())
    order = sort_index(position)
    total = sum(mass)
    do s = 1, size(shares)
      summed = 0.0_dp
      do k = size(order), 2, -1
        summed = summed + mass(order(k))
        if (summed > (1.0_dp - shares(s))*total) exit
      end do
      x(s) = position(order(max(k, 1)))
    end do
  end function mass_front

  !> Depth of the deposit at its initial density in each column of cells, in m: [columns].
  !> A point counts in the column of its centre; one outside all columns counts nowhere.
  pure function deposit_depth(particles, materials, x_min, column_width, columns) result(depth)
    type(particles_t), intent(in) :: particles
    type(material_t), intent(in) :: materials(:)
    real(dp), intent(in) :: x_min, column_width
    integer, intent(in) :: columns
    real(sp) :: depth(columns)
    real(dp) :: total(columns), density
    integer :: body, p, k

    total = 0.0_dp
    do body = 1, size(particles%bodies)
      if (.not. particles%bodies(body)%is_measured) cycle
      density = materials(particles%bodies(body)%material)%density
      do p = particles%bodies(body)%first, particles%bodies(body)%last
        if (size(particles%density) > 0) density = particles%density(p)
        k = floor((particles%origin(1) + particles%x(p) - x_min)/column_width) + 1
        if (k >= 1 .and. k <= columns) total(k) = total(k) &
          + particles%mass(p)/(density*column_width)
      end do
    end do
    depth = real(total, sp)
  end function deposit_depth

  !> End of the deposit still joined to the main body, in m: walking from the column of `source_x`
  !> along x, the right end of the last column before the depth falls below `least_depth`.
  pure function connected_front(depth, x_min, column_width, source_x, least_depth) result(x)
    real(sp), intent(in) :: depth(:)
    real(dp), intent(in) :: x_min, column_width, source_x, least_depth
    real(dp) :: x
    integer :: k, first

    first = min(max(floor((source_x - x_min)/column_width) + 1, 1), size(depth))
    do k = first, size(depth)
      ! A part in 1e5 for the single precision of the depth.
      if (depth(k) < least_depth*(1.0_dp - 1.0e-5_dp)) exit
    end do
    x = x_min + (k - 1)*column_width
  end function connected_front

  !> Highest edge of the points whose centre lies between `x_first` and `x_last`, in m; `y_base` if
  !> there is none.
  pure function surface_height(particles, x_first, x_last, y_base) result(y)
    type(particles_t), intent(in) :: particles
    real(dp), intent(in) :: x_first, x_last, y_base
    real(dp) :: y
    integer :: body

    y = y_base
    do body = 1, size(particles%bodies)
      associate (b => particles%bodies(body))
        if (.not. b%is_measured) cycle
        y = max(y, 0.5_wp*b%height + maxval(particles%origin(2) + particles%y(b%first:b%last), &
                mask=particles%origin(1) + particles%x(b%first:b%last) >= x_first &
                .and. particles%origin(1) + particles%x(b%first:b%last) <= x_last))
      end associate
    end do
  end function surface_height

  !> Elastic energy in J/m: sum of V/2 s : C^-1 : s, for neo-Hookean points of V_0 W.
  pure function elastic_energy(particles, materials) result(energy)
    type(particles_t), intent(in) :: particles
    type(material_t), intent(in) :: materials(:)
    real(dp) :: energy, trace, volume
    real(wp), allocatable :: mass(:)
    integer :: body, p

    energy = 0.0_dp
    do body = 1, size(particles%bodies)
      associate (s => particles, material => materials(particles%bodies(body)%material))
        if (material%model == MODEL_NEO_HOOKEAN) then
          associate (first => s%bodies(body)%first, last => s%bodies(body)%last)
            ! Mass stands for the first volume, and energy is proportional to the modulus.
            mass = s%mass(first:last)
            if (size(s%density) > 0) mass = mass*(material%density/s%density(first:last))
            if (size(s%young) > 0) mass = mass*(s%young(first:last)/material%young)
            energy = energy + sum(mass*neo_hookean_energy( &
              real(material%lame, dp), real(material%shear, dp), real(s%fxx(first:last), dp), &
              real(s%fxy(first:last), dp), real(s%fyx(first:last), dp), &
              real(s%fyy(first:last), dp)))/material%density
          end associate
          cycle
        end if
        do p = particles%bodies(body)%first, particles%bodies(body)%last
          trace = real(s%sxx(p), dp) + s%syy(p) + s%szz(p)
          volume = s%volume(p)
          if (size(s%young) > 0) volume = volume*(material%young/s%young(p))
          energy = energy + volume*(trace**2/(18.0_wp*material%bulk) &
            + ((s%sxx(p) - trace/3.0_dp)**2 + (s%syy(p) - trace/3.0_dp)**2 + (s%szz(p) &
            - trace/3.0_dp)**2 &
            + 2.0_wp*s%sxy(p)**2)/(4.0_wp*material%shear))
        end do
      end associate
    end do
  end function elastic_energy

  !> Potential energy in the field `gravity` (m/s^2) against the place that positions are counted
  !> from, in J/m.
  pure function potential_energy(particles, gravity) result(energy)
    type(particles_t), intent(in) :: particles
    real(dp), intent(in) :: gravity(2)
    real(dp) :: energy
    energy = -sum(particles%mass*(gravity(1)*particles%x + gravity(2)*particles%y))
  end function potential_energy

  !> Angular momentum about (0, 0), in kg m/s.
  pure function angular_momentum(particles) result(momentum)
    type(particles_t), intent(in) :: particles
    real(dp) :: momentum
    momentum = sum(particles%mass*((particles%origin(1) + particles%x)*particles%vy &
      - (particles%origin(2) + particles%y)*particles%vx))
  end function angular_momentum
end module sg_runout
