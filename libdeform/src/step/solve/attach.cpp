#include "step/solve/attach.h"

#include <algorithm>

#include "deform/attach.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/move_obstacles.h"
#include "step/rigid/rigid.h"
#include "step/sides.h"
#include "step/stages.h"

namespace dfm {
namespace {

// The gap is closed within the planned sub-step; within a piece of it that the guard has cut, which may be of
// any length, it would throw the body. A gap beyond d_c, made by a host, closes by at most d_c, or at
// recovery_speed, for the same reason.
Vec3 closing(const World &w, const StepContext &step, Vec3 gap) {
  const double most = w.def.recovery_speed > 0 ? w.def.recovery_speed : w.offset / step.length.planned;
  const Vec3 rate = (1 / step.length.planned) * gap;
  const double speed = norm(rate);
  return norm(gap) > w.offset && speed > most ? (most / speed) * rate : rate;
}

// A body that steps itself may have fewer motions than bonds. Some of its motions then hardly move the held
// points, and rigid bonds would need impulses of a thousand times the weight to correct the last micrometer,
// which throws the body (doc/decisions/contact_problem.md). Each rigid bond of such a body therefore gets
// this share of its surfel's own response as compliance; at rest that is a gap of at most 1e-9 m.
constexpr double kSoftness = 1e-5;

bool few_motions(const Body &b) { return !b.dynamics->abilities().placed; }

void add_bonds(World &w, StepContext &step, const Attachment &a) {
  const uint32_t slot_a = slot_of(w, a.body);
  const BodyView &body = step.body_views[slot_a];
  const size_t n = a.surfels.size();
  // that of the attachment, divided among its points
  const double share = 1 / double(n), spring = step.h * (step.h * a.stiffness + a.damping) * share;
  for (size_t i = 0; i < n; ++i) {
    Bond b{};
    b.slot_a = slot_a;
    b.obstacle = static_cast<uint8_t>(a.obstacle);
    b.nnode = 1;
    b.node[0] = body.first_node + a.surfels[i];
    b.weight[0] = 1;
    const Vec3 x = load3(&body.surface->x[size_t{4} * a.surfels[i]]);
    const Vec3 held = attached_place(w, a, i), gap = x - held;
    if (a.obstacle) {
      b.slot_b = obstacle_slot_of(w, a.to);
      const Obstacle &o = *w.obstacles[b.slot_b];
      if (is_moved(o)) {
        b.velocity = place_velocity(o, x, step);
      } else if (step.obstacle_views[b.slot_b].moves()) {
        const Pose end = end_pose(w, step, o);
        b.velocity = (1 / step.h) * (place(end, load3(&a.place[3 * i])) - held);
      }
    } else {
      b.slot_b = slot_of(w, a.to);
      for (size_t k = kAnchors * i; k < kAnchors * (i + 1); ++k) {
        if (a.weight[k] == 0) continue;
        b.node[b.nnode] = step.body_views[b.slot_b].first_node + a.node[k];
        b.weight[b.nnode++] = -a.weight[k];
      }
    }
    if (spring > 0) {
      b.rate = (step.h * a.stiffness * share / spring) * gap;
      b.soft = 1 / spring;
    } else {
      b.rate = closing(w, step, gap);
      if (few_motions(*w.bodies[slot_a]) || (!a.obstacle && few_motions(*w.bodies[b.slot_b])))
        b.softness = kSoftness;
    }
    step.bonds.push_back(b);
  }
}

bool holds(const World &w, const Attachment &a) {
  return !a.released && !w.bodies[slot_of(w, a.body)]->sleep_state.asleep;
}

void add_release(World &w, const Attachment &a, double t) {
  add_event(w, DFM_EVENT_RELEASE, a.body, a.to, a.number, t);
}

// They may touch from now on, and may overlap at present.
void part(World &w, Attachment &a) {
  w.overlaps.place(a.body);
  a.parted = w.changed = true;
}

}  // namespace

Vec3 place_velocity(const Obstacle &o, Vec3 x, const StepContext &step) {
  return mean_velocity_at(o, &o.rigid->first[6 * size_t{o.rigid_body}], x - step.rigid_places[o.slot].center,
                          step.h);
}

Pose attached_frame(const Obstacle &o) { return o.rigid ? load_pose(o.rigid->state[o.rigid_body]) : o.pose; }

Vec3 attached_place(const World &w, const Attachment &a, size_t i) {
  if (a.obstacle)
    return place(attached_frame(*w.obstacles[obstacle_slot_of(w, a.to)]), load3(&a.place[3 * i]));
  const Body &b = *w.bodies[slot_of(w, a.to)];
  Vec3 x;
  for (size_t k = kAnchors * i; k < kAnchors * (i + 1); ++k)
    b.surface.each_phyxel(a.node[k], [&](uint32_t phyxel, double weight) {
      x += (a.weight[k] * weight) * load3(&b.p.x[size_t{kStride} * phyxel]);
    });
  return x;
}

void make_bonds(World &w, StepContext &step, bool again) {
  step.bonds.clear();
  if (!again) step.bond_impulse.clear();
  for (const Attachment &a : w.attachments) {
    if (!holds(w, a)) continue;
    add_bonds(w, step, a);
    if (again) continue;
    const double scale = a.h > 0 ? step.h / a.h : 0;
    for (const double l : a.impulse) step.bond_impulse.push_back(scale * l);
  }
}

void keep_bonds(World &w, StepContext &step) {
  const double *l = step.rows.impulse.data() + size_t{3} * step.rows.n;
  for (Attachment &a : w.attachments) {
    if (!holds(w, a)) continue;
    std::copy_n(l, a.impulse.size(), a.impulse.begin());
    l += a.impulse.size();
    a.h = step.h;
    if (w.prescribed.is_static()) continue;  // the way to an equilibrium does not count
    const Vec3 p = a.sum();
    a.total += p;
    if (!(a.release > 0 && norm(p) > a.release * step.h)) continue;
    a.released = true;
    add_release(w, a, w.time + step.h);
  }
}

bool part_released(World &w) {
  bool any = false;
  for (Attachment &a : w.attachments) {
    if (!a.released || a.parted) continue;
    part(w, a);
    any = true;
  }
  return any;
}

void drop_released(World &w) {
  part_released(w);
  if (std::erase_if(w.attachments, [](const Attachment &a) { return a.released; }) > 0) w.changed = true;
}

void drop_attachments(World &w, uint64_t id) {
  reserve_events(w, w.attachments.size());
  const auto of = [&](const Attachment &a) { return a.body == id || a.to == id; };
  for (Attachment &a : w.attachments) {
    if (!of(a)) continue;
    if (!a.released) add_release(w, a, w.time);
    each_body(w, a, [&](uint32_t slot) { wake(w, *w.bodies[slot]); });
    part(w, a);
  }
  std::erase_if(w.attachments, of);
}

void wake_attached(World &w, StepContext &step) {
  if (w.sleepers == 0) return;
  for (const Attachment &a : w.attachments) {
    if (!a.obstacle || !step.obstacle_views[obstacle_slot_of(w, a.to)].moves()) continue;
    Body &b = *w.bodies[slot_of(w, a.body)];
    if (!b.sleep_state.asleep) continue;
    save_start(w, step);
    wake(w, b);
  }
}

}  // namespace dfm
