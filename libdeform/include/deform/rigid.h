/* deform/rigid.h -- rigid bodies in contact with soft bodies: states, joints and motors, and the table of
 * functions by which a rigid host takes part in the contact solve. doc/concepts/rigid.md.
 *
 * A set of rigid bodies belongs to one host. The world keeps their states. In each sub-step the host says how
 * they would move without contact, how they respond to impulses, and where they end. Contact is solved with
 * these responses, so both sides receive the same impulses. Those of the host "builtin" touch obstacles and
 * each other as well; of other hosts they touch soft bodies only, and the rest is left to the host. */
#ifndef DEFORM_RIGID_H
#define DEFORM_RIGID_H
#include "deform/base.h"
#include "deform/body.h"
#include "deform/id.h"
#include "deform/math.h"
#include "deform/obstacle.h"
#ifdef __cplusplus
extern "C" {
#endif
#define DFM_RIGID_WORLD UINT32_MAX /* dfm_joint_def.with: the world */
#define DFM_RIGID_STILL UINT32_MAX /* group of a body that impulses do not move */
enum { DFM_JOINT_HINGE = 0, DFM_JOINT_SLIDER = 1, DFM_JOINT_BALL = 2, DFM_JOINT_FIXED = 3 };

/** State of one body, world frame: center of mass (m), rotation from its principal axes to the world (x y z
 * w, unit), velocity of the center of mass (m/s), spin (rad/s). */
typedef struct dfm_rigid_state { double position[3], rotation[4], velocity[3], spin[3]; } dfm_rigid_state;

typedef struct dfm_rigid_def {
  /* DFM_SHAPE_SPHERE, BOX or CAPSULE, centered at the pose, or NONE: dfm_rigid_add_shape gives it others */
  uint32_t size, shape;
  const char *name; /* unique in the world, among bodies and obstacles too */
  dfm_pose pose;
  double half_size[3], radius, half_length; /* as in dfm_obstacle_def, m */
  double mass;                              /* kg; > 0 unless fixed */
  /* kg m2, principal moments about the body's own axes; all zero: solid of uniform density */
  double inertia[3];
  double velocity[3], spin[3]; /* m/s of the center of mass, rad/s, world frame */
  uint32_t fixed, category;
  uint32_t collides_with, reserved;
  dfm_material material; /* for pair rules by material; 0: none */
  void *user;
  uint64_t cookie; /* set by the default function */
} dfm_rigid_def;

typedef struct dfm_joint_def {
  uint32_t size, type;      /* DFM_JOINT_* */
  uint32_t body, with;      /* numbers within the set; with: DFM_RIGID_WORLD for the world */
  double anchor[3];         /* m, world frame, with the bodies in their initial poses */
  double axis[3];           /* hinge, slider: world frame, any length */
  uint32_t motor, reserved; /* 1: motor of a hinge or slider */
  /* of `body` relative to `with`: rad/s about the axis (right hand), m/s along it */
  double velocity;
  double max; /* N m, N; limit of the motor in either direction */
} dfm_joint_def;

/** Bodies and joints of one host in one world. Strings and arrays are copied. The defs of an array are `size`
 * bytes apart, because they grow in later versions: a host reads them by dfm_rigid_set_body and
 * dfm_rigid_set_joint. */
typedef struct dfm_rigid_set_def {
  uint32_t size, nbody, njoint, reserved;
  const dfm_rigid_def *bodies;
  const dfm_joint_def *joints;
  /* passed to the host's create: the counterpart of the set in the host's own world; NULL: none yet */
  void *data;
} dfm_rigid_set_def;
/** Def of body i of a set, 0 .. nbody - 1. Threads: Any thread. Since 0.1. */
static inline const dfm_rigid_def *dfm_rigid_set_body(const dfm_rigid_set_def *set, uint32_t i) {
  return (const dfm_rigid_def *)(const void *)((const char *)set->bodies + (size_t)set->bodies->size * i);
}
/** Def of joint i of a set, 0 .. njoint - 1. Threads: Any thread. Since 0.1. */
static inline const dfm_joint_def *dfm_rigid_set_joint(const dfm_rigid_set_def *set, uint32_t i) {
  return (const dfm_joint_def *)(const void *)((const char *)set->joints + (size_t)set->joints->size * i);
}

/* ---- the table of a host ------------------------------------------------------------------------------- */

/** One sub-step. Arrays hold the state of the world and are valid during the call. */
typedef struct dfm_rigid_step {
  uint32_t size, nbody;
  double t, h, gravity[3];      /* s at its start, s, m/s2 */
  const dfm_rigid_state *state; /* [nbody] at its start */
  const double *extra;          /* [nextra] */
} dfm_rigid_step;

/** Order of calls per sub-step and set: predict; respond for each touched group; revise (and respond again if
 * it changed something); push if present; commit (again, if the guard needs other impulses). All get the same
 * dfm_rigid_step. Each function is called for all sets of the world before the next function, so that sets
 * that share a world of the host know all impulses (push) before any of them computes its end (commit). A
 * sub-step may be repeated with another h, and a failed one is not committed anywhere: the next predict then
 * gets the state of the last one that succeeded, so a host with a world of its own writes `state` into it
 * first. If bodies of a host interact beyond its responses (joints, contacts, motors of an engine), commit
 * may return DFM_RIGID_AGAIN with its outputs filled in: contact is then solved once more, with the
 * velocities that predict returns now, and pushed and committed again. The world does so at most
 * DFM_RIGID_MOST_AGAIN times; then the last outputs of commit are used.
 * Called from the thread that steps the world, never by two threads at once for one instance; results must
 * depend on the arguments alone. Every function returns DFM_OK, or a negative status, which ends the step
 * with DFM_TROUBLE_PLUGIN. */
enum { DFM_RIGID_AGAIN = 2, DFM_RIGID_MOST_AGAIN = 4 };

typedef struct dfm_rigid_host {
  uint32_t size, flags; /* flags: 0 */
  void *user;           /* passed to create */
  /** Creates an instance for a set. @param set    checked: no mass or inertia is missing, poses are unit
   * @param group  out, [nbody]: bodies that respond to each other's impulses share a number; the numbers
   * 0, 1, 2, .. are used without gaps; or DFM_RIGID_STILL
   * @param nextra out, number of further state values that the world keeps for this instance (motors, caches
   * that must survive restore); they start at 0
   * After an error *self is not looked at: destroy is not called. */
  dfm_status (*create)(void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group,
                       uint32_t *nextra);
  void (*destroy)(void *self);
  /** Mean velocity over the sub-step without contact with soft bodies: [nbody,6] linear of the center of
   * mass, angular; world frame. */
  dfm_status (*predict)(void *self, const dfm_rigid_step *step, double *velocity);
  /** Change of that mean velocity per unit impulse: [6g,6g] row-major, symmetric, positive semidefinite; for
   * each body of the group, in ascending order, linear at the center of mass, then angular (1/kg,
   * 1/(kg m2)). */
  dfm_status (*respond)(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix);
  /** End of the sub-step. @param impulse [nbody,6] of contact: N s, and N m s about the center of
   * mass at the start
   * @param state  out, [nbody]; @param extra out, [nextra]. Neither aliases *step. */
  dfm_status (*commit)(void *self, const dfm_rigid_step *step, const double *impulse, dfm_rigid_state *state,
                       double *extra);
  /** Sets a motor in extra; directly after create, extra holds the start values. May be NULL: no motors. */
  dfm_status (*set_motor)(void *self, uint32_t joint, double velocity, double max, double *extra);
  /** Results of dfm_rigid_joint, from state and extra alone (they may have been restored). May be NULL. */
  dfm_status (*joint)(void *self, const dfm_rigid_state *state, const double *extra, uint32_t joint,
                      double *position, double *rate, double *effort);
  /** Called after the contact solve: do the assumptions of predict and respond (motors that hold, motors at
   * their limit) remain valid with these impulses? If not, the host changes its assumptions, sets *changed to
   * 1 and velocity to what predict gives with the new ones; respond and the contact solve are repeated, a few
   * times at most. May be NULL: predict and respond are valid for all impulses. @param impulse [nbody,6] as
   * for commit @param velocity out, [nbody,6] @param changed out */
  dfm_status (*revise)(void *self, const dfm_rigid_step *step, const double *impulse, double *velocity,
                       uint32_t *changed);
  /** Gets the impulses of commit before any set commits. May be NULL. */
  dfm_status (*push)(void *self, const dfm_rigid_step *step, const double *impulse);
  /** Called by dfm_rigid_destroy: whether the caller may remove the set. A host whose engine owns the bodies
   * refuses, with a sentence by dfm_fail that says what to call instead. Not called when the world is
   * destroyed. May be NULL: removal is allowed. */
  dfm_status (*may_destroy)(void *self);
} dfm_rigid_host;

/** Registers a host under a name for every context of the process; the table is copied, its code must stay
 * loaded. "builtin" is always registered.
 * @return DFM_OK; DFM_E_ARG an entry is missing; DFM_E_STATE the name is taken. Threads: Any
 * thread. Since 0.1. */
DFM_API dfm_status dfm_rigid_host_register(const char *name, const dfm_rigid_host *table);

/* ---- bodies -------------------------------------------------------------------------------------------- */

/** dfm_rigid_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_rigid_def_default_sized(uint32_t size, dfm_rigid_def *out);
/** A ball of 1 kg and radius 0.5 m at the origin, category 1, collides with all. Threads: Any
 * thread. Since 0.1. */
static inline dfm_rigid_def dfm_rigid_def_default(void) {
  dfm_rigid_def out;
  dfm_rigid_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Creates a set of bodies. A dfm_rigid is also a dfm_obstacle: poses, defs, rays, pair rules and reports
 * accept it; functions that move obstacles refuse it.
 * @param host  "builtin" or a registered name; NULL: "builtin"
 * @param out   [nbody]
 * @return DFM_OK; DFM_E_ARG (which body or joint, why; nearest host); DFM_E_FATAL the host refuses (the
 * sentence gives its reason); DFM_E_NOMEM.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_create(dfm_world world, const char *host, const dfm_rigid_set_def *set,
                                    dfm_rigid *out);
/** Adds a shape to a body, at def->pose in the body's frame, whose origin is the center of mass. Any shape
 * but a plane; no keys, no sine. The shape moves with the body and has its mass in contact; it is a
 * dfm_obstacle with a name, material and filter of its own. dfm_obstacle_destroy removes the shape alone.
 * @return DFM_OK; DFM_E_ARG (which entry, why); DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_add_shape(dfm_rigid rigid, const dfm_obstacle_def *def, dfm_obstacle *out);
/** Removes the whole set of the body, with all shapes; their contacts end.
 * @return DFM_OK; DFM_E_STATE the body belongs to an engine's adapter, which removes it itself (the error
 * says how); DFM_E_HANDLE; DFM_E_BUSY.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_destroy(dfm_rigid rigid);
/** All rigid bodies in order of creation, except the parts of tools (dfm_tool_parts); capacity 0 with out
 * NULL only counts. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_rigids(dfm_world world, uint32_t capacity, dfm_rigid *out, uint32_t *n);
/** dfm_rigid_get_state of all bodies in one call, in the order of dfm_world_rigids: much cheaper than a call
 * for each body.
 * @param capacity  length of states, and of rigids; 0 with states NULL only counts
 * @param rigids    out, the body of each state; may be NULL
 * @param states    out
 * @param n         out, number of bodies; may be NULL
 * @return DFM_OK; DFM_E_ARG capacity too small; DFM_E_HANDLE. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_rigid_states(dfm_world world, uint32_t capacity, dfm_rigid *rigids,
                                          dfm_rigid_state *states, uint32_t *n);
/** Finds a rigid body by name. @return DFM_OK; DFM_E_ARG no such name (nearest one). Threads: Any thread. Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_world_find_rigid(dfm_world world, const char *name, dfm_rigid *out);
/** The def of its creation (name valid while it lives). Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_get_def(dfm_rigid rigid, dfm_rigid_def *out);
/** Pose and velocities now: m, unit quaternion, m/s of the center of mass, rad/s.
 * @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_get_state(dfm_rigid rigid, dfm_rigid_state *out);
/** Sets the state of a body at once. A body with joints should satisfy them; deviations are corrected in the
 * next step.
 * @return DFM_E_ARG not finite, or the body is fixed. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_set_state(dfm_rigid rigid, const dfm_rigid_state *state);
/** Mass, momenta and energies as for a soft body; elastic is 0, volume that of the shape. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_get_measure(dfm_rigid rigid, dfm_body_measure *out);
/** Mean contact force (N) and moment about the center of mass (N m) on the body in the last sub-step; 0
 * of a fixed one (dfm_world_contacts has its forces). Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_contact_wrench(dfm_rigid rigid, double force[3], double moment[3]);
/** Sets the motor of a joint of the set, numbered as in its def; `rigid` is any body of the set. max 0: off.
 * @return DFM_E_ARG no such joint, or it is no hinge or slider; DFM_E_UNSUPPORTED the host has no motors.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_set_motor(dfm_rigid rigid, uint32_t joint, double velocity, double max);
/** State of a hinge or slider, of `body` relative to `with`, about or along the def's axis, which moves with
 * `with`; the same on every host. Each out may be NULL.
 * @param position  rad since creation, within half a turn either way; m from the anchor of `with` to that of
 *                  `body`
 * @param rate      rad/s; m/s of the anchor of `body` relative to the coincident point of `with`
 * @param effort    mean action of the motor on `body` in the last sub-step; on `with` it is the opposite.
 *                  Hinge: N m, moment about the axis through the anchor (the constraint forces of the hinge
 *                  have none). Slider: N along the axis. 0 to rounding with the motor off
 * @return as dfm_rigid_set_motor. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_joint(dfm_rigid rigid, uint32_t joint, double *position, double *rate,
                                   double *effort);
#ifdef __cplusplus
}
#endif
#endif
