/* deform/plugin.h -- plugin ABI 1. Stand-alone: needs only the two headers below. SI units, binary64, C
 * calling convention. Structs start with their size and grow at the end only. A reader checks
 * the size before it reads a member that was added after the first version of ABI 1; missing members are
 * zero. The size of table rows is given beside the table (param_size, slot_size). Promises and possible
 * additions: doc/reference/abi.md. plugin_draft.h has tables that are not part of the ABI yet.
 * Threads: [setup] no other call on this instance at that time; other instances may be set up and step;
 * [step] one call at a time per instance, instances run concurrently; [batch] re-entrant, many workers at
 * once; [any] on any thread. No C++ exception, exit or longjmp may leave a function. Text is UTF-8.
 * A host refuses a type that sets one of the bits 16 to 31 of flags or caps that the host does not know; it
 * ignores unknown lower bits.
 * Functions: (required) is never NULL, (required: CONDITION) is not NULL under that condition, (optional) may
 * be NULL. Members called reserved, and bits without a name, are 0. `deform plugin check` (V03) refuses a
 * plugin that lacks a required function or sets a reserved member. */
#ifndef DEFORM_PLUGIN_H
#define DEFORM_PLUGIN_H
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
/* Increased by incompatible changes only. 0 were the drafts, which hosts no longer accept. */
#define DFM_ABI 1u
#define DFM_ABI_MIN 1u   /* oldest ABI that this version's host supports */
#define DFM_ABI_DRAFT 0u /* number of a draft; 0 for a frozen ABI */
/* 0 ok, > 0 try again, < 0 failed; never renumbered; base.h includes this header */
typedef int32_t dfm_status;
enum {
  DFM_OK = 0,
  DFM_DISCARD = 1 /* outputs void, nothing changed: host may retry with smaller dt */,
  DFM_E_ARG = -1,
  DFM_E_NOMEM = -2,
  DFM_E_UNSUPPORTED = -3,
  DFM_E_STATE = -4,
  DFM_E_FATAL = -5,
  DFM_E_HANDLE = -6,
  DFM_E_IO = -7,
  DFM_E_FORMAT = -8,
  DFM_E_DIVERGED = -9,
  DFM_E_BUSY = -10
};
/* ---- services of the host for a plugin; valid from entry until the last destroy ------------------ */
typedef struct dfm_host {
  uint32_t size, abi;          /* sizeof this struct in the host; newest ABI that it supports */
  uint32_t abi_draft, abi_min; /* DFM_ABI_DRAFT of the host; oldest ABI that it supports */
  void *ctx;                   /* pass back as the first argument of every call below */
  void *(*alloc)(void *ctx, size_t bytes, size_t align);           /* [any] NULL on failure */
  void (*release)(void *ctx, void *p, size_t bytes, size_t align); /* [any] */
  /* [batch] thread-local, aligned to 64 bytes, NULL on failure; valid until the call, or the block of
   * parallel_for, returns */
  void *(*scratch)(void *ctx, size_t bytes);
  /* [any] level 0 details, 1 information, 2 warning, 3 error: reason of the failure that follows; code:
   * chosen by the plugin */
  void (*log)(void *ctx, int32_t level, uint32_t code, const char *utf8);
  /* [setup][step] blocking. fn may be called for any division at multiples of grain; store partial sums in
   * slot begin/grain and add them in slot order; a call from inside a worker runs serially in the caller. */
  void (*parallel_for)(void *ctx, uint32_t n, uint32_t grain,
                       void (*fn)(void *user, uint32_t begin, uint32_t end), void *user);
  /* [any] a table of further services that begins with its size; NULL: the host has none with that id */
  const void *(*extension)(void *ctx, const char *id);
} dfm_host;
/* ---- self-description ---------------------------------------------------------------------------- */
/* a row; the values of all rows are stored one after the other, width doubles each */
typedef struct dfm_param {
  /* "sigma0", "bristle stiffness per area", "N/m^3"; "1" if dimensionless */
  const char *key, *label, *unit;
  double min, max, def;     /* closed finite range; def inside it */
  uint32_t flags, width;    /* DFM_PARAM_*; doubles per value, 1..16 (3: an axis) */
  const char *const *names; /* DFM_PARAM_ENUM: value k reads names[k], NULL-terminated; else NULL */
} dfm_param;
enum {
  DFM_PARAM_INTEGER = 1,
  DFM_PARAM_LOG_SCALE = 2,
  DFM_PARAM_RUNTIME = 4 /* may change mid-run */,
  DFM_PARAM_ENUM = 8,
  DFM_PARAM_PER_CELL = 16 /* may come as a field of the mesh with this key */,
  DFM_PARAM_AUTO =
      32 /* def means "auto" and is shown so: the plugin computes the value from the other parameters */,
  DFM_PARAM_LIST = 64 /* 1 to width values may be given; the rest are 0 */
};
/* A row: one block of state. It does not grow in ABI 1: rows of this type are always 16 bytes apart, and
 * slot_size is 0 or sizeof(dfm_slot). Longer rows will have another type, whose size is then slot_size. */
