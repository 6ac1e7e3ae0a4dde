// Plastic strain at the points of cells (plastic.h), in the frames of these.
#pragma once
#include <deform/elementary.h>

#include <algorithm>

#include "buffer.h"
#include "cell_blocks.h"
#include "plastic.h"
#include "rotation.h"

namespace model {
namespace plastic {

constexpr double kAtOnce = -1, kNever = 1e300;
constexpr const char *kIdle = "yield is 0";
constexpr const char *kNoFibers =
    "yield excludes anisotropy and energies other than corotational; leave these at their defaults, or "
    "yield at 0";
constexpr const char *kMadeWithout =
    "the body was created without yield and has no plastic strain; create it again with yield";

// The share of the flow that occurs in a step.
inline double flow_in(double creep, double dt) { return creep == kAtOnce ? 1 : 1 - dfm_exp(-creep * dt); }

// The first two times the volume.
struct Yield { double stress, hardening, limit; };
inline Yield yield_of(double stress, double hardening, double limit, double volume) {
  const bool flows = volume > 0 && stress > 0;
  return {flows ? stress * volume : kNever, flows ? hardening * volume : 0, limit > 0 ? limit : kNever};
}

}  // namespace plastic

class CellPoints {
 public:
  // Material and flow of a cell; stresses not times a volume.
  struct Law { double mu, yield, hardening, limit, flow; };
  using Nodes = const double (*)[3];

  void create(const dfm_host *host, uint32_t kind, uint32_t ncell) {
    nodes_ = nodes_of(kind);
    rows_ = uint32_t(cells::rows_of(kind));
    npoint_ = uint32_t(cells::points_of(kind));
    points_.create(host, each() * ncell);
    if (rows_ > nodes_) inner_.create(host, ncell);
  }
  bool empty() const { return points_.empty(); }
  size_t state() const { return size_t(npoint_) * plastic::kState; }  // by cell
  // Null where there are none.
  cells::RestPoints of(uint32_t c) {
    if (points_.empty()) return {};
    double *const weight = &points_[each() * c];
    return {weight, reinterpret_cast<double (*)[3]>(weight + npoint_)};
  }
  cells::RestInner *inner_of(uint32_t c) { return inner_.empty() ? nullptr : &inner_[c]; }

  // Takes from f, elastic forces of the displacements u, those of the plastic strain after the flow, which
  // `next` gets unless it is null.
  void relieve(uint32_t c, const Law &law, const double *state, double *next, Nodes u, double (*f)[3]) const {
    double sum[cells::kMax][3] = {};
    if (next) std::copy(state, state + this->state(), next);
    each_point(c, law, state, u, [&](uint32_t n, const At &at) {
      PlasticState<Single> s = at.state;
      plastic::take_flow(at.flow, s);
      if (next) {
        std::copy(s.strain, s.strain + 6, next + plastic::kState * n);
        next[plastic::kState * n + 6] = s.length;
      }
      const double *e = s.strain, by = at.law.mu2;
      for (uint32_t a = 0; a < rows_; ++a) {
        const double *g = at.g[a];
        sum[a][0] += by * ((e[0] * g[0] + e[3] * g[1]) + e[5] * g[2]);
        sum[a][1] += by * ((e[3] * g[0] + e[1] * g[1]) + e[4] * g[2]);
        sum[a][2] += by * ((e[5] * g[0] + e[4] * g[1]) + e[2] * g[2]);
      }
    });
    fold(c, &sum[0][0]);
    for (uint32_t a = 0; a < nodes_; ++a)
      for (int i = 0; i < 3; ++i) f[a][i] -= sum[a][i];
  }

  // J, beside the energy of the elastic cell.
  double energy(uint32_t c, const Law &law, const double *state, Nodes u) const {
    double sum = 0;
    each_point(c, law, state, u, [&](uint32_t, const At &at) {
      sum += plastic::flow_energy<Single>(at.law, at.e, at.state, at.flow);
    });
    return sum;
  }

