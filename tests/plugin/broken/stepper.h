/* A net that steps itself: symplectic Euler, v' = v + h (f + loads)/m, x' = x + h v'. An impulse at a surfel
 * goes to its points by their weights. */
#define STEPS_ITSELF
#define CAPS (DFM_CAP_ENERGY | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE)
#include "net.h"

#ifndef KEPT_SPEED
#define KEPT_SPEED 1
#endif
#ifndef GIVEN_WEIGHT /* by which an impulse goes to a point */
#define GIVEN_WEIGHT(net, s, e) ((net)->weight[e])
#endif
#ifndef COMMITTED
#define COMMITTED 1
#endif
#ifndef DIAGONAL
#define DIAGONAL 1
#endif
#ifndef MANY
#define MANY 1
#endif
#ifndef FREE_PLACE /* dfm_stepper.fetch */
#define FREE_PLACE NULL
#endif
#ifndef TABLE /* its table of one more extension */
#define TABLE_ID DFM_EXT_FACTS
#define TABLE NULL
#endif
#ifndef OTHER_ID /* what it answers to an id that nobody has given a meaning */
#define OTHER_ID NULL
#endif

/* Forces, then velocities at the end of the step, in net->spread. Held points have an infinite mass. */
static dfm_status predict(void *self, const dfm_kin *kin, const double *load, double *u) {
  Net *net = self;
  memset(net->spread, 0, 3 * sizeof(double) * net->npoint);
  for (uint32_t i = 0; i < net->n; ++i) {
    const size_t a = net->edges[2 * i], b = net->edges[2 * i + 1];
    double e[3];
    const double pull = pull_of(net, kin, i, e);
    for (int k = 0; k < 3; ++k) {
      net->spread[3 * a + k] += pull * e[k];
      net->spread[3 * b + k] -= pull * e[k];
    }
  }
  for (size_t i = 0; i < net->npoint; ++i)
    for (int k = 0; k < 3; ++k) {
      const double f = net->spread[3 * i + k] + load[i * kin->stride + k];
      net->spread[3 * i + k] =
          KEPT_SPEED * (kin->v[i * kin->stride + k] + kin->dt * f / net->rest[net->n + i]);
    }
  for (uint32_t s = 0; s < net->nsurfel; ++s)
    for (int k = 0; k < 3; ++k) {
      u[3 * s + k] = 0;
      for (uint32_t e = net->row[s]; e < net->row[s + 1]; ++e)
        u[3 * s + k] += net->weight[e] * net->spread[3 * (size_t)net->col[e] + k];
    }
  return DFM_OK;
}

/* What an impulse at one surfel gives another: 1/kg. */
static double between(const Net *net, uint32_t to, uint32_t from) {
  double sum = 0;
  for (uint32_t e = net->row[to]; e < net->row[to + 1]; ++e)
    for (uint32_t g = net->row[from]; g < net->row[from + 1]; ++g)
      if (net->col[e] == net->col[g])
        sum += net->weight[e] * GIVEN_WEIGHT(net, from, g) / net->rest[net->n + net->col[e]];
  return sum;
}

static dfm_status respond(void *self, const dfm_kin *kin, uint32_t n, const uint32_t *surfel, const double *p,
                          double *du) {
  (void)kin;
  for (uint32_t i = 0; i < n; ++i) {
    for (int k = 0; k < 3; ++k) du[3 * i + k] = 0;
    for (uint32_t j = 0; j < n; ++j) {
      const double w = between(self, surfel[i], surfel[j]);
      for (int k = 0; k < 3; ++k) du[3 * i + k] += w * p[3 * j + k];
    }
  }
  return DFM_OK;
}

static dfm_status respond_many(void *self, const dfm_kin *kin, uint32_t n, const uint32_t *surfel,
                               uint32_t nrhs, const double *p, double *du) {
  for (uint32_t r = 0; r < nrhs; ++r) {
    respond(self, kin, n, surfel, p + 3 * (size_t)n * r, du + 3 * (size_t)n * r);
    for (uint32_t i = 0; i < 3 * n; ++i) du[3 * (size_t)n * r + i] *= MANY;
  }
  return DFM_OK;
}

static dfm_status diagonal(void *self, const dfm_kin *kin, uint32_t n, const uint32_t *surfel, double *w) {
  (void)kin;
  for (uint32_t i = 0; i < n; ++i)
    for (int k = 0; k < 9; ++k) w[9 * i + k] = k % 4 ? 0 : DIAGONAL * between(self, surfel[i], surfel[i]);
  return DFM_OK;
}

static dfm_status commit(void *self, const dfm_kin *kin, const double *p, double *x, double *v) {
  Net *net = self;
  for (uint32_t s = 0; s < net->nsurfel; ++s)
    for (uint32_t e = net->row[s]; e < net->row[s + 1]; ++e)
      for (int k = 0; k < 3; ++k)
        net->spread[3 * (size_t)net->col[e] + k] +=
            COMMITTED * GIVEN_WEIGHT(net, s, e) * p[3 * s + k] / net->rest[net->n + net->col[e]];
  for (size_t i = 0; i < net->npoint; ++i)
    for (int k = 0; k < 3; ++k) {
      v[i * kin->stride + k] = net->spread[3 * i + k];
      x[i * kin->stride + k] = kin->x[i * kin->stride + k] + kin->dt * net->spread[3 * i + k];
    }
  return DFM_OK;
}

static const dfm_stepper steps = {sizeof(dfm_stepper), 0,           predict, respond, diagonal, commit,
                                  FREE_PLACE,          respond_many};

static const void *extension(const void *self, const char *id) {
  (void)self;
  if (!strcmp(id, "dfm.stepper/1")) return &steps;
  if (!strncmp(id, "dfm.unheard-of", 14)) return OTHER_ID;
  if (!strcmp(id, TABLE_ID)) return TABLE;
  return strcmp(id, DFM_EXT_CELL_ENERGY) ? NULL : &by_cell;
}
#define ADDS_FORCES NULL, NULL
#define WITH_ENERGY energy
#include "net_type.h"
