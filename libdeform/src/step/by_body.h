// Jobs whose blocks are bodies.
#pragma once
#include <cstdint>
#include <span>

#include "state/world.h"

namespace dfm {

// Fewer points in all explicit bodies are no job for their motion (8 ns a point), or their forces (0.1 us).
inline constexpr uint32_t kPointsToMove = 250, kPointsToPull = 20;

// How many of the active bodies a block has. Explicit bodies of few points, less than `worth` in all, are no
// work for two threads. Otherwise each body is a block, so that in all stages the same threads have the same
// bodies.
inline uint32_t bodies_together(const World &w, std::span<const uint32_t> active, uint32_t worth) {
  uint32_t points = 0;
  for (const uint32_t i : active) {
    const Body &b = *w.bodies[i];
    points += b.p.n;
    if (points >= worth || b.model.stepper || b.integrator.used != DFM_INTEGRATOR_SYMPLECTIC_EULER) return 1;
  }
  return static_cast<uint32_t>(active.size());
}

}  // namespace dfm
