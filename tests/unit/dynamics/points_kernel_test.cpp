// Results of the loops over points, at each width, against one cell and one edge at a time.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "dynamics/points_kernel.h"
#include "dynamics/symplectic_euler.h"
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

    std::vector<uint32_t> every_other;
    std::vector<double> middles, found(2 * size_t(rows) + 4);
    double farthest = 0;
    for (uint32_t r = 0; r < rows; ++r) {
      const uint32_t *t = &c.cells[4 * size_t(r)], *e = &c.edges[2 * size_t(r)];
      farthest = std::max(farthest, norm2(c.at(c.x, e[0]) - c.at(c.x, e[1])));
      if (r % 2) continue;
      every_other.push_back(r);
      const dfm::Vec3 m = 0.25 * ((c.at(c.x, t[0]) + c.at(c.x, t[1])) + (c.at(c.x, t[2]) + c.at(c.x, t[3])));
      middles.insert(middles.end(), {m.x, m.y, m.z, 0});
    }
    kernels.middles(uint32_t(every_other.size()), every_other.data(), c.cells.data(), c.x.data(),
                    found.data());
    found.resize(middles.size());
    EXPECT_EQ(found, middles) << rows;
    EXPECT_EQ(kernels.farthest(rows, c.edges.data(), c.x.data()), farthest) << rows;
    double low[4], high[4];
    kernels.bounds(rows + 1, c.x.data(), low, high);
    for (uint32_t a = 0; a < 4; ++a) {
      double least = c.x[a], most = least;
      for (uint32_t i = 0; i <= rows; ++i) {
        least = std::min(least, c.x[4 * size_t(i) + a]);
        most = std::max(most, c.x[4 * size_t(i) + a]);
      }
      EXPECT_EQ(low[a], least) << rows;
      EXPECT_EQ(high[a], most) << rows;
    }
  }
}

// [n,4] each, the fourth component zero.
struct Moving {
  static constexpr uint32_t kPoints = 101;
  std::vector<double> x, v, w, load, more, f, mass;
  std::vector<uint32_t> order;

  Moving() {
    std::mt19937 random(5);
    for (std::vector<double> *a : {&x, &v, &w, &load, &more})
      for (uint32_t k = 0; k < 4 * kPoints; ++k)
        a->push_back(k % 4 == 3 ? 0 : double(random()) / 4294967296.0 - 0.5);
    for (uint32_t k = 0; k < 4 * kPoints; ++k) f.push_back(load[k] + more[k]);
    for (uint32_t i = 0; i < kPoints; ++i) {
      mass.push_back(1 + double(i % 7));
      order.push_back(i * 30 % kPoints);
    }
  }
  // free and x_end, one behind the other; parts: of so many points in that order, 0: all at once
  std::vector<double> ends(const dfm::PointsKernels &kernels, uint32_t parts, uint32_t ahead) const {
    const double gravity[] = {0.5, -2, -9.81, 0};
    std::vector<double> out(size_t{8} * kPoints);
    const dfm::FreeMotion motion = {1e-2,     gravity,  mass.data(), v.data(),
                                    w.data(), x.data(), out.data(),  out.data() + size_t{4} * kPoints,
                                    ahead};
    double kinetic = parts ? 0 : kernels.predict(motion, kPoints, f.data());
    for (uint32_t at = 0; parts && at < kPoints; at += parts) {
      const uint32_t n = std::min(parts, kPoints - at);
      std::vector<double> own;
      for (uint32_t k = at; k < at + n; ++k)
        own.insert(own.end(), &more[size_t{4} * order[k]], &more[size_t{4} * order[k]] + 4);
      kinetic += kernels.predict_part(motion, n, &order[at], load.data(), own.data());
    }
    double exact = 0;
    for (uint32_t k = 0; k < 4 * kPoints; ++k) exact += 0.5 * mass[k / 4] * (out[k] * out[k]);
    EXPECT_NEAR(kinetic, exact, 1e-12 * exact);
    return out;
  }
};

}  // namespace

TEST(PointsKernels, QueriesOfCellsAndEdges_AreThoseOfOneAtATime) {
  check(dfm::points_kernels_sse2());
  if constexpr (dfm::kHasWider)
    if (dfm::doubles_at_once() >= 4) check(dfm::points_kernels_avx2());
}

// Points that cannot bound the step are left out early, which changes no bit.
TEST(StableStep, IsThatOfTheFormulaAtThePointThatBounds) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    dfm::Phyxels p;
    p.n = 60;
    std::vector<double> k(p.n), c(p.n);
    const auto number = [&](uint32_t spread) {  // zero, close to one, or of any size
      const double size =
          spread == 0 ? 1 + 1e-12 * double(random() % 1000) : std::exp(double(random() % spread));
      return random() % 7 == 0 ? 0 : size;
    };
    for (uint32_t i = 0; i < p.n; ++i) {
      p.mass.push_back(number(seed % 3 * 5));
      p.held.push_back(uint8_t(random() % 9 == 0 ? 7 : 0));
      k[i] = seed % 5 == 4 ? 0 : number(seed % 4 * 10);
      c[i] = seed % 7 == 6 ? 0 : number(seed % 5 * 10);
    }
    double best = HUGE_VAL;
    uint32_t at = p.n, worst = 0;
    for (uint32_t i = 0; i < p.n; ++i) {
      const double bottom = c[i] + std::sqrt(c[i] * c[i] + 4 * p.mass[i] * k[i]);
      const double h = bottom > 0 ? 4 * p.mass[i] / bottom : HUGE_VAL;
      if (p.held[i] == 7 || !(h < best)) continue;
      best = h;
      at = i;
    }
    EXPECT_EQ(dfm::stable_step(p, k.data(), c.data(), &worst), best) << seed;
    EXPECT_EQ(worst, at) << seed;
  }
}

TEST(PointsKernels, PartsInAnyOrder_EndWhereAllPointsDo) {
  const Moving m;
  const std::vector<double> all = m.ends(dfm::points_kernels_sse2(), 0, Moving::kPoints);
  std::vector<const dfm::PointsKernels *> widths = {&dfm::points_kernels_sse2()};
  if constexpr (dfm::kHasWider)
    if (dfm::doubles_at_once() >= 4) widths.push_back(&dfm::points_kernels_avx2());
  for (const dfm::PointsKernels *kernels : widths)
    for (uint32_t parts : {0u, 1u, 2u, 33u, 200u})
      for (uint32_t ahead : {1u, 4u, Moving::kPoints})
        EXPECT_EQ(m.ends(*kernels, parts, parts ? ahead : Moving::kPoints), all) << parts;
  EXPECT_GT(std::fabs(all[2]), 1e-3);
}
