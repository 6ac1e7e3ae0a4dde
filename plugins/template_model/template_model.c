/* A model to copy and edit: a spring with a damper on each edge of the mesh. The host owns positions,
 * velocities and forces; the instance keeps what it needs of the mesh.
 * E = sum k/2 (l - L)^2; the force on the first point of an edge is (k (l - L) + c dl/dt) e. */
#include <math.h>
#include <string.h>
#include <deform/plugin.h>

static const dfm_param params[] = {
    {"stiffness", "of each edge", "N/m", 1e-3, 1e9, 500.0, DFM_PARAM_LOG_SCALE, 1, NULL},
    {"damper", "of each edge", "N s/m", 0.0, 1e6, 0.05, 0, 1, NULL}};

typedef struct Net {
  const dfm_host *host;
  double k, c;
  uint32_t npoint, nedge;
  size_t bytes;    /* of all of it, in one piece */
  double *rest;    /* [nedge] m */
  uint32_t *edges; /* [nedge,2] */
} Net;

/* Length and direction; no direction where two points meet. */
static double apart(const double *a, const double *b, double e[3]) {
  for (int i = 0; i < 3; ++i) e[i] = b[i] - a[i];
  const double l = sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]);
  for (int i = 0; i < 3 && l != 0; ++i) e[i] /= l;
  return l;
}

static dfm_status create(const dfm_host *host, const dfm_mesh *m, void **self) {
  const size_t head = (sizeof(Net) + 63) / 64 * 64;
  const size_t bytes = head + m->nedge * (sizeof(double) + 2 * sizeof(uint32_t));
  char *memory = host->alloc(host->ctx, bytes, 64);
  double e[3];
  if (!memory) return DFM_E_NOMEM;
  Net *net = (Net *)memory;
  net->host = host;
  net->k = m->params[0];
  net->c = m->params[1];
  net->npoint = m->npoint;
  net->nedge = m->nedge;
  net->bytes = bytes;
  net->rest = (double *)(memory + head);
  net->edges = (uint32_t *)(net->rest + m->nedge);
  memcpy(net->edges, m->edges, 2 * sizeof(uint32_t) * m->nedge);
  for (size_t n = 0; n < m->nedge; ++n)
    net->rest[n] = apart(m->rest + 3 * (size_t)m->edges[2 * n], m->rest + 3 * (size_t)m->edges[2 * n + 1], e);
  *self = net;
  return DFM_OK;
}

static void destroy(void *self) {
  Net *net = self;
  net->host->release(net->host->ctx, net, net->bytes, 64);
}

/* The length of edge n as it is now; a and b: where its points stand in arrays of the host. */
static double edge(const Net *net, const dfm_kin *kin, size_t n, size_t *a, size_t *b, double e[3]) {
  *a = (size_t)net->edges[2 * n] * kin->stride;
  *b = (size_t)net->edges[2 * n + 1] * kin->stride;
  return apart(kin->x + *a, kin->x + *b, e);
}

static dfm_status add_forces(void *self, const dfm_kin *kin, double *f) {
  const Net *net = self;
  for (size_t n = 0; n < net->nedge; ++n) {
    size_t a, b;
    double e[3];
    double pull = net->k * (edge(net, kin, n, &a, &b, e) - net->rest[n]);
    for (int i = 0; i < 3; ++i) pull += net->c * e[i] * (kin->v[b + i] - kin->v[a + i]);
    for (int i = 0; i < 3; ++i) {
      f[a + i] += pull * e[i];
      f[b + i] -= pull * e[i];
    }
  }
  return DFM_OK;
}

static dfm_status energy(void *self, const dfm_kin *kin, double *joule) {
  const Net *net = self;
  *joule = 0;
  for (size_t n = 0; n < net->nedge; ++n) {
    size_t a, b;
    double e[3];
    const double longer = edge(net, kin, n, &a, &b, e) - net->rest[n];
    *joule += 0.5 * net->k * longer * longer;
  }
  return DFM_OK;
}

/* Stiffness across an edge: that of a taut string. Negative where the edge is shorter than at rest, and left
 * out there: an implicit step needs a matrix without positive directions. */
static double across(const Net *net, double l, size_t n) {
  return l > net->rest[n] ? net->k * (1 - net->rest[n] / l) : 0;
}

/* Row sums of absolute values: those of e e^T are at most (1 + sqrt 3)/2, and both points take part. */
static dfm_status bound(void *self, const dfm_kin *kin, double *ksum, double *csum, double *dt) {
  const Net *net = self;
  const double row = 2 * 1.3661;
  (void)dt;
  for (size_t n = 0; n < net->nedge; ++n) {
    size_t a, b;
    double e[3];
    const double l = edge(net, kin, n, &a, &b, e);
    for (int side = 0; side < 2; ++side) {
      ksum[net->edges[2 * n + side]] += row * net->k + 2 * row * across(net, l, n);
      csum[net->edges[2 * n + side]] += row * net->c;
    }
  }
  return DFM_OK;
}

/* Blocks: each point with itself, then the edges. */
static dfm_status pattern(const void *self, uint32_t *nb, uint32_t *ij) {
  const Net *net = self;
  *nb = net->npoint + net->nedge;
  for (uint32_t i = 0; ij && i < net->npoint; ++i) ij[2 * i] = ij[2 * i + 1] = i;
  if (ij) memcpy(ij + 2 * (size_t)net->npoint, net->edges, 2 * sizeof(uint32_t) * net->nedge);
  return DFM_OK;
}

static dfm_status stiffness(void *self, const dfm_kin *kin, double alpha, double beta, double *blk) {
  const Net *net = self;
  for (size_t n = 0; n < net->nedge; ++n) {
    size_t a, b;
    double e[3];
    const double side = alpha * across(net, edge(net, kin, n, &a, &b, e), n);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double k = (alpha * net->k + beta * net->c - side) * e[i] * e[j] + side * (i == j);
        blk[9 * (size_t)net->edges[2 * n] + 3 * i + j] -= k;
        blk[9 * (size_t)net->edges[2 * n + 1] + 3 * i + j] -= k;
        blk[9 * (net->npoint + n) + 3 * i + j] += k;
      }
  }
  return DFM_OK;
}

enum { CLAIMS = DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT };
static const dfm_model model = {sizeof model,
                                CLAIMS | DFM_CAP_PLAUSIBLE,
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
                                pattern,
                                stiffness,
                                NULL,
                                0,
                                0};
static const char *const effects[] = {"large_rotation", "damping", NULL};
#define ID "org.deform.template_model"
#define SOURCE "Provot 1995, Deformation constraints in a mass-spring model"
static const dfm_type type = {sizeof type, DFM_KIND_MODEL, ID, "springs on edges", "1.0",   "MIT",
                              SOURCE,      params,         2,  sizeof params[0],   effects, &model};
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof plugin, DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL; /* never to a host of another shape */
}
