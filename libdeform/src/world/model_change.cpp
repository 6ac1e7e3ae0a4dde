// A change of model changes no position and no velocity: surface, momentum, angular momentum and kinetic
// energy stay to the bit. What jumps is the elastic energy, because two models see different energies in one
// shape; the jump is measured before the change takes effect (doc/decisions/models.md).
#include "world/model_change.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <span>

#include "body/make_surface.h"
#include "core/error.h"
#include "math/polar.h"
#include "math/turn.h"
#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "plugin/registry.h"
#include "state/world.h"
#include "step/context.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "world/body_model.h"
#include "world/change_energy.h"
#include "world/idle.h"
#include "world/may_cut.h"
#include "world/measure.h"
#include "world/queries.h"

namespace dfm {
namespace {

constexpr char kMaxJump[] = "max_jump";
// Largest displacement of the surface, relative to the size of the body, by a model that steps itself.
constexpr double kSurfaceStays = 1e-6;
constexpr double kInstant = 1e-9;  // s, too short for any motion
constexpr double kSlender = 1e-3;  // of the size: less across a line defines no direction
constexpr double kOnTime = 1e-6;   // of a step: a switch may be early by this share
constexpr size_t kMaxSwaps = 4096;
constexpr size_t kMaxCached = 2;  // a rule has three models

// ---- rigid placement of the body ------------------------------------------------------------------

Vec3 rest_of(const Body &b, uint32_t i) { return b.p.rest_at(i); }
Vec3 now_of(const Body &b, uint32_t i) { return b.p.x_at(i); }

struct Middle { Vec3 rest, now; };

Middle middle_of(const Body &b, std::span<const double> weight, double all) {
  Middle out;
  for (uint32_t i = 0; i < b.p.n; ++i) {
    out.rest += (weight[i] / all) * rest_of(b, i);
    out.now += (weight[i] / all) * now_of(b, i);
  }
  return out;
}

// The rotation of the linear map from the rest shape to the present one, by least squares. flat: the points
// may lie in a plane, whose normal then turns with them. Returns false if there is none.
bool turn_of(const Body &b, std::span<const double> weight, const Middle &middle, bool flat, double *r) {
  Vec3 a[3], s[3];  // columns of the sums of m x X^T, m X X^T
  const auto add = [&](double m, Vec3 x, Vec3 rest) {
    for (int k = 0; k < 3; ++k) {
      a[k] += rest[k] * (m * x);
      s[k] += rest[k] * (m * rest);
    }
  };
  for (uint32_t i = 0; i < b.p.n; ++i) add(weight[i], now_of(b, i) - middle.now, rest_of(b, i) - middle.rest);
  if (flat) {
    Vec3 normal, turned;
    for (int k = 0; k < 3; ++k)
      if (const Vec3 n = cross(s[k], s[(k + 1) % 3]); norm2(n) > norm2(normal)) {
        normal = n;
        turned = cross(a[k], a[(k + 1) % 3]);
      }
    const double size = s[0].x + s[1].y + s[2].z;
    if (!(norm(normal) > kSlender * kSlender * size * size)) return false;  // they are on a line
    add(size, normalized(turned), normalized(normal));
  }
  const Vec3 rows[3] = {cross(s[1], s[2]), cross(s[2], s[0]),
                        cross(s[0], s[1])};  // inverse times determinant
  double f[9] = {};
  for (int row = 0; row < 3; ++row)
    for (int col = 0; col < 3; ++col)
      for (int k = 0; k < 3; ++k) f[3 * row + col] += a[k][row] * rows[k][col];
  return polar_rotation(f, r);
}

// The frame of the rest shape for a model whose forces do not rotate with the body: the present rotation of
// the body, of its held points where these are not on a line. Such a model is valid for small rotations
// relative to this frame.
Pose frame_of(const Body &b) {
  const Middle middle = middle_of(b, b.p.mass, b.mass);
  std::vector<double> held;
  for (const uint8_t axes : b.p.held) held.push_back(axes == 7);
  const double all = std::accumulate(held.begin(), held.end(), 0.0);
  double r[9];
  Pose frame = b.origin.frame;
  if ((all > 0 && turn_of(b, held, middle_of(b, held, all), true, r)) ||
      turn_of(b, b.p.mass, middle, false, r))
    frame.rotation = quat_of(r);
  frame.position = middle.now - rotate(frame.rotation, middle.rest);
  return frame;
}

// ---- checks of the new model ------------------------------------------------------------------

double size_of(const Body &b) { return extent_of(b.p.rest.data(), b.p.n, 3).longest(); }

// A model that steps itself may represent only some shapes. A sub-step that is too short for any motion, with
// the forces of the last one, shows where it would put the surface; the result is discarded.
void check_surface(World &w, Body &b) {
  if (!b.model.stepper) return;
  const SubStep now{w.time, kInstant, w.gravity.now, HUGE_VAL, w.gravity.now};
  const double share = b.impulse_time() > 0 ? kInstant / b.impulse_time() : 0;
  std::vector<double> impulse(b.surfel_impulse.begin(), b.surfel_impulse.end());
  for (double &p : impulse) p *= share;
  double kinetic = 0, most = 0;
  const bool knows =
      b.dynamics->free_motion(now, kinetic) && b.dynamics->end_state(now, impulse.data(), true);
  if (knows)
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
      Vec3 jump;
      b.surface.each_phyxel(s, [&](uint32_t i, double weight) {
        const size_t at = size_t{kStride} * i;
        jump += weight * (load3(&b.p.x_end[at]) - load3(&b.p.x[at]) - kInstant * load3(&b.p.v[at]));
      });
      most = std::max(most, norm(jump));
    }
  if (b.sleep_state.asleep) gather_surface(b.surface, b.p.x.data(), b.p.v.data());
  if (!knows)
    refuse(b, DFM_DISCARD,
           ": model '%s' cannot continue from the present shape; change the model where the body is nearer "
           "to its rest shape; nothing was changed",
           b.model.type->id);
  if (most > kSurfaceStays * size_of(b))
    refuse(b, DFM_DISCARD,
           ": model '%s' would move the surface by %g m at once, and at most %g m are allowed; change the "
           "model where the body is nearer to its rest shape; nothing was changed",
           b.model.type->id, most, kSurfaceStays * size_of(b));
}

// Effects of the scene's list that only the old model provides.
void check_effects(const World &w, const Body &b, const ModelInstance &old, const ModelInstance &fresh) {
  if (!w.selection.listed()) return;
  const std::vector<std::string> now = effects(*fresh.type);
  for (const std::string &effect : effects(*old.type)) {
    const bool stays = std::find(now.begin(), now.end(), effect) != now.end() && fresh.works(effect);
    if (stays || !old.works(effect) || !w.selection.lists(effect)) continue;
    const auto &offered = w.steps->facts.offered;
    const auto is = [&](const SceneFacts::Provider &p) { return p.effect == effect; };
    if (std::count_if(offered.begin(), offered.end(), is) > 1) continue;
    refuse(b,
           ": effect '%s' is asked for, and with model '%s' nothing in the scene would provide it; take it "
           "from the list of effects, or choose a model that has it; nothing was changed",
           effect.c_str(), fresh.type->id);
  }
}

void check_springs(const Body &b, const dfm_type &type, const Dynamics &moves) {
  if (b.springs.empty() || moves.abilities().springs) return;
  refuse(b, DFM_E_UNSUPPORTED,
         ": springs are integrated explicitly and need a model with a step bound, which '%s' does not have; "
         "remove its springs first; nothing was changed",
         type.id);
}

void check_jump(const Body &b, const Swap &swap) {
  if (std::isinf(swap.max_jump)) return;
  const double jump = std::fabs(swap.after - swap.before);
  if (std::isnan(jump))
    refuse(b, DFM_DISCARD,
           ": '%s' or '%s' gives no energy, so the jump from one to the other cannot be held to max_jump (%g "
           "J); leave max_jump out; nothing was changed",
           swap.from->id, swap.to->id, swap.max_jump);
  if (jump > swap.max_jump)
    refuse(b, DFM_DISCARD,
           ": from '%s' to '%s' its elastic energy would jump from %g J to %g J, by more than max_jump (%g "
           "J); raise it, or change the model where the body is less deformed; nothing was changed",
           swap.from->id, swap.to->id, swap.before, swap.after, swap.max_jump);
}

// A model whose forces do not rotate with the body has strain if the body has rotated.
void warn_of_jump(const World &w, const Body &b, const Swap &swap) {
  const double jump = std::fabs(swap.after - swap.before);
  const double has = std::min(swap.before, swap.after) + kinetic_of(b);
  if (!std::isinf(swap.max_jump) || !(jump > has + rounded_energy(b))) return;
  w.context->warn(
      "t = %g s, body '%s': from '%s' to '%s' its elastic energy jumps from %g J to %g J, by more than all "
      "the energy it has; change the model where it is less deformed and has turned less, or give max_jump",
      w.time, b.name.c_str(), swap.from->id, swap.to->id, swap.before, swap.after);
}

// Called with the new model in place.
void judge(World &w, Body &b, const ModelInstance &old, const ChangeBook &book, Swap &swap) {
  check_springs(b, *b.model.type, *b.dynamics);
  check_effects(w, b, old, b.model);
  swap.after = elastic_energy(b);
  check_jump(b, swap);
  check_unpaid(b, book, swap);
  check_surface(w, b);
  if (b.tears || cut_by_any(b) || !b.planned_cuts.empty() || b.separate.waits) check_may_cut(b, b.model);
}

// Keeps an instance for later changes; replaces an older one with the same inputs. There is room.
void cache_model(std::vector<CachedModel> &cached_models, MadeModel &left) {
  const auto same = [&](const CachedModel &s) {
    return s.instance.type == left.model.type && s.origin.params == left.origin.params;
  };
  std::erase_if(cached_models, same);
  if (cached_models.size() == kMaxCached) cached_models.erase(cached_models.begin());
  cached_models.push_back({std::move(left.model), std::move(left.origin), std::move(left.switched_off)});
}

// The inputs of an instance of this type, at the present state of the body.
ModelOrigin origin_for(const Body &b, const dfm_type &type, const ModelChoice &to) {
  ModelOrigin origin{to.params,
                     b.origin.frame,
                     to.integrator == kSameIntegrator ? b.origin.integrator : to.integrator,
                     {b.p.held.begin(), b.p.held.end()}};
  if (!rests_unplaced(type)) origin.frame = frame_of(b);
  return origin;
}

// s, the stable sub-step of the body with it.
double stable_with(Body &b, MadeModel &made) {
  StepBound bound;
  exchange(b, made);
  const bool known = b.dynamics->bound(b.world->time, b.integrator.share, [](double *, double *) {}, bound);
  exchange(b, made);
  return known ? kBoundShare * bound.step : -1;
}

// A future change, at t or at any time from then on, of a body that has this integrator from then on. named:
// the change names it.
void rehearse(Body &b, ModelChoice &to, double t, uint32_t integrator, bool at_rest, bool named,
              std::vector<CachedModel> &cached_models) {
  World &w = *b.world;
  const dfm_type &type = w.context->registry.find(DFM_KIND_MODEL, to.type);
  ModelOrigin origin = origin_for(b, type, to);
  origin.integrator = integrator;
  const std::unique_ptr<MadeModel> made =
      make_body_model(w, b, type, std::move(origin), static_cast<int32_t>(integrator));
  check_springs(b, type, *made->dynamics);
  if (b.tears || cut_by_any(b) || (!b.planned_cuts.empty() && b.planned_cuts.back().t > t))
    check_may_cut(b, made->model);
  to.stable = stable_with(b, *made);
  if (named) warn_of_own_steps(b, made->model, static_cast<int32_t>(to.integrator));
  if (!w.changed) check_effects(w, b, b.model, made->model);
  if (at_rest && made->model.stepper)
    refuse(
        b, DFM_E_UNSUPPORTED,
        ": model '%s' steps itself and gives no stiffness, which an equilibrium needs; choose another model",
        type.id);
  // one whose forces do not rotate with the body is valid at the present placement only
  const bool lasts = rests_unplaced(type);
  if (lasts && cached_models.size() < kMaxCached) cache_model(cached_models, *made);
}

}  // namespace

