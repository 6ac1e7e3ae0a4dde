// Abaqus, TetGen and Medit files of every kind of cell against the same mesh as MSH; sets, sections, parts;
// what is refused, and damage.
#include <gtest/gtest.h>

#include <functional>

#include "deform/plugin.h"
#include "mesh/cells.h"
#include "mesh/numbers.h"
#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

const Memory &kStandard = Memory::standard();
const std::string kFour = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n";
const std::string kTet = kFour + "*ELEMENT, TYPE=C3D4, ELSET=all\n7, 1, 2, 3, 4\n";

RestMesh parsed(const std::string &text) {
  return finish_mesh("a.inp", parse_raw(kStandard, "a.inp", text.data(), text.size()));
}

RestMesh made(uint32_t kind) {
  if (kind == DFM_CELL_HEX8) return make_bricks(kStandard, 0.3, 0.2, 0.2, 12);
  if (kind == DFM_CELL_HEX20) return test::of_twenty(second_order(made(DFM_CELL_HEX8)));
  const RestMesh beam = make_beam(kStandard, 0.3, 0.2, 0.2, 100);
  return kind == DFM_CELL_TET10 ? second_order(beam) : beam;
}

// The first half of the cells is the group "left".
RestMesh grouped(uint32_t kind) {
  RestMesh mesh = made(kind);
  const uint32_t tets = cell_kind(kind).tets;
  mesh.groups.push_back({"left", 3, 4, Array<uint32_t>()});
  for (uint32_t t = 0; t < mesh.ntet() / 2 / tets * tets; ++t) mesh.tet_group[t] = 0;
  return mesh;
}

std::string rows(size_t n, const std::function<std::string(size_t)> &row) {
  std::string out;
  for (size_t i = 0; i < n; ++i) out += row(i) + "\n";
  return out;
}
std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}
std::string point(const RestMesh &mesh, size_t p, const char *between) {
  std::string out;
  for (size_t k = 0; k < 3; ++k) out += between + number(mesh.points[3 * p + k]);
  return out;
}

// Numbers with gaps that fall; the nodes of a cell stand on two lines.
std::string abaqus(const RestMesh &mesh, const std::string &type) {
  const CellKind &kind = cell_kind(mesh.cell);
  const size_t n = mesh.nodes().size() / kind.nodes;
  const auto tag = [&](size_t p) { return std::to_string(10 + 3 * (mesh.npoint() - p)); };
  const auto element = [&](size_t c) { return std::to_string(5 * (n - c)); };
  std::string members;
  for (size_t c = 0; c < n / 2; ++c) members += element(c) + (c % 8 == 7 ? ",\n" : ",");
  return "*HEADING\n*NODE\n" + rows(mesh.npoint(), [&](size_t p) { return tag(p) + point(mesh, p, ", "); }) +
         "*ELEMENT, TYPE=" + type + ", ELSET=whole\n" +
         rows(n,
              [&](size_t c) {
                std::string out = element(c);
                for (size_t k = 0; k < kind.nodes; ++k)
                  out += (k % 16 == 3 ? ",\n " : ", ") + tag(mesh.nodes()[kind.nodes * c + k]);
                return out;
              }) +
         "*ELSET, ELSET=left\n" + members + "\n";
}

// place: of each of TetGen's nodes among ours
void write_tetgen(const RestMesh &mesh, const std::string &stem, size_t first) {
  constexpr uint32_t kPlace[10] = {0, 1, 2, 3, 9, 7, 4, 5, 8, 6};
  const CellKind &kind = cell_kind(mesh.cell);
  const size_t n = mesh.nodes().size() / kind.nodes;
  test::write_file(stem + ".node",
                   std::to_string(mesh.npoint()) + " 3 0 0\n" + rows(mesh.npoint(), [&](size_t p) {
                     return std::to_string(p + first) + point(mesh, p, " ");
                   }));
  test::write_file(stem + ".ele",
                   std::to_string(n) + " " + std::to_string(kind.nodes) + " 1\n" + rows(n, [&](size_t c) {
                     std::string out = std::to_string(c + first);
                     for (size_t k = 0; k < kind.nodes; ++k)
                       out += " " + std::to_string(mesh.nodes()[kind.nodes * c + kPlace[k]] + first);
                     return out + (c < n / 2 ? " 4" : " 0");
                   }));
}

