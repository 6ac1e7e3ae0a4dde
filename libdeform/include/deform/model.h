/* deform/model.h -- change of a body's model while it runs (doc/concepts/changing_models.md). */
#ifndef DEFORM_MODEL_H
#define DEFORM_MODEL_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Gives the body another model, or the same one anew, between two steps. Positions and velocities stay as
 * they are, and with them surface, momentum, angular momentum, kinetic energy and contacts; what the old
 * model kept (plastic strain, stresses that relax) is dropped. Elastic energy jumps: dfm_world_swaps tells by
 * how much. Parameters that are not given follow from the body's materials and fields; those that were given
 * for the model before are not taken over, not even to the same type. A sleeping body wakes.
 * @param type    short name or full id of a loaded model
 * @param params  of the model; NULL: none. Beside them "precision" (dfm_body_def) and "max_jump", J: the
 * change is refused where the elastic energy would rise or fall by more, and what changes put in may come to
 * as much
 * @return DFM_OK; DFM_DISCARD the energy would jump by more than max_jump, changes would put in too much, or
 * the surface would jump by more than 1e-6 of the size; DFM_E_UNSUPPORTED no such model is loaded (lists
 * those that are), or it cannot move this body: it has no stiffness for an implicit step, it steps itself and
 * the body has springs; DFM_E_ARG a parameter, or an effect that the scene asks for and only the old model
 * has; DFM_E_NOMEM; DFM_E_HANDLE; DFM_E_BUSY from inside a step. On failure nothing has changed.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_model(dfm_body body, const char *type, const dfm_params *params);

/** A change of model that is to come. */
typedef struct dfm_switch {
  uint32_t size;      /* dfm_switch_default sets it */
  int32_t integrator; /* DFM_INTEGRATOR_* from then on; AUTO: the one it was made with */
  double t;           /* s: made by the first step that begins at t or later (to 1e-6 of the step) */
  const char *type;   /* short name or full id */
  dfm_params params;  /* copied */
  double max_jump;    /* J, as in dfm_body_set_model; 0: any jump */
  uint64_t cookie;    /* set by the default function */
} dfm_switch;
/** dfm_switch_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_switch_default_sized(uint32_t size, dfm_switch *out);
/** At t = 0, to no model, any jump, the integrator that the body was made with. Threads: Any thread.
 * Since 0.1. */
static inline dfm_switch dfm_switch_default(void) {
  dfm_switch out;
  dfm_switch_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** The changes to come, in place of those that were to come. They are made before the step (or the
 * equilibrium) that begins at their time, and stay made where that step is discarded. Their models are made
 * now, and two of them kept: what could never be made is refused now, and a change costs no more than the
 * next step. One that would jump too far (DFM_DISCARD in dfm_body_set_model) is told by dfm_world_swaps and
 * the log, and the body goes on with the model it has; any other failure, as of a spring that was added
 * since, is that of the step, which is not taken.
 * @param switches  [n], times do not fall; n 0: none
 * @return DFM_OK; DFM_E_UNSUPPORTED no such model, or one that cannot move this body in this world (contact
 * method, integrator, springs); DFM_E_ARG parameters, times, cells that a model does not take, an effect that
 * would be lost; DFM_E_NOMEM; DFM_E_HANDLE. On failure what was to come stays. Threads: Not during step.
 * Since 0.1. */
DFM_API dfm_status dfm_body_set_switches(dfm_body body, uint32_t n, const dfm_switch *switches);

/** A model by its name, and what it is made with. It stands in dfm_switch_rule and is the same in every
 * version; dfm_switch_rule_default sets its size. */
typedef struct dfm_model_choice {
  uint32_t size;
  int32_t integrator; /* DFM_INTEGRATOR_* with this model; AUTO: the body's own */
  const char *type;   /* short name or full id; NULL: not asked for */
  dfm_params params;  /* copied */
} dfm_model_choice;
/** Which model a body has by what it does and where it is. */
typedef struct dfm_switch_rule {
  uint32_t size, reserved;
  dfm_model_choice touching;  /* while it has a contact */
  dfm_model_choice near_by;   /* else, while a vertex of its surface is within `distance` of `point` */
  dfm_model_choice otherwise; /* else; always named */
  double point[3], distance;  /* m; count where near_by is named */
  double hysteresis;          /* near_by ends at distance times 1 + hysteresis; 0.1 by default */
  double wait;     /* s for which nothing calls for a model before the next one in this list; 0.1 */
  double max_jump; /* J, as in dfm_body_set_model; 0: any jump */
  uint64_t cookie; /* set by the default function */
} dfm_switch_rule;
/** dfm_switch_rule_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_switch_rule_default_sized(uint32_t size, dfm_switch_rule *out);
/** No models, the values said above. Threads: Any thread. Since 0.1. */
static inline dfm_switch_rule dfm_switch_rule_default(void) {
  dfm_switch_rule out;
  dfm_switch_rule_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Has the model of the body follow a rule, which is looked at before each step, after the changes by time: a
 * model further up in dfm_switch_rule is taken at once, one further down after `wait`. A change that is
 * refused is told once and tried again after `wait`; a body that sleeps keeps its model. What the rule has
 * come to is part of a snapshot. Its models are made now, as those of dfm_body_set_switches.
 * @param rule  NULL: none from now on. @return DFM_OK; DFM_E_ARG values, parameters, one model alone, and
 * with DFM_E_UNSUPPORTED, DFM_E_NOMEM as dfm_body_set_switches; DFM_E_HANDLE. On failure the rule that there
 * was stays. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_switch_rule(dfm_body body, const dfm_switch_rule *rule);
/** Moves the point of the body's rule. @return DFM_OK; DFM_E_ARG it has no rule with near_by, or the point is
 * not finite; DFM_E_HANDLE. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_body_set_interest(dfm_body body, const double point[3]);

enum { DFM_SWAP_REFUSED = 1 /* for what energy or surface would do: the body has `from` */ };
/** A change of model. */
typedef struct dfm_swap {
  uint32_t size, flags; /* DFM_SWAP_* */
  dfm_body body;
  double t;                             /* s, simulated time */
  const char *from, *to;                /* ids, as long as the context lives */
  double elastic_before, elastic_after; /* J; NAN where a model gives none */
  double max_jump;                      /* J; INFINITY: any */
} dfm_swap;
/** dfm_world_swaps with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Not during step. */
DFM_API dfm_status dfm_world_swaps_sized(dfm_world world, uint32_t row_size, uint32_t capacity, dfm_swap *out,
                                         uint32_t *n);
/** Changes of models since the last call; empties the list. Where more than 4,096 wait, the oldest are left
 * out. @param capacity 0 with out NULL only counts. @return DFM_OK; DFM_E_ARG too small; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_swaps(dfm_world world, uint32_t capacity, dfm_swap *out, uint32_t *n) {
  return dfm_world_swaps_sized(world, (uint32_t)sizeof(dfm_swap), capacity, out, n);
}
#ifdef __cplusplus
}
#endif
#endif
