/* The rest of a broken law: eval, tables and entry. Hooks, each a macro with a sound default: EFFECTS and
 * FLAGS what it promises, LANE the update of one contact, BEFORE_EVAL a statement at the head of eval,
 * AFTER_LANE one after each contact, STEP the step it uses, EVAL, CHECK, SLOTS, ID, SOURCE, ROWS, NPARAM
 * and PARAM_SIZE of its parameter table; with OWN_ENTRY it brings its entry. */
#include "base.h"

#ifndef SOURCE
#define SOURCE "Simo and Hughes 1998, box 1.4"
#endif
#ifndef EFFECTS
#define EFFECTS "stiction", "presliding", "hysteresis"
#endif
#ifndef FLAGS
#define FLAGS (DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN)
#endif
#ifndef LANE
#define LANE correct_lane
#endif
#ifndef BEFORE_EVAL
#define BEFORE_EVAL
#endif
#ifndef AFTER_LANE
#define AFTER_LANE
#endif
#ifndef STEP
#define STEP in->dt
#endif
#ifndef CHECK
#define CHECK NULL
#endif
#ifndef EVAL
#define EVAL eval
#endif
#ifndef ID
#define ID "org.broken.law"
#endif
#ifndef ROWS
#define ROWS rows
#endif
#ifndef NPARAM
#define NPARAM 2
#endif
#ifndef PARAM_SIZE
#define PARAM_SIZE sizeof(dfm_param)
#endif
#ifndef SLOTS
#define SLOTS {DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}
#endif

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  const uint32_t s = in->stride;
  BEFORE_EVAL
  for (uint32_t i = 0; i < in->n; ++i) {
    const double pressed = in->fn[i] > 0 ? in->fn[i] : 0.0;
    struct lane l = {in->fn[i],
                     STEP,
                     in->params[0],
                     in->params[1] * in->area[i],
                     in->params[0] * pressed,
                     {in->vt[i], in->vt[s + i]},
                     {in->state[i], in->state[s + i]},
                     {0},
                     {0},
                     {0},
                     {0},
                     0,
                     0,
                     0};
    LANE(&l);
    for (uint32_t a = 0; a < 2; ++a) {
      if (out->ft) out->ft[a * s + i] = l.f[a];
      if (out->state) out->state[a * s + i] = l.next[a];
      if (out->dft_dfn) out->dft_dfn[a * s + i] = l.dn[a];
    }
    for (uint32_t k = 0; out->dft_dvt && k < 4; ++k) out->dft_dvt[k * s + i] = l.dv[k];
    if (out->limit) out->limit[i] = l.limit;
    if (out->mode) out->mode[i] = (uint8_t)l.mode;
    if (out->stored) out->stored[i] = l.stored;
    AFTER_LANE
  }
  return DFM_OK;
}

static const dfm_param rows[NPARAM] = {
    {"mu", "friction coefficient", "1", 0.0, 10.0, 0.5, DFM_PARAM_RUNTIME, 1, NULL},
    {"sigma0", "bristle stiffness per area", "N/m^3", 1.0, 1e12, 1e8, DFM_PARAM_LOG_SCALE, 1, NULL}};
static const dfm_slot slots[] = {SLOTS};
static const dfm_friction ops = {sizeof(dfm_friction),
                                 DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA,
                                 FLAGS,
                                 sizeof slots / sizeof slots[0],
                                 slots,
                                 EVAL,
                                 CHECK,
                                 NULL,
                                 NULL,
                                 NULL,
                                 0,
                                 0,
                                 NULL};
static const char *const effects[] = {EFFECTS, NULL};
static const dfm_type type = {
    sizeof(dfm_type), DFM_KIND_FRICTION, ID,  "a law of the tests", "1.0", "MIT", SOURCE, ROWS, NPARAM,
    PARAM_SIZE,       effects,           &ops};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

#ifndef OWN_ENTRY
const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL;
}
#endif
