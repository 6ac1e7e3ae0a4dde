/* deform/body.h -- deformable bodies: creation, state, loads, held points, measures. */
#ifndef DEFORM_BODY_H
#define DEFORM_BODY_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Coupling of a separate surface to the body's points: x_s = N x_p, rows of N sum to one; forces are
 * distributed by the transpose. BARYCENTRIC: in the cell that contains the surfel, or the nearest one. MLS:
 * moving least squares over the points within the support. Both reproduce linear fields. THESIS: Zerbato
 * (2010), equation 3.9 as printed, for comparison: torque and power are wrong (doc/concepts/couplings.md). */
enum { DFM_COUPLING_BARYCENTRIC = 0, DFM_COUPLING_MLS = 1, DFM_COUPLING_THESIS = 2 };
typedef struct dfm_surface_def {
  uint32_t size;
  int32_t coupling;
  uint32_t npoint, ntriangle;
  const double *points;      /* [npoint,3] at rest, in the frame of the body's points; copied */
  const uint32_t *triangles; /* [ntriangle,3] counter-clockwise from outside; copied */
  /* MLS, THESIS: support radius in mean distances to the ten nearest points; 0: 3 */
  double support;
} dfm_surface_def;

/** Groups of a body's surface triangles, for friction by "body:GROUP". With `triangles`: some of the
 * surface's triangles by their points (those of the body, or of its separate surface), in any order and
 * orientation; triangles inside the body are ignored, and a triangle named twice keeps its first group.
 * Without `triangles`: one entry per triangle, in the order of dfm_surface_triangles. Since 0.1. */
typedef struct dfm_surface_groups {
  uint32_t size, ngroup;
  const char *const *names; /* [ngroup] */
  uint32_t ntriangle, reserved;
  const uint32_t *triangles; /* [ntriangle,3], or NULL */
  const uint32_t *group;     /* [ntriangle] index into names; UINT32_MAX: none */
} dfm_surface_groups;

/* [ntet,width] */
typedef struct dfm_cell_field {
  const char *key;
  const double *values;
  uint32_t width;
} dfm_cell_field;

typedef struct dfm_body_def {
  uint32_t size, flags;
  const char *name; /* unique in the world; NULL: "body<N>" */
  uint32_t npoint, ntet;
  const double *points;  /* [npoint,3] rest positions before pose, m; copied */
  const uint32_t *tets;  /* [ntet,4] positive volume; copied */
  dfm_material material; /* 0: dfm_material_def_default() */
  const char *model;     /* short name or full id; NULL: msm, or corotational_fem for cells msm refuses */
  /* of the model; a further key "precision": its forces in explicit steps, 0 double, 1 single */
  dfm_params model_params;
  dfm_pose pose;
  double velocity[3], spin[3]; /* m/s of the center of mass; rad/s about it */
  const uint8_t *fixed;        /* [npoint] held components, bits 1 x, 2 y, 4 z; NULL: none */
  /* collision filter: a pair touches if (a.category & b.collides_with) and (b.category & a.collides_with) */
  uint32_t category, collides_with;
  void *user;
  const dfm_surface_def *surface; /* NULL: the boundary of the cells, each surfel a point of the body */
  uint32_t nfield;
  /* model parameters that differ by cell ("young", "anisotropy_axis"); they override materials; copied */
  const dfm_cell_field *fields;
  const dfm_material *cell_materials; /* [ntet] material of each cell, 0: `material`; NULL: one for all */
  /* [ntet] fraction of the cell that is material, (0,1]: scales its mass and Young's modulus; NULL: 1 */
  const double *cell_share;
  const dfm_surface_groups *groups; /* named parts of its surface; NULL: none. Copied */
  int32_t integrator;               /* DFM_INTEGRATOR_* of this body; AUTO: the world's */
  uint32_t reserved;
  uint64_t cookie; /* set by the default function */
  /* Share of its mass, at most 0.1, that may be moved to the points that bound its explicit sub-steps:
   * slivers and light points. Mass, center and moments of inertia at rest stay exact; dfm_body_info has what
   * was moved and what it changes (doc/concepts/step.md). Such a body cannot be cut. 0: none. */
  double mass_scaling;
  /* Cells that are not first-order tetrahedra, as dfm_mesh_info gives them: kind, DFM_CELL_* of plugin.h,
   * and nodes, copied. tets and ntet are then those of the same mesh, and all [ntet] arrays go by these: of a
   * cell the values of its first tetrahedron count. NULL: the cells are the tetrahedra. */
  const uint32_t *cells;
  uint32_t cell, reserved2;
  /* Hexahedra that are only in part material, or whose material reaches beyond them, as dfm_mesh_info.inside
   * gives them: [ncell,27], copied. NULL: whole cells. */
  const double *cell_inside;
  /* Degrees: the surface means to be smooth across edges where its normals differ by at most this. There it
   * touches planes, spheres, boxes and capsules as a curved one (doc/concepts/detection.md). 0: all faces are
   * flat. */
  double smooth;
} dfm_body_def;