typedef struct dfm_slot { uint32_t unit, width, kind, reserved; /* 0 */ } dfm_slot;
enum { DFM_PER_CONTACT = 1, DFM_PER_POINT = 2, DFM_PER_CELL = 3, DFM_PER_EDGE = 4, DFM_PER_INSTANCE = 5 };
enum {
  DFM_SLOT_SCALAR = 1,
  DFM_SLOT_TANGENT = 2 /* pair; rotates with the contact frame */,
  DFM_SLOT_VECTOR = 3,
  DFM_SLOT_ROTATION = 4 /* unit quaternion */
};
/* all state of an instance */
typedef struct dfm_slots {
  uint32_t size, nslot;
  const dfm_slot *slots; /* [nslot] rows of slot_size bytes */
  uint32_t slot_size;    /* bytes per row: sizeof(dfm_slot), or 0 for 16 */
  uint32_t reserved;     /* 0 */
} dfm_slots;
typedef struct dfm_type {
  uint32_t size, kind;                                /* DFM_KIND_* tells what ops points to */
  const char *id, *name, *version, *licence, *source; /* "org.deform.lugre" ...; source = paper, eq. no. */
  const dfm_param *params; /* [nparam] rows of param_size bytes (rows may grow too) */
  uint32_t nparam, param_size;
  /* promises, NULL-terminated: "stiction" "stribeck" ... or "vendor.word" */
  const char *const *effects;
  /* dfm_friction, dfm_model or dfm_solver: grows independently of this head */
  const void *ops;
} dfm_type;
enum { DFM_KIND_FRICTION = 1, DFM_KIND_MODEL = 2, DFM_KIND_SOLVER = 3 };
/* ---- friction law: a pure function of a batch; all memory belongs to the host --------------------- */
enum { DFM_NEED_FN = 1, DFM_NEED_VT = 2, DFM_NEED_FT_STOP = 4, DFM_NEED_AREA = 8, DFM_NEED_DWELL = 16 };
enum {
  DFM_FRIC_ISOTROPIC = 1,
  DFM_FRIC_PASSIVE = 2,
  DFM_FRIC_JACOBIAN = 4,
  DFM_FRIC_SET_VALUED = 8,
  DFM_FRIC_NONE = 16 /* no force at any slip, and no state: hosts do not call it */
};
typedef struct dfm_friction_in { /* SoA; column c of contact i is at [c*stride + i]; 64-byte aligned */
  /* stride % 8 == 0; lanes up to n rounded to 8 may be touched, ignored */
  uint32_t size, n, stride, flags; /* flags: 0 */
  double dt;                       /* s */
  const double *params;            /* shared by the batch (host groups contacts by law and params) */
  const void *data;                /* result of prepare() for params; NULL without prepare */
  const double *fn;                /* [n]   normal force, >= 0 (N) */
  /* [2,n] trial slip, mean over the step = slip path / dt, of the surfel's owner against the other side, in
   * the contact frame (m/s) */
  const double *vt;
  const double *ft_stop;      /* [2,n] tangential force that makes this mean slip zero (N) */
  const double *area, *dwell; /* [n]   m^2, s; NULL unless needed */
  const double *state;        /* [nstate,n] at t */
} dfm_friction_in;
typedef struct dfm_friction_out { /* a pointer that is NULL is not wanted */
  uint32_t size, flags;           /* flags: 0 */
  /* [2,n] force ON the moving side (N); opposes slip; ft_stop while stuck */
  double *ft;
  /* [nstate,n] trial at t+dt, inside the cone of fn; host commits or drops it */
  double *state;
  /* [4,n] row-major 2x2 (N s/m). The symmetric part is used where it is negative semidefinite, the
   * antisymmetric part whole */
  double *dft_dvt;
  double *dft_dfn; /* [2,n] (1) */
  /* [n]   largest force the contact carries before gross slip (N); +inf none */
  double *limit;
  uint8_t *mode;  /* [n]   0 open, 1 stick (presliding included), 2 slip */
  double *stored; /* [n]   energy held in the state (J) */
} dfm_friction_out;
typedef struct dfm_friction {
  uint32_t size, needs, flags, nslot;
  const dfm_slot *slots; /* [nslot], unit DFM_PER_CONTACT; nstate = sum of widths; zero = rest */
  /* [batch] (required) no alloc, no I/O */
  dfm_status (*eval)(const dfm_friction_in *in, dfm_friction_out *out);
  dfm_status (*check)(const double *params, char *why, size_t cap); /* [any] (optional) cross-field rules */
  /* [setup] (optional) tables; on failure data is not read, and prepare has freed its memory */
  dfm_status (*prepare)(const dfm_host *h, const double *params, void **data);
  void (*release)(const dfm_host *h, void *data); /* [setup] (required: with prepare, and not without) */
  /* [any] (optional; NULL: slots) the state that these parameters need, if it depends on them; it replaces
   * slots, which is then the most that any parameters need. Constant data, the same for the same
   * parameters. */
  const dfm_slots *(*state)(const double *params);
  uint32_t slot_size, reserved; /* of slots, as in dfm_slots */
  /* [any] optional (NULL: no effect can be switched off): changes params, the values of all rows, so that the
   * effect, one of dfm_type.effects, is off and nothing else changes; does nothing if it is off already.
   * Parameters that check() accepts it still accepts afterwards. DFM_E_UNSUPPORTED: no parameter switches the
   * effect off. */
  dfm_status (*without)(const char *effect, double *params);
} dfm_friction;
/* ---- deformable model: host owns x, v, f and all state; plugin owns only rebuildable caches -------- */
enum {
  DFM_CAP_ENERGY = 1,
  DFM_CAP_STIFFNESS = 2, /* has pattern and stiffness: implicit steps are possible */
  DFM_CAP_DAMPING = 4,
  DFM_CAP_ROTATION_INVARIANT = 16,
  DFM_CAP_PLAUSIBLE = 32,          /* not derived from a continuum */
  DFM_CAP_CONSTANT_STIFFNESS = 64, /* stiffness depends on the parameters alone: one factorization serves */
  DFM_CAP_INSIDE = 128             /* accepts dfm_mesh.inside */
};
/* [ncell,k] points: 4 corners; those and then the middles of the edges 01 12 02 03 13 23, k = 10; 8 corners,
 * around the bottom, then around the top; those and then the middles of the edges 01 12 23 30 45 56 67 74 04
 * 15 26 37, k = 20; those and then the middles of the faces 0473 1265 0154 3267 0321 4567 and of the cell,
 * k = 27 */