bool is_made_so(const Body &b, const ModelChoice &c) {
  return c.type == b.model.type->id && c.params == b.origin.params &&
         (c.integrator == kSameIntegrator || c.integrator == b.origin.integrator);
}

ModelChoice choose_model(const Body &b, const char *type, const dfm_params &params, int32_t integrator) {
  const dfm_type &found = b.world->context->registry.find(DFM_KIND_MODEL, type);
  check_given(b, params);
  check_integrator(b, integrator);
  ModelChoice out;
  out.type = found.id;
  if (integrator != DFM_INTEGRATOR_AUTO) out.integrator = static_cast<uint32_t>(integrator);
  std::vector<dfm_param_value> own(params.values, params.values + params.n);
  const auto limit = [](const dfm_param_value &v) { return v.key && std::strcmp(v.key, kMaxJump) == 0; };
  for (const dfm_param_value &v : own) {
    if (!limit(v)) continue;
    if (!v.value || v.width != 1 || !(*v.value > 0) || out.max_jump < HUGE_VAL)
      refuse(b, ": max_jump is one number of joules above 0, given once");
    out.max_jump = *v.value;
  }
  std::erase_if(own, limit);
  out.params = keep_params(found, {sizeof(dfm_params), static_cast<uint32_t>(own.size()), own.data()});
  requested_values(*b.world, b, found, out.params);
  return out;
}

