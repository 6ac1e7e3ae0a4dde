// A model to copy and edit, that of ../template_model.c in C++: a spring with a damper on each edge of the
// mesh. The host owns positions, velocities and forces; an object keeps what it needs of the mesh.
// E = sum k/2 (l - L)^2; the force on the first point of an edge is (k (l - L) + c dl/dt) e.
#include <cmath>
#include <vector>
#include <deform/plugin.hpp>

namespace dp = dfm::plugin;
namespace {

enum { kStiffness, kDamper };
constexpr dfm_param params[] = {
    dp::param("stiffness", "of each edge", "N/m", 1e-3, 1e9, 500, DFM_PARAM_LOG_SCALE),
    dp::param("damper", "of each edge", "N s/m", 0, 1e6, 0.05)};

// Its points, its direction from the first to the second (none where they meet), its length.
struct Edge {
  uint32_t a, b;
  double e[3], length;
};

class Net {
 public:
  Net(const dfm_host &, const dfm_mesh &m)
      : k_(m.params[kStiffness]),
        c_(m.params[kDamper]),
        npoint_(m.npoint),
        edges_(m.edges, m.edges + 2 * size_t(m.nedge)) {
    for (size_t n = 0; n < m.nedge; ++n) rest_.push_back(edge(n, m.rest, 3).length);
  }

  void add_forces(const dfm_kin *kin, double *f) const {
    for (size_t n = 0; n < rest_.size(); ++n) {
      const Edge g = edge(n, kin->x, kin->stride);
      const size_t a = size_t(g.a) * kin->stride, b = size_t(g.b) * kin->stride;
      double pull = k_ * (g.length - rest_[n]);
      for (size_t i = 0; i < 3; ++i) pull += c_ * g.e[i] * (kin->v[b + i] - kin->v[a + i]);
      for (size_t i = 0; i < 3; ++i) {
        f[a + i] += pull * g.e[i];
        f[b + i] -= pull * g.e[i];
      }
    }
  }

  void energy(const dfm_kin *kin, double *joule) const {
    *joule = 0;
    for (size_t n = 0; n < rest_.size(); ++n) {
      const double longer = edge(n, kin->x, kin->stride).length - rest_[n];
      *joule += 0.5 * k_ * longer * longer;
    }
  }

  // Row sums of absolute values: those of e e^T are at most (1 + sqrt 3)/2, and both points take part.
  void bound(const dfm_kin *kin, double *ksum, double *csum, double *) const {
    const double row = 2 * 1.3661;
    for (size_t n = 0; n < rest_.size(); ++n) {
      const Edge g = edge(n, kin->x, kin->stride);
      for (const uint32_t point : {g.a, g.b}) {
        ksum[point] += row * k_ + 2 * row * across(g, n);
        csum[point] += row * c_;
      }
    }
  }

  // Blocks: each point with itself, then the edges.
  void pattern(uint32_t *nb, uint32_t *ij) const {
    *nb = npoint_ + uint32_t(rest_.size());
    if (!ij) return;
    for (uint32_t i = 0; i < npoint_; ++i) ij[2 * i] = ij[2 * i + 1] = i;
    for (size_t n = 0; n < edges_.size(); ++n) ij[2 * size_t(npoint_) + n] = edges_[n];
  }

  void stiffness(const dfm_kin *kin, double alpha, double beta, double *blk) const {
    for (size_t n = 0; n < rest_.size(); ++n) {
      const Edge g = edge(n, kin->x, kin->stride);
      const double side = alpha * across(g, n);
      for (size_t i = 0; i < 3; ++i)
        for (size_t j = 0; j < 3; ++j) {
          const double k = (alpha * k_ + beta * c_ - side) * g.e[i] * g.e[j] + (i == j ? side : 0);
          blk[9 * size_t(g.a) + 3 * i + j] -= k;
          blk[9 * size_t(g.b) + 3 * i + j] -= k;
          blk[9 * (npoint_ + n) + 3 * i + j] += k;
        }
    }
  }

 private:
  Edge edge(size_t n, const double *x, size_t stride) const {
    Edge g = {edges_[2 * n], edges_[2 * n + 1], {}, 0};
    for (size_t i = 0; i < 3; ++i) g.e[i] = x[g.b * stride + i] - x[g.a * stride + i];
    g.length = std::sqrt(g.e[0] * g.e[0] + g.e[1] * g.e[1] + g.e[2] * g.e[2]);
    for (size_t i = 0; i < 3 && g.length != 0; ++i) g.e[i] /= g.length;
    return g;
  }
  // Stiffness across an edge: that of a taut string. Negative where the edge is shorter than at rest, and
  // left out there: an implicit step needs a matrix without positive directions.
  double across(const Edge &g, size_t n) const {
    return g.length > rest_[n] ? k_ * (1 - rest_[n] / g.length) : 0;
  }

  double k_, c_;
  uint32_t npoint_;
  std::vector<uint32_t> edges_;  // [nedge,2]
  std::vector<double> rest_;     // [nedge] m
};

constexpr uint32_t kClaims =
    DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING | DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE;
const dfm_model model = {sizeof(dfm_model),
                         kClaims,
                         DFM_CELL_TET,
                         0,
                         nullptr,
                         dp::make<Net>,
                         dp::unmake<Net>,
                         nullptr,
                         nullptr,
                         dp::method<&Net::add_forces>,
                         dp::method<&Net::bound>,
                         dp::method<&Net::energy>,
                         dp::method<&Net::pattern>,
                         dp::method<&Net::stiffness>,
                         nullptr,
                         0,
                         0};
const char *const effects[] = {"large_rotation", "damping", nullptr};
const dfm_type type =
    dp::type(DFM_KIND_MODEL, "org.deform.template_model", "springs on edges", "1.0", "MIT",
             "Provot 1995, Deformation constraints in a mass-spring model", params, effects, &model);

}  // namespace
DFM_PLUGIN(&type)
