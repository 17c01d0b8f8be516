!> The normal quantile of many numbers at once, with the arithmetic of vectors: rational functions
!> through the quantile at Chebyshev nodes, one for nine numbers of ten and one for the tails.
!> tests/support/fit_normal_quantile.py makes the coefficients.
module sg_normal_quantile
  use sg_kinds, only: wp
  implicit none
  private

  public :: to_normal

  !> |u - 1/2| up to which the central function serves.
  real(wp), parameter :: CENTRE = 0.45_wp
  !> sqrt(-ln p) where the tail begins, p = 1/2 - CENTRE.
  real(wp), parameter :: TAIL_START = 1.7308183826022853382_wp
  real(wp), parameter :: CENTRE_N(0:10) = [ &
    3.6552302821143837776_wp, &
    2.7409912486859869165e+2_wp, &
    8.3657854704026485614e+3_wp, &
    1.3434997661856955031e+5_wp, &
    1.2282364174297828825e+6_wp, &
    6.4810108550175028492e+6_wp, &
    1.9202344393039711885e+7_wp, &
    2.9795063167263789272e+7_wp, &
    2.1174148277850551536e+7_wp, &
    5.2305452304051518397e+6_wp, &
    1.9790541860838368498e+5_wp]
  real(wp), parameter :: CENTRE_D(0:10) = [ &
    1.0_wp, &
    7.9068761056676006695e+1_wp, &
    2.5684428324918964966e+3_wp, &
    4.4430591232586513121e+4_wp, &
    4.4448790232258865519e+5_wp, &
    2.6218835460538437834e+6_wp, &
    8.9485256775621322096e+6_wp, &
    1.6731040748235983255e+7_wp, &
    1.5444875030146195571e+7_wp, &
    5.7718816793105594292e+6_wp, &
    5.4660202913188078493e+5_wp]
  real(wp), parameter :: TAIL_N(0:9) = [ &
    1.6448536269514727182_wp, &
    5.2084470466577047319_wp, &
    6.6609724208844231839_wp, &
    4.5920943066859251022_wp, &
    1.8975027222538088153_wp, &
    4.8792878268273703117e-1_wp, &
    7.7282105874450990768e-2_wp, &
    7.0851959176415074664e-3_wp, &
    3.267827077633245542e-4_wp, &
    5.4343902639928340464e-6_wp]
  real(wp), parameter :: TAIL_D(0:9) = [ &
    1.0_wp, &
    2.1462401294434309678_wp, &
    1.9228332409481114737_wp, &
    9.3850700822937888379e-1_wp, &
    2.717890300543857666e-1_wp, &
    4.7141125532891227407e-2_wp, &
    4.6332124384051559846e-3_wp, &
    2.2444144023414165129e-4_wp, &
    3.8425487533773087895e-6_wp, &
    8.2012045302881773555e-13_wp]

contains

  !> u <- the x with Phi(x) = u, relative error below 2e-15. Every u must be a multiple of 2^-53
  !> inside (0, 1), as the uniform numbers of sg_philox are: u - 1/2 is then exact.
  pure subroutine to_normal(u)
    !> [n].
    real(wp), contiguous, intent(inout) :: u(:)
    integer, parameter :: CHUNK = 256
    real(wp) :: x(CHUNK), deviation(CHUNK), outer(CHUNK)
    integer :: tail(CHUNK), first, i, n, tails

    do first = 0, size(u) - 1, CHUNK
      n = min(CHUNK, size(u) - first)
      do i = 1, n
        deviation(i) = u(first + i) - 0.5_wp
        x(i) = central_quantile(deviation(i))
      end do
      ! The list of the tails is made without a branch, which would be taken at random.
      tails = 0
      do i = 1, n
        tail(tails + 1) = i
        tails = tails + merge(1, 0, abs(deviation(i)) > CENTRE)
      end do
      ! The logarithms of vectors and of single numbers differ in the last bit, and which one a
      ! number would get depends on the numbers after it.
      !GCC$ novector
      do i = 1, tails
        outer(i) = -log(0.5_wp - abs(deviation(tail(i))))
      end do
      do i = 1, tails
        outer(i) = tail_quantile(outer(i))
      end do
      do i = 1, tails
        x(tail(i)) = sign(outer(i), deviation(tail(i)))
      end do
      u(first + 1:first + n) = x(:n)
    end do
  end subroutine to_normal

  !> Of u = 1/2 + deviation, |deviation| <= CENTRE; beyond, a finite number without meaning.
  pure function central_quantile(deviation) result(x)
    real(wp), intent(in) :: deviation
    real(wp) :: x, s, top, bottom
    integer :: k

    s = max(CENTRE**2 - deviation**2, 0.0_wp)
    top = CENTRE_N(ubound(CENTRE_N, 1))
    bottom = CENTRE_D(ubound(CENTRE_D, 1))
    do k = ubound(CENTRE_N, 1) - 1, 0, -1
      top = top*s + CENTRE_N(k)
      bottom = bottom*s + CENTRE_D(k)
    end do
    x = deviation*top/bottom
  end function central_quantile

  !> |x| where the tail beyond x has the probability exp(-rarity), from that of 1/2 - CENTRE down to
  !> that of the smallest uniform number.
  pure function tail_quantile(rarity) result(x)
    real(wp), intent(in) :: rarity
    real(wp) :: x, s, top, bottom
    integer :: k

    s = sqrt(rarity) - TAIL_START
    top = TAIL_N(ubound(TAIL_N, 1))
    bottom = TAIL_D(ubound(TAIL_D, 1))
    do k = ubound(TAIL_N, 1) - 1, 0, -1
      top = top*s + TAIL_N(k)
      bottom = bottom*s + TAIL_D(k)
    end do
    x = top/bottom
  end function tail_quantile
end module sg_normal_quantile
