// The matrix of an implicit step: linear elasticity of first-order tetrahedra and lumped masses,
// A = M / h^2 + K, in the blocks of math/block_matrix.h.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
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

// Steps of h seconds, Young's modulus and Poisson's ratio, density 1,000 kg/m^3.
inline BlockSystem elastic_system(const dfm::TetMesh &mesh, double young, double poisson, double h) {
  const double lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu = young / (2 + 2 * poisson);
  std::map<std::array<uint32_t, 2>, std::array<double, 9>> blocks;
  BlockSystem out;
  out.n = mesh.npoint();
  out.points.assign(mesh.points.begin(), mesh.points.end());
  for (uint32_t i = 0; i < out.n; ++i) blocks[{i, i}] = {};
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
        auto &block = blocks[{p[a], p[b]}];
        const dfm::Vec3 ga = gradient[a], gb = gradient[b];
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c)
            block[size_t(3 * r + c)] += volume * (lambda * ga[r] * gb[c] + mu * ga[c] * gb[r] +
                                                  (r == c ? mu * dfm::dot(ga, gb) : 0.0));
        if (a == b)
          for (size_t r = 0; r < 3; ++r) block[4 * r] += 1000 * volume / 4 / (h * h);
      }
  }
  for (const auto &[pair, block] : blocks) {
    out.ij.insert(out.ij.end(), pair.begin(), pair.end());
    out.blk.insert(out.blk.end(), block.begin(), block.end());
  }
  return out;
}

}  // namespace test
