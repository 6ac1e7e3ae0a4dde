// Scenes with an accuracy or a budget: what the planner chooses is in the scene, in explain and in the
// summary, and what cannot be planned is one sentence.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "deform/deform.h"
#include "json_text.h"
#include "logged_context.h"
#include "support.h"

namespace {

// Tests run side by side: a folder for each.
std::string folder() {
  return test::scratch(std::string("planner_") +
                       testing::UnitTest::GetInstance()->current_test_info()->name());
}

// A bar that is held at one end; `wish` and `model` are members with their commas.
std::string bar(const std::string &wish, const std::string &model = "", const std::string &time = "") {
  const std::string path = folder() + "/bar.json";
  test::write_file(path, R"({"format": "deform-scene", "version": 1, )" + wish + R"(
 "time": {"duration": 0.1)" + time +
                             R"(},
 "materials": {"gel": {"young": 5e6, "damping": {"stiffness": 2e-4}}},
 "bodies": [{"name": "bar", )" +
                             model + R"("material": "gel",
   "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 300},
   "fix": [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]}]})");
  return path;
}

// Costs of one model without those of hexahedra.
std::string old_costs() {
  const std::string path = folder() + "/old.json";
  const std::string sizes = R"([{"points": 100, "ns_per_point": 200}])";
  test::write_file(path, R"({"format": "deform-costs", "version": 4, "machine": "old", "models": [
  {"model": "corotational_fem", "steps_itself": false, "wave_steps": 1.2, "errors": {"bends_little": 0,
   "bends_far": 0, "turns": 0, "lies": 0, "dents": 0, "dent_force": 0}, "costs": {"symplectic_euler": {
   "free": )" + sizes + R"(, "touching": )" +
                             sizes + R"(, "pressed": )" + sizes + R"(, "stacked": )" + sizes + "}}}]}");
  return path;
}

bool has(const std::string &text, const std::string &word) { return text.find(word) != std::string::npos; }

void expect_refused(const std::string &scene, const std::vector<std::string> &words) {
  test::expect_refused({"explain", scene}, words);
}

// From the load on, what the planner assumes of a body in a scene with these settings.
std::string assumed_of(const std::string &scene, const std::vector<std::string> &settings) {
  std::vector<std::string> args = {"explain", scene};
  for (const std::string &s : settings) args.insert(args.end(), {"--set", s});
  const test::CommandResult r = test::deform(args);
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const size_t at = r.out.find("; load ");
  return at == std::string::npos ? r.out : r.out.substr(at, r.out.find('\n', at) - at);
}

// Costs measured on the machine of the tests must not decide their results.
class PlannerScene : public testing::Test {
 protected:
  void SetUp() override { setenv("XDG_CONFIG_HOME", folder().c_str(), 1); }
};

}  // namespace

TEST_F(PlannerScene, Accuracy_ChoosesAndSaysWhy) {
  const test::CommandResult r = test::deform({"explain", bar(R"("accuracy": {"target": 0.4},)")});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  for (const char *word : {"planner (predicted, not measured",
                           "by costs of: ", "assumed: body 'bar': ", "chosen: ", "error of the model ",
                           "--set /bodies/0/model/type=", "--set /time/integrator="})
    EXPECT_TRUE(has(r.out, word)) << "no '" << word << "' in: " << r.out;
  const test::CommandResult run =
      test::deform({"run", bar(R"("accuracy": {"target": 0.4},)"), "--out", folder() + "/out", "--quiet"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(test::read_file(folder() + "/out/summary.json"), "\"planner\""));
}

// What the planner says of a bar's lowest mode on its mesh is what the model that computes it says.
TEST_F(PlannerScene, LowestMode_IsThatOfTheModel) {
  const test::CommandResult r =
      test::deform({"explain", bar(R"("accuracy": {"target": 0.4},)", R"("lattice": null, )")});
  const auto number_after = [&](const char *word) {
    const size_t at = r.out.find(word);
    return at == std::string::npos ? 0.0 : std::strtod(r.out.c_str() + at + std::strlen(word), nullptr);
  };
  const double model = number_after("lowest: "), mesh = number_after(" Hz (");
  ASSERT_GT(model, 0) << r.out;
  EXPECT_NEAR(mesh, model, 0.1 * model) << "of the bar itself: " << number_after("lowest mode at ");
}

// The lines that explain prints make the same scene without a planner: the same bits.
TEST_F(PlannerScene, ChoiceWrittenIntoTheScene_IsTheSameRun) {
  const std::string wish = R"("accuracy": {"target": 0.05},)";
  const test::CommandResult planned = test::deform({"explain", bar(wish)});
  std::vector<std::string> fixed = {"run", bar(""), "--out", folder() + "/b", "--quiet"};
  for (size_t at = 0; (at = planned.out.find("--set ", at)) != std::string::npos; ++at) {
    const size_t end = planned.out.find('\n', at);
    fixed.push_back("--set");
    fixed.push_back(planned.out.substr(at + 6, end - at - 6));
  }
  ASSERT_GT(fixed.size(), 5u);
  ASSERT_EQ(test::deform(fixed).exit_code, 0);
  ASSERT_EQ(test::deform({"run", bar(wish), "--out", folder() + "/a", "--quiet"}).exit_code, 0);
  const auto hash = [](const std::string &run) {
    const std::string text = test::read_file(folder() + "/" + run + "/summary.json");
    return text.substr(text.find("state_hash"), sizeof "state_hash\": \"0123456789abcdef" - 1);
  };
  EXPECT_EQ(hash("a"), hash("b"));
}

// Few hexahedra bend as they should where as many tetrahedra do not. What the choice claims is compared with
// 250 bricks: held bars that rest, and one that swings.
// soak: the references are slow
TEST_F(PlannerScene, HeldBar_TakesALatticeThatErrsAsItSays) {
  for (const char *const damping : {"20", "1"}) {
    for (const char *const size : {"[0.4, 0.1, 0.1]", "[0.6, 0.1, 0.1]", "[0.5, 0.1, 0.08]"}) {
      SCOPED_TRACE(std::string(size) + damping);
      const std::string out = folder() + "/" + size[3] + damping, path = out + ".json";
      const auto scene = [&](const std::string &wish, const std::string &mesh) {
        test::write_file(path, R"({"format": "deform-scene", "version": 1, )" + wish +
                                   R"("time": {"duration": 0.5, "integrator": "symplectic_euler"},
 "materials": {"gel": {"young": 1e7, "damping": {"mass": )" +
                                   damping +
                                   R"(}}}, "output": {"every": 0.005}, "gravity": [0, 0, -9.81],
 "bodies": [{"name": "bar", "material": "gel", "model": {"type": "corotational_fem"}, )" +
                                   mesh + R"(, "fix": [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]}],
 "probes": [{"name": "tip", "body": "bar", "point": [0.4, 0.02, 0.02]}]})");
        return path;
      };
      const auto tips = [&](const std::string &run) {
        std::vector<std::array<double, 4>> rows;
        for (const auto &row : test::read_csv(run + "/probes.csv"))
          if (row[0] != "t")
            rows.push_back({std::stod(row[0]), std::stod(row[2]), std::stod(row[3]), std::stod(row[4])});
        return rows;
      };
      const std::string shape = std::string(R"("size": )") + size;
      ASSERT_EQ(
          test::deform({"run", scene("", R"("mesh": {"make": "bricks", )" + shape + R"(, "cells": 250})"),
                        "--out", out + "truth", "--quiet"})
              .exit_code,
          0);
      ASSERT_EQ(test::deform({"run",
                              scene(R"("accuracy": {"target": 0.1, "quantity": "tip"}, )",
                                    R"("mesh": {"make": "beam", )" + shape + R"(, "cells": 400})"),
                              "--out", out, "--quiet"})
                    .exit_code,
                0);
      cli::JsonValue summary;
      ASSERT_TRUE(cli::parse_json(test::read_file(out + "/summary.json"), summary));
      const cli::JsonValue &plan = *summary.find("planner");
      EXPECT_NE(plan.find("set")->find("/bodies/0/lattice/size"), nullptr) << cli::json_text(plan);
      const std::vector<std::array<double, 4>> truth = tips(out + "truth"), found = tips(out);
      double off = 0, all = 0;
      for (const auto &tip : found) {
        size_t i = 1;
        while (i + 1 < truth.size() && truth[i][0] < tip[0]) ++i;
        const double part = (tip[0] - truth[i - 1][0]) / (truth[i][0] - truth[i - 1][0]);
        for (size_t k = 1; k < 4; ++k) {
          const double there = truth[i - 1][k] + part * (truth[i][k] - truth[i - 1][k]);
          off += std::pow(tip[k] - there, 2);
          all += std::pow(there - truth[0][k], 2);
        }
      }
      const double error = std::sqrt(off / all), claimed = plan.find("predicted")->scalar("error");
      EXPECT_LT(error, 0.1);
      EXPECT_LT(claimed, 2 * error);
      EXPECT_GT(claimed, 0.5 * error);
    }
  }
}

TEST_F(PlannerScene, HeldBar_SaysWhatALatticeTakesThePlaceOf) {
  const std::string scene = bar(R"("accuracy": {"target": 0.05},)");
  const test::CommandResult r = test::deform({"explain", scene});
  for (const char *word :
       {"hexahedra (\"lattice\": {\"size\": ", "take the place of its cells: the error is ",
        "\"lattice\": null keeps them", "--set /bodies/0/lattice/size="})
    EXPECT_TRUE(has(r.out, word)) << "no '" << word << "' in: " << r.out;
  const test::CommandResult filled =
      test::deform({"explain", bar(R"("accuracy": {"target": 0.05},)", R"("fill": {"cells": 800}, )")});
  for (const char *word : {"--set /bodies/0/fill=null", "--set /bodies/0/lattice/size="})
    EXPECT_TRUE(has(filled.out, word)) << "no '" << word << "' in: " << filled.out << filled.err;
  setenv("DEFORM_COSTS", old_costs().c_str(), 1);
  const test::CommandResult old = test::deform({"explain", bar(R"("accuracy": {"target": 0.05},)")});
  unsetenv("DEFORM_COSTS");
  EXPECT_EQ(old.exit_code, 0) << old.err;
  EXPECT_TRUE(has(old.out, "no lattice is proposed where the costs of its hexahedra are not measured"))
      << old.out;
  EXPECT_FALSE(has(old.out, "lattice/size")) << old.out;
}

// What is about the body's own cells, or needs them, keeps them.
TEST_F(PlannerScene, BodyThatNeedsItsCells_KeepsThem) {
  const std::string wish = R"("accuracy": {"target": 0.05},)",
                    corotational = R"("model": {"type": "corotational_fem"}, )";
  std::string values = "young\n";
  for (int i = 0; i < 336; ++i) values += "5e6\n";
  test::write_file(folder() + "/young.csv", values);
  ASSERT_TRUE(has(test::deform({"explain", bar(wish, corotational)}).out, "lattice/size="));
  for (const std::string &keys :
       {std::string(R"("lattice": null, )"), std::string(R"("model": {"type": "msm"}, )"),
        corotational + R"("cut_delay": 0.1, )", std::string(R"("surface": {"from": "boundary"}, )"),
        corotational + R"("fields": {"young": "young.csv"}, )"}) {
    const test::CommandResult r = test::deform({"explain", bar(wish, keys)});
    EXPECT_EQ(r.exit_code, 0) << keys << r.err;
    EXPECT_FALSE(has(r.out, "lattice/size=")) << keys << r.out;
  }
  // by a fourth of a coarse cell, by parts of its file, where a sphere dents it, and free
  for (const std::string &set :
       {std::string(R"(/bodies/0/fix=[{"box": [[-1, -1, -1], [0.03, 1, 1]]}])"),
        std::string(R"(/bodies/0/fix=[{"points": [0, 1, 2, 3]}])"),
        std::string(
            R"(/cuts=[{"body": "bar", "t": 0.05, "shape": "plane", "point": [0.2, 0, 0],
             "normal": [1, 0, 0]}])"),
        std::string(
            R"(/obstacles=[{"name": "probe", "shape": "sphere", "radius": 0.02, "motion": {"keyframes": [
          {"t": 0, "position": [0.3, 0.05, 0.121]}, {"t": 0.1, "position": [0.3, 0.05, 0.115]}]}}])"),
        std::string("/bodies/0/fix=[]")}) {
    const test::CommandResult r = test::deform({"explain", bar(wish, corotational), "--set", set});
    EXPECT_EQ(r.exit_code, 0) << set << r.err;
    EXPECT_FALSE(has(r.out, "lattice/size=")) << set << r.out;
  }
  // by a part of the second brick: what holds there may not hold more of the body under a lattice
  const auto lattice = [&](const std::string &how) {
    const std::string out =
        test::deform({"explain", bar(wish, corotational), "--set", "/bodies/0/mesh/cells=1500", "--set",
                      R"(/obstacles=[{"name": "wall", "shape": "box", "half_size": [0.1, 0.1, 0.1],
                          "pose": {"position": [-0.1, 0.05, 0.05]}}])",
                      "--set", "/bodies/0/fix=[]", "--set", how})
            .out;
    const size_t at = out.find("lattice/size=");
    return at == std::string::npos ? "" : out.substr(at, out.find('\n', at) - at);
  };
  const std::string to = R"("box": [[-1, -1, -1], [0.03, 1, 1]]}])",
                    fixed = lattice(R"(/bodies/0/fix=[{)" + to);
  EXPECT_NE(fixed, "");
  EXPECT_EQ(lattice(R"(/bodies/0/attach=[{"to": "wall", )" + to), fixed);
  for (const char *const shape : {"cylinder", "tube"}) {  // large cells would fill a hole or join its sides
    const test::CommandResult r = test::deform(
        {"explain", bar(wish, corotational), "--set",
         std::string(R"(/bodies/0/mesh={"make": ")") + shape + R"(", "radius": 0.05, "length": 0.4)" +
             (shape == std::string("tube") ? R"(, "inner": 0.02})" : "}"),
         "--set", R"(/bodies/0/fix=[{"box": [[-1, -1, -1], [1, 1, 1e-6]]}])"});
    EXPECT_EQ(r.exit_code, 0) << shape << r.err;
    EXPECT_EQ(has(r.out, "lattice/size="), shape == std::string("cylinder")) << r.out;
  }
  const test::CommandResult groups = test::deform(
      {"explain", DEFORM_SOURCE_DIR "/examples/scenes/two_materials.json", "--set",
       R"(/accuracy={"target": 0.05})", "--set", R"(/bodies/2/model={"type": "corotational_fem"})"});
  EXPECT_EQ(groups.exit_code, 0) << groups.err;
  EXPECT_FALSE(has(groups.out, "lattice/size=")) << groups.out;
}

