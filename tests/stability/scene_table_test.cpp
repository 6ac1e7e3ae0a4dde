// Every shipped scene: its least contact count, ten jittered runs (of most, three in `make test`), and a
// mutation (contact off) that the judgment of its runs must not survive. What else a scene is for, and the
// mutations of that (friction off, moduli swapped), stand in its own test beside this one.
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include "scenes.h"

namespace {

// Contacts at once that a run has at least, jittered ones included; 0: nothing touches. begins: s, by then
// there are so many. needs_ode: its rigid bodies are ODE's.
struct Row {
  const char *scene;
  double least_contacts, begins;
  bool needs_ode = false;
};
void PrintTo(const Row &row, std::ostream *out) { *out << row.scene; }
constexpr Row kRows[] = {
    {"attached", 0, 0},
    {"ball_incline", 3, 0.3},
    {"basin", 8, 0.8},
    {"bending_cells", 0, 0},
    {"cheese", 20, 0.6},
    {"changing_models", 12, 0.2},
    {"fill_drop", 30, 0.4},
    {"fill_drop_organs", 20, 0.2},
    {"gravity_anisotropy", 0, 0},
    {"gravity_beams", 0, 0},
    {"grasp", 6, 0.75},
    {"guard_shot", 20, 0.02},
    {"lattice_drop", 8, 0.3},
    {"liver", 20, 0.75},
    {"orange", 20, 0.5},
    {"pinched_tube", 8, 0.45},
    {"ode_bed", 30, 0.4, true},
    {"ode_cart", 60, 0.3, true},
    {"ode_chain", 30, 0.2, true},
    {"ode_gripper", 20, 0.5, true},
    {"ode_seesaw", 40, 0.6, true},
    {"pressed_ring", 20, 0.2},
    {"rabbits_slope", 5, 0.6},
    {"probe_block", 2, 0.2},
    {"reduced_models", 30, 0.2},
    {"rigid_on_ball", 10, 0.4},
    {"rigid_on_bed", 5, 0.3},
    {"rigid_pinch", 20, 0.6},
    {"rollback_compare", 15, 0.2},
    {"slope_block", 10, 0.2},
    {"smooth_rolling", 4, 0.1},
    {"surface_organ", 0, 0},
    {"ten_bodies", 60, 0.9},
    {"terrain", 12, 0.6},
    {"torn_dough", 0, 0},
    {"two_cylinders", 12, 0.5},
    {"two_cylinders_coarse", 20, 0.4},
    {"two_cylinders_fine", 40, 0.3},
    {"two_materials", 0, 0},
    {"viscoelastic_bars", 0, 0},
};

const Row &row_of(const std::string &scene) {
  for (const Row &row : kRows)
    if (scene == row.scene) return row;
  static const Row none{"", -1, 0};
  return none;
}

// What every run of a contact scene is held to, here and by expect_jittered.
bool is_valid(const test::SceneRun &run, double least_contacts) {
  return run.finite() && run.number("intersections_max") == 0 && run.contacts_max() >= least_contacts;
}

std::vector<std::string> until(double time) {
  return {"--time", std::to_string(time), "--set", "/output/every=0.02"};
}

bool on_top(const test::SceneRun &run) { return run.last("upper").com[2] > 0.85; }

}  // namespace

TEST(SceneTable, EveryShippedScene_HasItsRow) {
  std::set<std::string> shipped, rows;
  for (const auto &file :
       std::filesystem::directory_iterator(std::string(DEFORM_SOURCE_DIR) + "/examples/scenes"))
    if (file.path().extension() == ".json") shipped.insert(file.path().stem().string());
  for (const Row &row : kRows) rows.insert(row.scene);
  EXPECT_EQ(shipped, rows);
}