void expect_same(const RestMesh &a, const RestMesh &b) {
  EXPECT_EQ(a.cell, b.cell);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.tets, b.tets);
  EXPECT_EQ(a.turned, 0u);
  EXPECT_TRUE(a.warnings.empty()) << a.warnings[0];
  const auto tags = [](const RestMesh &m, bool of_left) {
    std::vector<bool> out;
    for (const uint32_t g : m.tet_group)
      out.push_back(g != kNoGroup && of_left && m.groups[g].name != "whole");
    return out;
  };
  EXPECT_EQ(tags(a, true), tags(b, true));
}

const MeshGroup &group_of(const RestMesh &mesh, const std::string &name, int32_t dimension) {
  for (const MeshGroup &g : mesh.groups)
    if (g.name == name && g.dimension == dimension) return g;
  ADD_FAILURE() << "no group " << name;
  return mesh.groups.at(0);
}

using test::expect_refusal;

class MeshesOfEngineers : public testing::TestWithParam<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Kinds, MeshesOfEngineers,
                         testing::Values(DFM_CELL_TET, DFM_CELL_TET10, DFM_CELL_HEX8, DFM_CELL_HEX20),
                         [](const auto &of) {
                           const uint32_t nodes = cell_kind(of.param).nodes;
                           return (nodes == 4 || nodes == 10 ? "Tet" : "Hex") + std::to_string(nodes);
                         });

}  // namespace

TEST_P(MeshesOfEngineers, EveryFormat_GivesTheMeshThatMshGives) {
  const std::string folder = test::scratch("engineers");
  const RestMesh mesh = grouped(GetParam());
  write_mesh(mesh, folder + "/a.msh");
  const RestMesh msh = read_mesh(kStandard, folder + "/a.msh", DFM_MESH_CELLS);
  for (const char *more : {"", "H", "R", "MH"}) {
    const RestMesh back = parsed(abaqus(mesh, "C3D" + std::to_string(cell_kind(mesh.cell).nodes) + more));
    expect_same(back, msh);
    EXPECT_EQ(group_of(back, "left", 3).points, group_of(msh, "left", 3).points);
    EXPECT_EQ(group_of(back, "whole", 3).points.size(), back.npoint());
  }
  if (cell_kind(mesh.cell).medit) {
    write_mesh(mesh, folder + "/a.mesh");
    expect_same(read_mesh(kStandard, folder + "/a.mesh", DFM_MESH_CELLS), msh);
  }
  for (const size_t first : {0, 1, 5}) {
    if (mesh.cell != DFM_CELL_TET && mesh.cell != DFM_CELL_TET10) continue;
    write_tetgen(mesh, folder + "/t", first);
    for (const char *ending : {".ele", ".node"}) {
      const RestMesh back = read_mesh(kStandard, folder + "/t" + ending, DFM_MESH_CELLS);
      expect_same(back, msh);
      EXPECT_EQ(group_of(back, "4", 3).points, group_of(msh, "left", 3).points);
    }
  }
}

// Nodes of C3D10 as Abaqus numbers them: the middles of 12 23 13 14 24 34.
TEST(Abaqus, MiddlesOfEdges_LieOnThem) {
  const RestMesh mesh = parsed(
      "*NODE\n1, 0, 0, 0\n2, 2, 0, 0\n3, 0, 2, 0\n4, 0, 0, 2\n5, 1, 0, 0\n6, 1, 1, 0\n7, 0, 1, 0\n8, 0, 0, "
      "1\n"
      "9, 1, 0, 1\n10, 0, 1, 1\n*ELEMENT, TYPE=C3D10M\n1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10\n");
  ASSERT_EQ(mesh.cells.size(), 10u);
  EXPECT_EQ(mesh.turned, 0u);
  EXPECT_NEAR(mesh_statistics(mesh).volume, 8.0 / 6, 1e-14);
  const uint32_t edges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
  for (size_t e = 0; e < 6; ++e)
    for (size_t k = 0; k < 3; ++k)
      EXPECT_EQ(
          mesh.points[3 * mesh.cells[4 + e] + k],
          (mesh.points[3 * mesh.cells[edges[e][0]] + k] + mesh.points[3 * mesh.cells[edges[e][1]] + k]) / 2);
}