// A block under a small probe, in 1 ms: modes answer a dent with twice the force, and are not taken.
TEST_F(PlannerScene, BlockUnderAProbe_TakesAModelThatDents) {
  const test::CommandResult r =
      test::deform({"explain", DEFORM_SOURCE_DIR "/examples/scenes/probe_block.json", "--set",
                    R"(/bodies/0/model={"type": "auto"})", "--set", R"(/budget={"ms_per_step": 1})"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "--set /bodies/0/model/type=")) << r.out;
  for (const char *wrong : {"modal", "shape_matching"})
    EXPECT_FALSE(has(r.out, std::string("--set /bodies/0/model/type=") + wrong)) << r.out;
  EXPECT_TRUE(has(r.out, "'probe' touches it over about 0.054 m")) << r.out;
}

TEST_F(PlannerScene, BudgetThatCannotBeMet_IsReportedByTheRun) {
  const test::CommandResult r =
      test::deform({"run", bar(R"("budget": {"ms_per_step": 1e-6},)"), "--out", folder() + "/out"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  for (const char *word : {"planner: the budget of 1e-06 ms per 1/60 s is not met", "a larger budget",
                           "the nearest choice is simulated", "deform cost"})
    EXPECT_TRUE(has(r.err, word)) << "no '" << word << "' in: " << r.err;
  EXPECT_EQ(r.out.find("planner, nearest: "), 0u) << "what is simulated: " << r.out;
  EXPECT_TRUE(has(r.out, " ms per step\nbody ")) << r.out;
}

// A mesh of few cells across cannot bend to within 2 %: that is told with the figures of the choice.
TEST_F(PlannerScene, TargetThatCannotBeMet_IsReportedByRunAndExplain) {
  const std::string scene = bar(R"("accuracy": {"target": 0.02},)", R"("lattice": null, )");
  const test::CommandResult r = test::deform({"run", scene, "--out", folder() + "/out"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  const test::CommandResult reported = test::deform({"explain", scene});
  for (const std::string *text : {&r.err, &reported.out})
    for (const char *word : {"the target of 2 % is not met: body 'bar' has a predicted error of", "mesh ",
                             " times as many cells", "deform cost"})
      EXPECT_TRUE(has(*text, word)) << "no '" << word << "' in: " << *text;
  EXPECT_TRUE(has(reported.out, "  nearest: ")) << reported.out;
  EXPECT_FALSE(has(reported.out, "  chosen: ")) << reported.out;
}

// Dampers with a lag are what bounds the sub-steps of the world, and what the planner takes for them.
TEST_F(PlannerScene, ExplicitStepsOfADampedBody_AreThoseThatTheWorldTakes) {
  const std::string path =
      bar(R"("accuracy": {"target": 0.4},)", R"("model": {"type": "corotational_fem"}, "lattice": null, )",
          R"(, "integrator": "symplectic_euler")");
  for (const char *damping : {"2e-5", "2e-4", "2e-3", "2e-2"}) {
    const test::CommandResult r = test::deform(
        {"explain", path, "--json", "--set", std::string("/materials/gel/damping/stiffness=") + damping});
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const auto after = [&](const char *key, size_t from) {
      const size_t at = r.out.find(key, from);
      return at == std::string::npos ? 0.0 : std::strtod(r.out.c_str() + at + std::strlen(key), nullptr);
    };
    const double planned = after("\"substep_s\":", r.out.find("\"predicted\":")),
                 taken = after("\"stable_s\":", 0);
    EXPECT_GT(planned, taken / 1.5) << damping;
    EXPECT_LT(planned, taken * 1.5) << damping;
  }
}

// A silicone finger that is damped so much that its explicit steps would be 3 us.
TEST_F(PlannerScene, StiffFingerUnderAProbe_MovesImplicitly) {
  const std::string path = folder() + "/finger.json";
  test::write_file(path, R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.5},
 "accuracy": {"target": 0.05, "quantity": "tip"},
 "materials": {"silicone": {"density": 1070, "young": 2e5, "poisson": 0.4, "damping": {"stiffness": 0.03}}},
 "bodies": [{"name": "finger", "material": "silicone", "lattice": null,
   "mesh": {"make": "beam", "size": [0.1, 0.02, 0.02], "cells": 2000},
   "fix": [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]}],
 "obstacles": [{"name": "rod", "shape": "sphere", "radius": 0.01, "motion": {"keyframes": [
   {"t": 0, "position": [0.09, 0.01, 0.031]}, {"t": 0.3, "position": [0.09, 0.01, 0.005]}]}}],
 "probes": [{"name": "tip", "body": "finger", "point": [0.1, 0.01, 0.01]}]})");
  const test::CommandResult r = test::deform({"explain", path});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, "--set /time/integrator=tr_bdf2")) << r.out;
}

