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
  for (size_t i = 0; i < 3; ++i) u[i] = p[1][i] - p[0][i], v[i] = p[2][i] - p[0][i];
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
    for (size_t p = i; p < 3 * size_t(def.npoint); p += 3) low = std::min(low, def.points[p]), high = std::max(high, def.points[p]);
    volume *= high - low;
  }
  return std::cbrt(volume / (def.cells ? def.cells : 262144));
}

std::vector<double> voxel_core(const dfm_obstacle_def &def) {
  const double half = 0.5 * voxel_cell(def);
  std::vector<Vector> mean(def.npoint, Vector{});
  for (uint32_t t = 0; t < def.ntriangle; ++t) {
    const Vector n = unit_normal(def, t);
    for (size_t k = 0; k < 3; ++k)
      for (size_t i = 0; i < 3; ++i) mean[def.triangles[3 * size_t(t) + k]][i] += n[i];
  }
  for (Vector &m : mean) {
    const double length = std::sqrt(dot(m, m));
    for (double &x : m) x = length > 0 ? x / length : 0;
  }
  std::vector<double> least(def.npoint, 1);   // share of the way along the mean normal that the planes around move
  for (uint32_t t = 0; t < def.ntriangle; ++t) {
    const Vector n = unit_normal(def, t);
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t p = def.triangles[3 * size_t(t) + k];
      least[p] = std::min(least[p], dot(n, mean[p]));
    }
  }
  std::vector<double> out(def.points, def.points + 3 * size_t(def.npoint));
  for (size_t p = 0; p < def.npoint; ++p)
    for (size_t i = 0; i < 3; ++i) out[3 * p + i] -= half / std::max(0.5, least[p]) * mean[p][i];
  return out;
}

}  // namespace cli
