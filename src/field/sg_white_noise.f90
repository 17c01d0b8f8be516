!> Independent standard normal numbers, each a function of its address, and the plans by which the
!> members of an ensemble share them out.
module sg_white_noise
  use sg_kinds, only: i8, wp
  use sg_normal_quantile, only: to_normal
  use sg_philox, only: fill_uniform, fill_words
  implicit none
  private

  public :: noise_source_t, fill_white_noise
  public :: PLAN_RANDOM, PLAN_ANTITHETIC, PLAN_LATIN_HYPERCUBE

  !> Every member has numbers of its own; every second one those of the member before with the other
  !> sign; each number runs through N equally likely intervals in N members, in an order of its own.
  integer, parameter :: PLAN_RANDOM = 1
  integer, parameter :: PLAN_ANTITHETIC = 2
  integer, parameter :: PLAN_LATIN_HYPERCUBE = 3

  !> Random words that make the order of a number: two for a permutation, one for a rotation.
  integer, parameter :: ORDER_WORDS = 3
  integer(i8), parameter :: LOW_32_BITS = int(z'ffffffff', i8)
  integer, parameter :: ROUNDS = 6
  !> 2^32 over the golden ratio.
  integer(i8), parameter :: KEY_STEP = int(z'9e3779b9', i8)

  !> The white noise of an ensemble: a function of (seed, stream, realization, plan, members).
  type :: noise_source_t
    integer(i8) :: seed = 0
    integer :: plan = PLAN_RANDOM
    !> N of the Latin hypercube, below 2^30.
    integer(i8) :: members = 1
  contains
    procedure :: fill
  end type noise_source_t

contains

  !> The first numbers of a stream for a realization: the normal quantile of one uniform number
  !> each, so within +-8.2.
  subroutine fill(this, stream, realization, values)
    class(noise_source_t), intent(in) :: this
    integer, intent(in) :: stream
    !> From 1; at most `members` for the Latin hypercube.
    integer(i8), intent(in) :: realization
    real(wp), contiguous, intent(out) :: values(:)

    select case (this%plan)
    case (PLAN_ANTITHETIC)
      call fill_white_noise(this%seed, stream, realization - modulo(realization + 1, 2_i8), values)
      if (modulo(realization, 2_i8) == 0) values = -values
    case (PLAN_LATIN_HYPERCUBE)
      call fill_uniform(this%seed, stream, realization, 0_i8, values)
      call stratify(this, stream, realization, values)
      call to_normal(values)
    case default
      call fill_white_noise(this%seed, stream, realization, values)
    end select
  end subroutine fill

  !> The same without a plan. For a grid, give the array [nx, ny]: x runs fastest.
  subroutine fill_white_noise(seed, stream, realization, values)
    integer(i8), intent(in) :: seed
    !> FIELD_STREAM or another of sg_philox.
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    real(wp), contiguous, intent(out) :: values(:)

    call fill_uniform(seed, stream, realization, 0_i8, values)
    call to_normal(values)
  end subroutine fill_white_noise

  !> u <- (interval + u)/N, where the intervals 0 to N - 1 that position j runs through are a
  !> permutation of its own. Its words are those of realization 0, which no member has. The rotation
  !> makes every interval equally likely for every member, whatever the permutation: means stay
  !> without bias (McKay, Beckman & Conover 1979; Owen 1992).
  subroutine stratify(source, stream, realization, u)
    type(noise_source_t), intent(in) :: source
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    real(wp), intent(inout) :: u(:)
    integer(i8) :: words(ORDER_WORDS*size(u)), interval
    real(wp) :: place
    integer :: j

    call fill_words(source%seed, stream, 0_i8, 0_i8, words)
    do j = 1, size(u)
      associate (order => words(ORDER_WORDS*(j - 1) + 1:ORDER_WORDS*j))
        interval = modulo(permuted(realization - 1, source%members, order(:2)) &
          + modulo(shiftr(order(3), 2), source%members), source%members)
      end associate
      ! Of the form that to_normal asks for.
      place = (real(interval, wp) + u(j))/real(source%members, wp)
      u(j) = (real(min(int(place*2.0_wp**52, i8), 2_i8**52 - 1), wp) + 0.5_wp)*2.0_wp**(-52)
    end do
  end subroutine stratify

  !> Where a permutation of 0 to n - 1 takes i: six rounds of a Feistel network on two halves of as
  !> many bits as n needs, again until the result is below n (Black & Rogaway 2002). With four,
  !> pairs of intervals were uneven by 14 % at n = 7, with six by 4 %.
  pure function permuted(i, n, words) result(place)
    integer(i8), intent(in) :: i, n
    !> 128 random bits: four keys, of which the last rounds take changed ones again.
    integer(i8), intent(in) :: words(2)
    integer(i8) :: place, left, right, swap, mask, keys(ROUNDS)
    integer :: bits, round

    keys(:4) = [iand(words(1), LOW_32_BITS), shiftr(words(1), 32), iand(words(2), LOW_32_BITS), &
      shiftr(words(2), 32)]
    keys(5:) = iand(keys(:ROUNDS - 4) + KEY_STEP, LOW_32_BITS)
    bits = 1
    do while (shiftl(1_i8, 2*bits) < n)
      bits = bits + 1
    end do
    mask = shiftl(1_i8, bits) - 1
    place = i
    do
      left = shiftr(place, bits)
      right = iand(place, mask)
      do round = 1, ROUNDS
        swap = right
        right = ieor(left, iand(mixed(right, keys(round)), mask))
        left = swap
      end do
      place = ior(shiftl(left, bits), right)
      if (place < n) return
    end do
  end function permuted

  !> 16 well mixed bits of value and key: xor, multiply, shift, multiply modulo 2^32 (the
  !> multipliers of MurmurHash3, Appleby 2011).
  pure function mixed(value, key) result(bits)
    integer(i8), intent(in) :: value, key
    integer(i8) :: bits

    bits = times(ieor(value, key), int(z'85ebca6b', i8))
    bits = times(ieor(bits, shiftr(bits, 13)), int(z'c2b2ae35', i8))
    bits = shiftr(bits, 16)
  end function mixed

  !> a b modulo 2^32 for 0 <= a, b < 2^32, without overflow of 63 bits.
  pure function times(a, b) result(c)
    integer(i8), intent(in) :: a, b
    integer(i8) :: c

    c = iand(a*iand(b, 65535_i8) + shiftl(iand(a*shiftr(b, 16), 65535_i8), 16), LOW_32_BITS)
  end function times
end module sg_white_noise
