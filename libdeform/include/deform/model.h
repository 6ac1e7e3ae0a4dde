/* deform/model.h -- change of a body's model while it runs (doc/concepts/changing_models.md). */
#ifndef DEFORM_MODEL_H
#define DEFORM_MODEL_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Changes the model of a body between two steps, or creates the same model again. Positions and velocities
 * are kept, and with them surface, momentum, angular momentum, kinetic energy and contacts. The state of the
 * old model (plastic strain, relaxing stresses) is lost. The elastic energy jumps; dfm_world_swaps reports by
 * how much. Parameters that are not given follow from the body's materials and fields; parameters given for
 * the old model are not taken over, even if the type is the same. A sleeping body wakes.
 * @param type    short name or full id of a loaded model
 * @param params  of the model; NULL: none. Two further keys: "precision" (see dfm_body_def) and "max_jump",
 * J: the change is refused if the elastic energy would change by more; the energy that changes may add in sum
 * is then at least max_jump
 * @return DFM_OK; DFM_DISCARD the energy would jump by more than max_jump, changes would add too much energy,
 * or the surface would jump by more than 1e-6 of the size; DFM_E_UNSUPPORTED no such model is loaded (lists
 * the loaded ones), or it cannot be used for this body (it has no stiffness for an implicit step, or it steps
 * itself and the body has springs); DFM_E_ARG a parameter, or an effect that the scene lists and only the
 * old model provides; DFM_E_NOMEM; DFM_E_HANDLE; DFM_E_BUSY from inside a step. On failure nothing has
 * changed. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_model(dfm_body body, const char *type, const dfm_params *params);

/** A scheduled change of model. */
typedef struct dfm_switch {
  uint32_t size;      /* dfm_switch_default sets it */
  int32_t integrator; /* DFM_INTEGRATOR_* after the change; AUTO: unchanged */
  double t;           /* s; the first step that begins at t or later makes it (to 1e-6 of the step) */
  const char *type;   /* short name or full id */
  dfm_params params;  /* copied */
  double max_jump;    /* J, as in dfm_body_set_model; 0: any jump */
  uint64_t cookie;    /* set by the default function */
} dfm_switch;
/** dfm_switch_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_switch_default_sized(uint32_t size, dfm_switch *out);
/** t = 0, no model, any jump, the integrator unchanged. Threads: Any thread.
 * Since 0.1. */
static inline dfm_switch dfm_switch_default(void) {
  dfm_switch out;
  dfm_switch_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Replaces the scheduled changes of model of a body. A change is made before the step (or the equilibrium)
 * that begins at its time, and remains if that step is discarded. The models are created by this call, so
 * that impossible changes are refused now; two of them are kept, so that a change costs no more than the next
 * step. If a change would jump too far (DFM_DISCARD in dfm_body_set_model), dfm_world_swaps and the log
 * report it and the body keeps its model. Any other failure, such as a spring added in the meantime, makes
 * the step fail.
 * @param switches  [n], in order of time; n 0: none
 * @return DFM_OK; DFM_E_UNSUPPORTED no such model, or one that this body cannot have in this world (contact
 * method, integrator, springs); DFM_E_ARG parameters, times, cells that a model does not accept, an effect
 * that would be lost; DFM_E_NOMEM; DFM_E_HANDLE. On failure the scheduled changes stay as they were.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_switches(dfm_body body, uint32_t n, const dfm_switch *switches);

/** A model by name, with its parameters. A member of dfm_switch_rule; it does not grow in later versions.
 * dfm_switch_rule_default sets its size. */
typedef struct dfm_model_choice {
  uint32_t size;
  int32_t integrator; /* DFM_INTEGRATOR_* with this model; AUTO: that of the body */
  const char *type;   /* short name or full id; NULL: none */
  dfm_params params;  /* copied */
} dfm_model_choice;
/** Chooses the model of a body by contact and position. */
typedef struct dfm_switch_rule {
  uint32_t size, reserved;
  dfm_model_choice touching;  /* while it has a contact */
  dfm_model_choice near_by;   /* else, while a vertex of its surface is within `distance` of `point` */
  dfm_model_choice otherwise; /* else; required */
  double point[3], distance;  /* m; used if near_by is named */
  double hysteresis;          /* near_by ends at distance times 1 + hysteresis; 0.1 by default */
  double wait;                /* s without its condition, after which a model gives way to a later one; 0.1 */
  double max_jump;            /* J, as in dfm_body_set_model; 0: any jump */
  uint64_t cookie;            /* set by the default function */
} dfm_switch_rule;
/** dfm_switch_rule_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_switch_rule_default_sized(uint32_t size, dfm_switch_rule *out);
/** No models; hysteresis and wait 0.1, any jump. Threads: Any thread. Since 0.1. */
static inline dfm_switch_rule dfm_switch_rule_default(void) {
  dfm_switch_rule out;
  dfm_switch_rule_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Sets a rule that chooses the model of the body before each step, after the scheduled changes. A model that
 * comes earlier in dfm_switch_rule is taken at once, a later one after `wait`. A refused change is logged
 * once and tried again after `wait`. A sleeping body keeps its model. The state of the rule is part of a
 * snapshot. The models are created by this call, as in dfm_body_set_switches.
 * @param rule  NULL: removes the rule. @return DFM_OK; DFM_E_ARG values or parameters, or only one model is
 * named; DFM_E_ARG, DFM_E_UNSUPPORTED and DFM_E_NOMEM also as dfm_body_set_switches; DFM_E_HANDLE. On failure
 * the old rule stays. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_switch_rule(dfm_body body, const dfm_switch_rule *rule);
/** Moves `point` of the body's rule. @return DFM_OK; DFM_E_ARG no rule with near_by, or the point is not
 * finite; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_interest(dfm_body body, const double point[3]);

enum { DFM_SWAP_REFUSED = 1 /* refused for its jump: the body still has `from` */ };
/** A change of model, made or refused. */
typedef struct dfm_swap {
  uint32_t size, flags; /* DFM_SWAP_* */
  dfm_body body;
  double t;                             /* s, simulated time */
  const char *from, *to;                /* ids, valid while the context lives */
  double elastic_before, elastic_after; /* J; NAN if the model reports none */
  double max_jump;                      /* J; INFINITY: any */
} dfm_swap;
/** dfm_world_swaps with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Not during step. */
DFM_API dfm_status dfm_world_swaps_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_swap *out,
                                         uint32_t *n);
/** Changes of models since the last call; empties the list, which keeps the latest 4,096.
 * @param capacity 0 with out NULL only counts. @return DFM_OK; DFM_E_ARG too small; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_swaps(dfm_world world, uint32_t capacity, dfm_swap *out, uint32_t *n) {
  return dfm_world_swaps_sized(world, (uint32_t)sizeof(dfm_swap), capacity, out, n);
}
#ifdef __cplusplus
}
#endif
#endif
