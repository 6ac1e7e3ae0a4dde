// The surface readers on files of our own (tests/data/surfaces): every dialect gives the same cube; every
// refusal names its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

const std::string kFolder = std::string(DEFORM_SOURCE_DIR) + "/tests/data/surfaces/";

RawMesh parse(const std::string &name, const std::string &text) {
  return parse_raw(Memory::standard(), name, text.data(), text.size());
}

void expect_refusal(const std::string &name, const std::string &text, dfm_status status,
                    std::vector<std::string> words) {
  words.push_back(name);
  test::expect_error(test::error_of([&] { parse(name, text); }), status, words);
}

// Names of groups and how many triangles each has.
std::map<std::string, uint32_t> groups_of(const RawMesh &raw) {
  std::map<std::string, uint32_t> out;
  for (const uint32_t g : raw.tri_group) ++out[g == kNoGroup ? "" : raw.groups[g].name];
  return out;
}
using Groups = std::map<std::string, uint32_t>;

// Six times the volume of the triangles' cones: tells whether the corners come in the right turn.
double volume6(const RawMesh &raw) {
  double v = 0;
  for (size_t t = 0; t < raw.tris.size(); t += 3) {
    const double *a = &raw.points[3 * raw.tris[t]];
    const double *b = &raw.points[3 * raw.tris[t + 1]];
    const double *c = &raw.points[3 * raw.tris[t + 2]];
    v += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
         a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return v;
}

const std::string kPlyHead =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string kPlyThree = "0 0 0\n1 0 0\n0 1 0\n";

}  // namespace

TEST(ReadSurface, EveryDialect_GivesTheSameCube) {
  const auto files = test::own_surfaces();
  ASSERT_EQ(files.size(), 19u);
  for (const std::string &file : files) {
    SCOPED_TRACE(file);
    const RawMesh raw = read_raw(Memory::standard(), file);
    const bool stl = file.find(".stl") != std::string::npos;
    EXPECT_EQ(raw.npoint(), stl ? 36u : 9u);
    ASSERT_EQ(raw.ntri(), 12u);
    EXPECT_EQ(raw.tri_group.size(), 12u);
    EXPECT_TRUE(raw.tets.empty());
    EXPECT_DOUBLE_EQ(volume6(raw), 6.0);
    const RestMesh mesh = read_mesh(Memory::standard(), file, DFM_MESH_SURFACE);
    EXPECT_EQ(mesh.npoint(), 8u);
    EXPECT_EQ(mesh.ntri(), 12u);
    EXPECT_EQ(mesh.turned, 0u);
    if (!stl) {
      EXPECT_EQ(mesh.file_point, (Array<uint32_t>{0, 1, 3, 4, 5, 6, 7, 8}));
    }
  }
}

TEST(ReadSurface, Groups_AreThoseOfTheFile) {
  const auto groups = [](const char *file) {
    return groups_of(read_raw(Memory::standard(), kFolder + "cube_" + file));
  };
  EXPECT_EQ(groups("obj.obj"), (Groups{{"low", 6}, {"high end", 6}}));
  EXPECT_EQ(groups("obj_quads.obj"), (Groups{{"", 12}}));
  EXPECT_EQ(groups("stl_ascii.stl"), (Groups{{"low", 6}, {"high end", 6}}));
  EXPECT_EQ(groups("stl_upper.stl"), (Groups{{"", 12}}));
  for (const char *file : {"ply_ascii.ply", "ply_little.ply", "ply_big.ply"})
    EXPECT_EQ(groups(file), (Groups{{"", 6}, {"1", 6}})) << file;
  EXPECT_EQ(groups("vtk_polydata.vtk"), (Groups{{"1", 8}, {"2", 4}}));  // vertices, lines, polygons, strips
  EXPECT_EQ(groups("medit.mesh"), (Groups{{"1", 6}, {"2", 6}}));
  EXPECT_EQ(groups("msh22.msh"), (Groups{{"1", 6}, {"2", 6}}));
}

