/* deform/tool.h -- tools: rigid things that a hand, a device or a program moves; they feel what they touch.
 * doc/concepts/tools.md.
 *
 * A tool has a frame and one or more parts, which are rigid bodies (deform/rigid.h): contact, friction,
 * attachments, filters and reports take them as they take any rigid body. It moves to the pose that it is
 * given for the end of each step. Where its stiffness is above 0, the pose is that of a device and pulls at
 * the tool through a spring and a damper (virtual coupling): the tool then has a mass, yields to what it
 * meets, and the device feels the spring. Tools have no weight. */
#ifndef DEFORM_TOOL_H
#define DEFORM_TOOL_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Shapes, in the tool's frame.
 * SPHERE, BOX, MESH, ELLIPSOID: around the origin (a mesh where its points say). CAPSULE: around the origin,
 * axis along z. BLADE: a box, x its thickness, whose lower edge, along y at -z, is the sharp one.
 * GRASPER: two boxes, hinged at the origin about y, that point along -z and lie on each other's faces x = 0
 * where the opening is 0. SCISSORS: the same, and the two lie side by side along y, so that they pass each
 * other. Both have a shaft where radius is above 0: a capsule from the origin along +z. */
enum {
  DFM_TOOL_SPHERE = 0,
  DFM_TOOL_CAPSULE = 1,
  DFM_TOOL_BOX = 2,
  DFM_TOOL_MESH = 3,
  DFM_TOOL_GRASPER = 4,
  DFM_TOOL_SCISSORS = 5,
  DFM_TOOL_ELLIPSOID = 6,
  DFM_TOOL_BLADE = 7
};

/** dfm_tool_def.flags. PASSIVE: of a coupled tool, a passivity controller watches the work that the hand does
 * against the force that it is given, which is older than its motion. While the hand has got more than it
 * gave, it is given a share of the force, the smaller the more that is. */
enum { DFM_TOOL_PASSIVE = 1 };

typedef struct dfm_tool_def {
  uint32_t size, shape; /* DFM_TOOL_* */
  /* unique in the world among bodies and obstacles too. The jaws are NAME.left (towards +x) and NAME.right,
   * the triangles of a mesh or an ellipsoid NAME.shape */
  const char *name;
  dfm_pose pose; /* at the start: of the tool, and of the device */
  /* m. box, blade: half of the edges; ellipsoid: half axes; grasper, scissors: of one jaw, x its thickness,
   * z its length */
  double half_size[3];
  double radius;      /* sphere, capsule, shaft, m; shaft: 0: none */
  double half_length; /* capsule: half of the axis between the centers of its caps; shaft: half its length */
  uint32_t npoint, ntriangle;
  const double *points;      /* mesh: [npoint,3] m; closed, or it acts on the side that its triangles face */
  const uint32_t *triangles; /* [ntriangle,3] counter-clockwise seen from outside; both are copied */
  double opening;            /* rad between the jaws at the start, 0 to 3 */
  /* N/m and N s/m, N m/rad and N m s/rad, of the coupling. stiffness 0: no coupling, the tool follows its
   * pose exactly; else turn_stiffness must be above 0 too */
  double stiffness, damping, turn_stiffness, turn_damping;
  double mass, inertia; /* kg, kg m2 about any axis through the origin: of the tool, where it is coupled */
  /* s, 0 to 0.1, of a coupled tool: delay of the device in both directions, beyond the next step, until the
   * hand feels the response to its motion. port_work and PASSIVE include it */
  double late;
  uint32_t nkey, nopening;
  const dfm_pose_key *keys;          /* [nkey] poses over time, until the first dfm_tool_set_pose; copied */
  const dfm_scale_key *opening_keys; /* [nopening] rad over time, until dfm_tool_set_opening; copied */
  dfm_material material;             /* of all parts, for pair rules by material; 0: none */
  uint32_t category, collides_with;  /* of all parts, as of bodies */
  void *user;
  uint32_t flags, reserved; /* flags: DFM_TOOL_PASSIVE */
  uint64_t cookie;          /* set by the default function */
} dfm_tool_def;
/** dfm_tool_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_tool_def_default_sized(uint32_t size, dfm_tool_def *out);
/** A sphere of radius 5 mm at the origin, not coupled; 0.05 kg and 1e-5 kg m2 if it is. Threads: Any
 * thread. Since 0.1. */
