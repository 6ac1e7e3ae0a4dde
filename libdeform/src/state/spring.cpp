#include "state/spring.h"

#include "state/motion.h"

namespace dfm {

Vec3 spring_end(const Spring &s, double t) { return s.keys.empty() ? s.to : vector_at(s.keys, t); }

Vec3 spring_force(const Body &b, const Spring &s, double t, double h) {
  Vec3 x, v;
  for (size_t i = 0; i < s.points.size(); ++i) {
    const size_t at = size_t(s.points[i]) * kStride;
    x += s.weights[i] * load3(&b.p.x[at]);
    v += s.weights[i] * load3(&b.p.v[at]);
  }
  // Both ends are taken at t; otherwise a body that follows would be ahead by one step.
  const Vec3 end = spring_end(s, t), speed = h > 0 ? (1 / h) * (spring_end(s, t + h) - end) : Vec3{};
  return s.stiffness * (end - x) + s.damping * (speed - v);
}

void add_spring_force(Body &b, const Spring &s, double t, double h) {
  const Vec3 pull = spring_force(b, s, t, h);
  for (size_t i = 0; i < s.points.size(); ++i)
    add3(&b.p.load[size_t(s.points[i]) * kStride], s.weights[i] * pull);
}

void add_spring_bound(const Spring &s, double *stiffness, double *damping) {
  for (size_t i = 0; i < s.points.size(); ++i) {
    stiffness[s.points[i]] += s.stiffness * s.weights[i];
    damping[s.points[i]] += s.damping * s.weights[i];
  }
}

}  // namespace dfm
