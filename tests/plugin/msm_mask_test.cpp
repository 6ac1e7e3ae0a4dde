// Springs that are switched off (dfm.spring_mask/1): a cut bar falls apart, nothing is gained, nothing is
// paid without a mask.
#include "msm_host.h"

namespace msm_test {
namespace {

std::vector<uint32_t> across(const Mesh &m, double x) {  // edges that cross the plane at x
  std::vector<uint32_t> out;
  for (uint32_t e = 0; e < m.edges.size() / 2; ++e)
    if ((m.at(m.edges[2 * e])[0] < x) != (m.at(m.edges[2 * e + 1])[0] < x)) out.push_back(e);
  return out;
}

std::vector<uint8_t> get(const Instance &b) {
  std::vector<uint8_t> on(b.mesh.edges.size() / 2, 7);
  EXPECT_EQ(static_cast<const dfm_spring_mask *>(b.ops->extension(b.self, DFM_EXT_SPRING_MASK))
                ->get(b.self, on.data()),
            DFM_OK);
  return on;
}

Params soft() {
  Params p = {1e5, 0.4, 0.001, 0, 1};
  p.slope = 1;
  p.axis = {0, 1, 1};
  return p;
}

TEST(MsmMask, CutBar_FallsApartKeepsMomentumAndGainsNoEnergy) {
  Host host;
  Instance b(host, kuhn_bar(8, 2, 2, 0.1, 0.1), soft());
  const auto energy = [&] {
    double e = b.energy();
    for (uint32_t i = 0; i < b.size(); ++i) e += 0.5 * b.mesh.mass[i] * dot(b.get(b.v, i), b.get(b.v, i));
    return e;
  };
  const auto momentum = [&](int half) {  // 0 left, 1 right
    Vec sum{};
    for (uint32_t i = 0; i < b.size(); ++i)
      if ((b.mesh.at(i)[0] > 0.45) == (half == 1)) sum = sum + b.mesh.mass[i] * b.get(b.v, i);
    return sum;
  };
  for (uint32_t i = 0; i < b.size(); ++i) {  // stretched, halves that leave each other at 0.2 m/s
    const Vec x = b.mesh.at(i);
    b.set(b.x, i, {1.05 * x[0], x[1], x[2]});
    b.set(b.v, i, {x[0] > 0.45 ? 0.1 : -0.1, 0.02, 0});
  }
  const double whole = energy();
  b.mask(across(b.mesh, 0.45), false);
  double last = energy();
  EXPECT_LT(last, whole);
  const Vec left = momentum(0), right = momentum(1);
  const double h = 0.5 * b.bound();
  for (int n = 0; n < 4000; ++n) {
    b.forces();
    b.move(h);
    ASSERT_LT(energy(), whole) << n;
  }
  EXPECT_LT(energy(), last);
  const double scale = norm(right);
  EXPECT_LT(norm(momentum(0) - left), 1e-12 * scale);
  EXPECT_LT(norm(momentum(1) - right), 1e-12 * scale);
  double gap = 1e300, reach = -1e300;
  for (uint32_t i = 0; i < b.size(); ++i)
    if (b.mesh.at(i)[0] > 0.45) gap = std::min(gap, b.get(b.x, i)[0]);
    else reach = std::max(reach, b.get(b.x, i)[0]);
  EXPECT_GT(gap - reach, 0.1 + 0.15 * h * 4000);
}

TEST(MsmMask, EveryCut_LowersTheEnergyAndKeepsTheBound) {
  Host host;
  Instance b(host, kuhn_bar(5, 3, 2, 0.1, 0.2), soft());
  b.shake(0.02, 0);
  std::mt19937 random(3);
  double last = b.energy();
  std::vector<double> before, now;
  b.bound(&before);
  for (int n = 0; n < 40; ++n) {
    b.mask({uint32_t(random() % (b.mesh.edges.size() / 2))}, false);
    EXPECT_LE(b.energy(), last);
    last = b.energy();
  }
  b.bound(&now);
  // What |A_i| loses in a direction cannot make a row larger by more than its own estimate of the norm.
  for (uint32_t i = 0; i < b.size(); ++i) EXPECT_LT(now[i], 1.1 * before[i]);
  b.forces();
  Vec sum{};
  for (uint32_t i = 0; i < b.size(); ++i) sum = sum + b.get(b.f, i);
  EXPECT_LT(norm(sum), 1e-12 * b.size() * b.largest_force());
}

TEST(MsmMask, CellThatLostASpring_HasNoVolumeTerm) {
  Host host;
  Instance b(host, irregular_tet(), {1.0, 0.25, 0, 0, 1e6});
  b.mask({3}, false);
  for (uint32_t i = 0; i < 4; ++i) b.set(b.x, i, 1.1 * b.mesh.at(i));
  const double springs = b.energy();
  b.forces();
  EXPECT_LT(b.largest_force(), 10);  // 1 Pa; the volume term would give 1e5
  b.mask({3}, true);
  EXPECT_GT(b.energy(), 1e3 * springs);
}

TEST(MsmMask, OnAgain_IsThePlainBodyToTheBit) {
  Host plain_host, host;
  const Mesh mesh = kuhn_bar(5, 3, 2, 0.1, 0.2);
  Instance a(plain_host, mesh, soft()), b(host, mesh, soft());
  EXPECT_EQ(plain_host.live, host.live);
  EXPECT_EQ(get(b), std::vector<uint8_t>(mesh.edges.size() / 2, 1));
  b.mask({4, 9, 4}, false);
  std::vector<uint8_t> expected(mesh.edges.size() / 2, 1);
  expected[4] = expected[9] = 0;
  EXPECT_EQ(get(b), expected);
  // parameters leave the mask alone
  ASSERT_EQ(b.ops->set_params(b.self, Instance::row(soft()).data()), DFM_OK);
  EXPECT_EQ(get(b), expected);
  a.shake(0.02, 1);
  b.shake(0.02, 1);
  a.forces();
  b.forces();
  EXPECT_NE(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0);
  b.mask({4, 9}, true);
  b.forces();
  EXPECT_EQ(std::memcmp(a.f, b.f, 4 * a.size() * sizeof(double)), 0);
  EXPECT_EQ(a.bound(), b.bound());
}

// All or nothing: forces, energy, bound and mask are those of before, to the bit.
TEST(MsmMask, ParametersThatFindNoMemory_ChangeNothing) {
  Host host;
  Instance b(
      host, kuhn_bar(3, 2, 2, 0.1, 0.2), {1e5}, 4,
      {{"damping_mass", std::vector<double>(72, 1)}, {"damping_stiffness", std::vector<double>(72, 1e-3)}});
  b.mask({2}, false);
  b.shake(0.01, 1);
  b.forces();
  const std::vector<double> f(b.f, b.f + 4 * b.size());
  const std::vector<uint8_t> mask = get(b);
  const double energy = b.energy(), bound = b.bound();
  size_t failed = 0;
  for (;; ++failed) {
    host.calls = 0;
    host.fail_at = failed;
    const dfm_status status = b.ops->set_params(b.self, Instance::row(soft()).data());
    host.fail_at = ~size_t(0);
    EXPECT_EQ(get(b), mask);
    b.forces();
    if (status == DFM_OK) break;
    EXPECT_EQ(status, DFM_E_NOMEM);
    EXPECT_EQ(std::memcmp(f.data(), b.f, f.size() * sizeof(double)), 0) << failed;
    EXPECT_EQ(b.energy(), energy) << failed;
    EXPECT_EQ(b.bound(), bound) << failed;
  }
  EXPECT_GT(failed, 5u);
  EXPECT_NE(b.energy(), energy);
}

TEST(MsmMask, EdgeThatDoesNotExist_IsRefusedAndNothingChanges) {
  Host host;
  Instance b(host, irregular_tet(), soft());
  const auto *ext = static_cast<const dfm_spring_mask *>(b.ops->extension(b.self, DFM_EXT_SPRING_MASK));
  const uint32_t wrong[] = {1, 6};
  EXPECT_EQ(ext->set(b.self, 2, wrong, 0), DFM_E_ARG);
  EXPECT_NE(host.logged.find("does not exist"), std::string::npos);
  EXPECT_EQ(get(b), std::vector<uint8_t>(6, 1));
}

}  // namespace
}  // namespace msm_test
