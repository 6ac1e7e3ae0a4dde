// The message for a failed contact solve: the bodies, the law, and the inputs of the law.
#include <cmath>
#include <string>

#include "contact/contact_state.h"
#include "friction/laws.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/context.h"
#include "step/messages.h"
#include "step/sides.h"
#include "step/rigid/tool_touch.h"
#include "step/stages.h"

namespace dfm {
namespace {

// The body to name if no contact is the cause: with an invalid load or parameter, the body fails before its
// contacts do.
const Body &fastest(const World &w) {
  const Body *fast = w.bodies.front().get();
  double most = -1;
  for (const auto &b : w.bodies)
    for (const double v : b->surface.v)
      if (!(std::fabs(v) <= most)) {
        most = std::isnan(v) ? INFINITY : std::fabs(v);
        fast = b.get();
      }
  return *fast;
}

// The first contact with a value that is not finite after the solve, or kNone.
uint32_t spoilt(const StepContext &step) {
  for (uint32_t i = 0; i < step.rows.n; ++i)
    for (size_t k = 0; k < 3; ++k)
      if (!std::isfinite(step.rows.impulse[3 * size_t{i} + k])) return i;
  return kNone;
}

std::string sides(const World &w, const StepContext &step, uint32_t i) {
  if (i >= step.rows.soft() && i < step.rows.n) return step.tools->row_names(w, i - step.rows.soft());
  if (i >= step.contacts.size() && w.bodies.empty()) return "rigid things that touch";
  if (i >= step.contacts.size()) return format("body '%s' (the fastest one)", fastest(w).name.c_str());
  const ContactPoint &c = step.contacts[i];
  return names_of(w, w.bodies[c.slot_a]->id, id_of_b(w, c));
}

// Whether the inputs of the law at a contact are finite.
bool finite_inputs(const ContactState &s, const LawInstance &law, uint32_t i) {
  const size_t n = s.stride;
  double sum = 0;
  for (const double v :
       {s.fn[i], s.vt[i], s.vt[n + i], s.ft_stop[i], s.ft_stop[n + i], s.area[i], s.dwell[i]})
    sum += 0.0 * v;
  for (uint32_t k = 0; k < law.nstate; ++k) sum += 0.0 * s.bristle[size_t{k} * n + i];
  return sum == 0;
}

}  // namespace

bool report_failed_solve(World &w, StepContext &step, const LawInstance *law, uint32_t contact,
                         uint32_t *trouble) {
  const uint32_t at = law ? contact : spoilt(step);
  const std::string where = at_step(w) + ", " + sides(w, step, at);
  constexpr const char *kDo = "take a smaller step, reduce the loads or change the law";
  if (!law || (at != kNone && !finite_inputs(step.state, *law, at)))
    return fail_step(trouble, DFM_TROUBLE_NONFINITE, "%s: the contact solve is not finite; %s", where.c_str(),
                     kDo);
  const ContactState &s = step.state;
  const std::string what =
      at == kNone
          ? "returned an error"
          : format(
                "returned a value that is not finite, or a limit below zero, at %.9g N and a slip of %.9g, "
                "%.9g m/s",
                s.fn[at], s.vt[at], s.vt[s.stride + at]);
  return fail_step(trouble, DFM_TROUBLE_PLUGIN, "%s: friction law '%s' %s; %s", where.c_str(), law->type->id,
                   what.c_str(), kDo);
}

bool report_jam(World &w, StepContext &step, uint32_t *trouble) {
  uint32_t worst = kNone;
  for (uint32_t i = 0; i < step.rows.n; ++i)
    if (worst == kNone || step.rows.impulse[3 * size_t{i}] > step.rows.impulse[3 * size_t{worst}]) worst = i;
  const ContactPoint *const c = worst < step.contacts.size() ? &step.contacts[worst] : nullptr;
  return fail_step(
      trouble, DFM_TROUBLE_UNCONVERGED,
      "%s, %s: squeezed until nothing can move; open what closes on it, move that more slowly, or "
      "make the body stiffer%s",
      at_step(w).c_str(), sides(w, step, worst).c_str(),
      c ? hint_of_attachment(w, w.bodies[c->slot_a]->id) : "");
}

}  // namespace dfm
