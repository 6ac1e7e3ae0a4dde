// `deform friction` as a user calls it: what it refuses, what it writes, what it says about a law
// that is not ours.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "friction_rig.h"

namespace {

using test::rig::example;

std::string folder() { return test::scratch("friction_command"); }
std::string tiny(const std::string &name) {
  return std::string(DEFORM_BINARY_DIR) + "/lib/tiny/" + name + ".so";
}

std::string file(const std::string &name, const std::string &text) {
  test::write_file(folder() + "/" + name, text);
  return folder() + "/" + name;
}

// A push in five rows; `change` replaces a piece of it.
std::string push(const std::string &from = "", const std::string &to = "") {
  std::string text = R"({"law": "coulomb", "mass": 1.0, "gravity": 10.0,
 "params": {"F_C": 1.0, "F_S": 1.5},
 "input": {"kind": "bias_sine_force", "bias": 2.0, "amp": 0, "freq": 1},
 "columns": ["t", "x", "v", "F"],
 "output_times": [0, 0.1, 0.2, 0.3, 0.4]}
)";
  if (!from.empty()) {
    EXPECT_NE(text.find(from), std::string::npos) << from;
    text.replace(text.find(from), from.size(), to);
  }
  return text;
}

void expect_bad_case(const std::string &from, const std::string &to, std::vector<std::string> words) {
  words.push_back("bad.json");
  test::expect_refused({"friction", file("bad.json", push(from, to)), "--csv", folder() + "/never.csv"},
                       words);
  EXPECT_FALSE(std::filesystem::exists(folder() + "/never.csv"));
}

bool has(const std::string &text, const std::string &word) { return text.find(word) != std::string::npos; }

}  // namespace

TEST(FrictionCommand, EveryDrive_WritesItsColumnsAtItsTimes) {
  const struct {
    const char *name, *columns;
    size_t rows;
  } cases[] = {
      {"braked_mass", "t,x,v,F", 8},
      {"rig", "t,x,v,F,z", 601},
      {"stick_slip", "t,x,v,F", 281},
      {"loops", "x,segment,F", 101},
      {"circle", "t,vx,vy,zx,zy,Fx,Fy", 51},
      {"load_wave", "t,v,Fn,z,F_elastic,closed,F", 201},
      {"breakaway", "rate,F_ba,t_ba,f_applied_at_ba,interior_peak,t_v_eq_v_s,f_applied_v_eq_v_s", 3}};
  for (const auto &c : cases) {
    const std::string csv = folder() + "/rows.csv";
    const test::CommandResult r = test::deform(
        {"friction", example(c.name), "--law", "coulomb", "--step", "1e-3", "--quiet", "--csv", csv});
    ASSERT_EQ(r.exit_code, 0) << r.err;
    EXPECT_EQ(r.out + r.err, "") << c.name;
    const std::string text = test::read_file(csv);
    EXPECT_EQ(text.substr(0, text.find('\n')), c.columns);
    EXPECT_EQ(size_t(std::count(text.begin(), text.end(), '\n')), c.rows + 1) << c.name;
    EXPECT_EQ(text.back(), '\n');
  }
}

// Every digit that a double has: 1/3 reads back as 1/3. A step that does not divide the interval is
// shortened, not rounded.
TEST(FrictionCommand, Rows_HoldEveryDigitAtExactTimes) {
  const std::string f =
      file("thirds.json", push("[0, 0.1, 0.2, 0.3, 0.4]", "[0, 0.3333333333333333, 0.6666666666666666]"));
  const test::rig::Outcome out = test::rig::run(f, {"--step", "0.01"});
  const std::vector<double> t = out.rows.column("t"), x = out.rows.column("x");
  ASSERT_EQ(t.size(), 3u);
  EXPECT_EQ(t[1], 0.3333333333333333);
  EXPECT_EQ(t[2], 0.6666666666666666);
  EXPECT_EQ(out.figure("steps"), 68);  // 34 steps of 0.0098 s each time
  EXPECT_EQ(x[2], out.figure("x_end"));
}

