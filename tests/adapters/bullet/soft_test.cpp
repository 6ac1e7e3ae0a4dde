// Soft bodies of Bullet's become bodies of a dfm_world.
#include <BulletSoftBody/btSoftBody.h>
#include <gtest/gtest.h>

#include <fstream>

#include "bullet.h"
#include "support.h"

namespace {

using namespace test;

struct Cube {
  btSoftBodyWorldInfo info;
  btVector3 corners[8];
  btScalar masses[8];
  std::unique_ptr<btSoftBody> body;
  Cube() {
    for (int i = 0; i < 8; ++i) {
      corners[i] = bt({i & 1 ? 0.2 : 0, i & 2 ? 0.2 : 0, i & 4 ? 0.2 : 0});
      masses[i] = 1;
    }
    body = std::make_unique<btSoftBody>(&info, 8, corners, masses);
    for (int i = 0; i < 8; ++i) body->m_nodes[i].m_v = btVector3(1, 0, 2);
  }
  void append_faces() {
    const int faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                              {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    for (const auto &f : faces) body->appendFace(f[0], f[1], f[2]);
  }
};

dfm_body taken(Bullet &b, const Cube &cube, uint32_t cells, dfm_body_def like = dfm_body_def_default()) {
  dfm_material_def gel = dfm_material_def_default();
  like.name = "cube";
  ok(dfm_material_create(b.soft, &gel, &like.material));
  dfm_body out = 0;
  ok(dfm_bullet_take_soft_body(b.context, b.soft, cube.body.get(), &like, cells, &out));
  return out;
}

}  // namespace

TEST(BulletSoft, Tetrahedra_AreTakenWithHeldNodesAndVelocity) {
  Bullet b;
  Cube cube;
  const int cells[5][4] = {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}};
  for (const auto &c : cells) cube.body->appendTetra(c[0], c[1], c[2], c[3]);
  for (int i = 4; i < 8; ++i) cube.body->setMass(i, 0);
  const dfm_body body = taken(b, cube, 0);
  EXPECT_NEAR(measure(body).mass, 8, 1e-5);  // of 1000 kg/m3
  EXPECT_GT(measure(body).velocity[2], 0.5);
  for (int i = 0; i < 300; ++i) b.step(1e-2);
  EXPECT_GT(measure(body).com[2], 0.05);  // it hangs by what is held
  EXPECT_LT(measure(body).com[2], 0.1);
}

// The def of another body: its mesh, and the arrays that go by that mesh, are not read.
TEST(BulletSoft, DefOfAnotherBody_GivesNoMeshAndNoPlace) {
  Bullet b;
  Cube cube;
  cube.append_faces();
  cube.body->setVelocity(btVector3(0, 0, 0));
  const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const uint32_t tet[4] = {0, 1, 2, 3};
  const std::unique_ptr<uint8_t[]> fixed(new uint8_t[4]{7, 7, 7, 7});
  dfm_body_def like = dfm_body_def_default();
  like.points = corners;
  like.tets = tet;
  like.npoint = 4;
  like.ntet = 1;
  like.fixed = fixed.get();
  like.pose.position[2] = 1;
  like.spin[0] = 1;
  const dfm_body body = taken(b, cube, 300, like);
  EXPECT_NEAR(measure(body).com[2], 0.1, 1e-3);
  EXPECT_NEAR(measure(body).angular[0], 0, 1e-9);
  for (int i = 0; i < 10; ++i) b.step(1e-2);
  EXPECT_LT(measure(body).velocity[2], -0.9);  // nothing of it is held
}

TEST(BulletSoft, FacesThatClose_AreFilled) {
  Bullet b;
  Cube cube;
  cube.append_faces();
  EXPECT_NEAR(measure(taken(b, cube, 300)).mass, 8, 0.1);
}

TEST(BulletSoft, PinnedNodesOfFaces_HoldTheCellsAroundThem) {
  for (const char *model : {"msm", "modal"}) {  // the second one must know them when it is made
    Bullet b;
    Cube cube;
    cube.append_faces();
    for (int i = 4; i < 8; ++i) cube.body->setMass(i, 0);
    cube.body->setVelocity(btVector3(0, 0, 0));
    dfm_body_def like = dfm_body_def_default();
    like.model = model;
    const dfm_body hung = taken(b, cube, 300, like);
    for (int i = 0; i < 100; ++i) b.step(1e-2);
    EXPECT_GT(measure(hung).com[2], 0.05) << model;  // it hangs by its corners
  }
}

TEST(BulletSoft, LinksAlone_AreRefused) {
  Bullet b;
  Cube cube;
  cube.body->appendLink(0, 1);
  dfm_body_def like = dfm_body_def_default();
  dfm_body out = 0;
  EXPECT_EQ(dfm_bullet_take_soft_body(b.context, b.soft, cube.body.get(), &like, 0, &out), DFM_E_ARG);
}

// The form that btSoftBodyHelpers::CreateFromVtkFile reads.
TEST(BulletSoft, VtkFileOfBullet_IsReadAsAMesh) {
  Context c;
  const std::string path = scratch("bullet_vtk") + "/ball.vtk";
  const char *const text =
      "# vtk DataFile Version 2.0\nball\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n"
      "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\n\n"
      "CELL_TYPES 2\n10\n10\n";
  std::ofstream(path) << text;
  dfm_mesh_handle mesh = 0;
  ok(dfm_mesh_load(c, path.c_str(), DFM_MESH_CELLS, &mesh));
  dfm_mesh_info info{};
  info.size = sizeof info;
  ok(dfm_mesh_get_info(mesh, &info));
  EXPECT_EQ(info.npoint, 5u);
  EXPECT_EQ(info.ntet, 2u);
}
