#include "step/watch/contact_energy.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "friction/laws.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/sides.h"
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

// Share of the rest distance: nearer contacts were placed there, or recovery is late.
constexpr double kShallow = 0.99;
constexpr double kRounding = 2.220446049250313e-16;
// Work is taken at the mean of the velocities at both ends of a sub-step. A depth decreases by a fifth per
// sub-step, so in the sub-step before by 1.25 times as much.
constexpr double kOpens = 0.5 * (1 + 1.25);

// J, of a contact in the sub-step: what it has put into its sides beyond recovery of its depth, along the
// normal and by friction. If the sides count their work differently (step/watch/energy_watch.cpp), velocities
// at the end of the sub-step are used; otherwise a common acceleration would count as work. An obstacle has
// one velocity in the sub-step, that of its end: with the mean of a body's velocities an obstacle that stops
// would seem to do work.
struct Made { double normal, friction; };
Made made_by(const World &w, const StepContext &step, uint32_t i, bool ends) {
  const ContactRows &rows = step.rows;
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
  const double normal = l[0] * (u.x - kOpens * std::max(0.0, -rows.rate[i]));
  const bool deep = step.contacts[i].distance < kShallow * w.offset;
  return {deep ? std::min(0.0, normal) : normal, l[1] * u.y + l[2] * u.z};
}

double most_of(const EnergyWatch &e) { return std::max(e.made, e.rubbed); }

// J. Contact is accurate to a small part of the rest distance, so while bodies at rest on each other have
// hardly begun to move, the work of their weight over that distance is used instead of the largest energy,
// and at least the kinetic energy of a motion by the rounding of a coordinate in a sub-step. Unknown elastic
// energies are not part of the largest energy (energy_watch.cpp).
double limit_of(const World &w) {
  double mass = 0, extent = 0, share = w.def.energy_watch;
  for (const auto &b : w.bodies) {
    if (!has_balance(*b)) continue;
    mass += b->mass;
    if (!b->model.can(DFM_CAP_ENERGY)) share = w.def.energy_watch + 1;
    for (const double x : b->p.x) extent = std::max(extent, std::fabs(x));
  }
  const double h = w.stats.substeps > 0 ? w.time / double(w.stats.substeps) : 0;
  const double rounding = h > 0 ? kRounding * extent / h : 0;
  return share *
         std::max({w.stats.energy_max, mass * norm(w.gravity.now) * w.offset, mass * rounding * rounding});
}

// The law of the contact of the pair with the largest load.
std::string law_of(const World &w, uint64_t a, uint64_t b) {
  const LawInstance *law = nullptr;
  double most = 0;
  for (uint32_t m = 0; m < w.store.n; ++m) {
    const double normal = w.store.impulse[size_t(3) * m];
    const uint64_t first = w.store.id_a[m], second = w.store.id_b[m];
    if (!((first == a && second == b) || (first == b && second == a)) || !(normal >= most)) continue;
    most = normal;
    law = w.pairs.laws[w.store.law[m]];
  }
  return law ? law->type->id : "?";
}

std::string models_of(const World &w, uint64_t a, uint64_t b) {
  std::string out;
  for (const auto &body : w.bodies)
    if ((body->id == a || body->id == b) && body->model.stepper)
      out += format(", model '%s'", body->model.type->id);
  return out;
}

}  // namespace

// Bodies wedged in each other may bear any load that balances itself, and a solve may err in it: what
// contacts of one pair seem to make, those of others take back in the same sub-step through the points that
// they share. So there is one sum over all contacts.
void book_contact_gain(World &w, const StepContext &step) {
  EnergyWatch &sum = w.watch;
  const std::span<const ContactPoint> all = step.contacts;
  double most = 0;
  for (uint32_t i = 0; i < all.size();) {
    const ContactPoint &c = all[i];
    const auto by_halves = [&](uint32_t slot) { return w.bodies[slot]->dynamics->abilities().energy; };
    const bool counts = booked(w, step, c), ends = c.obstacle || by_halves(c.slot_a) != by_halves(c.slot_b);
    double made = 0, rubbed = 0;
    for (; i < all.size() && all[i].slot_a == c.slot_a && all[i].slot_b == c.slot_b &&
           all[i].obstacle == c.obstacle;
         ++i) {
      if (!counts || !(step.rows.impulse[size_t(3) * i] > 0)) continue;
      const Made one = made_by(w, step, i, ends);
      // a law with memory returns the energy that it has stored
      const bool remembers = w.pairs.laws[step.state.law[i]]->nstate > 0;
      made += remembers ? one.normal : one.normal + one.friction;
      rubbed += remembers ? one.friction : 0;
    }
    sum.made += made;
    sum.rubbed += rubbed;
    if (!(std::max(made, rubbed) > most)) continue;
    most = std::max(made, rubbed);
    sum.side[0] = w.bodies[c.slot_a]->id;
    sum.side[1] = id_of_b(w, c);
  }
  sum.made = std::max(0.0, sum.made);
}

bool contact_over(const World &w) {
  return most_of(w.watch) > w.def.energy_watch * w.stats.energy_max && most_of(w.watch) > limit_of(w);
}

std::string describe_contact_gain(const World &w) {
  if (!contact_over(w)) return {};
  const auto [a, b] = w.watch.side;
  return format(
      "%s, %s: contact with friction law '%s' has put in %.3g J more than it has taken (limit: %.3g J; "
      "%.3g J is the largest energy so far); take a shorter step, repair their surfaces, or, where a "
      "plugin's law or model takes part%s, check that the law's force points against the slip, and that a "
      "model that steps itself moves by the response to impulses that it gives (energy_watch sets the "
      "limit, 0 switches the watch off)%s",
      at_step(w).c_str(), names_of(w, a, b).c_str(), law_of(w, a, b).c_str(), most_of(w.watch), limit_of(w),
      w.stats.energy_max, models_of(w, a, b).c_str(), hint_of_attachment(w, a));
}

void forget_contact_gain(World &w) {
  if (w.watch.reported) w.watch.made = w.watch.rubbed = 0;
}

}  // namespace dfm
