/* deform/callback.h -- functions of the host that decide about contacts: may two things touch at all, and
 * what is to hold of one contact before it is solved. doc/concepts/callbacks.md.
 *
 * They are called on the thread that steps the world, never on workers, one at a time and in an order that
 * does not depend on the number of threads: results have the same bits as long as the answers depend on the
 * arguments and on nothing that changes between runs. Every call that they make into the world is refused
 * with DFM_E_BUSY. They must not throw. Snapshots hold neither functions nor answers: the host sets the
 * functions again. A world without them runs no instruction of theirs. */
#ifndef DEFORM_CALLBACK_H
#define DEFORM_CALLBACK_H
#include "deform/base.h"
#include "deform/id.h"
#ifdef __cplusplus
extern "C" {
#endif
/** May these two touch? a: a body; b: a body created later, an obstacle or a rigid body. */
typedef bool (*dfm_may_touch_fn)(void *user, uint64_t a, uint64_t b);
/** Sets the function that is asked about pairs, in addition to masks and rules (dfm_body_def,
 * dfm_world_filter_pair): each pair that these let touch is asked once, in order of creation, by the next
 * call that needs the plan (a step at the latest), and the answer is kept until dfm_world_ask_again. Pairs
 * that come later, or that masks and rules let touch again, are asked when they do. All bodies wake.
 * @param may_touch  NULL: none any more, and all answers are forgotten
 * @param user       its first argument
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_may_touch(dfm_world world, dfm_may_touch_fn may_touch, void *user);
/** Forgets answers, so that the pairs are asked again. Pairs that may touch now and overlap are set aside as
 * at the start (dfm_world_overlaps). All bodies wake.
 * @param a, b  two things: of this pair; b 0: of all pairs of a; both 0: of all pairs
 * @return DFM_OK; DFM_E_HANDLE a or b is no body or obstacle of this world; DFM_E_BUSY. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_ask_again(dfm_world world, uint64_t a, uint64_t b);

/** dfm_contact_choice.flags. TOUCHED: it carried load, or was not yet apart, at the end of the last
 * sub-step. */
enum { DFM_CHOICE_TOUCHED = 1 };
/** A contact that is about to be solved. The members up to velocity say what it is; those behind may be
 * changed. */
typedef struct dfm_contact_choice {
  uint32_t size, flags;
  /* as in dfm_contact, but b is always named: an obstacle too; a == b where a body touches itself */
  uint64_t a, b, key;
  uint32_t kind, feature_a, feature_b;
  uint32_t substep;           /* solves since the world was made, to tell the sub-steps apart */
  double time, dt;            /* s: at the start of the sub-step, and its length */
  double point[3], normal[3]; /* m, unit from b to a */
  double gap;                 /* m, distance of the surfaces less the rest distance */
  double velocity[3];         /* m/s, of a against b over the sub-step if nothing touched */
  uint32_t enabled;           /* 1; 0: it pushes nothing in this sub-step */
  uint32_t law;               /* number of its friction law (dfm_world_law_info); of any of the world's */
  /* 1; the law is asked as if the normal force were so many times as large: its coefficient times this. 0: no
   * friction. At least 0 */
  double friction_scale;
  double surface_velocity[3]; /* m/s, zero: how b's surface moves along itself, beside its motion: a belt */
} dfm_contact_choice;
typedef void (*dfm_pre_solve_fn)(void *user, dfm_contact_choice *contact);
/** Sets the function that every contact passes before it is solved, in every sub-step: contacts in reach,
 * which need not touch yet, in the order of dfm_world_contacts' sides; then what the guard wants to add. A
 * contact may be asked several times in a sub-step, and must be answered alike each time. A contact that is
 * not enabled is not reported and begins no event; the guard lets what it stands for pass. There is no
 * restitution to choose. Values that are not finite or out of range end the step with DFM_E_ARG, as nothing
 * else does, and the world stays at its last good sub-step. All bodies wake; contacts of sleepers are not
 * asked.
 * @param pre_solve  NULL: none any more
 * @param user       its first argument
 * @return DFM_OK; DFM_E_UNSUPPORTED the world's method is ROLLBACK; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_pre_solve(dfm_world world, dfm_pre_solve_fn pre_solve, void *user);
#ifdef __cplusplus
}
#endif
#endif
