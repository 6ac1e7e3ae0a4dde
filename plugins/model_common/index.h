// Indices of lists have 32 bits, and counts may be products of two of them.
#pragma once
#include <cstdint>

namespace model {

// The end of a list after `n` more entries; throws the message if 32 bits cannot index them.
inline uint32_t after(uint32_t begin, uint64_t n, const char *sentence) {
  if (n > UINT32_MAX - begin) throw sentence;
  return begin + uint32_t(n);
}

}  // namespace model
