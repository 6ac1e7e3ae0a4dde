// Rigid bodies in a world: sets of bodies that one host answers for. To detection, filters and reports each
// body is an obstacle; the solve takes its response from the host, so that it feels what it pushes. The
// states are the world's (snapshot, hash), the host only maps one to the next.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/memory.h"
#include "deform/rigid.h"
#include "math/vec3.h"
#include "rigid/host.h"

namespace dfm {

struct StepContext;
struct World;
struct Obstacle;
struct Pose;

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

// Throws Error and leaves the world as it was. out: [nbody] handles.
void create_rigids(World &w, const char *host, const dfm_rigid_set_def &def, uint64_t *out);
void destroy_rigids(RigidSet &set);  // throws Error where the host keeps its bodies
Obstacle &rigid_obstacle(World &w, uint64_t id);
// a host without memory is no fault of what it was asked: ends as where the library itself finds none
void need_memory(dfm_status status);
void place_rigids(World &w);  // World::prepare(): slots and groups
void rigid_response(World &w, StepContext &step, uint32_t group, double *matrix);
void sum_rigid_impulses(World &w, StepContext &step);  // of the rows, into every set
// true: a host answers differently under these impulses; rows have its new response, solve again
bool revise_rigids(World &w, StepContext &step);
dfm_body_measure measure_rigid(const RigidSet &set, uint32_t body);
void set_rigid_state(Obstacle &o, const dfm_rigid_state &state);  // of the body that the shape belongs to
// where a body's shape stands when the body has this state
Pose shape_pose(const Obstacle &shape, const dfm_rigid_state &body);
Obstacle &add_rigid_shape(Obstacle &body, const dfm_obstacle_def &def);
// make_rows(): the rows start where the hosts' last answer is
void correct_rigids(World &w, StepContext &step);
void set_rigid_motor(RigidSet &set, uint32_t joint, double velocity, double max);
void rigid_joint(RigidSet &set, uint32_t joint, double *position, double *rate, double *effort);

}  // namespace dfm
