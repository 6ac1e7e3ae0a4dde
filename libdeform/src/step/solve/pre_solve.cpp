#include "step/solve/pre_solve.h"

#include <cmath>

#include "core/error.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/pair_table.h"

namespace dfm {
namespace {

// m/s, of side a against side b over the sub-step without contact.
Vec3 free_velocity(const StepContext &step, const ContactPoint &c) {
  Vec3 u;
  for (uint32_t k = 0; k < c.nnode; ++k) {
    const BodyView &a = step.body_views[c.slot_a];
    const bool of_a = c.node[k] >= a.first_node && c.node[k] - a.first_node < a.surface->nsurfel;
    const BodyView &side = of_a ? a : step.body_views[c.slot_b];
    u += c.weight[k] * load3(&side.surface->v[4 * size_t{c.node[k] - side.first_node}]);
  }
  return u - load3(c.velocity);
}

dfm_contact_choice choice_of(const World &w, const StepContext &step, const ContactPoint &c) {
  dfm_contact_choice out{};
  out.size = sizeof out;
  out.a = w.bodies[c.slot_a]->handle;
  out.b = c.obstacle ? w.obstacles[c.slot_b]->handle : w.bodies[c.slot_b]->handle;
  out.key = c.key;
  out.kind = c.obstacle ? uint32_t{DFM_CONTACT_PRIMITIVE} : c.kind;
  out.feature_a = c.feature_a;
  out.feature_b = c.obstacle ? c.slot_b : c.feature_b;
  if (const uint32_t known = w.store.find(c.key); known != kNone && w.store.touching[known])
    out.flags |= DFM_CHOICE_TOUCHED;
  out.substep = static_cast<uint32_t>(w.stats.substeps);
  out.time = w.time;
  out.dt = step.h;
  store3(out.point, load3(c.point));
  store3(out.normal, load3(c.normal));
  out.gap = c.distance - w.offset;
  store3(out.velocity, free_velocity(step, c));
  out.enabled = 1;
  out.law = contact_law(w, c);
  out.friction_scale = 1;
  return out;
}

// Applies and checks the host's answer; returns whether the contact is accepted.
bool call_host(World &w, StepContext &step, const ContactPoint &c, StepContext::Chosen &to) {
  dfm_contact_choice choice = choice_of(w, step, c);
  w.pre_solve.call(w.pre_solve.user, &choice);
  if (!choice.enabled) return false;
  const Vec3 belt = load3(choice.surface_velocity);
  if (choice.law >= w.pairs.laws.size())
    fail(DFM_E_ARG, "the pre-solve function chose law %u for a contact; this world has %zu", choice.law,
         w.pairs.laws.size());
  if (!(choice.friction_scale >= 0 && choice.friction_scale < HUGE_VAL))
    fail(DFM_E_ARG, "the pre-solve function chose the friction scale %g; it must be finite and not negative",
         choice.friction_scale);
  if (!std::isfinite(norm2(belt)))
    fail(DFM_E_ARG, "the pre-solve function chose a surface velocity that is not finite");
  to = {choice.law, choice.friction_scale, belt};
  return true;
}

}  // namespace

void call_pre_solve(World &w, StepContext &step) {
  step.chosen.clear();
  if (!w.pre_solve.call || step.contacts.empty()) return;
  size_t kept = 0;
  for (size_t i = 0; i < step.contacts.size(); ++i) {
    const ContactPoint &c = step.contacts[i];
    StepContext::Chosen chosen;
    if (c.more > 0) {  // the answer belongs to the contact
      size_t first = 0;
      while (first < kept && step.contacts[first].key != c.key) ++first;
      if (first == kept) continue;
      chosen = step.chosen[first];
    } else if (!call_host(w, step, c, chosen)) {
      continue;
    }
    step.contacts[kept++] = c;
    step.chosen.push_back(chosen);
  }
  step.contacts.resize(kept);
}

bool query_host(World &w, StepContext &step, const ContactPoint &c) {
  StepContext::Chosen unused;
  return call_host(w, step, c, unused);
}

void take_choices(StepContext &step) {
  step.state.scale.clear();
  if (step.chosen.empty()) return;
  bool scaled = false;
  for (uint32_t i = 0; i < step.contacts.size(); ++i) {
    step.state.law[i] = step.chosen[i].law;
    scaled = scaled || step.chosen[i].scale != 1;
  }
  if (!scaled) return;
  step.state.scale.assign(step.state.stride, 1.0);
  for (uint32_t i = 0; i < step.contacts.size(); ++i) step.state.scale[i] = step.chosen[i].scale;
}

void run_belts(StepContext &step) {
  for (uint32_t i = 0; i < step.chosen.size(); ++i) {
    const Vec3 v = step.chosen[i].belt;
    if (v.x == 0 && v.y == 0 && v.z == 0) continue;
    const double *const f = &step.rows.frame[size_t(9) * i];
    step.rows.drive[size_t(3) * i + 1] += dot(load3(f + 3), v);
    step.rows.drive[size_t(3) * i + 2] += dot(load3(f + 6), v);
  }
}

}  // namespace dfm
