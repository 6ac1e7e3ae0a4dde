// Filling is bounded by the triangles and the wanted cells wherever the corners lie: few cells, or a
// sentence; never a search without end.
#include <gtest/gtest.h>

#include <random>

#include "core/error.h"
#include "fill_support.h"
#include "mesh/fill_lattice.h"

using namespace dfm;

namespace {

RestMesh tetrahedron(Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
  return test::surface_of({a, b, c, d}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
}

// The cells, or the sentence of a refusal.
std::string outcome(const RestMesh &surface, uint32_t cells) {
  try {
    const RestMesh mesh = fill_surface(surface, cells);
    EXPECT_LE(mesh.ntet(), 4 * uint64_t(cells) + 1000);
    return "";
  } catch (const Error &e) {
    EXPECT_TRUE(e.status == DFM_E_FORMAT || e.status == DFM_E_NOMEM) << e.status;
    EXPECT_FALSE(e.sentence.empty());
    return e.sentence;
  }
}

}  // namespace

TEST(FillBounds, CornersFarApart_GiveCellsOrAnError) {
  const double f = 1.5e14;
  const std::string needle = outcome(tetrahedron({0, 0, 0}, {72, 0, 0}, {0, 72, 0}, {f, f, f}), 1000);
  EXPECT_NE(needle.find("m across"), std::string::npos) << needle;
  outcome(tetrahedron({f, f, 72}, {72, f, f}, {f, 72, f}, {72, 72, 72}), 1000);
  outcome(tetrahedron({0, 0, 0}, {72, 0, 0}, {0, f, 0}, {0, 0, 72}), 1000);
}

TEST(FillBounds, CoordinatesTooCoarseForTheCells_AreRefusedWithTheirResolution) {
  const double f = 1.5e14;  // doubles are 0.03 m apart here
  const std::string sentence =
      outcome(tetrahedron({f, f, f}, {f + 72, f, f}, {f, f + 72, f}, {f, f, f + 72}), 1000000);
  EXPECT_NE(sentence.find("nearer to the origin"), std::string::npos) << sentence;
  EXPECT_EQ(outcome(tetrahedron({f, f, f}, {f + 7200, f, f}, {f, f + 7200, f}, {f, f, f + 7200}), 200), "");
}

TEST(FillBounds, PartsTooFarApart_AreRefused) {
  RestMesh both = test::sphere_surface(0.1, 2);
  test::append(both, test::sphere_surface(0.1, 2, {1e7, 0, 0}));
  const std::string sentence = outcome(both, 2000);
  EXPECT_NE(sentence.find("too far apart"), std::string::npos) << sentence;
}

TEST(FillBounds, SpikesAndStrayCorners_GiveCellsOrAnError) {
  std::mt19937 draw(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double reach : {1e2, 1e6, 1e20}) {
    RestMesh spiked = test::sphere_surface(0.1, 3);
    for (int i = 0; i < 10; ++i) {
      double *const p = &spiked.points[3 * size_t(draw() % spiked.npoint())];
      for (int k = 0; k < 3; ++k) p[k] = reach * unit(draw);
    }
    outcome(spiked, 300);
  }
}

TEST(FillBounds, TangleOfTriangles_GivesCellsOrAnError) {
  std::mt19937 draw(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  RestMesh tangle;
  for (int i = 0; i < 100; ++i) {
    const auto any = [&] { return Vec3{unit(draw), unit(draw), unit(draw)}; };
    test::append(tangle, tetrahedron(any(), any(), any(), any()));
  }
  outcome(tangle, 100);
}

TEST(FillBounds, MoreCellsThanMemoryHolds_AreRefusedBeforeTheWorkBegins) {
  EXPECT_THROW(need_memory(uint64_t(1) << 60, "a test"), Error);
  EXPECT_NO_THROW(need_memory(1 << 20, "a test"));
}

TEST(FillBounds, SurfaceTurnedInsideOut_IsNotFilledFromOnePoint) {
  const RestMesh inside_out = tetrahedron({0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1});
  try {
    fan_surface(inside_out);
    FAIL() << "filled";
  } catch (const Error &e) {
    EXPECT_EQ(e.status, DFM_E_FORMAT);
    EXPECT_NE(e.sentence.find("it should enclose a volume"), std::string::npos) << e.sentence;
  }
}
