/* deform/plugin_draft.h -- what is planned for plugin.h and has no caller in the library yet: a plugin may
 * offer it, and nothing happens. It may change with every version, and is not part of the ABI that plugin.h
 * freezes. A part moves to plugin.h with its first caller. Conventions as in plugin.h. */
#ifndef DEFORM_PLUGIN_DRAFT_H
#define DEFORM_PLUGIN_DRAFT_H
#include "deform/plugin.h"
#ifdef __cplusplus
extern "C" {
#endif
/* ---- models: cells other than tetrahedra ------------------------------------------------------------- */
enum { DFM_CELL_POINT = 1, DFM_CELL_EDGE = 2, DFM_CELL_TRI = 4, DFM_CELL_HEX = 16 };
/* ---- models: cells that come and go ------------------------------------------------------------------- */
enum { DFM_CAP_TOPOLOGY = 8 /* extension "dfm.topology/1" */ };
/* ---- self-stepping models: state that lives off the host ---------------------------------------------- */
/* Type of dfm_stepper.fetch: copies what lives off the host. [step] */
typedef dfm_status (*dfm_fetch_fn)(void *self, uint32_t what, double *dst);
/* ---- models: springs switched off --------------------------------------------------------------------- */
/* Extension "dfm.spring_mask/1" of a model: springs by edge of the mesh, switched off and on. Like a
 * parameter, the mask is the host's to keep: it is no state. Off gives a spring's energy away; on again may
 * bring some. */
#define DFM_EXT_SPRING_MASK "dfm.spring_mask/1"
typedef struct dfm_spring_mask {
  uint32_t size, reserved;
  /* [setup] all or, on DFM_E_ARG, none */
  dfm_status (*set)(void *self, uint32_t n, const uint32_t *edges, uint8_t on);
  dfm_status (*get)(const void *self, uint8_t *on); /* [any] on[nedge] 1, 0 */
} dfm_spring_mask;
/* ---- linear solver for the implicit system (SPD, 3x3 blocks) ---------------------------------------- */
typedef struct dfm_solver {
  uint32_t size, flags;
  /* [setup] */
  dfm_status (*analyse)(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, void **self);
  /* [step] */
  dfm_status (*factor)(void *self, const double *blk);
  /* [step] */
  dfm_status (*solve)(void *self, const double *rhs, double *x, double tolerance);
  /* [setup] */
  void (*release)(void *self);
} dfm_solver;
enum { DFM_KIND_SOLVER = 3 }; /* dfm_type.kind whose ops is a dfm_solver; the library refuses it as unknown */
#ifdef __cplusplus
}
#endif
#endif
