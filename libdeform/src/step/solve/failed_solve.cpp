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
const Body &fastest(const Entities &w) {
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

std::string sides(const Entities &entities, const Detection &detection, const Solution &solution,
                  const Views &views, uint32_t i) {
  if (i >= solution.rows.soft() && i < solution.rows.n)
    return views.tools->row_names(entities, i - solution.rows.soft());
  if (i >= detection.contacts.size() && entities.bodies.empty()) return "rigid things that touch";
  if (i >= detection.contacts.size())
    return format("body '%s' (the fastest one)", fastest(entities).name.c_str());
  const ContactPoint &c = detection.contacts[i];
  return names_of(entities, entities.bodies[c.slot_a]->id, id_of_b(entities, c));
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
  const std::string where = at_step(w) + ", " + sides(w, step, step, step, at);
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

bool report_jam(const WorldState &state, const Entities &entities, const Detection &detection,
                const Solution &solution, const Views &views, uint32_t row, uint32_t *trouble) {
  const ContactRows &rows = solution.rows;
  uint32_t worst = row;
  for (uint32_t i = 0; row == kNone && i < rows.soft(); ++i)
    if (worst == kNone || rows.impulse[3 * size_t{i}] > rows.impulse[3 * size_t{worst}]) worst = i;
  const ContactPoint *const c = worst < rows.soft() ? &detection.contacts[worst] : nullptr;
  return fail_step(
      trouble, DFM_TROUBLE_UNCONVERGED,
      "%s, %s: squeezed until nothing can move; open what closes on it, or move that more slowly%s%s",
      at_step(state).c_str(), sides(entities, detection, solution, views, worst).c_str(),
      c ? ", or make the body stiffer" : "",
      c ? hint_of_attachment(state, entities.bodies[c->slot_a]->id) : "");
}

}  // namespace dfm