/** dfm_body_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_body_def_default_sized(uint32_t size, dfm_body_def *out);
/** No mesh, no named model, category 1, collides with all. Threads: Any thread. Since 0.1. */
static inline dfm_body_def dfm_body_def_default(void) {
  dfm_body_def out;
  dfm_body_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** @return DFM_OK; DFM_E_ARG (which entry, why); DFM_E_UNSUPPORTED no plugin offers the model (lists the
 * loaded models); DFM_E_NOMEM; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_create(dfm_world world, const dfm_body_def *def, dfm_body *out);
/** Removes the body, also from a running world between two steps; its contacts end (events are reported).
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_destroy(dfm_body body);

typedef struct dfm_body_info {
  uint32_t size, npoint, ntet, nsurfel, ntriangle, nedge;
  dfm_world world;
  const char *name, *model; /* valid while the body lives */
  double mass, rest_volume; /* kg, m3 */
  void *user;
  /* shares, by dfm_body_def.mass_scaling: of the mass, what was moved; of a frequency, what a mode whose
   * displacement is quadratic in the place (bending, torsion) may change by. */
  double mass_moved, frequency_change;
} dfm_body_info;
/** Sizes, names and mass of a body. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_get_info(dfm_body body, dfm_body_info *out);
/** Changes the user pointer of dfm_body_def. @return DFM_OK; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_set_user(dfm_body body, void *user);
/** Changes the collision filter of dfm_body_def. @return DFM_OK; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_set_filter(dfm_body body, uint32_t category, uint32_t collides_with);

/** Positions and velocities of all phyxels, [npoint,3] each, m and m/s; either may be NULL.
 * @param capacity of x and v in phyxels; 0 with both NULL only counts. @return DFM_OK; DFM_E_ARG capacity too
 * small (untouched, *n set); DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_get_state(dfm_body body, uint32_t capacity, double *x, double *v, uint32_t *n);
/** Sets positions and velocities, [n,3] each, m and m/s; either may be NULL. Held components do not change.
 * @param n number of phyxels
 * @return DFM_OK; DFM_E_ARG n is another number, or a value is not finite (nothing changed); DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_state(dfm_body body, uint32_t n, const double *x, const double *v);
/** Rest positions, [npoint,3], m, pose not applied; cells [ntet,4], phyxel numbers. Either may be NULL.
 * @return DFM_OK; DFM_E_ARG a capacity too small (untouched); DFM_E_HANDLE. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_get_rest(dfm_body body, uint32_t capacity_points, double *x,
                                     uint32_t capacity_tets, uint32_t *tets);

/** Holds (bits 1 x, 2 y, 4 z) or releases (0) components of points. A released point loses its motion
 * (dfm_body_move_held); a point that stays held keeps it.
 * @return DFM_OK; DFM_E_ARG axes or a point does not exist; DFM_E_UNSUPPORTED the model steps itself and
 * takes held points at creation only (dfm_body_def.fixed); DFM_E_HANDLE. Threads: Not during step.
 * Since 0.1. */
DFM_API dfm_status dfm_body_hold(dfm_body body, uint32_t n, const uint32_t *points, uint8_t axes);
/** Moves held points together: their start positions are moved by the keys' pose (relative to key 0), then
 * offset by the sine. A point has one motion: a new one replaces the old one, so that calling this in every
 * frame takes no more memory than calling it once.
 * @param keys  [nkey], times strictly rising; nkey may be 0 when sine is given; copied
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_move_held(dfm_body body, uint32_t n, const uint32_t *points, uint32_t nkey,
                                      const dfm_pose_key *keys, const dfm_sine *sine);
/** Adds a lasting load: force[i] N on points[i], times the keyed scale (nkey 0: 1), times (1 + sine) if sine
 * is given (only its amplitude[0] is used). @param load out, its number; may be NULL. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_body_add_load(dfm_body body, uint32_t n, const uint32_t *points, const double *force,
                                     uint32_t nkey, const dfm_scale_key *keys, const dfm_sine *sine,
                                     uint32_t *load);
/** Removes a load by its number. @return DFM_OK; DFM_E_ARG no such load; DFM_E_HANDLE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_remove_load(dfm_body body, uint32_t load);

/** A spring of rest length zero from a point of the body to a place in the world, F = stiffness (to - x) +
 * damping (v_to - v), where x = sum weights[i] x[points[i]]; each point takes its weight's share of F.
 * The spring is explicit: it limits the stable step of the body. */