TEST(FrictionCommand, TimesFromLengthAndSpacing_AreTheSame) {
  const std::string by_list = file("list.json", push());
  for (const std::string length : {"0.4", "0.46"}) {  // no row lies beyond it
    const std::string by_step =
        file("step.json", push("\"freq\": 1},", "\"freq\": 1, \"T\": " + length + ", \"dt\": 0.1},"));
    std::string text = test::read_file(by_step);
    text.erase(text.find(",\n \"output_times\""), text.rfind(']') + 1 - text.find(",\n \"output_times\""));
    test::write_file(by_step, text);
    const auto listed = test::rig::run(by_list).rows.values, stepped = test::rig::run(by_step).rows.values;
    ASSERT_EQ(listed.size(), stepped.size());
    for (size_t i = 0; i < listed.size(); ++i)
      for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(listed[i][k], stepped[i][k], 1e-12);
  }
}

TEST(FrictionCommand, NamesOfTheSet_MeanOurLaws) {
  for (const char *law : {"coulomb", "coulomb_plain", "org.deform.coulomb"})
    EXPECT_TRUE(has(test::rig::run(example("steady_push"), {"--law", law}).figures,
                    "\"law\": \"org.deform.coulomb\""))
        << law;
  EXPECT_TRUE(has(test::rig::run(example("rig_below"), {"--law", "ep"}).figures,
                  "\"law\": \"org.deform.elastoplastic\""));
}

TEST(FrictionCommand, BadCases_AreRefusedWithTheirPlace) {
  test::expect_refused({"friction", folder() + "/none.json"}, {"none.json", "No such file"});
  test::expect_refused({"friction", file("cut.json", push().substr(0, 90))}, {"cut.json:3:", "not JSON"});
  test::expect_refused({"friction", file("list.json", "[1]")}, {"list.json", "object"});
  std::string spring = test::read_file(example("stick_slip"));
  test::expect_refused(
      {"friction", file("spring.json", spring.replace(spring.find("\"k\": "), 5, "\"k\": -"))},
      {"/input/k", "negative"});
  expect_bad_case("\"input\"", "\"inputs\"", {"/input"});
  expect_bad_case("\"bias_sine_force\"", "\"bias_sin_force\"",
                  {"/input/kind", "bias_sin_force", "did you mean \"bias_sine_force\""});
  expect_bad_case("\"bias_sine_force\"", "\"table\"", {"/input/kind", "table"});
  expect_bad_case("\"amp\": 0", "\"ampl\": 0", {"/input/amp", "missing", "\"ampl\""});
  expect_bad_case("\"amp\": 0", "\"amp\": \"much\"", {"/input/amp", "much", "finite number"});
  expect_bad_case("\"amp\": 0", "\"amp\": 1e999", {"/input/amp", "1e999"});
  expect_bad_case("\"mass\": 1.0", "\"mass\": -1.0", {"/mass", "-1.0"});
  expect_bad_case("\"mass\": 1.0", "\"weight\": 1.0", {"/mass", "missing"});
  expect_bad_case("\"params\": {", "\"params\": [{", {"not JSON"});
  expect_bad_case("0.1, 0.2", "0.2, 0.1", {"/output_times/2", "rise"});
  expect_bad_case("\"output_times\"", "\"output_time\"", {"/output_times", "\"output_time\""});
  expect_bad_case("\"F\"]", "\"Fx1\"]", {"/columns", "Fx1", "did you mean \"Fx\""});
  expect_bad_case("\"F_S\": 1.5", "\"F_S\": 0.5", {"/params", "mu_S", "mu_C"});
  expect_bad_case("\"F_C\": 1.0, \"F_S\": 1.5", "\"v_s\": 1", {"/params", "F_C"});
  expect_bad_case("\"coulomb\"", "\"maxwell_slip\"", {"maxwell_slip", "coulomb"});
  expect_bad_case("\"coulomb\"", "\"dahl,lugre\"", {"several laws", "--law"});
}