enum { DFM_CELL_TET = 8, DFM_CELL_HEX8 = 16, DFM_CELL_TET10 = 32, DFM_CELL_HEX20 = 64, DFM_CELL_HEX27 = 128 };
typedef struct dfm_mesh {             /* rest configuration; borrowed during create() only */
  uint32_t size, npoint, ncell, cell; /* cell: one DFM_CELL_* */
  /* [npoint,3] m, before the body's pose; after it for a model without DFM_CAP_ROTATION_INVARIANT */
  const double *rest;
  const uint32_t *cells; /* [ncell,k] */
  const double *mass;    /* [npoint] kg */
  const double *params;  /* as in dfm_param */
  /* DFM_PARAM_PER_CELL rows that differ by cell, NULL-terminated ("young") */
  const char *const *field_keys;
  /* [nfield] each [ncell, width of the row of that key], in the row's range */
  const double *const *fields;
  uint32_t nedge, nsurfel;
  /* [nedge,2] i < j, lexicographic: the order of DFM_PER_EDGE state. Of other cells than DFM_CELL_TET
   * those of the tetrahedra of each (dfm_mesh_info) */
  const uint32_t *edges;
  const uint32_t *row, *col; /* coupling N in CSR: surfel s has points col[row[s] .. row[s+1]) */
  const double *weight;      /* [row[nsurfel]]; x_s = sum weight * x_point */
  const uint8_t *fixed;      /* [npoint] held components, bits 1 x, 2 y, 4 z; the host moves them */
  /* [ncell,27] material of hexahedra as dfm_mesh_info describes it, only for a model with
   * DFM_CAP_INSIDE; NULL: whole cells */
  const double *inside;
} dfm_mesh;
typedef struct dfm_kin { /* one evaluation point */
  uint32_t size, stride;
  double t, dt;        /* stride: doubles per point in x, v and f, >= 3; 4 by default */
  const double *x, *v; /* [npoint,stride] m, m/s; 64-byte aligned */
  /* at t; slots end to end, each [count, width] row-major, count by unit */
  const double *state;
  /* trial at t+dt, written by add_forces (steppers: commit); NULL: pure query */
  double *state_out;
} dfm_kin;
typedef struct dfm_model {           /* self is void*: one shared struct tag would break the C++ ODR */
  uint32_t size, caps, cells, nslot; /* DFM_CAP_*, accepted DFM_CELL_* */
  /* state is everything that can change a bit of a later result, warm starts included */
  const dfm_slot *slots;
  /* [setup] (required) on failure self is not read, and create has freed its memory */
  dfm_status (*create)(const dfm_host *h, const dfm_mesh *m, void **self);
  void (*destroy)(void *self); /* [setup] (required) */
  /* [setup] (required: with RUNTIME rows) only those rows differ; on failure nothing has changed */
  dfm_status (*set_params)(void *self, const double *params);
  dfm_status (*state_init)(const void *self, double *state); /* [setup] (optional; NULL: all 0) */
  /* [step] (required: without "dfm.stepper/1") f[npoint,stride] += N */
  dfm_status (*add_forces)(void *self, const dfm_kin *k, double *f);
  /* [step] (required: with add_forces) row sums += N/m, N s/m per point; *dt = min(*dt, cell bound) */
  dfm_status (*bound)(void *self, const dfm_kin *k, double *ksum, double *csum, double *dt);
  /* [step] (required: CAP_ENERGY) f = -dE/dx */
  dfm_status (*energy)(void *self, const dfm_kin *k, double *joule);
  /* [setup] (required: CAP_STIFFNESS) pairs of coupled points, ij[nb,2], i <= j, each pair once, each point
   * with itself. ij NULL: only counts. */
  dfm_status (*pattern)(const void *self, uint32_t *nb, uint32_t *ij);
  /* [step] (required: CAP_STIFFNESS) blk[nb,9] += a*df_i/dx_j + b*df_i/dv_j, row-major, in the order of the
   * pattern; block (j, i) is the transpose of (i, j). f is what add_forces adds at the same k; state_out is
   * NULL. For a, b >= 0 the sum must be negative semidefinite: leave out terms that make it indefinite. */
  dfm_status (*stiffness)(void *self, const dfm_kin *k, double a, double b, double *blk);
  /* [setup] (optional) "dfm.stepper/1" ...: a table that begins with its size and does not change while the
   * instance lives; NULL for ids that the model does not know */
  const void *(*extension)(const void *self, const char *id);
  uint32_t slot_size, reserved; /* of slots, as in dfm_slots */
} dfm_model;
/* Self-stepping model, extension "dfm.stepper/1". Contact, friction, report and pictures see surfels only.
 * Velocities here are means over the step: (x_s(t+dt) - x_s(t)) / dt. The functions of this table and of
 * those below are required unless marked (optional): a model without them returns NULL for the id of the
 * table. A touched body takes no step beyond dfm_model.bound, if the model sets it. */
