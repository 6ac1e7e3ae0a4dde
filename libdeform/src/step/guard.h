// Data of the guard in one sub-step; doc/concepts/guard.md. Data that outlive the sub-step (memory) save work
// and do not change results.
#pragma once
#include <vector>

#include "ccd/toi_guard.h"

namespace dfm {

struct Derived;
struct Detection;
struct StepContext;
struct Views;
struct World;
struct WorldMemory;

struct Guard {
  GuardScene scene;
  ListMemory memory;
  Array<Candidate> joined;                 // if bodies may touch themselves: candidates of pairs, then theirs
  const Array<Candidate> *list = nullptr;  // the list of `memory`: `joined`, or the candidates of pairs
  Array<uint32_t> near;                    // candidates that may reach the floor
  GuardBlocks blocks;
  Array<GuardHit> hits;
  // m/s by body slot: bounds of the surfels' speeds after the solve; of what the solve has
  // changed of a phyxel's
  Array<double> speed, change;
  struct Common {
    Vec3 mean;           // m/s
    double spread = -1;  // m/s, no surfel differs by more from the mean; < 0: not known
  };
  Array<Common> common;     // [bodies] of the surfels' velocities without contact
  uint64_t lists = 0;       // number of rebuilds of broad/ when `memory` began
  uint64_t placements = 0;  // World::placements that `memory` knows of
  // The triangles of a tested pair that cross at the start: of a, of b.
  struct Through {
    uint32_t a, b;
    bool obstacle;
    std::vector<std::pair<uint32_t, uint32_t>> triangles;
  };
  std::vector<Through> through;
  struct Kept {
    uint64_t key;
    uint32_t more;
    Vec3 impulse;
    double rate;
    bool hit;
  };
  // sorted by key, more: results of the previous solve, and rates of contacts made from hits; those before
  Array<Kept> kept, kept_before;
  bool resolving = false;  // the next solve starts from `kept`
  uint32_t solves = 0;     // of this sub-step, with hits

  uint32_t cuts = 0;        // of this planned sub-step
  bool acted = false;       // in this sub-step
  bool lets_slits = false;  // hits across slits no longer count
  double motion = 1;        // < 1: fraction of the displacement that is taken

  void start() {
    kept.clear();
    through.clear();
    motion = 1;
    solves = 0;
    resolving = lets_slits = false;
  }
  void forget() { memory.forget(); }  // positions or d_c have changed other than by a step
};

// Whether two surfaces cross at the start of the sub-step. Each pair is tested once per sub-step. slot_a <
// slot_b if both are bodies.
bool cross_at_start(const Views &views, Detection &detection, uint32_t slot_a, uint32_t slot_b,
                    bool obstacle);
// Guard::memory follows all pairs that may come near, before the narrow phase and before the guard's checks:
// candidates of two sides, then those of bodies with themselves. fresh: lists of the latter have changed.
void follow_pairs(const WorldMemory &memory, const Derived &derived, Views &views, Detection &detection,
                  bool fresh);
// Finds guard.common of body i, beside its end, if it moves so far that the guard needs it.
void check_motion(const World &w, StepContext &step, uint32_t i);
// guard_hits.cpp: the earliest hits as contacts of the sub-step, among those that it has.
void guard_add_hits(World &w, StepContext &step);
// Drops hits whose contacts the host rejects (PreSolve).
void guard_filter_hits(World &w, StepContext &step);
// Called while a solve is prepared, if guard.resolving: takes the impulses and the rates of hits from `kept`.
void guard_impulses(StepContext &step);
void guard_rates(StepContext &step);

}  // namespace dfm
