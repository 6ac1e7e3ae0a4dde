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
/* ---- models: claims by instance ----------------------------------------------------------------------- */
/* Extension "dfm.caps/1" of a model: those of dfm_model.caps that hold with the instance's present
 * parameters, where some choice of them takes one away. Asked by `deform plugin check`. */
#define DFM_EXT_CAPS "dfm.caps/1"
typedef struct dfm_caps {
  uint32_t size, reserved;
  uint32_t (*active)(const void *self); /* [setup] DFM_CAP_*, until the next call of set_params */
} dfm_caps;
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
/* ---- models: what explains a body to its user ---------------------------------------------------------- */
/* Extension "dfm.effect_rows/1" of a model: the parameters that switch its effects off. An effect without a
 * row is the model's own, or the body's. Told, and switched to measure costs, by `deform explain`; no step
 * asks. */
#define DFM_EXT_EFFECT_ROWS "dfm.effect_rows/1"
typedef struct dfm_effect_row {
  const char *effect;       /* one of dfm_type.effects */
  uint32_t param, reserved; /* row of dfm_type.params, one wide */
  double off;               /* the effect is off where each of its rows has this value */
} dfm_effect_row;
typedef struct dfm_effect_rows {
  uint32_t size, row_size, n, reserved;
  const dfm_effect_row *rows; /* [n] rows of row_size bytes; constant */
} dfm_effect_rows;
/* Extension "dfm.facts/1" of a model: numbers that the instance found when it was made and that its user
 * should know. Told by `deform explain` and the summary of a run. */
#define DFM_EXT_FACTS "dfm.facts/1"
typedef struct dfm_fact {
  const char *key, *label, *unit; /* "modes", "modes that the body has", "1" */
  double value;
} dfm_fact;
typedef struct dfm_facts {
  uint32_t size, row_size;
  /* [setup] *n rows of row_size bytes; valid until the next call of set_params */
  const dfm_fact *(*list)(const void *self, uint32_t *n);
} dfm_facts;
#ifdef __cplusplus
}
#endif
#endif
