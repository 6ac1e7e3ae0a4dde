// Hosts that pass on the time of their frames: undamped bodies that fall lose no promise by it. The damping
// that these hosts pay: doc/concepts/step.md.
#include <cmath>
#include <random>

#include "world.h"

namespace {

struct Host {
  const char *name;
  double (*dt)(std::mt19937 &, int);
};
double uniform(std::mt19937 &random) { return double(random()) / 4294967296.0; }

constexpr Host kHosts[] = {
    {"frames of 1/240 s, a third more or less",
     [](std::mt19937 &random, int) { return (0.7 + 0.6 * uniform(random)) / 240; }},
    {"short and uneven", [](std::mt19937 &random, int) { return (0.7 + 0.6 * uniform(random)) / 2000; }},
    {"any", [](std::mt19937 &random, int) { return std::pow(10, -4 + 2.5 * uniform(random)); }},
    {"late ones at times",
     [](std::mt19937 &random, int) { return uniform(random) < 0.05 ? 0.1 : 1.0 / 144; }}};

struct Fall {
  test::Context context;
  dfm_world world = test::make_world(context);
  dfm_body body = 0;
  std::mt19937 random{1};
  double time = 0;
  int frame = 0;

  Fall(const char *model, double young) {
    test::add_plane(world, "floor");
    test::BodyOptions o;
    o.model = model;
    o.young = young;
    o.position = {0, 0, 0.2};
    body = test::make_body(context, world, "beam", {0.3, 0.1, 0.1}, 200, o);
  }
  dfm_status step(const Host &host) {
    const double dt = host.dt(random, frame++);
    time += dt;
    return dfm_world_step(world, dt, nullptr);
  }
  double energy() const { return test::total_energy(body); }
};

}  // namespace

TEST(VariedSteps, OfAnUndampedBeamThatFalls_GainNothing) {
  for (const char *model : {"msm", "corotational_fem"})
    for (const double young : {1e4, 1e5})
      for (const Host &host : kHosts) {
        Fall fall(model, young);
        const double start = fall.energy();
        double most = 0;
        while (fall.time < 3) {
          ASSERT_EQ(fall.step(host), DFM_OK)
              << model << ", " << young << " Pa, " << host.name << ": " << dfm_last_error();
          most = std::max(most, fall.energy());
        }
        EXPECT_LT(most, 1.01 * start) << model << ", " << young << " Pa, " << host.name;
        EXPECT_LT(fall.energy(), 0.5 * start) << "it rests, more or less";
      }
}

TEST(VariedSteps, OfARestoredWorld_GiveTheSameBits) {
  Fall fall("corotational_fem", 1e4);
  for (int i = 0; i < 100; ++i) test::ok(fall.step(kHosts[0]));
  const std::string saved = test::snapshot(fall.world);
  const std::mt19937 random = fall.random;
  uint64_t hash[2];
  for (uint64_t &h : hash) {
    test::ok(dfm_world_restore(fall.world, saved.data(), saved.size()));
    fall.random = random;
    for (int i = 0; i < 100; ++i) test::ok(fall.step(kHosts[0]));
    h = dfm_world_hash(fall.world);
  }
  EXPECT_EQ(hash[0], hash[1]);
}

// Damping acts on motion alone, so what stands still stays where it is, bristles included.
TEST(VariedSteps, OnASlope_HoldTheBlockWhereItIs) {
  for (const char *law : {"coulomb", "lugre"})
    for (const Host &host : kHosts) {
      test::Context context;
      const dfm_world world = test::make_world(context, {9.81 * 0.3, 0, -9.81});
      test::add_plane(world, "floor");
      test::set_friction(world, 0.6, law);
      test::BodyOptions o;
      o.damping_stiffness = 2e-3;
      o.position = {0, 0, 0.0501};
      const dfm_body body = test::make_body(context, world, "beam", {0.2, 0.2, 0.1}, 200, o);
      std::mt19937 random{2};
      double time = 0, at = 0, since = 0;
      for (int i = 0; time < 6; ++i) {
        const double dt = host.dt(random, i);
        test::ok(dfm_world_step(world, dt, nullptr));
        time += dt;
        if (since == 0 && time > 4) {
          since = time;
          at = test::measure(body).com[0];
        }
      }
      EXPECT_LT(std::fabs(test::measure(body).com[0] - at) / (time - since), 1e-9)
          << law << ", " << host.name;
    }
}
