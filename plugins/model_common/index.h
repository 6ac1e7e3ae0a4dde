// Places in lists are numbers of 32 bits, and what is counted may be products of two of them.
#pragma once
#include <cstdint>

namespace model {

// Where a list goes on behind `n` entries more; throws the sentence where no index names them any more.
inline uint32_t after(uint32_t begin, uint64_t n, const char *sentence) {
  if (n > UINT32_MAX - begin) throw sentence;
  return begin + uint32_t(n);
}

}  // namespace model
