// Different friction on different parts of one surface, and contacts that slide from triangle to triangle and
// from part to part.
#include <map>
#include <set>

#include "bristle_law.h"
#include "zoned.h"

namespace {

constexpr double kG = 9.81;

// Adds a speed along x to all points.
void push(dfm_body body, double speed) {
  auto [x, v] = test::State(body);
  const uint32_t n = uint32_t(x.size() / 3);
  for (uint32_t i = 0; i < n; ++i) v[3 * i] += speed;
  test::ok(dfm_body_set_state(body, n, x.data(), v.data()));
}

// A block of edge 0.1 m, ice for y < 0.05 and rubber beyond, on a plane.
struct Sledge {
  test::Context context;
  dfm_world world;
  dfm_body body;
  // 4 cells along an edge: the line between the parts is one of the mesh
  explicit Sledge(double ice, double rubber, uint32_t cells = 768) {
    world = test::make_world(context);
    test::ZonedOptions o;
    o.name = "block";
    o.young = 1e6;
    o.poisson = 0;
    o.damping_stiffness = 1e-3;
    o.position = {-0.05, -0.05, 2e-5};
    o.groups = {"ice", "rubber"};
    o.group = [](const double x[3]) { return x[1] < 0.05 ? 0u : 1u; };
    body = test::make_zoned_beam(context, world, {0.1, 0.1, 0.1}, cells, o);
    test::add_plane(world, "floor");
    test::ok(test::friction(world, "block:ice", "floor", ice));
    test::ok(test::friction(world, "floor", "block:rubber", rubber));
  }
};

}  // namespace

TEST(Zones, SlidingBlockOnIceAndRubber_IsTurnedByTheClosedForm) {
  // Uniform pressure W/b2, each half with its own coefficient at a mean lever of b/4: moment W b (rubber -
  // ice) / 8, force W (ice + rubber) / 2. The surfels on the line between the halves, a quarter of the face
  // at 4 cells along an edge, belong to the part with the lowest triangles: ice. That moves an eighth of the
  // weight from rubber to ice, and nothing of the moment, as the line runs through the middle.
  const double ice = 0.05, rubber = 0.35;
  Sledge s(ice, rubber);
  test::run(s.world, 0.3, 1e-3);
  push(s.body, 3);
  test::run(s.world, 0.03, 1e-3);
  const double weight = test::measure(s.body).mass * kG;
  double moment = 0, friction = 0;
  const int steps = 20;
  for (int k = 0; k < steps; ++k) {
    test::run(s.world, 1e-3, 1e-3);
    dfm_pair_report pair{};
    uint32_t n = 0;
    ASSERT_EQ(dfm_world_pairs(s.world, 1, &pair, &n), DFM_OK) << dfm_last_error();
    ASSERT_EQ(n, 1u);
    moment += pair.moment[2] / steps;
    friction += pair.friction[0] / steps;
  }
  EXPECT_NEAR(moment, weight * 0.1 * (rubber - ice) / 8, 0.02 * weight * 0.1 * (rubber - ice) / 8);
  const double force = weight * (0.625 * ice + 0.375 * rubber);
  EXPECT_NEAR(friction, -force, 0.02 * force);
  EXPECT_GT(test::measure(s.body).angular[2], 0) << "the rubber holds back the left side";
}

TEST(Zones, EveryContact_CarriesTheLawOfItsPart) {
  Sledge s(0.05, 0.35);
  test::run(s.world, 0.3, 1e-3);
  push(s.body, 3);
  std::map<uint32_t, int> seen;
  for (int k = 0; k < 20; ++k) {
    test::run(s.world, 1e-3, 1e-3);
    for (const dfm_contact &c : test::contacts(s.world)) {
      // surfels on the line between the parts belong to either
      if (!(c.fn > 1e-3) || std::fabs(c.point[1]) < 1e-3) continue;
      EXPECT_NEAR(std::hypot(c.ft[0], c.ft[1]), (c.point[1] < 0 ? 0.05 : 0.35) * c.fn, 1e-6 * c.fn)
          << "y " << c.point[1];
      ++seen[c.law];
    }
  }
  ASSERT_EQ(seen.size(), 2u);
  for (const auto &[law, count] : seen) EXPECT_GT(count, 100) << law;
}

TEST(Zones, MaterialOfTheCellBehindATriangle_DecidesItsLaw) {
  test::Context context;
  const dfm_world world = test::make_world(context);
  dfm_material soft[2];
  const char *const names[] = {"ice", "rubber"};
  for (int i = 0; i < 2; ++i) {
    dfm_material_def d = dfm_material_def_default();
    d.name = names[i];
    d.young = 1e6;
    d.poisson = 0;
    d.damping_stiffness = 1e-3;
    test::ok(dfm_material_create(world, &d, &soft[i]));
  }
  test::ZonedOptions o;
  o.name = "block";
  o.position = {-0.05, -0.05, 2e-5};
  o.velocity = {2, 0, 0};
  o.material = [&](const double x[3]) { return soft[x[1] < 0.05 ? 0 : 1]; };
  test::make_zoned_beam(context, world, {0.1, 0.1, 0.1}, 768, o);
  test::add_plane(world, "floor");
  test::ok(test::friction(world, "material=ice", "*", 0.05));
  test::ok(test::friction(world, "material=rubber", "*", 0.35));
  int seen[2] = {};
  for (int k = 0; k < 60; ++k) {
    test::run(world, 1e-3, 1e-3);
    for (const dfm_contact &c : test::contacts(world)) {
      if (!(c.fn > 1e-3) || std::fabs(c.point[1]) < 5e-3 || c.flags & DFM_CONTACT_STICKING) continue;
      EXPECT_NEAR(std::hypot(c.ft[0], c.ft[1]), (c.point[1] < 0 ? 0.05 : 0.35) * c.fn, 1e-6 * c.fn)
          << "y " << c.point[1];
      ++seen[c.point[1] < 0 ? 0 : 1];
    }
  }
  EXPECT_GT(seen[0], 100);
  EXPECT_GT(seen[1], 100);
}

