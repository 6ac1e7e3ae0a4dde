// What is prescribed over time: gravity, loads, springs, the ways of held points.
#include "state/spring.h"
#include "state/world.h"
#include "step/energy_watch.h"
#include "step/stages.h"

namespace dfm {

void stage_motion(World &w, double h, Array<Driven> &driven) {
  // Held velocities are the one part of the state that changes before a sub-step is known to succeed; what
  // was there is kept.
  if (!w.gravity.keys.empty()) change_gravity(w, vector_at(w.gravity.keys, w.time + h));
  for (auto &b : w.bodies) {
    if (b->slumber.asleep) continue;
    if (b->loads_vary()) {
      std::fill(b->p.load.begin(), b->p.load.end(), 0.0);
      for (const Load &load : b->loads) {
        double scale = load.keys.empty() ? 1 : scale_at(load.keys, w.time + h);
        if (load.sine.amplitude[0] != 0) scale *= 1 + load.sine.amplitude[0] * sine_at(load.sine, w.time + h);
        for (size_t i = 0; i < load.points.size(); ++i) {
          double *const f = &b->p.load[size_t(load.points[i]) * kStride];
          store3(f, load3(f) + scale * load3(&load.force[3 * i]));
        }
      }
      for (const Spring &spring : b->springs) add_spring_force(*b, spring, w.time, h);
    }
    for (const HeldMotion &m : b->motions) {
      const Pose first = m.keys.empty() ? Pose{} : to_pose(m.keys.front().pose);
      const Pose now = m.keys.empty() ? Pose{} : pose_at(m.keys, w.time + h);
      const Vec3 shift = m.sine.frequency != 0 || m.sine.phase != 0
                             ? sine_at(m.sine, w.time + h) * load3(m.sine.amplitude)
                             : Vec3{};
      for (size_t i = 0; i < m.points.size(); ++i) {
        const size_t at = size_t(m.points[i]) * kStride;
        const Vec3 local = rotate_back(first.rotation, load3(&m.start[3 * i]) - first.position);
        const Vec3 v = (1 / h) * (place(now, local) + shift - load3(&b->p.x[at]));
        for (int k = 0; k < 3; ++k)
          if (b->p.held[m.points[i]] & (1 << k)) {
            driven.push_back({&b->p.v[at + size_t(k)], b->p.v[at + size_t(k)]});
            b->p.v[at + size_t(k)] = v[k];
          }
      }
    }
  }
}

void undo_motion(Array<Driven> &driven) {
  for (size_t i = driven.size(); i-- > 0;) *driven[i].velocity = driven[i].before;
  driven.clear();
}

}  // namespace dfm