TEST(Abaqus, Sets_AreGroupsHoweverTheyAreWritten) {
  const RestMesh mesh = parsed(
      "*node, nset=ALL\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 1, 1, 1\n"
      "*Element, Type=C3D4\n 1, 1, 2, 3, 4\n 2, 2, 5, 3, 4\n*ELEMENT, TYPE=S3, ELSET=Face\n 3, 1, 3, 2\n"
      "*NSET, NSET=odd, GENERATE\n1, 5, 2\n*NSET, nset=Two\n1,\n2\n*NSET, NSET=both\nODD, two\n"
      "*NSET, NSET=both\n4\n*ELSET, ELSET=odd\n1, 3\n*ELSET, ELSET=\"with blank\", GENERATE\n2, "
      "1000000000000\n");
  const auto points = [&](const char *name, int32_t dimension) {
    return group_of(mesh, name, dimension).points;
  };
  EXPECT_EQ(points("ALL", 0), (Array<uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(points("odd", 0), (Array<uint32_t>{0, 2, 4}));
  EXPECT_EQ(points("Two", 0), (Array<uint32_t>{0, 1}));
  EXPECT_EQ(points("both", 0), (Array<uint32_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(points("odd", 3), (Array<uint32_t>{0, 1, 2, 3}));
  EXPECT_EQ(points("odd", 2), (Array<uint32_t>{0, 1, 2}));
  EXPECT_EQ(points("with blank", 3), (Array<uint32_t>{1, 2, 3, 4}));
  EXPECT_EQ(mesh.groups[mesh.tet_group[0]].name, "odd");
  EXPECT_EQ(mesh.groups[mesh.tet_group[1]].name, "with blank");
  EXPECT_EQ(mesh.tri_group.size(), 1u);  // in both sets, of the last of which it is
  EXPECT_TRUE(mesh.warnings.empty());
}

TEST(Abaqus, BlankOrMissingCoordinate_IsZero) {
  const RestMesh mesh = parsed(
      "*NODE\n1, 0, , 0\n2, 1.\n3, 0, 1,\n4, , , 1, 0., 0., 1.\n"
      "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4\n");
  EXPECT_EQ(mesh.points, (Array<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

TEST(Abaqus, SectionsDivideTheCells_WhateverOtherSetsSay) {
  const std::string two = kFour +
                          "5, 1, 1, 1\n*ELEMENT, TYPE=C3D4, ELSET=all\n1, 1, 2, 3, 4\n2, 2, 5, 3, 4\n"
                          "*ELSET, ELSET=one\n1\n*ELSET, ELSET=loaded\n1, 2\n";
  const auto groups = [](const RestMesh &m) {
    return std::vector{m.groups.at(m.tet_group.at(0)).name, m.groups.at(m.tet_group.at(1)).name};
  };
  EXPECT_EQ(groups(parsed(two)), (std::vector<std::string>{"loaded", "loaded"}));
  const RestMesh mesh = parsed(two + "*SOLID SECTION, MATERIAL=a, ELSET=ALL\n*SOLID SECTION, ELSET=one\n");
  EXPECT_EQ(groups(mesh), (std::vector<std::string>{"one", "all"}));
  EXPECT_EQ(group_of(mesh, "loaded", 3).points.size(), 5u);
  EXPECT_EQ(group_of(mesh, "all", 3).points.size(), 5u);
}

// As Abaqus/CAE writes it: sets of the assembly name the instance; what else it has are points of reference.
TEST(Abaqus, AssemblyOfOnePart_IsRead) {
  const std::string part = "*Heading\n*Part, name=P\n" + kTet + "*End Part\n*Assembly, name=A\n";
  const std::string rest =
      "*End Instance\n*Node\n1, 9., 9., 9.\n*Nset, nset=reference\n 1,\n*Nset, nset=Fixed, instance=P-1\n 1, "
      "2\n"
      "*End Assembly\n";
  const RestMesh mesh = parsed(part + "*Instance, name=P-1, part=P\n" + rest);
  EXPECT_EQ(mesh.npoint(), 4u);
  EXPECT_EQ(mesh.groups.size(), 2u);
  EXPECT_EQ(group_of(mesh, "Fixed", 0).points, (Array<uint32_t>{0, 1}));
  EXPECT_TRUE(mesh.warnings.empty());
  const RestMesh moved = parsed(part + "*Instance, name=P-1, part=P\n 1., 0., 0.\n" + rest);
  EXPECT_EQ(moved.points, mesh.points);
  ASSERT_EQ(moved.warnings.size(), 1u);
  EXPECT_NE(moved.warnings[0].find("place of the instance"), std::string::npos);
  expect_refusal("a.inp", part + "*Instance, name=P-1, part=P\n*End Instance\n*Instance, name=P-2, part=P\n",
                 DFM_E_UNSUPPORTED, {"a.inp:14:", "second instance"});
  expect_refusal("a.inp", "*Part, name=P\n*Part, name=Q\n", DFM_E_UNSUPPORTED, {"a.inp:2:", "second part"});
}

TEST(Abaqus, ElementsThatAreNoCells_AreLeftOutAndReported) {
  const RestMesh mesh = parsed(kTet +
                               "*ELEMENT, TYPE=SPRINGA, ELSET=s\n20, 1, 2\n*ELEMENT, TYPE=SPRINGA\n22, 1, "
                               "2\n*ELEMENT, TYPE=T3D2\n21, 1, 2\n"
                               "*ELSET, ELSET=mixed\n7, 20, 21\n");
  ASSERT_EQ(mesh.warnings.size(), 2u);
  EXPECT_NE(mesh.warnings[0].find("'SPRINGA'"), std::string::npos);
  EXPECT_NE(mesh.warnings[1].find("2 entries"), std::string::npos);
  EXPECT_EQ(group_of(mesh, "mixed", 3).points.size(), 4u);
}

// F3D3 and F3D4 are the faces that enclose a fluid, FC3D4 are its cells.
TEST(Abaqus, FacesOfAFluidCavity_AreTriangles) {
  const RestMesh mesh = parsed(kTet +
                               "*ELEMENT, TYPE=F3D4, ELSET=cavity\n30, 1, 2, 3, 4\n"
                               "*ELEMENT, TYPE=F3D3, ELSET=side\n31, 1, 2, 4\n");
  EXPECT_EQ(mesh.ntet(), 1u);
  EXPECT_TRUE(mesh.warnings.empty());
  EXPECT_EQ(group_of(mesh, "cavity", 2).points.size(), 4u);
  EXPECT_EQ(group_of(mesh, "side", 2).points.size(), 3u);
  EXPECT_EQ(parsed(kTet + "*ELEMENT, TYPE=FC3D4\n30, 1, 2, 3, 4\n").warnings.size(), 1u) << "a double cell";
}

TEST(Abaqus, WhatWouldLosePartOfTheMesh_IsRefused) {
  const auto refuse = [](const std::string &text, dfm_status status, const std::vector<std::string> &words) {
    expect_refusal("a.inp", text, status, words);
  };
  refuse("*HEADING\n*INCLUDE, INPUT=mesh.inp\n", DFM_E_UNSUPPORTED, {"a.inp:2:", "*INCLUDE", "one file"});
  refuse("*NODE, INPUT=nodes.txt\n", DFM_E_UNSUPPORTED, {"a.inp:1:", "INPUT=nodes.txt"});
  refuse("*NODE, SYSTEM=C\n1, 1, 0, 0\n", DFM_E_UNSUPPORTED, {"SYSTEM=C"});
  refuse(kTet + "*ELGEN\n7, 3\n", DFM_E_UNSUPPORTED, {"*ELGEN", "by its numbers"});
  for (const char *type : {"C3D6", "C3D15", "C3D27", "C3D5", "SC6R"})
    refuse(kFour + "*ELEMENT, TYPE=" + type + "\n1, 1\n", DFM_E_UNSUPPORTED, {"a.inp:6:", type, "C3D10"});
  refuse(kTet + "*ELEMENT, TYPE=C3D8\n8, 1, 2, 3, 4, 1, 2, 3, 4\n", DFM_E_UNSUPPORTED, {"one kind"});
  refuse(kFour + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 9\n", DFM_E_FORMAT, {"a.inp:7:", "node 9"});
  refuse(kFour + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3\n", DFM_E_FORMAT, {"an element's node"});
  refuse(kFour + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3\n*NSET, NSET=a\n", DFM_E_FORMAT,
         {"a.inp:8:", "element's node"});
  refuse(kFour + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4, 5\n", DFM_E_FORMAT, {"a.inp:7:", "more than the 4"});
  refuse(kFour + "*ELEMENT\n1, 1, 2, 3, 4\n", DFM_E_FORMAT, {"a.inp:6:", "TYPE=C3D4"});
  refuse(kTet + "7, 1, 2, 3, 4\n", DFM_E_FORMAT, {"element number 7 is given twice"});
  refuse("*NODE\n1, 0, 0, nan\n", DFM_E_FORMAT, {"a.inp:2:", "finite", "'nan'"});
  refuse(kFour + "4, 0, 0, 1\n", DFM_E_FORMAT, {"node number 4 is given twice"});
  refuse(kTet + "*NSET, NSET=a\nnone\n", DFM_E_FORMAT, {"a.inp:9:", "'none'", "a set that stands before"});
  refuse(kTet + "*NSET\n1\n", DFM_E_FORMAT, {"nset=NAME"});
  refuse(kTet + "*NSET, NSET=a, GENERATE\n1, 4, 0\n", DFM_E_FORMAT, {"step 0"});
  refuse("1, 2, 3\n*NODE\n", DFM_E_FORMAT, {"a.inp:1:", "a keyword such as *NODE"});
  refuse("*HEADING\n", DFM_E_FORMAT, {"no nodes"});
  refuse(kFour, DFM_E_FORMAT, {"no tetrahedra"});
  std::string sets = kTet + "*NODE\n" + rows(96, [](size_t p) { return std::to_string(p + 5) + ",1,1,1"; });
  sets += "*NSET,NSET=a,GENERATE\n" + rows(50, [](size_t) { return "1,99"; });
  refuse(sets, DFM_E_UNSUPPORTED, {"one for each byte"});
  sets = sets.substr(0, sets.find("*NSET")) + "*NSET,NSET=a0,GENERATE\n1,99\n";
  for (int k = 0; k < 99; ++k)
    sets += "*NSET,NSET=a" + std::to_string(k + 1) + "\na" + std::to_string(k) + "\n";
  refuse(sets, DFM_E_UNSUPPORTED, {"one for each byte"});
}

// 1 MB of ranges that name two nodes of 15,000 each, and of blocks of one set: time grows as the file does.
TEST(Abaqus, RangesOfFarSteps_CostWhatTheyName) {
  Numbers numbers(kStandard, "node");
  for (int64_t k = 1; k <= 30000; k += 2) numbers.add(k);
  const std::string none = "a.inp";
  numbers.finish(Cursor(none, none.data(), 0));
  Array<uint32_t> found;
  EXPECT_EQ(numbers.find_range(1, 29999, 29998, found), 2u);
  EXPECT_EQ(found, (Array<uint32_t>{0, 14999}));
  found.clear();
  EXPECT_EQ(numbers.find_range(INT64_MIN, INT64_MAX, 1, found), 15000u);
  EXPECT_EQ(found.size(), 15000u);
  found.clear();
  EXPECT_EQ(numbers.find_range(2, 30000, 4, found), 7500u);
  EXPECT_EQ(numbers.find_range(5, 4, 1, found), 0u);
  EXPECT_TRUE(found.empty());
  std::string text = kTet + "*NODE\n" +
                     rows(15000, [](size_t p) { return std::to_string(p + 5) + ",1,1,1"; }) +
                     "*NSET,NSET=a,GENERATE\n" + rows(30000, [](size_t) { return "1,15004,15003"; });
  for (int k = 0; k < 15000; ++k) text += "*NSET,NSET=a\n" + std::to_string(k + 1) + "\n";
  EXPECT_EQ(group_of(parsed(text), "a", 0).points.size(), 4u);  // nodes of no element are left out
  // ranges that name none of the nodes that are there are looked through all the same
  text = kTet + "*NODE\n" + rows(999, [](size_t p) { return std::to_string(2 * p + 6) + ",1,1,1"; }) +
         "*NSET,NSET=a,GENERATE\n" + rows(99, [](size_t) { return "5,2001,2"; });
  expect_refusal("a.inp", text, DFM_E_UNSUPPORTED, {"one for each byte"});
}

TEST(Tetgen, MarkersAndRegions_AreGroups) {
  const std::string cube = std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/cube_tetgen";
  for (const char *ending : {".ele", ".node", ".face"}) {
    const RestMesh m = read_mesh(kStandard, cube + ending, DFM_MESH_CELLS);
    ASSERT_EQ(m.groups.size(), 3u);  // markers of points are those of their triangles
    EXPECT_EQ(group_of(m, "7", 2).points.size(), 8u);
    EXPECT_EQ(m.tri_group.size(), 12u);
    EXPECT_EQ(m.tet_group, (Array<uint32_t>{1, 1, 1, 2, 2, 2}));
    EXPECT_NEAR(mesh_statistics(m).volume, 1, 1e-15);
  }
  const std::string stem = test::scratch("tetgen") + "/a";
  test::write_file(stem + ".node", test::read_file(cube + ".node"));
  test::write_file(stem + ".ele", test::read_file(cube + ".ele"));
  EXPECT_EQ(group_of(read_mesh(kStandard, stem + ".ele", DFM_MESH_CELLS), "3", 0).points.size(), 8u);
}

// After the corners tetgen -po2 writes the middles of 12 23 31, tetgen -po2f those of 23 31 12, tetgen -o2 of
// points alone none; then the marker, if any, and with -nn two tetrahedra.
TEST(Tetgen, SecondOrderTriangles_AreTheBoundaryHoweverTheirMiddlesAreOrdered) {
  const std::string stem = test::scratch("tetgen2") + "/a";
  write_tetgen(second_order(parsed(kTet)), stem, 0);
  const RestMesh plain = read_mesh(kStandard, stem + ".ele", DFM_MESH_CELLS);
  const auto at = [&](uint32_t a, uint32_t b) {
    for (uint32_t p = 4; p < 10; ++p) {
      bool is = true;
      for (size_t k = 0; k < 3; ++k)
        is = is && plain.points[3 * p + k] == (plain.points[3 * a + k] + plain.points[3 * b + k]) / 2;
      if (is) return " " + std::to_string(p);
    }
    return std::string("?");
  };
  for (const std::string &middles :
       {at(0, 2) + at(2, 1) + at(0, 1), at(2, 1) + at(0, 1) + at(0, 2), std::string()}) {
    for (const char *marker : {" 5", " 5 0 -1"}) {
      test::write_file(stem + ".face", "1 1\n  0 0 2 1" + middles + marker + "\n# made by tetgen\n");
      const RestMesh mesh = read_mesh(kStandard, stem + ".face", DFM_MESH_CELLS);
      EXPECT_EQ(mesh.tri_group.size(), 4u);
      EXPECT_EQ(group_of(mesh, "5", 2).points.size(), 6u);
      const RestMesh skin = read_mesh(kStandard, stem + ".ele", DFM_MESH_SURFACE);
      ASSERT_EQ(skin.groups.size(), 1u);  // each of the four is a triangle of the boundary
      EXPECT_EQ(std::count(skin.tri_group.begin(), skin.tri_group.end(), 0u), 4);
    }
    test::write_file(stem + ".face", "1 0\n  0 0 2 1" + middles + "\n");
    expect_same(read_mesh(kStandard, stem + ".ele", DFM_MESH_CELLS), plain);
  }
}

TEST(Tetgen, Damage_IsRefusedInOneSentence) {
  const std::string cube = std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/cube_tetgen";
  const std::string stem = test::scratch("tetgen_damage") + "/a";
  const std::vector<std::string> parts = {".node", ".ele", ".face"};
  const auto whole = [&] {
    for (const std::string &part : parts) test::write_file(stem + part, test::read_file(cube + part));
  };
  const auto refuse = [&](const std::string &part, const std::string &text,
                          const std::vector<std::string> &words) {
    whole();
    test::write_file(stem + part, text);
    test::CountedMemory memory;
    memory.cap = 65536;
    const auto error = test::refusal(stem + ".ele", memory.hooks);
    ASSERT_TRUE(error) << part << " was read:\n" << text;
    for (const std::string &word : words)
      EXPECT_NE(error->sentence.find(word), std::string::npos) << error->sentence;
    EXPECT_EQ(memory.held, 0u);
  };
  for (const std::string &part : parts) {
    const std::string bytes = test::read_file(cube + part);
    for (size_t k = 0; k < 24; ++k) refuse(part, bytes.substr(0, k * (bytes.size() - 8) / 24), {"a" + part});
  }
  refuse(".node", "4000000000 3 0 0\n0 0 0 0\n", {"a.node:1:", "4000000000 points"});
  refuse(".node", "9 3 10000000000 0\n", {"attributes"});
  refuse(".node", "9 2 0 0\n", {"dimension 2"});
  refuse(".node", "1 3 0 0\n0 0 nan 0\n", {"a.node:2:", "'nan'"});
  refuse(".ele", "10000000000 4 0\n0 10 14 12 40\n", {"a.ele:1:", "10000000000 tetrahedra"});
  refuse(".ele", "1 5 0\n", {"5 points"});
  refuse(".ele", "1 4 0\n0 10 14 12 99\n", {"a.ele:2:", "node 99", "does not define"});
  refuse(".ele", "1 4 1\n0 10 14 12 40 0.5\n", {"a.ele:2:", "0.5", "whole number"});
  refuse(".ele", "1 4 2\n", {"0 or 1"});
  refuse(".face", "4000000000 1\n0 10 14 12 7\n", {"a.face:1:", "triangles"});
  std::filesystem::remove(stem + ".node");
  const auto error = test::refusal(stem + ".ele");
  ASSERT_TRUE(error);
  EXPECT_EQ(error->status, DFM_E_IO);
  EXPECT_NE(error->sentence.find("a.node"), std::string::npos) << error->sentence;
}

TEST(Tetgen, MutatedBytes_NeitherCrashNorEatMemory) {
  const std::string cube = std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/cube_tetgen";
  const std::string stem = test::scratch("tetgen_mutated") + "/a";
  const std::vector<std::string> parts = {".node", ".ele", ".face"};
  uint64_t random = 88172645463325252ull;  // xorshift64
  const auto next = [&] {
    random ^= random << 13;
    random ^= random >> 7;
    return random ^= random << 17;
  };
  for (const std::string &part : parts) test::write_file(stem + part, test::read_file(cube + part));
  for (const std::string &part : parts) {
    const std::string bytes = test::read_file(cube + part);
    for (int round = 0; round < 300; ++round) {
      std::string mutated = bytes;
      for (uint64_t k = 0, n = 1 + next() % 4; k < n; ++k)
        mutated[next() % mutated.size()] = "0123456789 -e.#\n"[next() % 16];
      test::write_file(stem + part, mutated);
      test::CountedMemory memory;
      memory.cap = 65536;
      const auto error = test::refusal(stem + ".ele", memory.hooks);
      if (error) {
        EXPECT_FALSE(error->sentence.empty());
      }
      EXPECT_EQ(memory.held, 0u);
    }
    test::write_file(stem + part, bytes);
  }
}
