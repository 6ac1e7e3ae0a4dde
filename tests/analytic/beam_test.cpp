// A clamped beam under its own weight. Euler-Bernoulli with Timoshenko's shear: w = q L^4/(8 E I) + q L^2/(2
// k G A), k = 5/6, and for springs alone G = E/(2 (1 + 1/4)). Source: S. Timoshenko, Phil. Mag. 41 (1921);
// the springs' Poisson ratio: doc/models/msm.md.
#include "world.h"

namespace {

constexpr double kL = 0.5, kH = 0.1, kRho = 1000, kG = 9.81;

double timoshenko(double young) {
  const double area = kH * kH, inertia = kH * kH * kH * kH / 12, q = kRho * kG * area, shear = young / 2.5;
  return q * kL * kL * kL * kL / (8 * young * inertia) + q * kL * kL / (2 * (5.0 / 6) * shear * area);
}

// Mean sag of the tip's face at rest, by a run damped until nothing moves.
double sag(double young, uint32_t cells) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  test::BodyOptions o;
  o.young = young;
  o.density = kRho;
  o.damping_mass = 30;
  o.damping_stiffness = 2e-5;
  const dfm_body body = test::make_body(context, world, "beam", {kL, kH, kH}, cells, o);
  dfm_body_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_get_info(body, &info));
  std::vector<double> rest(size_t(3) * info.npoint), now(rest.size());
  test::ok(dfm_body_get_rest(body, info.npoint, rest.data(), 0, nullptr));
  std::vector<uint32_t> clamped, tip;
  for (uint32_t i = 0; i < info.npoint; ++i) {
    if (rest[3 * i] < 1e-9) clamped.push_back(i);
    if (rest[3 * i] > kL - 1e-9) tip.push_back(i);
  }
  test::ok(dfm_body_hold(body, static_cast<uint32_t>(clamped.size()), clamped.data(), 7));
  test::run(world, 0.8, 2e-4);
  EXPECT_LT(test::measure(body).speed_max, 1e-4) << "still moving";
  uint32_t n = 0;
  test::ok(dfm_body_get_state(body, info.npoint, now.data(), nullptr, &n));
  double sum = 0;
  for (uint32_t i : tip) sum += rest[3 * i + 2] - now[3 * i + 2];
  return sum / double(tip.size());
}

}  // namespace

TEST(Cantilever, OwnWeight_SagsInverselyToYoung) { EXPECT_NEAR(sag(4e6, 1000) / sag(8e6, 1000), 2, 0.01); }

// Linear cells are too stiff in bending when there are few of them across, and the layer of cells at the
// surface is of another make than the lattice inside, a share that falls as the cell size: the answer is
// approached from below, to first order. n cubes across are 60 n^3 cells.
TEST(Cantilever, OwnWeight_ApproachesTimoshenkoAsTheMeshIsRefined) {
  const double exact = timoshenko(4e6);
  const double coarse = sag(4e6, 60 * 8);
  const double medium = sag(4e6, 60 * 27);
  const double fine = sag(4e6, 60 * 216);
  EXPECT_LT(coarse, medium);
  EXPECT_LT(medium, fine);
  EXPECT_LT(fine, exact);
  EXPECT_NEAR(fine + (fine - medium), exact, 0.03 * exact);
}
