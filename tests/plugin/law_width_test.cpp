// Each law is compiled for the processor that everybody has, for AVX2 and for AVX-512: the files that are
// shipped give the same bits at all three (the recorded hashes of the other tests see one of them only).
#include "../../plugins/friction_common/lanes.h"
#include "law_rules.h"

namespace {

const char *const kWidths[] = {"sse2", "avx2", "avx512"};

TEST(LawWidth, Environment_ChoosesTheWidth) {
  const lanes::Width widths[] = {lanes::kNarrow, lanes::kAvx2, lanes::kAvx512};
  for (int i = 0; i < 3; ++i) {
    setenv("DEFORM_SIMD", kWidths[i], 1);
    EXPECT_EQ(lanes::chosen(), std::min(widths[i], lanes::widest())) << kWidths[i];
    unsetenv("DEFORM_SIMD");
  }
}

#if defined(__x86_64__)  // other processors have one width
void all_widths(const std::string &file, const std::vector<double> &params) {
  if (lanes::widest() == lanes::kNarrow)
    GTEST_SKIP() << "this processor has no AVX2; there is only one width";
  const tiny::Context contexts[3];  // one file of a law in each
  std::vector<rules::Law> laws;
  for (size_t i = 0; i < 3; ++i)
    laws.push_back(rules::law_of(tiny::open_at_width(contexts[i], file, kWidths[i]), params));
  for (const double z : {1e-6, 1e-5, 1e-4}) {
    const uint64_t narrow = rules::hash_of_bits(laws[0], z);
    for (size_t i = 1; i < laws.size(); ++i)
      EXPECT_EQ(rules::hash_of_bits(laws[i], z), narrow) << file << " " << kWidths[i] << " z " << z;
  }
}

// n elements of unequal stiffness and share; the law's table has room for sixteen of each, the unused are 0.
std::vector<double> elements(size_t n, double delta) {
  std::vector<double> p{0.15, 0.20, 0.01, delta, 0.4, 60};
  p.resize(6 + 32, 0.0);
  const double parts = 0.5 * double(n) * double(n + 1);
  for (size_t e = 0; e < n; ++e) {
    p[6 + e] = 1e4 * double(n - e) / parts;
    p[22 + e] = double(e + 1) / parts;
  }
  return p;
}

TEST(LawWidth, Coulomb_GivesOneResult) {
  for (const double delta : {2.0, 1.0, 0.7}) all_widths("friction_coulomb", {0.3, 0.5, 0.01, delta, 0.4});
}

TEST(LawWidth, Karnopp_GivesOneResult) {
  for (const double delta : {2.0, 0.7}) all_widths("friction_karnopp", {0.3, 0.5, 0.01, delta, 0.4, 1e-3});
}

TEST(LawWidth, Dahl_GivesOneResult) {
  for (const double alpha : {1.0, 2.5}) all_widths("friction_dahl", {0.15, 1e4, alpha});
}

TEST(LawWidth, Lugre_GivesOneResult) {
  for (const double form : {0.0, 1.0, 2.0})
    for (const double delta : {2.0, 0.7})
      all_widths("friction_lugre", {0.15, 0.20, 0.01, delta, 1e4, 20, form, 0.01, 0.4});
}

TEST(LawWidth, Elastoplastic_GivesOneResult) {
  for (const double i : {1.0, 3.0})
    for (const double multiplier : {0.0, 1.0})
      all_widths("friction_elastoplastic",
                 {0.15, 0.20, 0.01, 1.3, 1e4, 20, 0, 0.01, 0.4, 0.7, i, multiplier});
}

TEST(LawWidth, Gms_GivesOneResultWithAnyNumberOfElements) {
  for (const double delta : {2.0, 0.7})
    for (const size_t n : {1, 2, 4, 7, 16}) all_widths("friction_gms", elements(n, delta));
}
#endif

}  // namespace
