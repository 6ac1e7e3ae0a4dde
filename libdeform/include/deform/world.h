/* deform/world.h -- the world: gravity, step, snapshot, hash, statistics, plan. */
#ifndef DEFORM_WORLD_H
#define DEFORM_WORLD_H
#include "deform/base.h"
#include "deform/id.h"
#include "deform/math.h"
#ifdef __cplusplus
extern "C" {
#endif
/* AUTO is SYMPLECTIC_EULER. If dfm_world_def.step is set, AUTO chooses for each body, before its first step,
 * the cheaper one of SYMPLECTIC_EULER and TR_BDF2 (IMPLICIT_EULER if newton_iterations is 1). IMPLICIT_EULER
 * and TR_BDF2 need models that provide their stiffness, and are stable at every step
 * (doc/concepts/implicit.md). TR_BDF2 is of second order and damps little; a body that touches moves by
 * IMPLICIT_EULER. */
enum {
  DFM_INTEGRATOR_AUTO = 0,
  DFM_INTEGRATOR_SYMPLECTIC_EULER = 1,
  DFM_INTEGRATOR_IMPLICIT_EULER = 2,
  DFM_INTEGRATOR_TR_BDF2 = 3
};

/* dfm_world_def.flags: switches off the guard against crossing (doc/concepts/guard.md), to see its effect */
enum {
  DFM_WORLD_UNGUARDED = 1,
  /* things that overlap when they are created or placed are moved apart before the next step
   * (doc/concepts/overlaps.md) */
  DFM_WORLD_UNTANGLE = 2
};
enum { DFM_SELF_OFF = 0, DFM_SELF_ON = 1, DFM_SELF_AUTO = 2 }; /* dfm_world_def.self_contact */
typedef struct dfm_world_def {
  uint32_t size, flags;
  double gravity[3];  /* m/s2 */
  int32_t reserved3;  /* 0, else DFM_E_UNSUPPORTED */
  int32_t integrator; /* DFM_INTEGRATOR_* */
  /* m, rest distance d_c; 0: chosen from the meshes of the world (1e-3 of the median surface edge) */
  double contact_offset;
  /* m/s, slip that a sticking contact may have; 0: min(1e-6, 0.01 (d_c-d_g)/h); doc/concepts/contact.md */
  double contact_tolerance;
  /* of explicit contact islands, before Newton's method goes on; 200 */
  uint32_t max_sweeps;
  uint32_t max_passes;   /* outer passes of these sweeps; 20 */
  uint32_t max_substeps; /* a step that needs more returns DFM_DISCARD; 10000 */
  /* 1: islands of bodies at rest sleep until something reaches them (doc/concepts/sleeping.md); default 0 */
  uint32_t sleep;
  /* NULL-terminated list of the effects to simulate; dfm_world_explain names the effects that the list leaves
   * out (doc/concepts/effects.md); NULL: the effects that the parameters call for */
  const char *const *effects;
  /* m/s, 0.01. A body falls asleep after every point has been slower than sleep_speed, and has stayed within
   * half of d_c, for sleep_time */
  double sleep_speed;
  double sleep_time; /* s, 0.5 */
  /* DFM_SELF_ON: every surface can touch itself, as with "self_contact" in the list of effects;
   * DFM_SELF_AUTO: the same; DFM_SELF_OFF: only if another effect needs it.
   * dfm_world_filter_pair with the name of a body twice decides for that body
   * (doc/concepts/self_contact.md) */
  uint32_t self_contact;
  uint32_t reserved;
  /* s, wall-clock limit for one step, 0: none. A step that reaches the limit depends on the machine and its
   * load */
  double max_time;
  /* units of work for one step (doc/concepts/budget.md), the same on every machine; 0: automatic, 16000 times
   * the cost of a step without contact; UINT64_MAX: no limit */
  uint64_t max_work;
  /* 0.01: a step stops if a body has gained more energy than loads, motions and contact have put into it, by
   * this fraction of the largest energy so far (doc/concepts/energy_watch.md); 0: never */
  double energy_watch;
  /* m/s, largest speed at which contact separates penetrating surfaces; 0: a tenth of d_c per sub-step. A
   * body that comes free keeps this speed, a soft one up to twice as much: an energy of at most 2 m v^2
   * (doc/concepts/contact.md) */
  double recovery_speed;
  double obstacle_speed; /* m/s: a step in which an obstacle would move faster is refused; 0: 200 */
  /* linear solver of the implicit step: "auto", "ldlt", "pcg" or the id of a plugin; NULL: "auto" */
  const char *solver;
  double solver_tolerance;    /* relative residual of an iterative solver; 0: 1e-10 */
  uint32_t solver_iterations; /* limit for an iterative solver; 0: the number of unknowns */
  /* limit on the iterations of Newton's method per sub-step; 0: 20. 1 is one linear solve without a line
   * search, for an interactive scene */
  uint32_t newton_iterations;
  uint32_t reserved2;
  /* s, intended length of steps, from which integrator AUTO is chosen: a body whose explicit sub-steps would
   * cost four times as much as implicit ones becomes implicit (doc/concepts/implicit.md); 0: unknown, AUTO is
   * SYMPLECTIC_EULER */
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
/** Gravity over time by keys; times in s, strictly rising. n = 0 removes the keys. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_set_gravity_keys(dfm_world world, uint32_t n, const dfm_vector_key *keys);

/** Lets islands at rest sleep, or (false) wakes all bodies and keeps them awake. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_set_sleep(dfm_world world, bool sleep);

/* ---- step ---------------------------------------------------------------------------------------------- */
/** Trouble in a step; each bit with its remedy. */
enum {
  /* dt is above the stable step, or too long for bodies that meet fast: sub-steps were taken.
   * With DFM_DISCARD it needs more than max_substeps: soften the material, coarsen the mesh, shorten dt */
  DFM_TROUBLE_SUBSTEPS = 1,
  DFM_TROUBLE_UNCONVERGED = 2, /* no answer to contact was found: contacts exclude each other, or max_work */
  /* a plugin or a load produced a NaN or a velocity above the speed of light: the last good sub-step is kept
   * (DFM_E_DIVERGED) */
  DFM_TROUBLE_NONFINITE = 4,
  /* a cell is inverted (checked when the step bound is computed): refine the mesh, or lower the load */
  DFM_TROUBLE_INVERTED = 8,
  DFM_TROUBLE_PLUGIN = 16, /* a plugin failed: see the log */
  /* set once, by the step after something was created or placed inside something else, or parts of a body
   * came off with their teeth in each other: dfm_world_overlaps lists the pairs; move one of each, unless
   * they are such parts, which contact moves apart (doc/concepts/overlaps.md) */
  DFM_TROUBLE_OVERLAP = 32,
  /* a body, or contact, gained energy without a cause (status DFM_E_DIVERGED): take a shorter
   * step, or add stiffness damping */
  DFM_TROUBLE_ENERGY = 64,
  /* the step was simplified because of max_time or max_work, or ended before dt with the time that they held
   * (dfm_world_time tells): take a shorter step, or accept slower motion */
  DFM_TROUBLE_BUDGET = 256,
  DFM_TROUBLE_INTERRUPTED = 512 /* DFM_DISCARD because of dfm_world_interrupt */
};
/** Advances the world by dt. A step that is too long (DFM_TROUBLE_SUBSTEPS) is divided into equal sub-steps,
 * each with a contact solve; their number is 1, 2, 3 or (4, 5, 6, 7) 2^k.
 * @param dt       s, at least 1e-9, and 1e-9 for each meter of the largest coordinate: below that the
 *                 rounding of positions dominates
 * @param trouble  out, DFM_TROUBLE_* bits; may be NULL
 * @return DFM_OK, also where the budget (max_time, max_work) was used up before dt: at least one sub-step was
 * taken, dfm_world_time tells how far; DFM_DISCARD too many sub-steps, or dfm_world_interrupt: nothing has
 * changed except scheduled changes of model (model.h);
 *         DFM_E_DIVERGED a sub-step failed (a value is not finite, a plugin failed, energy appeared without a
 *         cause): the world stays at its last good sub-step, and can step again once the cause is removed;
 *         DFM_E_NOMEM likewise; DFM_E_FATAL a plugin gave no step bound; DFM_E_UNSUPPORTED a scheduled change
 *         of model cannot be made (model.h), returned until it is removed; DFM_E_ARG; DFM_E_HANDLE;
 *         DFM_E_BUSY called from inside a step
 * Threads: One thread at a time per world. Since 0.1. */
DFM_API dfm_status dfm_world_step(dfm_world world, double dt, uint32_t *trouble);
/** Load steps, tolerance and limits of dfm_world_equilibrium. */
typedef struct dfm_equilibrium_def {
  uint32_t size;
  uint32_t load_steps; /* 0: 1. Each starts from the one before */
  /* fraction of gravity and loads at the start and the end; those with keys or a sine follow them instead */
  double load_from, load_to;
  double time; /* s that pass during the load steps, for keys and sines; 0 */
  /* residual force at a point over the largest load or reaction; 0: 1e-10, with contact 1e-6 */
  double tolerance;
  /* steps from rest per load step, but those in which keys advance; 0: 500 */
  uint32_t max_iterations;
  uint32_t reserved;
  uint64_t cookie; /* set by the default function */
} dfm_equilibrium_def;
typedef struct dfm_equilibrium_info {
  uint32_t size;
  uint32_t load_steps; /* number taken */
  uint64_t iterations; /* steps from rest, of all load steps */
  double residual; /* of the last load step: residual force over the largest load or reaction, worst body */
} dfm_equilibrium_info;
/** dfm_equilibrium_def_default into a def of any size (base.h). Threads: Any thread. Since 0.1. */
DFM_API void dfm_equilibrium_def_default_sized(uint32_t size, dfm_equilibrium_def *out);
/** One load step, from no load to full load, without time passing. Threads: Any thread. Since 0.1. */
static inline dfm_equilibrium_def dfm_equilibrium_def_default(void) {
  dfm_equilibrium_def out;
  dfm_equilibrium_def_default_sized((uint32_t)sizeof out, &out);
  return out;
}
/** Moves all bodies to an equilibrium of internal forces, contact, friction, gravity, loads and springs, with
 * held points and obstacles at their prescribed places; velocities are zero (doc/concepts/static.md).
 * Relaxation and flow are complete. dfm_world_interrupt stops a search.
 * @param def   NULL: the default
 * @param info  out; may be NULL
 * @return DFM_OK; DFM_E_DIVERGED no equilibrium was found: a body without support has loads that do not
 * sum to zero, slides on, or falls; DFM_E_UNSUPPORTED a model without stiffness, or rigid bodies;
 * DFM_DISCARD interrupted; DFM_E_ARG; DFM_E_NOMEM; DFM_E_HANDLE; DFM_E_BUSY.
 * On failure nothing has changed except scheduled changes of model (model.h).
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_equilibrium(dfm_world world, const dfm_equilibrium_def *def,
                                         dfm_equilibrium_info *info);
/** Sets the budget of a step, as max_time and max_work of dfm_world_def.
 * @return DFM_OK; DFM_E_ARG max_time below zero or not a number. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_set_budget(dfm_world world, double max_time, uint64_t max_work);
/** Requests the running step, or else the next one, to stop: it returns DFM_DISCARD with
 * DFM_TROUBLE_INTERRUPTED at the end of the present sweep, guard query or stage, and the state is as before
 * the step. A function of a plugin is not interrupted.
 * @return DFM_OK; DFM_E_HANDLE not a world's handle (stale handles are not detected); DFM_E_NOMEM requests
 * for 64 other worlds are pending
 * Threads: Any thread. May be called from a signal handler. Since 0.1. */
DFM_API dfm_status dfm_world_interrupt(dfm_world world);
/* Two things that overlapped by more than the rest distance when they were created or placed. */
enum {
  DFM_OVERLAP_OBSTACLE = 1, /* b is an obstacle or a rigid body */
  /* too deep for contact to separate: the pair does not touch until it is apart */
  DFM_OVERLAP_ASIDE = 2,
  DFM_OVERLAP_SEPARATED = 4 /* the pair was moved apart */
};
typedef struct dfm_overlap {
  uint32_t size, flags; /* DFM_OVERLAP_* */
  dfm_body a;
  uint64_t b; /* dfm_body or dfm_obstacle */
  /* pairs of triangles that cross; for a plane, a sphere or a capsule: triangles of a that it intersects */
  uint32_t crossings;
  uint32_t enclosed; /* surface points of one that lie inside the other */
  double depth;      /* m, the deepest of them, from the surface */
} dfm_overlap;
/** dfm_world_overlaps with rows of any size. @param row_size bytes from one row of out to the next
 * (base.h). Since 0.1.
 * Threads: Not during step. */
DFM_API dfm_status dfm_world_overlaps_sized(dfm_world world, uint32_t row_size, uint32_t capacity,
                                            dfm_overlap *out, uint32_t *n);
/** Overlaps found by the last check, and earlier ones that no step has reported. The library checks things
 * that were created, placed or restored once, in the next call that needs the plan (a step at the latest),
 * and not in every step. Filtered pairs are left out.
 * capacity 0 with out NULL only counts.
 * @return DFM_OK; DFM_E_ARG too small; DFM_E_HANDLE; DFM_E_BUSY. Threads: Not during step. Since 0.1. */
static inline dfm_status dfm_world_overlaps(dfm_world world, uint32_t capacity, dfm_overlap *out,
                                            uint32_t *n) {
  return dfm_world_overlaps_sized(world, (uint32_t)sizeof(dfm_overlap), capacity, out, n);
}
/** Checks all pairs now, and changes nothing; dfm_world_overlaps then lists the result.
 * @param n  out, pairs; may be NULL. Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_find_overlaps(dfm_world world, uint32_t *n);

/** Moves overlapping bodies apart, as DFM_WORLD_UNTANGLE does for new ones: whole bodies are translated by
 * the shortest displacement found, which adds neither elastic energy nor velocity. Bodies with held points,
 * attached bodies, parts of one body, obstacles and rigid bodies stay. Pairs that cannot be separated stay,
 * and the log says why.
 * @param left  out, pairs that still overlap; may be NULL. @return DFM_OK; DFM_E_HANDLE; DFM_E_BUSY. Threads:
 * Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_untangle(dfm_world world, uint32_t *left);

/** The longest step that needs no sub-steps: (4, 5, 6, 7) 2^k s, at most 0.9 of the proven bound; +INFINITY
 * without a bound. It can be passed to dfm_world_step each time: it follows the bound down at once and up
 * with delay, so that steps change rarely (doc/concepts/step.md). dfm_world_stats.stable_step has 0.9 of the
 * bound. IMPLICIT_EULER and TR_BDF2 have no bound; for them it follows the error of the last step, up to
 * 1/30 s (doc/concepts/implicit.md).
 * @param dt          out, s
 * @param body,point  out, the point that determines the bound; may be NULL
 * @return DFM_OK; DFM_E_HANDLE; DFM_E_FATAL a plugin gave no step bound. Threads: Not during
 * step. Since 0.1. */
DFM_API dfm_status dfm_world_stable_step(dfm_world world, double *dt, dfm_body *body, uint32_t *point);
/** Simulated time, s; NAN for a stale handle. Threads: Any thread. Not during step. Since 0.1. */
DFM_API double dfm_world_time(dfm_world world);

/** FNV-1a hash, 64 bits, of x, v, model state, contact keys and bristles, in id order, and of the model and
 * its parameters for bodies whose model differs from that at the first step; 0 for a stale handle
 * and during a step. Threads: Any thread. Not during step. Since 0.1. */
DFM_API uint64_t dfm_world_hash(dfm_world world);
/** Writes the whole state on which later results depend. buffer NULL: *bytes gets the size needed. Too small:
 * DFM_E_ARG and the size.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_snapshot(dfm_world world, void *buffer, size_t *bytes);
/** Restores a snapshot into a world with the same bodies and obstacles (also a scene loaded again in another
 * process): state, contacts, loads, holds, motions, gravity, filters, friction rules, models with their
 * parameters. The next steps give the same bits; unread events are dropped.
 * @return DFM_OK; DFM_E_FORMAT damaged, of another version, or of a different world; DFM_E_UNSUPPORTED a
 * law or a model is not loaded; DFM_E_NOMEM; DFM_E_HANDLE. On failure nothing has changed. Threads: Not
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
  /* of the last step; contacts to sweeps: of its last sub-step */
  uint32_t last_substeps, contacts, sticking, passes, sweeps, pairs_tested;
  double residual; /* m/s, of the last sub-step */
  uint32_t contacts_max, passes_max, sweeps_max;
  double contacts_mean, residual_max;                  /* since creation */
  uint64_t unconverged, guard_steps, rebuilds, refits; /* since creation */
  uint32_t inverted_max, substeps_max;                 /* since creation */
  double stable_step;                                  /* s, 0.9 of the bound at its last evaluation */
  /* bodies that sleep now; bodies that touch themselves */
  uint32_t asleep, self_bodies;
  /* J and N s that bodies had when they fell asleep, sum since creation */
  double sleep_energy, sleep_momentum[3];
  /* since creation: solves with hits of the guard as contacts; sub-steps repeated with a shorter length */
  uint64_t guard_solves, guard_cuts;
  double guard_lost; /* s since creation: motion removed because neither was enough */
  /* contact solves repeated for a rigid host (DFM_RIGID_AGAIN), since creation */
  uint64_t rigid_again;
  /* units of the last step, also if it was interrupted; maximum since creation (doc/concepts/budget.md) */
  uint64_t work, work_max;
  /* steps simplified because of their budget; steps abandoned because of dfm_world_interrupt */
  uint64_t cheapened, discarded;
  /* largest number at one time, since creation: cells so distorted that their model limited their stiffness;
   * bodies that touch themselves */
  uint32_t limited_max, self_max;
  /* J, kinetic and elastic energy of the bodies that the energy watch checks (the plan lists them): at the
   * first step; the maximum. Between two checks the kinetic energy of the motion without contact counts */
  double energy_start, energy_max;
  /* J, the largest gain beyond the work of loads, motions and contact */
  double energy_gain;
  /* steps that ended before their end because their budget was used up, since creation */
  uint64_t shortened;
} dfm_world_stats;
/** @return DFM_OK; DFM_E_HANDLE. Threads: Any thread. Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_get_stats(dfm_world world, dfm_world_stats *out);

/** Bytes that a world uses now, allocated by the hooks of its context. Not included: memory that plugins
 * allocate (dfm_host.alloc), meshes of the context, names and lists of a few bytes. */
typedef struct dfm_memory {
  uint32_t size, reserved;
  uint64_t bodies;    /* points, cells, surfaces, couplings, data of models */
  uint64_t dynamics;  /* time integration: matrices and factors of implicit bodies */
  uint64_t obstacles; /* surfaces and voxels of obstacles */
  uint64_t detection; /* trees and lists of pairs */
  uint64_t contacts;  /* contact solve, state and reports */
  uint64_t steps;     /* other buffers of a step */
  uint64_t total;     /* sum */
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
/** Wall-clock seconds in each stage of the plan since creation.
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
 * "step":{"stable_s","worst_body","worst_point","reason"}, "auto":{"steps_s","implicit_s","changes"}}.
 * state: "asked" by the list of effects, "called for" by parameters; left_out: called for, not in the list;
 * laws: asked: the law that the rules name; auto: null, or the time in which integrators may change, and what
 * of it was implicit; surface: "boundary" of cells, or "own, COUPLING"; from: source of values that differ by
 * cell (field, materials, share); idle: parameters without effect, or with another one than their name says;
 * effects: effects of the model, whether they act and are used, and the parameters that together switch each
 * off (switchable: whether a law's effect can be); facts: numbers that the model computed at creation;
 * changes: scheduled models of the body (integrator and max_jump_J if given); unwatched: why the energy watch
 * does not check the body, "" if it does.
 * @param text NULL: *bytes gets the size needed, in bytes. @return DFM_OK; DFM_E_ARG; DFM_E_HANDLE.
 * Threads: Not during step. Since 0.1. */
DFM_API dfm_status dfm_world_explain(dfm_world world, char *text, size_t *bytes);
#ifdef __cplusplus
}
#endif
#endif
