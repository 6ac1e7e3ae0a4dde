/* A linear solver: dense Cholesky of at most 40 points. */
#include <math.h>

#include "deform/plugin.h"

#ifndef KIND
#define KIND DFM_SOLVER_DIRECT
#endif
enum { kMax = 40 };

typedef struct Cholesky {
  const dfm_host *host;
  uint32_t n, nb;
  uint32_t *ij;
  double *l; /* [3n,3n] lower triangle */
} Cholesky;

static size_t pair_bytes(const Cholesky *c) { return 2 * sizeof(uint32_t) * c->nb; }
static size_t matrix_bytes(const Cholesky *c) { return 9 * sizeof(double) * c->n * c->n; }

static void release(void *self) {
  Cholesky *c = self;
  const dfm_host *host = c->host;
  if (c->l) host->release(host->ctx, c->l, matrix_bytes(c), 64);
  if (c->ij) host->release(host->ctx, c->ij, pair_bytes(c), 64);
  host->release(host->ctx, c, sizeof *c, 64);
}

static dfm_status analyse(const dfm_host *host, uint32_t n, uint32_t nb, const uint32_t *ij, void **self) {
  Cholesky *c;
  uint32_t k;
  if (n > kMax) {
    host->log(host->ctx, 3, 0, "tiny solver: at most 40 points");
    return DFM_E_UNSUPPORTED;
  }
  c = host->alloc(host->ctx, sizeof *c, 64);
  if (!c) return DFM_E_NOMEM;
  c->host = host;
  c->n = n;
  c->nb = nb;
  c->ij = host->alloc(host->ctx, pair_bytes(c), 64);
  c->l = host->alloc(host->ctx, matrix_bytes(c), 64);
  if (!c->ij || !c->l) {
    release(c);
    return DFM_E_NOMEM;
  }
  for (k = 0; k < 2 * nb; ++k) c->ij[k] = ij[k];
  *self = c;
  return DFM_OK;
}

static dfm_status factor(void *self, const double *blk) {
  Cholesky *c = self;
  const size_t m = 3 * (size_t)c->n;
  size_t i, j, k;
  double *const l = c->l;
  for (i = 0; i < m * m; ++i) l[i] = 0;
  for (i = 0; i < 9 * (size_t)c->nb; ++i) {
    const size_t row = 3 * c->ij[2 * (i / 9)] + i % 9 / 3, column = 3 * c->ij[2 * (i / 9) + 1] + i % 3;
    if (row >= column) l[row * m + column] = blk[i];
    else l[column * m + row] = blk[i];
  }
  for (j = 0; j < m; ++j) {
    for (i = j; i < m; ++i) {
      for (k = 0; k < j; ++k) l[i * m + j] -= l[i * m + k] * l[j * m + k];
      if (i == j && !(l[j * m + j] > 0)) return DFM_DISCARD;
      l[i * m + j] = i == j ? sqrt(l[j * m + j]) : l[i * m + j] / l[j * m + j];
    }
  }
  return DFM_OK;
}

static dfm_status solve(void *self, uint32_t nrhs, const double *b, double *x, double tolerance) {
  const Cholesky *c = self;
  const size_t m = 3 * (size_t)c->n;
  size_t i, k;
  (void)tolerance;
  for (; nrhs > 0; --nrhs, b += m, x += m) {
    for (i = 0; i < m; ++i) {
      x[i] = b[i];
      for (k = 0; k < i; ++k) x[i] -= c->l[i * m + k] * x[k];
      x[i] /= c->l[i * m + i];
    }
    for (i = m; i-- > 0;) {
      for (k = i + 1; k < m; ++k) x[i] -= c->l[k * m + i] * x[k];
      x[i] /= c->l[i * m + i];
    }
  }
  return DFM_OK;
}

static const dfm_solver solver = {sizeof(dfm_solver), KIND, analyse, factor, solve, release};
static const dfm_type type = {sizeof(dfm_type),
                              DFM_KIND_SOLVER,
                              "org.tiny.cholesky",
                              "dense Cholesky",
                              "1.0",
                              "MIT",
                              "test",
                              NULL,
                              0,
                              sizeof(dfm_param),
                              NULL,
                              &solver};
#include "../one_type.h"
