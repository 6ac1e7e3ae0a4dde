#include "world/rest_loads.h"

#include <algorithm>

#include "state/spring.h"
#include "state/world.h"

namespace dfm {
namespace {

Vec3 mean_of(const Body &b, const Spring &s) {
  Vec3 x;
  for (size_t i = 0; i < s.points.size(); ++i)
    x += s.weights[i] * load3(&b.p.x[size_t(s.points[i]) * kStride]);
  return x;
}

}  // namespace

void loads_at_rest(const World &w, const Body &b, double *f) {
  const Phyxels &p = b.p;
  for (size_t i = 0; i < p.n; ++i)
    for (size_t k = 0; k < 3; ++k)
      f[i * kStride + k] = p.load[i * kStride + k] + p.mass[i] * w.gravity.now[int(k)];
  for (const Spring &s : b.springs) {
    const Vec3 pull = s.stiffness * (spring_end(s, w.time) - mean_of(b, s));
    for (size_t i = 0; i < s.points.size(); ++i) {
      double *const at = f + size_t(s.points[i]) * kStride;
      store3(at, load3(at) + s.weights[i] * pull);
    }
  }
}

std::vector<double> softness_of(const Body &b) {
  std::vector<double> softness(b.p.n), damping(b.p.n);
  for (const Spring &s : b.springs) add_spring_bound(s, softness.data(), damping.data());
  return softness;
}

bool is_free(const Body &b) {
  return b.springs.empty() && std::all_of(b.p.held.begin(), b.p.held.end(), [](uint8_t h) { return h == 0; });
}

}  // namespace dfm
