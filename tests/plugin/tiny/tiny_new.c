/* Built against a newer header: every struct and every parameter row is longer than this library knows. */
#include "deform/plugin.h"

struct new_param {
  dfm_param known;
  double added[3];
};
struct new_slot {
  dfm_slot known;
  uint64_t added[2];
};
struct new_slots {
  dfm_slots known;
  uint64_t added[2];
};
struct new_friction {
  dfm_friction known;
  void *added[4];
};
struct new_type {
  dfm_type known;
  void *added[4];
};
struct new_plugin {
  dfm_plugin known;
  void *added[4];
};

static const struct new_param rows[] = {
    {{"first", "first", "N", 0.0, 10.0, 1.0, 0, 1, NULL}, {7, 7, 7}},
    {{"second", "second", "N", 0.0, 10.0, 2.0, 0, 1, NULL}, {7, 7, 7}},
};

static const struct new_slot slots[] = {{{DFM_PER_CONTACT, 2, DFM_SLOT_TANGENT, 0}, {7, 7}},
                                        {{DFM_PER_CONTACT, 3, DFM_SLOT_SCALAR, 0}, {7, 7}}};
static const struct new_slots all = {{sizeof(struct new_slots), 2, &slots[0].known, sizeof slots[0], 0},
                                     {7, 7}};
static const struct new_slots first = {{sizeof(struct new_slots), 1, &slots[0].known, sizeof slots[0], 0},
                                       {7, 7}};
static const dfm_slots *state(const double *params) { return params[1] > 0 ? &all.known : &first.known; }

static dfm_status eval(const dfm_friction_in *in, dfm_friction_out *out) {
  uint32_t i, column;
  for (i = 0; i < in->n; ++i) {
    out->ft[i] = in->params[0];
    out->ft[in->stride + i] = in->params[1];
    for (column = 0; out->state && column < (in->params[1] > 0 ? 5u : 2u); ++column)
      out->state[column * in->stride + i] = column;
  }
  return DFM_OK;
}

static const struct new_friction law = {{sizeof(struct new_friction), 0, 0, 2, &slots[0].known, eval, NULL,
                                         NULL, NULL, state, sizeof slots[0], 0, NULL},
                                        {NULL, NULL, NULL, NULL}};
static const struct new_type type = {
    {sizeof(struct new_type), DFM_KIND_FRICTION, "org.tiny.new", "new", "1.0", "MIT", "test",
     (const dfm_param *)rows, 2, sizeof(struct new_param), NULL, &law},
    {NULL, NULL, NULL, NULL}};
static const dfm_type *const types[] = {&type.known};
static const struct new_plugin plugin = {{sizeof(struct new_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL},
                                         {NULL, NULL, NULL, NULL}};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin.known : NULL;
}
