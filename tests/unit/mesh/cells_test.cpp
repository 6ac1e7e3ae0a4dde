// Second-order tetrahedra and hexahedra as meshes: their tetrahedra, masses, files, and what is refused.
#include "mesh/cells.h"

#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include "deform/plugin.h"
#include "math/vec3.h"
#include "mesh/cell_finder.h"
#include "mesh/raw_mesh.h"
#include "mesh_support.h"

namespace {

using namespace dfm;

using test::expect_refusal;

const Memory &kMemory = Memory::standard();

RestMesh made(uint32_t kind) {
  const RestMesh bricks = make_bricks(kMemory, 0.3, 0.2, 0.2, 12);
  if (kind == DFM_CELL_HEX8) return bricks;
  if (kind == DFM_CELL_HEX27) return second_order(bricks);
  if (kind == DFM_CELL_HEX20) return test::of_twenty(second_order(bricks));
  return second_order(make_beam(kMemory, 0.3, 0.2, 0.2, 100));
}

class Cells : public testing::TestWithParam<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Kinds, Cells,
                         testing::Values(DFM_CELL_TET10, DFM_CELL_HEX8, DFM_CELL_HEX20, DFM_CELL_HEX27),
                         [](const auto &of) {
                           const std::string nodes = std::to_string(cell_kind(of.param).nodes);
                           return (of.param == DFM_CELL_TET10 ? "Tet" : "Hex") + nodes;
                         });

// All are positive, fill the box, and have no other boundary than the box, whatever the numbers of points.
TEST_P(Cells, Tetrahedra_FillTheShapeAndMeet) {
  RestMesh mesh = made(GetParam());
  const CellKind &kind = cell_kind(mesh.cell);
  for (int shuffle = 0; shuffle < 3; ++shuffle) {
    ASSERT_EQ(mesh.ntet(), kind.tets * (mesh.cells.size() / kind.nodes));
    double volume = 0;
    for (uint32_t t = 0; t < mesh.ntet(); ++t) {
      const double one = tet_volume(mesh.points.data(), &mesh.tets[4 * size_t{t}]);
      EXPECT_GT(one, 0);
      volume += one;
    }
    EXPECT_NEAR(volume, 0.012, 1e-15);
    double area = 0;
    const Array<uint32_t> faces = boundary_triangles(mesh.tets);
    for (size_t f = 0; f < faces.size(); f += 3) {
      const auto x = [&](size_t k) { return load3(&mesh.points[3 * size_t{faces[f + k]}]); };
      area += norm(cross(x(1) - x(0), x(2) - x(0))) / 2;
    }
    EXPECT_NEAR(area, 2 * (0.06 + 0.06 + 0.04), 1e-14);
    // other numbers of the points
    const uint32_t n = mesh.npoint();
    RestMesh other = mesh;
    const auto number = [&](uint32_t p) { return uint32_t((uint64_t{p} * 101 + uint32_t(shuffle) + 3) % n); };
    ASSERT_EQ(std::gcd(n, 101u), 1u);
    for (uint32_t p = 0; p < n; ++p)
      std::copy_n(&mesh.points[3 * size_t{p}], 3, &other.points[3 * size_t{number(p)}]);
    for (uint32_t &p : other.cells) p = number(p);
    other.tets = tets_of(kMemory, kind, other.cells);
    mesh = other;
  }
}

TEST_P(Cells, MassShares_ArePositiveAndHaveTheCenterOfTheCell) {
  const RestMesh mesh = made(GetParam());
  const CellKind &kind = cell_kind(mesh.cell);
  RestMesh moved = mesh;
  for (size_t k = 0; k < moved.points.size(); k += 3) moved.points[k] *= 1 + moved.points[k + 1];  // a taper
  const bool straight = kind.nodes == 10 || kind.nodes == 20;
  const RestMesh &of = straight ? mesh : moved;
  for (size_t c = 0; c < of.cells.size() / kind.nodes; ++c) {
    double share[kMaxNodes], sum = 0, volume = 0;
    Vec3 center, mean;
    mass_shares(kind, of.points.data(), &of.cells[kind.nodes * c], share);
    for (uint32_t k = 0; k < kind.nodes; ++k) {
      EXPECT_GT(share[k], 0);
      sum += share[k];
      mean += share[k] * load3(&of.points[3 * size_t{of.cells[kind.nodes * c + k]}]);
    }
    for (size_t t = kind.tets * c; t < kind.tets * (c + 1); ++t) {
      const double v = tet_volume(of.points.data(), &of.tets[4 * t]);
      volume += v;
      for (size_t k = 0; k < 4; ++k) center += (v / 4) * load3(&of.points[3 * size_t{of.tets[4 * t + k]}]);
    }
    EXPECT_NEAR(sum, 1, 1e-14);
    EXPECT_LT(norm(mean - (1 / volume) * center), 1e-12);
  }
}

