// Rigid bodies in a world: sets of bodies that one host answers for. To detection, filters and reports each
// body is an obstacle; the solve takes its response from the host, so that it feels what it pushes. The
// states are the world's (snapshot, hash), the host only maps one to the next.
#pragma once
#include "contact/rows.h"
#include "math/vec3.h"
#include "state/motion.h"
#include "dynamics/rigid/rigid_set.h"

namespace dfm {

struct StepContext;
struct World;
struct Obstacle;

// Throws Error and leaves the world as it was. out: [nbody] handles.
void create_rigids(World &w, const char *host, const dfm_rigid_set_def &def, uint64_t *out);
void destroy_rigids(RigidSet &set);  // throws Error where the host keeps its bodies
Obstacle &rigid_obstacle(World &w, uint64_t id);
void place_rigids(World &w);  // World::prepare(): slots and groups
void rigid_response(World &w, StepContext &step, const ContactRows::Block &group);
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
