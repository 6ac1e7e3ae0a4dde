/* Dahl's law, exponent 1, from the template: every slip moves the bristle, and the force comes near the cone
 * as exp(-path sigma0/(mu p)). z <- z on the cone of the new normal force;
 * z' = (z + h v) mu fn/(mu fn + k h |v|); ft = -k z' (Dahl 1968; implicit in h). */
#include <math.h>
#include <deform/plugin.h>

static const dfm_param params[] = {
    {"mu_C", "friction coefficient", "1", 0.0, 10.0, 0.5, DFM_PARAM_RUNTIME, 1, NULL},
    {"sigma0", "bristle stiffness per area", "N/m^3", 1e3, 1e12, 1e8, DFM_PARAM_LOG_SCALE, 1, NULL}};

static double length(const double *a) { return sqrt(a[0] * a[0] + a[1] * a[1]); }
static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  /* column c of contact i is at [c * s + i]; outputs that are NULL are not wanted */
  const size_t s = in->stride;
  for (size_t i = 0; i < in->n; ++i) {
    const double h = in->dt, mu = in->params[0];
    const double k = in->params[1] * in->area[i], cone = in->fn[i] < 0 ? 0 : mu * in->fn[i];
    double z[2] = {in->state[i], in->state[s + i]};
    const double held = k * length(z), onto = held <= cone ? 1 : cone / held; /* a NaN stays one */
    const double v[2] = {in->vt[i], in->vt[s + i]};
    const double path = k * h * length(v), share = path > 0 || cone > 0 ? cone / (cone + path) : 0 * cone;
    for (int a = 0; a < 2; ++a) {
      z[a] = share * (onto * z[a] + h * v[a]);
      if (out->ft) out->ft[a * s + i] = -k * z[a];
      if (out->state) out->state[a * s + i] = z[a];
    }
    if (out->limit) out->limit[i] = cone;
    if (out->mode) out->mode[i] = (uint8_t)(in->fn[i] > 0 ? 1 + (path > cone) : 0); /* open, stick, slip */
    if (out->stored) out->stored[i] = 0.5 * k * (z[0] * z[0] + z[1] * z[1]);
  }
  return DFM_OK;
}

static const dfm_slot state[] = {{DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}}; /* the host keeps and turns it */
static const char *const effects[] = {"presliding", "hysteresis", NULL};
enum { NEEDS = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA };
enum { FLAGS = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE };
static const dfm_friction law = {
    .size = sizeof law, .needs = NEEDS, .flags = FLAGS, .nslot = 1, .slots = state, .eval = eval};
#define ID "com.example.mylaw"
#define SOURCE "Dahl 1968, exponent 1"
static const dfm_type type = {
    sizeof type, DFM_KIND_FRICTION, ID,      "Dahl's law", "1.0", "MIT", SOURCE, params,
    2,           sizeof params[0],  effects, &law};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof plugin, DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL; /* never to a host of another shape */
}