TEST(ReadSurface, ObjGroup_IsWhatGSaysElseTheMaterialElseTheObject) {
  const std::string v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", f = "f 1 2 3\n";
  EXPECT_EQ(groups_of(parse("a.obj", v + "o whole\n" + f + "usemtl red\n" + f + "g part\n" + f +
                                         "usemtl blue\n" + f + "g default\n" + f)),
            (Groups{{"whole", 1}, {"red", 1}, {"part", 2}, {"blue", 1}}));
  EXPECT_TRUE(parse("a.obj", v + "g empty\ng\n" + f).groups.empty());  // a group without faces is none
}

TEST(ReadSurface, ObjRecordsThatAreSkipped_MayBeContinued) {
  const std::string v = "v 0 0 0\nv 1 0 0 1 \\\n 0 0\nv 0 1 0\n", f = "f 1 2 \\\n 3\n";
  EXPECT_EQ(parse("a.obj", v + "l 1 2 \\\r\n3\n" + f + "# f 1 \\\n" + f + "f 1 2 3 # f 2 \\\n" + f).ntri(),
            4u);
}

TEST(ReadSurface, PolygonOfNCorners_IsAFanOfNMinusTwoTriangles) {
  std::string text;
  for (int k = 0; k < 7; ++k) text += "v " + std::to_string(k) + " " + std::to_string(k * k) + " 0\n";
  const RawMesh raw = parse("a.obj", text + "f 1 2 3 4 5 6 7\n");
  ASSERT_EQ(raw.ntri(), 5u);
  for (uint32_t t = 0; t < 5; ++t) {
    EXPECT_EQ(raw.tris[3 * t], 0u);
    EXPECT_EQ(raw.tris[3 * t + 1], t + 1);
    EXPECT_EQ(raw.tris[3 * t + 2], t + 2);
  }
}

// Twice the area of a plane polygon's triangles, with its sign.
std::vector<double> doubled_areas(const RawMesh &raw) {
  std::vector<double> out;
  for (uint32_t t = 0; t < raw.ntri(); ++t) {
    const auto p = [&](uint32_t k, uint32_t axis) { return raw.points[3 * raw.tris[3 * t + k] + axis]; };
    out.push_back((p(1, 0) - p(0, 0)) * (p(2, 1) - p(0, 1)) - (p(2, 0) - p(0, 0)) * (p(1, 1) - p(0, 1)));
  }
  return out;
}

TEST(ReadSurface, PolygonThatIsNotConvex_IsCutWithoutAFold) {
  for (int corners = 4; corners <= 40; corners += 2) {
    std::string text, face = "f";
    double doubled = 0, last[2] = {0.1, 0};
    for (int k = 0; k <= corners; ++k) {  // a star, from an inner corner on
      const double r = k % 2 ? 0.3 : 0.1, angle = 2 * M_PI * (k % corners) / corners;
      const double x = r * std::cos(angle), y = r * std::sin(angle);
      doubled += last[0] * y - last[1] * x;
      last[0] = x;
      last[1] = y;
      if (k == corners) break;
      text += "v " + std::to_string(x) + " " + std::to_string(y) + " 0\n";
      face += " " + std::to_string((k + corners - 1) % corners + 1);
    }
    const RawMesh raw = parse("a.obj", text + face + "\n");
    ASSERT_EQ(raw.ntri(), uint32_t(corners - 2));
    double sum = 0;
    for (const double a : doubled_areas(raw)) {
      EXPECT_GT(a, 0) << corners << " corners";
      sum += a;
    }
    EXPECT_NEAR(sum, doubled, 1e-5) << corners << " corners";
  }
}

TEST(ReadSurface, PolygonThatCrossesItself_IsCutAllTheSame) {
  const RawMesh raw = parse("a.obj", "v 0 0 0\nv 2 1 0\nv 2 0 0\nv 0 1 0\nv -1 0.5 0\nf 1 2 3 4 5\n");
  EXPECT_EQ(raw.ntri(), 3u);
}

