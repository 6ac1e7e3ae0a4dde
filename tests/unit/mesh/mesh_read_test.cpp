// Readers on files of our own: every dialect gives the same body, every refusal names its place.
#include <gtest/gtest.h>

#include <array>
#include <clocale>
#include <map>
#include <set>

#include "mesh_support.h"

using namespace dfm;

namespace {

const std::string kVtk = "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\n";
const std::string kFour = "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
const std::string kOneCell = "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
const std::string kMsh40 = "$MeshFormat\n4 0 8\n$EndMeshFormat\n";  // as gmsh writes 4.0
const std::string kMsh41 = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
const std::string kMshNodes = "$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n";
const std::string kMsh22 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";

RestMesh read_text(const std::string &name, const std::string &text) {
  const std::string path = test::scratch("mesh") + "/" + name;
  test::write_file(path, text);
  return read_mesh(Memory::standard(), path, DFM_MESH_CELLS);
}

using test::expect_refusal;

using Corner = std::array<double, 3>;

// The cells as places in space, whatever the numbers.
std::set<std::set<Corner>> cells_in_space(const RestMesh &m) {
  std::set<std::set<Corner>> out;
  for (uint32_t t = 0; t < m.ntet(); ++t) {
    std::set<Corner> cell;
    for (int k = 0; k < 4; ++k) {
      const double *p = &m.points[3 * size_t(m.tets[4 * t + k])];
      cell.insert({p[0], p[1], p[2]});
    }
    out.insert(cell);
  }
  return out;
}

}  // namespace

