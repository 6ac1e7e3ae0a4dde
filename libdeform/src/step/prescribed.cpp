// Prescribed gravity, loads, springs, and motions of held points.
#include "state/spring.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"

namespace dfm {

void set_loads(Body &b, double t, double share) {
  std::fill(b.p.load.begin(), b.p.load.end(), 0.0);
  for (const Load &load : b.loads) {
    const bool varies = load.sine.amplitude[0] != 0;
    double scale = load.keys.empty() ? (varies ? 1 : share) : scale_at(load.keys, t);
    if (varies) scale *= 1 + load.sine.amplitude[0] * sine_at(load.sine, t);
    for (size_t i = 0; i < load.points.size(); ++i)
      add3(&b.p.load[size_t(load.points[i]) * kStride], scale * load3(&load.force[3 * i]));
  }
}

void each_held_place(const Body &b, double t, const std::function<void(uint32_t, Vec3)> &use) {
  for (const HeldMotion &m : b.motions) {
    const Pose first = m.keys.empty() ? Pose{} : to_pose(m.keys.front().pose);
    const Pose now = m.keys.empty() ? Pose{} : pose_at(m.keys, t);
    const Vec3 shift =
        m.sine.frequency != 0 || m.sine.phase != 0 ? sine_at(m.sine, t) * load3(m.sine.amplitude) : Vec3{};
    for (size_t i = 0; i < m.points.size(); ++i) {
      const Vec3 local = rotate_back(first.rotation, load3(&m.start[3 * i]) - first.position);
      use(m.points[i], place(now, local) + shift);
    }
  }
}

bool stage_motion(World &w, StepContext &step, uint32_t *) {
  // Held velocities are the only state that changes before a sub-step has succeeded; the previous values are
  // kept.
  const double end = w.prescribed.at(w.time + step.h);
  if (!w.gravity.keys.empty()) change_gravity(w, vector_at(w.gravity.keys, end));
  for (auto &b : w.bodies) {
    if (b->sleep_state.asleep) continue;
    if (b->loads_vary()) {
      const auto set = [&](double t) {
        set_loads(*b, t, w.prescribed.share);
        for (const Spring &spring : b->springs) {
          if (w.prescribed.is_static()) add_spring_force(*b, spring, end, 0);
          else add_spring_force(*b, spring, w.time, step.h);
        }
      };
      if (b->dynamics->abilities().parts) {
        set(w.prescribed.at(w.time));
        b->p.load_before = b->p.load;
      }
      set(end);
    }
    each_held_place(*b, w.motion_time(step.rest), [&](uint32_t point, Vec3 to) {
      const size_t at = size_t(point) * kStride;
      const Vec3 v = (1 / step.rest) * (to - load3(&b->p.x[at]));
      for (int k = 0; k < 3; ++k)
        if (b->p.held[point] & (1 << k)) {
          step.driven.push_back({&b->p.v[at + size_t(k)], b->p.v[at + size_t(k)]});
          b->p.v[at + size_t(k)] = v[k];
        }
    });
  }
  return true;
}

void undo_motion(Array<Driven> &driven) {
  for (size_t i = driven.size(); i-- > 0;) *driven[i].velocity = driven[i].before;
  driven.clear();
}

}  // namespace dfm
