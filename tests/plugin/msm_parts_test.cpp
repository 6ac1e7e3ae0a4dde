// Forces of org.deform.msm part by part, extension dfm.part_forces/1: each point once, the bits of
// add_forces, whatever the cut. Sees the plugin ABI alone.
#include "msm_host.h"

namespace msm_test {
namespace {

struct Parts : Instance {
  using Instance::Instance;
  const dfm_part_forces &table() const {
    return *static_cast<const dfm_part_forces *>(ops->extension(self, DFM_EXT_PART_FORCES));
  }
  dfm_kin with_result() {
    dfm_kin k = kin();
    std::fill(state_out.begin(), state_out.end(), -1.0);
    k.state_out = state_out.empty() ? nullptr : state_out.data();
    return k;
  }
  struct Taken {
    std::vector<double> force;  // [npoint,4]
    std::vector<int> times;     // [npoint]
    std::vector<int> parts;     // [part]
  };
  dfm_status take(bool single, Taken &out) {
    out = {std::vector<double>(4 * size_t(size()), 0.0), std::vector<int>(size(), 0),
           std::vector<int>(table().parts(self), 0)};
    const auto add = [](void *user, uint32_t part, uint32_t n, const uint32_t *point, const double *from) {
      Taken &to = *static_cast<Taken *>(user);
      ++to.parts.at(part);
      for (uint32_t k = 0; k < n; ++k) {
        ++to.times.at(point[k]);
        for (uint32_t c = 0; c < 4; ++c) to.force[4 * size_t(point[k]) + c] += from[4 * size_t(k) + c];
      }
    };
    const dfm_kin k = with_result();
    return table().forces(self, &k, single, add, &out);
  }
};

void expect_forces(Parts &b, bool single) {
  Parts::Taken taken;
  ASSERT_EQ(b.take(single, taken), DFM_OK);
  const std::vector<double> by_parts = b.state_out;
  std::fill(b.f, b.f + size_t(b.size()) * b.stride, 0.0);
  const dfm_kin k = b.with_result();
  const auto *f32 = static_cast<const dfm_f32 *>(b.ops->extension(b.self, DFM_EXT_F32));
  ASSERT_EQ(single ? f32->add_forces(b.self, &k, b.f) : b.ops->add_forces(b.self, &k, b.f), DFM_OK);
  EXPECT_EQ(by_parts, b.state_out);
  EXPECT_EQ(taken.times, std::vector<int>(b.size(), 1));
  EXPECT_EQ(taken.parts, std::vector<int>(taken.parts.size(), 1));
  double most = 0;
  for (uint32_t i = 0; i < b.size(); ++i)
    for (uint32_t c = 0; c < 4; ++c) {
      const double whole = c < 3 ? b.f[size_t(b.stride) * i + c] : 0;
      EXPECT_EQ(taken.force[4 * size_t(i) + c], whole) << i;
      most = std::max(most, std::abs(whole));
    }
  EXPECT_GT(most, 1e-3);
}

const Params kFull = {2e5, 0.4, 0.003, 0.5, 1.5};

TEST(MsmParts, EachPoint_ComesOnceWithTheBitsOfAddForces) {
  Params branches = kFull, tilted = kFull;
  branches.damper = 2;
  tilted.slope = 1.3;
  for (const Mesh &mesh : {kuhn_bar(4, 3, 2, 0.1, 0.2), kuhn_bar(30, 9, 8, 0.05, 0.2)})
    for (const Params &p : {kFull, tilted, branches})
      for (unsigned shuffle : {0u, 7u})
        for (uint32_t stride : {3u, 4u}) {
          Host host;
          host.shuffle = shuffle;
          Parts b(host, mesh, p, stride);
          b.shake(0.01, 1);
          expect_forces(b, false);
        }
}

TEST(MsmParts, InSinglePrecision_OnceItIsPrepared) {
  Host host;
  Parts b(host, kuhn_bar(30, 9, 8, 0.05, 0.2), kFull);
  b.shake(0.01, 1);
  Parts::Taken taken;
  EXPECT_EQ(b.take(true, taken), DFM_E_STATE);
  const auto *f32 = static_cast<const dfm_f32 *>(b.ops->extension(b.self, DFM_EXT_F32));
  ASSERT_EQ(f32->prepare(b.self), DFM_OK);
  expect_forces(b, true);
  expect_forces(b, false);
}

// Numbers of points within a part have 16 bits.
TEST(MsmParts, MoreNeighborsOfAPartThanItCanCount_AreRefusedInASentence) {
  Mesh fan;  // around point 0, which lies at an end of the order
  constexpr uint32_t kRing = 70000;
  fan.rest = {-100, 0, 0};
  for (uint32_t i = 0; i < kRing; ++i) {
    const double angle = 0.01 * i;
    fan.rest.insert(fan.rest.end(), {1e-3 * i, std::cos(angle), std::sin(angle)});
  }
  for (uint32_t i = 1; i + 2 <= kRing; ++i) fan.cells.insert(fan.cells.end(), {0, i, i + 1, i + 2});
  fan.finish();
  Host host;
  const Parts b(host, fan, kFull);
  EXPECT_EQ(b.status, DFM_E_ARG);
  EXPECT_NE(host.logged.find("share an edge with very many others"), std::string::npos) << host.logged;
}

}  // namespace
}  // namespace msm_test