// The same path of a tool, of an obstacle; the place that "place" means, given by a pose; a bar on a wall.
TEST_F(PlannerScene, ToolsPlacesAndAttachments_CountAsWhatTheyAre) {
  const auto planned = [](const std::string &body, const std::string &more) {
    const std::string path = folder() + "/scene.json";
    test::write_file(path, R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.5},
 "accuracy": {"target": 0.2}, "materials": {"gel": {"young": 2e4, "damping": {"stiffness": 2e-3}}},
 "bodies": [{"name": "block", "material": "gel", "lattice": null,
   "mesh": {"make": "beam", "size": [0.2, 0.2, 0.1], "cells": 600})" +
                               body + "}], " + more + "}");
    const test::CommandResult r = test::deform({"explain", path});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    std::string out;
    for (const char *word : {"assumed: body 'block'", "--set "})
      for (size_t at = 0; (at = r.out.find(word, at)) != std::string::npos; ++at)
        out += r.out.substr(at, r.out.find('\n', at) - at) + "\n";
    return out;
  };
  const std::string held = R"(, "fix": [{"box": [[-1, -1, -1], [1, 1, 1e-6]]}])",
                    probe = R"({"name": "probe", "shape": "sphere", "radius": 0.05, "motion": {"keyframes": [
   {"t": 0, "position": [0.1, 0.1, 0.151]}, {"t": 0.3, "position": [0.1, 0.1, 0.142]}]}})";
  const std::string pressed = planned(held, "\"tools\": [" + probe + "]");
  EXPECT_TRUE(has(pressed, "'probe' touches it")) << pressed;
  EXPECT_EQ(pressed, planned(held, "\"obstacles\": [" + probe + "]"));

  const std::string table = R"("obstacles": [{"name": "table", "shape": "plane"}])";
  const std::string placed =
      planned(R"(, "pose": {"position": [0, 0, 0.8]}, "place": {"on": "table"})", table);
  EXPECT_FALSE(has(placed, "touches nothing")) << placed;
  EXPECT_EQ(placed, planned(R"(, "pose": {"position": [0, 0, 3e-5]})", table));

  const std::string hung =
      planned(R"(, "attach": [{"to": "wall", "box": [[-1, -1, -1], [1e-6, 1, 1]]}])",
              R"("obstacles": [{"name": "wall", "shape": "box", "half_size": [0.1, 0.2, 0.2],
                        "pose": {"position": [-0.1, 0.1, 0.05]}}])");
  EXPECT_TRUE(has(hung, "; held")) << hung;
}

