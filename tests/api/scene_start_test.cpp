// The key `start` of a scene's bodies: where each kind puts the points, what stays as it was, and what is
// refused.
#include <unistd.h>

#include <algorithm>

#include "opened.h"

namespace {

// Two bodies of one mesh and pose: "rested" begins at rest, "other" as `start` says.
std::string scene(const std::string &start, const std::string &further = "") {
  const std::string body = R"("mesh": {"make": "beam", "size": [0.2, 0.1, 0.06], "cells": 60},
    "pose": {"position": [0.3, -0.2, 0.5], "rotation": {"axis": [0, 0, 1], "angle_deg": 90}, "scale": 2},
    "velocity": [0.1, 0, 0], "spin": [0, 0, 3])";
  return R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.001},
    "bodies": [{"name": "rested", )" +
         body + "}, {\"name\": \"other\", " + body + ", \"start\": " + start + further +
         R"(}], "contact": {"filter": [{"between": ["*", "*"], "collide": false}]}})";
}

struct Opened : test::Opened {
  explicit Opened(const std::string &text, uint64_t jitter = 0)
      : test::Opened(
            test::written(test::scratch("scene_start_" + std::to_string(getpid())) + "/scene.json", text),
            jitter) {}
  dfm_body body(const char *name) const {
    dfm_body out = 0;
    test::ok(dfm_world_find_body(world, name, &out));
    return out;
  }
  // positions, then velocities
  std::array<std::vector<double>, 2> state(const char *name) const {
    uint32_t n = 0;
    test::ok(dfm_body_get_state(body(name), 0, nullptr, nullptr, &n));
    std::array<std::vector<double>, 2> out{std::vector<double>(3 * size_t(n)),
                                           std::vector<double>(3 * size_t(n))};
    test::ok(dfm_body_get_state(body(name), n, out[0].data(), out[1].data(), &n));
    return out;
  }
};

// The box of the rest positions: 0.4 x 0.2 x 0.12 m turned by 90 degrees about z.
constexpr double kCenter[3] = {0.3 - 0.1, -0.2 + 0.2, 0.5 + 0.06}, kHalf[3] = {0.1, 0.2, 0.06};

struct Flat {
  const char *onto;
  bool keeps[3];  // world axes
};

}  // namespace

TEST(SceneStart, Flattened_LiesOnThePlaneLineOrPointOfItsFrame) {
  for (const Flat &flat : {Flat{"plane", {true, true, false}}, Flat{"line", {false, true, false}},
                           Flat{"point", {false, false, false}}}) {
    const Opened s(scene(std::string(R"({"flatten": ")") + flat.onto + "\"}"));
    ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
    const auto rest = s.state("rested")[0], x = s.state("other")[0];
    for (size_t i = 0; i < x.size(); ++i)
      ASSERT_NEAR(x[i], flat.keeps[i % 3] ? rest[i] : kCenter[i % 3], 1e-15) << flat.onto;
  }
}

