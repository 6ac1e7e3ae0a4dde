// Parts of the scene reader on their own: text to tree, rotations, jitter, sharing of forces.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "scene/jitter.h"
#include "scene/node.h"
#include "scene/rotation.h"
#include "scene/select.h"
#include "scene/table.h"
#include "support.h"

using namespace dfm::scene;
using dfm::Quat;

namespace {

std::string sentence_of(const std::string &text) {
  try {
    parse_text(text, "s.json");
  } catch (const dfm::Error &e) {
    return e.sentence;
  }
  return "";
}

}  // namespace

TEST(Parse, RepeatedKey_IsRefusedWithItsLine) {
  EXPECT_EQ(sentence_of("{\"a\": 1,\n \"b\": {\"a\": 2}}"), "");
  EXPECT_NE(
      sentence_of("{\"a\": 1,\n \"b\": 2,\n  \"a\": 3}").find("s.json:3:3: the key \"a\" is given twice"),
      std::string::npos);
}

TEST(Parse, BracketsInStrings_AreNoNesting) {
  EXPECT_EQ(sentence_of("{\"a\": \"" + std::string(1000, '[') + "\\\"[\"}"), "");
}

TEST(Parse, Nesting_IsBounded) {
  EXPECT_NE(sentence_of(std::string(10 << 20, '[')).find("s.json:1:65: brackets nested deeper than 64"),
            std::string::npos);
  EXPECT_EQ(sentence_of(std::string(64, '[') + std::string(64, ']')), "");
}

// Levels of the pointer and of the value count together, or a long pointer would exhaust the stack.
TEST(Parse, Nesting_IsBoundedInSettings) {
  const auto levels = [](size_t n, const std::string &value) {
    std::string pointer;
    for (size_t i = 0; i < n; ++i) pointer += "/a";
    json tree = json::object();
    try {
      apply_set(tree, pointer + "=" + value, "s.json");
    } catch (const dfm::Error &e) {
      return e.sentence;
    }
    return std::string();
  };
  EXPECT_EQ(levels(64, "1"), "");
  EXPECT_EQ(levels(60, "[[[[]]]]"), "");
  EXPECT_NE(levels(60, "[[[[[]]]]]").find("nested deeper than 64"), std::string::npos);
  EXPECT_NE(levels(2000, "1").find("a pointer of 2000 steps; a scene has at most 64"), std::string::npos);
}

TEST(Parse, BadSyntax_NamesLineAndColumn) {
  EXPECT_NE(sentence_of("{\n  \"a\": 1\n  \"b\": 2\n}").find("s.json:3:"), std::string::npos);
  EXPECT_NE(sentence_of("{\"a\": NaN}").find("numbers must be finite"), std::string::npos);
  EXPECT_EQ(sentence_of("{\"-1e999\": 2e-999,\n \"a\": [-1e999]}"),
            "s.json:2:8: the number -1e999 is too large; numbers are at most 1.8e308 in size");
  EXPECT_NE(sentence_of("").find("empty"), std::string::npos);
}

TEST(Parse, RandomBytes_NeverCrash) {
  std::mt19937 random(5);
  const std::string alphabet = "{}[]\":,\\ \n0123456789.eE+-truefalsn/*\t\xff\xc3\x80";
  for (int n = 0; n < 20000; ++n) {
    std::string text;
    for (size_t i = random() % 60; i > 0; --i) text += alphabet[random() % alphabet.size()];
    sentence_of(text);
  }
}

TEST(Set, PointerAndValue_ChangeTheTree) {
  json tree = json::parse(R"({"a": {"b": [1, 2]}})");
  apply_set(tree, "/a/b/1=7", "s");
  apply_set(tree, "/a/b/-=[1,{}]", "s");
  apply_set(tree, "/new/deep=word", "s");
  apply_set(tree, "/a~1b=\"x=y\"", "s");
  EXPECT_EQ(tree, json::parse(R"({"a": {"b": [1, 7, [1, {}]]}, "new": {"deep": "word"}, "a/b": "x=y"})"));
}

