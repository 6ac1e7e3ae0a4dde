// Contacts of the sub-step, without impossible depths. A contact of a sleeping body wakes its island.
#include <algorithm>
#include <cmath>

#include "contact/reach.h"
#include "geometry/area.h"
#include "geometry/closest.h"
#include "narrow/narrow_phase.h"
#include "narrow/parts.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"

namespace dfm {
namespace {

// Share of d_c: if a surface is nearer than this, rounding may decide the side. The guard keeps twice this
// distance, unless surfaces start nearer.
constexpr double kClearly = 0.25;

const Surface &surface_b(const StepContext &step, const ContactPoint &c) {
  return c.obstacle ? *step.obstacle_views[c.slot_b].surface : *step.body_views[c.slot_b].surface;
}

bool of_surfel_and_face(const ContactPoint &c) { return c.obstacle ? c.type_a != 1 : c.kind == kVertexFace; }

// For two bodies: whether the edges cross between their ends, without extending them.
bool edges_cross(const StepContext &step, const ContactPoint &c) {
  const BodyView &a = step.body_views[c.slot_a];
  for (uint32_t k = 0; k < c.nnode; ++k) {
    const bool of_a = c.node[k] - a.first_node < a.surface->nsurfel;
    if (of_a ? c.weight[k] < 0 : c.weight[k] > 0) return false;
  }
  return true;
}

// m, how much nearer than d_c the contact rests, which is part of its `distance`.
double nearer_at_rest(const StepContext &step, double offset, const ContactPoint &c) {
  if (c.obstacle) return 0;
  const BodyView &a = step.body_views[c.slot_a], &b = step.body_views[c.slot_b];
  if (!parts_of_one(*a.surface, a.id, *b.surface, b.id)) return 0;
  return offset -
         rest_of_parts(*a.surface, *b.surface, c.kind, c.feature_a, c.feature_b, load3(c.normal), offset);
}

// A contact of a surfel and a face, on the side of the face where the surfel is. False: the surfel is not
// over the face itself, or out of reach.
bool turn_over(const StepContext &step, double offset, ContactPoint &c) {
  const Surface &a = *step.body_views[c.slot_a].surface, &b = surface_b(step, c);
  const bool face_of_a = c.type_a == 2;
  const Surface &points = face_of_a ? b : a, &faces = face_of_a ? a : b;
  const uint32_t surfel = face_of_a ? c.feature_b : c.feature_a;
  const uint32_t *const corner = &faces.tri[3 * size_t{face_of_a ? c.feature_a : c.feature_b}];
  const auto x = [](const Surface &s, uint32_t i) { return load3(&s.x[4 * size_t{i}]); };
  const auto v = [](const Surface &s, uint32_t i) { return load3(&s.v[4 * size_t{i}]); };
  if (closest_on_triangle(x(points, surfel), x(faces, corner[0]), x(faces, corner[1]), x(faces, corner[2]))
          .feature != TriangleFeature::face)
    return false;
  double speed2 = 0;
  for (int k = 0; k < 3; ++k) speed2 = std::max(speed2, norm2(v(points, surfel) - v(faces, corner[k])));
  const auto nearer = [&] { return nearer_at_rest(step, offset, c); };
  const double true_distance = c.distance - nearer();
  store3(c.normal, -load3(c.normal));
  c.distance = nearer() - true_distance;
  if (!face_of_a) c.area = (c.obstacle ? 1 : 0.5) * facing_area(a, surfel, -load3(c.normal));
  return c.distance < contact_reach(step.h, offset, std::sqrt(speed2));
}

// Where two surfaces do not cross, no point has passed through one of them. So a point behind a face lies
// outside: the face looks inward, because its surface is folded through itself. A contact that leads the
// point through the face works against the guard, and the impulses of both would grow without bound
// (doc/decisions/contact_problem.md).
void turn_false_depths(World &w, StepContext &step) {
  if (!w.plan.has(StageRole::guards)) return;
  const auto is_false = [&](const ContactPoint &c) {
    if (!(c.distance < -kClearly * w.offset)) return false;
    if (c.obstacle) {
      if (step.obstacle_views[c.slot_b].shape != Shape::mesh || !of_surfel_and_face(c)) return false;
      return !cross_at_start(step, c.slot_a, c.slot_b, true);
    }
    return (of_surfel_and_face(c) || edges_cross(step, c)) &&
           !cross_at_start(step, std::min(c.slot_a, c.slot_b), std::max(c.slot_a, c.slot_b), false);
  };
  std::erase_if(step.contacts, [&](ContactPoint &c) {
    return is_false(c) && !(of_surfel_and_face(c) && turn_over(step, w.offset, c));
  });
}

}  // namespace

Next stage_narrow(World &w, StepContext &step, uint32_t *) {
  step.narrow.forget_speeds();
  for (const uint32_t i : step.active) step.narrow.set_speed(step.body_views, i, step.broad.speed(i));
  const bool known = w.plan.has(StageRole::guards);
  if (known) follow_pairs(w, step, false);
  find_contacts(step.body_views, step.obstacle_views, step.broad.candidates(), step.h, w.offset,
                w.store.crossings, step.lent, step.contacts, &step.narrow, &w.context->tasks,
                known ? &step.guard.memory : nullptr);
  turn_false_depths(w, step);
  step.woken.clear();
  if (w.sleepers == 0) return Next::stage;
  for (const ContactPoint &c : step.contacts) {
    if (w.bodies[c.slot_a]->sleep_state.asleep) wake(w, *w.bodies[c.slot_a]);
    if (!c.obstacle && w.bodies[c.slot_b]->sleep_state.asleep) wake(w, *w.bodies[c.slot_b]);
  }
  std::sort(step.woken.begin(), step.woken.end());
  return step.woken.empty() ? Next::stage : Next::woken;
}

}  // namespace dfm
