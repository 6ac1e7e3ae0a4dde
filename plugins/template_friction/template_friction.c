/* A friction law to copy and edit: an elastic bristle z that yields on the friction cone (radial return; Simo
 * and Hughes 1998, box 1.4). z <- z on the cone of the new normal force; t = z + h v;
 * z' = t, or where k |t| > mu fn the point of the cone beside it; ft = -k z'. */
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
    for (int a = 0; a < 2; ++a) z[a] *= onto;
    const double t[2] = {z[0] + h * in->vt[i], z[1] + h * in->vt[s + i]};
    const double trial = k * length(t), share = trial <= cone ? 1 : cone / trial;
    for (int a = 0; a < 2; ++a) {
      double by_fn = share < 1 ? mu * k * t[a] / trial : 0; /* of k z', by fn; below, by v */
      for (int b = 0; b < 2; ++b) {
        const double turn = share * ((a == b) - (share < 1 ? t[a] * t[b] * k * k / (trial * trial) : 0));
        if (onto < 1 && cone > 0) by_fn += turn * mu * k * z[b] / cone;
        if (out->dft_dvt) out->dft_dvt[(2 * a + b) * s + i] = -k * h * turn;
      }
      if (out->dft_dfn) out->dft_dfn[a * s + i] = -by_fn;
      if (out->ft) out->ft[a * s + i] = -k * share * t[a];
      if (out->state) out->state[a * s + i] = share * t[a];
    }
    if (out->limit) out->limit[i] = cone;
    if (out->mode) out->mode[i] = (uint8_t)(in->fn[i] > 0 ? 1 + (share < 1) : 0); /* open, stick, slip */
    if (out->stored) out->stored[i] = 0.5 * share * share * trial * length(t);
  }
  return DFM_OK;
}

static const dfm_slot state[] = {{DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}}; /* the host keeps and turns it */
static const char *const effects[] = {"stiction", "presliding", "hysteresis", NULL};
enum { NEEDS = DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_AREA };
enum { FLAGS = DFM_FRIC_ISOTROPIC | DFM_FRIC_PASSIVE | DFM_FRIC_JACOBIAN };
static const dfm_friction law = {
    .size = sizeof law, .needs = NEEDS, .flags = FLAGS, .nslot = 1, .slots = state, .eval = eval};
#define ID "org.deform.template_friction"
#define SOURCE "Simo and Hughes 1998, box 1.4"
static const dfm_type type = {
    sizeof type,      DFM_KIND_FRICTION, ID,  "bristle on a cone", "1.0", "MIT", SOURCE, params, 2,
    sizeof params[0], effects,           &law};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof plugin, DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL; /* never to a host of another shape */
}
