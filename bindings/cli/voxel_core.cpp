#include "voxel_core.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cli {
namespace {

using Vector = std::array<double, 3>;

double dot(const Vector &a, const Vector &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector unit_normal(const dfm_obstacle_def &def, uint32_t triangle) {
  const double *p[3];
  for (int k = 0; k < 3; ++k) p[k] = def.points + 3 * size_t(def.triangles[3 * size_t(triangle) + size_t(k)]);
  Vector u, v;
  for (size_t i = 0; i < 3; ++i) {
    u[i] = p[1][i] - p[0][i];
    v[i] = p[2][i] - p[0][i];
  }
  Vector n = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::sqrt(dot(n, n));
  for (double &x : n) x = length > 0 ? x / length : 0;
  return n;
}

}  // namespace

double voxel_cell(const dfm_obstacle_def &def) {
  double volume = 1;
  for (size_t i = 0; i < 3; ++i) {
    double low = def.points[i], high = low;
    for (size_t p = i; p < 3 * size_t(def.npoint); p += 3) {
      low = std::min(low, def.points[p]);
      high = std::max(high, def.points[p]);
    }
    volume *= high - low;
  }
  return std::cbrt(volume / (def.cells ? def.cells : 262144));
}

std::vector<double> voxel_core(const dfm_obstacle_def &def) {
  // Projections onto the half-spaces n . way <= -half in turn: each point ends where all its planes want it,
  // by a short way.
  constexpr int kPasses = 32;
  const double half = 0.5 * voxel_cell(def);
  std::vector<Vector> way(def.npoint, Vector{});
  for (int pass = 0; pass < kPasses; ++pass)
    for (uint32_t t = 0; t < def.ntriangle; ++t) {
      const Vector n = unit_normal(def, t);
      if (dot(n, n) == 0) continue;
      for (size_t k = 0; k < 3; ++k) {
        Vector &w = way[def.triangles[3 * size_t(t) + k]];
        const double missing = half + dot(n, w);
        for (size_t i = 0; missing > 0 && i < 3; ++i) w[i] -= missing * n[i];
      }
    }
  std::vector<double> out(def.points, def.points + 3 * size_t(def.npoint));
  for (size_t p = 0; p < def.npoint; ++p) {
    const double length = std::sqrt(dot(way[p], way[p])), share = length > 2 * half ? 2 * half / length : 1;
    for (size_t i = 0; i < 3; ++i) out[3 * p + i] += share * way[p][i];
  }
  return out;
}

}  // namespace cli
