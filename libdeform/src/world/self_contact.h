// Bodies whose surfaces touch themselves: who they are, and what detection keeps of them. A world in which none does has no stage for it.
#pragma once
#include "broad/self_list.h"
#include "plan/plan.h"

namespace dfm {

struct World;
struct Body;

struct SelfBody {
  uint64_t id;
  const Body *body;
  SelfRest rest;
  SelfList list;
  SelfBody(const Memory &memory, const Body &b);
};

// Asked for by the world (dfm_world_def.self_contact, or the effect in its list)?
bool asks_self_contact(const World &w);
// Of prepare(): fills w.self_bodies and what the plan is told of them; laws of the pairs of a body with itself are found, `used` is scratch.
void choose_self_bodies(World &w, SceneFacts &facts, std::vector<uint32_t> &used);

}  // namespace dfm
