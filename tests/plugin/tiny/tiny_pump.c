/* A model of a third party with a wrong sign: springs along the edges, whose dampers push where they
 * should brake. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "deform/plugin.h"

static const dfm_param rows[] = {{"stiffness", "of each edge", "N/m", 1.0, 1e6, 500.0, 0, 1, NULL},
                                 {"damper", "of each edge", "N s/m", 0.0, 1e3, 0.05, 0, 1, NULL}};

typedef struct Net {
  double stiffness, damper;
  uint32_t n;
  uint32_t *edges; /* [n,2] */
  double *rest;    /* [n] m */
} Net;

static double apart(const double *a, const double *b, double e[3]) {
  double square = 0, length;
  int k;
  for (k = 0; k < 3; ++k) {
    e[k] = b[k] - a[k];
    square += e[k] * e[k];
  }
  length = sqrt(square);
  for (k = 0; k < 3; ++k) e[k] /= length;
  return length;
}

static void destroy(void *self) {
  Net *net = self;
  free(net->edges);
  free(net->rest);
  free(net);
}

static dfm_status create(const dfm_host *host, const dfm_mesh *m, void **self) {
  Net *net = calloc(1, sizeof *net);
  double e[3];
  uint32_t i;
  (void)host;
  if (!net) return DFM_E_NOMEM;
  net->stiffness = m->params[0];
  net->damper = m->params[1];
  net->n = m->nedge;
  net->edges = malloc(2 * sizeof(uint32_t) * (m->nedge + 1));
  net->rest = malloc(sizeof(double) * (m->nedge + 1));
  if (!net->edges || !net->rest) {
    destroy(net);
    return DFM_E_NOMEM;
  }
  memcpy(net->edges, m->edges, 2 * sizeof(uint32_t) * m->nedge);
  for (i = 0; i < m->nedge; ++i)
    net->rest[i] = apart(m->rest + 3 * (size_t)m->edges[2 * i], m->rest + 3 * (size_t)m->edges[2 * i + 1], e);
  *self = net;
  return DFM_OK;
}

static dfm_status add_forces(void *self, const dfm_kin *kin, double *f) {
  const Net *net = self;
  uint32_t i;
  int k;
  for (i = 0; i < net->n; ++i) {
    const size_t a = (size_t)net->edges[2 * i] * kin->stride, b = (size_t)net->edges[2 * i + 1] * kin->stride;
    double e[3], pull = net->stiffness * (apart(kin->x + a, kin->x + b, e) - net->rest[i]), rate = 0;
    for (k = 0; k < 3; ++k) rate += e[k] * (kin->v[b + k] - kin->v[a + k]);
    pull -= net->damper * rate; /* the wrong sign */
    for (k = 0; k < 3; ++k) {
      f[a + k] += pull * e[k];
      f[b + k] -= pull * e[k];
    }
  }
  return DFM_OK;
}

static dfm_status bound(void *self, const dfm_kin *kin, double *ksum, double *csum, double *dt) {
  const Net *net = self;
  uint32_t i;
  (void)kin;
  (void)dt;
  for (i = 0; i < 2 * net->n; ++i) {
    ksum[net->edges[i]] += 2 * net->stiffness;
    csum[net->edges[i]] += 2 * net->damper;
  }
  return DFM_OK;
}

static dfm_status energy(void *self, const dfm_kin *kin, double *joule) {
  const Net *net = self;
  uint32_t i;
  *joule = 0;
  for (i = 0; i < net->n; ++i) {
    double e[3];
    const double longer = apart(kin->x + (size_t)net->edges[2 * i] * kin->stride,
                                kin->x + (size_t)net->edges[2 * i + 1] * kin->stride, e) -
                          net->rest[i];
    *joule += 0.5 * net->stiffness * longer * longer;
  }
  return DFM_OK;
}

static const dfm_model model = {sizeof(dfm_model),
                                DFM_CAP_ENERGY | DFM_CAP_DAMPING,
                                DFM_CELL_TET,
                                0,
                                NULL,
                                create,
                                destroy,
                                NULL,
                                NULL,
                                add_forces,
                                bound,
                                energy,
                                NULL,
                                NULL,
                                NULL,
                                0,
                                0};
static const char *const effects[] = {"damping", NULL};
static const dfm_type type = {
    sizeof(dfm_type),  DFM_KIND_MODEL, "org.tiny.pump", "pump", "1.0", "MIT", "test", rows, 2,
    sizeof(dfm_param), effects,        &model};
#include "../one_type.h"