namespace {

// A narrow block slides along x between two rows of points of a held plate of two parts; both carry the
// bristle law, softer on the second part.
struct Crossing {
  test::Context context;
  dfm_world world;
  dfm_body plate, block;
  static constexpr double kSigma[2] = {1e7, 1e6};  // N/m3
  explicit Crossing(bool one_law) {
    test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_bristle, "bristle"));
    world = test::make_world(context);
    test::ZonedOptions p;
    p.name = "plate";
    p.held = true;
    p.position = {0, -0.05, -0.02};
    p.groups = {"near", "far"};
    p.group = [](const double x[3]) { return x[0] < 0.2 ? 0u : 1u; };
    plate = test::make_zoned_beam(context, world, {0.4, 0.1, 0.02}, 1200, p);  // squares of 0.02 m
    test::ZonedOptions o;
    o.name = "block";
    o.young = 2e5;
    o.damping_stiffness = 1e-3;
    o.position = {0.02, -0.005, 2e-5};
    block = test::make_zoned_beam(context, world, {0.03, 0.01, 0.01}, 36, o);
    const double mu = 0.1;
    for (int k = 0; k < 2; ++k) {
      test::ok(test::add_friction(world, "test.bristle", {{"mu", mu}, {"sigma0", kSigma[one_law ? 0 : k]}},
                                  "block", k ? "plate:far" : "plate:near"));
    }
  }
  // Contacts of the block's own surfels on the plate, by surfel.
  std::map<uint32_t, dfm_contact> corners() const {
    std::map<uint32_t, dfm_contact> out;
    for (const dfm_contact &c : test::contacts(world))
      if (c.body_a == block && c.kind == DFM_CONTACT_VERTEX_FACE) out[c.feature_a] = c;
    return out;
  }
};

}  // namespace

TEST(Identity, ContactSlidingOverTwentyTriangles_KeepsItsKeyAndItsBristle) {
  Crossing s(true);
  test::run(s.world, 0.2, 1e-3);
  push(s.block, 1.2);
  test::run(s.world, 0.02, 1e-3);
  const auto first = s.corners();
  ASSERT_GE(first.size(), 4u);
  uint32_t n = 0;
  std::map<uint32_t, std::set<uint32_t>> under;
  std::vector<dfm_contact_event> events(65536);
  test::ok(dfm_world_events(s.world, 65536, events.data(), &n));
  for (int k = 0; k < 200; ++k) {
    test::run(s.world, 1e-3, 1e-3);
    const auto now = s.corners();
    for (const auto &[surfel, c] : first) {
      ASSERT_EQ(now.count(surfel), 1u) << "surfel " << surfel << " at step " << k;
      const dfm_contact &d = now.at(surfel);
      EXPECT_EQ(d.key, c.key);
      EXPECT_FALSE(d.flags & DFM_CONTACT_BEGAN);
      under[surfel].insert(d.feature_b);
      // it slides all the time, so its bristle is as long as the cone allows: it was never dropped on the way
      const double most = 0.1 * d.fn / (Crossing::kSigma[0] * d.area);
      EXPECT_NEAR(std::hypot(d.bristle[0], d.bristle[1]), most, 1e-3 * most + 1e-12) << "step " << k;
    }
  }
  for (const auto &[surfel, triangles] : under) EXPECT_GE(triangles.size(), 20u) << surfel;
  test::ok(dfm_world_events(s.world, 65536, events.data(), &n));
  for (uint32_t i = 0; i < n; ++i)
    for (const auto &[surfel, c] : first) EXPECT_NE(events[i].key, c.key) << "neither ended nor began anew";
}

TEST(Identity, ContactThatSlidesIntoAnotherPart_ChangesItsLawAndStartsFromRest) {
  Crossing s(false);
  test::run(s.world, 0.2, 1e-3);
  push(s.block, 1.2);
  test::run(s.world, 0.02, 1e-3);
  std::map<uint32_t, dfm_contact> before = s.corners();
  int crossed = 0;
  for (int k = 0; k < 250; ++k) {
    test::run(s.world, 1e-3, 1e-3);
    const auto now = s.corners();
    for (const auto &[surfel, c] : now) {
      const auto old = before.find(surfel);
      if (old == before.end() || old->second.law == c.law) continue;
      ++crossed;
      EXPECT_EQ(c.key, old->second.key) << "the contact lives on";
      EXPECT_GT(c.point[0], 0.19);
      // one step of slip at most: the soft bristle of the second part, mu fn / (sigma A) when it
      // slides, is far longer
      const double slip = std::hypot(c.slip[0], c.slip[1]), length = std::hypot(c.bristle[0], c.bristle[1]);
      EXPECT_LE(length, 1e-3 * slip * (1 + 1e-9));
      EXPECT_GT(std::hypot(old->second.bristle[0], old->second.bristle[1]), 0);
    }
    before = now;
  }
  EXPECT_GE(crossed, 4);
}