typedef struct dfm_stepper {
  uint32_t size, reserved; /* reserved: 0, here and in the tables below */
  /* [step] without contact. f_ext [npoint,stride] N: gravity, loads, springs. u_s [nsurfel,3]. Held
   * components of k->v carry their given mean velocity. */
  dfm_status (*predict)(void *self, const dfm_kin *k, const double *f_ext, double *u_s);
  /* [step] p, du_s [n,3] at the same n distinct surfels; linear in p (N s), symmetric, >= 0, same operator
   * for the whole step */
  dfm_status (*respond)(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel, const double *p,
                        double *du_s);
  /* [step] (optional) [n,9] 1/kg, or a bound */
  dfm_status (*diagonal)(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel, double *w);
  /* [step] equals predict + respond. p_s [nsurfel,3] total impulses; x, v [npoint,stride] out at t+dt,
   * not aliasing k */
  dfm_status (*commit)(void *self, const dfm_kin *k, const double *p_s, double *x, double *v);
  void (*fetch)(void); /* NULL: reserved for dfm_fetch_fn of plugin_draft.h */
  /* [step] (optional: NULL, or a smaller size) respond for nrhs right-hand sides at once, p, du_s [nrhs,n,3];
   * otherwise respond is called nrhs times. */
  dfm_status (*respond_many)(void *self, const dfm_kin *k, uint32_t n, const uint32_t *surfel, uint32_t nrhs,
                             const double *p, double *du_s);
} dfm_stepper;
/* Extension "dfm.late_points/1" of a self-stepping model whose state determines all points: a step moves only
 * the points of surfels and the held ones, and computes the others on request. A host that knows the table
 * ends steps by its commit; the other points keep their last computed values in k->x and k->v. The host calls
 * `points` before anything else reads them, and `look` after anything else wrote points. */
