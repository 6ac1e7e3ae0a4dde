// The source's collision solution (Zerbato 2010, sections 4.2 and 5.4), to compare: vertices that collide go back to the time of their impact.
// doc/concepts/rollback.md, doc/decisions/0022-rollback-to-compare.md.
#pragma once
#include <vector>

#include "narrow/impact_time.h"
#include "world/islands.h"

namespace dfm {

struct Body;
struct Obstacle;
struct World;

struct Rollback {
  Islands islands;                       // of surfels, world-wide numbers
  Array<ImpactHit> hits;                 // by candidate
  Array<uint8_t> joins;                  // by candidate: ties its vertices together
  Array<uint32_t> joined;                // those candidates, in the order in which they were found
  Array<double> share;                   // by surfel, of its way
  Array<double> time;                    // by island
  Array<uint8_t> met;                    // by surfel: a contact of a point has it
  std::vector<const double *> shares;    // by body slot, into share
  explicit Rollback(const Memory &memory);
};

// Each throws Error(DFM_E_UNSUPPORTED) with what cannot be and what to do, where the world's method is rollback; else nothing.
void rollback_check(const World &w, const Body &b);
void rollback_check(const World &w, const Obstacle &o);
void rollback_check_law(const World &w, const char *law, uint32_t nstate);
void rollback_refuse(const World &w, const char *what);

}  // namespace dfm
