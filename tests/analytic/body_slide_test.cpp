// A block slides without friction over a body of triangles, coarse or fine, as over a plane. The ghost of
// every engine: a flat vertex of the lower body that the leading edge of the upper one meets with a
// leaning normal.
//
// What may differ is the dent. Under the block's pressure p = rho g H the slab of modulus E and thickness t
// goes down by p t / E, within an edge or so of the rim, so normals lean by some p / E (1e-4, 5e-3 for the
// soft one) and the weight's part along the slide is at most m g times that.
#include "obstacle.h"

namespace {

constexpr double kG = 9.81, kHeight = 0.1, kThick = 0.04, kSpeed = 0.7, kTime = 0.3;

struct Slide {
  test::Context context;
  dfm_world world;
  dfm_body block = 0, slab = 0;

  explicit Slide(uint32_t cells, double young = 0) {
    world = test::make_world(context);
    test::set_friction(world, 0);
    test::add_plane(world, "floor", {0, 0, cells ? -kThick - 1e-4 : 0});
    test::BodyOptions o;
    o.name = "block";
    o.young = 1e6;
    o.damping_stiffness = 1e-3;
    o.position = {-0.05, -0.05, 1e-4};
    block = test::make_body(context, world, "beam", {0.1, 0.1, kHeight}, 60, o);
    if (cells) {
      o.name = "slab";
      o.young = young;
      o.damping_stiffness = 1e-4;
      o.position = {-0.2, -0.2, -kThick};
      slab = test::make_body(context, world, "beam", {0.8, 0.4, kThick}, cells, o);
    }
    test::run(world, 0.2, 1e-3);
    uint32_t n = 0;
    test::ok(dfm_body_get_state(block, 0, nullptr, nullptr, &n));
    std::vector<double> v(size_t(3) * n);
    for (size_t i = 0; i < v.size(); ++i) v[i] = i % 3 == 0 ? kSpeed : i % 3 == 1 ? 0.2 : 0;
    test::ok(dfm_body_set_state(block, n, nullptr, v.data()));
  }
};

}  // namespace

TEST(BodySlide, Frictionless_IsThatOnPlane) {
  Slide on_plane(0);
  test::run(on_plane.world, kTime, 1e-3);
  const dfm_body_measure want = test::measure(on_plane.block);
  EXPECT_NEAR(want.velocity[0], kSpeed, 1e-9);
  for (const auto &[cells, young] : {std::pair{200u, 1e7}, {3000u, 1e7}, {3000u, 2e5}}) {
    const double lean = 1000 * kG * kHeight / young;
    Slide s(cells, young);
    const double height = test::measure(s.block).com[2];
    double leaning = 0, rise = 0;
    size_t least = SIZE_MAX;
    for (int k = 0; k < 100 * kTime; ++k) {
      for (int i = 0; i < 10; ++i) {
        test::run(s.world, 1e-3, 1e-3);
        size_t between = 0;
        for (const dfm_contact &c : test::contacts(s.world)) {
          if (c.body_a != s.block && c.body_b != s.block) continue;
          ++between;
          leaning = std::max(leaning, std::hypot(c.normal[0], c.normal[1]));
        }
        least = std::min(least, between);
      }
      rise = std::max(rise, std::fabs(test::measure(s.block).com[2] - height));
    }
    const dfm_body_measure got = test::measure(s.block);
    for (int i = 0; i < 2; ++i)
      EXPECT_NEAR(got.velocity[i], want.velocity[i], kG * lean * kTime) << cells << " cells, axis " << i;
    EXPECT_LT(leaning, 10 * lean) << cells;
    EXPECT_LT(rise, 2 * lean * kThick) << "no more than the dent; " << cells;
    EXPECT_GE(least, 6u) << cells;
    const double off = got.velocity[0] - want.velocity[0];
    std::printf("%u cells of %.0e Pa: %.2e m/s off the plane's, normals lean by %.1e, rises by %.1e m\n",
                cells, young, off, leaning, rise);
  }
}