// A load counts at its greatest, wherever the scene has it.
TEST_F(PlannerScene, Loads_CountAtTheirGreatest) {
  const std::string scene = bar(R"("accuracy": {"target": 0.4},)", R"("lattice": null, )");
  const auto load = [&](const std::vector<std::string> &set) { return assumed_of(scene, set); };
  EXPECT_TRUE(has(load({}), "load 9.81 m/s2")) << load({});
  EXPECT_EQ(
      load({R"(/gravity={"keyframes": [{"t": 0, "value": [0, 0, 0]}, {"t": 0.1, "value": [0, 0, -9.81]}]})"}),
      load({}));
  // of what the run does not reach, the part that it does
  EXPECT_EQ(
      load(
          {R"(/gravity={"keyframes": [{"t": 0, "value": [0, 0, 0]}, {"t": 0.2, "value": [0, 0, -19.62]}]})"}),
      load({}));
  const std::string to = R"(/bodies/0/forces=[{"box": [[0.39, -1, -1], [1, 1, 1]], "total": [0, 0, )";
  const std::string whole = load({to + "-40]}]"});
  EXPECT_TRUE(has(whole, "load 19.8 m/s2")) << whole;
  EXPECT_EQ(load({to + R"(0.4], "keyframes": [{"t": 0, "scale": 0}, {"t": 0.05, "scale": -100}]}])"}), whole);
  EXPECT_EQ(load({to + R"(20], "sine": {"amplitude": 1, "frequency": 3}}])"}), whole);
  test::write_file(folder() + "/forces.csv",
                   "node,fixx,fixy,fixz,fx,fy,fz\n20,0,0,0,0,0,-30\n21,0,0,0,0,0,-10\n");
  EXPECT_EQ(load({R"(/bodies/0/nodal_bc="forces.csv")"}), whole);
}

