// Union-find with the lowest number as root: the root of an island is its first member, so numbering needs no
// sort.
#include "step/islands.h"

#include <algorithm>

namespace dfm {

Islands::Islands(const Memory &m) { use_memory(m, of, begin, member); }

void Islands::reserve(uint32_t n) {
  of.reserve(n);
  begin.reserve(size_t{n} + 1);
  member.reserve(n);
}

void Islands::start(uint32_t n) {
  of.resize(n);
  for (uint32_t i = 0; i < n; ++i) of[i] = i;  // until finish(): a thing nearer to the root
  count = 0;
}

uint32_t Islands::root(uint32_t a) {
  for (; of[a] != a; a = of[a]) of[a] = of[of[a]];
  return a;
}

void Islands::join(uint32_t a, uint32_t b) {
  a = root(a);
  b = root(b);
  if (a < b) of[b] = a;
  else of[a] = b;
}

void Islands::finish() {
  const uint32_t n = static_cast<uint32_t>(of.size());
  begin.assign(size_t{n} + 1, 0);
  // Roots precede their members and have no link: one ascending pass turns links into numbers.
  for (uint32_t i = 0; i < n; ++i) of[i] = of[i] == i ? count++ : of[of[i]];
  begin.resize(size_t{count} + 1);
  for (uint32_t i = 0; i < n; ++i) ++begin[of[i] + 1];
  for (uint32_t k = 0; k < count; ++k) begin[k + 1] += begin[k];
  member.resize(n);
  for (uint32_t i = 0; i < n; ++i) member[begin[of[i]]++] = i;
  for (uint32_t k = count; k > 0; --k) begin[k] = begin[k - 1];
  begin[0] = 0;
}

}  // namespace dfm
