// A block on a plane and a block on a block rest in their static shape, whatever moves them there: the ends
// of what tests/bench/rest_compression.cpp tabulates.
#include "compression.h"

namespace {

using namespace test::compression;

class Rest : public testing::TestWithParam<const char *> {};

}  // namespace

TEST_P(Rest, BlockOnAPlaneAndOnABlock_AreCompressedAsTheStaticSolutionSays) {
  for (const char *scene : {"plane", "column", "pair"})
    for (const int32_t integrator :
         {DFM_INTEGRATOR_SYMPLECTIC_EULER, DFM_INTEGRATOR_IMPLICIT_EULER, DFM_INTEGRATOR_TR_BDF2})
      for (const double step : {1e-4, 1.0 / 60})
        for (const double young : {1e4, 1e7}) {
          // TR-BDF2 rests by backward Euler
          if (integrator == DFM_INTEGRATOR_TR_BDF2 && (step < 1e-3 || scene == std::string("pair"))) continue;
          if (scene == std::string("pair") && step < 1e-3 && young < 1e5) continue;  // the costliest
          // springs in every combination, finite elements with one modulus at each step
          if (GetParam() != std::string("msm") && (step < 1e-3) != (young > 1e5)) continue;
          const Result r = run_case({scene, GetParam(), integrator, step, young});
          const std::string what = std::string(scene) + ", integrator " + std::to_string(integrator) +
                                   ", step " + std::to_string(step) + " s, E " + std::to_string(young) +
                                   " Pa";
          EXPECT_LT(r.error, scene == std::string("pair") ? 0.01 : 1e-3) << what;
          EXPECT_LT(r.gap, (scene == std::string("pair") ? 0.05 : 0.01) * kOffset) << what;
        }
}

INSTANTIATE_TEST_SUITE_P(Models, Rest, testing::Values("msm", "corotational_fem", "linear_fem"),
                         [](const auto &p) { return std::string(p.param); });
