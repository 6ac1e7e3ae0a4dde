#include "deform/model.h"

#include <cmath>

#include "api/objects.h"
#include "core/error.h"
#include "world/idle.h"
#include "world/model_change.h"

using namespace dfm;

namespace {

dfm_params params_of(const dfm_params *given) {
  dfm_params none{};
  none.size = sizeof none;
  return given ? *given : none;
}

// Makes a switch from one entry.
Switch make_switch(const Body &b, const dfm_switch &s, double after) {
  need(s.type, "type");
  if (!std::isfinite(s.t) || s.t < after)
    refuse(b, ": a switch at %g s after one at %g s; times must be finite and must not decrease", s.t, after);
  Switch out{s.t, choose_model(b, s.type, s.params, s.integrator)};
  if (!(s.max_jump >= 0)) refuse(b, ": max_jump is %g J; it must be above 0, or 0 for any jump", s.max_jump);
  if (s.max_jump > 0) out.to.max_jump = s.max_jump;
  return out;
}

// It is a member of dfm_switch_rule, so its size is the same in every version.
ModelChoice make_choice(const Body &b, const char *name, const dfm_model_choice &c, double max_jump) {
  if (c.size != sizeof c && (c.type || c.size))
    refuse(b, ": the size of '%s' is %u, expected %zu; start from dfm_switch_rule_default()", name, c.size,
           sizeof c);
  if (!c.type) return {};
  ModelChoice out = choose_model(b, c.type, c.params, c.integrator);
  // before a change to another model
  if (out.integrator == kSameIntegrator) out.integrator = b.origin.integrator;
  if (max_jump > 0) out.max_jump = max_jump;
  return out;
}

SwitchRule make_rule(const Body &b, const dfm_switch_rule &r) {
  if (!r.otherwise.type || (!r.touching.type && !r.near_by.type))
    refuse(b, ": a rule needs a model for otherwise (far), and a model for touching, near_by (near) or both");
  if (!(r.max_jump >= 0))
    refuse(b, ": max_jump is %g J; give a number above 0, or 0 for no limit", r.max_jump);
  for (const double x : {r.hysteresis, r.wait})
    if (!(x >= 0 && std::isfinite(x)))
      refuse(b, ": hysteresis and wait (s) are finite and not negative; found %g", x);
  SwitchRule out;
  out.touching = make_choice(b, "touching", r.touching, r.max_jump);
  out.near = make_choice(b, "near_by", r.near_by, r.max_jump);
  out.far = make_choice(b, "otherwise", r.otherwise, r.max_jump);
  out.hysteresis = r.hysteresis;
  out.wait = r.wait;
  if (!r.near_by.type) return out;
  if (!all_finite(r.point, 3)) refuse(b, ": the point of a rule is not finite");
  if (!(r.distance > 0 && std::isfinite(r.distance)))
    refuse(b, ": the distance of a rule is %g m; it must be positive and finite", r.distance);
  out.point = load3(r.point);
  out.distance = r.distance;
  return out;
}

}  // namespace

dfm_status dfm_body_set_model(dfm_body body, const char *type, const dfm_params *params) {
  return as_status(body_of, body, [&](Body &b) {
    World &w = exclusive(*b.world);
    need(type, "type");
    const ModelChoice to = choose_model(b, type, params_of(params), DFM_INTEGRATOR_AUTO);
    w.swaps.reserve(w.swaps.size() + 1);
    Swap swap;
    change_model(b, to, swap);
    keep_swap(w, swap);
    warn_of_idle(b);
  });
}

dfm_status dfm_body_set_switches(dfm_body body, uint32_t n, const dfm_switch *switches) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    if (n) need(switches, "switches");
    std::vector<Switch> made;
    const char *const from = "start from dfm_switch_default()";
    for (const dfm_switch &s : take_defs(switches, n, dfm_switch_default(), "switch", from))
      made.push_back(make_switch(b, s, made.empty() ? -HUGE_VAL : made.back().t));
    rehearse(b, made, b.rule, false);
    b.switches.swap(made);
  });
}

dfm_status dfm_body_set_switch_rule(dfm_body body, const dfm_switch_rule *rule) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    std::vector<SwitchRule> made;
    if (rule) made.push_back(make_rule(b, take_def(rule, dfm_switch_rule_default())));
    rehearse(b, b.switches, made, false);
    b.rule.swap(made);
  });
}

dfm_status dfm_body_set_interest(dfm_body body, const double point[3]) {
  return as_status(to_change<body_of>, body, [&](Body &b) {
    need(point, "point");
    if (!all_finite(point, 3)) refuse(b, ": the point is not finite");
    if (b.rule.empty() || b.rule[0].near.type.empty())
      refuse(b, " has no rule that depends on a point; call dfm_body_set_switch_rule first");
    b.rule[0].point = load3(point);
  });
}

dfm_status dfm_world_swaps_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_swap *out,
                                 uint32_t *n) {
  return as_status([&] {
    Rows<dfm_swap> rows(out, row_size, "dfm_swap");
    World &w = exclusive(world_of(world));
    if (!room(w.swaps.size(), capacity, out, n)) return;
    for (const Swap &s : w.swaps)
      rows.add({0, s.refused ? uint32_t{DFM_SWAP_REFUSED} : 0, s.body, s.t, s.from->id, s.to->id, s.before,
                s.after, s.max_jump});
    w.swaps.clear();
  });
}
