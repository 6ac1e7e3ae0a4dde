/* What the broken models are made from: springs with dampers along the edges of the mesh keep every rule of
 * `deform plugin check`. A broken model defines what it does otherwise before it includes this, or stepper.h,
 * which makes a body that steps itself of it. */
#ifndef BROKEN_NET_H
#define BROKEN_NET_H
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "deform/plugin.h"

#ifndef CAPS
#define CAPS \
  (DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#endif
#ifndef DAMPER
#define DAMPER 0.05 /* N s/m, of each edge */
#endif
#ifndef DAMPER_KEY
#define DAMPER_KEY "damper"
#endif
#ifndef REST_LENGTH
#define REST_LENGTH(length) (length)
#endif
#ifndef STIFFNESS
#define STIFFNESS(net, edge, e) ((net)->stiffness)
#endif
#ifndef SHORTEST
#define SHORTEST 1e-12 /* m: below it a spring has no direction */
#endif
#ifndef ON_CREATE
#define ON_CREATE
#endif
#ifndef BEFORE_FORCES
#define BEFORE_FORCES
#endif
#ifndef FORCE /* on the first point, along the edge, N */
#define FORCE(pull) (pull)
#endif
#ifndef REACTION /* on the second, less */
#define REACTION(pull) (pull)
#endif
#ifndef AFTER_FORCES
#define AFTER_FORCES
#endif
#ifndef ENERGY
#define ENERGY(sum) (sum)
#endif
#ifndef CELL_ENERGY
#define CELL_ENERGY(sum) (sum)
#endif
#ifndef ALONG_BLOCK
#define ALONG_BLOCK(k) (k)
#endif
#ifndef ACROSS_BLOCK /* of a shortened spring it is negative and left out */
#define ACROSS_BLOCK(k) ((k) > 0 ? (k) : 0)
#endif
#ifndef BOUND
#define BOUND(k) (k)
#endif
#ifndef ON_DESTROY
#define ON_DESTROY free(net->rest);
#endif

#ifndef ROW_FLAGS
#define ROW_FLAGS 0
#endif
static const dfm_param rows[] = {{"stiffness", "of each edge", "N/m", 1.0, 1e4, 500.0, ROW_FLAGS, 1, NULL},
                                 {DAMPER_KEY, "of each edge", "N s/m", 0.0, 10.0, DAMPER, 0, 1, NULL}};

typedef struct Net {
  const dfm_host *host;
  double stiffness, damper, volume, t;
  uint32_t n, npoint, ncell, nsurfel, count;
  uint32_t *edges;         /* [n,2] */
  double *rest;            /* [n] m, then [npoint] kg */
  uint32_t *row, *col;     /* coupling */
  double *weight, *spread; /* and [npoint,3] of a step */
} Net;

/* Its length; e: unit vector, or zero where there is no direction. */
static double apart(const double *a, const double *b, double e[3]) {
  double square = 0, length;
  for (int k = 0; k < 3; ++k) {
    e[k] = b[k] - a[k];
    square += e[k] * e[k];
  }
  length = sqrt(square);
  if (!(length < SHORTEST))
    for (int k = 0; k < 3; ++k) e[k] /= length;
  return length;
}

static void destroy(void *self) {
  Net *net = self;
  free(net->edges);
  ON_DESTROY
  free(net->row);
  free(net->col);
  free(net->weight);
  free(net->spread);
  free(net);
}

static void *copied(const void *from, size_t bytes) {
  void *to = malloc(bytes + 1);
  if (to) memcpy(to, from, bytes);
  return to;
}

static dfm_status create(const dfm_host *host, const dfm_mesh *m, void **self) {
  Net *net = calloc(1, sizeof *net);
  double e[3];
  if (!net) return DFM_E_NOMEM;
  net->host = host;
  net->stiffness = m->params[0];
  net->damper = m->params[1];
  net->n = m->nedge;
  net->npoint = m->npoint;
  net->ncell = m->ncell;
  net->nsurfel = m->nsurfel;
  net->edges = copied(m->edges, 2 * sizeof(uint32_t) * m->nedge);
  net->rest = malloc(sizeof(double) * (m->nedge + m->npoint));
  net->row = copied(m->row, sizeof(uint32_t) * (m->nsurfel + 1));
  net->col = copied(m->col, sizeof(uint32_t) * m->row[m->nsurfel]);
  net->weight = copied(m->weight, sizeof(double) * m->row[m->nsurfel]);
  net->spread = calloc(3 * (size_t)m->npoint, sizeof(double));
  if (!net->edges || !net->rest || !net->row || !net->col || !net->weight || !net->spread) {
    destroy(net);
    return DFM_E_NOMEM;
  }
  for (uint32_t i = 0; i < m->nedge; ++i)
    net->rest[i] = REST_LENGTH(
        apart(m->rest + 3 * (size_t)m->edges[2 * i], m->rest + 3 * (size_t)m->edges[2 * i + 1], e));
  for (uint32_t i = 0; i < m->npoint; ++i)
    net->rest[m->nedge + i] = m->fixed && m->fixed[i] ? INFINITY : m->mass[i];
  for (uint32_t i = 0; i < m->npoint; ++i) net->volume += m->mass[i] / 1000; /* density in the check */
  ON_CREATE
  *self = net;
  return DFM_OK;
}

/* Of one edge, on its first point. */
static double pull_of(const Net *net, const dfm_kin *kin, uint32_t i, double e[3]) {
  const size_t a = (size_t)net->edges[2 * i] * kin->stride, b = (size_t)net->edges[2 * i + 1] * kin->stride;
  double rate = 0;
  const double length = apart(kin->x + a, kin->x + b, e);
  for (int k = 0; k < 3; ++k) rate += e[k] * (kin->v[b + k] - kin->v[a + k]);
  return STIFFNESS(net, i, e) * (length - net->rest[i]) + net->damper * rate;
}

static void add_edge(const Net *net, const dfm_kin *kin, double *f, uint32_t i) {
  double e[3];
  const double pull = pull_of(net, kin, i, e);
  for (int k = 0; k < 3; ++k) {
    f[(size_t)net->edges[2 * i] * kin->stride + k] += FORCE(pull) * e[k];
    f[(size_t)net->edges[2 * i + 1] * kin->stride + k] -= REACTION(pull) * e[k];
  }
}

#ifndef OWN_FORCES
static dfm_status add_forces(void *self, const dfm_kin *kin, double *f) {
  Net *net = self;
  BEFORE_FORCES
  for (uint32_t i = 0; i < net->n; ++i) add_edge(net, kin, f, i);
  AFTER_FORCES
  return DFM_OK;
}
#endif

static dfm_status bound(void *self, const dfm_kin *kin, double *ksum, double *csum, double *dt) {
  const Net *net = self;
  (void)dt;
  for (uint32_t i = 0; i < net->n; ++i) {
    const uint32_t *const q = net->edges + 2 * (size_t)i;
    double e[3];
    const double length = apart(kin->x + (size_t)q[0] * kin->stride, kin->x + (size_t)q[1] * kin->stride, e);
    const double pull = length - net->rest[i], across = length > SHORTEST && pull > 0 ? pull / length : 0;
    for (int side = 0; side < 2; ++side) {
      /* |e_a| (|e_x| + |e_y| + |e_z|) is at most (1 + sqrt 3)/2 in a row */
      ksum[q[side]] += BOUND(2 * STIFFNESS(net, i, e) * (1.3661 + 2 * across));
      csum[q[side]] += 2 * 1.3661 * fabs(net->damper);
    }
  }
  return DFM_OK;
}

static double stored(const Net *net, const dfm_kin *kin) {
  double sum = 0;
  for (uint32_t i = 0; i < net->n; ++i) {
    double e[3];
    const double longer = apart(kin->x + (size_t)net->edges[2 * i] * kin->stride,
                                kin->x + (size_t)net->edges[2 * i + 1] * kin->stride, e) -
                          net->rest[i];
    sum += 0.5 * STIFFNESS(net, i, e) * longer * longer;
  }
  return sum;
}

static dfm_status energy(void *self, const dfm_kin *kin, double *joule) {
  const double sum = stored(self, kin);
  *joule = ENERGY(sum);
  return DFM_OK;
}

static dfm_status cell_energy(void *self, const dfm_kin *kin, double *density) {
  const Net *net = self;
  const double sum = stored(net, kin);
  for (uint32_t c = 0; c < net->ncell; ++c) density[c] = CELL_ENERGY(sum) / net->volume;
  return DFM_OK;
}

/* Each point with itself, then the edges. */
static dfm_status pattern(const void *self, uint32_t *nb, uint32_t *ij) {
  const Net *net = self;
  *nb = net->npoint + net->n;
  for (uint32_t i = 0; ij && i < net->npoint; ++i) ij[2 * i] = ij[2 * i + 1] = i;
  if (ij) memcpy(ij + 2 * (size_t)net->npoint, net->edges, 2 * sizeof(uint32_t) * net->n);
  return DFM_OK;
}

static dfm_status stiffness(void *self, const dfm_kin *kin, double a, double b, double *blk) {
  const Net *net = self;
  for (uint32_t i = 0; i < net->n; ++i) {
    const uint32_t *const q = net->edges + 2 * (size_t)i;
    double e[3];
    const double length = apart(kin->x + (size_t)q[0] * kin->stride, kin->x + (size_t)q[1] * kin->stride, e);
    const double k = STIFFNESS(net, i, e);
    const double across = length > SHORTEST ? a * ACROSS_BLOCK(k * (length - net->rest[i]) / length) : 0;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const double block =
            (ALONG_BLOCK(a * k) + b * net->damper - across) * e[r] * e[c] + across * (r == c);
        blk[9 * (size_t)q[0] + 3 * r + c] -= block;
        blk[9 * (size_t)q[1] + 3 * r + c] -= block;
        blk[9 * ((size_t)net->npoint + i) + 3 * r + c] += block;
      }
  }
  return DFM_OK;
}

static const dfm_cell_energy by_cell = {sizeof(dfm_cell_energy), 0, cell_energy};

#ifndef STEPS_ITSELF
static const void *extension(const void *self, const char *id) {
  (void)self;
#ifdef BY_PART
  if (!strcmp(id, DFM_EXT_PART_FORCES)) return BY_PART;
#endif
#ifdef SINGLE
  if (!strcmp(id, DFM_EXT_F32)) return SINGLE;
#endif
  return strcmp(id, DFM_EXT_CELL_ENERGY) ? NULL : &by_cell;
}
#ifndef WITH_BOUND
#define WITH_BOUND bound
#endif
#define ADDS_FORCES add_forces, WITH_BOUND
#ifndef WITH_ENERGY
#define WITH_ENERGY energy
#endif
#include "net_type.h"
#endif
#endif
