// Any model with any coupling, partner, law and integrator: rows that hold every pair of levels at least
// once. `make soak` runs the whole product (doc/reference/combinations.md).
#include "cover.h"

#include "cover_known.h"

namespace {

using namespace test::cover;

class Cover : public testing::TestWithParam<Row> {};

}  // namespace

TEST(CoverRows, EveryPairOfLevels_IsInOne) {
  Pairs pairs;
  for (const Row &row : pairwise()) pairs.take(row);
  Row row;
  EXPECT_FALSE(pairs.first(row));
}

// soak(l*thesis_self*:s*mls_self*:*soft_condensed*implicit*:msm_mls_soft_s*:me*mls_soft_c*:me*bary*): long
TEST_P(Cover, Row_Holds) {
  const Row row = GetParam();
  const Seen seen = run(row);
  EXPECT_FALSE(seen.refused) << columns(row) << ": " << seen.reason;
  std::printf("%-62s %5.2f s, momentum %.1e, cone %.1e, creep %.1e m/s, slide %.1e\n", columns(row).c_str(),
              seen.cpu, seen.momentum, seen.cone, seen.creep, seen.slide);
  const std::string known = known_failure(row);
  if (known.empty())
    for (const std::string &sentence : seen.wrong) ADD_FAILURE() << columns(row) << ": " << sentence;
  else EXPECT_FALSE(seen.wrong.empty()) << columns(row) << " holds now, take it out of cover_known.h";
}

// Combinations that are refused, each in one sentence that names the model; the page has the table.
TEST(CoverRefused, BeyondTheProduct_NamesTheModelAndTheAlternative) {
  const auto refused = [](dfm_status s, std::initializer_list<const char *> parts) {
    EXPECT_EQ(s, DFM_E_UNSUPPORTED);
    test::says(parts);
  };
  for (const std::string &model : levels()[kModel]) {
    const bool steps_itself = model == "modal" || model == "condensed" || model == "shape_matching";
    test::Context context;
    const dfm_world w = test::make_world(context);
    test::BodyOptions o;
    o.name = "body";
    o.model = model;
    const dfm_body body = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    const uint32_t point = 0;
    dfm_spring_def spring{};
    spring.size = sizeof spring;
    spring.npoint = 1;
    spring.points = &point;
    spring.stiffness = 1;
    if (!steps_itself) {
      test::ok(dfm_body_add_spring(body, &spring, nullptr));
      test::ok(dfm_body_hold(body, 1, &point, 7));
      continue;
    }
    refused(dfm_body_add_spring(body, &spring, nullptr),
            {"'body'", model.c_str(), "step bound", "choose another model"});
    refused(dfm_body_hold(body, 1, &point, 7), {"'body'", model.c_str(), "dfm_body_def.fixed"});
    refused(dfm_world_equilibrium(w, nullptr, nullptr), {"'body'", model.c_str(), "choose another model"});
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Cover, testing::ValuesIn(pairwise()),
                         [](const auto &p) { return name(p.param); });
