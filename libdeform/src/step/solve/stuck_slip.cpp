// A solve stops within a tolerance, which is larger while bodies shake, and the errors have a direction: a
// body that rings would creep for as long as it rings. Sticking therefore holds for places, not only for
// velocities. With e, the slip of a contact since it sticks, and T the planned sub-step, a law that is a
// projection is asked at
//
//     v + a(e) / T,   and after the sub-step   e' = e + h v
//
// T and not h: in a sub-step that the guard has cut, a large velocity would take back a small slip. Laws that
// remember know places by their bristles.
//
// Where more contacts carry load than points can move, not every set of velocities can be asked for. The
// slips of all contacts since the same instant can be taken back: the points go where they were. But contacts
// begin and end, and what those that stay owe then belongs to no motion of the points. So a(e) / T is smaller
// than r, the tolerance of the sub-step: the state without slip, which solves the contacts without e, is good
// enough in any case, and contradictions change impulses by no more than the tolerance does. With E, the
// motion common to all contacts of two sides, a way and a turn in the plane of the contacts,
//
//     a(e) / T = kShare E / T, at most r / 2,   and   kShare (e - E) / T, at most r / 5.
//
// Bodies can follow E whatever the number of contacts, and nothing elastic opposes it. What begins to stick
// owes E (doc/decisions/contact_solver.md).
#include "step/solve/stuck_slip.h"

#include <algorithm>
#include <bit>

#include "contact/rows_part.h"
#include "friction/laws.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/solve_islands.h"

