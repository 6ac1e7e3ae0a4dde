// Points in cells, and what a selection on a given surface means for the cells below it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/error.h"
#include "mesh/mesh.h"
#include "scene/select.h"

using namespace dfm::scene;

namespace {

// A mesh of the library with what a scene's selections look at.
struct Cells {
  dfm::RestMesh mesh;
  BodyMesh body;
  explicit Cells(dfm::RestMesh &&m) : mesh(std::move(m)) {
    body.points.assign(mesh.points.begin(), mesh.points.end());
    body.info.tets = mesh.tets.data();
    body.info.npoint = mesh.npoint();
    body.info.ntet = mesh.ntet();
    for (int k = 0; k < 3; ++k) {
      body.lo[k] = INFINITY;
      body.hi[k] = -INFINITY;
    }
    for (size_t i = 0; i < body.points.size(); ++i) {
      const double x = body.points[i];
      body.lo[i % 3] = std::min(body.lo[i % 3], x);
      body.hi[i % 3] = std::max(body.hi[i % 3], x);
    }
    body.size = std::hypot(body.hi[0] - body.lo[0], body.hi[1] - body.lo[1], body.hi[2] - body.lo[2]);
  }
};

// One cell alone: a mesh on which a search has nothing to choose.
double one_cell(const BodyMesh &all, uint32_t cell, const double *point) {
  const uint32_t own[4] = {0, 1, 2, 3}, *const t = all.info.tets + 4 * size_t(cell);
  BodyMesh one;
  for (int k = 0; k < 4; ++k)
    one.points.insert(one.points.end(), &all.points[3 * size_t(t[k])], &all.points[3 * size_t(t[k])] + 3);
  one.info.npoint = 4;
  one.info.tets = own;
  one.info.ntet = 1;
  double away;
  one.finder().find(one.finder().local(point), away);
  return away;
}

}  // namespace

TEST(CellFinder, FindsTheCellThatASearchThroughAllFinds) {
  const dfm::Memory &memory = dfm::Memory::standard();
  for (int shape = 0; shape < 3; ++shape) {
    const Cells c(shape == 0   ? dfm::make_ball(memory, 1, 200)
                  : shape == 1 ? dfm::make_beam(memory, 4, 0.5, 0.05, 150)
                               : dfm::make_cylinder(memory, 0.2, 3, 200));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> in(-0.4, 1.4);
    for (int n = 0; n < 40; ++n) {
      double point[3], least = INFINITY;
      for (int k = 0; k < 3; ++k) point[k] = c.body.lo[k] + in(random) * (c.body.hi[k] - c.body.lo[k]);
      for (uint32_t t = 0; t < c.body.info.ntet; ++t) least = std::min(least, one_cell(c.body, t, point));
      const dfm::CellFinder &finder = c.body.finder();
      double weights[4], away, sum = 0;
      const uint32_t tet = finder.find(finder.local(point), away);
      finder.corner_weights(finder.local(point), tet, weights);
      EXPECT_NEAR(away, least, 1e-12) << shape << " " << n;
      for (int k = 0; k < 3; ++k) {
        double x = 0;
        for (size_t i = 0; i < 4; ++i)
          x += weights[i] * c.body.points[3 * size_t(c.body.info.tets[4 * size_t{tet} + i]) + size_t(k)];
        EXPECT_NEAR(x, point[k], 1e-10);
      }
      for (double w : weights) sum += w;
      EXPECT_NEAR(sum, 1, 1e-12);
    }
  }
}

// A slanted triangle inside a block: what reaches the cells' points has the triangle's force, torque
// and nothing else.
TEST(ShareOnSkin, ForceAndTorque_AreThoseOfTheTraction) {
  Cells c(dfm::make_beam(dfm::Memory::standard(), 1, 0.5, 0.5, 300));
  Skin &skin = c.body.skin;
  const uint32_t triangles[] = {0, 1, 2, 1, 3, 2};
  skin.points = {0.1, 0.1, 0.2, 0.8, 0.15, 0.3, 0.3, 0.4, 0.45, 0.9, 0.45, 0.1};
  skin.triangles = triangles;
  skin.npoint = 4;
  skin.ntriangle = 2;
  double area[2], center[2][3] = {};
  for (int t = 0; t < 2; ++t) {
    const double *p[3];
    for (int k = 0; k < 3; ++k) p[k] = &skin.points[3 * size_t(triangles[3 * t + k])];
    double u[3], v[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = p[1][k] - p[0][k];
      v[k] = p[2][k] - p[0][k];
      center[t][k] = (p[0][k] + p[1][k] + p[2][k]) / 3;
    }
    area[t] =
        0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
  }
  const Shared shared = share_on_skin({0, 1}, c.body);
  double sum = 0, middle[3] = {};
  for (size_t i = 0; i < shared.points.size(); ++i) {
    sum += shared.weights[i];
    for (int k = 0; k < 3; ++k)
      middle[k] += shared.weights[i] * c.body.points[3 * size_t(shared.points[i]) + size_t(k)];
  }
  EXPECT_NEAR(sum, 1, 1e-14);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(middle[k], (area[0] * center[0][k] + area[1] * center[1][k]) / (area[0] + area[1]), 1e-14)
        << "where the force acts";
}

TEST(SelectOnFilled, Box_TakesTheSurfaceInIt) {
  Cells c(dfm::make_beam(dfm::Memory::standard(), 1, 1, 1, 100));
  Skin &skin = c.body.skin;
  skin.points = {0.3, 0.305, 0.315};
  skin.npoint = 1;
  dfm::scene::Selection where;
  for (int k = 0; k < 3; ++k) {
    where.lo[k] = 0.29;
    where.hi[k] = 0.32;
  }
  EXPECT_THROW(select(where, c.body, "s.json"), dfm::Error) << "no point of the cells lies there";
  c.body.filled = true;
  const std::vector<uint32_t> points = select(where, c.body, "s.json");
  ASSERT_EQ(points.size(), 4u);
  double away;
  const uint32_t tet = c.body.finder().find(c.body.finder().local(skin.points.data()), away);
  uint32_t corners[4];
  std::copy_n(c.body.info.tets + 4 * size_t{tet}, 4, corners);
  std::sort(corners, corners + 4);
  for (int k = 0; k < 4; ++k) EXPECT_EQ(points[size_t(k)], corners[k]);
  skin.points = {0.3, 0.3, 0.31};  // on a face
  c.body.rows = nullptr;
  EXPECT_EQ(select(where, c.body, "s.json").size(), 3u);
}
