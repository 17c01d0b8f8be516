/* Philox4x64-10 of Random123, which is a header of C inline functions. */
#include <stdint.h>
#include <Random123/philox.h>

/* words[4*b .. 4*b+3] = philox4x64-10 of the counter with b added to its first word, b = 0 ... blocks-1. */
void sgimp_philox_blocks(const uint64_t key[2], const uint64_t counter[4], int64_t blocks, uint64_t *words)
{
  const philox4x64_key_t k = {{key[0], key[1]}};
  philox4x64_ctr_t c = {{counter[0], counter[1], counter[2], counter[3]}};

  for (int64_t b = 0; b < blocks; ++b, ++c.v[0]) {
    const philox4x64_ctr_t r = philox4x64_R(10, c, k);
    for (int i = 0; i < 4; ++i) words[4 * b + i] = r.v[i];
  }
}
