// Netgen's files beside cube_netgen.vol, which MeshRead compares with the other dialects: second order, and
// damage. That Netgen has these orders of nodes was seen in files that it wrote (6.2.2608).
#include <gtest/gtest.h>

#include <map>

#include "deform/plugin.h"
#include "mesh/cells.h"
#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

const std::string kHead = "mesh3d\ndimension\n3\ngeomtype\n0\n";
const std::string kPoints = "points\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const std::string kOne = "volumeelements\n1\n 1 4 1 3 2 4\n", kEnd = "endmesh\n";
// after the corners the middles of 01 02 03 12 13 23
const std::string kTen =
    "points\n10\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n.5 0 0\n0 .5 0\n0 0 .5\n.5 .5 0\n.5 0 .5\n0 .5 .5\n";

RawMesh parse(const std::string &text) {
  return parse_raw(Memory::standard(), "a.vol", text.data(), text.size());
}

}  // namespace

TEST(Netgen, SecondOrderCells_HaveTheirMiddlesWhereTheyBelong) {
  const RestMesh mesh =
      finish_mesh("a.vol", parse(kHead + "volumeelements\n1\n1 10 1 3 2 4 6 5 7 8 10 9\n" + kTen + kEnd));
  ASSERT_EQ(mesh.cell, DFM_CELL_TET10);
  EXPECT_EQ(mesh.turned, 0u);
  const uint32_t ends[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  for (size_t m = 0; m < 6; ++m)
    for (size_t k = 0; k < 3; ++k) {
      const auto at = [&](size_t node) { return mesh.points[3 * size_t(mesh.cells[node]) + k]; };
      EXPECT_EQ(at(4 + m), (at(ends[m][0]) + at(ends[m][1])) / 2) << m;
    }
  // middles of 12 02 01
  const RawMesh skin = parse(kHead + "surfaceelements\n1\n 5 7 1 0 6 1 2 3 8 6 5\n" + kTen + kEnd);
  ASSERT_EQ(skin.ntri(), 4u);
  for (size_t t = 0; t < 4; ++t) {
    const auto at = [&](size_t c) { return load3(&skin.points[3 * size_t(skin.tris[3 * t + c])]); };
    EXPECT_NEAR(cross(at(1) - at(0), at(2) - at(0)).z, 0.25, 1e-15) << t;
  }
}

TEST(Netgen, SectionsInAnyOrderAndOthersBetween_AreTheSameMesh) {
  const std::string other = "edgesegmentsgi2\n1\n1 0 1 2 -1 -1 0 0 1 0 1 1\n",
                    names = "materials\n1\n1\tthe core \n";
  for (const std::string &text : {kHead + kOne + other + kPoints + names + kEnd + "csgsurfaces 0\n",
                                  "# by hand\r\n" + kHead + other + kPoints + kOne + names + kEnd}) {
    const RestMesh mesh = finish_mesh("a.vol", parse(text));
    EXPECT_EQ(mesh.ntet(), 1u);
    ASSERT_EQ(mesh.groups.size(), 1u);
    EXPECT_EQ(mesh.groups[0].name, "the core");
  }
}

TEST(Netgen, GroupsOfOneName_AreOne) {
  const std::string names = "bcnames\n5\n1 side\n2 default\n3 side\n4 none\n5\n";
  const RestMesh mesh = finish_mesh(
      "a.vol", parse(kHead + "surfaceelements\n4\n1 3 1 0 3 1 3 2\n1 2 1 0 3 1 2 4\n1 1 1 0 3 1 4 3\n" +
                     "1 5 1 0 3 2 3 4\n" + kOne + kPoints + names + kEnd));
  std::map<std::string, size_t> points;
  for (const MeshGroup &group : mesh.groups)
    points[group.name + "/" + std::to_string(group.dimension)] = group.points.size();
  EXPECT_EQ(points, (std::map<std::string, size_t>{{"side/2", 4}, {"2/2", 3}, {"5/2", 3}, {"1/3", 4}}));
  std::map<std::string, int> triangles;
  for (const uint32_t group : mesh.tri_group) ++triangles[mesh.groups[group].name];
  EXPECT_EQ(triangles, (std::map<std::string, int>{{"side", 2}, {"2", 1}, {"5", 1}}));
}

TEST(Netgen, Damage_IsRefusedInASentence) {
  const struct {
    std::string text;
    dfm_status status;
    std::vector<std::string> words;
  } rows[] = {
      {"mesh2d\n", DFM_E_FORMAT, {"a.vol:1", "mesh3d"}},
      {"mesh3d\ndimension\n2\n", DFM_E_UNSUPPORTED, {"a.vol:3", "dimension 2"}},
      {kHead + kOne + kPoints, DFM_E_FORMAT, {"endmesh", "truncated"}},
      {kHead + kOne + kPoints + kPoints + kEnd, DFM_E_FORMAT, {"second section of points"}},
      {kHead + kOne + kEnd, DFM_E_FORMAT, {"point 4", "points 1 to 0"}},
      {kHead + "volumeelements\n1\n1 4 1 2 3 5\n" + kPoints + kEnd,
       DFM_E_FORMAT,
       {"point 5", "points 1 to 4"}},
      {kHead + "volumeelements\n1\n1 4 0 2 3 4\n" + kPoints + kEnd, DFM_E_FORMAT, {"a.vol:8", "point 0"}},
      {kHead + "volumeelements\n1\n1 6 1 2 3 4 5 6\n", DFM_E_UNSUPPORTED, {"6 points", "tetrahedra"}},
      {kHead + "surfaceelements\n1\n1 1 1 0 8 1 2 3 4 5 6 7 8\n", DFM_E_UNSUPPORTED, {"8 points"}},
      {kHead + "volumeelements\n1\n9000000000 4 1 2 3 4\n", DFM_E_FORMAT, {"32 bits"}},
      {kHead + "volumeelements\n10000000000\n1 4 1 2 3 4\n", DFM_E_FORMAT, {"10000000000 elements"}},
      {kHead + "points\n10000000000\n0 0 0\n", DFM_E_FORMAT, {"10000000000 points"}},
      {kHead + kOne + kPoints + "materials\n10000000000\n1 a\n", DFM_E_FORMAT, {"10000000000 names"}},
      {kHead + kOne + "points\n4\n0 0 0\n1 0 nan\n0 1 0\n0 0 1\n", DFM_E_FORMAT, {"a.vol:12", "'nan'"}}};
  for (const auto &row : rows) test::expect_refusal("a.vol", row.text, row.status, row.words);
}
