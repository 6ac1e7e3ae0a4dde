// Where one contact's line of slip and force meets its law: found for bristles of any stiffness, at any step,
// within a bounded number of questions.
#include "bristle_law.h"
#include "friction/laws.h"
#include "plugin/context.h"

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
