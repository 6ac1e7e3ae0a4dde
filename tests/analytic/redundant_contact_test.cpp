// More surfels than points carry the body, and laws that are no projection: forces of single contacts are not
// unique, their sum is. Before laws were asked again beyond the cap on sweeps, such a block turned round
// instead of stopping and walked on at 7 mm/s, pushed by friction that no law gives
// (doc/decisions/contact_solver.md).
#include "coupled.h"
#include "hold.h"

namespace {

using namespace test;

constexpr double kStep = 1.0 / 240, kSpeed = 0.1, kG = 9.81;

class Redundant : public testing::TestWithParam<const char *> {};

}  // namespace

// A block of 16 points below, with 36 surfels, slides onto rest: v^2 / (2 mu g), give or take the way of a
// step. Backward Euler stops in whole steps.
TEST_P(Redundant, SlidingBlock_StopsWhereItsLawSays) {
  for (const char *model : {"modal", "corotational_fem"}) {
    Context context;
    const dfm_world w = make_world(context, {0, 0, -kG}, DFM_INTEGRATOR_IMPLICIT_EULER);
    add_plane(w, "floor");
    Skin skin = box_skin({0.06, 0.06, 0.03}, 5);
    const dfm_surface_def surface = skin.def();
    BodyOptions o;
    o.model = model;
    o.young = 2e5;
    o.damping_stiffness = 1e-3;
    o.position = {0, 0, 1e-5};
    o.surface = &surface;
    const dfm_body block = make_body(context, w, "beam", {0.06, 0.06, 0.03}, 108, o);
    hold::set_law(w, GetParam());
    run(w, 0.2, kStep);
    const double start = measure(block).com[0];
    set_velocity(block, {kSpeed, 0, 0});
    double work = 0, back = 0;
    const uint64_t unconverged = stats(w).unconverged;
    for (int i = 0; i < 48; ++i) {
      run(w, kStep, kStep);
      back = std::min(back, measure(block).velocity[0]);
      for (const dfm_pair_report &p : listed(dfm_world_pairs, w)) work = std::max(work, p.friction_work);
    }
    const std::string what = std::string(model) + ", " + GetParam();
    EXPECT_NEAR(measure(block).com[0] - start, kSpeed * kSpeed / (2 * hold::kMu * kG), kSpeed * kStep)
        << what;
    EXPECT_LT(measure(block).speed_max, 1e-6) << what;
    EXPECT_LT(work, 1e-9) << what;  // J; the block brought 0.5 mJ
    EXPECT_LE(stats(w).unconverged - unconverged, 2u) << what;
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, Redundant, testing::Values("dahl", "lugre", "elastoplastic", "gms"),
                         [](const auto &p) { return std::string(p.param); });

// Beams of 40 modes on a slope that friction holds: 60 contacts hold 46 motions. Sweeps handed loads from
// contact to contact too slowly, ended at their cap in every step, and the beam crept by 4e-6 m/s at 1/60 s
// (doc/decisions/contact_solver.md). Two beams are two parts; one alone has the same motion.
TEST(RedundantModes, BeamsOnASlope_Stay) {
  for (const double step : {1.0 / 60, 0.004}) {
    Context context;
    const double c = std::cos(M_PI / 9), s = std::sin(M_PI / 9);
    const dfm_world w = make_world(context, {kG * s, 0, -kG * c}, DFM_INTEGRATOR_IMPLICIT_EULER);
    add_plane(w, "floor");
    BodyOptions o;
    o.model = "modal";
    o.young = 1e5;
    o.damping_stiffness = 0.002;
    std::vector<dfm_body> beams;
    for (const double y : {0.0, 0.3}) {
      o.position = {0, y, 1e-4};
      o.name = y > 0 ? "second" : "first";
      beams.push_back(make_body(context, w, "beam", {0.4, 0.1, 0.05}, 500, o));
    }
    set_friction(w, hold::kMu);
    run(w, 1, step);
    const uint64_t unconverged = stats(w).unconverged;
    std::vector<Vec> before;
    for (const dfm_body b : beams) before.push_back(vec(measure(b).com));
    run(w, 0.5, step);
    for (size_t i = 0; i < beams.size(); ++i)
      EXPECT_LT(apart(before[i], vec(measure(beams[i]).com)) / 0.5, 2e-7) << step << ", " << i;
    EXPECT_EQ(stats(w).unconverged, unconverged) << step;
  }
}

// Three blocks of 400 cells, turned against each other, land on each other and on a slope that holds them:
// about 200 contacts that the blocks can move at in 350 ways. By sweeps alone 22 of these 25 steps ended at
// their cap (doc/decisions/contact_solver.md).
TEST(RedundantStack, TurnedBlocks_LandWithinTheTolerance) {
  for (const int32_t integrator : {DFM_INTEGRATOR_IMPLICIT_EULER, DFM_INTEGRATOR_TR_BDF2}) {
    Context context;
    const dfm_world w = make_world(context, {1, 0, -kG}, integrator);
    add_plane(w, "floor");
    set_friction(w, 0.5);
    BodyOptions o;
    o.model = "corotational_fem";
    o.poisson = 0.25;
    o.damping_stiffness = 4e-3;
    const double shift[3][3] = {{0, 0, 0}, {0.013, -0.004, 11}, {-0.003, 0.008, -7}};
    for (int k = 0; k < 3; ++k) {
      const double half = 0.5 * shift[k][2] * M_PI / 180;
      o.position = {shift[k][0], shift[k][1], 2e-5 + k * 0.05002};
      o.rotation = {0, 0, std::sin(half), std::cos(half)};
      make_body(context, w, "beam", {0.1, 0.1, 0.05}, 400, o);
    }
    run(w, 0.1, 0.004);
    EXPECT_LE(stats(w).unconverged, 2u);
  }
}

namespace {

// Five blocks of 0.05 m on each other, a little beside each other, as tests/bench/five_blocks.json.
std::vector<dfm_body> five_blocks(Context &context, dfm_world w, BodyOptions o) {
  const double shift[5][2] = {{-0.003, -0.002}, {0, 0.002}, {0.003, 0}, {-0.003, -0.002}, {0, 0.002}};
  add_plane(w, "floor");
  set_friction(w, 0.5);
  std::vector<dfm_body> blocks;
  for (int k = 0; k < 5; ++k) {
    o.position = {shift[k][0], shift[k][1], 2e-5 + k * 0.05002};
    blocks.push_back(make_body(context, w, "beam", {0.05, 0.05, 0.05}, 400, o));
  }
  return blocks;
}

}  // namespace

// Undamped, of 1 MPa. Before crossings of edges in their flush faces gave way under load, 9 of 10 sub-steps
// ended at the cap on sweeps.
TEST(RedundantStack, FiveExplicitBlocks_FewStepsEndAtTheCap) {
  Context context;
  const dfm_world w = make_world(context, {0, 0, -kG});
  BodyOptions o;
  o.young = 1e6;
  const std::vector<dfm_body> blocks = five_blocks(context, w, o);
  run(w, 0.5, 1.0 / 60);
  EXPECT_LE(stats(w).unconverged, stats(w).substeps / 50);
  // Gravity that acts at once on an undamped column of 0.25 m leaves up to g H / c = 0.08 m/s.
  for (const dfm_body b : blocks) EXPECT_LT(measure(b).speed_max, 0.08);
  EXPECT_EQ(stats(w).guard_steps, 0u);
}

// A column buckles under its own weight from the height (7.84 E I / (rho g A))^(1/3) on (Greenhill 1881):
// 0.255 m with 1e5 Pa, 0.32 m with 2e5 Pa. So five blocks fall with 1e5 Pa, and stand with 2e5 Pa.
TEST(RedundantStack, FiveImplicitBlocks_FallWhereAColumnBuckles) {
  for (const double young : {1e5, 2e5}) {
    Context context;
    const dfm_world w = make_world(context, {0, 0, -kG}, DFM_INTEGRATOR_TR_BDF2);
    BodyOptions o;
    o.model = "corotational_fem";
    o.young = young;
    const std::vector<dfm_body> blocks = five_blocks(context, w, o);
    const double start = measure(blocks.back()).com[0];
    run(w, 0.6, 0.004);
    const double lean = std::fabs(measure(blocks.back()).com[0] - start);
    if (young > 1.5e5) EXPECT_LT(lean, 1e-3);
    else EXPECT_GT(lean, 1e-2);
  }
}
