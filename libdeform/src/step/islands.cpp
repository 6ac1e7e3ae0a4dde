#include "step/islands.h"

#include "core/lists.h"

namespace dfm {

Islands::Islands(const Memory &m) : DisjointSets(m) { use_memory(m, begin, member); }

void Islands::reserve(uint32_t n) {
  of.reserve(n);
  begin.reserve(size_t{n} + 1);
  member.reserve(n);
}

void Islands::finish() {
  count = number();
  list_by(count, of.size(), [&](uint32_t i) { return of[i]; }, begin, member);
}

}  // namespace dfm
