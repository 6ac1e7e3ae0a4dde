// Where one contact's line of slip and force meets its law: found for bristles of any stiffness, at any step,
// within a bounded number of questions.
#include "bristle_law.h"
#include "friction/laws.h"
#include "plugin/context.h"
#include "plugin/params.h"
#include "plugin/registry.h"

namespace {

// What one contact sees, and the answer in closed form: the bristle with the contact's own compliance is an
// elastic predictor with radial return.
struct Case { double mu, fn, area, wt, z[2], free[2]; };

struct Numbers {
  uint64_t seed = 7;
  double next() {
    seed = seed * 6364136223846793005ull + 1442695040888963407ull;
    return double(seed >> 11) / 9007199254740992.0;
  }
  double size(double low, double high) { return low * std::pow(high / low, next()); }
  double sign() { return 2 * next() - 1; }
};

// Force that the contact carries, by hand: stick if it stays within the cone, else slip along the
// elastic trial.
std::array<double, 2> by_hand(const Case &c, double sigma0, double h) {
  const double k = sigma0 * c.area, most = c.mu * c.fn, m = h * c.wt;
  double z[2] = {c.z[0], c.z[1]};
  const double held = k * std::hypot(z[0], z[1]);
  for (double &x : z)
    if (held > most) x *= most / held;
  const double a = -k * (z[0] + h * c.free[0]) / (1 + h * k * m);
  const double b = -k * (z[1] + h * c.free[1]) / (1 + h * k * m);
  const double size = std::hypot(a, b);
  const double share = size > most ? most / size : 1;
  return {share * a, share * b};
}

}  // namespace

TEST(LocalSolve, AnyStiffnessAndStep_MeetsTheRadialReturn) {
  test::Context context;
  test::ok(dfm_plugin_register_static(context, dfm_plugin_entry_bristle, "bristle"));
  const dfm_host &host = static_cast<dfm_context *>(context)->host;
  const dfm_type &type =
      static_cast<dfm_context *>(context)->registry.find(DFM_KIND_FRICTION, "test.bristle");
  Numbers random;
  constexpr uint32_t n = 203;
  for (const double h : {1e-6, 1e-4, 1e-3, 1.0 / 240, 1.0 / 30})
    for (const double sigma0 : {1e4, 1e6, 1e9, 1e12}) {
      dfm::LawInstance law(type, host, {0.5, sigma0});
      dfm::LawBatches batches(dfm::Memory::standard());
      dfm::ContactState s;
      s.resize(n, 2);
      std::vector<Case> cases(n);
      std::vector<double> wt(n);
      for (uint32_t i = 0; i < n; ++i) {
        Case &c = cases[i];
        c = {0.5, random.size(1e-6, 10), random.size(1e-7, 1e-3), random.size(1, 1e5), {0, 0}, {0, 0}};
        const double far = 2 * c.mu * c.fn / (sigma0 * c.area), fast = random.size(1e-7, 3);
        for (int k = 0; k < 2; ++k) {
          c.z[k] = far * random.sign();
          c.free[k] = fast * random.sign();
        }
        wt[i] = c.wt;
        s.law[i] = 0;
        s.fn[i] = c.fn;
        s.area[i] = c.area;
        s.dwell[i] = 0;
        // The question starts anywhere: at rest, at the slip without friction, or reversed, as the outer
        // passes leave it.
        const double from = i % 3 == 0 ? 0 : i % 3 == 1 ? 1 : -random.size(1e-3, 1e3);
        for (uint32_t k = 0; k < 2; ++k) {
          s.bristle[k * s.stride + i] = c.z[k];
          s.ft_stop[k * s.stride + i] = -c.free[k] / (h * c.wt);
          s.vt[k * s.stride + i] = from * c.free[k];
        }
      }
      const dfm::RowRun contacts{0, n};
      batches.gather({&law}, {&contacts, 1}, s);
      EXPECT_TRUE(batches.has_smooth());
      ASSERT_EQ(batches.evaluate_local(h, wt.data(), 1e-8, 1e-4, s), nullptr);
      for (uint32_t i = 0; i < n; ++i) {
        const auto expected = by_hand(cases[i], sigma0, h);
        const double off = std::hypot(s.ft[i] - expected[0], s.ft[s.stride + i] - expected[1]);
        const double slip =
            std::max(std::hypot(cases[i].free[0], cases[i].free[1]), std::hypot(s.vt[i], s.vt[s.stride + i]));
        EXPECT_LT(h * wt[i] * off, 2e-8 + 2e-4 * slip)
            << "contact " << i << ", h " << h << ", sigma0 " << sigma0;
      }
    }
}

