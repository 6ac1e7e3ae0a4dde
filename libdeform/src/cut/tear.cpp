// A point represents the cells around it: its strain is the mean of their left Cauchy-Green tensors B = F
// F^T, weighted by their rest volumes. Where sqrt(largest eigenvalue) - 1 exceeds the strain at which the
// material tears, the point is split by the plane normal to that eigenvector: the faces between cells on
// different sides of it open. So each split adds a copy of a point, on any mesh, and no cell is divided
// (doc/decisions/cutting.md).
#include "cut/tear.h"

#include <algorithm>
#include <cmath>

#include "cut/blade_sweep.h"
#include "cut/separate.h"
#include "mesh/cut_mesh.h"
#include "state/material.h"
#include "state/world.h"
#include "step/stages.h"

namespace dfm {
namespace {

constexpr uint32_t kMaxPoints = 64;  // per body and step; the most stretched points come first

// Largest eigenvalue of a symmetric matrix (xx, yy, zz, xy, yz, zx), by Jacobi's rotations; the vector to it.
double largest_eigenvalue(const double (&a)[6], Vec3 &vector) {
  constexpr int kSweeps = 12;
  double m[3][3] = {{a[0], a[3], a[5]}, {a[3], a[1], a[4]}, {a[5], a[4], a[2]}};
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double tangent = (theta >= 0 ? 1 : -1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(tangent * tangent + 1), s = tangent * c;
        const auto turn = [&](double &x, double &y) {
          const double old = x;
          x = c * old - s * y;
          y = s * old + c * y;
        };
        for (auto &row : m) turn(row[p], row[q]);
        for (int k = 0; k < 3; ++k) turn(m[p][k], m[q][k]);
        for (auto &row : v) turn(row[p], row[q]);
      }
  int most = 0;
  for (int k = 1; k < 3; ++k)
    if (m[k][k] > m[most][most]) most = k;
  vector = {v[0][most], v[1][most], v[2][most]};
  return m[most][most];
}

class Tear {
 public:
  explicit Tear(Body &b) : b_(b), ncell_(b.ncell()), points_(b.p.n) {
    for (const Material &m : b.composition.materials) limits_.push_back(m.entry(kTearKey, 0));
    for (uint32_t c = 0; c < ncell_; ++c) add(c);
  }

  // Faces between cells that open.
  Array<uint64_t> faces() {
    Array<uint64_t> out{b_.world->memory()};
    find_weakest();
    if (weakest_.empty()) return out;
    mark();
    if (b_.inner.empty()) b_.inner = inner_faces(b_);
    for (size_t f = 0; f < b_.inner.size(); f += 2) {
      const uint32_t i = b_.inner[f], j = b_.inner[f + 1], *const point = &b_.tets[size_t{4} * i];
      if (std::any_of(point, point + 4, [&](uint32_t p) {
            return points_[p].split && shares(j, p) && side(i, p) != side(j, p);
          }))
        out.push_back(open_face(i, j));
    }
    return out;
  }

 private:
  struct Point {
    double sum[6] = {};            // xx, yy, zz, xy, yz, zx
    double volume = 0, limit = 0;  // limit: times volume
    Vec3 way;                      // of the largest stretch
    bool split = false;
  };

  Vec3 x(uint32_t cell, size_t k) const { return b_.corner(cell, k); }
  Vec3 rest(uint32_t cell, size_t k) const { return b_.p.rest_at(b_.tets[size_t{4} * cell + k]); }
  bool shares(uint32_t cell, uint32_t point) const {
    const uint32_t *const c = &b_.tets[size_t{4} * cell];
    return std::find(c, c + 4, point) != c + 4;
  }
  bool side(uint32_t cell, uint32_t point) const {
    const Vec3 middle = 0.25 * ((x(cell, 0) + x(cell, 1)) + (x(cell, 2) + x(cell, 3)));
    return dot(points_[point].way, middle - b_.p.x_at(point)) >= 0;
  }