TEST(ReadSurface, ObjRefusals_NameLineAndReason) {
  const std::string v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  expect_refusal("a.obj", v + "f 1 2 0\n", DFM_E_FORMAT, {"a.obj:4:", "vertex 0", "from 1"});
  expect_refusal("a.obj", v + "f 1 2 4\n", DFM_E_FORMAT, {"a.obj:4:", "vertex 4", "only 3"});
  expect_refusal("a.obj", v + "f 1 2 -4\n", DFM_E_FORMAT, {"a.obj:4:", "vertex -4"});
  expect_refusal("a.obj", v + "f 1 2\n", DFM_E_FORMAT, {"a.obj:4:", "2 corners"});
  expect_refusal("a.obj", v + "f 1 2 x\n", DFM_E_FORMAT, {"a.obj:4:", "'x'"});
  expect_refusal("a.obj", "v 0 0\n" + v, DFM_E_FORMAT, {"a.obj:1:", "coordinate"});
  expect_refusal("a.obj", "v 0 0 nan\n", DFM_E_FORMAT, {"a.obj:1:", "finite", "'nan'"});
  expect_refusal("a.obj", "hello\n", DFM_E_FORMAT, {"a.obj:1:", "'hello'"});
  expect_refusal("a.obj", "# nothing\n\n", DFM_E_FORMAT, {"no records"});
}

TEST(ReadSurface, PlyRefusals_NamePlaceAndReason) {
  const std::string faces = "element face 1\nproperty list uchar int vertex_index\nend_header\n";
  EXPECT_EQ(parse("a.ply", kPlyHead + faces + kPlyThree + "3 0 1 2").ntri(), 1u);
  expect_refusal("a.ply", kPlyHead + faces + kPlyThree + "3 0 1 3\n", DFM_E_FORMAT,
                 {"a.ply:13:", "vertex 3", "0 to 2"});
  expect_refusal("a.ply", kPlyHead + faces + kPlyThree + "200 0 1 2\n", DFM_E_FORMAT, {"a.ply:13:", "200"});
  expect_refusal("a.ply", kPlyHead + faces + kPlyThree + "2 0 1\n", DFM_E_FORMAT, {"2 corners"});
  expect_refusal("a.ply", kPlyHead + faces + "0 0 inf\n", DFM_E_FORMAT, {"cannot hold"});
  expect_refusal("a.ply", kPlyHead + faces + "0 0 inf\n" + kPlyThree, DFM_E_FORMAT, {"a.ply:10:", "'inf'"});
  expect_refusal("a.ply", kPlyHead + "element face 1\nproperty int a\nend_header\n" + kPlyThree + "1\n",
                 DFM_E_FORMAT, {"vertex_indices"});
  expect_refusal("a.ply",
                 kPlyHead + "element face 1\nproperty list uchar float vertex_indices\nend_header\n" +
                     kPlyThree + "3 0 1 2\n",
                 DFM_E_FORMAT, {"whole"});
  expect_refusal("a.ply",
                 kPlyHead + "element tristrips 1\nproperty list uchar int vertex_indices\nend_header\n" +
                     kPlyThree + "3 0 1 2\n",
                 DFM_E_UNSUPPORTED, {"triangle strips", "meshio convert"});
  expect_refusal("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n", DFM_E_FORMAT,
                 {"without properties"});
  expect_refusal(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
      DFM_E_FORMAT, {"no property z"});
  expect_refusal("a.ply", "ply\nformat zip 1.0\nend_header\n", DFM_E_FORMAT, {"a.ply:2:", "'zip'"});
  expect_refusal("a.ply", "ply\nformat ascii 1.0\nproperty float x\nend_header\n", DFM_E_FORMAT,
                 {"before any element"});
  expect_refusal("a.ply", "ply\nend_header\n", DFM_E_FORMAT, {"no format"});
  expect_refusal("a.ply", "ply\nformat ascii 1.0\n", DFM_E_FORMAT, {"end_header is missing"});
}