TEST(Set, WrongPlace_IsReported) {
  json tree = json::parse(R"({"a": [1, 2], "n": 3})");
  EXPECT_THROW(apply_set(tree, "a=1", "s"), dfm::Error);
  EXPECT_THROW(apply_set(tree, "/a", "s"), dfm::Error);
  EXPECT_THROW(apply_set(tree, "/a/2=1", "s"), dfm::Error);
  EXPECT_THROW(apply_set(tree, "/a/x=1", "s"), dfm::Error);
  EXPECT_THROW(apply_set(tree, "/n/x=1", "s"), dfm::Error);
}

TEST(Rotation, QuarterTurns_AreExact) {
  const double z[3] = {0, 0, 5}, x[3] = {1, 0, 0};
  double out[3];
  rotate(rotation(z, 180), x, out);
  EXPECT_EQ(out[0], -1);
  EXPECT_EQ(out[1], 0);
  rotate(rotation(z, 90), x, out);
  EXPECT_NEAR(out[0], 0, 2.3e-16);
  EXPECT_NEAR(out[1], 1, 2.3e-16);
}

TEST(Rotation, AnyAngle_AgreesWithTheMathLibrary) {
  const double axis[3] = {0.3, -0.4, 1.2}, n = 1.3;
  constexpr double kHalfTurn = 1e-15;  // the reference rounds an angle of up to pi to 4.4e-16
  for (double angle = -1000; angle < 1000; angle += 7.3) {
    const Quat q = rotation(axis, angle);
    const double half = std::remainder(angle / 2, 360.0) * M_PI / 180;
    EXPECT_NEAR(q.w, std::cos(half), kHalfTurn) << angle;
    EXPECT_NEAR(q.x, std::sin(half) * axis[0] / n, kHalfTurn) << angle;
    EXPECT_NEAR(q.z, std::sin(half) * axis[2] / n, kHalfTurn) << angle;
  }
}

TEST(Rotation, OntoDirection_TurnsZ) {
  const double z[3] = {0, 0, 1};
  for (const auto &d : {std::array<double, 3>{0, 0, 2},
                        {0, 0, -3},
                        {1e-9, 0, -1},
                        {1, 2, -3},
                        {1e-200, 0, 1e-200},
                        {1, 0, 0}}) {
    double out[3];
    rotate(rotation_to(d.data()), z, out);
    const double scale = std::max({std::fabs(d[0]), std::fabs(d[1]), std::fabs(d[2])});
    const double n = std::hypot(d[0] / scale, d[1] / scale, d[2] / scale);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(out[k], d[size_t(k)] / scale / n, 1e-15);
  }
}

TEST(Jitter, StaysWithinItsBounds_AndFollowsTheSeed) {
  const double center[3] = {0.5, 0, 2};
  dfm_pose first = {};
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    Jitter jitter(seed);
    dfm_pose pose = {{1, 2, 3}, {0, 0, 0, 1}};
    double v[3] = {1, -2, 0}, spin[3] = {0, 0, 4};
    jitter.apply(2.0, center, pose, v, spin);
    const Quat q = dfm::load_quat(pose.rotation);
    double moved[3];
    rotate(q, center, moved);
    for (int k = 0; k < 3; ++k)
      EXPECT_LE(std::fabs(moved[k] + pose.position[k] - (center[k] + 1 + k)), 2e-3 + 1e-12);
    EXPECT_LE(2 * std::acos(std::min(1.0, q.w)) * 180 / M_PI, 0.5 + 1e-6);
    EXPECT_LE(std::fabs(v[0] - 1), 0.01 + 1e-12);
    EXPECT_EQ(v[1], -2 * v[0]);
    EXPECT_LE(std::fabs(spin[2] - 4), 0.04 + 1e-12);
    if (seed == 1) first = pose;
    else EXPECT_NE(pose.position[0], first.position[0]);
  }
}