TEST_P(Cells, Files_GiveBackCellsGroupsAndPoints) {
  RestMesh mesh = made(GetParam());
  const CellKind &kind = cell_kind(mesh.cell);
  mesh.groups.push_back({"left", 3, 4, Array<uint32_t>()});
  for (uint32_t t = 0; t < mesh.ntet() / 2 / kind.tets * kind.tets; ++t) mesh.tet_group[t] = 0;
  for (const char *ending : {"msh", "msh2", "vtk", "vtu", "mesh"}) {
    const std::string path = test::scratch("cells") + "/a." + ending;
    if (!kind.medit && std::string(ending) == "mesh") {
      EXPECT_THROW(write_mesh(mesh, path), Error);
      continue;
    }
    ASSERT_TRUE(write_mesh(mesh, path));
    const RestMesh back = read_mesh(kMemory, path, DFM_MESH_CELLS);
    EXPECT_EQ(back.cell, mesh.cell) << ending;
    EXPECT_EQ(back.cells, mesh.cells) << ending;
    EXPECT_EQ(back.tets, mesh.tets) << ending;
    EXPECT_EQ(back.points, mesh.points) << ending;
    EXPECT_EQ(back.tet_group, mesh.tet_group) << ending;
    EXPECT_TRUE(back.warnings.empty()) << ending << ": " << back.warnings[0];
  }
}

// A quadratic field over the nodes of second-order cells has its own value at every place, in the cells and
// outside; a linear one over those of the others.
TEST_P(Cells, Finder_FollowsTheFieldsOfTheCells) {
  const RestMesh mesh = made(GetParam());
  const bool quadratic = GetParam() != DFM_CELL_HEX8;
  const auto field = [&](Vec3 x) {
    const double linear = 0.3 + 2 * x.x - x.y + 0.5 * x.z;
    return quadratic ? linear + 7 * x.x * x.y - 3 * x.z * x.z + x.y * x.z : linear;
  };
  const CellFinder finder(kMemory, {mesh.npoint(), mesh.ntet(), mesh.points.data(), mesh.tets.data(),
                                    mesh.cells.data(), mesh.cell});
  std::mt19937 random(3);
  std::uniform_real_distribution<double> along(-0.02, 0.32), across(-0.02, 0.22);
  uint32_t outside = 0;
  for (int n = 0; n < 200; ++n) {
    const double place[3] = {along(random), across(random), across(random)};
    double away, w[kMaxNodes], value = 0;
    const uint32_t tet = finder.find(finder.local(place), away);
    const std::span<const uint32_t> nodes = finder.weights(finder.local(place), tet, w);
    ASSERT_EQ(nodes.size(), cell_kind(mesh.cell).nodes);
    for (size_t k = 0; k < nodes.size(); ++k)
      value += w[k] * field(load3(&mesh.points[3 * size_t{nodes[k]}]));
    EXPECT_NEAR(value, field(load3(place)), 1e-12);
    outside += away > 0;
  }
  EXPECT_GT(outside, 0u);
}

// A cell that is a cube of side 1 or a regular tetrahedron.
RestMesh regular(uint32_t kind) {
  RestMesh tet(kMemory);
  tet.points = {0, 0, 0, 1, 0, 0, 0.5, std::sqrt(0.75), 0, 0.5, std::sqrt(1.0 / 12), std::sqrt(2.0 / 3)};
  tet.tets = {0, 1, 2, 3};
  tet.tet_group = {kNoGroup};
  tet.file_point = {0, 1, 2, 3};
  if (kind == DFM_CELL_TET10) return second_order(tet);
  const RestMesh cube = make_bricks(kMemory, 1, 1, 1, 1);
  if (kind == DFM_CELL_HEX8) return cube;
  return kind == DFM_CELL_HEX27 ? second_order(cube) : test::of_twenty(second_order(cube));
}