TEST(ReadSurface, StlRefusals_NamePlaceAndReason) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  EXPECT_EQ(parse("a.stl", "solid\n" + facet + "endsolid").ntri(), 1u);
  std::string line = facet;  // white space is free
  std::replace(line.begin(), line.end(), '\n', ' ');
  EXPECT_EQ(parse("a.stl", "solid\n" + line + "endsolid").ntri(), 1u);
  expect_refusal("a.stl", "solid\nfacet normal 0 0 1\nvertex 0 0 0\n", DFM_E_FORMAT, {"'outer'", "'vertex'"});
  expect_refusal("a.stl", "solid\n" + facet, DFM_E_FORMAT, {"'facet' or 'endsolid'", "end of the file"});
  expect_refusal("a.stl", "solid\n" + facet + "endsolid\nfacet", DFM_E_FORMAT, {"a.stl:10:", "'solid'"});
  expect_refusal("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
                 DFM_E_FORMAT, {"a.stl:6:", "'vertex'"});
  expect_refusal("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n", DFM_E_FORMAT,
                 {"a.stl:4:", "'zero'"});
  expect_refusal("a.stl", "hello", DFM_E_FORMAT, {"5 bytes", "84"});
  std::string binary(84 + 50, '\0');
  binary[80] = 1;
  EXPECT_EQ(parse("a.stl", binary).ntri(), 1u);
  EXPECT_EQ(parse("a.stl", binary + "tail").ntri(), 1u);  // some writers append a few bytes
  binary[80] = 2;
  expect_refusal("a.stl", binary, DFM_E_FORMAT, {"2 triangles", "184"});
  expect_refusal("a.stl", "solid x " + binary.substr(8), DFM_E_FORMAT, {"2 triangles", "truncated"});
  binary[80] = 0;
  // 50 bytes more than promised: a part would be lost
  expect_refusal("a.stl", binary, DFM_E_FORMAT, {"0 triangles", "count is wrong"});
}

TEST(ReadSurface, OffRefusals_NamePlaceAndReason) {
  const std::string v = "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(parse("a.off", "OFF\n3 1 0\n" + v + "3 0 1 2").ntri(), 1u);
  expect_refusal("a.off", "OFF\n3 1 0\n" + v + "3 0 1 3\n", DFM_E_FORMAT, {"a.off:6:", "vertex 3", "0 to 2"});
  expect_refusal("a.off", "OFF\n3 1 0\n" + v + "3 0 1 -1\n", DFM_E_FORMAT, {"vertex -1"});
  expect_refusal("a.off", "OFF\n3 1 0\n" + v + "2 0 1\n", DFM_E_FORMAT, {"2 corners"});
  expect_refusal("a.off", "OFF\n3 1 0\n" + v + "90 0 1\n", DFM_E_FORMAT, {"90"});
  expect_refusal("a.off", "OFF\n3 2 0\n" + v + "3 0 1 2\n", DFM_E_FORMAT, {"end of the file"});
  expect_refusal("a.off", "OFF\n-3 1 0\n", DFM_E_FORMAT, {"-3 vertices", "negative"});
  expect_refusal("a.off", "4OFF\n1 0 0\n0 0 0 0\n", DFM_E_UNSUPPORTED, {"three coordinates"});
  expect_refusal("a.off", "hello\n", DFM_E_FORMAT, {"a.off:1:", "'hello'", "COFF"});
}

TEST(ReadSurface, CurvedFacesAlone_AreReadUpToSecondOrder) {
  const std::string nodes =
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n8\n1 0 0 0\n2 2 0 0\n3 2 2 0\n4 0 2 0\n5 1 0 0\n6 2 1 "
      "0\n7 1 2 0\n8 0 1 0\n$EndNodes\n";
  EXPECT_EQ(parse("a.msh", nodes + "$Elements\n1\n1 9 0 1 2 3 5 6 7\n$EndElements\n").ntri(), 4u);
  EXPECT_EQ(parse("a.msh", nodes + "$Elements\n1\n1 16 0 1 2 3 4 5 6 7 8\n$EndElements\n").ntri(), 6u);
  // a triangle of third order has ten points, one here in twice
  expect_refusal("a.msh", nodes + "$Elements\n1\n1 21 0 1 2 3 4 5 6 7 8 1 2\n$EndElements\n",
                 DFM_E_UNSUPPORTED, {"above second order"});
  const std::string grid =
      "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n0 0 0 2 0 "
      "0 2 2 0 0 2 0 1 0 0 2 1 0 1 2 0 0 1 0\n"
      "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n";
  EXPECT_EQ(parse("a.vtk", grid + "23\n").ntri(), 6u);
  expect_refusal("a.vtk", grid + "36\n", DFM_E_UNSUPPORTED, {"second- or higher-order", "-order 1"});
}
