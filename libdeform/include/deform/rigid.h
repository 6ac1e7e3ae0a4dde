/* deform/rigid.h -- rigid bodies that soft bodies push: their states, joints and motors, and the table by
 * which a rigid host takes part in the contact solve. doc/concepts/rigid.md.
 *
 * A set of rigid bodies belongs to one host. The world keeps their states; the host answers, once per
 * sub-step, how they would move without contact, how they answer impulses, and where they end. Contact is
 * solved with these answers, so both sides feel the same impulses. Rigid bodies touch soft bodies only:
 * neither each other nor obstacles. That is their host's business. */
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
#define DFM_RIGID_WORLD UINT32_MAX /* a joint's `with`: the world */
#define DFM_RIGID_STILL UINT32_MAX /* a body's group: it feels nothing and never moves */
enum { DFM_JOINT_HINGE = 0, DFM_JOINT_SLIDER = 1, DFM_JOINT_BALL = 2, DFM_JOINT_FIXED = 3 };

/** What moves of one body, in the world's frame: center of mass (m), from the axes of its moments of inertia
 * to the world's (x y z w, unit), velocity of the center of mass (m/s), spin (rad/s). */
typedef struct dfm_rigid_state { double position[3], rotation[4], velocity[3], spin[3]; } dfm_rigid_state;

typedef struct dfm_rigid_def {
  /* DFM_SHAPE_SPHERE, BOX or CAPSULE, centered at the pose, or NONE: dfm_rigid_add_shape gives it others */
  uint32_t size, shape;
  const char *name; /* unique in the world among bodies and obstacles too */
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
  double anchor[3];         /* m, world frame, as the bodies stand when they are created */
  double axis[3];           /* hinge, slider: world frame, any length */
  uint32_t motor, reserved; /* 1: hinge and slider may have one */
  /* of `body` against `with`: rad/s about the axis (right hand), m/s along it */
  double velocity;
  double max; /* N m, N; what the motor can do at most, either way */
} dfm_joint_def;

/** One host's bodies and joints in one world. Strings and arrays are copied. The defs of an array have one
 * size and lie that far apart, so that they may grow: a host takes them by dfm_rigid_set_body and
 * dfm_rigid_set_joint. */
typedef struct dfm_rigid_set_def {
  uint32_t size, nbody, njoint, reserved;
  const dfm_rigid_def *bodies;
  const dfm_joint_def *joints;
  /* for the host's create: what the set stands for in the host's own world; NULL: nothing yet */
  void *data;
} dfm_rigid_set_def;
/** Def of body i of a set, 0 .. nbody - 1, in the rows' own size. Threads: Any thread. Since 0.1. */
static inline const dfm_rigid_def *dfm_rigid_set_body(const dfm_rigid_set_def *set, uint32_t i) {
  return (const dfm_rigid_def *)(const void *)((const char *)set->bodies + (size_t)set->bodies->size * i);
}
/** Def of joint i of a set, 0 .. njoint - 1, in the rows' own size. Threads: Any thread. Since 0.1. */
static inline const dfm_joint_def *dfm_rigid_set_joint(const dfm_rigid_set_def *set, uint32_t i) {
  return (const dfm_joint_def *)(const void *)((const char *)set->joints + (size_t)set->joints->size * i);
}

/* ---- the table of a host ------------------------------------------------------------------------------- */

/** One sub-step as a host sees it. Arrays hold the world's state and live during the call. */
typedef struct dfm_rigid_step {
  uint32_t size, nbody;
  double t, h, gravity[3];      /* s at its start, s, m/s2 */
  const dfm_rigid_state *state; /* [nbody] at its start */
  const double *extra;          /* [nextra] */
} dfm_rigid_step;

