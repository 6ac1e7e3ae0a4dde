// The one thing that the roll-back promises: no state that it leaves has two bodies through each other, if
// one time holds for each island.
#include "coupled.h"
#include "crossing.h"
#include "rollback_cases.h"

namespace {

struct Body {
  dfm_body body;
  std::vector<uint32_t> triangles;
};

// Triangle pairs of different bodies that cross. (A body that is torn by frozen vertices may cross itself;
// nobody looks.)
size_t crossings(const std::vector<Body> &bodies) {
  std::vector<std::vector<double>> x;
  for (const Body &b : bodies) x.push_back(test::surface_positions(b.body));
  const auto surface = [&](size_t i, bool obstacle) {
    return crossing::Surface{x[i].data(), uint32_t(x[i].size() / 3), bodies[i].triangles.data(),
                             uint32_t(bodies[i].triangles.size() / 3), obstacle};
  };
  size_t found = 0;
  for (size_t j = 0; j + 1 < bodies.size(); ++j)
    for (size_t i = j + 1; i < bodies.size(); ++i)
      found += crossing::Counter()
                   .count({surface(i, true), surface(j, false)}, crossing::Touching::counts)
                   .between;
  return found;
}

}  // namespace

// unsanitized: too slow there; shorter tests run the same code
TEST(Rollback, TenBodiesThrownTogether_NeverCross) {
  uint32_t most = 0;
  for (int seed = 0; seed < 2; ++seed) {
    test::rollback::World w(test::rollback::By::rollback, {0, 0, -9.81}, 0.3);
    const double s = std::sqrt(0.5);
    test::add_plane(w.world, "floor");
    test::add_plane(w.world, "west", {-0.08, 0, 0}, {0, s, 0, s});
    test::add_plane(w.world, "east", {0.08, 0, 0}, {0, -s, 0, s});
    test::add_plane(w.world, "south", {0, -0.08, 0}, {-s, 0, 0, s});
    test::add_plane(w.world, "north", {0, 0.08, 0}, {s, 0, 0, s});
    const char *const kinds[] = {"ball", "beam", "cylinder"};
    const std::array<double, 3> sizes[] = {{0.015, 0, 0}, {0.025, 0.02, 0.02}, {0.012, 0.03, 0}};
    std::vector<Body> bodies;
    for (int i = 0; i < 10; ++i) {
      test::BodyOptions o;
      o.young = 3e4;
      o.damping_stiffness = 1e-3;
      o.volume = 1;
      o.position = {-0.035 + 0.045 * (i % 2), -0.035 + 0.045 * (i / 2 % 2), 0.02 + 0.05 * (i / 4)};
      o.velocity = {0.2 - 0.04 * i + 0.03 * seed, 0.05 * (i % 5) - 0.1, -1.2 - 0.2 * seed};
      o.spin = {double(i), 3.0 - i, 1.0 + seed};
      const dfm_body b = test::make_body(w.context, w.world, kinds[i % 3], sizes[i % 3], 60, o);
      bodies.push_back({b, test::surface_triangles(b)});
    }
    ASSERT_EQ(crossings(bodies), 0u) << "a start without crossing";
    for (int i = 0; i < 60; ++i) {
      w.run(2e-3, 1e-3);
      most = std::max(most, test::stats(w.world).contacts);
      ASSERT_EQ(crossings(bodies), 0u) << "seed " << seed << ", after " << 2 * (i + 1) << " ms";
    }
  }
  EXPECT_GT(most, 10u);
}