TEST(FrictionCommand, BadUsage_IsRefused) {
  const std::string good = file("good.json", push());
  test::expect_refused({"friction"}, {"CASE"});
  test::expect_refused({"friction", good, "--step", "0"}, {"--step"});
  test::expect_refused({"friction", good, "--step", "nan"}, {"--step"});
  test::expect_refused({"friction", good, "--step", "1e-12"}, {"--step", "steps"});
  test::expect_refused({"friction", good, "--steps", "1"}, {"--steps", "did you mean \"--step\""});
  test::expect_refused({"friction", good, "--law", "culomb"}, {"culomb", "coulomb"});
  test::expect_refused({"friction", good, "--law", folder() + "/no.so"}, {"no.so"});
  test::expect_refused({"friction", good, "--csv", folder() + "/no/such/folder.csv"}, {"no/such/folder.csv"});
  EXPECT_FALSE(std::filesystem::exists(folder() + "/no"));
}

TEST(FrictionCommand, LoadWithoutProjection_IsRefused) {
  std::string text = test::read_file(example("load_wave"));
  const std::string other =
      std::string(text).replace(text.find("\"F0\""), 4, "\"form\": \"Fn = F0(1+a sin)\", \"F0\"");
  test::expect_refused({"friction", file("form.json", other)}, {"/input", "projection"});
  text.replace(text.find("\"F_elastic\""), 11, "\"cone_excess\"");
  test::expect_refused({"friction", file("excess.json", text)}, {"/input", "projection"});
}

TEST(FrictionCommand, ThirdPartyLaw_RunsByPathAndItsMissingKeysAreNamed) {
  const test::rig::Outcome out = test::rig::run(example("rig"), {"--law", tiny("tiny_bristle")});
  EXPECT_TRUE(has(out.figures, "\"law\": \"org.tiny.bristle\""));
  for (const char *key : {"F_S", "v_s", "delta", "sigma1", "sigma2", "dv", "z_ba", "alpha", "nu"})
    EXPECT_TRUE(has(out.err, std::string(" ") + key)) << key << " in " << out.err;
  EXPECT_FALSE(has(out.err, "F_C,")) << out.err;  // mu came of it
  EXPECT_FALSE(has(out.err, "sigma0")) << out.err;
  EXPECT_TRUE(has(out.figures, "\"warnings\": [\"")) << out.figures;
  EXPECT_NEAR(out.figure("F_max"), 1.47, 1e-12);
  // The tangent pair is the second slot: z is the bristle, not the counter before it.
  const std::vector<double> z = out.rows.column("z"), f = out.rows.column("F");
  for (size_t i = 1; i < z.size(); ++i) ASSERT_NEAR(f[i], 1e4 * z[i], 1e-12);
}

TEST(FrictionCommand, ThirdPartyLawWithoutASpeedInTheCase_KeepsItsOwn) {
  const auto loop = [](const std::string &params) {
    return file("own_speed.json", R"({"law": "coulomb", "normal_force": 10, "T": 1, "dt": 0.125,
 "params": {)" + params + R"(}, "input": {"kind": "sine_velocity", "V": 0.1, "freq": 1}})");
  };
  const auto largest = [&](const std::string &params) {
    return test::rig::run(loop(params), {"--law", tiny("tiny_smooth")}).figure("F_max");
  };
  EXPECT_NEAR(largest("\"mu\": 0.5"), 2.5, 1e-3);
  EXPECT_NEAR(largest("\"mu\": 0.5, \"v_s\": 0.3"), 1.25, 1e-3);
}

TEST(FrictionCommand, StrangeKeyForOurLaw_IsNamedWithTheNearest) {
  const test::CommandResult r = test::deform(
      {"friction", file("strange.json", push("\"F_S\": 1.5", "\"F_S\": 1.5, \"sigma_2\": 0.4"))});
  EXPECT_EQ(r.exit_code, 0);
  EXPECT_TRUE(has(r.err, "sigma_2 (did you mean \"sigma2\"?)")) << r.err;
  const test::CommandResult known = test::deform({"friction", example("rig")});
  // keys of other laws of the set are no mistake
  EXPECT_EQ(known.err, "");
}