  void add(uint32_t cell) {
    const double limit = limits_[b_.composition.of.empty() ? 0 : b_.composition.of[cell]];
    if (!(limit > 0)) return;
    const Vec3 a = rest(cell, 1) - rest(cell, 0), b = rest(cell, 2) - rest(cell, 0),
               c = rest(cell, 3) - rest(cell, 0);
    const double volume6 = dot(a, cross(b, c));
    if (volume6 == 0) return;
    // F = sum of edges now times gradients at rest
    const Vec3 gradient[3] = {(1 / volume6) * cross(b, c), (1 / volume6) * cross(c, a),
                              (1 / volume6) * cross(a, b)};
    double f[3][3] = {};
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 edge = x(cell, k + 1) - x(cell, 0);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) f[i][j] += edge[i] * gradient[k][j];
    }
    const double volume = std::fabs(volume6);
    const auto product = [&](int i, int j) {
      return volume * ((f[i][0] * f[j][0] + f[i][1] * f[j][1]) + f[i][2] * f[j][2]);
    };
    const double own[6] = {product(0, 0), product(1, 1), product(2, 2),
                           product(0, 1), product(1, 2), product(2, 0)};
    for (size_t k = 0; k < 4; ++k) {
      Point &p = points_[b_.tets[size_t{4} * cell + k]];
      for (int i = 0; i < 6; ++i) p.sum[i] += own[i];
      p.volume += volume;
      p.limit += volume * limit;
    }
  }

  // Points above their limit, the largest excess first.
  void find_weakest() {
    for (uint32_t i = 0; i < b_.p.n; ++i) {
      Point &p = points_[i];
      if (!(p.volume > 0)) continue;
      const double most = 1 + p.limit / p.volume;
      double mean[6], beyond2 = 0;
      for (int k = 0; k < 6; ++k) {
        mean[k] = p.sum[k] / p.volume;
        const double part = mean[k] - (k < 3);
        beyond2 += (k < 3 ? 1 : 2) * part * part;
      }
      // no eigenvalue is further from 1 than the norm of B - 1
      if (!(beyond2 > (most * most - 1) * (most * most - 1))) continue;
      const double stretch = std::sqrt(std::max(0.0, largest_eigenvalue(mean, p.way)));
      if (stretch > most) weakest_.push_back({-stretch / most, i});
    }
    std::sort(weakest_.begin(), weakest_.end());
  }

  // A split unloads the points around it, so points of the same cells wait for the next step.
  void mark() {
    std::vector<std::vector<uint32_t>> cells(b_.p.n);
    for (uint32_t k = 0; k < 4 * ncell_; ++k) cells[b_.tets[k]].push_back(k / 4);
    std::vector<uint8_t> taken(ncell_);
    uint32_t n = 0;
    for (const auto &weak : weakest_) {
      const uint32_t i = weak.second;
      const auto free = [&](uint32_t c) { return !taken[c]; };
      if (n == kMaxPoints || !std::all_of(cells[i].begin(), cells[i].end(), free)) continue;
      const auto first = [&](uint32_t c) { return side(c, i) == side(cells[i].front(), i); };
      if (std::all_of(cells[i].begin(), cells[i].end(), first)) continue;  // a tip of the body
      points_[i].split = true;
      for (const uint32_t c : cells[i]) taken[c] = 1;
      ++n;
    }
  }

  Body &b_;
  uint32_t ncell_;
  std::vector<double> limits_;
  std::vector<Point> points_;
  std::vector<std::pair<double, uint32_t>> weakest_;
};

}  // namespace

void tear_bodies(World &w) {
  if (w.tearing == 0) return;
  const size_t n = w.bodies.size();  // new pieces come after
  for (size_t i = 0; i < n; ++i) {
    Body &b = *w.bodies[i];
    if (!b.tears || b.sleep_state.asleep) continue;
    const Array<uint64_t> faces = Tear(b).faces();
    if (faces.empty()) continue;
    reserve_cut_events(w, 1);
    CutReport done = open_faces(b, faces);
    add_event(w, DFM_EVENT_TEAR, b.id, b.id, done.points, w.time);
    separate_if_requested(b, done);
  }
}

}  // namespace dfm
