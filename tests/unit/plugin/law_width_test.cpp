// Each law is compiled for the processor that everybody has, for AVX2 and for AVX-512: all give the same bits (the recorded hashes of the plugin tests see
// one of them only).
#include <cstring>
#include <random>

#include "../../../plugins/friction_common/lugre_rows.h"
#include "../../../plugins/friction_common/stribeck.h"
#include "../../plugin/law_rules.h"

#define dfm_plugin_entry coulomb_entry
namespace coulomb_inside {
#include "../../../plugins/friction_coulomb/friction_coulomb.cpp"
}
#undef dfm_plugin_entry
#define dfm_plugin_entry karnopp_entry
namespace karnopp_inside {
#include "../../../plugins/friction_karnopp/friction_karnopp.cpp"
}
#undef dfm_plugin_entry
#define dfm_plugin_entry dahl_entry
namespace dahl_inside {
#include "../../../plugins/friction_dahl/friction_dahl.cpp"
}
#undef dfm_plugin_entry
#define dfm_plugin_entry lugre_entry
namespace lugre_inside {
#include "../../../plugins/friction_lugre/friction_lugre.cpp"
}
#undef dfm_plugin_entry
#define dfm_plugin_entry elastoplastic_entry
namespace elastoplastic_inside {
#include "../../../plugins/friction_elastoplastic/friction_elastoplastic.cpp"
}
#undef dfm_plugin_entry

namespace {

template <class Law>
void all_widths(std::vector<double> params, dfm_friction narrow) {
  if (lanes::widest() == lanes::kNarrow) GTEST_SKIP() << "this processor has no AVX2; there is only one width";
  narrow.eval = lanes::eval_narrow<Law>;
  dfm_friction wide = narrow;
  rules::Law a{&narrow, params, 0, {}, {}, (narrow.flags & DFM_FRIC_SET_VALUED) != 0};
  rules::read_slots(a);
  rules::Law b = a;
  b.ops = &wide;
  for (int width = lanes::kAvx2; width <= lanes::widest(); ++width) {
    wide.eval = width == lanes::kAvx2 ? lanes::eval_avx2<Law> : lanes::eval_avx512<Law>;
    for (double z : {1e-6, 1e-5, 1e-4}) EXPECT_EQ(rules::hash_of_bits(a, z), rules::hash_of_bits(b, z)) << width;
  }
}

TEST(LawWidth, Coulomb_HasOneAnswer) {
  for (double delta : {2.0, 1.0, 0.7}) all_widths<coulomb_inside::Coulomb>({0.3, 0.5, 0.01, delta, 0.4}, coulomb_inside::law);
}

TEST(LawWidth, Karnopp_HasOneAnswer) {
  for (double delta : {2.0, 0.7}) all_widths<karnopp_inside::Karnopp>({0.3, 0.5, 0.01, delta, 0.4, 1e-3}, karnopp_inside::law);
}

TEST(LawWidth, Dahl_HasOneAnswer) {
  for (double alpha : {1.0, 2.5}) all_widths<dahl_inside::Dahl>({0.15, 1e4, alpha}, dahl_inside::law);
}

TEST(LawWidth, Lugre_HasOneAnswer) {
  for (double form : {0.0, 1.0, 2.0})
    for (double delta : {2.0, 0.7}) all_widths<lugre_inside::Lugre>({0.15, 0.20, 0.01, delta, 1e4, 20, form, 0.01, 0.4}, lugre_inside::law);
}

TEST(LawWidth, Elastoplastic_HasOneAnswer) {
  for (double i : {1.0, 3.0})
    for (double multiplier : {0.0, 1.0})
      all_widths<elastoplastic_inside::Elastoplastic>({0.15, 0.20, 0.01, 1.3, 1e4, 20, 0, 0.01, 0.4, 0.7, i, multiplier}, elastoplastic_inside::law);
}

}  // namespace
