// What the guard keeps between its questions of one sub-step; doc/concepts/guard.md. What outlives the
// sub-step (memory) saves work and changes nothing.
#pragma once
#include <vector>

#include "ccd/toi_guard.h"
#include "contact/contact_set.h"

namespace dfm {

struct StepContext;
struct World;

struct Guard {
  GuardScene scene;
  GuardMemory memory;
  Array<Candidate> joined;  // where bodies may touch themselves: candidates of pairs and theirs
  const Array<Candidate> *list = nullptr;  // what `memory` follows: `joined`, or those of pairs as they are
  Array<uint32_t> near;                    // candidates that may reach the floor
  GuardBlocks blocks;
  Array<GuardHit> hits;
  // m/s by body slot: bounds of the surfels' speeds after the solve; of what the solve has
  // changed of a phyxel's
  Array<double> speed, change;
  uint64_t lists = 0;       // renewals of broad/ at which `memory` was begun
  uint64_t placements = 0;  // World::placements that `memory` knows of
  struct Through {
    uint32_t a, b;
    bool obstacle, yes;
  };
  std::vector<Through> through;  // pairs that were looked at: do they cross at the start?
  struct Kept {
    uint64_t key;
    Vec3 impulse;
    double rate;
    bool hit;
  };
  // sorted by key: what the solve before left, and the rates of contacts made from hits
  Array<Kept> kept;
  bool resolving = false;  // a solve that starts from `kept`

  double planned = 0;                 // s, the sub-step before it was cut
  uint32_t pieces = 0;                // cuts of this planned sub-step
  bool acted = false, again = false;  // in this sub-step; it is to be taken anew
  double cut = 1;                     // then: this much as long
  double motion = 1;                  // < 1: fraction of its way that is taken

  void start() {
    kept.clear();
    through.clear();
    cut = motion = 1;
    acted = again = resolving = false;
  }
  void forget() { memory.forget(); }  // positions or d_c have changed otherwise than by a step
};

// Do two surfaces cross at the start of the sub-step? Each pair is looked at once in it. slot_a < slot_b
// where both are slots of bodies.
bool cross_at_start(StepContext &step, uint32_t slot_a, uint32_t slot_b, bool obstacle);
// guard_hits.cpp: the earliest hits as contacts of the sub-step, among those that it has.
void guard_add_hits(World &w, StepContext &step);
// Leaves out the hits whose contacts the host does not want (PreSolve).
void guard_ask_hits(World &w, StepContext &step);
// In the middle of a solve's preparation, where guard.resolving: impulses, and rates of hits, of `kept`.
void guard_impulses(StepContext &step);
void guard_rates(StepContext &step);

}  // namespace dfm
