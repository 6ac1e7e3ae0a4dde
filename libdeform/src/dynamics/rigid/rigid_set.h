// The rigid bodies of one host. They move in a sub-step by the same calls as a soft body
// (dynamics/dynamics.h), each for all bodies of the host at once; step/rigid/rigid.cpp uses the results.
#pragma once
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/rigid.h"
#include "dynamics/dynamics.h"
#include "dynamics/rigid/host.h"

namespace dfm {

struct World;

// Why a call of a host failed; status: that of the host, DFM_OK if its result is not finite.
struct HostFault {
  dfm_status status = DFM_OK;
  const char *what = nullptr;
  explicit operator bool() const { return what != nullptr; }
};

void need_memory(dfm_status status);  // throws std::bad_alloc if the host had no memory
bool finite_values(std::span<const dfm_rigid_state> states);

struct RigidMotor { double velocity = 0, max = 0; };  // max 0: none

struct RigidSet {
  World *world;
  std::string host_name;
  dfm_rigid_host host;
  void *self = nullptr;
  std::vector<dfm_rigid_def> defs;                   // without names: the obstacles have them
  std::vector<dfm_joint_def> joints;                 // [njoint] as created
  std::vector<uint64_t> obstacle;                    // [n] ids
  bool elsewhere = false;                            // made with data: bodies of a world that the host owns
  uint32_t njoint = 0, ngroup = 0, first_group = 0;  // first_group: of this set among the world's
  std::vector<uint32_t> group, place;                // [n] group within the set; number within the group
  dfm_rigid_step step{};                             // of this sub-step

  Array<dfm_rigid_state> state, next;  // [n] now; at the end of the sub-step
  Array<double> extra, next_extra;     // the host's
  Array<RigidMotor> motors;            // [njoint] as last given to the host
  // [n,6] mean velocity without contact; contact impulse of the last sub-step
  Array<double> velocity, impulse;
  // [n,6] velocity that detection used; the solve starts from the later one
  Array<double> first;
  // [n,6] the same velocity with the host's present data
  Array<double> revised;
  Array<double> total;            // [n,3] N s of contact since creation
  Array<double> wrench;           // [n,6] N, N m: mean of contact in the last sub-step that was kept
  bool of_tool = false;           // its bodies are parts of a tool (state/tool.h)
  std::recursive_mutex querying;  // one query of the host at a time, from any thread

  // As Dynamics: throws std::bad_alloc if the host has no memory.
  void begin(const SubStep &now);  // sets the inputs of the host until the next sub-step
  HostFault free_motion();         // velocity
  HostFault respond(uint32_t group, uint32_t bodies, double *matrix);  // [6 bodies, 6 bodies], 1/kg
  // changed: with these impulses the response of the host differs; revised is then its velocity without
  // contact.
  HostFault revise(bool &changed);
  HostFault take_impulses();                         // for all sets, before any set ends its sub-step
  HostFault end_state(bool &again);                  // next; again: the velocity has changed, solve again
  void commit(const SubStep &now, double fraction);  // share of the displacement

  RigidSet(World &w, const Memory &memory, const std::string &host);
  ~RigidSet();
  RigidSet(const RigidSet &) = delete;
  RigidSet &operator=(const RigidSet &) = delete;
};

}  // namespace dfm
