!> Cracks: what the tension cut-off of Mohr-Coulomb has opened and what must close again.
!>
!> A no-tension material (Del Piero 1989, Angelillo 1993) splits its strain into an elastic one and
!> a crack strain that is nowhere negative; where cracks are open, no stress acts across them. The
!> crack strain e_c is not plastic: it is found anew in each step, with the stress, from the strain
!> that both share. So the stress that it has taken, `crack` = D e_c, is kept, turned with the
!> material and given back to the trial stress; the return takes from that what it must. A crack
!> that is pushed together thus closes before its normal carries pressure, and over a cycle of
!> opening and closing nothing is gained or lost.
!>
!> The volume of a cracked point is that of its solid: the stress is that of the solid, and so are
!> the forces on it. As a stress the crack does not ask for the modulus; its opening does.
module sg_cracks
  use sg_kinds, only: wp
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: is_cracked, crack_opening, give_back, turn_cracks

contains

  !> Has a point with `crack` (xx, yy, zz, xy) in Pa a crack?
  pure function is_cracked(crack) result(is)
    real(wp), intent(in) :: crack(4)
    logical :: is
    is = crack(1) + crack(2) + crack(3) > 0.0_wp
  end function is_cracked

  !> Volumetric strain of the cracks of `n` points, for the modulus `bulk` (Pa).
  pure function crack_opening(n, bulk, crack) result(opening)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk, crack(4, n)
    real(wp) :: opening(n)
    opening = (crack(1, :) + crack(2, :) + crack(3, :))/(3.0_wp*bulk)
  end function crack_opening

  !> Turns the cracks of `n` points with the material, as predict_stress does with their stress.
  pure subroutine turn_cracks(n, time_step, gradient, crack)
    integer, intent(in) :: n
    !> s; 1/s, as in find_strain.
    real(wp), intent(in) :: time_step, gradient(BLOCK, 4)
    real(wp), intent(inout) :: crack(4, n)
    real(wp) :: mean, half_difference, shear_stress, spin, turn, cosine, sine
    integer :: p

    do p = 1, n
      if (.not. is_cracked(crack(:, p))) cycle
      spin = 0.5_wp*time_step*(gradient(p, 2) - gradient(p, 3))
      turn = 2.0_wp/(1.0_wp + spin*spin)
      cosine = turn - 1.0_wp
      sine = spin*turn
      mean = 0.5_wp*(crack(1, p) + crack(2, p))
      half_difference = 0.5_wp*(crack(1, p) - crack(2, p))
      shear_stress = half_difference*sine + crack(4, p)*cosine
      half_difference = half_difference*cosine - crack(4, p)*sine
      crack(1, p) = mean + half_difference
      crack(2, p) = mean - half_difference
      crack(4, p) = shear_stress
    end do
  end subroutine turn_cracks

  !> Gives `n` points back the stress that their cracks have taken, and leaves the cracks empty;
  !> `limit`, the tension they can carry (Pa), is none across a crack.
  pure subroutine give_back(n, crack, limit, sxx, syy, szz, sxy)
    integer, intent(in) :: n
    real(wp), intent(inout) :: crack(4, n), limit(n), sxx(n), syy(n), szz(n), sxy(n)
    integer :: p

    do p = 1, n
      if (.not. is_cracked(crack(:, p))) cycle
      limit(p) = 0.0_wp
      sxx(p) = sxx(p) + crack(1, p)
      syy(p) = syy(p) + crack(2, p)
      szz(p) = szz(p) + crack(3, p)
      sxy(p) = sxy(p) + crack(4, p)
      crack(:, p) = 0.0_wp
    end do
  end subroutine give_back
end module sg_cracks
