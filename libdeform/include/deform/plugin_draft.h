/* deform/plugin_draft.h -- extensions that are not part of the ABI that plugin.h freezes: the library uses
 * some of them if a plugin offers them, and each may change with every version. plugin.h uses none of these
 * bits and names for anything else. Conventions as in plugin.h. */
#ifndef DEFORM_PLUGIN_DRAFT_H
#define DEFORM_PLUGIN_DRAFT_H
#include "deform/plugin.h"
#ifdef __cplusplus
extern "C" {
#endif
/* ---- models: cells without volume -------------------------------------------------------------------- */
enum { DFM_CELL_POINT = 1, DFM_CELL_EDGE = 2, DFM_CELL_TRI = 4 };
/* ---- models: cells that go, points that are split ------------------------------------------------------ */
/* Extension "dfm.topology/1" of a model: an instance depends on the cells of the body one by one, so an
 * instance that create() makes from a part of the cells can continue from the state of this one. A host cuts
 * the body by creating that instance beside this one and copying the state, slot by slot: of points, cells
 * and edges by these maps; a new edge has the state of state_init(); a slot by instance is copied. Both
 * instances exist until one of them is destroyed. It stays a draft until a model of another author has
 * it. */
#define DFM_EXT_TOPOLOGY "dfm.topology/1"
typedef struct dfm_topology_maps {
  uint32_t size, npoint, ncell, nedge; /* of the mesh now */
  /* [npoint], [ncell], [nedge] numbers in the mesh before; several points may have one; UINT32_MAX: an edge
   * that was none */
  const uint32_t *point, *cell, *edge;
} dfm_topology_maps;
typedef struct dfm_topology {
  uint32_t size, reserved;
  /* [setup] (optional) after the state was taken over, before the next step: what does not follow by slot.
   * state: of `now`, slots end to end. Not DFM_OK: the cut does not take place. */
  dfm_status (*carry)(const void *before, void *now, const dfm_topology_maps *maps, double *state);
} dfm_topology;
/* ---- self-stepping models: state that lives off the host ---------------------------------------------- */
/* Type of dfm_stepper.fetch: copies what lives off the host. [step] */
typedef dfm_status (*dfm_fetch_fn)(void *self, uint32_t what, double *dst);
/* ---- self-stepping models: dampers that see velocities with a lag ------------------------------------- */
/* Extension "dfm.seen_velocity/1" of a model: slot number `slot` of its state, a vector by point, follows the
 * velocities of the points. A host that sets velocities writes them there, too. It stays a draft until a
 * model of another author has it. */
#define DFM_EXT_SEEN_VELOCITY "dfm.seen_velocity/1"
typedef struct dfm_seen_velocity { uint32_t size, slot; } dfm_seen_velocity;
/* ---- models: forces in single precision ------------------------------------------------------------- */
/* Extension "dfm.f32/1" of a model: the forces of add_forces once more, computed in single precision inside
 * the model. Positions, velocities, forces and state stay binary64 here; bound, energy and stiffness have one
 * precision. The library asks for it where a body's parameters hold "precision" 1. It stays a draft until a
 * second model has it. */
#define DFM_EXT_F32 "dfm.f32/1"
typedef struct dfm_f32 {
  uint32_t size, reserved;
  /* [setup] once, before add_forces of this table; takes the memory for it. DFM_E_UNSUPPORTED, after the
   * reason was logged: the instance's parameters or its mesh have no such forces. From then on set_params
   * keeps both alike, and refuses what would take these forces away. */
  dfm_status (*prepare)(void *self);
  /* [step] f[npoint,stride] += N. Forces between points sum to zero up to the rounding of binary64; a force
   * is that of dfm_model.add_forces up to a small number of units in the 24th bit of what the model adds up;
   * the same bits for the same k. Writes k->state_out as dfm_model.add_forces does. */
  dfm_status (*add_forces)(void *self, const dfm_kin *k, double *f);
} dfm_f32;
/* ---- models: forces part by part ---------------------------------------------------------------------- */
/* Extension "dfm.part_forces/1" of a model: the forces of add_forces once more, not added to an array of all
 * points but given away part by part, each as soon as it is complete, so that the host moves the points of a
 * part while they are in the cache. Each point is in one part; parts do not change while the instance lives.
 * It stays a draft until a second model has it. */
#define DFM_EXT_PART_FORCES "dfm.part_forces/1"
/* n points of part number `part` and what add_forces would add to them, f[n,4] N, the fourth zero. The
 * instance calls it once for each part, on any of its workers, several at once. */
typedef void (*dfm_take_part_fn)(void *user, uint32_t part, uint32_t n, const uint32_t *point,
                                 const double *f);
typedef struct dfm_part_forces {
  uint32_t size, reserved;
  uint32_t (*parts)(const void *self); /* [setup] how many there are */
  /* [step] Reads k, and writes k->state_out, as dfm_model.add_forces does; the host may write neither of them
   * until it returns. single: 1 for the forces of dfm_f32.add_forces, else 0 */
  dfm_status (*forces)(void *self, const dfm_kin *k, uint32_t single, dfm_take_part_fn take, void *user);
} dfm_part_forces;
/* ---- services of a host: a direct solver --------------------------------------------------------------- */
/* Service "dfm.direct/1" of a host, asked for by dfm_host.extension: the host's own direct solver of
 * symmetric positive definite matrices of 3x3 blocks, for a model whose body is made with a factor. NULL:
 * the host has none. It stays a draft until a second model asks for it. */
#define DFM_HOST_DIRECT "dfm.direct/1"
typedef struct dfm_direct {
  uint32_t size, reserved;
  /* every function, DFM_SOLVER_DIRECT; memory and threads are those of the host that is given, which outlives
   * what is made. One call at a time for each self. */
  const dfm_solver *solver;
  /* [setup] as solver->analyse, for points that lie at places[n,3] m in space: an order that keeps the factor
   * of a solid body small */
  dfm_status (*analyse)(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, const double *places,
                        void **self);
  /* [setup] after a factor() that gave DFM_OK: w[3 nsel,3 nsel] = the rows and columns of the inverse at the
   * points sel[nsel], each named once; row-major, symmetric to the bit. Takes much less time than a solve for
   * each column; while it works, memory for half of w and a part of the factor per column. */
  dfm_status (*inverse_at)(void *self, uint32_t nsel, const uint32_t *sel, double *w);
} dfm_direct;
/* ---- models: springs switched off --------------------------------------------------------------------- */
/* Extension "dfm.spring_mask/1" of a model: springs by edge of the mesh, switched off and on. The host keeps
 * the mask, as it keeps parameters: it is no state. Switching a spring off removes its energy; switching it
 * on may add energy. */
#define DFM_EXT_SPRING_MASK "dfm.spring_mask/1"
typedef struct dfm_spring_mask {
  uint32_t size, reserved;
  /* [setup] all or, on DFM_E_ARG, none */
  dfm_status (*set)(void *self, uint32_t n, const uint32_t *edges, uint8_t on);
  dfm_status (*get)(const void *self, uint8_t *on); /* [any] on[nedge] 1, 0 */
} dfm_spring_mask;
#ifdef __cplusplus
}
#endif
#endif
