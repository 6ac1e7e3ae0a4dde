/* deform/callback.h -- functions of the host that decide whether two things may touch at all, and change the
 * properties of a contact before it is solved. doc/concepts/callbacks.md.
 *
 * They are called on the thread that steps the world, never on workers, one at a time and in an order that
 * does not depend on the number of threads. Results have the same bits if the answers depend on the arguments
 * alone. Calls that change the world or read points get DFM_E_BUSY. Callbacks must not throw. Snapshots
 * contain neither functions nor answers: the host sets the functions again. A world without callbacks pays
 * nothing. */
#ifndef DEFORM_CALLBACK_H
#define DEFORM_CALLBACK_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** Whether two things may touch. a: a body; b: a body created later, an obstacle or a rigid body. */
typedef bool (*dfm_may_touch_fn)(void *user, uint64_t a, uint64_t b);
/** Sets the function that decides about pairs, in addition to masks and rules (dfm_body_def,
 * dfm_world_filter_pair). It is called once for each pair that masks and rules let touch, in order of
 * creation, by the next call that needs the plan (a step at the latest). The answer is kept until
 * dfm_world_ask_again. For pairs that appear later, or that masks and rules let touch again, it is called
 * at that time. All bodies wake.
 * @param may_touch  NULL: removes the function and forgets all answers
 * @param user       its first argument
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_may_touch(dfm_world world, dfm_may_touch_fn may_touch, void *user);
/** Forgets answers, so that the function is called again. Pairs that may touch now and overlap are treated as
 * overlapping at the start (dfm_world_overlaps). All bodies wake.
 * @param a, b  two things: the answer for this pair; b 0: for all pairs of a; both 0: for all pairs
 * @return DFM_OK; DFM_E_HANDLE a or b is no body or obstacle of this world; DFM_E_BUSY. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_ask_again(dfm_world world, uint64_t a, uint64_t b);

/** dfm_contact_choice.flags. TOUCHED: it carried load, or was not yet apart, at the end of the last
 * sub-step. */
enum { DFM_CHOICE_TOUCHED = 1 };
/** A contact before it is solved. The members up to velocity are input; the callback may change the members
 * after it. */
typedef struct dfm_contact_choice {
  uint32_t size, flags;
  /* as in dfm_contact, but b is never 0: it may be an obstacle; a == b if a body touches itself */
  uint64_t a, b, key;
  uint32_t kind, feature_a, feature_b;
  uint32_t substep;           /* sub-steps taken since creation of the world */
  double time, dt;            /* s: at the start of the sub-step, and its length */
  double point[3], normal[3]; /* m, unit from b to a */
  double gap;                 /* m, distance of the surfaces less the rest distance */
  double velocity[3];         /* m/s, of a relative to b over the sub-step without contact */
  uint32_t enabled;           /* 1; 0: no force in this sub-step */
  uint32_t law;               /* number of its friction law (dfm_world_law_info); any law of the world */
  /* 1; factor on the coefficient of friction (the law is evaluated with the normal force times this
   * factor). 0: no friction. At least 0 */
  double friction_scale;
  /* m/s, zero; velocity of b's surface along itself, added to its motion: a belt */
  double surface_velocity[3];
} dfm_contact_choice;
typedef void (*dfm_pre_solve_fn)(void *user, dfm_contact_choice *contact);
/** Sets the function that is called for every contact before it is solved, in every sub-step: first for
 * contacts in reach, which need not touch yet, in the order of dfm_world_contacts' sides, then for contacts
 * that the guard adds. It may be called several times for a contact in a sub-step, and must give the same
 * answer each time. A contact that is not enabled is not reported and begins no event, and the guard lets its
 * features pass. Restitution cannot be set. Values that are not finite or out of range end the step with
 * DFM_E_ARG, and the world stays at its last good sub-step. All bodies wake; the function is not called for
 * contacts of sleeping bodies.
 * @param pre_solve  NULL: removes the function
 * @param user       its first argument
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_pre_solve(dfm_world world, dfm_pre_solve_fn pre_solve, void *user);
#ifdef __cplusplus
}
#endif
#endif
