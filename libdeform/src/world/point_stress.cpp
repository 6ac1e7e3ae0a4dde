// Stress at the points of a body from that of its cells: patch recovery (Zienkiewicz and Zhu 1992, The
// superconvergent patch recovery and a posteriori error estimates), with quadratic functions.
#include <algorithm>
#include <cmath>

#include "core/lists.h"
#include "core/memory.h"
#include "math/extent.h"
#include "mesh/cells.h"
#include "state/world.h"
#include "world/measure.h"

namespace dfm {
namespace {

constexpr size_t kTerms = 10, kComponents = 6;
constexpr int kPair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
constexpr double kFlat = 1e-6;                    // of its size: a patch has one layer of cells across
constexpr double kWeak = 1e-12, kWeakest = 1e-9;  // terms of which the patch says nothing stay small

// Moments of a cell: its middle, and the means over it of products of the coordinates from there, in the
// order of kPair.
struct Moments {
  Vec3 middle;
  double second[6] = {};
};

// The quadratic function whose means over the cells fit best, at the place from which they are seen.
class Fit {
 public:
  // scale: of each axis
  void add(const Moments &cell, Vec3 from, Vec3 scale, const double *mean) {
    const Vec3 d = cell.middle - from;
    double f[kTerms] = {0, 0, 0, 0, 0, 0, scale.x * d.x, scale.y * d.y, scale.z * d.z, 1};
    for (int n = 0; n < 6; ++n) {
      const auto &[i, j] = kPair[n];
      f[n] = scale[i] * scale[j] * (d[i] * d[j] + cell.second[n]);
    }
    for (size_t i = 0; i < kTerms; ++i) {
      for (size_t j = 0; j < kTerms; ++j) normal_[i][j] += f[i] * f[j];
      for (size_t k = 0; k < kComponents; ++k) right_[i][k] += f[i] * mean[k];
    }
  }
  // Gauss's elimination of a positive definite matrix leaves the constant, which is last.
  void solve(double *out) {
    const double cells = normal_[kTerms - 1][kTerms - 1];
    for (size_t i = 0; i + 1 < kTerms; ++i) normal_[i][i] += (i < 6 ? kWeakest : kWeak) * cells;
    for (size_t k = 0; k + 1 < kTerms; ++k)
      for (size_t i = k + 1; i < kTerms; ++i) {
        const double times = normal_[i][k] / normal_[k][k];
        for (size_t j = k; j < kTerms; ++j) normal_[i][j] -= times * normal_[k][j];
        for (size_t c = 0; c < kComponents; ++c) right_[i][c] -= times * right_[k][c];
      }
    for (size_t c = 0; c < kComponents; ++c) out[c] = right_[kTerms - 1][c] / normal_[kTerms - 1][kTerms - 1];
  }

 private:
  double normal_[kTerms][kTerms] = {}, right_[kTerms][kComponents] = {};
};

Moments moments_of(const double *rest, const uint32_t *tets, size_t n) {
  Moments out;
  double volume = 0;
  Vec3 first;
  for (size_t t = 0; t < n; ++t) {
    const double part = tet_volume(rest, tets + 4 * t);
    Vec3 sum;
    for (int k = 0; k < 4; ++k) sum += load3(&rest[3 * size_t{tets[4 * t + k]}]);
    volume += part;
    first += (part / 4) * sum;
  }
  out.middle = (1 / volume) * first;
  for (size_t t = 0; t < n; ++t) {
    const double part = tet_volume(rest, tets + 4 * t) / (20 * volume);
    Vec3 x[5];  // corners and their sum
    for (int k = 0; k < 4; ++k) x[4] += x[k] = load3(&rest[3 * size_t{tets[4 * t + k]}]) - out.middle;
    for (const Vec3 &p : x)
      for (int m = 0; m < 6; ++m) out.second[m] += part * p[kPair[m][0]] * p[kPair[m][1]];
  }
  return out;
}

}  // namespace

void point_stress(Body &b, double *out) {
  const Memory &memory = b.world->memory();
  const CellKind &kind = cell_kind(b.cell_type);
  const Array<uint32_t> &nodes = b.cells.empty() ? b.tets : b.cells;
  const size_t ncell = b.ncell() / kind.tets;
  Array<double> stress(kComponents * size_t{b.ncell()}, memory);
  cell_stress(b, stress.data());
  Array<Moments> moments(ncell, memory);
  for (size_t c = 0; c < ncell; ++c)
    moments[c] = moments_of(b.p.rest.data(), &b.tets[4 * kind.tets * c], kind.tets);
  Array<uint32_t> row(memory), around(memory);
  const auto each = [&](const auto &use) {
    for (size_t n = 0; n < nodes.size(); ++n) use(nodes[n], uint32_t(n / kind.nodes));
  };
  make_lists(b.p.n, each, row, around);

  // three cells along an axis determine a quadratic function; a brick has six tetrahedra
  const size_t rings = kind.nodes == 4 || kind.nodes == 10 ? 2 : 3;
  Array<uint32_t> points(memory), patch(memory), point_of(b.p.n, UINT32_MAX, memory),
      cell_of(ncell, UINT32_MAX, memory);
  for (uint32_t i = 0; i < b.p.n; ++i) {
    const Vec3 here = load3(&b.p.rest[3 * size_t{i}]);
    points.assign(1, i);
    patch.clear();
    point_of[i] = i;
    for (size_t ring = 0, first = 0; ring < rings; ++ring)
      for (const size_t end = points.size(); first < end; ++first)
        for (uint32_t n = row[points[first]]; n < row[points[first] + 1]; ++n) {
          const uint32_t c = around[n];
          if (cell_of[c] == i) continue;
          cell_of[c] = i;
          patch.push_back(c);
          for (size_t k = 0; k < kind.nodes; ++k) {
            const uint32_t j = nodes[kind.nodes * c + k];
            if (point_of[j] != i) points.push_back(j);
            point_of[j] = i;
          }
        }
    Extent box;
    for (const uint32_t c : patch) box.add(moments[c].middle);
    Vec3 scale;  // one layer of cells says nothing of what changes across it
    const Vec3 size = box.hi - box.lo;
    for (int k = 0; k < 3; ++k) scale[k] = size[k] > kFlat * box.longest() ? 1 / box.longest() : 0;
    Fit fit;
    for (const uint32_t c : patch)
      fit.add(moments[c], here, scale, &stress[kComponents * kind.tets * size_t{c}]);
    fit.solve(out + kComponents * size_t{i});
  }
}

}  // namespace dfm
