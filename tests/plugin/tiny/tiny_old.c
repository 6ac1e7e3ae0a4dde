/* Built against an older header: every struct ends sooner. What follows each one in memory is not zero, so a
 * host that reads past the stated size shows itself. */
#include "deform/plugin.h"

/* without names */
struct old_param {
  const char *key, *label, *unit;
  double min, max, def;
  uint32_t flags, width;
};
struct old_friction {
  uint32_t size, needs, flags, nslot;
  const dfm_slot *slots;
  dfm_status (*eval)(const dfm_friction_in *, dfm_friction_out *);
};
/* without shutdown */
struct old_plugin {
  uint32_t size, abi, abi_draft, ntype;
  const dfm_type *const *types;
};

static const struct old_param rows[] = {
    {"first", "first", "N", 0.0, 10.0, 1.0, 0, 1},
    {"second", "second", "N", 0.0, 10.0, 2.0, 0, 1},
};

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  uint32_t i;
  for (i = 0; i < in->n; ++i) {
    out->ft[i] = in->params[0];
    out->ft[in->stride + i] = in->params[1];
  }
  return DFM_OK;
}

static const struct {
  struct old_friction law;
  uint64_t beyond[8];
} ops = {
    {sizeof(struct old_friction), 0, 0, 0, NULL, eval},
    {0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0xbadbadbad}};
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_FRICTION,
                              "org.tiny.old",
                              "old",
                              "1.0",
                              "MIT",
                              "test",
                              (const dfm_param *)rows,
                              2,
                              sizeof(struct old_param),
                              NULL,
                              &ops.law};
static const dfm_type *const types[] = {&type};
static const struct {
  struct old_plugin plugin;
  uint64_t beyond[8];
} all = {{sizeof(struct old_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types},
         {0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0xbadbadbad, 0, 0, 0, 0}};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? (const dfm_plugin *)&all.plugin : NULL;
}
