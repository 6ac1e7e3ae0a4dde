// Laws of different memory in one world: what a contact without bristles keeps is nothing, whoever stood in
// its place before.
#include "world.h"

namespace {

struct Mixture {
  test::Context context;
  dfm_world world;
  dfm_body lower, upper;
  Mixture() : world(test::make_world(context, {2, 1, -9.81})) {
    test::BodyOptions o;
    o.young = 5e4;
    o.damping_stiffness = 2e-3;
    o.name = "lower";
    o.position = {0, 0, 1e-3};
    lower = test::make_body(context, world, "beam", {0.1, 0.1, 0.04}, 120, o);
    o.name = "upper";
    o.position = {0.02, 0.02, 0.05};
    o.spin = {3, -2, 4};  // comes down on an edge, rocks and slides: contacts come and go
    upper = test::make_body(context, world, "beam", {0.06, 0.06, 0.04}, 120, o);
    test::add_plane(world, "floor");
    law("lower", "floor", "coulomb");
    law("lower", "upper", "gms");
    law("upper", "floor", "dahl");
  }
  void law(const char *a, const char *b, const char *name) {
    test::ok(test::add_friction(world, name, {{"mu_C", 0.4}}, a, b));
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) test::ok(dfm_world_step(world, 1e-3, nullptr));
  }
};

}  // namespace

TEST(LawMixture, ContactsWithoutMemory_KeepNone) {
  Mixture m;
  int bare = 0, bristled = 0;
  for (int k = 0; k < 40; ++k) {
    m.run(10);
    for (const dfm_contact &c : test::contacts(m.world)) {
      const bool floor = c.body_a == m.lower && c.body_b != m.upper && c.body_b != m.lower &&
                         c.kind == DFM_CONTACT_PRIMITIVE;
      if (floor) {
        EXPECT_EQ(std::fabs(c.bristle[0]) + std::fabs(c.bristle[1]), 0) << k;
      }
      (floor ? bare : bristled) += 1;
    }
  }
  EXPECT_GT(bare, 100);
  EXPECT_GT(bristled, 100);
}

TEST(LawMixture, SavedAndRestored_ContinuesWithTheSameBits) {
  for (const int until : {60, 150, 300}) {
    Mixture a, b;
    a.run(until);
    const std::string data = test::snapshot(a.world);
    test::ok(dfm_world_restore(b.world, data.data(), data.size()));
    for (int k = 0; k < 5; ++k) {
      a.run(20);
      b.run(20);
      ASSERT_EQ(dfm_world_hash(a.world), dfm_world_hash(b.world)) << until << " " << k;
    }
  }
}
