#include "step/context.h"

#include "step/rigid/tool_touch.h"
#include "step/self_contact.h"
#include "step/solve/solve_islands.h"

namespace dfm {

Views::Views() = default;
Views::~Views() = default;

Solution::Solution(const Memory &memory)
    : contact_memory(memory),
      rows(memory),
      solve_islands(std::make_unique<SolveIslands>(memory)),
      areas(memory),
      exchange(memory),
      renewal(memory) {}
Solution::~Solution() = default;

StepContext::StepContext(const Meters &meters)
    : Detection(meters.detection.memory()),
      Solution(meters.contacts.memory()),
      SubStepEnd(meters.contacts.memory()),
      Awake(meters.steps.memory()),
      stage_times(stage_table().size()) {
  tools = std::make_unique<ToolTouch>(meters.contacts.memory());
  use_memory(meters.steps.memory(), driven, free_kinetic, samples, in_full, near, touching, active, met,
             woken, stirred, roused.bodies, roused.dwell, roused.total);
  use_memory(meters.contacts.memory(), lent, contacts, tolerance.normal, tolerance.tangent, start_residual,
             impulse_before_rebuild, tangents, slip_back, stick_drift, match, sharing, target_area,
             keeps_area, ways, renewed, rebound_speed, motions, marked, bonds, bond_impulse, chosen, mean,
             before, goes_on, given.list);
  state.use(meters.contacts.memory());
  use_memory(meters.detection.memory(), guard.joined, guard.near, guard.hits, guard.speed, guard.change,
             guard.common, guard.kept, guard.kept_before, guard.blocks.ranges);
  ListMemory &known = guard.memory;
  use_memory(meters.detection.memory(), known.runs, known.old_runs, known.features, known.old_features,
             known.apart, known.old_apart, known.normal, known.old_normal, known.before);
}

StepContext::~StepContext() = default;

}  // namespace dfm