// Laws that ship, with and without the flag that they give derivatives. A factor on friction is part of the
// derivative by the normal force.
TEST(LocalSolve, LawWithoutDerivatives_GetsThemByDifferences) {
  test::Context context;
  const dfm_context &own = *static_cast<dfm_context *>(context);
  constexpr uint32_t n = 203;
  for (const char *name : {"dahl", "lugre", "elastoplastic", "coulomb"}) {
    const dfm_type &type = own.registry.find(DFM_KIND_FRICTION, name);
    dfm_friction ops = dfm::law_of(type);
    ops.flags &= ~uint32_t{DFM_FRIC_JACOBIAN};
    dfm_type without = type;
    without.ops = &ops;
    dfm::ContactState found[2];
    for (dfm::ContactState &s : found) {
      dfm::LawInstance law(&s == found ? type : without, own.host, dfm::pack_params(type, {}));
      dfm::LawBatches batches(dfm::Memory::standard());
      s.resize(n, law.nstate);
      s.scale.assign(n, 0.7);
      Numbers random;
      const std::vector<double> wt(n);  // the laws are evaluated at vt
      for (uint32_t i = 0; i < n; ++i) {
        s.law[i] = 0;
        s.dwell[i] = 0;
        s.fn[i] = random.size(0.1, 10);
        s.area[i] = random.size(1e-5, 1e-4);
        for (uint32_t k = 0; k < 2; ++k) {
          s.vt[k * s.stride + i] = random.size(1e-3, 1) * random.sign();
          s.ft_stop[k * s.stride + i] = 100 * random.sign();
        }
        for (uint32_t k = 0; k < law.nstate; ++k) s.bristle[k * s.stride + i] = 1e-6 * random.sign();
      }
      const dfm::RowRun contacts{0, n};
      const std::vector<double> vt(s.vt.begin(), s.vt.end());
      batches.gather({&law}, {&contacts, 1}, s);
      ASSERT_EQ(batches.evaluate_local(1e-4, wt.data(), 1e-8, 1e-4, s), nullptr) << name;
      EXPECT_TRUE(std::equal(vt.begin(), vt.end(), s.vt.begin())) << name;
    }
    const auto &given = found[0], &by_differences = found[1];
    EXPECT_EQ(given.ft, by_differences.ft) << name;
    EXPECT_EQ(given.bristle_out, by_differences.bristle_out) << name;
    const auto compare = [&](const dfm::Array<double> &a, const dfm::Array<double> &b, uint32_t columns) {
      for (uint32_t i = 0; i < n; ++i) {
        double size = 0;
        for (uint32_t c = 0; c < columns; ++c) size = std::max(size, std::fabs(a[c * given.stride + i]));
        for (uint32_t c = 0; c < columns; ++c)
          EXPECT_NEAR(b[c * given.stride + i], a[c * given.stride + i], 1e-3 * size + 1e-6)
              << name << ", contact " << i << ", column " << c;
      }
    };
    compare(given.dft_dvt, by_differences.dft_dvt, 4);
    compare(given.dft_dfn, by_differences.dft_dfn, 2);
  }
}
