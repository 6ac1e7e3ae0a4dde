// The rigid bodies that one host answers for. They move in a sub-step by the calls that Dynamics has for a
// soft body (dynamics/dynamics.h), each for all bodies of the host at once; what stages do with the answers
// stands in step/rigid.cpp.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/rigid.h"
#include "dynamics/dynamics.h"
#include "dynamics/rigid/host.h"

namespace dfm {

struct World;

// Why a host could not be asked; status: its own, DFM_OK where its answer is not finite.
struct HostFault {
  dfm_status status = DFM_OK;
  const char *what = nullptr;
  explicit operator bool() const { return what != nullptr; }
};

void need_memory(dfm_status status);  // throws std::bad_alloc where a host has found none
bool finite_values(const double *p, size_t n);
bool finite_values(std::span<const dfm_rigid_state> states);

struct RigidSet {
  World *world;
  std::string host_name;
  dfm_rigid_host host;
  void *self = nullptr;
  std::vector<dfm_rigid_def> defs;                   // names: those of the obstacles
  std::vector<dfm_joint_def> joints;                 // [njoint] with their motors as they were last set
  std::vector<uint64_t> obstacle;                    // [n] ids
  bool elsewhere = false;                            // made with data: bodies of a world of the host's own
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
  Array<double> total;   // [n,3] N s of contact since creation
  double last_h = 0;     // s, of the last sub-step; 0: none yet
  bool of_tool = false;  // its bodies are the parts of a tool (state/tool.h)

  // As Dynamics: throws std::bad_alloc where the host finds no memory.
  void begin(const SubStep &now);  // what the host is asked with, until the next one
  HostFault free_motion();         // velocity
  bool respond(uint32_t group, uint32_t bodies, double *matrix);  // [6 bodies, 6 bodies], 1/kg
  // changed: by these impulses the host answers differently; revised is its velocity without contact then.
  bool revise(bool &changed);
  HostFault take_impulses();                         // of all sets, before any set ends its sub-step
  HostFault end_state(bool &again);                  // next; again: with another velocity, solve once more
  void commit(const SubStep &now, double fraction);  // of the way to the end

  RigidSet(World &w, const Memory &memory, const std::string &host);
  ~RigidSet();
  RigidSet(const RigidSet &) = delete;
  RigidSet &operator=(const RigidSet &) = delete;
};

}  // namespace dfm
