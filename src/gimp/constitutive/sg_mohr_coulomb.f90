!> Mohr-Coulomb plasticity with tension cut-off: exact return in principal stresses, and the gap of
!> separated points.
!>
!> Sorted principal stresses s1 >= s2 >= s3, tension positive; the out-of-plane stress may be any
!> of them.
!>   yield    f = (s1 - s3) + (s1 + s3) sin(phi) - 2 c cos(phi) <= 0,  s1 <= T = min(tension
!> strength, c cot(phi))
!>   flow     g = (s1 - s3) + (s1 + s3) sin(psi) on the cone, associated on the cut-off
!>   return   s = s_trial - sum_k lambda_k D dg_k/ds over the active planes, lambda_k >= 0 (Koiter)
!> Planes are linear in principal stress, so each set of active planes is a small linear system and
!> the return is exact: plane, two edges (s2 = s3 and s1 = s2), the cut-off with its edges and
!> corners, the apex s1 = s2 = s3 = T.
!>
!> Gap: at the apex the volumetric strain that makes no stress is kept as `gap` >= 0. While it is
!> open the point carries no stress (one that was held by tension lets go of it); compression closes
!> the gap first, and only the rest of the increment builds stress. Without it a grain that flew off
!> would come back with several times its volume and full stiffness.
!>
!> Cracks: where the cut-off lies below the apex, what it opens in one or two directions while the
!> point carries stress in the others is kept too (sg_cracks). At the apex it becomes part of the
!> gap.
module sg_mohr_coulomb
  use sg_cracks, only: give_back
  use sg_kinds, only: i8, wp
  use sg_materials, only: material_t
  use sg_rounding, only: COARSENESS, LEAST_STRESS
  use sg_weighting, only: BLOCK, points_above
  implicit none
  private

  public :: close_gap, release_open, return_cracked, return_stress, return_principal
  public :: REGION_ELASTIC, REGION_PLANE, REGION_EDGE, REGION_CUT_OFF, REGION_APEX

  !> Where a trial stress was returned to.
  integer, parameter :: REGION_ELASTIC = 0
  integer, parameter :: REGION_PLANE = 1
  integer, parameter :: REGION_EDGE = 2
  integer, parameter :: REGION_CUT_OFF = 3
  integer, parameter :: REGION_APEX = 4

  !> Planes: 1 the cone between s1 and s3, 2 between s1 and s2, 3 between s2 and s3, 4 to 6 the
  !> cut-offs of s1, s2, s3.
  !> Sets of active planes in the order they are tried; those from the 4th on need a cut-off below
  !> the apex.
  integer, parameter :: SET_COUNT = 10
  integer, parameter :: CONE_SET_COUNT = 3
  integer, parameter :: ACTIVE(3, SET_COUNT) = reshape([ &
    1, 0, 0, 1, 2, 0, 1, 3, 0, &
    4, 0, 0, 1, 4, 0, 4, 5, 0, 1, 2, 4, 1, 3, 4, 1, 4, 5, 3, 4, 5], [3, SET_COUNT])
  integer, parameter :: SET_REGION(SET_COUNT) = [REGION_PLANE, REGION_EDGE, REGION_EDGE, &
    REGION_CUT_OFF, REGION_CUT_OFF, REGION_CUT_OFF, REGION_CUT_OFF, REGION_CUT_OFF, &
    REGION_CUT_OFF, REGION_CUT_OFF]
  !> Admissible violation of a condition, as a share of the stresses involved: some hundred
  !> roundings.
  real(wp), parameter :: ROUNDING = 1.0e-13_wp*COARSENESS

  !> Trial stresses of a block: principal ones in the plane (a >= b) and out of it (z); radius of
  !> Mohr's circle and the two components that give its direction.
  type :: principal_t
    real(wp) :: a(BLOCK), b(BLOCK), z(BLOCK), radius(BLOCK), half_difference(BLOCK), &
      shear_stress(BLOCK)
  end type principal_t

