// A soft block on a soft pad, with bristles between the two meshes: `test.bristle` of bristle_law.h, so
// included by one file of a program.
#pragma once
#include "bristle_law.h"

namespace {

void set_bristles(dfm_context *c, dfm_world w, double sigma0, double mu) {
  test::ok(dfm_plugin_register_static(c, dfm_plugin_entry_bristle, "bristle"));
  test::ok(test::add_friction(w, "test.bristle", {{"mu", mu}, {"sigma0", sigma0}}, "block"));
}

struct TwoPads {
  static constexpr double kSigma0 = 1e7, kGravity = 9.81, kPatch = 0.05 * 0.05;  // N/m3, m/s2, m2
  static constexpr uint32_t kCells[2][2] = {{600, 300}, {800, 400}};             // pad, block
  test::Context context;
  dfm_world world;
  dfm_body block;
  // of: row of kCells. x, y: m, of the block from the middle of the pad.
  TwoPads(int of, double x, double y) : world(test::make_world(context, {0, 0, -kGravity})) {
    test::set_friction(world, 10);
    test::add_plane(world, "floor");
    test::BodyOptions o;
    o.young = 2e4;
    o.damping_stiffness = 2e-3;
    o.damping_mass = 60;
    o.volume = 0.5;
    o.name = "pad";
    o.position = {-0.04, -0.04, 2e-5};
    test::make_body(context, world, "beam", {0.08, 0.08, 0.03}, kCells[of][0], o);
    o.name = "block";
    o.position = {-0.025 + x, -0.025 + y, 0.03 + 5e-5};
    block = test::make_body(context, world, "beam", {0.05, 0.05, 0.03}, kCells[of][1], o);
    set_bristles(context, world, kSigma0, 1);
  }
  // act(contact): of those between the two that carry load
  template <class Act>
  void each_loaded(const Act &act) const {
    for (const dfm_contact &c : test::contacts(world))
      if (c.kind != DFM_CONTACT_PRIMITIVE && c.fn > 0) act(c);
  }
  void pull(double along, double down) {  // in g
    const double gravity[3] = {along * kGravity, 0, -down * kGravity};
    test::ok(dfm_world_set_gravity(world, gravity));
  }
};

}  // namespace
