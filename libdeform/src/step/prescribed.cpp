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

void stage_motion(const WorldState &state, Entities &entities, Rules &rules, const SubStepTimes &times,
                  FreeMotions &motions) {
  // Held velocities are the only state that changes before a sub-step has succeeded; the previous values are
  // kept.
  const Prescribed &prescribed = rules.prescribed;
  const double end = prescribed.at(state.time + times.h);
  if (!rules.gravity.keys.empty()) change_gravity(state, entities, rules, vector_at(rules.gravity.keys, end));
  for (auto &b : entities.bodies) {
    if (b->sleep_state.asleep) continue;
    if (b->loads_vary()) {
      const auto set = [&](double t) {
        set_loads(*b, t, prescribed.share);
        for (const Spring &spring : b->springs) {
          if (prescribed.is_static()) add_spring_force(*b, spring, end, 0);
          else add_spring_force(*b, spring, state.time, times.h);
        }
      };
      if (b->dynamics->abilities().parts) {
        set(prescribed.at(state.time));
        b->p.load_before = b->p.load;
      }
      set(end);
    }
    each_held_place(*b, prescribed.at(state.time + times.rest), [&](uint32_t point, Vec3 to) {
      const size_t at = size_t(point) * kStride;
      const Vec3 v = (1 / times.rest) * (to - load3(&b->p.x[at]));
      for (int k = 0; k < 3; ++k)
        if (b->p.held[point] & (1 << k)) {
          motions.driven.push_back({&b->p.v[at + size_t(k)], b->p.v[at + size_t(k)]});
          b->p.v[at + size_t(k)] = v[k];
        }
    });
  }
}

void undo_motion(Array<Driven> &driven) {
  for (size_t i = driven.size(); i-- > 0;) *driven[i].velocity = driven[i].before;
  driven.clear();
}

}  // namespace dfm