TEST(MeshRead, EveryDialect_GivesTheSameBody) {
  auto files = test::own_meshes();
  files.push_back(std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/cube_tetgen.ele");
  std::set<std::set<Corner>> expected;
  for (const std::string &file : files) {
    SCOPED_TRACE(file);
    const RestMesh m = read_mesh(Memory::standard(), file, DFM_MESH_CELLS);
    ASSERT_EQ(m.npoint(), 8u);
    ASSERT_EQ(m.ntet(), 6u);
    EXPECT_EQ(m.turned, 0u);
    EXPECT_EQ(m.dropped_points, 1u);
    // the third node of the file belongs to no cell
    EXPECT_EQ(m.file_point, (Array<uint32_t>{0, 1, 3, 4, 5, 6, 7, 8}));
    EXPECT_EQ(m.points[3 * 2 + 1], 1.0);
    for (size_t t = 0; t < m.tets.size(); t += 4)
      EXPECT_DOUBLE_EQ(tet_volume(m.points.data(), &m.tets[t]), 1.0 / 6);
    if (expected.empty()) expected = cells_in_space(m);
    EXPECT_EQ(cells_in_space(m), expected);
  }
}

TEST(MeshRead, PhysicalGroups_KeepNamesCellsAndPoints) {
  std::set<std::string> checked;
  for (const std::string &file : test::own_meshes()) {
    const std::string ending = file.substr(file.size() - 4);
    if (ending != ".msh" && ending != ".vtu" && ending != ".vol") continue;
    SCOPED_TRACE(file);
    const RestMesh m = read_mesh(Memory::standard(), file, DFM_MESH_CELLS);
    ASSERT_EQ(m.groups.size(), 3u);
    EXPECT_EQ(m.groups[0].name, "skin");
    EXPECT_EQ(m.groups[0].dimension, 2);
    EXPECT_EQ(m.groups[0].tag, 7);
    EXPECT_EQ(m.groups[0].points.size(), 8u);
    EXPECT_EQ(m.groups[1].name, "low");
    EXPECT_EQ(m.groups[2].name, "high end");
    EXPECT_EQ(m.groups[2].points.size(), 6u);
    EXPECT_EQ(m.tet_group, (Array<uint32_t>{1, 1, 1, 2, 2, 2}));
    EXPECT_EQ(m.tri_group, Array<uint32_t>(12, 0));
    EXPECT_EQ(mesh_statistics(m).ntriangle, 12u);
    std::set<std::set<uint32_t>> skin, kept;
    const Array<uint32_t> boundary = boundary_triangles(m.tets);
    for (size_t t = 0; t < 36; t += 3) {
      skin.insert({boundary[t], boundary[t + 1], boundary[t + 2]});
      kept.insert({m.tris[t], m.tris[t + 1], m.tris[t + 2]});
    }
    EXPECT_EQ(kept, skin);
    checked.insert(ending);
  }
  EXPECT_EQ(checked.size(), 3u);
}

TEST(MeshRead, MeditReferences_AreGroupsByNumber) {
  const RestMesh m =
      read_mesh(Memory::standard(), std::string(DEFORM_SOURCE_DIR) + "/tests/data/meshes/cube_medit.mesh",
                DFM_MESH_CELLS);
  ASSERT_EQ(m.groups.size(), 4u);
  const struct {
    const char *name;
    int32_t dimension;
    size_t points;
  } wanted[] = {{"3", 1, 2}, {"7", 2, 8}, {"1", 3, 6}, {"2", 3, 6}};
  for (int g = 0; g < 4; ++g) {
    EXPECT_EQ(m.groups[size_t(g)].name, wanted[g].name);
    EXPECT_EQ(m.groups[size_t(g)].dimension, wanted[g].dimension);
    EXPECT_EQ(m.groups[size_t(g)].points.size(), wanted[g].points);
  }
  EXPECT_EQ(m.tet_group, (Array<uint32_t>{2, 2, 2, 3, 3, 3}));
  EXPECT_EQ(m.tri_group, Array<uint32_t>(12, 1));
}

TEST(MeshRead, MeditStructure_IsChecked) {
  const std::string head = "MeshVersionFormatted 2\nDimension 3\n";
  const std::string four = "Vertices 4\n0 0 0 0\n1 0 0 0\n0 1 0 0\n0 0 1 0\n";
  EXPECT_EQ(read_text("m.mesh", head + four + "Tetrahedra 1\n1 2 3 4 0\nEnd\n").ntet(), 1u);
  EXPECT_EQ(
      read_text("m.mesh", head + four + "RequiredVertices 1\n2\nHexahedra 0\nTetrahedra 1\n1 2 3 4 0\nEnd")
          .ntet(),
      1u);
  expect_refusal("m.mesh", "hello\n", DFM_E_FORMAT, {"m.mesh:1:", "MeshVersionFormatted"});
  expect_refusal("m.mesh", "MeshVersionFormatted 9\n", DFM_E_UNSUPPORTED, {"version 9"});
  expect_refusal("m.mesh", "MeshVersionFormatted 1\nDimension 2\n", DFM_E_UNSUPPORTED,
                 {"m.mesh:2:", "dimension 2"});
  expect_refusal("m.mesh", head + "Tetrahedra 1\n1 2 3 4 0\nEnd\n", DFM_E_FORMAT, {"before Vertices"});
  expect_refusal("m.mesh", head + four + "Tetrahedra 1\n1 2 3 5 0\nEnd\n", DFM_E_FORMAT,
                 {"m.mesh:9:", "vertex 5", "1 to 4"});
  expect_refusal("m.mesh", head + four + "Tetrahedra 1\n0 1 2 3 0\nEnd\n", DFM_E_FORMAT, {"vertex 0"});
  expect_refusal("m.mesh", head + four + "Tetrahedra 9\n1 2 3 4 0\nEnd\n", DFM_E_FORMAT, {"9 tetrahedra"});
  // as several writers leave it
  const RestMesh endless = read_text("m.mesh", head + four + "Tetrahedra 1\n1 2 3 4 0\n");
  EXPECT_EQ(endless.ntet(), 1u);
  ASSERT_EQ(endless.warnings.size(), 1u);
  EXPECT_NE(endless.warnings[0].find("End is missing"), std::string::npos);
  expect_refusal("m.mesh", head + four + "Tetrahedra 2\n1 2 3 4 0\n1 2 3 4 ", DFM_E_FORMAT, {"reference"});
  expect_refusal("m.mesh", head + "End\n", DFM_E_FORMAT, {"no Vertices"});
  expect_refusal("m.mesh", head + four + "7 7\n", DFM_E_FORMAT, {"keyword", "'7'"});
  for (const char *kind : {"Prisms", "HexahedraP3", "TetrahedraP3", "TetrahedraP2Ordering"})
    expect_refusal("m.mesh", head + four + kind + " 1\n1 2 3 4 1 2 3 4 1 2 0\nEnd\n", DFM_E_UNSUPPORTED,
                   {kind, "hexahedra of 8"});
}

TEST(MeshRead, GroupWithoutName_IsCalledByItsNumber) {
  const RestMesh m = read_text("unnamed.msh", kMsh22 +
                                                  "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n"
                                                  "$Elements\n1\n1 4 2 42 1 1 2 3 4\n$EndElements\n");
  ASSERT_EQ(m.groups.size(), 1u);
  EXPECT_EQ(m.groups[0].name, "42");
}

// gmsh gives entities that a group turns round its negative number (Geometry.OrientedPhysicals).
TEST(MeshRead, EntitiesTurnedRound_AreOfTheirGroup) {
  const std::string names = "$PhysicalNames\n1\n2 3 \"wall\"\n$EndPhysicalNames\n";
  const std::string entities =
      "$Entities\n0 0 2 1\n1 0 0 0 1 1 1 1 3 0\n2 0 0 0 1 1 1 1 -3 0\n1 0 0 0 1 1 1 0 0\n$EndEntities\n";
  const RestMesh m = read_text("turned.msh", kMsh41 + names + entities + kMshNodes +
                                                 "$Elements\n3 3 1 3\n2 1 2 1\n1 1 2 3\n2 2 2 1\n2 1 2 4\n"
                                                 "3 1 4 1\n3 1 2 3 4\n$EndElements\n");
  ASSERT_EQ(m.groups.size(), 1u);
  EXPECT_EQ(m.groups[0].name, "wall");
  EXPECT_EQ(m.groups[0].points.size(), 4u);
}

// Elements of a mesh that gmsh divided are in entities of their own.
TEST(MeshRead, PartitionedEntities_HaveTheirGroupsOrThoseOfTheirParents) {
  const std::string entities =
      "$Entities\n0 0 1 1\n1 0 0 0 1 1 1 1 3 0\n1 0 0 0 1 1 1 1 7 0\n$EndEntities\n"
      "$PartitionedEntities\n2\n1\n9 1\n1 0 2 1\n5 2 1 2 1 2 0 0 0 0\n"
      "4 2 1 1 1 0 0 0 1 1 1 1 3 1 2\n5 2 1 1 2 0 0 0 1 1 1 0 0\n2 3 1 1 1 0 0 0 1 1 1 0 2 4 5\n"
      "$EndPartitionedEntities\n";
  const RestMesh m = read_text("parts.msh", kMsh41 + entities + kMshNodes +
                                                "$Elements\n3 3 1 3\n2 4 2 1\n1 1 2 3\n2 5 2 1\n2 1 2 4\n"
                                                "3 2 4 1\n3 1 2 3 4\n$EndElements\n");
  ASSERT_EQ(m.groups.size(), 2u);
  EXPECT_EQ(m.groups[0].name, "3");
  EXPECT_EQ(m.groups[0].points.size(), 4u);
  EXPECT_EQ(m.groups[m.tet_group[0]].name, "7");
}

TEST(MeshRead, NegativeCell_IsTurnedAndCounted) {
  const RestMesh m = read_text("turned.vtk", kVtk + kFour + "CELLS 1 5\n4 0 2 1 3\nCELL_TYPES 1\n10\n");
  EXPECT_EQ(m.turned, 1u);
  EXPECT_GT(tet_volume(m.points.data(), m.tets.data()), 0);
  ASSERT_EQ(m.warnings.size(), 1u);
  EXPECT_EQ(m.warnings[0], "1 of 1 cells had negative volume and was turned");
}

TEST(MeshRead, DuplicateCellInAnotherOrder_IsDroppedAndCounted) {
  const RestMesh m =
      read_text("double.vtk", kVtk + kFour + "CELLS 2 10\n4 0 1 2 3\n4 3 1 0 2\nCELL_TYPES 2\n10\n10\n");
  EXPECT_EQ(m.ntet(), 1u);
  EXPECT_EQ(m.dropped_cells, 1u);
  EXPECT_EQ(mesh_statistics(m).ntriangle, 4u);
}

TEST(MeshRead, OverlappingCells_AreReportedAsTangled) {
  const RestMesh m = read_text("tangled.vtk", kVtk +
                                                  "POINTS 5 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0.1 0.1 2\n"
                                                  "CELLS 2 10\n4 0 1 2 3\n4 0 1 2 4\nCELL_TYPES 2\n10\n10\n");
  EXPECT_EQ(m.overlapping, 1u);
  EXPECT_NE(m.warnings.at(0).find("tangled"), std::string::npos);
}

TEST(MeshRead, AnySize_LoadsWithoutAbsoluteEpsilon) {
  for (const double size : {1e-12, 1e-9, 1.0, 1e5, 1e12}) {
    char text[512];
    std::snprintf(text, sizeof text, "POINTS 4 double\n0 0 0\n%.17g 0 0\n0 %.17g 0\n0 0 %.17g\n", size, size,
                  size);
    const RestMesh m = read_text("size.vtk", kVtk + text + kOneCell);
    EXPECT_NEAR(mesh_statistics(m).volume / (size * size * size), 1.0 / 6, 1e-15);
    EXPECT_TRUE(m.warnings.empty()) << m.warnings[0];
  }
}

TEST(MeshRead, CellThinnerThanItsCoordinatesResolve_IsFlat) {
  // 1 mm cells 1e13 m from the origin, where doubles are 2 mm apart: whatever volume comes out is rounding.
  expect_refusal(
      "far.vtk",
      kVtk + "POINTS 4 double\n1e13 0 0\n10000000000000.002 0 0\n1e13 0.001 0\n1e13 0 0.001\n" + kOneCell,
      DFM_E_FORMAT, {"flat"});
  // The same shape nearby is sound, and so is a sliver that is thin but resolved.
  EXPECT_EQ(
      read_text("near.vtk", kVtk + "POINTS 4 double\n0 0 0\n0.002 0 0\n0 0.001 0\n0 0 0.001\n" + kOneCell)
          .ntet(),
      1u);
  const RestMesh sliver =
      read_text("sliver.vtk", kVtk + "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0.3 0.3 1e-9\n" + kOneCell);
  EXPECT_EQ(mesh_statistics(sliver).flat_cells, 1u);
  EXPECT_NE(sliver.warnings.at(0).find("nearly flat"), std::string::npos);
}

TEST(MeshRead, FlatCells_AreRefusedWithTheFirst) {
  const std::string six = "POINTS 6 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n2 3 0\n";
  expect_refusal("flat_all.vtk", kVtk + six + "CELLS 2 10\n4 0 1 2 4\n4 0 1 2 5\nCELL_TYPES 2\n10\n10\n",
                 DFM_E_FORMAT, {"all 2 tetrahedra are flat"});
  expect_refusal("flat_one.vtk", kVtk + six + "CELLS 2 10\n4 0 1 2 3\n4 0 1 2 4\nCELL_TYPES 2\n10\n10\n",
                 DFM_E_FORMAT, {"1 of 2", "tetrahedron 1", "0 1 2 4"});
  expect_refusal("flat_twice.vtk", kVtk + kFour + "CELLS 1 5\n4 0 1 1 3\nCELL_TYPES 1\n10\n", DFM_E_FORMAT,
                 {"flat", "0 1 1 3"});
}

TEST(MeshRead, NumbersThatAreNone_AreRefusedWithTheirLine) {
  const auto points = [](const std::string &x) {
    return kVtk + "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 " + x + "\n" + kOneCell;
  };
  for (const char *bad : {"nan", "NaN", "-nan", "inf", "-Infinity", "1e999", "zero", "1,5", "1.0x", "0x10",
                          "--1", "+-1", "+", "1e101"})
    expect_refusal(
        "number.vtk", points(bad), DFM_E_FORMAT,
        {std::string(bad) == "1e101" ? "coordinate" : "number.vtk:9: expected a point's coordinate"});
  for (const char *good : {"+1", "1.", ".5", "1E0", "1e-400"}) {
    const auto error = test::refusal_of_text("number.vtk", points(good));
    // underflow reads as 0: a flat cell
    EXPECT_EQ(bool(error), std::string(good) == "1e-400") << good << (error ? error->sentence : "");
    if (error) {
      EXPECT_NE(error->sentence.find("flat"), std::string::npos) << error->sentence;
    }
  }
}

TEST(MeshRead, Locale_HasNoInfluence) {
  const char *set = std::setlocale(LC_ALL, "de_DE.UTF-8");
  const RestMesh m =
      read_text("locale.vtk", kVtk + "POINTS 4 double\n0 0 0\n1.5 0 0\n0 1 0\n0 0 1\n" + kOneCell);
  std::setlocale(LC_ALL, "C");
  EXPECT_EQ(m.points[3], 1.5) << (set ? set : "locale not installed");
}

TEST(MeshRead, LongLinesAndCarriageReturns_AreFine) {
  std::string text = "# vtk DataFile Version 3.0\r\n" + std::string(100000, 'x');
  text += "\r\nASCII\r\ndataset unstructured_grid\r\nPOINTS 4 double\r\n";
  text += "0 0 0 1 0 0 0 1 0" + std::string(70000, ' ') +
          "\t0 0 1\r\nCELLS 1 5\r\n4 0 1 2 3\r\nCELL_TYPES 1\r\n10";
  EXPECT_EQ(read_text("long.vtk", text).ntet(), 1u);
}

// VTK and our writer of old: names as strings, before the points.
TEST(MeshRead, VtkNamesAsStrings_NameTheGroups) {
  const RestMesh m = read_text("named.vtk", kVtk + "FIELD FieldData 2\ngroup_number 2 1 int\n3 7\n" +
                                                "group_name 1 1 string\nsoft part\n" + kFour +
                                                "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\nCELL_DATA 1\n" +
                                                "SCALARS group int 1\nLOOKUP_TABLE default\n7\n");
  ASSERT_EQ(m.groups.size(), 1u);
  EXPECT_EQ(m.groups[0].name, "soft part");
}

TEST(MeshRead, VtkStructure_IsChecked) {
  expect_refusal("v.vtk", "hello\n", DFM_E_FORMAT, {"v.vtk:1", "# vtk DataFile Version", "hello"});
  expect_refusal("v.vtk", "# vtk DataFile Version 9.7\nt\nASCII\n", DFM_E_UNSUPPORTED, {"9.7", "2.0 to 5.1"});
  expect_refusal("v.vtk", "# vtk DataFile Version 3.0\nt\nEBCDIC\n", DFM_E_FORMAT,
                 {"v.vtk:3", "ASCII or BINARY", "EBCDIC"});
  expect_refusal("v.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET STRUCTURED_POINTS\n",
                 DFM_E_UNSUPPORTED, {"STRUCTURED_POINTS", "UNSTRUCTURED_GRID or POLYDATA"});
  expect_refusal("v.vtk", "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0 0 0\n",
                 DFM_E_FORMAT, {"no POLYGONS section"});
  expect_refusal("v.vtk", kVtk + kFour, DFM_E_FORMAT, {"no CELLS section"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 5\n4 0 1 2 3\n", DFM_E_FORMAT, {"no CELL_TYPES section"});
  expect_refusal("v.vtk", kVtk + "CELLS 1 5\n4 0 1 2 3\n", DFM_E_FORMAT, {"CELLS before POINTS"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 5\n4 0 1 2 4\nCELL_TYPES 1\n10\n", DFM_E_FORMAT,
                 {"v.vtk:11", "point 4", "0 to 3"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 5\n4 0 1 2 -1\nCELL_TYPES 1\n10\n", DFM_E_FORMAT,
                 {"point -1"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 6\n4 0 1 2 3\nCELL_TYPES 1\n10\n", DFM_E_FORMAT,
                 {"list of 6 numbers", "use 5"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 5\n5 0 1 2 3\nCELL_TYPES 1\n10\n", DFM_E_FORMAT,
                 {"has 5 points"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 2\n10\n10\n", DFM_E_FORMAT,
                 {"2 types", "1 cells"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n10\n", DFM_E_FORMAT,
                 {"tetrahedra", "3 points"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n", DFM_E_FORMAT,
                 {"no tetrahedra", "TetMesh.fill", "deform mesh fill ", "/v.vtk", " --out ", "/v.vtu"});
  expect_refusal("a v.vtk", kVtk + kFour + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n", DFM_E_FORMAT,
                 {"deform mesh fill '/", "/a v.vtk' --out '/", "/a v.vtu'"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 2 8\nOFFSETS int\n0 5\nCONNECTIVITY int\n0 1 2 3\n",
                 DFM_E_FORMAT, {"last cell offset"});
  expect_refusal("v.vtk", kVtk + kFour + "CELLS 3 8\nOFFSETS int\n0 5 4\nCONNECTIVITY int\n0 1 2 3\n",
                 DFM_E_FORMAT, {"cell offset 4"});
  expect_refusal("v.vtk", kVtk + "POINTS 4 quaternion\n", DFM_E_FORMAT, {"number type", "quaternion"});
  const std::string eight =
      "POINTS 8 double\n0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\nCELLS 1 9\n8 0 1 2 3 4 5 6 "
      "7\nCELL_TYPES 1\n";
  expect_refusal("v.vtk", kVtk + eight + "13\n", DFM_E_UNSUPPORTED, {"wedge", "tetrahedra"});
  expect_refusal("v.vtk", kVtk + eight + "12\n", DFM_E_FORMAT, {"cell 0", "distorted", "order its points"});
  expect_refusal("v.vtk", kVtk + eight + "24\n", DFM_E_FORMAT, {"8 points", "expected 10"});
  expect_refusal("v.vtk", kVtk + eight + "71\n", DFM_E_UNSUPPORTED, {"above second order", "-order 2"});
  for (const char *type : {"67\n", "79\n", "81\n"})  // of any order; Bezier hexahedron, pyramid
    expect_refusal("v.vtk", kVtk + eight + type, DFM_E_UNSUPPORTED, {"volume cell of type", "29"});
}

TEST(MeshRead, MshStructure_IsChecked) {
  const std::string &nodes = kMshNodes;
  const std::string cells = "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n";
  EXPECT_EQ(read_text("m.msh", kMsh41 + nodes + cells).ntet(), 1u);
  const std::string comments = "$Comments\nanything $ at all\n$EndComments\n";
  const std::string later = "$Later\nx y\n$EndLater\n";
  EXPECT_EQ(read_text("m.msh", comments + kMsh41 + later + nodes + cells).ntet(), 1u);
  expect_refusal("m.msh", "", DFM_E_FORMAT, {"empty"});
  expect_refusal("m.msh", "solid\n", DFM_E_FORMAT, {"$MeshFormat", "solid"});
  expect_refusal("m.msh", "$NOD\n4\n", DFM_E_UNSUPPORTED, {"version 1", "gmsh", "msh41"});
  expect_refusal("m.msh", "$MeshFormat\n3 0 8\n$EndMeshFormat\n", DFM_E_UNSUPPORTED,
                 {"version 3.0 ", "gmsh", "msh41"});
  expect_refusal("m.msh", "$MeshFormat\n9.7 0 8\n$EndMeshFormat\n", DFM_E_UNSUPPORTED,
                 {"9.7", "2.2, 4.0 and 4.1"});
  expect_refusal("m.msh", "$MeshFormat\n4.1 2 8\n$EndMeshFormat\n", DFM_E_FORMAT, {"file type 2"});
  expect_refusal("m.msh", kMsh41, DFM_E_FORMAT, {"no $Nodes section"});
  expect_refusal("m.msh", kMsh41 + nodes, DFM_E_FORMAT, {"no $Elements section"});
  expect_refusal("m.msh", kMsh41 + cells + nodes, DFM_E_FORMAT, {"$Elements before $Nodes"});
  expect_refusal("m.msh", kMsh41 + nodes + nodes + cells, DFM_E_FORMAT, {"second $Nodes"});
  expect_refusal("m.msh", kMsh41 + nodes + "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 5\n$EndElements\n",
                 DFM_E_FORMAT, {"node 5"});
  expect_refusal("m.msh", kMsh41 + nodes + "$Elements\n1 2 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n",
                 DFM_E_FORMAT, {"promises 2 elements"});
  expect_refusal("m.msh", kMsh41 + nodes + "$Elements\n1 1 1 1\n3 1 4 2\n1 1 2 3 4\n$EndElements\n",
                 DFM_E_FORMAT, {"block of 2 elements"});
  expect_refusal("m.msh", kMsh41 + nodes + "$Elements\n1 1 1 1\n3 1 77 1\n1 1 2 3 4\n$EndElements\n",
                 DFM_E_FORMAT, {"element type 77"});
  expect_refusal("m.msh", kMsh41 + nodes + "$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n", DFM_E_FORMAT,
                 {"$EndElements"});
  expect_refusal("m.msh", kMsh41 + nodes + cells + "$Tail\n", DFM_E_FORMAT, {"'$Tail'", "has no end"});
  expect_refusal("m.msh", kMsh41 + "$Nodes\n1 2 1 2\n3 1 0 2\n1\n1\n0 0 0\n1 0 0\n$EndNodes\n" + cells,
                 DFM_E_FORMAT, {"node number 1 is given twice"});
  expect_refusal("m.msh", kMsh22 + "$Nodes\n2\n1 0 0 0\n2 1 0 0\n$Elements\n", DFM_E_FORMAT,
                 {"m.msh:8", "$EndNodes", "$Elements"});
  expect_refusal("m.msh", kMsh22 + "$PhysicalNames\n1\n3 1 body\n$EndPhysicalNames\n", DFM_E_FORMAT,
                 {"double quotes"});
  const std::string hexes = "$Elements\n1 1 1 1\n3 1 6 1\n1 1 2 3 4 1 2\n$EndElements\n";
  expect_refusal("m.msh", kMsh41 + nodes + hexes, DFM_E_UNSUPPORTED,
                 {"prism", "hexahedra of first and second order"});
  expect_refusal(
      "m.msh",
      kMsh41 + nodes +
          "$Elements\n1 1 1 1\n3 1 29 1\n1 1 2 3 4 1 2 3 4 1 2 3 4 1 2 3 4 1 2 3 4\n$EndElements\n",
      DFM_E_UNSUPPORTED, {"above second order", "-order 1"});
}

TEST(MeshRead, StructureOfMsh40_IsChecked) {
  const std::string four = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n",
                    nodes = "$Nodes\n1 4\n1 3 0 4\n" + four;
  const std::string cells = "$Elements\n1 1\n1 3 4 1\n1 1 2 3 4\n$EndElements\n";
  EXPECT_EQ(read_text("m.msh", kMsh40 + nodes + cells).ntet(), 1u);
  EXPECT_EQ(read_text("m.msh", "$MeshFormat\n4.0 0 8\n$EndMeshFormat\n" + nodes + cells).ntet(), 1u);
  EXPECT_EQ(read_text("m.msh", kMsh40 + "$Nodes\n1 4\n1 3 1 4\n" + four + cells).ntet(),
            1u);  // a volume has no parameters
  const std::string entities = "$Entities\n1 0 0 1\n9 0 0 0 0 0 0 1 3\n1 0 0 0 1 1 1 1 5 0\n$EndEntities\n";
  const RestMesh grouped = read_text("m.msh", kMsh40 + entities + nodes + cells);
  ASSERT_EQ(grouped.groups.size(), 2u);
  EXPECT_EQ(grouped.groups[grouped.tet_group[0]].tag, 5);
  const std::pair<std::string, std::vector<std::string>> wrong[] = {
      {"$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n", {"node"}},  // as in 4.1
      {"$Nodes\n1 4\n1 4 0 4\n" + four + cells, {"dimension 4"}},
      {"$Nodes\n1 4\n1 3 2 4\n" + four + cells, {"parametric flag 2"}},
      {"$Nodes\n1 4\n1 3 0 5\n" + four + cells, {"block of 5 nodes"}},
      {"$Nodes\n1 5\n1 3 0 4\n" + four + cells, {"promises 5 nodes"}},
      {"$Nodes\n1 1\n1 3 0 1\n3000000000 0 0 0\n$EndNodes\n" + cells, {"3000000000", "32 bits"}},
      {nodes + "$Elements\n1 1\n1 3 4 1\n1 1 2 3 5\n$EndElements\n", {"node 5"}},
      {nodes + "$Elements\n1 2\n1 3 4 1\n1 1 2 3 4\n$EndElements\n", {"promises 2 elements"}},
      {nodes + "$Elements\n1 1\n1 3 4 2\n1 1 2 3 4\n$EndElements\n", {"block of 2 elements"}},
      {entities + nodes + "$Elements\n1 1\n1 3 2 1\n1 1 2 3\n$EndElements\n", {"type 2", "dimension 3"}},
      {nodes + cells.substr(0, cells.size() - 14), {"$EndElements"}}};
  for (const auto &[text, words] : wrong) {
    SCOPED_TRACE(text);
    expect_refusal("m.msh", kMsh40 + text, DFM_E_FORMAT, words);
  }
  expect_refusal("m.msh", "$MeshFormat\n4 0 4\n$EndMeshFormat\n", DFM_E_FORMAT,
                 {"data size 4", "expected 8"});
}

TEST(MeshRead, OtherFiles_AreRefusedByEnding) {
  expect_refusal("a.nas", "x", DFM_E_UNSUPPORTED, {"Nastran", "meshio convert"});
  expect_refusal("a.docx", "x", DFM_E_UNSUPPORTED, {"'docx'", ".msh", ".vtk"});
  expect_refusal("README", "x", DFM_E_UNSUPPORTED, {"ending"});
  EXPECT_EQ(test::refusal(test::scratch("mesh") + "/no_such.msh")->status, DFM_E_IO);
  const std::string folder = test::scratch("mesh/folder.msh");
  const auto error = test::refusal(folder);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->status, DFM_E_IO);
  EXPECT_NE(error->sentence.find("a directory"), std::string::npos);
}
