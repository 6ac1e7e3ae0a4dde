// A scene whose body is an Abaqus file: node sets hold and load it, sections give its materials. The same
// mesh as MSH moves alike.
#include <gtest/gtest.h>

#include <cmath>

#include "deform/deform.h"
#include "support.h"
#include "world.h"

namespace {

// A bar of 4 x 1 x 1 hexahedra along x: sets of its two ends, sections of its two halves.
std::string bar() {
  std::string out = "*HEADING\n*NODE\n";
  const auto node = [](int i, int j, int k) { return 1 + i + 5 * (j + 2 * k); };
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 5; ++i)
        out += std::to_string(node(i, j, k)) + ", " + std::to_string(0.05 * i) + ", " +
               std::to_string(0.05 * j) + ", " + std::to_string(0.05 * k) + "\n";
  out += "*ELEMENT, TYPE=C3D8R, ELSET=bar\n";
  for (int i = 0; i < 4; ++i) {
    out += std::to_string(i + 1);
    for (int k = 0; k < 2; ++k)
      for (const auto &[di, j] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}})
        out += ", " + std::to_string(node(i + di, j, k));
    out += "\n";
  }
  return out +
         "*NSET, NSET=Wall, GENERATE\n1, 16, 5\n*NSET, NSET=Tip\n5, 10, 15, 20\n*ELSET, ELSET=stiff\n1, 2\n"
         "*ELSET, ELSET=soft\n3, 4\n*SOLID SECTION, ELSET=stiff, MATERIAL=a\n"
         "*SOLID SECTION, ELSET=soft, MATERIAL=b\n*STEP\n*STATIC\n*BOUNDARY\nWall, 1, 3\n*END STEP\n";
}

std::string scene(const std::string &mesh, const std::string &more) {
  return R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"duration": 0.05, "step": 0.001},
    "materials": {"a": {"density": 1000, "young": 1e6}, "b": {"density": 1000, "young": 2e5}},
    "bodies": [{"name": "bar", "mesh": ")" +
         mesh + R"(", "material": "a", "model": {"type": "corotational_fem"},
      "fix": [{"group": "Wall"}], "forces": [{"group": "Tip", "total": [0, 0, -2]}])" +
         more + "}]}";
}

// The points after 0.05 s.
std::vector<double> moved(const std::string &path) {
  test::Context context;
  dfm_scene s = 0;
  dfm_world world = 0;
  dfm_body body = 0;
  test::ok(dfm_scene_open(context, path.c_str(), nullptr, &s));
  test::ok(dfm_scene_world(s, &world));
  test::ok(dfm_world_find_body(world, "bar", &body));
  for (int i = 0; i < 50; ++i) test::ok(dfm_world_step(world, 1e-3, nullptr));
  const std::vector<double> x = test::State(body).x;
  return x;
}

}  // namespace

TEST(AbaqusScene, SetsHoldAndLoadTheBody_AndConvertedFilesMoveAlike) {
  const std::string folder = test::scratch("abaqus_scene") + "/";
  test::write_file(folder + "bar.inp", bar());
  const std::string soft = R"(, "materials_by_group": {"soft": "b"})";
  test::write_file(folder + "all.json", scene("bar.inp", ""));
  test::write_file(folder + "inp.json", scene("bar.inp", soft));
  const std::vector<double> all = moved(folder + "all.json"), inp = moved(folder + "inp.json");
  ASSERT_EQ(inp.size(), 60u);
  double held = 0, tip = 0;
  for (size_t p = 0; p < 20; ++p) {
    if (p % 5 == 0) held += std::abs(inp[3 * p] - 0) + std::abs(inp[3 * p + 2] - (p < 10 ? 0 : 0.05));
    if (p % 5 == 4) tip += (inp[3 * p + 2] - (p < 10 ? 0 : 0.05)) / 4;
  }
  EXPECT_EQ(held, 0);
  EXPECT_LT(tip, -1e-4);
  EXPECT_NE(all, inp);
  for (const char *ending : {"msh", "msh2"}) {
    const std::string mesh = std::string("bar.") + ending;
    const auto r = test::deform({"mesh", "convert", folder + "bar.inp", folder + mesh});
    ASSERT_EQ(r.exit_code, 0) << r.err;
    test::write_file(folder + "msh.json", scene(mesh, soft));
    EXPECT_EQ(moved(folder + "msh.json"), inp) << ending;
  }
  const auto run = test::deform({"run", folder + "inp.json", "--quiet", "--out", folder + "out"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
}

// VTU has no groups of points: cells, their groups and the boundary are the same.
TEST(AbaqusScene, ConvertedToVtu_KeepsCellsAndTheirGroups) {
  const std::string folder = test::scratch("abaqus_convert") + "/";
  test::write_file(folder + "bar.inp", bar());
  const auto r = test::deform({"mesh", "convert", folder + "bar.inp", folder + "bar.vtu"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto info = test::deform({"mesh", "info", folder + "bar.vtu"});
  for (const char *word : {"cells             4 hexahedra", "volume            0.0005 m3",
                           "stiff (cells, 12 points)", "soft (cells, 12 points)"})
    EXPECT_NE(info.out.find(word), std::string::npos) << word << " not in\n" << info.out;
}