/** Per sub-step and set: predict, respond for each group that is touched, revise (and respond again where it
 * changed something), push where there is one, commit (again, if the guard asks for other impulses), all with
 * the same dfm_rigid_step. Each of
 * them runs for all sets of the world before the next one begins, so that sets that share a world of the
 * host's see all impulses (push) before any has to know where it ends (commit). A sub-step may be tried again
 * with another h, and one that fails is not committed anywhere: the next predict then has the state of the
 * last one that succeeded, so a host with a world of its own writes `state` into it first.
 * A host whose bodies act on each other beyond its answers (joints, contacts, motors of an engine) may return
 * DFM_RIGID_AGAIN from commit, with its outputs filled all the same: contact is then solved once more, with
 * the velocities that predict gives now, and pushed and committed again. The world does so
 * DFM_RIGID_MOST_AGAIN times at most, after that what commit has filled in counts.
 * Called from the thread that steps the world, never by two threads at once for one instance; results must
 * depend on the arguments alone. Every function returns DFM_OK, or a negative status, which ends the step
 * with DFM_TROUBLE_PLUGIN. */
enum { DFM_RIGID_AGAIN = 2, DFM_RIGID_MOST_AGAIN = 4 };

typedef struct dfm_rigid_host {
  uint32_t size, flags; /* flags: 0 */
  void *user;           /* handed to create */
  /** Takes a set. @param set    checked: masses and inertias are there (1/0 never occurs), poses are unit
   * @param group  out, [nbody]: bodies that answer each other's impulses share a number; numbers 0, 1, 2, ..
   * each in use; DFM_RIGID_STILL
   * @param nextra out, values of further state that the world keeps for this instance (motors, caches that
   * must survive restore); they start at 0 */
  dfm_status (*create)(void *user, const dfm_rigid_set_def *set, void **self, uint32_t *group,
                       uint32_t *nextra);
  void (*destroy)(void *self);
  /** Mean velocity over the sub-step with everything but contact: [nbody,6] linear of the center of mass,
   * angular; world frame. */
  dfm_status (*predict)(void *self, const dfm_rigid_step *step, double *velocity);
  /** Change of that mean velocity per unit impulse: [6g,6g] row-major, symmetric, positive semidefinite; per
   * body of the group, in rising order, linear at the center of mass, then angular (1/kg, 1/(kg m2)). */
  dfm_status (*respond)(void *self, const dfm_rigid_step *step, uint32_t group, double *matrix);
  /** End of the sub-step. @param impulse [nbody,6] of contact: N s, and N m s about the center of
   * mass at the start
   * @param state  out, [nbody]; @param extra out, [nextra]. Neither aliases *step. */
  dfm_status (*commit)(void *self, const dfm_rigid_step *step, const double *impulse, dfm_rigid_state *state,
                       double *extra);
  /** Changes what extra must say for a motor; extra holds the start values when called right after create.
   * May be NULL: no motors. */
  dfm_status (*set_motor)(void *self, uint32_t joint, double velocity, double max, double *extra);
  /** What dfm_rigid_joint tells, from state and extra alone (they may just have been restored).
   * May be NULL. */
  dfm_status (*joint)(void *self, const dfm_rigid_state *state, const double *extra, uint32_t joint,
                      double *position, double *rate, double *effort);
  /** Asked when contact is solved: do these impulses leave true what predict and respond took for granted
   * (motors that hold, motors at their limit)? If not, the host takes something else for granted, *changed is
   * 1 and velocity what predict gives with that; respond is asked again and contact solved again, a few times
   * at most. May be NULL: predict and respond hold for all impulses. @param impulse [nbody,6] as for commit
   * @param velocity out, [nbody,6] @param changed out */
  dfm_status (*revise)(void *self, const dfm_rigid_step *step, const double *impulse, double *velocity,
                       uint32_t *changed);
  /** The impulses that commit will have, before any set commits. May be NULL. */
  dfm_status (*push)(void *self, const dfm_rigid_step *step, const double *impulse);
  /** Asked by dfm_rigid_destroy: may the caller remove the set? A host whose engine owns the bodies refuses,
   * with a sentence by dfm_fail that says what to call instead; not asked when the world ends. May be NULL:
   * the caller may. */
  dfm_status (*may_destroy)(void *self);
} dfm_rigid_host;