TEST_P(Cells, Quality_IsTheMeanRatioAtTheWorstNode) {
  const CellKind &kind = cell_kind(GetParam());
  const RestMesh cell = regular(GetParam());
  for (const double size : {1e-9, 1.0, 1e9}) {
    RestMesh of = cell;
    for (double &x : of.points) x *= size;
    EXPECT_NEAR(cell_quality(kind, of.points.data(), of.cells.data()), 1, 1e-12);
  }
  RestMesh longer = cell;
  for (size_t k = 0; k < longer.points.size(); k += 3) longer.points[k] *= 2;
  const double of_cube = 3 * std::cbrt(4.0) / 6,
               of_tet = tet_quality(longer.points.data(), cell.cells.data());
  EXPECT_NEAR(cell_quality(kind, longer.points.data(), longer.cells.data()),
              kind.nodes == 10 ? of_tet : of_cube, 1e-12);
  const dfm_mesh_info info = mesh_statistics(longer);
  EXPECT_NEAR(info.quality_min, kind.nodes == 10 ? of_tet : of_cube, 1e-12);
  EXPECT_EQ(std::accumulate(info.quality_histogram, info.quality_histogram + 10, 0u), info.ncell);
  if (kind.nodes == 8) return;
  // with the middle of an edge at a quarter of it the Jacobian is zero at the corner there
  const uint32_t middle = kind.nodes == 10 ? 4 : 8;
  double before = 1;
  for (const double share : {0.4, 0.3, 0.26, 0.24, 0.2}) {
    RestMesh moved = cell;
    for (size_t k = 0; k < 3; ++k) {
      const double a = cell.points[3 * cell.cells[0] + k], b = cell.points[3 * cell.cells[1] + k];
      moved.points[3 * moved.cells[middle] + k] = a + share * (b - a);
    }
    const double quality = cell_quality(kind, moved.points.data(), moved.cells.data());
    EXPECT_LT(quality, before) << share;
    EXPECT_EQ(quality > 0, share > 0.25) << share;
    EXPECT_EQ(mesh_statistics(moved).flat_cells, share < 0.25 ? 1u : 0u) << share;
    before = quality;
  }
}

// A corner that is pushed in: first beyond the middles of its edges, where tetrahedra of 20 points turn
// inside out, then so far that the material does.
TEST_P(Cells, Inversion_IsThatOfTheMaterial) {
  const CellKind &kind = cell_kind(GetParam());
  const RestMesh cell = regular(GetParam());
  const auto pushed = [&](double share) {
    RestMesh out = cell;
    Vec3 middle;
    for (uint32_t p = 0; p < cell.npoint(); ++p)
      middle += (1.0 / cell.npoint()) * load3(&cell.points[3 * size_t{p}]);
    double *const corner = &out.points[3 * size_t{cell.cells[0]}];
    store3(corner, load3(corner) + share * (middle - load3(corner)));
    return out;
  };
  for (const double share : {0.0, 0.1, 0.36, 1.2}) {
    const RestMesh of = pushed(kind.nodes == 10 ? 0.8 * share : share);
    uint32_t tets = 0;
    for (size_t t = 0; t < of.tets.size(); t += 4) tets += tet_volume(of.points.data(), &of.tets[t]) < 0;
    EXPECT_TRUE(kind.nodes != 20 || tets > 0 || share < 0.35) << share;
    EXPECT_EQ(inverted_cell(kind, of.points.data(), 3, of.cells.data()), share > 1) << share;
  }
}

// Their sum is 1, that of the slopes 0, and each is 1 at its node.
TEST(CellShapes, SumToOneAndAreOneAtTheirNodes) {
  RestMesh corner(kMemory);
  corner.points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  corner.tets = {0, 1, 2, 3};
  corner.tet_group = {kNoGroup};
  corner.file_point = {0, 1, 2, 3};
  for (const uint32_t nodes : {8u, 10u, 20u, 27u}) {
    const RestMesh cell = second_order(nodes == 10 ? corner : make_bricks(kMemory, 2, 2, 2, 1));
    double value[kMaxNodes];
    Vec3 slope[kMaxNodes];
    for (uint32_t n = 0; n < nodes; ++n) {
      const Vec3 at = load3(&cell.points[3 * size_t{cell.cells[n]}]) - (nodes == 10 ? Vec3{} : Vec3{1, 1, 1});
      cell_shapes(nodes, at, value, slope);
      for (uint32_t k = 0; k < nodes; ++k) EXPECT_EQ(value[k], double(k == n)) << nodes;
    }
    cell_shapes(nodes, {0.3, -0.8, 0.1}, value, slope);
    EXPECT_NEAR(std::accumulate(value, value + nodes, 0.0), 1, 1e-15);
    EXPECT_LT(norm(std::accumulate(slope, slope + nodes, Vec3{})), 1e-15);
  }
}

