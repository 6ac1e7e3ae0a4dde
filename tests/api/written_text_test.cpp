// What the library writes as text, a scene and its plan: the same in every locale, UTF-8, and what was meant.
#include <clocale>
#include <cstdlib>
#include <filesystem>

#include "support.h"
#include "world.h"

namespace {

std::string folder() {
  return test::scratch(std::string("written_text_") +
                       testing::UnitTest::GetInstance()->current_test_info()->name());
}

// Its name is the body's; it falls onto a floor, onto which it touches after some steps.
dfm_world world_of(dfm_context *context, const std::string &name, const std::string &model_keys) {
  const std::string path = folder() + "/made.json";
  test::write_file(path, R"({"format": "deform-scene", "version": 1, "time": {"duration": 1, "step": 0.001},
    "obstacles": [{"name": "floor", "shape": "plane"}], "bodies": [{"name": ")" +
                             name + R"(", "mesh": {"make": "beam", "size": [0.1, 0.1, 0.1], "cells": 60},
      "pose": {"position": [0, 0, 0.0005]}, )" +
                             model_keys + "}]}");
  dfm_world out = 0;
  EXPECT_EQ(dfm_scene_load(context, path.c_str(), &out), DFM_OK) << dfm_last_error();
  for (int i = 0; i < 30; ++i) test::ok(dfm_world_step(out, 1e-3, nullptr));
  return out;
}

std::string plan_of(dfm_world world) {
  size_t bytes = 0;
  test::ok(dfm_world_explain(world, nullptr, &bytes));
  std::string out(bytes, 0);
  test::ok(dfm_world_explain(world, out.data(), &bytes));
  return out;
}

dfm_status write(dfm_world world, const std::string &path) {
  dfm_scene_write_def def = dfm_scene_write_def_default();
  def.flags = DFM_SCENE_PARTIAL;
  return dfm_world_write_scene(world, path.c_str(), &def, nullptr);
}

}  // namespace

// A program that shows numbers with a decimal comma reads and writes the same files and sentences.
TEST(WrittenText, Locale_HasNoInfluence) {
  const std::string source = folder() + "/source";
  test::write_file(source,
                   "LC_NUMERIC\ndecimal_point \",\"\nthousands_sep \".\"\ngrouping 3\nEND LC_NUMERIC\n");
  const std::string make =
      "localedef -c -i '" + source + "' -f ANSI_X3.4-1968 '" + folder() + "/xx_XX' >/dev/null 2>&1";
  const int made = std::system(make.c_str());
  const test::Context context;
  const dfm_world world = world_of(context, "b", R"("model": {"type": "msm"})");
  const std::string under = folder() + "/again", large = under + "/large.json";
  std::filesystem::create_directories(under);
  test::write_file(large, R"({"format": "deform-scene", "version": 1, "time": {"duration": 1.5e400}})");
  const auto texts = [&] {
    test::ok(write(world, under + "/made.json"));
    std::string out = plan_of(world) + test::read_file(under + "/made.json") +
                      test::read_file(under + "/made_files/b_start.csv");
    dfm_world back = 0, none = 0;
    EXPECT_EQ(dfm_scene_load(context, (under + "/made.json").c_str(), &back), DFM_OK) << dfm_last_error();
    out += plan_of(back);
    EXPECT_EQ(dfm_scene_load(context, large.c_str(), &none), DFM_E_FORMAT);
    out += dfm_last_error();
    dfm_obstacle floor = 0;
    test::ok(dfm_world_find_obstacle(back, "floor", &floor));
    const dfm_pose far = {{0, 0, -1e5}, {0, 0, 0, 1}};
    test::ok(dfm_obstacle_move_to(floor, &far));
    EXPECT_EQ(dfm_world_step(back, 1e-3, nullptr), DFM_E_ARG);
    out += dfm_last_error();
    dfm_world_destroy(back);
    return out;
  };
  const std::string here = texts();
  setenv("LOCPATH", folder().c_str(), 1);
  const char *const set = std::setlocale(LC_NUMERIC, "xx_XX");
  unsetenv("LOCPATH");
  ASSERT_NE(set, nullptr) << "localedef has made no locale with a comma: " << made;
  const std::string there = texts();
  std::setlocale(LC_NUMERIC, "C");
  EXPECT_TRUE(here == there) << there;
  for (const char *sentence : {"the number 1.5e400 is too large", "in a step of 0.001 s"})
    EXPECT_NE(here.find(sentence), std::string::npos) << here;
}

// Names of a host that are not UTF-8, which JSON has to be.
TEST(WrittenText, NameInAnotherEncoding_IsRefusedInAScene) {
  const test::Context context;
  const dfm_world_def plain = dfm_world_def_default();
  dfm_world world = 0;
  test::ok(dfm_world_create(context, &plain, &world));
  const test::Tet odd("K\xf6rper");
  dfm_body body = 0;
  test::ok(dfm_body_create(world, &odd.def, &body));
  EXPECT_EQ(write(world, folder() + "/odd.json"), DFM_E_ARG);
  test::says({"'K?rper' cannot be used in a scene: a name has 1 to 100 bytes of UTF-8"});
  EXPECT_NE(plan_of(world).find("{\"name\":\"K?rper\""), std::string::npos) << plan_of(world);
  // longer than it need be, half of a pair of UTF-16, beyond U+10FFFF
  for (const char *bytes : {"\xe0\x80\x80", "\xed\xa0\x80", "\xf0\x80\x80\x80", "\xf4\x90\x80\x80"}) {
    dfm_world other = 0;
    test::ok(dfm_world_create(context, &plain, &other));
    const test::Tet tet(bytes);
    test::ok(dfm_body_create(other, &tet.def, &body));
    EXPECT_EQ(write(other, folder() + "/odd.json"), DFM_E_ARG);
    test::says({"cannot be used in a scene"});
    EXPECT_NE(plan_of(other).find("{\"name\":\"??"), std::string::npos) << plan_of(other);
  }

  // so for the group of a surface that a rule names
  test::write_file(folder() + "/odd.msh",
                   "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"gr\xfcn\"\n"
                   "$EndPhysicalNames\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
                   "$Elements\n2\n1 2 2 1 1 1 2 3\n2 4 2 0 1 1 2 3 4\n$EndElements\n");
  test::write_file(folder() + "/odd.json", R"({"format": "deform-scene", "version": 1,
    "time": {"duration": 1}, "bodies": [{"name": "b", "mesh": "odd.msh"}]})");
  dfm_world grouped = 0;
  ASSERT_EQ(dfm_scene_load(context, (folder() + "/odd.json").c_str(), &grouped), DFM_OK) << dfm_last_error();
  dfm_friction_def rule{};
  rule.size = sizeof rule;
  rule.between[0] = "b:gr\xfcn";
  rule.between[1] = "*";
  rule.law = "coulomb";
  test::ok(dfm_world_add_friction(grouped, &rule));
  EXPECT_EQ(write(grouped, folder() + "/again.json"), DFM_E_ARG);
  test::says({"the name of this file, or of a group of a surface, is not UTF-8"});
  // and for the file, whose folder is named within it
  const dfm_world fine = world_of(context, "b", R"("model": {"type": "msm"})");
  EXPECT_EQ(write(fine, folder() + "/gr\xfcn.json"), DFM_E_ARG);
  test::says({"the name of this file, or of a group of a surface, is not UTF-8"});
}

// What the library chooses for one model of a rule is no matter of the one that is in use.
TEST(WrittenText, RuleThatLeavesAnIntegratorOpen_KeepsItOpen) {
  const test::Context context;
  for (const bool open : {true, false}) {
    const dfm_world world =
        world_of(context, "b",
                 std::string(R"("model": {"type": "msm"}, "switch": {"wait": 0.5, "touching": {
          "type": "corotational_fem", "integrator": "implicit_euler"}, "far": {"type": "msm")") +
                     (open ? "}}" : R"(, "integrator": "tr_bdf2"}})"));
    const std::string path = folder() + "/later.json";
    test::ok(write(world, path));
    const std::string later = test::read_file(path);
    const size_t first = later.find("implicit_euler");
    ASSERT_NE(first, std::string::npos) << later;
    EXPECT_EQ(later.find("implicit_euler", first + 1) == std::string::npos, open) << later;
    dfm_world again = 0;
    EXPECT_EQ(dfm_scene_load(context, path.c_str(), &again), DFM_OK) << dfm_last_error();
  }
}