/** Makes a host known under a name to every context of the process; the table is copied, its code must stay
 * loaded. "builtin" is always known.
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
/** Makes a set of bodies. A dfm_rigid is a dfm_obstacle too: poses, defs, rays, pair rules and reports take
 * it; it moves by itself only.
 * @param host  "builtin" or a registered name; NULL: "builtin"
 * @param out   [nbody]
 * @return DFM_OK; DFM_E_ARG (which body or joint, why; nearest host); DFM_E_FATAL the host refuses (the
 * sentence gives its reason); DFM_E_NOMEM.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_create(dfm_world world, const char *host, const dfm_rigid_set_def *set,
                                    dfm_rigid *out);
/** A further shape of a body, at def->pose in the body's frame, whose origin is the center of mass: any but a
 * plane; no keys, no sine. It touches with the body's mass and moves with it; a dfm_obstacle with a name,
 * material and filter of its own. dfm_obstacle_destroy removes it alone.
 * @return DFM_OK; DFM_E_ARG (which entry, why); DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_add_shape(dfm_rigid rigid, const dfm_obstacle_def *def, dfm_obstacle *out);
/** Removes the whole set that the body came with, with all shapes; their contacts end.
 * @return DFM_OK; DFM_E_STATE the body belongs to an engine's adapter, which takes it away itself (the
 * sentence says how); DFM_E_HANDLE; DFM_E_BUSY.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_destroy(dfm_rigid rigid);
/** All rigid bodies in order of creation but the parts of tools (dfm_tool_parts); capacity 0 with out NULL
 * only counts. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_rigids(dfm_world world, uint32_t capacity, dfm_rigid *out, uint32_t *n);
/** dfm_rigid_get_state of all of them in one call, in the order of dfm_world_rigids. For hosts with many
 * bodies: it costs a fraction of a call for each.
 * @param capacity  length of states, and of rigids; 0 with states NULL only counts
 * @param rigids    out, which body each state is of; may be NULL
 * @param states    out
 * @param n         out, number of bodies; may be NULL
 * @return DFM_OK; DFM_E_ARG fewer places than bodies; DFM_E_HANDLE. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_rigid_states(dfm_world world, uint32_t capacity, dfm_rigid *rigids,
                                          dfm_rigid_state *states, uint32_t *n);
/** @return DFM_OK; DFM_E_ARG none of that name (nearest one). Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_find_rigid(dfm_world world, const char *name, dfm_rigid *out);
/** Its def as created (name valid while it lives). Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_get_def(dfm_rigid rigid, dfm_rigid_def *out);
/** Pose and velocities now: m, unit quaternion, m/s of the center of mass, rad/s.
 * @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_get_state(dfm_rigid rigid, dfm_rigid_state *out);
/** Puts a body somewhere, at once; a body with joints must fit them (what does not is pulled back in
 * the next step).
 * @return DFM_E_ARG not finite, or the body is fixed. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_set_state(dfm_rigid rigid, const dfm_rigid_state *state);
/** Mass, momenta and energies as of a soft body: elastic 0, volume that of the shape. Threads: Any thread.
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_get_measure(dfm_rigid rigid, dfm_body_measure *out);
/** Mean force (N) and moment about the center of mass (N m) that contact put on it in the last sub-step.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_contact_wrench(dfm_rigid rigid, double force[3], double moment[3]);
/** Motor of one of the set's joints, numbered as in its def; any body of the set names it. max 0: off.
 * @return DFM_E_ARG no such joint, or no hinge or slider; DFM_E_UNSUPPORTED the host has no motors. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_set_motor(dfm_rigid rigid, uint32_t joint, double velocity, double max);
/** A hinge or slider, of `body` against `with`, about or along the def's axis as it goes along with `with`;
 * on every host alike. Each out may be NULL.
 * @param position  rad since creation, within half a turn either way; m of `body`'s anchor from `with`'s
 * @param rate      rad/s; m/s of `body`'s anchor against the place of `with` that it is at
 * @param effort    mean of what the motor did to `body` in the last sub-step; to `with` it did the opposite.
 *                  Hinge: N m, the moment about the axis through the anchor (what the hinge itself holds with
 *                  has none there). Slider: N along the axis. 0 to rounding with the motor off
 * @return as dfm_rigid_set_motor. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_rigid_joint(dfm_rigid rigid, uint32_t joint, double *position, double *rate,
                                   double *effort);
#ifdef __cplusplus
}
#endif
#endif