// Held is what is held along all axes, and met is what is there and no sensor and not filtered.
// unsanitized: too slow there; shorter tests run the same code
TEST_F(PlannerScene, HoldsAndObstacles_CountAsTheyAre) {
  const std::string scene = bar(R"("accuracy": {"target": 0.4},)", R"("lattice": null, )");
  const auto about = [&](const std::vector<std::string> &set) { return assumed_of(scene, set); };
  const std::string nodes = "node,fixx,fixy,fixz,fx,fy,fz\n", loose = "/bodies/0/fix=[]";
  test::write_file(folder() + "/free.csv", nodes + "20,0,0,0,0,0,0\n");
  test::write_file(folder() + "/held.csv", nodes + "20,1,1,0,0,0,0\n21,1,1,1,0,0,0\n");
  EXPECT_EQ(about({loose, R"(/bodies/0/nodal_bc="free.csv")"}), about({loose}));
  EXPECT_TRUE(has(about({loose}), "; free")) << about({loose});
  EXPECT_TRUE(has(about({loose, R"(/bodies/0/nodal_bc="held.csv")"}), "; held"));
  EXPECT_TRUE(has(about({R"(/bodies/0/fix/0/axes="yz")"}), "; free"));

  const auto wall = [&](const std::string &keys) {
    return R"(/obstacles=[{"name": "w", "shape": "box", "half_size": [1, 1, 0.1], )" + keys + "}]";
  };
  const std::string below = about({loose, wall(R"("pose": {"position": [0, 0, -0.11]})")}),
                    away = about({loose});
  EXPECT_TRUE(has(below, "may touch something")) << below;
  EXPECT_EQ(about({loose, wall(R"("pose": {"position": [0, 0, 5]}, "start": {"position": [0, 0, -0.11]})")}),
            below);
  EXPECT_EQ(about({loose, wall(R"("start": {"position": [0, 0, 5]})")}), away);
  EXPECT_EQ(about({loose, wall(R"("sensor": true)")}), away);
  EXPECT_EQ(about({loose, wall(R"("pose": {"position": [0, 0, -0.11]})"),
                   R"(/contact={"filter": [{"between": ["bar", "w"]}]})"}),
            away);
  // a moving one that begins far from where its pose is not given, at a speed of 0
  const std::string comes = about({loose, wall(R"("motion": {"keyframes": [{"t": 0, "position": [0, 0, 9]},
                                                     {"t": 1, "position": [0, 0, 8]}]})")});
  EXPECT_TRUE(has(comes, "and speed 0.981 m/s")) << comes;
}

