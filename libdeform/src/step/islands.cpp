#include "step/islands.h"

namespace dfm {

Islands::Islands(const Memory &m) : DisjointSets(m) { use_memory(m, begin, member); }

void Islands::reserve(uint32_t n) {
  of.reserve(n);
  begin.reserve(size_t{n} + 1);
  member.reserve(n);
}

void Islands::finish() {
  const uint32_t n = static_cast<uint32_t>(of.size());
  count = number();
  begin.assign(size_t{count} + 1, 0);
  for (uint32_t i = 0; i < n; ++i) ++begin[of[i] + 1];
  for (uint32_t k = 0; k < count; ++k) begin[k + 1] += begin[k];
  member.resize(n);
  for (uint32_t i = 0; i < n; ++i) member[begin[of[i]]++] = i;
  for (uint32_t k = count; k > 0; --k) begin[k] = begin[k - 1];
  begin[0] = 0;
}

}  // namespace dfm
