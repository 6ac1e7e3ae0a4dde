// More surfels than points carry the body, and laws that are no projection: forces of single contacts are not
// unique, their sum is. Before laws were asked again beyond the cap on sweeps, such a block turned round
// instead of stopping and walked on at 7 mm/s, pushed by friction that no law gives (doc/decisions/0201).
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