// Seeds 1 to 10 of every contact scene are asked for somewhere in this folder, with a least count that is not
// below the table's.
TEST(SceneTable, EveryContactScene_IsRunTenTimesWithJitter) {
  std::map<std::string, std::set<int>> seeds;
  const std::regex call(R"re(expect_jittered\("(\w+)", (\d+), (\d+),[^;]*?,\s+(\d+|row_of\())re");
  for (const auto &file :
       std::filesystem::directory_iterator(std::string(DEFORM_SOURCE_DIR) + "/tests/stability")) {
    std::ifstream in(file.path());
    std::stringstream text;
    text << in.rdbuf();
    const std::string source = text.str();
    for (std::sregex_iterator it(source.begin(), source.end(), call), end; it != end; ++it) {
      const std::string scene = (*it)[1], least = (*it)[4];
      for (int seed = std::stoi((*it)[2]); seed <= std::stoi((*it)[3]); ++seed) seeds[scene].insert(seed);
      if (std::isdigit(least[0])) {
        EXPECT_GE(std::stod(least), row_of(scene).least_contacts) << scene;
      }
    }
  }
  for (const Row &row : kRows)
    if (row.least_contacts > 0) {
      EXPECT_EQ(seeds[row.scene], (std::set<int>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10})) << row.scene;
    }
}

class ContactScene : public testing::TestWithParam<Row> {};

// The same short run with and without contact: the first is sound, the second must not be.
// soak(basin:fill_drop*:liver:orange): long; the other scenes are judged alike
TEST_P(ContactScene, WithoutContact_MissesItsCriteria) {
  const Row &row = GetParam();
  if (row.needs_ode && !test::kHasOde) GTEST_SKIP() << "built without libdeform_ode";
  std::vector<std::string> arguments = until(row.begins);
  const test::SceneRun with(row.scene, arguments);
  EXPECT_TRUE(is_valid(with, row.least_contacts))
      << with.contacts_max() << " contacts, " << with.number("intersections_max") << " crossings";
  arguments.insert(arguments.end(),
                   {"--set", R"(/contact/filter=[{"between": ["*", "*"], "collide": false}])"});
  const test::SceneRun without(row.scene, arguments);
  EXPECT_FALSE(is_valid(without, row.least_contacts));
  // the faces of a cut touch each other whatever a filter says
  EXPECT_LT(without.contacts_max(), row.least_contacts);
}

std::vector<Row> contact_rows() {
  std::vector<Row> rows;
  for (const Row &row : kRows)
    if (row.least_contacts > 0) rows.push_back(row);
  return rows;
}
INSTANTIATE_TEST_SUITE_P(Shipped, ContactScene, testing::ValuesIn(contact_rows()),
                         [](const auto &i) { return std::string(i.param.scene); });

// The task of the guard: whole flights.
TEST(GuardShot, JitteredRuns_DoNotCross) {
  test::expect_jittered("guard_shot", 1, 10, {}, row_of("guard_shot").least_contacts,
                        [](const test::SceneRun &run) { return run.number("guard_steps") > 0; });
}
// A probe that slides with friction drags the block along, on the mean over its swings.
TEST(ProbeBlock, JitteredRuns_AreDraggedByTheProbe) {
  const auto dragged = [](const test::SceneRun &run) {
    double sum = 0, n = 0;
    const std::vector<test::BodyRow> rows = run.rows("block");
    for (const test::BodyRow &row : rows)
      if (row.t > 0.3) {
        sum += row.com[0];
        ++n;
      }
    return sum / n - rows[0].com[0] > 3e-4;
  };
  test::expect_jittered("probe_block", 1, 10, {}, row_of("probe_block").least_contacts, dragged);
  EXPECT_FALSE(dragged(test::SceneRun("probe_block", {"--set", test::kFrictionless})));
}
// soak: long, and a jittered run of what another test runs
TEST(RabbitsSlope, JitteredRuns_DoNotCross) {
  test::expect_jittered("rabbits_slope", 1, 10, {}, row_of("rabbits_slope").least_contacts,
                        [](const test::SceneRun &run) { return run.number("guard_steps") > 0; });
}

// The pairs of the speed figures, over their landing.
TEST(TwoCylinders, CoarsePairJitteredRuns_DoNotCross) {
  test::expect_jittered("two_cylinders_coarse", 1, 10, until(0.4),
                        row_of("two_cylinders_coarse").least_contacts, on_top);
}
// soak: long, and a jittered run of what another test runs
TEST(TwoCylinders, FinePairJitteredRuns_DoNotCross) {
  test::expect_jittered("two_cylinders_fine", 1, 10, until(0.3), row_of("two_cylinders_fine").least_contacts,
                        on_top);
}