#define DFM_EXT_LATE_POINTS "dfm.late_points/1"
typedef struct dfm_late_points {
  uint32_t size, reserved;
  /* [step] as dfm_stepper.commit, but may leave out points that belong to no surfel and are not held */
  dfm_status (*commit)(void *self, const dfm_kin *k, const double *p_s, double *x, double *v);
  /* [step] x, v [npoint,stride]: those left out, of k->state; k->x and k->v may be the same arrays. Never
   * between predict and commit of a step. */
  dfm_status (*points)(void *self, const dfm_kin *k, double *x, double *v);
  /* [step] marks the state so that the next step starts from the points, all of them */
  dfm_status (*look)(const void *self, double *state);
  /* [step] (optional: NULL, or a smaller size) over all points, from k->state and the points that steps move:
   * sums[5] = kinetic and elastic energy, J, and the sum of mass times position, kg m. It replaces a request
   * for all points while the scene runs, and does not change the results of predict. DFM_DISCARD: the points
   * determine the state, so the host must compute the sums from them. */
  dfm_status (*sums)(void *self, const dfm_kin *k, double *sums);
} dfm_late_points;
/* Extension "dfm.cell_energy/1" of a model: elastic energy per rest volume, for pictures
 * and probes. */
#define DFM_EXT_CELL_ENERGY "dfm.cell_energy/1"
typedef struct dfm_cell_energy {
  uint32_t size, reserved;
  /* [step] density[ncell] = J/m^3 */
  dfm_status (*cell_energy)(void *self, const dfm_kin *k, double *density);
} dfm_cell_energy;
/* Extension "dfm.cell_stress/1" of a model: stress of the elastic forces, for pictures and probes.
 */
#define DFM_EXT_CELL_STRESS "dfm.cell_stress/1"
typedef struct dfm_cell_stress {
  uint32_t size, reserved;
  /* [step] stress[ncell,6] = Pa, Cauchy stress as xx yy zz xy yz zx in the axes of the world; tension > 0 */
  dfm_status (*cell_stress)(void *self, const dfm_kin *k, double *stress);
} dfm_cell_stress;
/* Extension "dfm.slots/1" of a model: state of this instance, if its size depends on the parameters. It
 * replaces dfm_model.slots, is read once after create() and does not change while the instance lives. */
#define DFM_EXT_SLOTS "dfm.slots/1"
/* Extension "dfm.effects/1" of a model: those of dfm_type.effects that the present parameters of the instance
 * call for, NULL-terminated. Without it all of them count as active. */
#define DFM_EXT_EFFECTS "dfm.effects/1"
typedef struct dfm_effects {
  uint32_t size, reserved;
  /* [setup] valid until the next call of set_params */
  const char *const *(*active)(const void *self);
} dfm_effects;
/* Extension "dfm.idle/1" of a model: parameters that have no effect with the present values of the others, or
 * another effect than their row says. `why` gives the reason as part of a sentence, without a full stop, for
 * the user; NULL if the parameter acts as its row says. */
#define DFM_EXT_IDLE "dfm.idle/1"
typedef struct dfm_idle {
  uint32_t size, reserved;
  /* [setup] row of dfm_type.params; valid until the next call of set_params */
  const char *(*why)(const void *self, uint32_t row);
} dfm_idle;
/* Extension "dfm.limited/1" of a model: cells so distorted that the model limits their stiffness. */
#define DFM_EXT_LIMITED "dfm.limited/1"
typedef struct dfm_limited {
  uint32_t size, reserved;
  /* [step] as counted by the last call of bound */
  uint32_t (*count)(const void *self);
} dfm_limited;
/* Extension "dfm.caps/1" of a model: the bits of dfm_model.caps that are valid with the present parameters of
 * the instance, if some parameters remove one. A host reads them after create and after set_params. Without
 * CAP_ENERGY the body's energy is neither reported nor watched. set_params is refused and undone if it
 * removes a capability that an implicit step needs. dfm_mesh.rest follows dfm_model.caps, since there is no
 * instance yet. */
