!> Stress before the first step: that of level ground under its own weight, made admissible.
module sg_initial_stress
  use sg_kinds, only: dp, wp
  use sg_materials, only: material_t, MODEL_DRUCKER_PRAGER, MODEL_MOHR_COULOMB
  use sg_particles, only: particles_t
  use sg_sorting, only: sort_index
  use sg_stress_update, only: return_block
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: set_geostatic_stress, make_admissible

contains

  !> s_yy = -(weight above in a column of the width of a point, and half the own weight)/width and
  !> s_xx = s_zz = K0 s_yy with K0 = nu/(1 - nu). `gravity` in m/s^2 downwards (the configuration
  !> saw to that).
  !> Bodies with points of different widths share columns of the largest width.
  subroutine set_geostatic_stress(particles, materials, gravity)
    type(particles_t), intent(inout) :: particles
    type(material_t), intent(in) :: materials(:)
    real(wp), intent(in) :: gravity(2)
    real(wp), allocatable :: load(:), above(:)
    integer, allocatable :: order(:), column(:)
    real(wp) :: width, k0
    integer :: body, k, p

    allocate (load(particles%count), column(particles%count))
    width = maxval(particles%bodies%width)
    column = 1 + floor((particles%x - minval(particles%x))/width + 0.5_wp)
    allocate (above(maxval(column)))
    above = 0.0_wp
    order = sort_index(-real(particles%y, dp))
    do k = 1, particles%count
      p = order(k)
      load(p) = -gravity(2)*(above(column(p)) + 0.5_wp*particles%mass(p))/width
      above(column(p)) = above(column(p)) + particles%mass(p)
    end do
    do body = 1, size(particles%bodies)
      associate (b => particles%bodies(body))
        k0 = materials(b%material)%poisson/(1.0_wp - materials(b%material)%poisson)
        particles%syy(b%first:b%last) = -load(b%first:b%last)
        particles%sxx(b%first:b%last) = -k0*load(b%first:b%last)
        particles%szz(b%first:b%last) = -k0*load(b%first:b%last)
      end associate
    end do
  end subroutine set_geostatic_stress

  !> Returns every stress that violates the yield criterion of its point to the yield surface: K0 =
  !> 0.449 violates
  !> Mohr-Coulomb below 22.3 degrees.
  subroutine make_admissible(particles, materials)
    type(particles_t), intent(inout) :: particles
    type(material_t), intent(in) :: materials(:)
    integer :: body, first, last

    do body = 1, size(particles%bodies)
      associate (p => particles, b => particles%bodies(body))
        if (.not. any(materials(b%material)%model == [MODEL_MOHR_COULOMB, &
          MODEL_DRUCKER_PRAGER])) cycle
        do first = b%first, b%last, BLOCK
          last = min(first + BLOCK - 1, b%last)
          call return_block(p, materials(b%material), first, last)
        end do
      end associate
    end do
  end subroutine make_admissible
end module sg_initial_stress