void change_model(Body &b, const ModelChoice &to, Swap &swap) {
  World &w = *b.world;
  const OnBehalf prefix(b.name);
  const dfm_type &type = w.context->registry.find(DFM_KIND_MODEL, to.type);
  prepare(w);
  ModelOrigin origin = origin_for(b, type, to);
  swap = {b.handle, w.time, b.model.type, &type, elastic_energy(b), NAN, to.max_jump};
  ChangeBook book = check_changes(b, swap.before);
  const int32_t integrator = static_cast<int32_t>(origin.integrator);
  b.cached_models.reserve(kMaxCached);
  const std::unique_ptr<MadeModel> made = make_body_model(w, b, type, std::move(origin), integrator);
  exchange(b, *made);
  try {
    judge(w, b, made->model, book, swap);
    warn_of_jump(w, b, swap);
    w.changed = true;
    reopen_integrators(w);  // the choices for other bodies may no longer fit
    prepare(w);
  } catch (...) {
    exchange(b, *made);
    if (!b.rule.empty()) cache_model(b.cached_models, *made);  // the rule may use it again
    throw;
  }
  book_change(b, book, swap);
  b.changes = book;
  if (w.step_count == 0) b.first_model = model_hash(b);
  if (!b.rule.empty()) cache_model(b.cached_models, *made);
  wake(w, b);
  w.sizes = {};  // another bound, and other errors
}