#define DFM_EXT_CAPS "dfm.caps/1"
typedef struct dfm_caps {
  uint32_t size, reserved;
  uint32_t (*active)(const void *self); /* [setup] DFM_CAP_*, until the next call of set_params */
} dfm_caps;
/* Extension "dfm.effect_rows/1" of a model: the parameters that switch its effects off. An effect without a
 * row cannot be switched off. If an effect is not in the world's list, the world creates the model with these
 * values. */
#define DFM_EXT_EFFECT_ROWS "dfm.effect_rows/1"
typedef struct dfm_effect_row {
  const char *effect;       /* one of dfm_type.effects */
  uint32_t param, reserved; /* row of dfm_type.params, one wide */
  double off;               /* the effect is off if each of its rows has this value */
} dfm_effect_row;
typedef struct dfm_effect_rows {
  uint32_t size, row_size, n, reserved;
  const dfm_effect_row *rows; /* [n] rows of row_size bytes; constant */
} dfm_effect_rows;
/* Extension "dfm.facts/1" of a model: numbers that the instance computed at creation, for the user. `deform
 * explain` and the summary of a run show them. */
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
/* ---- linear solver for the implicit system: symmetric positive definite, 3x3 blocks --------------- */
enum { DFM_SOLVER_DIRECT = 1 /* exact up to rounding, whatever x holds and the tolerance is */ };
typedef struct dfm_solver { /* all functions are required */
  uint32_t size, flags;     /* DFM_SOLVER_* */
  /* [setup] a matrix of n points: pairs ij[nb,2], i <= j, each pair once, each point with itself, in any
   * order; borrowed during the call. On failure self is not read, and analyse has freed its memory */
  dfm_status (*analyse)(const dfm_host *h, uint32_t n, uint32_t nb, const uint32_t *ij, void **self);
  /* [step] values blk[nb,9], row-major, in that order; block (j, i) is the transpose of (i, j); borrowed
   * during the call. DFM_DISCARD: the matrix is not positive definite. */
  dfm_status (*factor)(void *self, const double *blk);
  /* [step] after a factor() that returned DFM_OK: b, x [nrhs,n,3], not overlapping; starts from x, ends when
   * the residual is tolerance times that of x = 0. DFM_DISCARD: not reached, x is the best found. */
  dfm_status (*solve)(void *self, uint32_t nrhs, const double *b, double *x, double tolerance);
  /* [setup] */
  void (*release)(void *self);
} dfm_solver;
/* ---- entry: the one symbol a plugin exports ------------------------------------------------------- */
/* Whether this host supports the ABI that the plugin is compiled for. The entry of the plugin returns NULL if
 * not. Before this check no member of dfm_host after log may be read. */
#define DFM_ABI_OK(h)                                    \
  ((h)->abi == DFM_ABI ? (h)->abi_draft == DFM_ABI_DRAFT \
                       : (h)->abi > DFM_ABI && (h)->abi_min != 0u && (h)->abi_min <= DFM_ABI)
/* The entry is called once for each context that loads the file, and shutdown once for each entry that
 * returned a plugin; other contexts may run meanwhile. A process runs one of these calls at a time, so none
 * of them may wait for another thread that loads or unloads plugins. The result of the entry is constant and
 * valid while the file is loaded. Do not store a host in a static variable: each instance has its own, which
 * is valid until that shutdown has returned. */
typedef struct dfm_plugin {
  uint32_t size, abi, abi_draft, ntype; /* DFM_ABI, DFM_ABI_DRAFT */
  const dfm_type *const *types;         /* [ntype] array of pointers, so dfm_type may grow */
  void (*shutdown)(void);               /* (optional) */
} dfm_plugin;
typedef const dfm_plugin *(*dfm_plugin_fn)(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min);
#ifdef DFM_STATIC_PLUGIN /* -DDFM_STATIC_PLUGIN=lugre -> dfm_plugin_entry_lugre, no dlopen */
#define DFM_CAT_(a, b) a##b
#define DFM_CAT(a, b) DFM_CAT_(a, b)
#define dfm_plugin_entry DFM_CAT(dfm_plugin_entry_, DFM_STATIC_PLUGIN)
#define DFM_EXPORT
#elif defined(_WIN32)
#define DFM_EXPORT __declspec(dllexport)
#else
#define DFM_EXPORT __attribute__((visibility("default")))
#endif
DFM_EXPORT const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min);
#ifdef __cplusplus
}
#endif
#endif
