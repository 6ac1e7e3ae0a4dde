#include "body/zones.h"

#include <limits>
#include <span>

namespace dfm {
namespace {

// tris: ascending, all of them triangles.
uint32_t facing_zone(const Surface &s, const Array<uint32_t> &of, std::span<const uint32_t> tris,
                     Vec3 outward) {
  bool same = true;
  for (uint32_t t : tris) same = same && of[t] == of[tris[0]];
  if (same) return of[tris[0]];
  uint32_t best = tris[0];
  double most = -std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < tris.size(); ++i) {
    bool first = true;
    Vec3 sum;
    for (size_t j = 0; j < tris.size(); ++j) {
      if (s.patch[tris[j]] != s.patch[tris[i]]) continue;
      first = first && j >= i;
      sum += s.area2(tris[j], [&](uint32_t surfel) { return load3(&s.x[size_t{4} * surfel]); });
    }
    if (!first) continue;
    const double length = norm(sum), facing = length > 0 ? dot(sum, outward) / length : -1;
    if (facing > most) {
      most = facing;
      best = tris[i];
    }
  }
  return of[best];
}

}  // namespace

uint32_t zone_of(const Surface &s, const Array<uint32_t> &of, uint8_t type, uint32_t feature, Vec3 outward) {
  if (type == 2) return of[feature];
  if (type == 0)
    return facing_zone(s, of, {s.fan.data() + s.fan_begin[feature], s.fan.data() + s.fan_begin[feature + 1]},
                       outward);
  uint32_t side[2] = {s.edge_tri[size_t{2} * feature], s.edge_tri[size_t{2} * feature + 1]};
  if (side[0] > side[1]) std::swap(side[0], side[1]);  // kNone (open edge) comes last
  return facing_zone(s, of, {side, side[1] == kNone ? size_t{1} : size_t{2}}, outward);
}

}  // namespace dfm