void rehearse(Body &b, std::vector<Switch> &switches, std::vector<SwitchRule> &rule, bool at_rest) {
  std::vector<CachedModel> cached_models;
  cached_models.reserve(kMaxCached);
  uint32_t integrator = b.origin.integrator;
  const auto one = [&](ModelChoice &to, double t, const std::string &when, bool named = false) {
    if (to.type.empty()) return;
    if (to.integrator != kSameIntegrator) integrator = to.integrator;
    if (!at_rest && is_made_so(b, to) && integrator == b.origin.integrator) return;
    try {
      rehearse(b, to, t, integrator, at_rest, named, cached_models);
    } catch (const Error &e) {
      if (e.status == DFM_E_NOMEM) throw;
      const std::string whose = format("body '%s': ", b.name.c_str());
      const char *const why = e.what() + (e.sentence.rfind(whose, 0) == 0 ? whose.size() : 0);
      fail(e.status, "%sits change to '%s' %s cannot be made: %s", whose.c_str(), to.type.c_str(),
           when.c_str(), why);
    }
  };
  for (Switch &s : switches) one(s.to, s.t, format("at %g s", s.t), s.to.integrator != kSameIntegrator);
  for (SwitchRule &r : rule) {
    one(r.touching, b.world->time, "by the rule (touching)");
    one(r.near, b.world->time, "by the rule (near)");
    one(r.far, b.world->time, "by the rule (far)");
  }
  b.cached_models.swap(cached_models);
}

void check_first_step(World &w, Body &b) {
  if (!b.model.stepper) return;
  const Overheard why;
  double kinetic = 0;
  const SubStep now{w.time, kInstant, w.gravity.now, HUGE_VAL, w.gravity.now};
  if (b.dynamics->free_motion(now, kinetic) || !*why.text()) return;
  refuse(b, DFM_E_UNSUPPORTED, ": %s", why.text());
}

void keep_swap(World &w, const Swap &swap) {
  if (w.swaps.size() == kMaxSwaps) w.swaps.erase(w.swaps.begin());
  w.swaps.push_back(swap);
}

