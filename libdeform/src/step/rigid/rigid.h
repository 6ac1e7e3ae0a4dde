// Rigid bodies in a world: sets of bodies of one host. For detection, filters and reports each body is an
// obstacle; the solve uses its response from the host, so that contact is two-way. The states belong to the
// world (snapshot, hash); the host only maps one to the next.
#pragma once
#include "contact/rows.h"
#include "dynamics/rigid/rigid_set.h"
#include "math/vec3.h"
#include "state/motion.h"

namespace dfm {

struct Derived;
struct Detection;
struct Entities;
struct Obstacle;
struct Solution;
struct StepContext;
struct Views;
struct World;

// The velocity of a body with this velocity and spin [6], at an arm from its center.
inline Vec3 velocity_at(const double *v, Vec3 arm) { return load3(v) + cross(load3(v + 3), arm); }

// The same of the body of this shape, as a mean over h seconds: its displacement to third order in the
// initial spin (ObstacleView::velocity_at).
Vec3 mean_velocity_at(const Obstacle &o, const double *v, Vec3 arm, double h);

// Throws Error; then the world is unchanged. out: [nbody] handles.
void create_rigids(World &w, const char *host, const dfm_rigid_set_def &def, uint64_t *out);
void destroy_rigids(RigidSet &set);  // throws Error if the host owns its bodies
Obstacle &rigid_obstacle(World &w, uint64_t id);
void place_rigids(World &w);  // World::prepare(): slots and groups
bool rigid_response(World &w, StepContext &step, const ContactRows::Block &group, uint32_t *trouble);
// of the rows, into every set
void sum_rigid_impulses(const Entities &entities, const Derived &derived, const Views &views,
                        const Detection &detection, const Solution &solution);
// Whether a solve must go on, because turning or motors go otherwise than it assumed; renewed: a host has
// decided again about motors, so that responses have changed.
struct Followed { bool goes_on = false, renewed = false; };
// After a solve that has left `left` m/s along normals. revises: hosts may decide again. False: one failed.
bool follow_rigids(World &w, StepContext &step, double left, bool revises, Followed &out, uint32_t *trouble);
void restart_rigids(World &w, StepContext &step);  // then, once the rows are finished again
dfm_body_measure measure_rigid(const RigidSet &set, uint32_t body);
void set_rigid_state(Obstacle &o, const dfm_rigid_state &state);  // of the body that the shape belongs to
bool is_moved(const Obstacle &o);                                 // the shape of a body that its host moves
// pose of a body's shape for this state of the body
Pose shape_pose(const Obstacle &shape, const dfm_rigid_state &body);
Obstacle &add_rigid_shape(Obstacle &body, const dfm_obstacle_def &def);
// for make_rows(): rows start from the last velocities of the hosts
void start_rigids(World &w, StepContext &step);
void set_rigid_motor(RigidSet &set, uint32_t joint, double velocity, double max);
void rigid_joint(RigidSet &set, uint32_t joint, double *position, double *rate, double *effort);

}  // namespace dfm
