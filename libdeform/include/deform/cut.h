/* deform/cut.h -- cells removed from a body, and its faces opened, between two steps. */
#ifndef DEFORM_CUT_H
#define DEFORM_CUT_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#ifdef __cplusplus
extern "C" {
#endif
/** dfm_cut_def.shape. ELLIPSOID (a sphere where its semi-axes are equal) and BOX are at `pose` and are
 * swept along `motion`. BLADE is a quadrilateral: an edge, and the place to which it has moved. PLANE goes
 * through the whole body. */
enum { DFM_CUT_ELLIPSOID = 0, DFM_CUT_BOX = 1, DFM_CUT_BLADE = 2, DFM_CUT_PLANE = 3 };
/** dfm_cut_def.how. REMOVE: the cells that the shape meets go, with their mass. SPLIT, of a blade or
 * plane: faces between cells open where the middles of the two lie on both sides of it, and points are split
 * where the cells around them hang together no more; no cell is divided, and no mass is lost. */
enum { DFM_CUT_REMOVE = 0, DFM_CUT_SPLIT = 1 };
typedef struct dfm_cut_def {
  uint32_t size, flags; /* flags: 0 */
  uint32_t shape, how;  /* DFM_CUT_* */
  dfm_pose pose;        /* of ellipsoid and box, before the motion */
  double half_size[3];  /* m: semi-axes, or half the edges of the box; along the axes of the pose */
  double motion[3];     /* m, in the world: straight way of the ellipsoid or box */
  /* [4,3] m, in the world: edge from 0 to 1, which has come to 3 and 2. PLANE: [0] a point of it, [1] its
   * normal, of any length above 0 */
  double blade[12];
  /* REMOVE: cells that may go, those of the lowest numbers; SPLIT: faces that may open, in the order in which
   * the blade meets them; 0: all that are met */
  uint32_t most;
  uint32_t reserved;
  uint64_t cookie; /* set by the default function */
} dfm_cut_def;
/** dfm_cut_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_cut_def_default_sized(uint32_t size, dfm_cut_def *out);
/** REMOVE by an ellipsoid without a size or a motion, at the origin. Threads: Any thread. Since 0.1. */
static inline dfm_cut_def dfm_cut_def_default(void) {
  dfm_cut_def out;
  dfm_cut_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** What a cut has done. */
typedef struct dfm_cut_info {
  uint32_t size, cells; /* cells that have gone */
  uint32_t left;        /* cells, of DFM_CUT_SPLIT faces, that the shape meets and that `most` has left */
  uint32_t points;      /* copies of points that have been made */
  uint32_t parts;       /* that the body consists of now, cells that share a point hanging together */
  uint32_t reserved;
  double area;              /* m2 of triangles that have come to the surface, both sides, at rest */
  double mass, momentum[3]; /* kg and N s that have gone with cells */
  double kinetic, elastic;  /* J, before less after; elastic NAN where the model gives no energy */
  uint32_t pieces;          /* bodies that have come off it (dfm_body_set_separate) */
  uint32_t reserved2;
  /* for faces of a material with "fracture_energy": the energy that opens them, J, and the force on the
   * blade, opposite to its motion, that does this work, N; 0 of a plane */
  double fracture, force[3];
} dfm_cut_info;
/** Cuts a body. Points that stay keep their positions and velocities to the bit, and that part of their mass
 * which the remaining cells give. The model keeps its state. Contacts of surface features that are left keep
 * their impulses and the state of their friction; contacts of others end, with an event. Loads, springs, held
 * points and attachments follow their points. Points, cells, surfels and triangles get new numbers
 * (dfm_body_origins).
 * A body that has been cut touches itself unless a filter forbids it. A body without cells takes no part in
 * steps: only dfm_body_get_info and dfm_body_destroy work, other calls give DFM_E_STATE. A snapshot from
 * before the cut undoes it.
 * @param out  may be NULL; set its size, or 0
 * @return DFM_OK, also where the shape meets nothing; DFM_E_ARG a size, a corner or `how`; DFM_E_UNSUPPORTED
 * the model needs all of its cells (each but msm and corotational_fem), or the body has a surface of its own;
 * DFM_E_NOMEM. After an error nothing has changed.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_cut(dfm_body body, const dfm_cut_def *def, dfm_cut_info *out);
/** Plans a cut as dfm_body_cut makes it, at the end of the first step that ends at t or later. It cuts pieces
 * that have come off the body by then, too. Cuts of one time are made in the order of the calls. An event
 * DFM_EVENT_CUT reports each that has met cells (deform/contact.h), a warning in the log one that has met
 * none. Snapshots hold the cuts to come. Until the last one is made, the model of the body changes only to
 * one that can be cut.
 * @param t    s, finite, not before the time of the world
 * @param def  copied; NULL: no cut of the body and of its pieces is to come any more
 * @return as dfm_body_cut; DFM_E_ARG also t. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_plan_cut(dfm_body body, double t, const dfm_cut_def *def);
/** Removes cells by their numbers, as dfm_body_cut does. @param n number of entries; a cell may be named
 * twice. @param cells [n] @return as dfm_body_cut; DFM_E_ARG a cell does not exist.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_remove_cells(dfm_body body, uint32_t n, const uint32_t *cells, dfm_cut_info *out);
/** Where the points and cells of a body come from: their numbers when the body was made. Copies of a point
 * have its number. Either may be NULL. @param points [npoint] @param cells [ntet] @return DFM_OK; DFM_E_ARG a
 * capacity too small (untouched); DFM_E_HANDLE; DFM_E_STATE.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_origins(dfm_body body, uint32_t capacity_points, uint32_t *points,
                                    uint32_t capacity_cells, uint32_t *cells);
/** dfm_separate_def.crumbs, for parts of fewer than least_cells. STAY: each remains with the part next to
 * it, in its piece or in the body. REMOVE: they go, with their mass. Since 0.1. */
enum { DFM_CRUMBS_STAY = 0, DFM_CRUMBS_REMOVE = 1 };
/** How parts of a body that are no longer connected become bodies of their own. Since 0.1. */
typedef struct dfm_separate_def {
  uint32_t size, flags; /* flags: 0 */
  uint32_t least_cells; /* a part of fewer cells does not become a body; 1: each does */
  uint32_t crumbs;      /* DFM_CRUMBS_* */
  uint64_t cookie;      /* set by the default function */
} dfm_separate_def;
/** dfm_separate_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_separate_def_default_sized(uint32_t size, dfm_separate_def *out);
/** Each part becomes a body. Threads: Any thread. Since 0.1. */
static inline dfm_separate_def dfm_separate_def_default(void) {
  dfm_separate_def out;
  dfm_separate_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Makes each part of a body but the heaviest a body of its own, a piece: cells that share a point are one
 * part. The body keeps its handle and the heaviest part. A piece is named after the body that the host made,
 * "block.1", "block.2" and so on, and takes over from the body: positions and velocities to the bit, the
 * state of its model, materials, surface groups, contacts with their impulses and the state of their
 * friction, loads, springs, held points and attachments on its points under their numbers, filter, user
 * pointer and this setting. Rules of friction and contact that name the body hold for its pieces too. Mass
 * and both momenta are kept. dfm_world_events has DFM_EVENT_PIECE for each; dfm_body_pieces lists them.
 * A snapshot from before takes the pieces back: calls with their handles then give DFM_E_STATE. Where a
 * piece of the same body and name comes again, by a later snapshot or as the run is repeated, it has its
 * handle again.
 * @param def  NULL: the default
 * @param out  may be NULL; set its size, or 0. pieces, parts, and of parts that were removed cells, mass,
 * momentum
 * @return DFM_OK, also where there is one part only; DFM_E_ARG `crumbs`; DFM_E_UNSUPPORTED as dfm_body_cut;
 * DFM_E_STATE; DFM_E_NOMEM. After an error nothing has changed. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_separate(dfm_body body, const dfm_separate_def *def, dfm_cut_info *out);
/** From now on each cut and each tear of the body (deform/material.h) is followed by a separation. If there
 * is no memory for the pieces, the cut is made and reported, the parts stay in the body with a warning in the
 * log, and each of the next steps tries again. Snapshots hold this setting, and whether parts wait.
 * @param def  copied; NULL: parts stay in one body, which is the default
 * @return DFM_OK; DFM_E_ARG; DFM_E_UNSUPPORTED the body cannot be cut; DFM_E_STATE. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_body_set_separate(dfm_body body, const dfm_separate_def *def);
/** How long after a tool has passed through a face of the body (dfm_tool_set_cuts with DFM_CUT_SPLIT) the
 * face opens. Meanwhile a thread of low priority builds the new body beside the steps, so that no step takes
 * the time of a cut. A step that finds the thread late builds it itself; the result is the same to the bit.
 * Faces that a tool passes through while others wait open `delay` after these. DFM_EVENT_CUT is reported when
 * faces open; at points inside the body the tool does the work of cutting after that. dfm_body_cut, tears and
 * tools that remove cells have no delay.
 * @param delay  s; 0: no thread, and faces open in the step in which a tool passes through, which is the
 * default. Rounded to the nearest step
 * @return DFM_OK; DFM_E_ARG; DFM_E_UNSUPPORTED the body cannot be cut; DFM_E_STATE faces wait, the body has
 * no cells, or it is a piece (set the delay of the body that it came off). Threads: Not during step. Since
 * 0.1. */
DFM_API dfm_status dfm_body_set_cut_delay(dfm_body body, double delay);
/** @param delay  s, may be NULL @param waiting  faces that wait now, may be NULL @return DFM_OK;
 * DFM_E_HANDLE; DFM_E_STATE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_cut_delay(dfm_body body, double *delay, uint32_t *waiting);
/** The pieces that have come off a body since the host made it, and that are there, in order of creation.
 * A piece has those of the body that it came off.
 * @param pieces  [capacity], or NULL with capacity 0, which only counts
 * @return DFM_OK; DFM_E_ARG capacity too small (untouched, *n set); DFM_E_HANDLE. Threads: Any thread. Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_body_pieces(dfm_body body, uint32_t capacity, dfm_body *pieces, uint32_t *n);
#ifdef __cplusplus
}
#endif
#endif
