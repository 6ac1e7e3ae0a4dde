// What the guard keeps between its questions of one sub-step; doc/concepts/guard.md. What outlives
// the sub-step (way, rest) saves work and changes nothing.
#pragma once
#include <vector>

#include "narrow/toi_guard.h"
#include "surfel/contact_set.h"

namespace dfm {

struct World;

struct Guard {
  Array<uint32_t> near;                  // candidates that may reach the floor
  Array<GuardHit> hits;
  Array<double> speed, travel;           // by body slot, m/s and m: bounds of what the sub-step does after its solve
  Array<double> way, rest;               // m: of all committed sub-steps since `rest` is known; guard_near
  uint64_t lists = 0;                    // renewals of broad/ at which `rest` was last cleared
  std::vector<Array<double>> end;        // by body slot, [nsurfel,4] where the sub-step leads; filled where `stamp` says `round`
  std::vector<Array<uint32_t>> stamp;
  uint32_t round = 0;
  std::vector<const double *> ends;
  std::vector<GuardPose> poses;          // of obstacles at the end
  struct Through { uint32_t a, b; bool yes; };
  std::vector<Through> through;          // body pairs that were looked at: do they cross at the start?
  struct Kept { uint64_t key; Vec3 impulse; double rate; bool hit; };
  Array<Kept> kept;                      // sorted by key: what the solve before left, and the rates of contacts made from hits
  bool resolving = false;                // a solve that starts from `kept`
  bool stepped = false;                  // self-stepping bodies have written their ends for the impulses as they are

  double planned = 0;                    // s, the sub-step before it was cut
  uint32_t pieces = 0;                   // cuts of this planned sub-step
  bool acted = false;                    // in this sub-step
  double cut = 1;                        // < 1: the sub-step is to be taken anew, this much as long
  double motion = 1;                     // < 1: share of its way that is taken

  void forget() { rest.clear(); }        // positions or d_c have changed otherwise than by a step
};

// In the middle of a solve's preparation, where guard.resolving: impulses and rates of `kept`.
void guard_adjust(World &w);

}  // namespace dfm
