/* deform/obstacle.h -- rigid things that the host moves and that feel nothing: plane, sphere, box, capsule,
 * triangle mesh, voxel grid. */
#ifndef DEFORM_OBSTACLE_H
#define DEFORM_OBSTACLE_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#ifdef __cplusplus
extern "C" {
#endif
enum {
  DFM_SHAPE_PLANE = 0,
  DFM_SHAPE_SPHERE = 1,
  DFM_SHAPE_BOX = 2,
  DFM_SHAPE_CAPSULE = 3,
  DFM_SHAPE_MESH = 4,
  DFM_SHAPE_VOXELS = 5,
  DFM_SHAPE_NONE = 6 /* a rigid body that has only the shapes added to it, or none */
};
typedef struct dfm_obstacle_def {
  uint32_t size, shape; /* DFM_SHAPE_* */
  const char *name;     /* unique in the world */
  dfm_pose pose;        /* plane: through position, normal = rotation * (0,0,1) */
  double half_size[3];  /* box, m */
  double radius;        /* sphere, capsule, m */
  /* capsule: half of the axis between the centers of its caps, along local z, m */
  double half_length;
  uint32_t nkey, reserved;
  const dfm_pose_key *keys; /* absolute poses over time, replace pose; copied */
  dfm_sine sine;            /* offset on top */
  /* belt: velocity of the surface beside that of the pose, m/s, world frame */
  double velocity_surface[3];
  dfm_material material; /* for pair rules by material; 0: none */
  uint32_t category, collides_with;
  void *user;
  /* Since 0.1. mesh, voxels: a triangle surface in the obstacle's frame; copied. Points of one place must be
   * one point (dfm_trimesh_read and dfm_trimesh_create see to that). A mesh may be open: it acts on the side
   * that its triangles face. Voxels need a closed one. */
  uint32_t npoint, ntriangle;
  const double *points;      /* [npoint,3] m */
  const uint32_t *triangles; /* [ntriangle,3] counter-clockwise seen from outside */
  /* voxels: cubic cells that fill the surface's box, about; 0: 262144 (64 x 64 x 64 of a cube) */
  uint32_t cells;
  uint32_t reserved2;
  uint64_t cookie; /* set by the default function */
} dfm_obstacle_def;
/** dfm_obstacle_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_obstacle_def_default_sized(uint32_t size, dfm_obstacle_def *out);
/** A plane z = 0 that looks up, at rest, category 1, collides with all. Threads: Any thread. Since 0.1. */
static inline dfm_obstacle_def dfm_obstacle_def_default(void) {
  dfm_obstacle_def out;
  dfm_obstacle_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** @return DFM_OK; DFM_E_ARG (which entry, why); DFM_E_NOMEM; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_create(dfm_world world, const dfm_obstacle_def *def, dfm_obstacle *out);
/** Its contacts end (events are reported). Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_destroy(dfm_obstacle obstacle);
/** Where it is now. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_get_pose(dfm_obstacle obstacle, dfm_pose *out);
/** Its def as created (name, points and triangles valid while it lives; keys are not returned). Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_get_def(dfm_obstacle obstacle, dfm_obstacle_def *out);
/** Pose at the end of the next step; its surface moves there at constant rate. Replaces keys. A step in which
 * it would move faster than dfm_world_def.obstacle_speed is refused with DFM_E_ARG, and nothing changes: take
 * more steps, or teleport. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_move_to(dfm_obstacle obstacle, const dfm_pose *pose);
/** Puts it there now, without a motion: nothing is pushed or dragged on the way. Replaces keys, sine and
 * target. What it lies in then overlaps, and is found as after creation (dfm_world_overlaps). Contacts that
 * it has there as well go on with their impulses and their friction memory, which belong to the body's
 * surface; the others end in the next step. Sleeping bodies wake. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_teleport(dfm_obstacle obstacle, const dfm_pose *pose);
/** Changes the velocity of its surface, a belt's, beside that of its pose. Sleeping bodies wake; contacts
 * keep their state. Cheap enough for each step.
 * @param velocity  [3] m/s, world frame
 * @return DFM_OK; DFM_E_ARG not finite, or too fast; DFM_E_STATE it is a rigid body; DFM_E_HANDLE. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_velocity_surface(dfm_obstacle obstacle, const double velocity[3]);
/** Changes the collision filter that its def gave, also of a rigid body or of one of its shapes. Contacts of
 * pairs that no longer touch end in the next step; a pair that touches from now on and overlaps is found as
 * after creation. @return DFM_OK; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_filter(dfm_obstacle obstacle, uint32_t category, uint32_t collides_with);
/** Changes its material, also of a rigid body or of one of its shapes: rules of friction by "material=NAME"
 * and the material's entry "friction" hold for it from now on. Where that gives a contact another law, or the
 * law other parameters, its friction memory starts anew; its impulses go on.
 * @param material  of the same world; 0: none
 * @return DFM_OK; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_material(dfm_obstacle obstacle, dfm_material material);
/** Obstacle of that name; rigid bodies and their shapes are obstacles too (dfm_world_find_rigid finds rigid
 * bodies alone). @return DFM_OK; DFM_E_ARG none of that name (nearest one); DFM_E_HANDLE. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_find_obstacle(dfm_world world, const char *name, dfm_obstacle *out);
#ifdef __cplusplus
}
#endif
#endif