static inline dfm_tool_def dfm_tool_def_default(void) {
  dfm_tool_def out;
  dfm_tool_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Makes a tool. @return DFM_OK; DFM_E_ARG (which entry, why); DFM_E_NOMEM; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_create(dfm_world world, const dfm_tool_def *def, dfm_tool *out);
/** Removes it with its parts; their contacts and attachments end with events. @return DFM_OK; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_destroy(dfm_tool tool);
/** All tools in order of creation; capacity 0 with out NULL only counts. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_tools(dfm_world world, uint32_t capacity, dfm_tool *out, uint32_t *n);
/** @return DFM_OK; DFM_E_ARG none of that name (nearest one). Threads: Any thread. Not during step. Since
 * 0.1. */
DFM_API dfm_status dfm_world_find_tool(dfm_world world, const char *name, dfm_tool *out);
/** Its def as created (name valid while it lives; points, triangles and keys are not returned). Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_get_def(dfm_tool tool, dfm_tool_def *out);
/** Its parts: frame or shaft first, then the left and the right jaw. Each is a dfm_rigid, and so a
 * dfm_obstacle: dfm_rigid_add_shape gives it further shapes, dfm_body_attach holds tissue at it,
 * dfm_obstacle_set_filter and dfm_obstacle_set_material change it. dfm_world_rigids does not list them, and
 * dfm_rigid_set_state and dfm_rigid_destroy refuse them.
 * @param capacity of out; 0 with out NULL only counts. @return DFM_OK; DFM_E_ARG too small. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_parts(dfm_tool tool, uint32_t capacity, dfm_rigid *out, uint32_t *n);

/* ---- moved once per step ------------------------------------------------------------------------------- */

/** Where the tool, or the device that it is coupled to, is at the end of the next step; it goes there at
 * constant rate, and does not move in steps for which no pose is set. Replaces keys.
 * @param pose      world frame
 * @param velocity  [6] m/s and rad/s at that time, world frame, as the device measures it: what the damper of
 * the coupling sees. NULL: that of the way there. Without a coupling it has no effect.
 * @return DFM_OK; DFM_E_ARG not finite; DFM_E_HANDLE. A step in which a tool without coupling would move
 * faster than dfm_world_def.obstacle_speed is refused by dfm_world_step, with DFM_E_ARG, and nothing changes.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_set_pose(dfm_tool tool, const dfm_pose *pose, const double velocity[6]);
/** Angle between the jaws at the end of the next step. Replaces opening_keys.
 * @param angle rad, 0 to 3. @return DFM_OK; DFM_E_ARG out of range, or the tool has no jaws; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_set_opening(dfm_tool tool, double angle);
/** Lets its keys lead again from the next step on, after dfm_tool_set_pose and dfm_tool_set_opening. By the
 * end of that step it is where they want it; far from there, bring it near first (dfm_tool_keys_at).
 * @return DFM_OK; DFM_E_ARG it has no keys, or a device moves it; DFM_E_HANDLE. Threads: Not during step.
 * Since 0.1. */
DFM_API dfm_status dfm_tool_follow_keys(dfm_tool tool);
/** Pose and opening that the keys give at a time, whether the tool follows them or not.
 * @param t        s
 * @param pose     out, may be NULL; of a tool without keys of this kind: the last pose that was set
 * @param opening  out, rad, may be NULL; likewise
 * @return DFM_OK; DFM_E_ARG t is not finite, or the tool has no keys at all; DFM_E_HANDLE. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_keys_at(dfm_tool tool, double t, dfm_pose *pose, double *opening);
/** Puts tool and device there now, at rest, without a motion; replaces keys. What the tool then lies in is
 * found as after creation (dfm_world_overlaps). @return DFM_OK; DFM_E_ARG not finite; DFM_E_HANDLE. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_teleport(dfm_tool tool, const dfm_pose *pose);

/* ---- what is felt -------------------------------------------------------------------------------------- */

/** What the world did to the tool in the last step: contact, friction, attachments and the force of its cuts
 * (materials with `fracture_energy`), on all parts. Impulses are summed over all sub-steps and divided by the
 * length H of the step: H times the force is the momentum that the world gave it, and H times the torque
 * the angular momentum, to rounding. The body that is cut gets the opposite of the force of the cut.
 * @param force   [3] N on the tool, in its present frame
 * @param torque  [3] N m on the tool, about its present origin, in that frame
 * @return DFM_OK (zero before the first step); DFM_E_ARG; DFM_E_HANDLE. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_tool_force(dfm_tool tool, double force[3], double torque[3]);
/** Force that a device exerts on the hand: the mean force of the coupling over the last step on the device,
 * or that of dfm_tool_force where there is no coupling.
 * @param force   [3] N on the hand, in the device's present frame
 * @param torque  [3] N m on the hand, about the device's origin, in that frame
 * @return as dfm_tool_force. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_feedback(dfm_tool tool, double force[3], double torque[3]);

typedef struct dfm_tool_state {
  uint32_t size, nkeys;        /* nkeys: 1: keys still move it */
  dfm_pose pose;               /* of the tool now */
  double velocity[3], spin[3]; /* m/s of its origin, rad/s; mean of the last sub-step; world frame */
  dfm_pose device;             /* the pose that was set; equals pose without a coupling */
  double opening;              /* rad */
  double time;                 /* s, of the last step; 0: none yet */
  double work; /* J that whoever moves it has put in since it was made: into the coupling, or without one into
                * what it touches; by the forces of the sub-steps themselves */
  /* J, the same by the forces that dfm_tool_feedback gave: each acts while the hand makes the next step, or
   * `late` seconds later. Below 0 the hand has got energy that it never put in */
  double port_work;
} dfm_tool_state;
/** @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_get_state(dfm_tool tool, dfm_tool_state *out);

/* ---- grasping ------------------------------------------------------------------------------------------ */

