/* deform/bullet.h -- libdeform_bullet and libdeform_bullet64: soft bodies in a world of Bullet 3.24, of
 * single and of double precision. For C++, as Bullet is. doc/concepts/bullet.md.
 *
 * An adapter joins a btDiscreteDynamicsWorld (or one that derives from it) to a dfm_world. Its collision
 * objects are what soft bodies touch; rigid bodies feel the same impulses, inside the solve. Bullet keeps
 * its constraints, motors and rigid contacts; stepSimulation steps both worlds. Bullet's objects stay the
 * caller's: they may be made, moved, changed and removed between two steps, and the next step takes
 * notice. An object counts as removed and added again, so that rules of the dfm_world that name it end, where
 * its shape, mass, factors or flags change. */
#ifndef DEFORM_BULLET_H
#define DEFORM_BULLET_H
#include <btBulletDynamicsCommon.h>

#include "deform/bullet_host.h"
#include "deform/deform.h"
class btSoftBody;
#ifdef __cplusplus
extern "C" {
#endif
typedef uint64_t dfm_bullet; /* handle of an adapter; zero is null */

typedef struct dfm_bullet_def {
  uint32_t size, flags; /* flags: 0 */
  btDynamicsWorld *world;
  /* of the caller's btScalar, and its Bullet: dfm_bullet_def_default() fills them in */
  uint32_t real_bytes, version;
} dfm_bullet_def;

typedef struct dfm_bullet_stats {
  /* rigid bodies and shapes that take part now; collision objects left out: ignored, empty, without
   * response */
  uint32_t size, bodies, shapes, refused;
  /* ticks of stepSimulation; solves of Bullet's; contact solved again, for a joint's reaction or a sleeper;
   * since attach */
  uint64_t ticks, bullet_steps, corrections;
  /* of the last sub-step, after the corrections: share of a jointed body's change by contact (of 1e-4 m/s at
   * least) that it did not take */
  double residual;
  double residual_max; /* since attach */
  /* since attach: looking for what the caller changed; Bullet's own collision and solves */
  double sync_seconds, bullet_seconds;
} dfm_bullet_stats;

/** dfm_bullet_def_default into a def of any size (base.h). @param real_bytes, version  of the caller's
 * Bullet. Threads: Any thread. Since 0.1. */
DFM_API void dfm_bullet_def_default_sized(uint32_t real_bytes, uint32_t version, uint32_t size,
                                          dfm_bullet_def *out);
/** World NULL. Threads: Any thread. Since 0.1. */
static inline dfm_bullet_def dfm_bullet_def_default(void) {
  dfm_bullet_def out;
  dfm_bullet_def_default_sized((uint32_t)sizeof(btScalar), BT_BULLET_VERSION, (uint32_t)sizeof out, &out);
  return out;
}
/** Takes the place of the world's tick callbacks, set before, and calls them: the first one before a tick,
 * the second one after it, with forces of theirs acting over the whole tick. In the first one, as in Bullet's
 * callbacks within a tick, calls with the adapter are refused (DFM_E_BUSY).
 * @return DFM_OK; DFM_E_ARG; DFM_E_STATE the world has an adapter already; DFM_E_UNSUPPORTED the world is
 * none of rigid bodies (which kind, what to do), the program has another btScalar or Bullet than the library,
 * or both builds of Bullet are loaded; DFM_E_HANDLE; DFM_E_NOMEM. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_attach(dfm_world world, const dfm_bullet_def *def, dfm_bullet *out);
/** What stood for Bullet's objects leaves the dfm_world, and the world has its own tick callbacks back. Call
 * it before either world is destroyed. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_detach(dfm_bullet bullet);
/** stepSimulation(dt, max_sub_steps, fixed), with the status of its ticks. Each tick advances both worlds, in
 * the sub-steps that the soft bodies need. Each sub-step runs Bullet's collision, the contact solve, and
 * Bullet's constraints with the impulses of that solve. A tick that fails leaves all bodies in the state of
 * the dfm_world, at the end of its last good sub-step; later ticks try again.
 * @param ticks  out, what stepSimulation returned; may be NULL
 * @return as dfm_world_step, of the first tick that failed; DFM_E_UNSUPPORTED a shape that soft bodies cannot
 * touch (which, what to do): then the tick has moved nothing
 * Threads: One thread at a time per world. Since 0.1. */
DFM_API dfm_status dfm_bullet_step(dfm_bullet bullet, double dt, int max_sub_steps, double fixed, int *ticks);
/** Status of the last tick, as of dfm_bullet_step, for programs that call stepSimulation themselves; its
 * error is in dfm_last_error(). @param trouble  out, DFM_TROUBLE_* bits; may be NULL. Threads: Any thread.
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_last_tick(dfm_bullet bullet, uint32_t *trouble);
DFM_API dfm_status dfm_bullet_get_stats(dfm_bullet bullet, dfm_bullet_stats *out);

/** The obstacle of a leaf of an object's shape, for reports, pair rules, rays and filters.
 * @param leaf  counted from 0, compounds opened in the order of their children; 0 of any other shape
 * @return DFM_OK; DFM_E_ARG the object is not in the world, takes no part or has fewer leaves;
 * DFM_E_UNSUPPORTED as dfm_bullet_step. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_obstacle(dfm_bullet bullet, const btCollisionObject *object, uint32_t leaf,
                                       dfm_obstacle *out);
/** The rigid body of an object that moves by forces: a btRigidBody, whose dfm_rigid_state is not rounded to
 * btScalar, or a btMultiBodyLinkCollider. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_rigid(dfm_bullet bullet, const btCollisionObject *body, dfm_rigid *out);

/** Properties of an object that Bullet does not have. Setting them creates its obstacles again, so their
 * contacts and the rules that name them end. Objects without a name are called "obstacleN". */
typedef struct dfm_bullet_object {
  uint32_t size, ignore; /* 1: soft bodies do not see it */
  const char *name;      /* NULL: none; leaves after the first: name.1, name.2 */
  dfm_material material; /* 0: none */
} dfm_bullet_object;
/** @return DFM_OK; DFM_E_ARG the object is not in the world. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_set_object(dfm_bullet bullet, const btCollisionObject *object,
                                         const dfm_bullet_object *props);
/** Reads an object's shape again, after a change of its arrays that leaves their sizes as they are
 * (refitTree, heights, corners of a hull). Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_refresh(dfm_bullet bullet, const btCollisionObject *object);

/** Surfaces of the soft bodies, and lines of dfm_debug_draw (what: DFM_DRAW_*, may be 0), by the world's own
 * drawer. Call it beside debugDrawWorld. @return DFM_OK; DFM_E_STATE the world has no drawer. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_debug_draw(dfm_bullet bullet, uint32_t what);

/** Creates a body of the dfm_world from one of Bullet's soft bodies, which does not change. The present
 * positions of its nodes are the rest shape; the body moves at their mean velocity. Cells are its tetrahedra;
 * without any, its faces, which must close, are filled with about `cells` cells (dfm_mesh_fill). Nodes of
 * infinite mass are held. Stiffness and mass are those of `like`'s material, because Bullet's coefficients
 * have no units. (dfm_mesh_load reads a .vtk file of Bullet's.)
 * @param like  name, material, model, filter and so on; mesh, pose and velocity are not looked at
 * @return DFM_OK; DFM_E_ARG neither tetrahedra nor faces; as dfm_mesh_create, dfm_mesh_fill,
 * dfm_body_create. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_bullet_take_soft_body(dfm_context *context, dfm_world world, const btSoftBody *body,
                                             const dfm_body_def *like, uint32_t cells, dfm_body *out);
#ifdef __cplusplus
}
#endif
#endif