// Where the prediction leaves something out, it is not claimed that the target is met.
TEST_F(PlannerScene, WhatIsLeftOut_IsNotClaimed) {
  const std::string scene = bar(R"("accuracy": {"target": 0.9},)", R"("lattice": null, )");
  const std::string fix = R"(/bodies/0/fix=[{"box": [[-1, -1, -1], [1e-6, 1, 1]])";
  const std::string kCases[][2] = {
      {R"(/bodies/0/springs=[{"point": [0.4, 0.05, 0.05], "to": [0.5, 0.05, 0.05], "stiffness": 100}])",
       "its springs"},
      {fix + R"(, "motion": {"sine": {"amplitude": [0, 0, 0.1], "frequency": 3}}}])",
       "the motion of what is held"},
      {fix + R"(, "axes": "xy"}])", "points that are held along some axes only"},
      {R"(/bodies/0/forces=[{"box": [[0.39, -1, -1], [1, 1, 1]], "total": [0, 0, 1],
          "sine": {"amplitude": 1, "frequency": 3}}])",
       "resonance with a force that oscillates"},
      {R"(/bodies/0/start={"scramble": 1})", "a start in another shape"},
      {R"(/contact={"self": true})", "contact with itself"},
      {R"(/contact={"self": "auto"})", "contact with itself"},
      {R"(/tools=[{"name": "t", "shape": "sphere", "radius": 0.01, "pose": {"position": [0, 0, 1]}}])",
       "the motion of tools without keyframes"},
  };
  EXPECT_TRUE(has(test::deform({"explain", scene, "--json"}).out, "\"meets\":true"));
  for (const auto &[set, what] : kCases) {
    const test::CommandResult r = test::deform({"explain", scene, "--set", set, "--json"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(has(r.out, "\"meets\":null") && has(r.out, what)) << set << r.out;
  }
  const test::CommandResult run =
      test::deform({"run", scene, "--set", kCases[0][0], "--out", folder() + "/out"});
  EXPECT_TRUE(has(run.err,
                  "whether the target of 90 % is met is not known: body 'bar': the prediction leaves "
                  "out its springs (see: deform explain"))
      << run.err;
  EXPECT_FALSE(has(run.out, "nearest")) << run.out;
  const test::CommandResult reported = test::deform({"explain", scene, "--set", kCases[0][0]});
  EXPECT_TRUE(has(reported.out, "  chosen:   ") && has(reported.out, "  unknown:  whether")) << reported.out;
}

// What a mesh does to a dent, and to contacts of a body that nothing holds, is not predicted: neither claimed
// nor denied. A held body that something wide presses is.
TEST_F(PlannerScene, DentsAndContactsOfFreeBodies_AreNotClaimed) {
  const std::string scene = bar(R"("accuracy": {"target": 0.9},)", R"("lattice": null, )");
  const auto comes = [](const std::string &shape) {
    return R"(/obstacles=[{"name": "o", )" + shape + R"(, "motion": {"keyframes": [
        {"t": 0, "position": [0.3, 0.05, -0.13]}, {"t": 1, "position": [0.3, 0.05, -0.1]}]}}])";
  };
  const std::string
      wide = comes(R"("shape": "box", "half_size": [1, 1, 0.1])"),
      tip = comes(R"("shape": "sphere", "radius": 0.01)"),
      floor = R"(/obstacles=[{"name": "o", "shape": "plane", "pose": {"position": [0, 0, -1e-3]}}])";
  struct Case {
    std::vector<std::string> set;
    bool claimed;
  };
  for (const Case &c : {Case{{wide}, true}, {{tip}, false}, {{floor, "/bodies/0/fix=[]"}, false}}) {
    std::vector<std::string> args = {"explain", scene, "--json"};
    for (const std::string &set : c.set) args.insert(args.end(), {"--set", set});
    const test::CommandResult r = test::deform(args);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(has(r.out, "touch something")) << r.out;
    EXPECT_EQ(has(r.out, "\"meets\":true"), c.claimed) << r.out;
    EXPECT_EQ(has(r.out, "\"meets\":null"), !c.claimed) << r.out;
    EXPECT_EQ(has(r.out,
                  "is not known: body 'bar': the prediction leaves out what its mesh does to its "
                  "contacts"),
              !c.claimed)
        << r.out;
  }
}

