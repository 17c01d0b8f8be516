!> Random numbers that are a function of (seed, stream, realization, position) and of nothing else:
!> Philox4x64-10 (Salmon et al. 2011) of Random123. No state is kept: ranks and order do not matter.
!>
!> The key is (seed, stream); the counter is (block, realization, 0, 0) with blocks of four words
!> counted from 1. NumPy gives the same 64-bit words in the same order:
!> `Philox(key=[seed, stream], counter=[0, realization, 0, 0]).random_raw(n)`.
module sg_philox
  use, intrinsic :: iso_c_binding, only: c_int64_t
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: fill_uniform, fill_words, philox_block
  public :: DATA_STREAM, FIELD_STREAM, field_stream_of, NOISE_STREAM

  !> Streams: the first random field, the perturbations of the homogeneous members, the errors of
  !> measurements.
  integer, parameter :: FIELD_STREAM = 1
  integer, parameter :: NOISE_STREAM = 2
  integer, parameter :: DATA_STREAM = 3
  !> The other random fields come after it.
  integer, parameter :: MORE_FIELDS = 100

  integer, parameter :: WORDS_PER_BLOCK = 4
  !> Words turned into numbers at a time, while they are in the cache.
  integer, parameter :: CHUNK = 1024
  integer(i8), parameter :: BITS_OF_ONE = int(z'3ff0000000000000', i8)

  interface
    subroutine sgimp_philox_blocks(key, counter, blocks, words) bind(c)
      import :: c_int64_t
      implicit none
      integer(c_int64_t), intent(in) :: key(2), counter(4)
      integer(c_int64_t), value :: blocks
      integer(c_int64_t), intent(inout) :: words(*)
    end subroutine sgimp_philox_blocks
  end interface

contains

  !> The stream of the k-th random field.
  pure integer function field_stream_of(k) result(stream)
    integer, intent(in) :: k

    stream = FIELD_STREAM
    if (k > 1) stream = MORE_FIELDS + k
  end function field_stream_of

  !> Uniform numbers in the open interval (0, 1), one of each 64-bit word r:
  !> (floor(r/2^12) + 1/2) 2^-52. Every value is exact in double precision, and u and 1 - u are
  !> equally likely; with 53 bits the half would be rounded away, and 1 itself could come out.
  subroutine fill_uniform(seed, stream, realization, offset, values)
    integer(i8), intent(in) :: seed
    !> FIELD_STREAM, NOISE_STREAM.
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    !> Position of the first word wanted, from 0.
    integer(i8), intent(in) :: offset
    real(wp), contiguous, intent(out) :: values(:)
    integer(i8) :: words(CHUNK)
    integer :: first, i, count

    do first = 0, size(values) - 1, CHUNK
      count = min(CHUNK, size(values) - first)
      call fill_words(seed, stream, realization, offset + first, words(:count))
      ! The upper 52 bits as the fraction of a number in [1, 2): what a conversion gives, in fewer
      ! and in vector instructions. The difference is exact.
      do i = 1, count
        values(first + i) = transfer(ior(shiftr(words(i), 12), BITS_OF_ONE), 1.0_wp) &
          - (1.0_wp - 2.0_wp**(-53))
      end do
    end do
  end subroutine fill_uniform

  !> The 64-bit words themselves, as signed integers with the same bits; arguments as above.
  subroutine fill_words(seed, stream, realization, offset, words)
    integer(i8), intent(in) :: seed
    integer, intent(in) :: stream
    integer(i8), intent(in) :: realization
    integer(i8), intent(in) :: offset
    integer(i8), contiguous, intent(out) :: words(:)
    integer(i8) :: key(2), counter(4), one_block(WORDS_PER_BLOCK)
    integer :: done, skip, count

    key = [seed, int(stream, i8)]
    done = 0
    do while (done < size(words))
      counter = [1 + (offset + done)/WORDS_PER_BLOCK, realization, 0_i8, 0_i8]
      skip = int(mod(offset + done, int(WORDS_PER_BLOCK, i8)))
      count = (size(words) - done)/WORDS_PER_BLOCK*WORDS_PER_BLOCK
      if (skip == 0 .and. count > 0) then
        call sgimp_philox_blocks(key, counter, int(count/WORDS_PER_BLOCK, i8), words(done + 1:))
      else
        count = min(size(words) - done, WORDS_PER_BLOCK - skip)
        one_block = philox_block(counter, key)
        words(done + 1:done + count) = one_block(skip + 1:skip + count)
      end if
      done = done + count
    end do
  end subroutine fill_words

  !> One block of Philox4x64-10: four words out of four words of counter and two of key.
  function philox_block(counter, key) result(words)
    integer(i8), intent(in) :: counter(4), key(2)
    integer(i8) :: words(4)

    call sgimp_philox_blocks(key, counter, 1_i8, words)
  end function philox_block
end module sg_philox
