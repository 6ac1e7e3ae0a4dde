/* M17: the pieces of its work write the same points, in the order in which they are run. */
#define OWN_FORCES
#include "deform/plugin.h"
static dfm_status add_forces(void *self, const dfm_kin *kin, double *f);
#include "net.h"

struct work {
  const Net *net;
  const dfm_kin *kin;
  double *f;
};

static void piece(void *user, uint32_t begin, uint32_t end) {
  const struct work *w = user;
  for (uint32_t i = begin; i < end; ++i) add_edge(w->net, w->kin, w->f, i);
}

static dfm_status add_forces(void *self, const dfm_kin *kin, double *f) {
  const Net *net = self;
  struct work w = {net, kin, f};
  net->host->parallel_for(net->host->ctx, net->n, 256, piece, &w);
  return DFM_OK;
}