namespace dfm {
namespace {

// All at once would be a velocity as large as the error, which the next solve stops again.
constexpr double kShare = 0.4;
constexpr double kMostCommon = 0.5, kMostOwn = 0.2;  // of the tolerance

bool is_projection(const LawInstance &law) { return law.ops->flags & DFM_FRIC_SET_VALUED; }

// An equilibrium leaves nothing over.
bool holds_places(const World &w) {
  if (w.prescribed.stands()) return false;
  return std::any_of(w.pairs.laws.begin(), w.pairs.laws.end(),
                     [](const LawInstance *law) { return is_projection(*law); });
}

// f(first, end): rows of the same two sides, which are neighbors.
template <class F>
void each_pair(const StepContext &step, const RowsPart &part, F &&f) {
  for (const RowRun &run : part.contacts)
    for (uint32_t i = run.first, end = std::min(run.first + run.n, step.rows.soft()); i < end;) {
      const uint32_t first = i;
      const ContactPoint &c = step.contacts[first];
      const auto belongs = [&](const ContactPoint &o) {
        return o.slot_a == c.slot_a && o.slot_b == c.slot_b && o.obstacle == c.obstacle;
      };
      while (++i < end && belongs(step.contacts[i])) {}
      f(first, i);
    }
}

// In integers: most contacts of a sliding body owe nothing, and each is asked several times.
bool any(const double *e) {
  const auto bits = [e](int k) { return std::bit_cast<uint64_t>(e[k]); };
  return (bits(0) | bits(1) | bits(2)) << 1 != 0;
}

// The motion in the plane of the contacts that comes nearest to what they owe.
struct Common {
  uint32_t n = 0;  // contacts that owe
  Vec3 center, axis, way;
  double turn = 0;
  Vec3 at(Vec3 x) const { return way + turn * cross(axis, x - center); }
};

// owed: [contacts,3]
Common common_motion(const StepContext &step, const double *owed, uint32_t first, uint32_t end) {
  uint32_t n = 0;
  Vec3 center, axis, way;
  const auto each = [&](auto &&f) {
    for (uint32_t i = first; i < end; ++i)
      if (const double *const e = owed + 3 * size_t{i}; any(e)) f(i, load3(step.contacts[i].point), load3(e));
  };
  each([&](uint32_t i, Vec3 x, Vec3 e) {
    ++n;
    center += x;
    axis += load3(&step.rows.frame[size_t{9} * i]);
    way += e;
  });
  if (n == 0) return {};
  const double size = norm(axis);
  center = (1.0 / n) * center;
  way = (1.0 / n) * way;
  if (!(size > 0)) return {n, center, axis, way, 0};
  axis = (1 / size) * axis;
  double along = 0, all = 0;
  each([&](uint32_t, Vec3 x, Vec3 e) {
    const Vec3 r = cross(axis, x - center);
    along += dot(r, e);
    all += dot(r, r);
  });
  return {n, center, axis, way, all > 0 ? along / all : 0};
}

Vec3 at_most(double most, Vec3 v) {
  const double size = norm(v);
  return size > most ? (most / size) * v : v;
}

}  // namespace

void reset_owed(const World &w, StepContext &step) {
  const size_t n = holds_places(w) ? step.contacts.size() : 0;
  step.asked_back.resize(2 * n);
  step.owed.assign(3 * n, 0.0);
}

// Newton's method has its multipliers for that.
void ask_slip_back(const World &w, StepContext &step, SolveIsland &own) {
  own.owes = false;
  if (own.implicit || step.owed.empty()) return;
  double *const owed = step.owed.data(), *const asked = step.asked_back.data();
  bool owes = false;
  each_row(own.part.contacts, [&](uint32_t i) {
    if (i >= step.rows.soft()) return;
    const uint32_t m = step.match[i];
    if (m == kNone || w.store.law[m] != step.state.law[i]) return;
    const double *const e = &w.store.owed[3 * size_t{m}];
    store3(owed + 3 * size_t{i}, load3(e));
    owes = owes || any(e);
  });
  own.owes = owes;
  if (!owes) return;
  const double rate = kShare / step.guard.planned;
  each_pair(step, own.part, [&](uint32_t first, uint32_t end) {
    const Common common = common_motion(step, owed, first, end);
    if (common.n == 0) {
      std::fill(asked + 2 * size_t{first}, asked + 2 * size_t{end}, 0.0);
      return;
    }
    for (uint32_t i = first; i < end; ++i) {
      double *const e = owed + 3 * size_t{i};
      const double r = own.tolerance.tangent[i];
      const Vec3 with = common.at(load3(step.contacts[i].point));
      if (!any(e)) {
        store3(e, with);
        asked[2 * size_t{i}] = asked[2 * size_t{i} + 1] = 0;
        continue;
      }
      const Vec3 back =
          at_most(kMostCommon * r, rate * with) + at_most(kMostOwn * r, rate * (load3(e) - with));
      for (size_t k = 0; k < 2; ++k) {
        const double along = dot(load3(&step.rows.frame[size_t{9} * i + 3 + 3 * k]), back);
        asked[2 * size_t{i} + k] = along;
        step.rows.drive[3 * size_t{i} + 1 + k] -= along;
      }
    }
  });
}

void restore_drive(StepContext &step, const SolveIsland &own) {
  if (!own.owes) return;
  each_row(own.part.contacts, [&](uint32_t i) {
    for (size_t k = 0; k < 2 && i < step.rows.soft(); ++k)
      step.rows.drive[3 * size_t{i} + 1 + k] += step.asked_back[2 * size_t{i} + k];
  });
}

// What goes beyond the tolerance is a slide: the contact sticks where it has come to.
void find_owed(const World &w, StepContext &step) {
  if (step.owed.empty()) return;
  ContactState &s = step.state;
  const uint8_t *const cut = step.solve_islands->of_cuts();
  for (const SolveIsland &own : step.solve_islands->all()) {
    if (own.implicit) continue;
    each_row(own.part.contacts, [&](uint32_t i) {
      if (i >= step.rows.soft()) return;
      double &v1 = s.vt[i], &v2 = s.vt[s.stride + i];
      double *const e = &step.owed[3 * size_t{i}];
      const double r = step.tolerance.tangent[i];
      const bool sticks = s.mode[i] == 1 && step.rows.impulse[3 * size_t{i}] > 0 &&
                          v1 * v1 + v2 * v2 <= r * r && is_projection(*w.pairs.laws[s.law[i]]) &&
                          !(cut && cut[i]);
      if (own.owes) {
        v1 -= step.asked_back[2 * size_t{i}];
        v2 -= step.asked_back[2 * size_t{i} + 1];
      }
      const double *const t = &step.rows.frame[size_t{9} * i + 3];
      if (sticks) store3(e, load3(e) + step.h * (v1 * load3(t) + v2 * load3(t + 3)));
      else if (own.owes) store3(e, Vec3{});
    });
  }
}

}  // namespace dfm