contains

  !> Opens or closes the gap with the volumetric strain increment; `share` is the part of the
  !> increment that is left to strain the material.
  pure subroutine close_gap(n, time_step, gradient, gap, share)
    integer, intent(in) :: n
    !> s; 1/s, as in find_strain.
    real(wp), intent(in) :: time_step, gradient(BLOCK, 4)
    real(wp), intent(inout) :: gap(n), share(BLOCK)
    real(wp) :: left(BLOCK), trace, before, least
    integer :: p

    least = 0.0_wp
    !$omp simd private(trace, before) reduction(min:least)
    do p = 1, n
      trace = time_step*(gradient(p, 1) + gradient(p, 4))
      before = gap(p)
      left(p) = merge(before + trace, 0.0_wp, before > 0.0_wp)
      least = min(least, left(p))
      share(p) = merge(0.0_wp, 1.0_wp, before > 0.0_wp)
      gap(p) = max(left(p), 0.0_wp)
    end do
    if (.not. least < 0.0_wp) return
    do p = 1, n
      if (left(p) < 0.0_wp) share(p) = left(p)/(time_step*(gradient(p, 1) + gradient(p, 4)))
    end do
  end subroutine close_gap

  !> Points that opened in the step before let go of the tension that held them at the apex; the
  !> elastic strain that it took, mean stress over `bulk` (Pa), goes into the gap.
  pure subroutine release_open(n, bulk, gap, sxx, syy, szz, sxy)
    integer, intent(in) :: n
    real(wp), intent(in) :: bulk
    real(wp), intent(inout) :: gap(n), sxx(n), syy(n), szz(n), sxy(n)
    real(wp) :: kept
    integer :: p

    !$omp simd private(kept)
    do p = 1, n
      kept = merge(0.0_wp, 1.0_wp, gap(p) > 0.0_wp)
      gap(p) = gap(p) + (1.0_wp - kept)*max(sxx(p) + syy(p) + szz(p), 0.0_wp)/(3.0_wp*bulk)
      sxx(p) = kept*sxx(p)
      syy(p) = kept*syy(p)
      szz(p) = kept*szz(p)
      sxy(p) = kept*sxy(p)
    end do
  end subroutine release_open

  !> Returns the trial stresses of `n` points to the yield surface, in place, and adds to the gap
  !> of those at the apex. `crack` is set where the cut-off opens one.
  !> The plane is done for all points at once; the few on an edge, the cut-off or the apex follow
  !> one by one.
  pure subroutine return_stress(n, material, sin_friction, cohesion_term, tension_limit, &
    sin_dilation, sxx, syy, szz, sxy, gap, crack)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    !> The last one is the sine of the dilation angle.
    real(wp), intent(in) :: sin_friction(n), cohesion_term(n), tension_limit(n), sin_dilation(n)
    real(wp), intent(inout) :: sxx(n), syy(n), szz(n), sxy(n)
    real(wp), intent(inout) :: gap(n)
    !> xx, yy, zz, xy in Pa.
    real(wp), intent(inout), optional :: crack(4, n)
    type(principal_t) :: trial
    real(wp) :: d_first, d_middle, d_last, high, middle, low, new_a, new_b, compliance(BLOCK)
    real(wp) :: centre, yield, multiplier, ratio, stress(4), opening, taken
    ! Above most_violation, mostly 0: the plane is not where the point belongs.
    real(wp) :: violation(BLOCK)
    integer(i8) :: points
    integer :: p, region

    call find_compliance(n, material, sin_friction, sin_dilation, compliance)
    !$omp simd private(centre, high, middle, low, yield, multiplier, new_a, new_b, ratio) &
    !$omp& private(d_first, d_middle, d_last)
    do p = 1, n
      d_middle = 2.0_wp*material%lame*sin_dilation(p)
      d_first = d_middle + 2.0_wp*material%shear*(1.0_wp + sin_dilation(p))
      d_last = d_middle - 2.0_wp*material%shear*(1.0_wp - sin_dilation(p))
      centre = 0.5_wp*(sxx(p) + syy(p))
      trial%half_difference(p) = 0.5_wp*(sxx(p) - syy(p))
      trial%shear_stress(p) = sxy(p)
      trial%radius(p) = sqrt(trial%half_difference(p)**2 + sxy(p)**2)
      trial%a(p) = centre + trial%radius(p)
      trial%b(p) = centre - trial%radius(p)
      trial%z(p) = szz(p)
      high = max(trial%a(p), trial%z(p))
      low = min(trial%b(p), trial%z(p))
      middle = max(min(trial%a(p), trial%z(p)), trial%b(p))
      yield = (high - low) + (high + low)*sin_friction(p) - cohesion_term(p)
      multiplier = max(yield, 0.0_wp)*compliance(p)
      high = high - multiplier*d_first
      middle = middle - multiplier*d_middle
      low = low - multiplier*d_last
      violation(p) = max(max(middle - high, low - middle), high - tension_limit(p))
      new_a = merge(high, middle, trial%a(p) >= trial%z(p))
      new_b = merge(low, middle, trial%b(p) <= trial%z(p))
      ratio = 0.5_wp*(new_a - new_b)/max(trial%radius(p), LEAST_STRESS)
      centre = 0.5_wp*(new_a + new_b)
      sxx(p) = centre + ratio*trial%half_difference(p)
      syy(p) = centre - ratio*trial%half_difference(p)
      sxy(p) = ratio*trial%shear_stress(p)
      szz(p) = merge(high, merge(low, middle, trial%z(p) < trial%b(p)), trial%z(p) > trial%a(p))
    end do

    points = points_above(n, violation, material%most_violation)
    do while (points /= 0_i8)
      p = trailz(points) + 1
      points = ibclr(points, p - 1)
      call return_special(material, [sin_friction(p), cohesion_term(p), tension_limit(p), &
        sin_dilation(p)], trial, p, stress, opening, region)
      sxx(p) = stress(1)
      syy(p) = stress(2)
      szz(p) = stress(3)
      sxy(p) = stress(4)
      gap(p) = gap(p) + opening
      if (.not. (present(crack) .and. region == REGION_CUT_OFF)) cycle
      taken = trial%a(p) + trial%b(p) + trial%z(p)
      if (maxval(abs(stress)) <= ROUNDING*(taken + cohesion_term(p))) then
        ! Nothing is left but rounding, which must not decide whether this is the apex.
        sxx(p) = 0.0_wp; syy(p) = 0.0_wp; szz(p) = 0.0_wp; sxy(p) = 0.0_wp
        gap(p) = gap(p) + taken/(3.0_wp*material%bulk)
      else
        crack(:, p) = crack_stress(material, sin_dilation(p), trial, p, stress)
      end if
    end do
  end subroutine return_stress

  !> As return_stress, with a memory of the cut-off: `crack` is the stress that cracks have taken
  !> (xx, yy, zz, xy in Pa) and, afterwards, that they take; [4, n], or [4, 0] for no memory.
  pure subroutine return_cracked(n, material, sin_friction, cohesion_term, tension_limit, &
    sin_dilation, sxx, syy, szz, sxy, gap, crack)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: sin_friction(n), cohesion_term(n), tension_limit(n), sin_dilation(n)
    real(wp), intent(inout) :: sxx(n), syy(n), szz(n), sxy(n), gap(n), crack(:, :)
    real(wp) :: limit(BLOCK)

    if (size(crack) == 0) then
      call return_stress(n, material, sin_friction, cohesion_term, tension_limit, sin_dilation, &
        sxx, syy, szz, sxy, gap)
    else
      limit(:n) = tension_limit
      call give_back(n, crack, limit(:n), sxx, syy, szz, sxy)
      call return_stress(n, material, sin_friction, cohesion_term, limit(:n), sin_dilation, sxx, &
        syy, szz, sxy, gap, crack)
    end if
  end subroutine return_cracked

  !> Stress D e_c that the cracks of point `p` of the block have taken, (xx, yy, zz, xy), once the
  !> cut-off has returned its trial stress to `stress`.
  !> The cone shortens one or two principal directions by N in all and widens the others by N (1 +
  !> sin(psi))/(1 - sin(psi)); what these have widened beyond that, e_c, is the cut-off's.
  pure function crack_stress(material, sin_dilation, trial, p, stress) result(crack)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: sin_dilation, stress(4)
    type(principal_t), intent(in) :: trial
    integer, intent(in) :: p
    real(wp) :: crack(4), taken(3), strain(3), opened(3), mean, radius, widening

    radius = max(trial%radius(p), LEAST_STRESS)
    mean = 0.5_wp*(stress(1) + stress(2))
    associate (along => (0.5_wp*(stress(1) - stress(2))*trial%half_difference(p) &
      + stress(4)*trial%shear_stress(p))/radius)
      taken = [trial%a(p) - (mean + along), trial%b(p) - (mean - along), trial%z(p) - stress(3)]
    end associate
    strain = (taken - material%lame/(3.0_wp*material%bulk)*sum(taken))/(2.0_wp*material%shear)
    opened = max(strain, 0.0_wp)
    widening = -sum(min(strain, 0.0_wp))*(1.0_wp + sin_dilation)/(1.0_wp - sin_dilation)
    opened = opened*max(1.0_wp - widening/max(sum(opened), tiny(1.0_wp)), 0.0_wp)
    taken = material%lame*sum(opened) + 2.0_wp*material%shear*opened
    mean = 0.5_wp*(taken(1) + taken(2))
    associate (ratio => 0.5_wp*(taken(1) - taken(2))/radius)
      crack = [mean + ratio*trial%half_difference(p), mean - ratio*trial%half_difference(p), &
        taken(3), ratio*trial%shear_stress(p)]
    end associate
  end function crack_stress

  !> Multiplier of the plane over the yield function, 1/(4 G + 4 (lambda + G) sin(phi) sin(psi)), in
  !> 1/Pa: the same for all points that do not dilate, who are spared the division.
  pure subroutine find_compliance(n, material, sin_friction, sin_dilation, compliance)
    integer, intent(in) :: n
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: sin_friction(n), sin_dilation(n)
    real(wp), intent(inout) :: compliance(BLOCK)
    integer :: p

    if (material%sin_dilation > 0.0_wp .or. material%divides_always) then
      !$omp simd
      do p = 1, n
        compliance(p) = 1.0_wp/(4.0_wp*material%shear + 4.0_wp*((material%lame &
          + material%shear)*sin_dilation(p))*sin_friction(p))
      end do
    else
      compliance = 1.0_wp/(4.0_wp*material%shear)
    end if
  end subroutine find_compliance

  !> Point `p` of the block, whose return is not to the plane: sorts its principal stresses, returns
  !> them, and turns them back to `stress` = (xx, yy, zz, xy). `opening`: volumetric strain that the
  !> apex left without stress; `region`: a REGION_ constant.
  pure subroutine return_special(material, strength, trial, p, stress, opening, region)
    type(material_t), intent(in) :: material
    !> sin(phi), 2 c cos(phi), T, sin(psi)
    real(wp), intent(in) :: strength(4)
    type(principal_t), intent(in) :: trial
    integer, intent(in) :: p
    real(wp), intent(out) :: stress(4), opening
    integer, intent(out) :: region
    real(wp) :: returned(3), new_a, new_b, new_z, ratio

    associate (a => trial%a(p), b => trial%b(p), z => trial%z(p))
      if (z >= a) then
        call return_principal(material, strength, [z, a, b], returned, region)
        new_z = returned(1); new_a = returned(2); new_b = returned(3)
      else if (z <= b) then
        call return_principal(material, strength, [a, b, z], returned, region)
        new_a = returned(1); new_b = returned(2); new_z = returned(3)
      else
        call return_principal(material, strength, [a, z, b], returned, region)
        new_a = returned(1); new_z = returned(2); new_b = returned(3)
      end if
      ratio = 0.5_wp*(new_a - new_b)/max(trial%radius(p), LEAST_STRESS)
      stress(1) = 0.5_wp*(new_a + new_b) + ratio*trial%half_difference(p)
      stress(2) = 0.5_wp*(new_a + new_b) - ratio*trial%half_difference(p)
      stress(3) = new_z
      stress(4) = ratio*trial%shear_stress(p)
      opening = 0.0_wp
      if (region == REGION_APEX) opening = max((a + b + z)/3.0_wp - strength(3), &
        0.0_wp)/material%bulk
    end associate
  end subroutine return_special

  !> Exact return of sorted principal trial stresses `trial` (s1 >= s2 >= s3, Pa) to `returned`; the
  !> head of the module has the equations. `strength` = sin(phi), 2 c cos(phi) in Pa, T in Pa,
  !> sin(psi).
  !> `region`: a REGION_ constant.
  pure subroutine return_principal(material, strength, trial, returned, region)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: strength(4), trial(3)
    real(wp), intent(out) :: returned(3)
    integer, intent(out) :: region
    real(wp) :: normal(3, 6), change(3, 6), excess(6), tolerance
    integer :: set, sets
    logical :: admissible

    call define_planes(material, strength, trial, normal, change, excess)
    tolerance = ROUNDING*(maxval(abs(trial)) + abs(strength(2)))
    returned = trial
    region = REGION_ELASTIC
    if (excess(1) <= tolerance .and. excess(4) <= tolerance) return
    sets = SET_COUNT
    ! No cut-off below the apex of the cone: T = c cot(phi).
    if (2.0_wp*strength(1)*strength(3) >= strength(2)*(1.0_wp - ROUNDING)) sets = CONE_SET_COUNT
    do set = 1, sets
      call try_planes(ACTIVE(:, set), admissible, returned)
      if (admissible) then
        region = SET_REGION(set)
        return
      end if
    end do
    returned = strength(3)
    region = REGION_APEX

  contains

    !> Tries one set of active planes: admissible if all multipliers are >= 0 and the result is
    !> admissible and sorted.
    pure subroutine try_planes(planes, admissible, stress)
      integer, intent(in) :: planes(3)
      logical, intent(out) :: admissible
      real(wp), intent(out) :: stress(3)
      real(wp) :: matrix(3, 3), multiplier(3)
      integer :: count, k, l

      stress = trial
      admissible = .false.
      matrix = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], &
        [3, 3])
      multiplier = 0.0_wp
      count = 0
      do k = 1, 3
        if (planes(k) == 0) cycle
        count = k
        multiplier(k) = excess(planes(k))
        do l = 1, 3
          if (planes(l) > 0) matrix(k, l) = dot_product(normal(:, planes(k)), change(:, planes(l)))
        end do
      end do
      call solve_small(count, matrix, multiplier)
      do k = 1, count
        if (multiplier(k)*norm2(change(:, planes(k))) < -tolerance) return
        stress = stress - multiplier(k)*change(:, planes(k))
      end do
      if (.not. all(abs(stress) <= huge(1.0_wp))) return
      if (stress(1) < stress(2) - tolerance) return
      if (stress(2) < stress(3) - tolerance) return
      if (stress(1) > strength(3) + tolerance) return
      if (dot_product(normal(:, 1), stress) > strength(2) + tolerance) return
      admissible = .true.
    end subroutine try_planes
  end subroutine return_principal

  !> The six planes of the sorted yield surface: normals dF/ds, stress changes D dg/ds, and
  !> F(trial) in Pa.
  pure subroutine define_planes(material, strength, trial, normal, change, excess)
    type(material_t), intent(in) :: material
    real(wp), intent(in) :: strength(4), trial(3)
    real(wp), intent(out) :: normal(3, 6), change(3, 6), excess(6)
    real(wp) :: flow(3, 6)
    integer :: k

    normal = 0.0_wp
    flow = 0.0_wp
    normal([1, 3], 1) = [1.0_wp + strength(1), strength(1) - 1.0_wp]
    normal([1, 2], 2) = normal([1, 3], 1)
    normal([2, 3], 3) = normal([1, 3], 1)
    flow([1, 3], 1) = [1.0_wp + strength(4), strength(4) - 1.0_wp]
    flow([1, 2], 2) = flow([1, 3], 1)
    flow([2, 3], 3) = flow([1, 3], 1)
    do k = 1, 3
      normal(k, 3 + k) = 1.0_wp
      flow(k, 3 + k) = 1.0_wp
    end do
    do k = 1, 6
      change(:, k) = material%lame*sum(flow(:, k)) + 2.0_wp*material%shear*flow(:, k)
      excess(k) = dot_product(normal(:, k), trial) - merge(strength(2), strength(3), k <= 3)
    end do
  end subroutine define_planes

  !> Solves the leading `count` by `count` system in place by Gaussian elimination with pivoting; a
  !> singular one gives what is not finite, which the caller refuses.
  pure subroutine solve_small(count, matrix, vector)
    integer, intent(in) :: count
    real(wp), intent(inout) :: matrix(3, 3), vector(3)
    real(wp) :: row(3), scale
    integer :: k, l, pivot

    scale = maxval(abs(matrix(:count, :count)))
    do k = 1, count
      pivot = k - 1 + maxloc(abs(matrix(k:count, k)), dim=1)
      row = matrix(k, :); matrix(k, :) = matrix(pivot, :); matrix(pivot, :) = row
      vector([k, pivot]) = vector([pivot, k])
      if (abs(matrix(k, k)) <= ROUNDING*scale) then
        vector = huge(1.0_wp)
        vector(1) = -huge(1.0_wp)
        return
      end if
      do l = k + 1, count
        vector(l) = vector(l) - matrix(l, k)/matrix(k, k)*vector(k)
        matrix(l, :) = matrix(l, :) - matrix(l, k)/matrix(k, k)*matrix(k, :)
      end do
    end do
    do k = count, 1, -1
      vector(k) = (vector(k) - dot_product(matrix(k, k + 1:count), vector(k &
        + 1:count)))/matrix(k, k)
    end do
  end subroutine solve_small
end module sg_mohr_coulomb
