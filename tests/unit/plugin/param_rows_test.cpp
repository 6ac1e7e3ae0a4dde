// Packed parameters by key, and packed again.
#include <gtest/gtest.h>

#include "plugin/params.h"

namespace {

constexpr dfm_param kRows[] = {
    {"mu", "", "1", 0, 1, 0.5, 0, 1, nullptr},
    {"axis", "", "1", -1, 1, 0, 0, 3, nullptr},
    {"levels", "", "1", 0, 9, 0, DFM_PARAM_LIST, 4, nullptr},
};
constexpr dfm_type kType = {
    sizeof(dfm_type), DFM_KIND_MODEL, "org.example.rows", "", "1", "MIT", "none", kRows, 3, sizeof(dfm_param),
    nullptr,          nullptr};

}  // namespace

TEST(ParamRows, OfPackedValues_PackToTheSame) {
  const double axis[] = {0, 0, 1};
  const double levels[] = {3, 0};
  const dfm_param_value given[] = {{"axis", axis, 3}, {"levels", levels, 2}};
  const std::vector<double> packed = dfm::pack_params(kType, given);
  const std::vector<dfm_param_value> rows = dfm::param_rows(kType, packed);
  ASSERT_EQ(rows.size(), 3u);
  EXPECT_EQ(rows[2].width, 4u);
  EXPECT_EQ(rows[1].value[2], 1);
  EXPECT_EQ(dfm::pack_params(kType, rows), packed);
}
