// The matrix of an implicit step: linear elasticity of first-order tetrahedra and lumped masses,
// A = M / h^2 + K, in the blocks of math/block_matrix.h.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "math/block_matrix.h"
#include "math/vec3.h"
#include "mesh/mesh.h"

namespace test {

struct BlockSystem {
  uint32_t n = 0;
  std::vector<uint32_t> ij;
  std::vector<double> blk;
  std::vector<double> points;
  dfm::BlockPattern pattern() const { return {n, uint32_t(ij.size() / 2), ij.data()}; }
};

// Steps of h seconds (infinity: equilibrium), Young's modulus and Poisson's ratio, density 1,000 kg/m^3.
inline BlockSystem elastic_system(const dfm::RestMesh &mesh, double young, double poisson, double h) {
  const double lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = young / (2 + 2 * poisson);
  BlockSystem out;
  out.n = mesh.npoint();
  out.points.assign(mesh.points.begin(), mesh.points.end());
  std::vector<std::vector<uint32_t>> columns(out.n);  // of the upper triangle
  for (uint32_t i = 0; i < out.n; ++i) columns[i].push_back(i);
  for (uint32_t t = 0; t < mesh.ntet(); ++t)
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const uint32_t i = mesh.tets[4 * size_t{t} + size_t(a)], j = mesh.tets[4 * size_t{t} + size_t(b)];
        if (i < j && std::find(columns[i].begin(), columns[i].end(), j) == columns[i].end())
          columns[i].push_back(j);
      }
  std::vector<size_t> row(1, 0);
  for (uint32_t i = 0; i < out.n; ++i) {
    std::sort(columns[i].begin(), columns[i].end());
    for (const uint32_t j : columns[i]) out.ij.insert(out.ij.end(), {i, j});
    row.push_back(out.ij.size() / 2);
  }
  out.blk.assign(9 * row.back(), 0.0);
  for (uint32_t t = 0; t < mesh.ntet(); ++t) {
    const uint32_t *const p = &mesh.tets[4 * size_t{t}];
    dfm::Vec3 x[4], gradient[4];
    for (int a = 0; a < 4; ++a) x[a] = dfm::load3(&mesh.points[3 * size_t{p[a]}]);
    const double volume = dfm::tet_volume(x[0], x[1], x[2], x[3]);
    gradient[1] = 1 / (6 * volume) * dfm::cross(x[2] - x[0], x[3] - x[0]);
    gradient[2] = 1 / (6 * volume) * dfm::cross(x[3] - x[0], x[1] - x[0]);
    gradient[3] = 1 / (6 * volume) * dfm::cross(x[1] - x[0], x[2] - x[0]);
    gradient[0] = -1.0 * (gradient[1] + gradient[2] + gradient[3]);
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        if (p[a] > p[b]) continue;
        const std::vector<uint32_t> &in_row = columns[p[a]];
        const auto at = std::lower_bound(in_row.begin(), in_row.end(), p[b]) - in_row.begin();
        double *const block = &out.blk[9 * (row[p[a]] + size_t(at))];
        const dfm::Vec3 ga = gradient[a], gb = gradient[b];
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c)
            block[3 * r + c] += volume * (lambda * ga[r] * gb[c] + mu * ga[c] * gb[r] +
                                          (r == c ? mu * dfm::dot(ga, gb) : 0.0));
        if (a == b)
          for (int r = 0; r < 3; ++r) block[4 * r] += 1000 * volume / 4 / (h * h);
      }
  }
  return out;
}

}  // namespace test