bool try_change(World &w, Body &b, const ModelChoice &to, bool report) {
  w.swaps.reserve(w.swaps.size() + 1);
  Swap swap;
  try {
    change_model(b, to, swap);
  } catch (const Error &e) {
    if (e.status != DFM_DISCARD) throw;
    swap.refused = true;
    if (report && !(swap.unpaid && b.changes.reported)) w.context->warn("t = %g s: %s", w.time, e.what());
  }
  b.changes.reported = b.changes.reported || swap.unpaid;
  if (report || !swap.refused) keep_swap(w, swap);
  return !swap.refused;
}

namespace {

// ---- rules ------------------------------------------------------------------------------------------------

// Selects the model of a body by contact and distance, between steps:
//
//   touching   it has a contact
//   near       a point of its surface lies within a distance of the place of interest
//   far        else
//
// A finer model (higher in this list) is taken at once. It is kept until it has not been needed for a while,
// and the distance at which near ends is larger than that at which it begins, so that a body that bounces, or
// stays near the limit, does not change back and forth. Sleeping bodies do not change, because a change would
// wake them.
const ModelChoice &choice_of(const SwitchRule &r, SwitchLevel level) {
  return level == SwitchLevel::touching ? r.touching : level == SwitchLevel::near ? r.near : r.far;
}

void find_touching(World &w, Array<uint8_t> &touching) {
  touching.assign(w.bodies.size(), 0);
  for (uint32_t m = 0; m < w.store.n; ++m)
    for (const uint64_t id : {w.store.id_a[m], w.store.id_b[m]})
      if (const uint32_t i = slot_of(w, id); w.store.touching[m] && i != kNone) touching[i] = 1;
}

bool is_near(const Body &b, const SwitchRule &r) {
  const bool was = r.level == uint32_t(SwitchLevel::near);
  const double limit = r.distance * (was ? 1 + r.hysteresis : 1);
  for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
    if (norm2(b.surface.sum(s, b.p.x.data()) - r.point) <= limit * limit) return true;
  }
  return false;
}

SwitchLevel called_for(const Body &b, const SwitchRule &r, bool touches) {
  if (!r.touching.type.empty() && touches) return SwitchLevel::touching;
  return !r.near.type.empty() && is_near(b, r) ? SwitchLevel::near : SwitchLevel::far;
}

void follow(World &w, Body &b, SwitchRule &r, bool touches) {
  const SwitchLevel wanted = called_for(b, r, touches);
  if (uint32_t(wanted) == r.level) {
    r.called = w.time;
    return;
  }
  const bool decided = r.level != uint32_t(SwitchLevel::undecided);
  if (decided && uint32_t(wanted) < r.level && w.time - r.called < r.wait) return;
  const bool again = r.refused >= 0;
  if (again && w.time - r.refused < r.wait) return;
  const ModelChoice &to = choice_of(r, wanted);
  if (!is_made_so(b, to) && !try_change(w, b, to, !again)) {
    r.refused = w.time;
    return;
  }
  r.level = uint32_t(wanted);
  r.called = w.time;
  r.refused = -1;
}

void follow_rules(World &w) {
  if (std::all_of(w.bodies.begin(), w.bodies.end(), [](const auto &b) { return b->rule.empty(); })) return;
  find_touching(w, w.steps->touching);
  for (size_t i = 0; i < w.bodies.size(); ++i) {
    Body &b = *w.bodies[i];
    if (!b.rule.empty() && !b.sleep_state.asleep) follow(w, b, b.rule[0], w.steps->touching[i]);
  }
}

}  // namespace

bool begins_alike(const Body &b, const SwitchRule &r) {
  SwitchRule fresh = r;
  fresh.level = uint32_t(SwitchLevel::undecided);
  return r.level == fresh.level || r.level == uint32_t(called_for(b, fresh, false));
}

void make_switches(World &w, double dt) {
  for (auto &b : w.bodies)
    while (!b->switches.empty() && b->switches.front().t <= w.time + kOnTime * dt) {
      const ModelChoice to = b->switches.front().to;
      if (try_change(w, *b, to, true)) warn_of_idle(*b);
      b->switches.erase(b->switches.begin());
    }
  follow_rules(w);
}

}  // namespace dfm