TEST(FrictionCommand, NormalForceOfAMeasurement_ScalesTheLoop) {
  const std::string text =
      R"({"law": "coulomb", "normal_force": 10, "params": {"mu": 0.5}, "T": 1, "dt": 0.125,
 "input": {"kind": "sine_velocity", "V": 0.1, "freq": 1}})";
  const test::rig::Outcome out = test::rig::run(file("ten.json", text), {});
  EXPECT_EQ(out.err, "");
  EXPECT_NEAR(out.figure("F_max"), 5, 1e-12);
  EXPECT_EQ(out.rows.column("t").size(), 9u);
  const auto reported = [&](const std::string &from, const std::string &to, const std::string &words) {
    std::string other = text;
    const test::CommandResult r =
        test::deform({"friction", file("told.json", other.replace(other.find(from), from.size(), to))});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_TRUE(has(r.err, words)) << "no '" << words << "' in: " << r.err;
  };
  reported("\"normal_force\": 10, ", "", "no normal force is given, so it is 1 N");
  reported("\"freq\": 1", "\"freq\": 1, \"F0\": 10",
           "/input/F0 is not read for input.kind \"sine_velocity\"; the "
           "normal force is /normal_force");
  reported("\"law\"", "\"normal_load\": 3, \"law\"", "/normal_load is not read; the normal force is");
  reported("\"freq\": 1", "\"freq\": 1, \"phas\": 1", "did you mean \"phase\"?");
  test::expect_refused({"friction", file("both.json", push("\"mass\"", "\"normal_force\": 3, \"mass\""))},
                       {"/normal_force and /gravity both give the normal force"});
}

TEST(FrictionCommand, LawWithAJump_HoldsAndIsReported) {
  std::string text = push("\"bias\": 2.0", "\"bias\": 0.9");
  const test::rig::Outcome held = test::rig::run(file("held.json", text), {"--law", tiny("tiny_sign")});
  for (const double x : held.rows.column("x")) EXPECT_EQ(x, 0);
  EXPECT_TRUE(has(held.err, "jumps")) << held.err;
  EXPECT_EQ(held.figure("jumps"), 4000);
  const std::vector<double> f = held.rows.column("F");
  // what holds it, not what the law said on either side
  EXPECT_EQ(f.back(), 0.9);
  const test::rig::Outcome slides = test::rig::run(file("slides.json", push()), {"--law", tiny("tiny_sign")});
  EXPECT_NEAR(slides.rows.column("v").back(), 0.4, 1e-12);
  EXPECT_EQ(slides.figure("jumps"), 0);
}

TEST(FrictionCommand, LawThatGivesNaN_StopsWithItsRows) {
  const std::string csv = folder() + "/nan.csv";
  const std::string f =
      file("nan.json", push("\"F_C\": 1.0, \"F_S\": 1.5", "\"where\": \"ft\", \"value\": \"nan\""));
  const test::CommandResult r =
      test::deform({"friction", f, "--law", tiny("tiny_nan"), "--csv", csv, "--json"});
  EXPECT_EQ(r.exit_code, 3);
  EXPECT_TRUE(has(r.err, "step 0") && has(r.err, "org.tiny.nan")) << r.err;
  EXPECT_TRUE(has(r.out, "\"stopped\"")) << r.out;
  EXPECT_EQ(test::read_file(csv), "t,x,v,F\n");
  const std::string word = file("word.json", push("\"F_C\": 1.0, \"F_S\": 1.5", "\"where\": \"foot\""));
  test::expect_refused({"friction", word, "--law", tiny("tiny_nan")}, {"/params/where", "foot", "dft_dvt"});
}

TEST(FrictionCommand, InputsAndOtherFiles_AreNotOverwritten) {
  const std::string good = file("own.json", push()), text = test::read_file(good);
  test::expect_refused({"friction", good, "--csv", good}, {"--csv", "would be overwritten"});
  test::expect_refused({"friction", good, "--plot", folder() + "/own.txt"}, {"--plot", ".png"});
  EXPECT_EQ(test::read_file(good), text);
  test::write_file(folder() + "/own.csv", "measured\n");
  const test::CommandResult r =
      test::run({"/usr/bin/env", "DEFORM_PYTHON=/nonexistent/python3", DEFORM_COMMAND, "friction", good,
                 "--plot", folder() + "/own.png"});
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_TRUE(has(r.err, "own.csv") && has(r.err, "--csv")) << r.err;
  EXPECT_EQ(test::read_file(folder() + "/own.csv"), "measured\n");
}

