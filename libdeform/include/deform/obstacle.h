/* deform/obstacle.h -- rigid things that the host moves and that forces do not move: plane, sphere, box,
 * capsule, triangle mesh, voxel grid. */
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
  DFM_SHAPE_NONE = 6 /* a rigid body without a shape of its own (dfm_rigid_add_shape) */
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
  dfm_sine sine;            /* offset added to it */
  /* belt: velocity of the surface in addition to that of the pose, m/s, world frame */
  double velocity_surface[3];
  dfm_material material; /* for pair rules by material; 0: none */
  uint32_t category, collides_with;
  void *user;
  /* Since 0.1. mesh, voxels: a triangle surface in the obstacle's frame; copied. Triangles must share points
   * (dfm_mesh_load and dfm_mesh_create merge equal points). A mesh may be open: it acts on the side
   * that its triangles face. Voxels need a closed surface. */
  uint32_t npoint, ntriangle;
  const double *points;      /* [npoint,3] m */
  const uint32_t *triangles; /* [ntriangle,3] counter-clockwise seen from outside */
  /* voxels: approximate number of cubic cells in the surface's box; 0: 262144 (64 x 64 x 64 for a cube) */
  uint32_t cells;
  uint32_t reserved2;
  uint64_t cookie; /* set by the default function */
} dfm_obstacle_def;
/** dfm_obstacle_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_obstacle_def_default_sized(uint32_t size, dfm_obstacle_def *out);
/** The plane z = 0 with normal +z, at rest, category 1, collides with all. Threads: Any thread. Since 0.1. */
static inline dfm_obstacle_def dfm_obstacle_def_default(void) {
  dfm_obstacle_def out;
  dfm_obstacle_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** @return DFM_OK; DFM_E_ARG (which entry, why); DFM_E_NOMEM; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_create(dfm_world world, const dfm_obstacle_def *def, dfm_obstacle *out);
/** Removes the obstacle; its contacts end (events are reported). Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_destroy(dfm_obstacle obstacle);
/** Present pose. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_get_pose(dfm_obstacle obstacle, dfm_pose *out);
/** The def of its creation (name, points and triangles valid while it lives; keys are not returned). Threads:
 * Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_get_def(dfm_obstacle obstacle, dfm_obstacle_def *out);
/** Sets the pose at the end of the next step; the obstacle moves there at constant rate. Replaces keys and
 * sine. A step in which it would move faster than dfm_world_def.obstacle_speed is refused with DFM_E_ARG, and
 * nothing changes: take more steps, or teleport. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_move_to(dfm_obstacle obstacle, const dfm_pose *pose);
/** Sets the pose now, without a motion: nothing is pushed or dragged on the way. Replaces keys, sine and
 * target. Bodies that it then overlaps are found as after creation (dfm_world_overlaps). Contacts that it
 * also has at the new place continue with their impulses and their friction memory, which belong to the
 * body's surface; the others end in the next step. Sleeping bodies wake. Threads: Not during step.
 * Since 0.1. */
DFM_API dfm_status dfm_obstacle_teleport(dfm_obstacle obstacle, const dfm_pose *pose);
/** Changes the velocity of its surface (a belt), in addition to that of its pose. Sleeping bodies wake;
 * contacts keep their state. Cheap enough for each step.
 * @param velocity  [3] m/s, world frame
 * @return DFM_OK; DFM_E_ARG not finite, or too fast; DFM_E_STATE it is a rigid body; DFM_E_HANDLE. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_velocity_surface(dfm_obstacle obstacle, const double velocity[3]);
/** Changes the collision filter of an obstacle, a rigid body or one of its shapes. Contacts of pairs that no
 * longer touch end in the next step; pairs that can touch from now on and overlap are found as after
 * creation. @return DFM_OK; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_filter(dfm_obstacle obstacle, uint32_t category, uint32_t collides_with);
/** Changes the material of an obstacle, a rigid body or one of its shapes: rules of friction by
 * "material=NAME" and the material's entry "friction" apply from now on. If a contact gets another law, or
 * other parameters, its friction memory starts at zero; its impulses continue.
 * @param material  of the same world; 0: none
 * @return DFM_OK; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_obstacle_set_material(dfm_obstacle obstacle, dfm_material material);
/** Finds an obstacle by name; rigid bodies and their shapes are obstacles too (dfm_world_find_rigid finds
 * rigid bodies only). @return DFM_OK; DFM_E_ARG none of that name (nearest one); DFM_E_HANDLE. Threads: Any
 * thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_find_obstacle(dfm_world world, const char *name, dfm_obstacle *out);
#ifdef __cplusplus
}
#endif
#endif