// Whether each triangle of the mesh is one of the boundary.
bool on_boundary(const RestMesh &mesh) {
  std::set<std::set<uint32_t>> faces;
  const auto add = [](std::set<std::set<uint32_t>> &to, const Array<uint32_t> &of) {
    for (size_t f = 0; f < of.size(); f += 3) to.insert({of[f], of[f + 1], of[f + 2]});
  };
  add(faces, boundary_triangles(mesh.tets));
  const size_t n = faces.size();
  add(faces, mesh.tris);
  return faces.size() == n;
}

// Gmsh's order: corners, edges 01 03 04 12 15 23 26 37 45 47 56 67, faces below, y low, x low, x high, y
// high, above, middle.
TEST(CellFiles, GmshsHexahedraOfSecondOrder_AreReordered) {
  const int of[27][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2}, {2, 0, 2}, {2, 2, 2},
                         {0, 2, 2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 1, 0}, {2, 0, 1}, {1, 2, 0},
                         {2, 2, 1}, {0, 2, 1}, {1, 0, 2}, {0, 1, 2}, {2, 1, 2}, {1, 2, 2}, {1, 1, 0},
                         {1, 0, 1}, {0, 1, 1}, {2, 1, 1}, {1, 2, 1}, {1, 1, 2}, {1, 1, 1}};
  for (const uint32_t nodes : {20u, 27u}) {
    std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(nodes) + "\n", list;
    for (uint32_t k = 0; k < nodes; ++k) {
      text += std::to_string(k + 1);
      for (const int x : of[k]) text += " " + std::to_string(x);
      text += "\n";
      list += " " + std::to_string(k + 1);
    }
    text += "$EndNodes\n$Elements\n2\n1 " +
            std::string(nodes == 20 ? "16 2 7 1 1 2 3 4 9 12 14 10\n" : "10 2 7 1 1 2 3 4 9 12 14 10 21\n") +
            "2 " + std::string(nodes == 20 ? "17" : "12") + " 2 0 1" + list + "\n$EndElements\n";
    const RestMesh mesh = finish_mesh("a.msh", parse_raw(kMemory, "a.msh", text.data(), text.size()));
    const RestMesh unit = second_order(make_bricks(kMemory, 2, 2, 2, 1));
    ASSERT_EQ(mesh.cells.size(), nodes);
    for (uint32_t k = 0; k < nodes; ++k)
      EXPECT_EQ(norm(load3(&mesh.points[3 * size_t{mesh.cells[k]}]) -
                     load3(&unit.points[3 * size_t{unit.cells[k]}])),
                0)
          << k;
    EXPECT_EQ(mesh.turned, 0u);
    EXPECT_EQ(mesh.tri_group.size(), nodes == 20 ? 6u : 8u);
    EXPECT_TRUE(on_boundary(mesh));
  }
}

// The order of GMF: corners, edges as VTK's, faces below, above, y low, x high, y high, x low, middle. The
// map is quadratic.
TEST(CellFiles, MeditsHexahedraOfSecondOrder_AreReordered) {
  const int of[27][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2}, {2, 0, 2}, {2, 2, 2},
                         {0, 2, 2}, {1, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 1, 0}, {1, 0, 2}, {2, 1, 2},
                         {1, 2, 2}, {0, 1, 2}, {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}, {1, 1, 0},
                         {1, 1, 2}, {1, 0, 1}, {2, 1, 1}, {1, 2, 1}, {0, 1, 1}, {1, 1, 1}};
  const auto map = [](Vec3 x) {
    return Vec3{x.x + 0.125 * x.y * x.z, x.y - 0.0625 * x.x * x.x, x.z + 0.0625 * x.x * x.y};
  };
  std::string text = "MeshVersionFormatted 2\nDimension 3\nVertices\n27\n", list;
  for (uint32_t k = 0; k < 27; ++k) {
    const Vec3 x = map({double(of[k][0]), double(of[k][1]), double(of[k][2])});
    text += std::to_string(x.x) + " " + std::to_string(x.y) + " " + std::to_string(x.z) + " 0\n";
    list += std::to_string(k + 1) + " ";
  }
  text += "QuadrilateralsQ2\n1\n1 2 3 4 9 10 11 12 21 7\nHexahedraQ2\n1\n" + list + "0\nEnd\n";
  const RestMesh mesh = finish_mesh("a.mesh", parse_raw(kMemory, "a.mesh", text.data(), text.size()));
  const RestMesh unit = second_order(make_bricks(kMemory, 2, 2, 2, 1));
  ASSERT_EQ(mesh.cell, uint32_t(DFM_CELL_HEX27));
  for (uint32_t k = 0; k < 27; ++k)
    EXPECT_EQ(norm(load3(&mesh.points[3 * size_t{mesh.cells[k]}]) -
                   map(load3(&unit.points[3 * size_t{unit.cells[k]}]))),
              0)
        << k;
  const CellKind &kind = cell_kind(mesh.cell);
  EXPECT_GT(cell_quality(kind, mesh.points.data(), mesh.cells.data()), 0.8);
  EXPECT_FALSE(inverted_cell(kind, mesh.points.data(), 3, mesh.cells.data()));
  EXPECT_EQ(mesh.turned, 0u);
  EXPECT_EQ(mesh.tri_group.size(), 8u);
  EXPECT_TRUE(on_boundary(mesh));
}