TEST(SceneStart, RotationOfAPlane_TurnsItsNormal) {
  for (const auto &[degrees, expected] :
       {std::pair<const char *, std::array<double, 3>>{"0", {1, 0, 0}}, {"90", {0, 1, 0}}}) {
    const Opened s(std::string(R"({"format": "deform-scene", "version": 1, "time": {"duration": 1},
      "obstacles": [{"name": "wall", "shape": "plane", "normal": [1, 0, 0], "point": [-1, 0, 0],
                     "start": {"rotation": {"axis": [0, 0, 1], "angle_deg": )") +
                   degrees + "}}}]}");
    ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
    dfm_obstacle wall = 0;
    dfm_pose pose{};
    test::ok(dfm_world_find_obstacle(s.world, "wall", &wall));
    test::ok(dfm_obstacle_get_pose(wall, &pose));
    const auto [x, y, z, w] = pose.rotation;
    const double normal[3] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(normal[k], expected[k], 1e-15) << degrees;
  }
}

TEST(SceneStart, Inverted_HasTheNegativeVolume) {
  const Opened s(scene(R"({"invert": true})"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  const auto rest = s.state("rested")[0], x = s.state("other")[0];
  for (size_t i = 0; i < x.size(); ++i) ASSERT_NEAR(x[i], 2 * kCenter[i % 3] - rest[i], 1e-15);
  const dfm_body_measure m = test::measure(s.body("other"));
  EXPECT_NEAR(m.volume, -m.rest_volume, 1e-15);
  dfm_body_info info{};
  info.size = sizeof info;
  test::ok(dfm_body_get_info(s.body("other"), &info));
  EXPECT_EQ(m.inverted, info.ntet);
}

TEST(SceneStart, InvertFalse_IsRest) {
  const Opened s(scene(R"({"invert": false})"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  EXPECT_EQ(s.state("rested"), s.state("other"));
}

// Every point on its own, all over the box and within it; velocities are those of the body at rest.
TEST(SceneStart, Scrambled_FillsTheBoxAndIsRepeatable) {
  const Opened s(scene(R"({"scramble": 7})")), again(scene(R"({"scramble": 7})")),
      other(scene(R"({"scramble": 8})"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  const auto x = s.state("other"), rest = s.state("rested");
  EXPECT_EQ(x, again.state("other"));
  EXPECT_NE(x[0], other.state("other")[0]);
  EXPECT_EQ(x[1], rest[1]);
  double least[3] = {1, 1, 1}, most[3] = {-1, -1, -1};
  size_t moved = 0;
  for (size_t i = 0; i < x[0].size(); ++i) {
    const double at = (x[0][i] - kCenter[i % 3]) / kHalf[i % 3];
    ASSERT_LE(std::fabs(at), 1 + 1e-12);
    least[i % 3] = std::min(least[i % 3], at);
    most[i % 3] = std::max(most[i % 3], at);
    moved += x[0][i] != rest[0][i];
  }
  EXPECT_EQ(moved, x[0].size());
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(least[k], -0.5);
    EXPECT_GT(most[k], 0.5);
  }
}

TEST(SceneStart, HeldPoints_StayWhereTheyAre) {
  const Opened s(
      scene(R"({"flatten": "point"})", R"(, "fix": [{"box": [[-1, -1, -1], [0.001, 1, 1]], "axes": "z"}])"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  const auto rest = s.state("rested")[0], x = s.state("other")[0];
  size_t held = 0;
  for (size_t i = 0; i < x.size(); i += 3) {
    ASSERT_NEAR(x[i], kCenter[0], 1e-15);
    held += x[i + 2] == rest[i + 2] && rest[i + 2] != kCenter[2];
  }
  EXPECT_GT(held, 4u);
}

TEST(SceneStart, Displacements_AreFromTheRestShapeAtItsPose) {
  const Opened s(scene(R"({"invert": true})"));
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  const std::vector<double> rest = s.state("rested")[0], x = s.state("other")[0];
  for (const double u : test::listed(dfm_debug_displacements, s.body("rested"), 3)) ASSERT_EQ(u, 0);
  const std::vector<double> u = test::listed(dfm_debug_displacements, s.body("other"), 3);
  ASSERT_EQ(u.size(), x.size());
  for (size_t i = 0; i < u.size(); ++i) ASSERT_NEAR(u[i], x[i] - rest[i], 1e-15);
  const std::vector<uint32_t> point = test::listed(dfm_surface_points, s.body("other"), 1);
  const std::vector<double> surface = test::listed(dfm_debug_surface_displacements, s.body("other"), 3);
  ASSERT_EQ(surface.size(), 3 * point.size());
  for (size_t i = 0; i < surface.size(); ++i) ASSERT_EQ(surface[i], u[3 * size_t(point[i / 3]) + i % 3]);
}

// A table of positions is a state of the body, not its rest: both files say how far it is from there.
TEST(SceneStart, NodesOfABodyThatStartsFromATable_HaveDisplacementsFromRest) {
  const std::string folder = test::scratch("scene_start_table_" + std::to_string(getpid()));
  const std::vector<double> rest = Opened(scene(R"({"invert": false})")).state("rested")[0];
  std::string table = "node,x,y,z,vx,vy,vz\n";
  for (size_t i = 0; i < rest.size(); i += 3) {
    char row[160];
    std::snprintf(row, sizeof row, "%zu,%.17g,%.17g,%.17g,0,0,0\n", i / 3, rest[i], rest[i + 1],
                  rest[i + 2] + 0.25);
    table += row;
  }
  test::write_file(folder + "/table.csv", table);
  test::write_file(folder + "/scene.json", scene(R"({"state": "table.csv"})"));
  const auto r = test::deform({"run", folder + "/scene.json", "--out", folder + "/out", "--quiet", "--time",
                               "1e-6", "--set", "/time/step=1e-6", "--set", R"(/output={"nodes": true})"});
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto rows = test::read_csv(folder + "/out/nodes/other.csv");
  ASSERT_EQ(rows.size(), 1 + rest.size() / 3);
  for (size_t i = 1; i < rows.size(); ++i)
    for (size_t k = 0; k < 3; ++k) ASSERT_NEAR(std::stod(rows[i][1 + k]), k == 2 ? 0.25 : 0, 1e-9);
}

// Files of meshers have them: centers of arcs, points of the geometry.
TEST(SceneStart, NodesWithoutCells_MayHaveARow) {
  const std::string folder = test::scratch("scene_start_table_" + std::to_string(getpid()));
  test::write_file(folder + "/mesh.msh",
                   "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 9 9 9\n3 1 0 0\n4 0 1 0\n"
                   "5 0 0 1\n$EndNodes\n$Elements\n1\n1 4 2 0 0 1 3 4 5\n$EndElements\n");
  test::write_file(folder + "/table.csv",
                   "node,x,y,z,vx,vy,vz\n0,0,0,2,0,0,0\n1,9,9,9,0,0,0\n2,1,0,2,0,0,0\n3,0,1,2,0,0,0\n"
                   "4,0,0,3,0,0,0\n");
  const Opened s(R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.01, "step": 0.001},
    "bodies": [{"name": "other", "mesh": ")" +
                 folder + R"(/mesh.msh", "start": {"state": ")" + folder + R"(/table.csv"}}]})");
  ASSERT_EQ(s.status, DFM_OK) << dfm_last_error();
  EXPECT_EQ(s.state("other")[0], (std::vector<double>{0, 0, 2, 1, 0, 2, 0, 1, 2, 0, 0, 3}));
}

TEST(SceneStart, Jitter_MovesTheChangedBodyToo) {
  const Opened still(scene(R"({"flatten": "point"})")), moved(scene(R"({"flatten": "point"})"), 3);
  ASSERT_EQ(moved.status, DFM_OK) << dfm_last_error();
  EXPECT_NE(still.state("other")[0], moved.state("other")[0]);
}

// A state as a whole, but for one whose points a motion places.
TEST(SceneStart, Jitter_MovesStates) {
  const std::vector<double> rest = Opened(scene(R"({"invert": false})")).state("rested")[0];
  std::string table = "node,x,y,z,vx,vy,vz\n";
  for (size_t i = 0; i < rest.size(); i += 3) {
    char row[160];
    std::snprintf(row, sizeof row, "%zu,%.17g,%.17g,%.17g,%.17g,0,0\n", i / 3, rest[i], rest[i + 1],
                  rest[i + 2] + 0.25, 1 + rest[i + 1]);
    table += row;
  }
  test::write_file(test::scratch("scene_start_" + std::to_string(getpid())) + "/table.csv", table);
  std::string free = scene(R"({"state": "table.csv"})");
  const std::string led = scene(R"({"state": "table.csv"})", R"(, "fix": [{"points": [0], "motion":
    {"keyframes": [{"t": 0, "position": [0, 0, 0]}, {"t": 1, "position": [0, 0, 1]}]}}])");
  free.insert(free.rfind('}'), R"(, "rigid": {"bodies": [{"name": "ball", "shape": "sphere", "radius": 0.1,
    "mass": 1, "start": {"position": [0, 0, 9], "velocity": [1, 0, 0], "spin": [0, 2, 0]}}]})");
  const Opened still(free), moved(free, 1), other(free, 2), led_still(led), led_moved(led, 1);
  ASSERT_EQ(moved.status, DFM_OK) << dfm_last_error();
  ASSERT_EQ(led_moved.status, DFM_OK) << dfm_last_error();
  EXPECT_EQ(led_moved.state("other"), led_still.state("other"));
  EXPECT_NE(moved.state("other"), other.state("other"));
  const auto [x, v] = still.state("other");
  const auto [y, u] = moved.state("other");
  const auto apart = [](const std::vector<double> &of, size_t i) {
    return std::hypot(of[3 * i] - of[0], of[3 * i + 1] - of[1], of[3 * i + 2] - of[2]);
  };
  double most = 0;
  for (size_t i = 0; i < x.size() / 3; ++i) {
    ASSERT_NEAR(apart(y, i), apart(x, i), 1e-14) << i;
    ASSERT_NEAR(std::hypot(u[3 * i], u[3 * i + 1], u[3 * i + 2]) / v[3 * i], u[0] / v[0], 1e-4) << i;
    for (size_t k = 0; k < 3; ++k) most = std::max(most, std::fabs(y[3 * i + k] - x[3 * i + k]));
  }
  EXPECT_GT(most, 1e-5);
  EXPECT_LT(most, 5e-3);
  dfm_rigid_state balls[2] = {};
  for (const Opened *s : {&still, &moved})
    test::ok(dfm_rigid_get_state(test::listed(dfm_world_rigids, s->world)[0], &balls[s == &moved]));
  EXPECT_NE(balls[0].position[2], balls[1].position[2]);
  EXPECT_NEAR(balls[0].position[2], balls[1].position[2], 1e-3);
  EXPECT_NE(balls[0].velocity[0], balls[1].velocity[0]);
}

TEST(SceneStart, Mistakes_AreRefusedWithTheirPlace) {
  const std::pair<const char *, std::vector<const char *>> cases[] = {
      {"{}", {"/bodies/1/start", "scramble", "flatten", "invert"}},
      {R"({"invert": true, "scramble": 1})", {"/bodies/1/start", "one of"}},
      {R"({"scramble": -1})", {"/bodies/1/start/scramble", "whole number"}},
      {R"({"scramble": 1.5})", {"/bodies/1/start/scramble", "whole number"}},
      {R"({"flatten": "plain"})", {"/bodies/1/start/flatten", "plane"}},
      {R"({"invert": 1})", {"/bodies/1/start/invert"}},
      {R"({"scrambel": 1})", {"/bodies/1/start", "scramble"}},
      {"true", {"/bodies/1/start"}}};
  for (const auto &[start, parts] : cases) {
    const Opened s(scene(start));
    EXPECT_LT(s.status, 0) << start;
    for (const char *part : parts) test::says({part});
  }
}

// Overlaps that the start asks for are no error; overlaps that remain at its end are.
TEST(SceneStart, InsideOut_IsWarnedOfWhereItLasts) {
  const std::string folder = test::scratch("scene_start_run_" + std::to_string(getpid()));
  test::write_file(folder + "/scene.json",
                   R"({"format": "deform-scene", "version": 1, "gravity": [0, 0, 0],
    "time": {"duration": 0.1, "step": 0.005, "integrator": "implicit_euler"},
    "bodies": [{"name": "block", "mesh": {"make": "beam", "size": [0.2, 0.1, 0.1], "cells": 60},
                "model": {"type": "corotational_fem"}, "start": {"invert": true}}]})");
  const auto log = [&](const char *step, const char *end) {
    const test::CommandResult r =
        test::deform({"run", folder + "/scene.json", "--set", std::string("/time/step=") + step, "--time",
                      end, "--out", folder + "/out"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return test::read_file(folder + "/out/summary.json");
  };
  const std::string soon = log("1e-6", "1e-5"), late = log("0.005", "0.1");
  EXPECT_NE(soon.find(R"(72 cells inverted by \"start\" are still inverted)"), std::string::npos) << soon;
  EXPECT_EQ(late.find("are still inverted"), std::string::npos) << late;
  EXPECT_EQ(late.find("crosses itself"), std::string::npos) << late;
}

// A sheet whose triangles face down does not carry what falls on it; the file looks the same in a picture.
TEST(SceneStart, BodyAboveTheBackOfAnOpenMesh_IsWarnedOf) {
  const std::string folder = test::scratch("scene_start_back_" + std::to_string(getpid()));
  const std::string points = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
  test::write_file(folder + "/up.obj", points + "f 1 2 3\nf 1 3 4\n");
  test::write_file(folder + "/down.obj", points + "f 1 3 2\nf 1 4 3\n");
  const auto log = [&](const std::string &mesh, double height, const char *turn = "0") {
    test::write_file(folder + "/scene.json",
                     R"({"format": "deform-scene", "version": 1, "time": {"duration": 1e-6, "step": 1e-6},
    "bodies": [{"name": "brick", "mesh": {"make": "beam", "size": [0.2, 0.1, 0.1], "cells": 60},
                "pose": {"position": [0.3, 0, )" +
                         std::to_string(height) + R"(]}}],
    "obstacles": [{"name": "tray", "shape": "mesh", "mesh": ")" +
                         mesh + R"(", "pose": {"rotation": {"axis": [1, 0, 0], "angle_deg": )" + turn +
                         "}}}]}");
    return test::deform({"run", folder + "/scene.json", "--out", folder + "/out"}).err;
  };
  EXPECT_NE(log("down.obj", 1).find("body 'brick' would fall on the back of obstacle 'tray'"),
            std::string::npos);
  EXPECT_NE(log("up.obj", 1, "180").find("on the back of obstacle"), std::string::npos);
  EXPECT_EQ(log("down.obj", 1, "180").find("on the back of obstacle"), std::string::npos);
  EXPECT_EQ(log("up.obj", 1).find("on the back of obstacle"), std::string::npos);
  EXPECT_EQ(log("down.obj", -1).find("on the back of obstacle"), std::string::npos) << "it falls away";
}

// A sheet of a hundred cells needs fifty times as many, which is slow for no visible reason.
TEST(SceneStart, ThinSheetOfManyMoreCellsThanAskedFor_IsWarnedOf) {
  const std::string folder = test::scratch("scene_start_sheet_" + std::to_string(getpid()));
  const auto log = [&](const char *size, const char *cells) {
    test::write_file(folder + "/scene.json",
                     std::string(R"({"format": "deform-scene", "version": 1, "time": {"duration": 1e-6},
    "bodies": [{"name": "sheet", "mesh": {"make": "beam", "size": )") +
                         size + R"(, "cells": )" + cells + "}}]}");
    const test::CommandResult r = test::deform({"run", folder + "/scene.json", "--out", folder + "/out"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return r.err;
  };
  const std::string thin = log("[0.4, 0.4, 0.01]", "100");
  EXPECT_NE(thin.find("body 'sheet': its beam has 4800 cells, not about 100"), std::string::npos) << thin;
  EXPECT_EQ(log("[0.4, 0.4, 0.01]", "4000").find("not about"), std::string::npos);
  EXPECT_EQ(log("[0.4, 0.4, 0.04]", "100").find("not about"), std::string::npos) << "300 are as good as 100";
}

// In 1/60 s a thing falls 1.4 mm, which is long for a body of 0.1 mm; explicit bodies take sub-steps anyway.
TEST(SceneStart, BodyThatFallsThroughItsSizeInAStep_IsWarnedOf) {
  const std::string folder = test::scratch("scene_start_small_" + std::to_string(getpid()));
  const auto log = [&](const char *radius, const char *time, const char *more = "") {
    test::write_file(folder + "/scene.json",
                     std::string(R"({"format": "deform-scene", "version": 1, "time": {"duration": 1, )") +
                         time + R"(}, "bodies": [{"name": "grain", "mesh": {"make": "ball", "radius": )" +
                         radius + R"(, "cells": 160}, "pose": {"position": [0, 0, 1]})" + more +
                         R"(}], "obstacles": [{"name": "floor", "shape": "plane"}]})");
    const test::CommandResult r = test::deform({"explain", folder + "/scene.json"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return r.err;
  };
  const char *const frame = R"("step": 0.0166666667, "integrator": "implicit_euler")";
  const std::string said = log("1e-4", frame);
  EXPECT_NE(said.find("body 'grain' is 0.000"), std::string::npos) << said;
  EXPECT_NE(said.find("falls 0.00136 m in a step of 0.0167 s"), std::string::npos) << said;
  for (const std::string &quiet :
       {log("1e-2", frame), log("1e-4", R"("step": 0.001, "integrator": "implicit_euler")"),
        log("1e-4", R"("step": 0.0166666667, "integrator": "symplectic_euler")"),
        log("1e-4", R"("integrator": "implicit_euler")"),
        log("1e-4", frame, R"(, "fix": [{"box": [[-1, -1, -1], [1, 1, 2]]}])")})
    EXPECT_EQ(quiet.find("in a step of"), std::string::npos) << quiet;
}

// A mesh in millimeters that is read as meters, and the same with its scale.
TEST(SceneStart, OwnWeightAboveHalfTheModulus_IsWarnedOf) {
  const std::string folder = test::scratch("scene_start_weight_" + std::to_string(getpid()));
  const auto log = [&](const char *scale, const char *more = "\"model\": {\"type\": \"msm\"}") {
    test::write_file(
        folder + "/scene.json",
        std::string(R"({"format": "deform-scene", "version": 1, "time": {"duration": 1e-6, "step": 1e-6},
    "bodies": [{"name": "brick", "mesh": {"make": "beam", "size": [50, 30, 20], "cells": 60}, )") +
            more + R"(, "pose": {"position": [0, 0, 1], "scale": )" + scale + "}}]}");
    const test::CommandResult r = test::deform({"run", folder + "/scene.json", "--out", folder + "/out"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    return r.err;
  };
  EXPECT_NE(
      log("1").find("body 'brick' is 20 m high, and the pressure of its own weight (density x gravity x "
                    "height = 1.96e+05 Pa)"),
      std::string::npos);
  EXPECT_EQ(log("0.001").find("own weight"), std::string::npos);
  EXPECT_EQ(log("1", "\"model\": {\"type\": \"shape_matching\"}").find("own weight"), std::string::npos);
}
