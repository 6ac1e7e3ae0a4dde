#include "step/watch/pair_energy.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/held_in.h"
#include "step/messages.h"
#include "step/sides.h"
#include "step/solve/solve_islands.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"

namespace dfm {
namespace {

// Whether both sides are part of the largest energy; not with movable rigid bodies.
bool booked(const World &w, const StepContext &step, const ContactPoint &c) {
  const Body &a = *w.bodies[c.slot_a];
  if (!has_balance(a)) return false;
  if (!c.obstacle) return has_balance(*w.bodies[c.slot_b]);
  return step.rigid_places.empty() || step.rigid_places[c.slot_b].group == kNone;
}

// Share of the rest distance: deeper contacts were placed there, or recovery is late.
constexpr double kShallow = 0.99;
// Work is taken at the mean of the velocities at both ends of a sub-step. A depth decreases by a fifth per
// sub-step, so in the sub-step before by 1.25 times as much.
constexpr double kRounding = 2.220446049250313e-16;
constexpr double kOpens = 0.5 * (1 + 1.25);
// Such a law returns the energy that it has stored.
bool remembers(const LawInstance *law) { return law->nstate > 0; }

// J, of a contact in the sub-step. If the sides count their work differently (step/watch/energy_watch.cpp),
// velocities at the end of the sub-step are used; otherwise a common acceleration would count as work. An
// obstacle has one velocity in the sub-step, that of its end: with the mean of a body's velocities an
// obstacle that stops would seem to do work.
struct Made {
  double all = 0;       // without friction if the law has memory
  double recovery = 0;  // upper bound of the energy added by recovery of depths
  // Work of the law by its own force at the slip of its evaluation. A set-valued law gives a limit only, and
  // projection onto it cannot add energy.
  double friction = 0;
};
Made made_by(const World &w, const StepContext &step, uint32_t i, bool ends) {
  const ContactRows &rows = step.rows;
  const ContactState &law = step.state;
  const double *const l = &rows.impulse[size_t(3) * i], *const f = &rows.frame[size_t(9) * i];
  Vec3 u;
  uint32_t body = kNone;
  const double *end = nullptr;  // of that body, where its mean is another one
  for (uint32_t k = rows.begin[i]; k < rows.begin[i + 1]; ++k) {
    const uint32_t d = rows.dof[k];
    if (ends && rows.source[d] != body) {
      body = rows.source[d];
      const Dynamics &dynamics = *w.bodies[body]->dynamics;
      end = dynamics.abilities().energy ? dynamics.end().v : nullptr;
    }
    const double *const v = end ? end + size_t{kStride} * rows.point[d] : &step.mean[size_t{kStride} * d];
    u += rows.weight[k] * load3(v);
  }
  u = in_frame(f, u) - load3(&rows.drive[size_t(3) * i]);
  const bool smooth = law.form[i] == kSmoothLaw;
  const double dissipated = law.ft[i] * law.slip[i] + law.ft[law.stride + i] * law.slip[law.stride + i];
  const double along = remembers(w.pairs.laws[law.law[i]]) ? 0 : l[1] * u.y + l[2] * u.z;
  return {l[0] * u.x + along, kOpens * l[0] * std::max(0.0, -rows.rate[i]), smooth ? step.h * dissipated : 0};
}

// Bodies wedged in each other may bear any load that balances itself, and a solve may err in it: what
// contacts of one pair seem to make, those of others take back in the same sub-step through the points that
// they share. So the contacts of an island have made no more than their sum, of which each pair that has made
// something gets its share.
void share_in_islands(StepContext &step) {
  Array<PairMade> &pairs = step.pairs_made;
  for (const SolveIsland &island : step.solve_islands->all()) {
    const auto each = [&](auto &&f) {
      for (const RowRun &run : island.part.contacts) {
        auto at = std::lower_bound(pairs.begin(), pairs.end(), run.first,
                                   [](const PairMade &p, uint32_t first) { return p.contact < first; });
        for (; at != pairs.end() && at->contact < run.first + run.n; ++at) f(*at);
      }
    };
    double all = 0, gained = 0, lost = 0;
    each([&](const PairMade &p) {
      all += p.made;
      (p.made > 0 ? gained : lost) += p.made;
    });
    const bool gains = all > 0;
    const double sum = gains ? gained : lost;
    each([&](PairMade &p) { p.made = sum != 0 && (p.made > 0) == gains ? p.made * (all / sum) : 0; });
  }
}

// The sum that is compared with the limit of the watch.
double excess_of(const PairWork &p) { return std::max(p.rubbed, p.made); }

// The energy to which the limit refers. Contact is accurate to a small part of the rest distance, so while
// bodies at rest on each other have hardly begun to move, the work of their weight over that distance is
// used, and at least the kinetic energy of a motion by the rounding of a coordinate in a sub-step. Unknown
// elastic energies are not part of the largest energy (energy_watch.cpp).
struct Scale {
  double joule;
  bool hidden;
  double limit(const World &w) const { return (w.def.energy_watch + (hidden ? 1 : 0)) * joule; }
};
Scale scale_of(const World &w, const PairWork &p) {
  double mass = 0, extent = 0;
  bool hidden = false;
  for (const auto &b : w.bodies) {
    if (b->id != p.a && b->id != p.b) continue;
    mass += b->mass;
    hidden = hidden || !b->model.can(DFM_CAP_ENERGY);
    for (const double x : b->p.x) extent = std::max(extent, std::fabs(x));
  }
  const double h = w.stats.substeps > 0 ? w.time / double(w.stats.substeps) : 0;
  const double rounding = h > 0 ? kRounding * extent / h : 0;
  return {std::max({w.stats.energy_max, mass * std::sqrt(norm2(w.gravity.now)) * w.offset,
                    mass * rounding * rounding}),
          hidden};
}

// The law of the contact of the pair with the largest load.
std::string law_of(const World &w, const PairWork &p) {
  const LawInstance *law = nullptr;
  double most = 0;
  for (uint32_t m = 0; m < w.store.n; ++m) {
    const double normal = w.store.impulse[size_t(3) * m];
    const uint64_t a = w.store.id_a[m], b = w.store.id_b[m];
    if (!((a == p.a && b == p.b) || (a == p.b && b == p.a)) || !(normal >= most)) continue;
    most = normal;
    law = w.pairs.laws[w.store.law[m]];
  }
  return law ? law->type->id : "?";
}

std::string models_of(const World &w, const PairWork &p) {
  std::string out;
  for (const auto &b : w.bodies)
    if ((b->id == p.a || b->id == p.b) && b->model.stepper) out += format(", model '%s'", b->model.type->id);
  return out;
}

}  // namespace

PairWork &work_of(World &w, PairIds ids) {
  const auto [a, b] = ids;
  auto it = std::lower_bound(w.work.begin(), w.work.end(), std::pair(a, b),
                             [](const PairWork &p, auto &k) { return std::pair(p.a, p.b) < k; });
  if (it == w.work.end() || it->a != a || it->b != b) it = w.work.insert(it, {a, b, 0});
  return *it;
}

// Contacts of a pair come from both sides and are not next to each other. Where a solve is far from a
// solution, those of one side may do much work that those of the other take back.
void book_pairs(World &w, StepContext &step) {
  const std::span<const ContactPoint> all = step.contacts;
  Array<PairMade> &pairs = step.pairs_made;
  pairs.clear();
  for (uint32_t i = 0; i < all.size();) {
    const ContactPoint &c = all[i];
    const uint32_t begin = i;
    while (++i < all.size() && all[i].slot_a == c.slot_a && all[i].slot_b == c.slot_b &&
           all[i].obstacle == c.obstacle) {}
    if (!booked(w, step, c)) continue;
    const auto by_halves = [&](uint32_t slot) { return w.bodies[slot]->dynamics->abilities().energy; };
    const bool ends = c.obstacle || by_halves(c.slot_a) != by_halves(c.slot_b);
    PairMade sum;
    sum.contact = begin;
    sum.ids = {w.bodies[c.slot_a]->id, id_of_b(w, c), c.obstacle != 0};
    bool touch = false;
    for (uint32_t k = begin; k < i; ++k) {
      if (!(step.rows.impulse[size_t(3) * k] > 0)) continue;
      const Made one = made_by(w, step, k, ends);
      sum.made += one.all - one.recovery;
      sum.friction += one.friction;
      touch = true;
      sum.deep = sum.deep || all[k].distance < kShallow * w.offset;
    }
    if (touch) pairs.push_back(sum);
  }
  share_in_islands(step);
  std::sort(pairs.begin(), pairs.end(), [](const PairMade &l, const PairMade &r) {
    return std::tuple(l.ids.a, l.ids.b, l.contact) < std::tuple(r.ids.a, r.ids.b, r.contact);
  });
  for (size_t k = 0; k < pairs.size();) {
    PairMade sum = pairs[k];
    for (++k; k < pairs.size() && pairs[k].ids.a == sum.ids.a && pairs[k].ids.b == sum.ids.b; ++k) {
      sum.made += pairs[k].made;
      sum.friction += pairs[k].friction;
      sum.deep = sum.deep || pairs[k].deep;
    }
    PairWork &pair = work_of(w, sum.ids);
    pair.rubbed += sum.friction;
    if (!pair.apart) pair.apart = !sum.deep;
    if (pair.apart) pair.made += sum.made;
  }
  const bool stores = std::any_of(w.pairs.laws.begin(), w.pairs.laws.end(), remembers);
  for (PairWork &p : w.work) {
    if (!stores) p.rubbed = std::max(0.0, p.rubbed);
    p.made = std::max(0.0, p.made);
  }
}

bool pair_over(const World &w) {
  const double limit = w.def.energy_watch * w.stats.energy_max;
  return std::any_of(w.work.begin(), w.work.end(), [&](const PairWork &p) {
    return excess_of(p) > limit && excess_of(p) > scale_of(w, p).limit(w);
  });
}

std::string describe_pair_gain(World &w) {
  const PairWork *worst = nullptr;
  double most = 1, limit = 0;
  for (const PairWork &p : w.work) {
    if (!(excess_of(p) > w.def.energy_watch * w.stats.energy_max)) continue;
    const double own = scale_of(w, p).limit(w);
    if (!(excess_of(p) > most * own)) continue;
    worst = &p;
    limit = own;
    most = excess_of(p) / own;
  }
  if (!worst) return {};
  const bool slides = worst->rubbed > limit;
  const std::string where = at_step(w) + ", " + names_of(w, worst->a, worst->b);
  const std::string grown =
      format("%.3g J more than it has taken (limit: %.3g J; %.3g J is the largest energy so far)",
             excess_of(*worst), limit, w.stats.energy_max);
  const std::string law = law_of(w, *worst);
  if (slides)
    return format(
        "%s: friction law '%s' has put in %s; its force must point against the slip: "
        "change the law or its parameters (energy_watch sets the limit, 0 switches the watch off)",
        where.c_str(), law.c_str(), grown.c_str());
  return format(
      "%s: their contact (law '%s'%s) has put in %s; take a shorter step, repair their surfaces, or, where a "
      "model of a plugin steps itself, check its response to impulses (energy_watch sets the limit, 0 "
      "switches the watch off)%s",
      where.c_str(), law.c_str(), models_of(w, *worst).c_str(), grown.c_str(),
      hint_of_attachment(w, worst->a));
}

void forget_pairs(World &w, uint64_t id) {
  if (!w.watch.reported) return;
  for (PairWork &p : w.work)
    if (id == 0 || p.a == id || p.b == id) p.made = p.rubbed = 0;
}

bool is_valid(const PairWork &p) {
  return std::isfinite(p.friction) && std::isfinite(p.rubbed) && std::isfinite(p.made) && p.made >= 0 &&
         p.apart <= 1;
}

}  // namespace dfm