typedef struct dfm_spring_def {
  uint32_t size, npoint;
  const uint32_t *points; /* [npoint] */
  /* [npoint] >= 0, scaled to sum 1; NULL: by mass, so that F acts at the center of mass of these points */
  const double *weights;
  double to[3];               /* m; used if nkey is 0 */
  const dfm_vector_key *keys; /* [nkey] m, times strictly rising: its end over time; copied */
  uint32_t nkey, reserved;
  double stiffness, damping; /* N/m, N s/m; >= 0 */
} dfm_spring_def;
/** Adds a spring. @param spring out, its number; may be NULL. @return DFM_E_ARG a point does not exist, the
 * weights sum to zero, a value is negative or not finite; DFM_E_UNSUPPORTED the model steps itself and has no
 * step bound. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_add_spring(dfm_body body, const dfm_spring_def *def, uint32_t *spring);
/** Moves the end of a spring; its keys, if any, are removed. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_set_spring_target(dfm_body body, uint32_t spring, const double to[3]);
/** The present force of a spring on the body, N. @param force out [3]. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_get_spring_force(dfm_body body, uint32_t spring, double force[3]);
/** Removes a spring by its number. @return DFM_OK; DFM_E_ARG no such spring; DFM_E_HANDLE. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_body_remove_spring(dfm_body body, uint32_t spring);
/** Applies an impulse (N s) at a point in space, distributed to the nearest surface triangle by barycentric
 * weights.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_apply_impulse(dfm_body body, const double point[3], const double impulse[3]);
/** Changes runtime parameters of the body's model by key. @return DFM_E_ARG unknown key (nearest valid name),
 * out of range, not changeable at run time, or a parameter that differs by cell in this body (from fields,
 * materials or share), which one value cannot replace.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_params(dfm_body body, const dfm_params *params);

/** Wakes the body and all bodies that it touches, directly or through others. For a body that is awake, the
 * time at rest starts again from zero. A body that is changed or reached wakes without this call. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_wake(dfm_body body);
/** Whether the body sleeps (dfm_world_def.sleep). @param asleep out. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_is_asleep(dfm_body body, bool *asleep);

/** Sums over the body, in SI units. A difference of contact_impulse over its interval is a mean force. */
typedef struct dfm_body_measure {
  uint32_t size, inverted;
  double mass, com[3], velocity[3];      /* kg; m, m/s of the center of mass */
  double momentum[3], angular[3];        /* kg m/s; kg m2/s about the center of mass */
  double kinetic, elastic;               /* J; elastic NAN if the model has no energy */
  double volume, rest_volume, speed_max; /* m3 of the cells, signed; m/s of the fastest phyxel */
  double contact_impulse[3];             /* N s, sum of contact impulses since creation */
} dfm_body_measure;
/** @return DFM_OK; DFM_E_HANDLE; DFM_E_ARG. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_get_measure(dfm_body body, dfm_body_measure *out);
/** Strain energy density of each cell, J/m3, [ntet]. @param capacity of out in cells
 * @return DFM_OK; DFM_E_UNSUPPORTED the model does not provide it; DFM_E_ARG capacity too small;
 * DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_energy_density(dfm_body body, uint32_t capacity, double *out);
/** Cauchy stress of each cell, Pa, [ntet,6] as xx yy zz xy yz zx in the axes of the world, tension > 0;
 * without dampers. @param capacity of out in cells
 * @return DFM_OK; DFM_E_UNSUPPORTED the model does not provide it; DFM_E_ARG capacity too small;
 * DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_stress(dfm_body body, uint32_t capacity, double *out);
/** The same at the phyxels, [npoint,6]: of quadratics in the rest positions that fit the cells around
 * each; smoothed across materials. Takes memory: for pictures, not steps. @param capacity of out in phyxels
 * @return as dfm_body_stress(); DFM_E_NOMEM. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_point_stress(dfm_body body, uint32_t capacity, double *out);
#ifdef __cplusplus
}
#endif
#endif