// The planner looks at a mesh, too; a host hears of it once.
TEST_F(PlannerScene, Warnings_AreHeardOnce) {
  const std::string path = folder() + "/scene.json";
  test::write_file(path, R"({"format": "deform-scene", "version": 1, "accuracy": {"target": 0.4},
 "time": {"duration": 0.1}, "bodies": [{"name": "lobes", "model": {"type": "auto"},
   "mesh": ")" DEFORM_SOURCE_DIR R"(/examples/data/lobes.stl"}], "obstacles": [{"name": "ground",
   "shape": "mesh", "mesh": ")" DEFORM_SOURCE_DIR
                         R"(/examples/data/terrain.obj", "pose": {"position": [0, 0, -5]}}]})");
  test::LoggedContext context;
  dfm_world world = 0;
  ASSERT_EQ(dfm_scene_load(context.context, path.c_str(), &world), DFM_OK) << dfm_last_error();
  dfm_world_destroy(world);
  for (const char *const warning : {"it is filled with", "terrain.obj: the surface is open"}) {
    size_t times = 0;
    for (size_t at = 0; (at = context.log.find(warning, at)) != std::string::npos; ++at) ++times;
    EXPECT_EQ(times, 1u) << context.log;
  }
}

// Of a body that then has a lattice, it is not told how its surface would be filled.
TEST_F(PlannerScene, Warnings_AreOfWhatIsBuilt) {
  std::string box;
  for (int i = 0; i < 8; ++i)
    box += std::string("v ") + (i & 1 ? "0.4 " : "0 ") + (i & 2 ? "0.1 " : "0 ") + (i & 4 ? "0.1\n" : "0\n");
  for (const char *side : {"1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"})
    box += std::string("f ") + side + "\n";
  test::write_file(folder() + "/box.obj", box);
  const std::string path = folder() + "/scene.json";
  for (const bool kept : {false, true}) {
    test::write_file(path, R"({"format": "deform-scene", "version": 1, "accuracy": {"target": 0.05},
 "time": {"duration": 0.1}, "gravity": [0, 0, -9.81], "bodies": [{"name": "bar", "mesh": "box.obj", )" +
                               std::string(kept ? R"("lattice": null, )" : "") +
                               R"("fix": [{"box": [[-1, -1, -1], [1e-6, 1, 1]]}]}]})");
    test::LoggedContext context;
    dfm_world world = 0;
    ASSERT_EQ(dfm_scene_load(context.context, path.c_str(), &world), DFM_OK) << dfm_last_error();
    EXPECT_EQ(has(context.log, "it is filled with"), kept) << context.log;
    dfm_world_destroy(world);
  }
}

TEST_F(PlannerScene, WhatCannotBePlanned_IsReportedInOneSentence) {
  const std::string target = R"("accuracy": {"target": 0.1},)";
  expect_refused(bar(target + R"("budget": {"ms_per_step": 1},)"), {"/budget", "keep one"});
  expect_refused(bar(R"("accuracy": {"target": 2},)"), {"/accuracy/target"});
  expect_refused(bar(R"("accuracy": {"target": 0.1, "quantity": "color"},)"),
                 {"/accuracy/quantity", "force"});
  expect_refused(bar(target, "", R"(, "mode": "static")"), {"/accuracy", "a static scene has no step"});
  const std::string none = folder() + "/none.json";
  for (const char *const key : {R"("accuracy": {"target": 0.1})", R"("budget": {"ms_per_step": 1})"}) {
    test::write_file(none, R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.1},
      "obstacles": [{"name": "floor", "shape": "plane"}], )" +
                               std::string(key) + "}");
    expect_refused(none, {"there is no body to plan for"});
  }
  const std::string two = folder() + "/two.json";
  test::write_file(two,
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.1}, )" + target + R"(
 "bodies": [{"name": "a", "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 300},
             "model": {"type": "corotational_fem"}, "integrator": "tr_bdf2"},
            {"name": "b", "mesh": {"make": "beam", "size": [0.4, 0.1, 0.1], "cells": 300},
             "model": {"type": "corotational_fem"}, "integrator": "implicit_euler",
             "pose": {"position": [0, 1, 0]}}]})");
  expect_refused(two, {"/accuracy", "different integrators"});
  expect_refused(bar(target, R"("model": {"params": {"volume": 0}}, )"),
                 {"/bodies/0/model/params", "name it in"});
}

