// Jobs whose blocks are bodies.
#pragma once
#include <atomic>
#include <cstdint>
#include <span>

#include "plugin/context.h"
#include "plugin/on_behalf.h"
#include "state/world.h"

namespace dfm {

// Fewer points in all explicit bodies are no job for their motion (8 ns a point), or their forces (0.1 us).
inline constexpr uint32_t kPointsToMove = 250, kPointsToPull = 20;
inline constexpr uint32_t kOnThisThread = ~0u;  // no points are

// How many of the active bodies a block has. Explicit bodies of few points, less than `worth` in all, are no
// work for two threads. Otherwise each body is a block, so that in all stages the same threads have the same
// bodies.
inline uint32_t bodies_together(const Entities &w, std::span<const uint32_t> active, uint32_t worth) {
  if (worth == kOnThisThread) return static_cast<uint32_t>(active.size());
  uint32_t points = 0;
  for (const uint32_t i : active) {
    const Body &b = *w.bodies[i];
    points += b.p.n;
    if (points >= worth || b.model.stepper || b.integrator.used != DFM_INTEGRATOR_SYMPLECTIC_EULER) return 1;
  }
  return static_cast<uint32_t>(active.size());
}

// act(body) -> has it succeeded? The active bodies side by side. Returns the first, in id order, for which it
// has not, or null.
template <class Act>
const Body *each_active(const WorldMemory &memory, const Entities &w, std::span<const uint32_t> active,
                        uint32_t worth, const Act &act) {
  std::atomic<uint32_t> failed{kNone};
  each_on(&memory.context->tasks, active.size(), bodies_together(w, active, worth), [&](size_t k) {
    Body &b = *w.bodies[active[k]];
    const OnBehalf prefix(b.name);
    if (act(b)) return;
    uint32_t first = failed;
    while (active[k] < first && !failed.compare_exchange_weak(first, active[k])) {}
  });
  return failed == kNone ? nullptr : w.bodies[failed].get();
}

}  // namespace dfm
