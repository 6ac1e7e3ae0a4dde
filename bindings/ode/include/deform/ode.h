/* deform/ode.h -- libdeform_ode: soft bodies in a world of the Open Dynamics Engine (double precision, 0.16).
 * doc/concepts/ode.md.
 *
 * An adapter joins a dWorldID and a dSpaceID to a dfm_world. The geoms of the space are what soft bodies
 * touch; bodies feel the same impulses, inside the solve. ODE keeps its joints, motors and rigid contacts;
 * dfm_ode_step steps both. ODE's objects stay the caller's: they may be made, moved, changed and destroyed
 * between two steps, and the next step takes notice. A geom counts as destroyed and made again, so that rules
 * of the dfm_world that name it end, where it is disabled or enabled, where its size, offset or body
 * changes, or the mass of its body. */
#ifndef DEFORM_ODE_H
#define DEFORM_ODE_H
#include <ode/ode.h>

#include "deform/deform.h"
#include "deform/ode_host.h"
#ifdef __cplusplus
extern "C" {
#endif
typedef uint64_t dfm_ode; /* handle of an adapter; zero is null */

enum { DFM_ODE_QUICK = 1 }; /* dWorldQuickStep instead of dWorldStep */

typedef struct dfm_ode_def {
  uint32_t size, flags; /* DFM_ODE_* */
  dWorldID world;
  dSpaceID space; /* with the spaces in it */
  /* makes contact joints in `contacts`; NULL: the default one, by `friction` and `most_contacts` */
  dNearCallback *near_callback;
  void *near_data;
  /* emptied before each collision of the rigid bodies; NULL: the adapter's own */
  dJointGroupID contacts;
  double friction;        /* default callback: coefficient, 0.5 */
  uint32_t most_contacts; /* default callback: per pair of geoms, 1 to 64; 8 */
  /* of the caller's dReal, and its ODE: dfm_ode_def_default() fills them in */
  uint32_t real_bytes;
  const char *version;
} dfm_ode_def;

typedef struct dfm_ode_stats {
  /* rigid bodies and shapes that take part now; geoms left out: ignored, rays, disabled */
  uint32_t size, bodies, shapes, refused;
  /* dfm_ode_step calls; dWorldStep calls; contact solved again, for a joint's reaction or a sleeper;
   * since attach */
  uint64_t steps, ode_steps, corrections;
  /* of the last sub-step, after the corrections: share of a jointed body's change by contact (of 1e-4 m/s at
   * least) that it did not take */
  double residual;
  double residual_max; /* since attach */
  /* since attach: looking for what the caller changed; collision of the rigid bodies and dWorldStep */
  double sync_seconds, ode_seconds;
} dfm_ode_stats;

/** dfm_ode_def_default into a def of any size (base.h). @param real_bytes, version  of the caller's ODE.
 * Threads: Any thread. Since 0.1. */
DFM_API void dfm_ode_def_default_sized(uint32_t real_bytes, const char *version, uint32_t size,
                                       dfm_ode_def *out);
/** World and space NULL, no callback, friction 0.5. Threads: Any thread. Since 0.1. */
static inline dfm_ode_def dfm_ode_def_default(void) {
  dfm_ode_def out;
  dfm_ode_def_default_sized((uint32_t)sizeof(dReal), dODE_VERSION, (uint32_t)sizeof out, &out);
  return out;
}
/** @return DFM_OK; DFM_E_ARG; DFM_E_STATE world or space has an adapter already; DFM_E_UNSUPPORTED this ODE
 * is of single precision or of another version than the one that libdeform_ode was built with; DFM_E_HANDLE;
 * DFM_E_NOMEM. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_attach(dfm_world world, const dfm_ode_def *def, dfm_ode *out);
/** Removes the obstacles of ODE's geoms from the dfm_world; ODE's world does not change. Call it before the
 * dfm_world or the dWorldID is destroyed, at the latest from the destructors of statics. An adapter that is
 * not detached does nothing at the program's end.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_detach(dfm_ode ode);
/** Advances both worlds by dt, in the sub-steps that the soft bodies need. Each sub-step runs ODE's
 * collision, the contact solve, and dWorldStep or dWorldQuickStep with the impulses of that solve. Forces and
 * torques that bodies have at the call act over all of dt.
 * A step that fails leaves all bodies in the state of the dfm_world, at the end of its last good sub-step; if
 * there was none, they keep their forces too.
 * @return as dfm_world_step; DFM_E_UNSUPPORTED a geom of a kind that ODE does not describe (which, what to
 * do). Then nothing has moved
 * Threads: One thread at a time per world. Since 0.1. */
DFM_API dfm_status dfm_ode_step(dfm_ode ode, double dt);
/** DFM_TROUBLE_* bits of the last dfm_ode_step. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_trouble(dfm_ode ode, uint32_t *trouble);
DFM_API dfm_status dfm_ode_get_stats(dfm_ode ode, dfm_ode_stats *out);

/** The obstacle of a geom, for reports, pair rules, rays and filters. @return DFM_OK; DFM_E_ARG the
 * geom is not in the space or takes no part; DFM_E_UNSUPPORTED as dfm_ode_step. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_ode_obstacle(dfm_ode ode, dGeomID geom, dfm_obstacle *out);
/** The rigid body of an ODE body with at least one geom that takes part. Its dfm_rigid_state is in the
 * world's frame, about ODE's center of mass; its rotation is that of the principal axes of dMass.I, which is
 * the body's own where I is diagonal. Joints belong to ODE and are unknown to dfm_rigid_joint.
 * dJointGetFeedback gives their forces in the last sub-step, in the world's frame, moments about each body's
 * center of mass.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_rigid(dfm_ode ode, dBodyID body, dfm_rigid *out);

/** The dfm_world's snapshot, followed by what it does not contain: bodies without geoms that joints connect,
 * and the states of dfm_ode_set_friction. The dfm_world's own snapshot contains the whole state of bodies
 * with geoms, auto-disable included. buffer NULL: *bytes gets the size needed.
 * @return DFM_OK; DFM_E_ARG too small (*bytes: the size); as dfm_ode_step. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_ode_snapshot(dfm_ode ode, void *buffer, size_t *bytes);
/** Restores both worlds, with the same bodies, geoms in the same order, joints and law; the next steps
 * give the same bits. dfm_world_restore alone also restores the bodies with geoms, but the rigid contacts
 * lose their states.
 * @return DFM_OK; DFM_E_FORMAT not of such a scene, or made under another law (nothing changed). Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_ode_restore(dfm_ode ode, const void *buffer, size_t bytes);

/** Friction of the rigid bodies among each other by one of the library's laws, in the default callback and in
 * dfm_ode_contact: the coefficient of a set-valued law follows its curve over the slip; a law with a state
 * keeps it per contact (dfm_ode_snapshot).
 * @param law     as for dfm_law_open; NULL: dfm_ode_def.friction again
 * @param params  NULL: the law's defaults
 * @param area    m2 of one contact, where the law's stiffness is per area
 * @return DFM_OK; as dfm_law_open and dfm_law_pack. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_set_friction(dfm_ode ode, dfm_context *context, const char *law,
                                        const dfm_params *params, double area);
/** For your own near callback: collides two geoms and makes their contact joints, in the group that
 * the adapter was attached with, with the friction of dfm_ode_set_friction. @param made  out, contact
 * joints; may be NULL
 * @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE. Threads: from the near callback, that is: inside
 * dfm_ode_step. Since 0.1. */
DFM_API dfm_status dfm_ode_contact(dfm_ode ode, dGeomID a, dGeomID b, int *made);

/** Properties of a geom that ODE does not have. Setting them creates its obstacle again, so its contacts
 * and the rules that name it end.
 * Geoms without a name are called "obstacleN". They, and the arrays below, go by the address of the geom: set
 * them again for one that was destroyed and made again between two steps. A new geom without a body, of the
 * size and at the address of one that is gone, is taken for that one moved. */
typedef struct dfm_ode_geom {
  uint32_t size, ignore; /* 1: soft bodies do not see it */
  const char *name;      /* NULL: none */
  dfm_material material; /* 0: none */
} dfm_ode_geom;
/** @return DFM_OK; DFM_E_ARG the geom is not in the space. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_set_geom(dfm_ode ode, dGeomID geom, const dfm_ode_geom *props);
/** The arrays of a dConvexClass geom, as dCreateConvex had them (polygons: number of corners, then corners,
 * for each). Copied.
 * @return DFM_OK; DFM_E_ARG. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_set_convex(dfm_ode ode, dGeomID geom, uint32_t npoint, const double *points,
                                      uint32_t npolygon, const uint32_t *polygons);
/** The heights of a dHeightfieldClass geom, m: samples [nz,nx] over width (local x) and depth (local z),
 * local y up, scale and offset included; not wrapped; the geom was created placeable (bPlaceable 1: ODE ends
 * the program where it is asked for another one's place). Copied.
 * @return DFM_OK; DFM_E_ARG. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_ode_set_heights(dfm_ode ode, dGeomID geom, double width, double depth, uint32_t nx,
                                       uint32_t nz, const double *heights);
/** Reads a geom's triangles again, after dGeomTriMeshDataUpdate or a change of its arrays. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_ode_refresh(dfm_ode ode, dGeomID geom);
#ifdef __cplusplus
}
#endif
#endif