// unsanitized: too slow there; shorter tests run the same code
TEST_F(PlannerScene, Calibrate_WritesWhatScenesTake) {
  const test::CommandResult r = test::deform({"calibrate", "--model", "shape_matching", "--quiet"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  EXPECT_TRUE(has(r.out, folder() + "/deform/costs.json")) << r.out;
  const std::string costs = test::read_file(folder() + "/deform/costs.json");
  EXPECT_TRUE(has(costs, "\"version\": 4") && has(costs, "\"short_ns_per_point\"")) << costs;
  // the others keep the costs that the library ships: a scene that names one of them is planned, too
  for (const char *model : {"shape_matching", "msm"}) {
    const test::CommandResult planned =
        test::deform({"explain", bar(R"("accuracy": {"target": 0.2},)",
                                     R"("model": {"type": ")" + std::string(model) + R"("}, )")});
    EXPECT_EQ(planned.exit_code, 0) << planned.err;
    EXPECT_TRUE(has(planned.out, "--set /time/step=")) << planned.out;
  }
  test::write_file(folder() + "/deform/costs.json",
                   R"({"format": "deform-costs", "version": 3, "machine": 3})");
  expect_refused(bar(R"("accuracy": {"target": 0.2},)"), {"costs.json", "/machine"});
  test::write_file(folder() + "/deform/costs.json",
                   R"({"format": "deform-costs", "version": 2, "machine": "old", "models": []})");
  expect_refused(bar(R"("accuracy": {"target": 0.2},)"), {"costs.json", "/version", "calibrate again"});
  std::remove((folder() + "/deform/costs.json").c_str());
}

// The cheapest model, which is modal without these, takes none of them.
TEST_F(PlannerScene, WhatTheSceneAsksFor_ExcludesModelsThatDoNotTakeIt) {
  const char *const kAsks[][2] = {
      {"", R"("springs": [{"point": [0.4, 0.05, 0.05], "to": [0.5, 0.05, 0.05], "stiffness": 100}], )"},
      {"", R"("separate": {}, )"},
      {"", R"("mass_scaling": 0.05, )"},
      {R"("cuts": [{"body": "bar", "t": 0.05, "shape": "plane", "point": [0.2, 0, 0],
                    "normal": [1, 0, 0]}], )",
       ""},
  };
  const auto planned = [](const std::string &of_scene, const std::string &of_body) {
    return test::deform({"explain", bar(of_scene + R"("accuracy": {"target": 0.4},)", of_body)});
  };
  const std::string modal = "--set /bodies/0/model/type=modal";
  EXPECT_TRUE(has(planned("", "").out, modal));
  for (const auto &[of_scene, of_body] : kAsks) {
    const test::CommandResult r = planned(of_scene, of_body);
    EXPECT_EQ(r.exit_code, 0) << of_scene << of_body << r.err;
    EXPECT_TRUE(has(r.out, "--set /bodies/0/model/type=") && !has(r.out, modal)) << r.out;
  }
}
