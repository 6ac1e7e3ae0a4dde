// What the loops over points answer, at each width, against one cell and one edge at a time.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "dynamics/points_kernel.h"
#include "math/vec3.h"
#include "math/width.h"

namespace {

struct Cloud {
  std::vector<double> x, v;
  std::vector<uint32_t> cells, edges;

  explicit Cloud(uint32_t rows) {
    constexpr uint32_t kPoints = 40;
    std::mt19937 random(rows);
    const auto number = [&] { return double(random()) / 4294967296.0 - 0.5; };
    for (uint32_t i = 0; i < kPoints; ++i) {
      for (int a = 0; a < 3; ++a) {
        x.push_back(number());
        v.push_back(number());
      }
      x.push_back(0);
      v.push_back(0);
    }
    for (uint32_t r = 0; r < rows; ++r) {
      const uint32_t first = uint32_t(random() % kPoints);
      for (uint32_t k = 0; k < 4; ++k) cells.push_back((first + k * (1 + r % 3)) % kPoints);
      edges.push_back(first);
      edges.push_back(r % 5 == 0 ? first : (first + 1 + r) % kPoints);  // some from a point to itself
    }
  }
  dfm::Vec3 at(const std::vector<double> &of, uint32_t i) const { return dfm::load3(&of[4 * size_t(i)]); }
};

void check(const dfm::PointsKernels &kernels) {
  for (uint32_t rows = 0; rows < 20; ++rows) {
    const Cloud c(rows);
    uint32_t inverted = 0;
    double rate = 0;
    for (uint32_t r = 0; r < rows; ++r) {
      const uint32_t *t = &c.cells[4 * size_t(r)], *e = &c.edges[2 * size_t(r)];
      inverted += dfm::tet_volume(c.at(c.x, t[0]), c.at(c.x, t[1]), c.at(c.x, t[2]), c.at(c.x, t[3])) < 0;
      if (e[0] == e[1]) continue;
      const dfm::Vec3 d = c.at(c.x, e[1]) - c.at(c.x, e[0]);
      rate = std::max(rate, std::fabs(dot(d, c.at(c.v, e[1]) - c.at(c.v, e[0]))) / norm2(d));
    }
    EXPECT_EQ(kernels.inverted(rows, c.cells.data(), c.x.data()), inverted) << rows;
    EXPECT_EQ(kernels.strain_rate(rows, c.edges.data(), c.x.data(), c.v.data()), rate) << rows;
  }
}

}  // namespace

TEST(PointsKernels, InvertedCellsAndStrainRates_AreThoseOfOneAtATime) {
  check(dfm::points_kernels_sse2());
  if (dfm::doubles_at_once() >= 4) check(dfm::points_kernels_avx2());
}
