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
// slips of all contacts since the same instant can be taken back: the points go where they were. But
// contacts begin and end, and what those that stay owe then belongs to no motion of the points. So a(e) /
// T is a share of e / T and at most 0.3 r, r the tolerance of the sub-step: the state without slip, which
// solves the contacts without e, is good enough in any case, and contradictions change impulses by no more
// than the tolerance does.
#include "step/solve/friction_memory.h"

#include <algorithm>

#include "contact/rows_part.h"
#include "contact/solve_settings.h"
#include "friction/laws.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/solve_islands.h"

namespace dfm {
namespace {

bool is_projection(const LawInstance &law) { return law.ops->flags & DFM_FRIC_SET_VALUED; }

// An equilibrium leaves nothing over.
bool holds_places(const World &w) {
  if (w.prescribed.is_static()) return false;
  return std::any_of(w.pairs.laws.begin(), w.pairs.laws.end(),
                     [](const LawInstance *law) { return is_projection(*law); });
}

Vec3 at_most(double most, Vec3 v) {
  const double size = norm(v);
  return size > most ? (most / size) * v : v;
}

}  // namespace

void reset_stick_drift(const World &w, StepContext &step) {
  const size_t n = holds_places(w) ? step.contacts.size() : 0;
  step.slip_back.resize(2 * n);
  step.stick_drift.assign(3 * n, 0.0);
}

// Newton's method has its multipliers for that.
void find_slip_back(const World &w, StepContext &step, SolveIsland &own) {
  own.drifts = false;
  if (own.implicit || step.stick_drift.empty()) return;
  double *const stick_drift = step.stick_drift.data(), *const requested = step.slip_back.data();
  bool drifts = false;
  each_row(own.part.contacts, [&](uint32_t i) {
    if (i >= step.rows.soft()) return;
    const uint32_t m = step.match[i];
    if (m == kNone || w.store.law[m] != step.state.law[i]) return;
    const double *const e = &w.store.stick_drift[3 * size_t{m}];
    store3(stick_drift + 3 * size_t{i}, load3(e));
    drifts = drifts || e[0] != 0 || e[1] != 0 || e[2] != 0;
  });
  own.drifts = drifts;
  if (!drifts) return;
  const double rate = SolveSettings::take_back / step.length.planned;
  each_row(own.part.contacts, [&](uint32_t i) {
    if (i >= step.rows.soft()) return;
    const Vec3 back = at_most(SolveSettings::accuracy * own.tolerance.tangent[i],
                              rate * load3(stick_drift + 3 * size_t{i}));
    for (size_t k = 0; k < 2; ++k) {
      const double along = dot(load3(&step.rows.frame[size_t{9} * i + 3 + 3 * k]), back);
      requested[2 * size_t{i} + k] = along;
      step.rows.drive[3 * size_t{i} + 1 + k] -= along;
    }
  });
}

void restore_drive(StepContext &step, const SolveIsland &own) {
  if (!own.drifts) return;
  each_row(own.part.contacts, [&](uint32_t i) {
    for (size_t k = 0; k < 2 && i < step.rows.soft(); ++k)
      step.rows.drive[3 * size_t{i} + 1 + k] += step.slip_back[2 * size_t{i} + k];
  });
}

// What goes beyond the tolerance is a slide: the contact sticks where it has come to.
void update_stick_drift(const World &w, StepContext &step) {
  if (step.stick_drift.empty()) return;
  ContactState &s = step.state;
  const uint8_t *const cut = step.solve_islands->of_cuts();
  for (const SolveIsland &own : step.solve_islands->all()) {
    if (own.implicit) continue;
    each_row(own.part.contacts, [&](uint32_t i) {
      if (i >= step.rows.soft()) return;
      double &v1 = s.vt[i], &v2 = s.vt[s.stride + i];
      double *const e = &step.stick_drift[3 * size_t{i}];
      const double r = step.tolerance.tangent[i];
      const bool sticks = s.mode[i] == 1 && step.rows.impulse[3 * size_t{i}] > 0 &&
                          v1 * v1 + v2 * v2 <= r * r && is_projection(*w.pairs.laws[s.law[i]]) &&
                          !(cut && cut[i]);
      if (own.drifts) {
        v1 -= step.slip_back[2 * size_t{i}];
        v2 -= step.slip_back[2 * size_t{i} + 1];
      }
      const double *const t = &step.rows.frame[size_t{9} * i + 3];
      if (sticks) add3(e, step.h * (v1 * load3(t) + v2 * load3(t + 3)));
      else if (own.drifts) store3(e, Vec3{});
    });
  }
}

}  // namespace dfm
