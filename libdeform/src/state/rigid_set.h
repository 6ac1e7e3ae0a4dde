// The rigid bodies that one host answers for, and their states (step/rigid.h).
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/rigid.h"
#include "dynamics/rigid/host.h"

namespace dfm {

struct World;

struct RigidSet {
  World *world;
  std::string host_name;
  dfm_rigid_host host;
  void *self = nullptr;
  std::vector<dfm_rigid_def> defs;                   // names: those of the obstacles
  std::vector<uint64_t> obstacle;                    // [n] ids
  uint32_t njoint = 0, ngroup = 0, first_group = 0;  // first_group: of this set among the world's
  std::vector<uint32_t> group, place;                // [n] within the set; its number within the group
  dfm_rigid_step step{};                             // this sub-step's

  Array<dfm_rigid_state> state, next;  // [n] now; at the end of the sub-step
  Array<double> extra, next_extra;     // the host's
  // [n,6] mean velocity without contact; contact impulse of the last sub-step
  Array<double> velocity, impulse;
  // [n,6] velocity as detection saw it; the solve starts from what came after
  Array<double> first;
  // [n,6] the same velocity by what the host takes for granted now
  Array<double> revised;
  Array<double> total;  // [n,3] N s of contact since creation
  double last_h = 0;    // s, of the last sub-step; 0: none yet

  RigidSet(World &w, const std::string &host);
  ~RigidSet();
  RigidSet(const RigidSet &) = delete;
  RigidSet &operator=(const RigidSet &) = delete;
};

}  // namespace dfm
