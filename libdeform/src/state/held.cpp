#include "state/held.h"

namespace dfm {

void drop_motions(Body &b, std::span<const uint32_t> points) {
  if (b.motions.empty()) return;
  std::vector<uint8_t> dropped(b.p.n);
  for (const uint32_t p : points) dropped[p] = 1;
  for (HeldMotion &m : b.motions) {
    size_t kept = 0;
    for (size_t i = 0; i < m.points.size(); ++i) {
      if (dropped[m.points[i]]) continue;
      m.points[kept] = m.points[i];
      for (size_t k = 0; k < 3; ++k) m.start[3 * kept + k] = m.start[3 * i + k];
      ++kept;
    }
    m.points.resize(kept);
    m.start.resize(3 * kept);
  }
  std::erase_if(b.motions, [](const HeldMotion &m) { return m.points.empty(); });
}

}  // namespace dfm