/** Attaches what a tool touches: the surfels of the body that touch a part of it or are nearer than `reach`
 * are held by the part, rigidly, as dfm_body_attach does with DFM_ATTACH_TOUCH (force, events, end). Another
 * tool may hold the same body: to hand it over, grab with the second, then dfm_body_detach from the first.
 * @param reach    m from the surface of a part; 0: twice the contact offset
 * @param release  N: a larger force ends the attachment; 0: none does
 * @param capacity of attachment; as many as the tool has parts is always enough
 * @param attachment out, [n] numbers among the body's attachments, one for each part that holds something
 * @param n        out; 0 where nothing is in reach
 * @return DFM_OK; DFM_E_ARG, also where capacity is too small, and then nothing is held; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_grab(dfm_tool tool, dfm_body body, double reach, double release,
                                 uint32_t capacity, uint32_t *attachment, uint32_t *n);

/* ---- cutting ------------------------------------------------------------------------------------------- */

/** Lets a tool cut bodies at the end of each step, as dfm_body_cut does (deform/cut.h). Replaces what was set
 * before. The parts that cut (of scissors the jaws) do not touch these bodies. An event DFM_EVENT_CUT
 * reports each body that was cut in a step (deform/contact.h).
 * SPLIT (blade, scissors): faces open where the edge crosses the line between the middles of their cells and
 * moves forward relative to the cells. REMOVE: the cells that the shape meets on its path are removed; blades
 * and scissors act by their boxes.
 * @param how     DFM_CUT_REMOVE or DFM_CUT_SPLIT
 * @param most    of one body in one step: cells, those of the lowest numbers, or faces, those that the edge
 * has met first; 0: no limit. The rest is cut in the next steps: cells as long as the shape is in them,
 * faces as long as they are less than one edge length of the body's surface behind the edge
 * @param n       number of bodies; 0: the tool cuts nothing
 * @param bodies  [n]
 * @return DFM_OK; DFM_E_ARG the shape cannot cut, or not in this way; DFM_E_UNSUPPORTED a body cannot be cut
 * (dfm_body_cut says which can); DFM_E_HANDLE. After an error nothing has changed. Where a cut finds no
 * memory, dfm_world_step returns DFM_E_NOMEM after the step. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_set_cuts(dfm_tool tool, uint32_t how, uint32_t most, uint32_t n,
                                     const dfm_body *bodies);
/** What the tool cuts. @param how, most  may be NULL @param capacity  of bodies; 0 with bodies NULL only
 * counts @param n  out, number of bodies that are still there; 0: it cuts nothing @return DFM_OK; DFM_E_ARG
 * capacity too small (bodies untouched); DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_cuts(dfm_tool tool, uint32_t *how, uint32_t *most, uint32_t capacity,
                                 dfm_body *bodies, uint32_t *n);

/* ---- devices ------------------------------------------------------------------------------------------- */

/** What a device says of the hand. */
typedef struct dfm_device_sample {
  uint32_t size, flags; /* DFM_DEVICE_* of the members that are given besides the pose */
  dfm_pose pose;        /* world frame */
  double velocity[6];   /* m/s, rad/s, world frame */
  double opening;       /* rad */
} dfm_device_sample;
enum { DFM_DEVICE_VELOCITY = 1, DFM_DEVICE_OPENING = 2 };
/** A device with six degrees of freedom: a haptic arm, a 3D mouse, a recorded hand. Both are called by the
 * thread that steps the world, once per step, and must not wait: what runs at a rate of its own leaves its
 * last sample where read() finds it. */
typedef struct dfm_device {
  uint32_t size, flags; /* flags: 0 */
  void *user;
  /** Before a step. @param t s, the end of the step that begins. @param out its size is set, flags are 0.
   * @return DFM_OK; DFM_DISCARD nothing new: the tool's device does not move; negative: the step is refused
   * with this status and nothing changes */
  dfm_status (*read)(void *user, double t, dfm_device_sample *out);
  /** After a step: the force, N, and torque, N m, on the hand, about the device's origin, world frame.
   * May be NULL. @return DFM_OK; negative: the device takes no force any more, which is logged once */
  dfm_status (*write)(void *user, double t, const double force[3], const double torque[3]);
} dfm_device;
/** Lets a device move the tool from the next step on; it replaces keys, and dfm_tool_set_pose then has no
 * effect.
 * @param device copied; NULL: none any more. @return DFM_OK; DFM_E_ARG read is missing; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_tool_set_device(dfm_tool tool, const dfm_device *device);
#ifdef __cplusplus
}
#endif
#endif
