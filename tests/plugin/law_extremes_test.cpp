// Every law of the shelf at every scale of its inputs: answers are finite, within their limit, and the same
// bits at the narrowest and the widest vectors.
#include <random>

#include "tiny_support.h"

namespace {

constexpr uint32_t kContacts = 64, kBatches = 400;

struct Shelf {
  tiny::Context context;
  const dfm_friction *ops = nullptr;
  std::vector<double> params;
  uint32_t nstate = 0;

  Shelf(const std::string &name, const char *simd) {
    const dfm_law law = tiny::open_at_width(context, name, simd);
    const dfm_type *type = nullptr;
    EXPECT_EQ(dfm_law_type(law, &type), DFM_OK) << dfm_last_error();
    ops = static_cast<const dfm_friction *>(type->ops);
    for (uint32_t i = 0; i < type->nparam; ++i)
      params.insert(params.end(), type->params[i].width, type->params[i].def);
    for (uint32_t s = 0; s < ops->nslot; ++s) nstate += ops->slots[s].width;
  }
};

struct Draw {
  std::mt19937_64 random{18};
  double one() { return double(random() >> 11) * 0x1p-53; }
  // Zero one time in eight, else some power of ten, of either sign where signs count.
  double scale(int low, int high, bool sign) {
    if (random() % 8 == 0) return 0;
    const double size = std::pow(10.0, low + (high - low) * one());
    return sign && random() % 2 ? -size : size;
  }
  void fill(tiny::Batch &b) {
    b.in.dt = std::pow(10.0, -12 + 13 * one());
    for (uint32_t i = 0; i < b.n; ++i) {
      b.fn[i] = scale(-320, 100, false);
      b.area[i] = scale(-40, 10, false);
      b.dwell[i] = scale(-12, 9, false);
      for (uint32_t k = 0; k < 2; ++k) {
        b.vt[k * b.stride + i] = scale(-320, 80, true);
        b.stop[k * b.stride + i] = scale(-320, 100, true);
      }
      for (uint32_t k = 0; k < b.nstate; ++k) b.state[k * b.stride + i] = scale(-320, 60, true);
    }
  }
};

class LawExtremes : public testing::TestWithParam<const char *> {};

}  // namespace

TEST_P(LawExtremes, InputsOfEveryScale_ResultsAreFiniteAndWithinTheirLimit) {
  const Shelf narrow(GetParam(), "sse2"), wide(GetParam(), "avx512");
  Draw draw;
  for (uint32_t round = 0; round < kBatches; ++round) {
    tiny::Batch a(kContacts, narrow.params, narrow.nstate), b(kContacts, wide.params, wide.nstate);
    Draw again = draw;
    draw.fill(a);
    again.fill(b);
    ASSERT_EQ(narrow.ops->eval(&a.in, &a.out), DFM_OK);
    ASSERT_EQ(wide.ops->eval(&b.in, &b.out), DFM_OK);
    for (uint32_t i = 0; i < kContacts; ++i) {
      const auto said = [&] {
        return testing::Message() << "round " << round << " contact " << i << ": h " << a.in.dt << " fn "
                                  << a.fn[i] << " v " << a.vt[i] << ' ' << a.vt[a.stride + i] << " area "
                                  << a.area[i];
      };
      double nan_flag = 0;
      for (uint32_t k = 0; k < 2; ++k)
        nan_flag += 0.0 * a.ft[k * a.stride + i] + 0.0 * a.dn[k * a.stride + i];
      for (uint32_t k = 0; k < 4; ++k) nan_flag += 0.0 * a.dv[k * a.stride + i];
      for (uint32_t k = 0; k < a.nstate; ++k) nan_flag += 0.0 * a.state_out[k * a.stride + i];
      ASSERT_EQ(nan_flag, 0) << said();
      ASSERT_GE(a.limit[i], 0) << said();
      ASSERT_LE(std::hypot(a.ft[i], a.ft[a.stride + i]), a.limit[i] * (1 + 1e-9) + 1e-300) << said();
      for (uint32_t k = 0; k < 2; ++k) ASSERT_EQ(a.ft[k * a.stride + i], b.ft[k * b.stride + i]) << said();
      for (uint32_t k = 0; k < a.nstate; ++k)
        ASSERT_EQ(a.state_out[k * a.stride + i], b.state_out[k * b.stride + i]) << said();
      ASSERT_EQ(a.limit[i], b.limit[i]) << said();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, LawExtremes,
                         testing::Values("friction_none", "friction_coulomb", "friction_karnopp",
                                         "friction_dahl", "friction_lugre", "friction_elastoplastic",
                                         "friction_gms"),
                         [](const auto &p) { return std::string(p.param).substr(9); });
