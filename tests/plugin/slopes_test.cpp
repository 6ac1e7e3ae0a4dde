// What a law without derivatives costs: how often it is evaluated, against the same law with them, and that
// the motion is the same.
#include "bristle_law.h"

namespace {

uint64_t lanes = 0;
dfm_status counted(const dfm_friction_in *in, dfm_friction_out *out) {
  lanes += in->n;
  return eval(in, out);
}

// The law of bristle_law.h under the id "test.counted", with its derivatives or without.
bool with_derivatives = true;
const dfm_plugin *entry(const dfm_host *host, uint32_t abi, uint32_t least) {
  const dfm_plugin *known = dfm_plugin_entry_bristle(host, abi, least);
  if (!known) return nullptr;
  static dfm_friction ops[2];
  static dfm_type type[2];
  static const dfm_type *types[2][1] = {{&type[0]}, {&type[1]}};
  static dfm_plugin plugin[2];
  const bool w = with_derivatives;
  ops[w] = *static_cast<const dfm_friction *>(known->types[0]->ops);
  type[w] = *known->types[0];
  plugin[w] = *known;
  ops[w].eval = counted;
  ops[w].flags = w ? ops[w].flags | DFM_FRIC_JACOBIAN : ops[w].flags & ~uint32_t{DFM_FRIC_JACOBIAN};
  type[w].ops = &ops[w];
  type[w].id = "test.counted";
  plugin[w].types = types[w];
  return &plugin[w];
}

struct Slide {
  uint64_t lanes;
  double x, z;
};

// A block that is thrown onto a floor, slides, and comes to rest.
Slide slide(bool derivatives) {
  with_derivatives = derivatives;
  lanes = 0;
  test::Context c;
  test::ok(dfm_plugin_register_static(c, entry, "counted"));
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::ok(test::add_friction(w, "test.counted", {{"mu", 0.4}, {"sigma0", 1e8}}));
  test::BodyOptions o;
  o.name = "block";
  o.young = 1e5;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 0.001};
  o.velocity = {0.3, 0.1, 0};
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 200, o);
  test::run(w, 0.2, 1e-3);
  const dfm_body_measure m = test::measure(b);
  return {lanes, m.com[0], m.com[2]};
}

}  // namespace

TEST(Slopes, LawWithoutDerivatives_IsEvaluatedFourTimesAsOften) {
  const Slide with = slide(true), without = slide(false);
  EXPECT_GT(with.lanes, 1000u);
  EXPECT_LT(static_cast<double>(without.lanes), 4.2 * static_cast<double>(with.lanes))
      << without.lanes << " of " << with.lanes;
  EXPECT_NEAR(without.x, with.x, 1e-5);
  EXPECT_NEAR(without.z, with.z, 1e-5);
}
