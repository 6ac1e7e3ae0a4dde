/* deform/world.h -- the world: gravity, step, snapshot, hash, statistics, plan. */
#ifndef DEFORM_WORLD_H
#define DEFORM_WORLD_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#ifdef __cplusplus
extern "C" {
#endif
/* How contacts are solved: with the inverse masses of the points (VELOCITY, for the integrator
 * SYMPLECTIC_EULER), or with the inverse of the matrix of the implicit step (IMPLICIT, for IMPLICIT_EULER
 * and TR_BDF2). AUTO is the one that belongs to the integrator. ROLLBACK is the scheme of Zerbato
 * (2010, 4.2), to compare only: it freezes what slides and loses momentum (doc/concepts/rollback.md); what it
 * cannot do is refused with DFM_E_UNSUPPORTED where it is made. Since 0.1. */
enum { DFM_METHOD_AUTO = 0, DFM_METHOD_VELOCITY = 1, DFM_METHOD_IMPLICIT = 2, DFM_METHOD_ROLLBACK = 3 };
/* AUTO is SYMPLECTIC_EULER, or IMPLICIT_EULER where the method is IMPLICIT; with dfm_world_def.step it is
 * SYMPLECTIC_EULER or TR_BDF2 (IMPLICIT_EULER where one Newton iteration is asked for), whichever costs less,
 * chosen for each body before the first step that it takes. IMPLICIT_EULER and TR_BDF2 need
 * models that give their stiffness, and are stable at every step (doc/concepts/implicit.md). TR_BDF2 is of
 * second order and damps little; where a body touches, it moves by IMPLICIT_EULER. */
enum {
  DFM_INTEGRATOR_AUTO = 0,
  DFM_INTEGRATOR_SYMPLECTIC_EULER = 1,
  DFM_INTEGRATOR_IMPLICIT_EULER = 2,
  DFM_INTEGRATOR_TR_BDF2 = 3
};

/* dfm_world_def.flags: without the guard against crossing (concepts/guard.md), to see what it does */
enum {
  DFM_WORLD_UNGUARDED = 1,
  /* what overlaps when it is made or put somewhere is moved apart before the next step
        * (concepts/overlaps.md) */
  DFM_WORLD_UNTANGLE = 2
};
enum { DFM_SELF_OFF = 0, DFM_SELF_ON = 1, DFM_SELF_AUTO = 2 }; /* dfm_world_def.self_contact */
typedef struct dfm_world_def {
  uint32_t size, flags;
  double gravity[3];          /* m/s2 */
  int32_t method, integrator; /* DFM_METHOD_*, DFM_INTEGRATOR_* */
  /* m, rest distance d_c; 0: chosen per world from the meshes (mechanics: 1e-3 of the median surface edge) */
  double contact_offset;
  /* m/s, slip that a sticking contact may be left with; 0: min(1e-6, 0.01 (d_c-d_g)/h); doc/decisions/0004 */
  double contact_tolerance;
  /* per sub-step; 50. Up to eight times as many where bodies would else pass through each other */
  uint32_t max_sweeps;
  uint32_t max_passes;   /* outer passes per sub-step; 20 */
  uint32_t max_substeps; /* a step that needs more returns DFM_DISCARD; 10000 */
  /* 1: islands of bodies at rest sleep until something reaches them (doc/concepts/sleeping.md); 0 */
  uint32_t sleep;
  /* NULL-terminated list, which selects: what is not in it is not simulated, and dfm_world_explain says what
   * that leaves out (doc/concepts/effects.md); NULL: what parameters call for */
  const char *const *effects;
  /* m/s, 0.01: what falls asleep has been slower in every point, and has stayed within half of d_c, */
  double sleep_speed;
  double sleep_time; /* s, 0.5: for so long */
  /* DFM_SELF_ON: every surface touches itself too, as the effect "self_contact" in the list does;
   * DFM_SELF_AUTO: while it folds or is squeezed so far that it may; DFM_SELF_OFF: only where another effect
   * needs it. dfm_world_filter_pair with one body's name twice decides for this body
   * (doc/concepts/self_contact.md) */
  uint32_t self_contact;
  uint32_t reserved;
  /* s of the machine's time for one step, 0: any. A step that this changes depends on the machine
   * and its load */
  double max_time;
  /* units of work for one step (doc/concepts/budget.md), the same on every machine; 0: automatic, 1000 times
   * what the step costs with nothing in contact; UINT64_MAX: any */
  uint64_t max_work;
  /* 0.01: a step stops where a body has gained more than this share of the largest energy so far beyond what
   * loads, motions and contact have put into it (doc/concepts/energy_watch.md); 0: never */
  double energy_watch;
  /* m/s, at most, at which contact opens a depth; 0: a tenth of d_c per sub-step. What comes free keeps it,
   * soft bodies up to twice of it: 2 m v^2 at most (doc/concepts/contact.md) */
  double recovery_speed;
  double obstacle_speed; /* m/s: an obstacle that is told to move faster is refused; 0: 200 */
  /* linear solver of the implicit step: "auto", "ldlt", "pcg" or the id of a plugin; NULL: "auto" */
  const char *solver;
  double solver_tolerance;    /* relative residual of an iterative solver; 0: 1e-10 */
  uint32_t solver_iterations; /* of an iterative solver, at most; 0: as many as there are unknowns */
  /* iterations of Newton's method per sub-step, at most; 0: 20. 1 is one linear solve without a line search,
   * for an interactive scene */
  uint32_t newton_iterations;
  uint32_t reserved2;
  /* s, how long steps are to be, for integrators AUTO to be chosen by: a body whose explicit sub-steps would
   * cost four times what implicit ones do moves by IMPLICIT_EULER (doc/concepts/implicit.md); 0: not told,
   * AUTO as it is without */
  double step;
  uint64_t cookie; /* set by the default function */
} dfm_world_def;

/** dfm_world_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_world_def_default_sized(uint32_t size, dfm_world_def *out);
/** Gravity (0,0,-9.81), everything automatic. Threads: Any thread. Since 0.1. */
static inline dfm_world_def dfm_world_def_default(void) {
  dfm_world_def out;
  dfm_world_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** @return DFM_OK; DFM_E_ARG a value out of range or an effect that nothing loaded provides; DFM_E_NOMEM.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_create(dfm_context *context, const dfm_world_def *def, dfm_world *out);
/** Destroys the world, its bodies and obstacles. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_destroy(dfm_world world);

/** Gravity from now on, m/s2. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_gravity(dfm_world world, const double gravity[3]);
/** Gravity that varies; times in s, strictly rising. n = 0 removes it. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_set_gravity_keys(dfm_world world, uint32_t n, const dfm_vector_key *keys);

/** Lets islands at rest sleep, or (false) wakes all and keeps them awake. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_set_sleep(dfm_world world, bool sleep);

/* ---- step ---------------------------------------------------------------------------------------------- */
/** Trouble inside a step; each bit with its remedy. */
enum {
  /* dt is above the stable step, sub-steps were taken or, with DFM_DISCARD, more than max_substeps would have
   * been needed: soften, coarsen, take a shorter step, or accept the cost */
  DFM_TROUBLE_SUBSTEPS = 1,
  DFM_TROUBLE_UNCONVERGED = 2, /* the contact solve met its cap: raise max_sweeps, or lower mass ratios */
  /* a plugin or a load made a NaN or a velocity above that of light: the last good sub-step is kept
   * (DFM_E_DIVERGED) */
  DFM_TROUBLE_NONFINITE = 4,
  /* a cell is inside out (looked for when the step bound is asked): refine, soften the load */
  DFM_TROUBLE_INVERTED = 8,
  DFM_TROUBLE_PLUGIN = 16, /* a plugin failed: see the log */
  /* told once, by the step after something was made or put inside something else: dfm_world_overlaps lists
   * the pairs; move one of each (doc/concepts/overlaps.md) */
  DFM_TROUBLE_OVERLAP = 32,
  /* a body gains energy that nobody gave it (status DFM_E_DIVERGED): shorten the step, or add
   * stiffness damping */
  DFM_TROUBLE_ENERGY = 64,
  /* the step was cheapened or, with DFM_DISCARD, given up by max_time or max_work: take a shorter step,
   * soften the blow */
  DFM_TROUBLE_BUDGET = 256,
  DFM_TROUBLE_INTERRUPTED = 512 /* DFM_DISCARD because of dfm_world_interrupt */
};
/** Advances the world by dt. A step longer than the stable one is cut into equal sub-steps with the contact
 * solve in each; their number is 1, 2, 3 or (4, 5, 6, 7) 2^k.
 * @param dt       s, at least 1e-9 for each meter that a body is away from the origin (and for the first
 *                 one): rounding of positions rules below
 * @param trouble  out, DFM_TROUBLE_* bits; may be NULL
 * @return DFM_OK; DFM_DISCARD too many sub-steps, its budget used up (max_time, max_work) or
 * dfm_world_interrupt: nothing changed but models whose time had come (model.h);
 *         DFM_E_DIVERGED a sub-step could not be taken (a value that is not finite, a plugin that failed,
 *         energy out of nothing): the world stays at its last good sub-step, and may step again once the
 *         cause is gone; DFM_E_NOMEM likewise; DFM_E_FATAL a plugin gave no step bound; DFM_E_UNSUPPORTED a
 *         change of model that was due and cannot be made (model.h), told until it is taken back; DFM_E_ARG;
 *         DFM_E_HANDLE; DFM_E_BUSY called from inside a step
 * Threads: One thread at a time per world. Since 0.1. */
DFM_API dfm_status dfm_world_step(dfm_world world, double dt, uint32_t *trouble);
/** Where dfm_world_equilibrium goes and how far it looks. */
typedef struct dfm_equilibrium_def {
  uint32_t size;
  uint32_t load_steps; /* 0: 1. Each starts from the one before; one without an answer is halved */
  /* share of gravity and of loads at the start and the end; those that have keys or a sine follow these */
  double load_from, load_to;
  double time; /* s that pass on the way: what has keys is at its end place after it; 0 */
  /* N left at a point per N of the largest load or reaction; 0: 1e-10, with contact 1e-6 */
  double tolerance;
  /* of Newton's method per load step and body; 0: 200. With contact, steps from rest per load step; 0: 500 */
  uint32_t max_iterations;
  uint32_t reserved;
  uint64_t cookie; /* set by the default function */
} dfm_equilibrium_def;
typedef struct dfm_equilibrium_info {
  uint32_t size;
  uint32_t load_steps; /* that it took */
  uint64_t iterations; /* linear solves, of all bodies and load steps; with contact, steps from rest */
  double residual;     /* of the last load step: N left per N of the largest load or reaction, worst body */
} dfm_equilibrium_info;
/** dfm_equilibrium_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_equilibrium_def_default_sized(uint32_t size, dfm_equilibrium_def *out);
/** One load step, from no load to all of it, no time passes. Threads: Any thread. Since 0.1. */
static inline dfm_equilibrium_def dfm_equilibrium_def_default(void) {
  dfm_equilibrium_def out;
  dfm_equilibrium_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Moves all bodies to where their inner forces, contact and friction balance gravity, loads and springs,
 * with held points and obstacles where they are told to be; velocities are zero then
 * (doc/concepts/static.md). What relaxes or flows has done so. dfm_world_interrupt stops a search with
 * contact.
 * @param def   NULL: the default
 * @param info  out; may be NULL
 * @return DFM_OK; DFM_E_DIVERGED no equilibrium was found: a body that nothing holds has loads that do not
 * sum to zero, slides on, or falls; DFM_E_UNSUPPORTED a model without stiffness, rigid bodies, contact in a
 * world whose method is ROLLBACK; DFM_DISCARD interrupted; DFM_E_ARG; DFM_E_NOMEM; DFM_E_HANDLE; DFM_E_BUSY.
 * On failure nothing has changed but models whose time had come (model.h).
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_equilibrium(dfm_world world, const dfm_equilibrium_def *def,
                                         dfm_equilibrium_info *info);
/** What a step may cost from now on, as max_time and max_work of dfm_world_def say it.
 * @return DFM_OK; DFM_E_ARG max_time below zero or not a number. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_budget(dfm_world world, double max_time, uint64_t max_work);
/** Asks the step that runs, or if none runs the next one, to stop: it returns DFM_DISCARD with
 * DFM_TROUBLE_INTERRUPTED as soon as the sweep, the guard's question or the stage that it is in has ended,
 * and the state is as before it. A function of a plugin is not cut short.
 * @return DFM_OK; DFM_E_HANDLE not a world's handle (whether it is stale is not looked at); DFM_E_NOMEM 64
 * other worlds' requests wait
 * Threads: Any thread. May be called from a signal handler. Since 0.1. */
DFM_API dfm_status dfm_world_interrupt(dfm_world world);
/* Two things that were through each other deeper than the rest distance when they were made or
 * put in place. */
enum {
  DFM_OVERLAP_OBSTACLE = 1, /* b is an obstacle or a rigid body */
  /* deeper than contact leads out: the pair does not touch until it is apart */
  DFM_OVERLAP_ASIDE = 2,
  DFM_OVERLAP_SEPARATED = 4 /* untangled: it is apart */
};
typedef struct dfm_overlap {
  uint32_t size, flags; /* DFM_OVERLAP_* */
  dfm_body a;
  uint64_t b; /* dfm_body or dfm_obstacle */
  /* pairs of triangles that cross; of a plane, a sphere or a capsule: triangles of a that it cuts */
  uint32_t crossings;
  uint32_t enclosed; /* surface points of one that lie inside the other */
  double depth;      /* m, the deepest of them, from the surface */
} dfm_overlap;
/** dfm_world_overlaps with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Not during step. */
DFM_API dfm_status dfm_world_overlaps_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                            dfm_overlap *out, uint32_t *n);
/** What the last look found. The library looks once, at the next call that needs the plan (a step at the
 * latest), at what was made, set or restored since: not in every step. Filtered pairs do not count. capacity
 * 0 with out NULL only counts.
 * @return DFM_OK; DFM_E_ARG too small; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_overlaps(dfm_world world, uint32_t capacity, dfm_overlap *out,
                                            uint32_t *n) {
  return dfm_world_overlaps_sized(world, (uint32_t)sizeof(dfm_overlap), capacity, out, n);
}
/** Looks at all pairs as they are now, and changes nothing; dfm_world_overlaps then lists these.
 * @param n  out, pairs; may be NULL. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_find_overlaps(dfm_world world, uint32_t *n);

/** Moves apart what overlaps now, as DFM_WORLD_UNTANGLE does for what is made: whole bodies, by the least way
 * found, neither turned nor bent, so that no elastic energy and no velocity comes of it. Bodies with held
 * points, obstacles and rigid bodies stay. What cannot be parted keeps its place, and the log says why.
 * @param left  out, pairs that overlap still; may be NULL. @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_untangle(dfm_world world, uint32_t *left);

/** A step that is not cut into sub-steps: (4, 5, 6, 7) 2^k s, at most 0.9 of the proven bound; +INFINITY if
 * nothing bounds it. It may be fed back at each step: it follows the bound down at once and up with delay, so
 * that steps change rarely (doc/concepts/step.md). dfm_world_stats.stable_step has the bound itself. With the
 * integrators IMPLICIT_EULER and TR_BDF2, which no bound holds, it follows the error of the last step
 * instead, up to 1/30 s (doc/concepts/implicit.md).
 * @param dt          out, s
 * @param body,point  out, the element that bounds it; may be NULL
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_FATAL a plugin gave no step bound. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_stable_step(dfm_world world, double *dt, dfm_body *body, uint32_t *point);
/** Simulated time, s; NAN for a stale handle. Threads: Any thread. Not during step. Since 0.1. */
DFM_API double dfm_world_time(dfm_world world);

/** FNV-1a 64 of x, v, model state, contact keys and bristles, in id order, and of the model with its
 * parameters where a body has another one than at the first step; 0 for a stale handle.
 * Threads: Any thread. Not during step. Since 0.1. */
DFM_API uint64_t dfm_world_hash(dfm_world world);
/** Writes what a later result depends on. buffer NULL: *bytes gets the size needed. Too small:
 * DFM_E_ARG and the size.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_snapshot(dfm_world world, void *buffer, size_t *bytes);
/** Restores into a world with the same bodies and obstacles (a scene loaded anew, in another process too):
 * state, contacts, loads, holds, motions, gravity, filters, friction rules, models with their parameters. The
 * next steps give the same bits; events not yet read are dropped.
 * @return DFM_OK; DFM_E_FORMAT damaged, of another version or not of such a world; DFM_E_UNSUPPORTED a
 * law or a model that is not loaded; DFM_E_NOMEM; DFM_E_HANDLE. On failure nothing has changed. Threads: Not
 * during step. Since 0.1. */
DFM_API dfm_status dfm_world_restore(dfm_world world, const void *buffer, size_t bytes);

/** @return DFM_OK; DFM_E_ARG no body of that name (nearest one). Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_find_body(dfm_world world, const char *name, dfm_body *out);
/** Bodies in id order. capacity 0 with bodies NULL only counts. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_bodies(dfm_world world, uint32_t capacity, dfm_body *bodies, uint32_t *n);
/** Obstacles in id order; capacity as for dfm_world_bodies. Threads: Any thread. Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_obstacles(dfm_world world, uint32_t capacity, dfm_obstacle *obstacles,
                                       uint32_t *n);

/* ---- what a step did ----------------------------------------------------------------------------------- */
typedef struct dfm_world_stats {
  uint32_t size, threads;
  uint64_t steps, substeps; /* since creation */
  double time;              /* s simulated */
  /* of the last step (last sub-step for contacts..sweeps) */
  uint32_t last_substeps, contacts, sticking, passes, sweeps, pairs_tested;
  double residual; /* m/s, of the last sub-step */
  uint32_t contacts_max, passes_max, sweeps_max;
  double contacts_mean, residual_max;                  /* since creation */
  uint64_t unconverged, guard_steps, rebuilds, refits; /* since creation */
  uint32_t inverted_max, substeps_max;                 /* since creation */
  double stable_step;                                  /* s, 0.9 of the bound at its last evaluation */
  /* bodies that sleep now; whose self contact was on in the last sub-step */
  uint32_t asleep, self_bodies;
  /* J and N s that bodies still had when they fell asleep, since creation */
  double sleep_energy, sleep_momentum[3];
  /* since creation: solves with hits as contacts; sub-steps taken anew, shorter */
  uint64_t guard_solves, guard_cuts;
  double guard_lost; /* s since creation: motion left out where neither was enough */
  /* times a rigid host had contact solved again (DFM_RIGID_AGAIN), since creation */
  uint64_t rigid_again;
  /* units of the last step, also where it was discarded; the most since creation (doc/concepts/budget.md) */
  uint64_t work, work_max;
  /* steps that left something out for their budget; that were given up by it or by dfm_world_interrupt */
  uint64_t cheapened, discarded;
  /* cells at once that were so far from their shape that their model limited their stiffness, bodies at once
   * whose self contact was on: since creation */
  uint32_t limited_max, self_max;
  /* J, kinetic and elastic of the bodies that the energy watch looks at (the plan says which): at the first
   * step; the largest seen, between two looks the kinetic energy of the motion without contact */
  double energy_start, energy_max;
  /* J, the largest gain seen beyond what loads, motions and contact have put in */
  double energy_gain;
} dfm_world_stats;
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_get_stats(dfm_world world, dfm_world_stats *out);

/** Bytes that a world holds now, taken through the hooks of its context. Not in it: what plugins allocate for
 * themselves (dfm_host.alloc), meshes that the context holds, names and lists of a few bytes. */
typedef struct dfm_memory {
  uint32_t size, reserved;
  uint64_t bodies;    /* points, cells, surfaces, couplings, what models keep of each body */
  uint64_t dynamics;  /* how bodies move: matrices and factors of implicit ones */
  uint64_t obstacles; /* surfaces and voxels of obstacles */
  uint64_t detection; /* trees and lists of pairs */
  uint64_t contacts;  /* what is solved, kept and reported of contacts */
  uint64_t steps;     /* other buffers of a step */
  uint64_t total;     /* of all these */
} dfm_memory;
/** @return DFM_OK; DFM_E_HANDLE; DFM_E_ARG out is NULL. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_memory(dfm_world world, dfm_memory *out);

/* name: static storage */
typedef struct dfm_stage_time {
  const char *name;
  double seconds;
  uint64_t calls;
} dfm_stage_time;
/** dfm_world_profile with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Not during step. */
DFM_API dfm_status dfm_world_profile_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                           dfm_stage_time *out, uint32_t *n);
/** Seconds spent in each stage of the plan since creation (CPU time of the stepping thread is not separated
 * from waiting).
 * @param capacity of out in stages; 0 with out NULL only counts. @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_profile(dfm_world world, uint32_t capacity, dfm_stage_time *out,
                                           uint32_t *n) {
  return dfm_world_profile_sized(world, (uint32_t)sizeof(dfm_stage_time), capacity, out, n);
}

/** The plan as JSON text (UTF-8, NUL-terminated): {"effects":[{"name","asked_by","provided_by","state"}],
 * "left_out":[{"name","of","by"}], "stages":[{"name","why","cost"}], "absent":[{"name","why"}],
 * "laws":[{"name","asked","effects":[{"name","works","used","switchable"}]}],
 * "bodies":[{"name","model","cells","points","surfels","surface","filled",
 * "fields":[{"name","from","min","max"}], "idle":[{"name","why"}],
 * "effects":[{"name","works","used","switches":[{"key","now","off","off_value"}]}],
 * "facts":[{"key","label","unit","value"}], "changes":[{"name","when","integrator","stable_s","max_jump_J"}],
 * "attached":[{"to","surfels","stiffness","damping","release"}], "unwatched"}],
 * "step":{"stable_s","worst_body","worst_point","reason"}}. state: "asked" by the list of effects, or
 * "called for" by parameters; left_out: called for, but not in the list; laws: asked is the one that the
 * rules name. surface: "boundary" of the cells, or "own, COUPLING"; from: who says what differs by cell
 * (field, materials, share); idle: parameters that do nothing, or not what they name; effects: what the model
 * brings, whether it is at work and used, and the parameters that together switch it off (switchable: one of
 * a law can be); facts: what the model found when it was made; changes: models that the body is to have, the
 * last two where given; unwatched: why the energy watch does not look at the body, "" where it does.
 * @param text NULL: *bytes gets the size needed, in bytes. @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_explain(dfm_world world, char *text, size_t *bytes);
#ifdef __cplusplus
}
#endif
#endif