TEST(Share, FaceOfACube_GetsTheConsistentLoad) {
  // Unit cube of five tetrahedra; the face x = 1 has two triangles, so two of its corners carry
  // 1/3 and two 1/6.
  BodyMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.insert(mesh.points.end(), {double(i & 1), double((i >> 1) & 1), double((i >> 2) & 1)});
  const std::vector<uint32_t> tets = {0, 1, 2, 4, 1, 3, 2, 7, 1, 7, 4, 5, 2, 7, 6, 4, 1, 2, 4, 7};
  mesh.info.tets = tets.data();
  mesh.info.npoint = 8;
  mesh.info.ntet = 5;
  mesh.size = std::sqrt(3.0);
  const std::vector<uint32_t> triangles = {1, 3, 7, 1, 7, 5, 0, 4, 2, 2, 4, 6};
  const std::vector<uint32_t> face = {1, 3, 5, 7};
  const std::vector<double> w = share_by_area(face, mesh, triangles);
  EXPECT_NEAR(w[0], 1.0 / 3, 1e-15);
  EXPECT_NEAR(w[1], 1.0 / 6, 1e-15);
  EXPECT_NEAR(w[2], 1.0 / 6, 1e-15);
  EXPECT_NEAR(w[3], 1.0 / 3, 1e-15);
  EXPECT_TRUE(share_by_area({1, 3}, mesh, triangles).empty());
  const std::vector<double> m = share_by_mass(face, mesh);
  EXPECT_NEAR(m[0] + m[1] + m[2] + m[3], 1, 1e-15);
  // 1 and 7 belong to four cells, 3 and 5 to one
  EXPECT_NEAR(m[0] / m[1], (3 * 1.0 / 6 + 1.0 / 3) / (1.0 / 6), 1e-12);

  const dfm::CellFinder &finder = mesh.finder();
  double weights[4], away;
  const double inside[3] = {0.1, 0.1, 0.1}, outside[3] = {1.5, 0.5, 0.5};
  const uint32_t tet = finder.find(finder.local(inside), away);
  EXPECT_EQ(away, 0);
  finder.corner_weights(finder.local(inside), tet, weights);
  for (int k = 0; k < 3; ++k) {
    double x = 0;
    for (size_t c = 0; c < 4; ++c)
      x += weights[c] * mesh.points[3 * size_t(mesh.info.tets[4 * size_t{tet} + c]) + size_t(k)];
    EXPECT_NEAR(x, inside[k], 1e-15);
  }
  finder.find(finder.local(outside), away);
  EXPECT_NEAR(away, 0.5, 1e-12);
}

TEST(Nodal, Table_IsReadByFileNumbers) {
  BodyMesh mesh;
  const std::vector<uint32_t> file_point = {4, 0, 2};
  mesh.info.npoint = 3;
  mesh.info.file_point = file_point.data();
  const std::string path = test::scratch("nodal") + "/bc.csv";
  test::write_file(path,
                   "node,fixx,fixy,fixz,fx,fy,fz\n0,1,0,1,0,0,0\n4,0,0,0,1.5,-2e-1,0\n\n1,1,1,1,0,0,0\n");
  const std::vector<NodalRow> rows = read_nodal(path, mesh);
  ASSERT_EQ(rows.size(), 2u);  // node 1 belongs to no cell: holding it means nothing
  EXPECT_EQ(rows[0].point, 1u);
  EXPECT_EQ(rows[0].axes, 5u);
  EXPECT_EQ(rows[1].point, 0u);
  EXPECT_EQ(rows[1].force[1], -0.2);
  EXPECT_THROW(read_nodal(test::scratch("nodal"), mesh), dfm::Error) << "a folder";
  for (const char *bad :
       {"", "node,x\n", "node,fixx,fixy,fixz,fx,fy,fz\n9,1,1,1,0,0,0\n",
        "node,fixx,fixy,fixz,fx,fy,fz\n0,2,1,1,0,0,0\n", "node,fixx,fixy,fixz,fx,fy,fz\n0,1,1,1,0,0,nan\n",
        "node,fixx,fixy,fixz,fx,fy,fz\n0,1,1,1,0,0\n", "node,fixx,fixy,fixz,fx,fy,fz\n1,0,0,0,1,0,0\n",
        "node,fixx,fixy,fixz,fx,fy,fz\n0.5,0,0,0,1,0,0\n"}) {
    test::write_file(path, bad);
    EXPECT_THROW(read_nodal(path, mesh), dfm::Error) << bad;
  }
}