TEST(FrictionCommand, CaseWithAByteOrderMark_IsRead) {
  EXPECT_EQ(test::deform({"friction", file("mark.json", "\xef\xbb\xbf" + push()), "--quiet"}).exit_code, 0);
}

TEST(FrictionCommand, DriveFasterThanItsSteps_IsRefused) {
  const std::string fast = file("fast.json", R"({"law": "coulomb",
    "params": {"mu": 0.5}, "mass": 1, "gravity": 9.81,
    "input": {"kind": "sine_velocity", "V": 0.02, "freq": 1e12, "T": 2, "dt": 0.002}})");
  test::expect_refused({"friction", fast}, {"/input/freq", "--step"});
}

TEST(FrictionCommand, PlotWithoutMatplotlib_KeepsTheRows) {
  const std::string good = file("good.json", push());
  const std::string picture = folder() + "/alone.png";
  const std::string beside = folder() + "/alone.csv";
  const std::string csv = folder() + "/given.csv";
  for (const std::string &old : {picture, beside, csv}) std::filesystem::remove(old);
  const std::vector<std::string> lost = {
      "/usr/bin/env", "DEFORM_PYTHON=/nonexistent/python3", DEFORM_COMMAND, "friction", good, "--plot",
      picture};
  const test::CommandResult r = test::run(lost);
  EXPECT_EQ(r.exit_code, 0);
  EXPECT_TRUE(has(r.err, "matplotlib") && has(r.err, beside)) << r.err;
  EXPECT_FALSE(std::filesystem::exists(picture) || std::filesystem::exists(picture + ".part") ||
               std::filesystem::exists(picture + ".rows"));
  EXPECT_EQ(test::read_csv(beside).size(), 6u);
  std::filesystem::remove(beside);
  std::vector<std::string> with_csv = lost;
  with_csv.insert(with_csv.end(), {"--csv", csv});
  EXPECT_EQ(test::run(with_csv).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(csv) && !std::filesystem::exists(beside));
}

// unsanitized: too slow there; shorter tests run the same code
TEST(FrictionCommand, Plot_WritesAPictureAndNothingElse) {
  const std::string picture = folder() + "/drawn.png";
  std::filesystem::remove(picture);
  const test::CommandResult r =
      test::deform({"friction", file("good.json", push()), "--plot", picture, "--quiet"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.err, "");
  ASSERT_TRUE(std::filesystem::exists(picture));
  EXPECT_EQ(test::read_file(picture).substr(1, 3), "PNG");
  EXPECT_FALSE(std::filesystem::exists(picture + ".rows") || std::filesystem::exists(picture + ".part"));
  test::expect_refused({"friction", file("good.json", push()), "--plot", folder() + "/no/such/place.png"},
                       {"no/such/place.png"});
  test::expect_refused({"friction", file("good.json", push()), "--plot", folder() + "/no/such/place.png",
                        "--csv", folder() + "/kept.csv", "--quiet"},
                       {"no/such/place.png: cannot be written: No such file or directory"});
}

// As where a version manager's python3, which has no matplotlib, comes first in PATH, and its settings are in
// the environment.
TEST(FrictionCommand, PlotWithAnotherPythonFirstInPath_DrawsByTheOneOfTheSetUp) {
  const std::string other = folder() + "/other_python";
  const std::string picture = folder() + "/drawn_with_another_python_first.png";
  std::filesystem::create_directories(other);
  test::write_file(other + "/python3", "#!/bin/sh\nexit 3\n");
  std::filesystem::permissions(other + "/python3", std::filesystem::perms::owner_all);
  std::filesystem::remove(picture);
  const test::CommandResult r =
      test::run({"/usr/bin/env", "PATH=" + other, "PYTHONHOME=" + other, "PYTHONPATH=" + other,
                 DEFORM_COMMAND, "friction", file("good.json", push()), "--plot", picture, "--quiet"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.err, "");
  EXPECT_TRUE(std::filesystem::exists(picture));
}
