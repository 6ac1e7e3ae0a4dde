// Effect of the roll-back on sliding, bouncing, momentum and normal force, beside the library's step, at two
// lengths of it. libdeform/doc/concepts/rollback.md holds what it prints.
#include <cstdio>

#include "rollback_cases.h"

namespace {

namespace rb = test::rollback;
struct Method {
  const char *name;
  rb::By id;
};
constexpr Method kMethods[] = {{"library", rb::By::library}, {"rollback", rb::By::rollback}};

void incline(const Method &m, double h) {
  for (const auto &[theta, mu] : {std::pair{30.0, 0.0}, {30.0, 0.3}}) {
    const rb::Slide s = rb::incline(m.id, theta, mu, h);
    const double exact =
        std::max(0.0, rb::kG * (std::sin(theta * rb::kDegree) - mu * std::cos(theta * rb::kDegree)));
    std::printf(
        "incline %2.0f deg, mu %.1f  %-9s h %.2g: a %.4f (exact %.4f) m/s2, way %.2e m, normal force "
        "reported %.4f felt %.4f of the weight's\n",
        theta, mu, m.name, h, s.acceleration, exact, s.way, s.reported, s.felt);
  }
}

void sliding(const Method &m, double h) {
  for (const double mu : {0.0, 0.3, 0.6}) {
    const rb::Throw s = rb::thrown(m.id, 1, mu, h);
    std::printf("thrown at 1 m/s, mu %.1f %-9s h %.2g: way %.4f (exact %.4f) m, time %.4f (%.4f) s\n", mu,
                m.name, h, s.way, mu > 0 ? 0.5 / (mu * rb::kG) : 2.0, s.time,
                mu > 0 ? 1 / (mu * rb::kG) : 2.0);
  }
}

void bounces(const Method &m, double h) {
  for (const double along : {0.0, 1.0})
    for (const double mu : {0.0, 0.3}) {
      const rb::Bounce b = rb::bounce(m.id, {along, 0, -1}, mu, h);
      std::printf(
          "bounce (%.0f, -1) m/s, mu %.1f %-9s h %.2g: leaves at (%.4f, %.4f) m/s, energy %.4f, after %.4f "
          "s; normal impulse reported %.4f of what it felt\n",
          along, mu, m.name, h, b.velocity[0], b.velocity[2], b.energy, b.time, b.reported);
    }
}

}  // namespace

int main() {
  for (const double h : {1e-3, 2.5e-4})
    for (const Method &m : kMethods) {
      incline(m, h);
      sliding(m, h);
      bounces(m, h);
      const rb::Collision c = rb::collision(m.id, 1, h);
      std::printf(
          "collision at 1 m/s  %-9s h %.2g: momentum left %.6f, energy left %.4f; flying %.4f, struck %.4f "
          "m/s\n",
          m.name, h, c.momentum, c.energy, c.first, c.second);
      const rb::Stacked s = rb::stacked(m.id, h);
      std::printf(
          "stack of two        %-9s h %.2g: floor reported %.4f felt %.4f, middle reported %.4f felt %.4f of "
          "what is above\n",
          m.name, h, s.floor_reported, s.floor_felt, s.middle_reported, s.middle_felt);
      std::fflush(stdout);
    }
  return 0;
}