const std::string kMsh22 = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
// Points of gmsh's second-order tetrahedron: corners, then the edges 01 12 02 03 23 13.
const std::string kTen =
    "$Nodes\n10\n1 0 0 0\n2 2 0 0\n3 0 2 0\n4 0 0 2\n5 1 0 0\n6 1 1 0\n7 0 1 0\n8 0 0 1\n9 0 1 1\n10 1 0 "
    "1\n$EndNodes\n";

RestMesh parsed(const std::string &name, const std::string &text) {
  return finish_mesh(name, parse_raw(kMemory, name, text.data(), text.size()));
}

TEST(CellFiles, GmshsOrderOfEdges_IsTurnedIntoVtks) {
  const RestMesh mesh =
      parsed("a.msh", kMsh22 + kTen + "$Elements\n1\n1 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n");
  ASSERT_EQ(mesh.cell, uint32_t(DFM_CELL_TET10));
  EXPECT_EQ(mesh.cells, (Array<uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 9, 8}));
  EXPECT_EQ(mesh.turned, 0u);
  EXPECT_NEAR(mesh_statistics(mesh).volume, 8.0 / 6, 1e-14);
}

TEST(CellFiles, ReflectedCells_AreTurned) {
  const RestMesh mesh =
      parsed("a.msh", kMsh22 + kTen + "$Elements\n1\n1 11 2 0 1 1 3 2 4 7 6 5 8 10 9\n$EndElements\n");
  EXPECT_EQ(mesh.turned, 1u);
  EXPECT_NEAR(mesh_statistics(mesh).volume, 8.0 / 6, 1e-14);
}

TEST(CellFiles, FlatHexahedron_IsOneCell) {
  RestMesh cell = make_bricks(kMemory, 1, 1, 1, 1);
  ASSERT_EQ(cell.cells.size(), 8u);
  for (size_t k = 2; k < cell.points.size(); k += 3) cell.points[k] *= 5e-4;
  EXPECT_EQ(mesh_statistics(cell).flat_cells, 1u);
}

TEST(CellFiles, GroupsOfQuadrangles_AreTrianglesOfTheBoundary) {
  const int top[4] = {5, 6, 7, 8};
  for (int first = 0; first < 4; ++first) {
    std::string msh = kMsh22 +
                      "$Nodes\n8\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 0 1 1\n"
                      "$EndNodes\n$Elements\n2\n1 3 2 7 1",
                vtk =
                    "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
                    "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1\nCELLS 2 14\n8 0 1 2 3 4 5 6 7\n4";
    for (int k = 0; k < 4; ++k) {
      msh += " " + std::to_string(top[(first + k) % 4]);
      vtk += " " + std::to_string(top[(first + k) % 4] - 1);
    }
    msh += "\n2 5 2 0 1 1 2 3 4 5 6 7 8\n$EndElements\n";
    vtk += "\nCELL_TYPES 2\n12 9\nCELL_DATA 2\nSCALARS group int 1\nLOOKUP_TABLE default\n3 7\n";
    for (const RestMesh &mesh : {parsed("a.msh", msh), parsed("a.vtk", vtk)}) {
      EXPECT_EQ(mesh.tri_group.size(), 2u);
      EXPECT_TRUE(on_boundary(mesh)) << first;
    }
  }
}

