// Surfaces out and back in again, in every format that is written.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "mesh/raw_mesh.h"
#include "mesh_support.h"

using namespace dfm;

namespace {

std::string folder() { return test::scratch("write_surface"); }

RestMesh ball_in_groups() {
  RestMesh m = make_ball_surface(Memory::standard(), 0.1, 320);
  m.groups.push_back({"north pole", 2, 3, {}});
  m.groups.push_back({"south", 2, 8, {}});
  for (uint32_t t = 0; t < m.ntri(); ++t) m.tri_group[t] = t % 5 == 0 ? 0 : t % 5 < 3 ? 1 : kNoGroup;
  return m;
}

RestMesh there_and_back(const RestMesh &m, const std::string &ending) {
  const std::string path = folder() + "/ball" + ending;
  write_mesh(m, path);
  return read_mesh(Memory::standard(), path, DFM_MESH_SURFACE);
}

std::string refused(const RestMesh &m, const std::string &name, dfm_status status) {
  try {
    write_mesh(m, folder() + "/" + name);
  } catch (const Error &e) {
    EXPECT_EQ(e.status, status);
    return e.what();
  }
  return "";
}

}  // namespace

TEST(WriteSurface, ThereAndBack_KeepsEveryBit) {
  const RestMesh m = ball_in_groups();
  for (const char *ending : {".obj", ".ply", ".off", ".vtk", ".vtu", ".OBJ", ".Vtu"}) {
    const RestMesh back = there_and_back(m, ending);
    EXPECT_EQ(back.points, m.points) << ending;
    EXPECT_EQ(back.tris, m.tris) << ending;
    EXPECT_TRUE(back.warnings.empty()) << ending << back.warnings.front();
  }
}

TEST(WriteSurface, Groups_ComeBackWhereTheFormatHasThem) {
  const RestMesh m = ball_in_groups();
  for (const char *ending : {".obj", ".vtk", ".vtu"}) {
    const RestMesh back = there_and_back(m, ending);
    ASSERT_EQ(back.groups.size(), 2u) << ending;
    EXPECT_EQ(back.groups[0].name, "north pole") << ending;
    EXPECT_EQ(back.groups[1].name, "south") << ending;
    EXPECT_EQ(back.tri_group, m.tri_group) << ending;
  }
}

TEST(WriteSurface, ObjGroupNames_CostNoFace) {
  RestMesh m = ball_in_groups();
  m.groups[0].name = "old\\parts\\";
  m.groups[1].name = "#2 and #3#";
  const RestMesh back = there_and_back(m, ".obj");
  ASSERT_EQ(back.tris, m.tris);
  ASSERT_EQ(back.tri_group, m.tri_group);
  EXPECT_EQ(back.groups[0].name, "old\\parts_");
  EXPECT_EQ(back.groups[1].name, "_2 and _3#");
}

TEST(WriteSurface, PlyGroups_ComeBackByNumber) {
  const RestMesh m = ball_in_groups(), back = there_and_back(m, ".ply");
  ASSERT_EQ(back.groups.size(), 2u);
  EXPECT_EQ(back.groups[0].name, "3");
  EXPECT_EQ(back.groups[1].tag, 8);
  EXPECT_EQ(back.tri_group, m.tri_group);
}

TEST(WriteSurface, Stl_KeepsSinglePrecision) {
  const RestMesh m = ball_in_groups(), back = there_and_back(m, ".stl");
  ASSERT_EQ(back.ntri(), m.ntri());
  EXPECT_EQ(back.npoint(), m.npoint());
  EXPECT_TRUE(mesh_statistics(back).closed);
  EXPECT_EQ(back.turned, 0u);
  for (size_t i = 0; i < m.tris.size(); ++i)
    for (int k = 0; k < 3; ++k)
      EXPECT_EQ(back.points[3 * size_t(back.tris[i]) + k],
                double(float(m.points[3 * size_t(m.tris[i]) + k])));
}

TEST(WriteSurface, StlNormals_PointOutward) {
  const std::string path = folder() + "/ball.stl";
  write_mesh(ball_in_groups(), path);
  const std::string bytes = test::read_file(path);
  ASSERT_EQ(bytes.size(), 84u + 50 * 320);
  for (size_t t = 0; t < 320; ++t) {
    float v[12];
    std::memcpy(v, bytes.data() + 84 + 50 * t, sizeof v);
    EXPECT_NEAR(std::hypot(v[0], v[1], v[2]), 1, 1e-6);
    EXPECT_GT(v[0] * v[3] + v[1] * v[4] + v[2] * v[5], 0.09f);
  }
}

// Numbers that no short text holds, from nanometers to the largest that is read.
TEST(WriteSurface, ExtremeCoordinates_SurviveText) {
  for (const double scale : {1e-9 / 3, 1e5 / 3, 1e99 / 3}) {
    RestMesh m = make_ball_surface(Memory::standard(), 1, 20);
    for (double &x : m.points) x *= scale;
    for (const char *ending : {".obj", ".off"})
      EXPECT_EQ(there_and_back(m, ending).points, m.points) << ending << scale;
  }
}

TEST(WriteSurface, WhatAFormatCannotHold_IsRefusedAndLeavesNoFile) {
  RestMesh m = make_ball_surface(Memory::standard(), 1e50, 20);
  EXPECT_NE(refused(m, "big.stl", DFM_E_UNSUPPORTED).find("STL holds coordinates up to"), std::string::npos);
  EXPECT_NE(refused(m, "ball.xyz", DFM_E_UNSUPPORTED).find(".obj, .ply, .stl, .off, .vtk, .vtu"),
            std::string::npos);
  EXPECT_NE(refused(m, "ball", DFM_E_UNSUPPORTED).find("which is '' here"), std::string::npos);
  const std::string missing = refused(m, "none/ball.obj", DFM_E_IO);
  EXPECT_NE(missing.find("No such file"), std::string::npos) << missing;
  EXPECT_NE(missing.find("make the folder '"), std::string::npos) << missing;
  for (const auto &entry : std::filesystem::directory_iterator(folder()))
    EXPECT_EQ(entry.path().string().find("big"), std::string::npos);
}
