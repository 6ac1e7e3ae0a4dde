// Bodies with self contact, and their data for detection. A world without such bodies has no stage for it.
#pragma once
#include <memory>

#include "broad/self_list.h"
#include "narrow/self_contact.h"
#include "plan/plan.h"

namespace dfm {

struct Body;
struct StepContext;
struct Views;
struct World;

struct SelfBody {
  uint64_t id, shape;  // the body's (state/body.h)
  const Body *body;
  SelfRest rest;
  SelfList list;
  SelfPairs pairs;
  bool on = false;       // may touch itself in this sub-step
  bool touches = false;  // of count_self()
  // rebuild of `list` that is included in the guard's list; 0: not included
  uint64_t joined = 0;
  // [ntri] whether it crosses another one at the start of the sub-step: Crosses, as far as it has been asked
  // in this sub-step; empty: nothing has
  Array<uint8_t> crosses;
  SelfBody(const Memory &memory, Body &b);
};

// What follows from the cells of the body (state/body.h: self_rest keeps it where it is made in advance).
SelfRest self_rest_of(const Memory &memory, Body &b);

// The setting of the world: dfm_world_def.self_contact, or the effect in its list.
bool uses_self_contact(const World &w);
// How many bodies touch themselves by the contacts of w.store.
uint32_t count_self(const World &w, StepContext &step);
// Would a cut have the surface of a body touch itself that has no lists of itself?
bool lists_after_cut(const World &w, const Body &b);
// For prepare(): fills step.self_bodies and the facts for the plan; finds the laws of bodies with themselves;
// `used` is scratch.
void choose_self_bodies(World &w, StepContext &step, SceneFacts &facts, std::vector<uint32_t> &used);

// For the guard: rebuilds lists that do not cover the motion after the solve; returns true if any has changed
// since it was joined.
bool cover_self(World &w, StepContext &step);
// Fills `to` with `pairs` (null: none) and behind them those of bodies with themselves; false: there are
// none, and `to` is as it was.
bool join_self(Views &views, const Array<Candidate> *pairs, Array<Candidate> &to);
// m that the two features of a candidate of one body rest apart; 0 where the guard has nothing to keep:
// they lie on each other at rest, or cross at the start of the sub-step, and what is through already
// must be let out.
double guarded_apart(World &w, StepContext &step, const Candidate &c);

}  // namespace dfm