// The bottom's diagonal is shorter than its long sides.
TEST(SecondOrder, GroupedFaceOfASkewHexahedron_StaysOnTheBoundary) {
  const RestMesh mesh = second_order(parsed(
      "a.msh", kMsh22 + "$Nodes\n8\n1 0 0 0\n2 1 0 0\n3 0.134 0.5 0\n4 -0.866 0.5 0\n5 0 0 1\n6 1 0 1\n"
                        "7 0.134 0.5 1\n8 -0.866 0.5 1\n$EndNodes\n"
                        "$Elements\n2\n1 3 2 7 1 1 2 3 4\n2 5 2 0 1 1 2 3 4 5 6 7 8\n$EndElements\n"));
  EXPECT_EQ(mesh.tri_group.size(), 8u);
  EXPECT_TRUE(on_boundary(mesh));
}

TEST(CellFiles, GroupsOfSecondOrderTriangles_AreTrianglesOfTheBoundary) {
  const RestMesh msh =
      parsed("a.msh", kMsh22 + kTen +
                          "$Elements\n2\n1 9 2 7 1 1 3 2 7 6 5\n2 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n"
                          "$EndElements\n");
  const RestMesh vtk =
      parsed("a.vtk",
             "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 double\n"
             "0 0 0 1 0 0 0 1 0 0 0 1 .5 0 0 .5 .5 0 0 .5 0 0 0 .5 .5 0 .5 0 .5 .5\nCELLS 2 18\n"
             "10 0 1 2 3 4 5 6 7 8 9\n6 0 2 1 6 5 4\nCELL_TYPES 2\n24 22\nCELL_DATA 2\nSCALARS group int 1\n"
             "LOOKUP_TABLE default\n3 7\n");
  for (const RestMesh &mesh : {msh, vtk}) {
    EXPECT_EQ(mesh.tri_group.size(), 4u);
    EXPECT_TRUE(on_boundary(mesh));
    for (const MeshGroup &g : mesh.groups)
      if (g.dimension == 2) {
        EXPECT_EQ(g.points, (Array<uint32_t>{0, 1, 2, 4, 5, 6}));
      }
  }
}

// The triangle 1 4 5 is no face of a cell; point 3 of the file is in no cell.
TEST(SecondOrder, TrianglesThatAreNoFaces_StayWhole) {
  const RestMesh mesh = second_order(parsed(
      "a.msh", kMsh22 +
                   "$Nodes\n6\n1 0 0 0\n2 1 0 0\n3 9 9 9\n4 0 1 0\n5 0.3 0.3 1\n6 0.3 0.3 -1\n$EndNodes\n"
                   "$Elements\n4\n1 4 2 0 1 1 2 4 5\n2 4 2 0 1 1 4 2 6\n3 2 2 7 1 1 5 6\n4 2 2 7 1 1 2 5\n"
                   "$EndElements\n"));
  ASSERT_EQ(mesh.tri_group.size(), 5u);
  EXPECT_EQ((Array<uint32_t>{mesh.tris.begin(), mesh.tris.begin() + 3}), (Array<uint32_t>{0, 3, 4}));
  std::set<uint32_t> numbers(mesh.file_point.begin(), mesh.file_point.end());
  EXPECT_EQ(numbers.size(), mesh.npoint());
  EXPECT_EQ(numbers.count(2), 0u);
  EXPECT_EQ(mesh.warnings.size(), 1u);
}

TEST(CellFiles, WhatIsNoBody_IsRefused) {
  expect_refusal(
      "a.msh",
      kMsh22 + kTen + "$Elements\n2\n1 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n2 4 2 0 1 1 2 3 4\n$EndElements\n",
      DFM_E_UNSUPPORTED, {"tetrahedra beside second-order tetrahedra", "one kind"});
  expect_refusal("a.msh", kMsh22 + kTen + "$Elements\n1\n1 11 2 0 1 1 2 3 4 6 5 7 8 9 10\n$EndElements\n",
                 DFM_E_FORMAT, {"cell 0", "distorted", "order its points"});
  expect_refusal(
      "a.msh",
      kMsh22 + kTen +
          "$Elements\n2\n1 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n2 11 2 0 1 1 2 3 4 5 6 7 8 9 10\n$EndElements\n",
      DFM_E_FORMAT, {"on one another"});
  RestMesh filled = make_beam(kMemory, 1, 1, 1, 50);
  filled.share.assign(filled.ntet(), 0.5);
  EXPECT_THROW(second_order(filled), Error);
  EXPECT_THROW(second_order(made(DFM_CELL_HEX27)), Error);
  EXPECT_THROW(cell_kind(7), Error);
}

}  // namespace