  // Pa, of the plastic strain after the flow, the mean over the cell: xx yy zz xy yz zx.
  void mean_stress(uint32_t c, const Law &law, const double *state, Nodes u, double (&out)[6]) const {
    double volume = 0;
    std::fill(out, out + 6, 0.0);
    each_point(c, law, state, u, [&](uint32_t, const At &at) {
      PlasticState<Single> s = at.state;
      plastic::take_flow(at.flow, s);
      volume += at.weight;
      for (int k = 0; k < 6; ++k) out[k] += at.law.mu2 * s.strain[k];
    });
    for (double &s : out) s /= volume;
  }

  // Adds to the blocks of the cell's stiffness `by` times what the flow takes from it.
  void soften(uint32_t c, const Law &law, const double *state, Nodes u, double by, double *blocks) const {
    each_point(c, law, state, u, [&](uint32_t, const At &at) {
      double d[6][6] = {};
      if (!plastic::soften(at.law, at.flow, d)) return;
      double strain[6][3 * cells::kMax] = {}, stress[6][3 * kMaxNodes] = {};
      cells::strain_of(int(rows_), at.g, strain);
      for (auto &row : strain) fold(c, row);
      for (int k = 0; k < 6; ++k)
        for (int l = 0; l < 6; ++l)
          for (uint32_t r = 0; r < 3 * nodes_; ++r) stress[k][r] += by * d[k][l] * strain[l][r];
      double *out = blocks;
      for (uint32_t a = 0; a < nodes_; ++a)
        for (uint32_t b = a; b < nodes_; ++b)
          for (uint32_t i = 0; i < 9; ++i, ++out)
            for (int k = 0; k < 6; ++k) *out += strain[k][3 * a + i / 3] * stress[k][3 * b + i % 3];
    });
  }

 private:
  using Single = rotation::Single;
  template <class Ops>
  using PlasticState = plastic::PlasticState<Ops>;
  struct At {
    double weight;
    const double (*g)[3];
    plastic::PlasticLaw<Single> law;
    double e[6];
    PlasticState<Single> state;
    plastic::PlasticFlow<Single> flow;
  };

  size_t each() const { return size_t(npoint_) * (1 + 3 * rows_); }

  // Forces on inner displacements become forces on the nodes.
  void fold(uint32_t c, double *f) const {
    for (uint32_t r = 3 * rows_; r-- > 3 * nodes_;)
      for (uint32_t j = 0; j < r; ++j) f[j] -= inner_[c].share[r - 3 * nodes_][j] * f[r];
  }

  template <class Use>
  void each_point(uint32_t c, const Law &of, const double *state, Nodes u, const Use &use) const {
    const double *const weight = &points_[each() * c];
    const auto g = reinterpret_cast<const double (*)[3]>(weight + npoint_);
    double d[3 * cells::kMax];
    std::copy_n(u[0], 3 * nodes_, d);
    for (uint32_t r = 3 * nodes_; r < 3 * rows_; ++r) {
      d[r] = 0;
      for (uint32_t j = 0; j < r; ++j) d[r] -= inner_[c].share[r - 3 * nodes_][j] * d[j];
    }
    for (uint32_t n = 0; n < npoint_ && weight[n] > 0; ++n) {
      At at;
      at.weight = weight[n];
      at.g = g + size_t(n) * rows_;
      double h[9] = {};
      for (uint32_t a = 0; a < rows_; ++a)
        for (uint32_t i = 0; i < 9; ++i) h[i] += d[3 * a + i / 3] * at.g[a][i % 3];
      const double e[6] = {h[0], h[4], h[8], 0.5 * (h[1] + h[3]), 0.5 * (h[5] + h[7]), 0.5 * (h[2] + h[6])};
      std::copy(e, e + 6, at.e);
      const double *const from = state + plastic::kState * n;
      std::copy(from, from + 6, at.state.strain);
      at.state.length = from[6];
      const plastic::Yield y = plastic::yield_of(of.yield, of.hardening, of.limit, at.weight);
      at.law = {2 * of.mu * at.weight,        y.stress, y.hardening, y.limit, of.flow,
                of.flow > 0 ? 1 / of.flow : 0};
      plastic::find_flow<Single>(at.law, at.e, at.state, at.flow);
      use(n, at);
    }
  }

  uint32_t nodes_ = 0, rows_ = 0, npoint_ = 0;
  Buffer<double> points_;           // [ncell,each()]: RestPoints of each
  Buffer<cells::RestInner> inner_;  // of HEX8
};

}  // namespace model
