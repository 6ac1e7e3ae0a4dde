// Every shape of Bullet carries a soft ball, as part of the world and as part of a body.
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <gtest/gtest.h>

#include <functional>

#include "bullet.h"

namespace {

using namespace test;

constexpr double kTop = 0.2;  // every stand ends at this height

struct Stand {
  const char *name;
  std::function<btCollisionShape *(Bullet &)> make;
  double below;  // where its center is: so far below the top
  bool solid;
  double play = 0;  // how much lower than a flat top the shape may be
};

btScalar s(double x) { return btScalar(x); }

// A table of eight points, twice as large where `scale` is 0.5.
struct Table {
  std::vector<btScalar> points;
  std::vector<int> faces{0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                         1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
  btTriangleIndexVertexArray array;
  explicit Table(double scale) {
    for (const double z : {-0.1, 0.1})
      for (const auto &[x, y] : {std::pair{-0.3, -0.3}, {0.3, -0.3}, {0.3, 0.3}, {-0.3, 0.3}})
        points.insert(points.end(), {s(x / scale), s(y / scale), s(z / scale)});
    btIndexedMesh mesh;
    mesh.m_numTriangles = 12;
    mesh.m_triangleIndexBase = reinterpret_cast<const unsigned char *>(faces.data());
    mesh.m_triangleIndexStride = 3 * sizeof(int);
    mesh.m_numVertices = 8;
    mesh.m_vertexBase = reinterpret_cast<const unsigned char *>(points.data());
    mesh.m_vertexStride = 3 * sizeof(btScalar);
    mesh.m_vertexType = kSingle ? PHY_FLOAT : PHY_DOUBLE;
    array.addIndexedMesh(mesh);
  }
};
Table &table() {
  static Table *const t = new Table(1);
  return *t;
}

btCollisionShape *hull(Bullet &b) {
  auto *const h = b.shape<btConvexHullShape>();
  for (size_t i = 0; i < table().points.size(); i += 3)
    h->addPoint(btVector3(table().points[i], table().points[i + 1], table().points[i + 2]));
  return h;
}
btCollisionShape *scaled(Bullet &b) {
  static Table *const large = new Table(0.5);
  auto *const mesh = b.shape<btBvhTriangleMeshShape>(&large->array, true);
  return b.shape<btScaledBvhTriangleMeshShape>(mesh, btVector3(s(0.5), s(0.5), s(0.5)));
}
btCollisionShape *heights(Bullet &b) {
  static const std::vector<float> *const flat = new std::vector<float>(81, 0.25f);
  // its own origin is the middle between the least and the largest height
  auto *const h = b.shape<btHeightfieldTerrainShape>(9, 9, flat->data(), s(0), s(0.5), 2, false);
  h->setLocalScaling(btVector3(s(0.1), s(0.1), 1));
  return h;
}
btCollisionShape *compound(Bullet &b) {
  auto *const outer = b.shape<btCompoundShape>(), *const inner = b.shape<btCompoundShape>();
  for (const double x : {-0.15, 0.15})
    inner->addChildShape(at({x, 0, -0.2}), b.shape<btBoxShape>(bt({0.15, 0.3, 0.1})));
  outer->addChildShape(at({0, 0, 0.1}), inner);
  return outer;
}

const Stand kStands[] = {
    {"box", [](Bullet &b) { return b.shape<btBoxShape>(bt({0.3, 0.3, 0.1})); }, 0.1, true},
    {"sphere", [](Bullet &b) { return b.shape<btSphereShape>(s(0.5)); }, 0.5, true, 0.01},
    {"capsule_x", [](Bullet &b) { return b.shape<btCapsuleShapeX>(s(0.5), s(1)); }, 0.5, true, 0.01},
    {"capsule_z", [](Bullet &b) { return b.shape<btCapsuleShapeZ>(s(0.3), s(0.4)); }, 0.5, true, 0.02},
    {"cylinder_standing", [](Bullet &b) { return b.shape<btCylinderShapeZ>(bt({0.4, 0.4, 0.15})); }, 0.15,
     true},
    {"cylinder_lying", [](Bullet &b) { return b.shape<btCylinderShapeX>(bt({0.5, 0.5, 0.5})); }, 0.5, true,
     0.01},
    {"hull", hull, 0.1, true},
    {"cone", [](Bullet &b) { return b.shape<btConeShapeZ>(s(3), s(1.5)); }, 0.75, true, 0.12},
    {"compound", compound, 0, true},
    {"mesh", [](Bullet &b) { return b.shape<btBvhTriangleMeshShape>(&table().array, true); }, 0.1, false},
    {"scaled_mesh", scaled, 0.1, false},
    {"heights", heights, 0, false},
    {"plane", [](Bullet &b) { return b.shape<btStaticPlaneShape>(btVector3(0, 0, 1), s(0.05)); }, 0.05,
     false},
};

class BulletStand : public ::testing::TestWithParam<Stand> {};
class BulletSolid : public BulletStand {};

}  // namespace

TEST_P(BulletStand, OfTheWorld_CarriesABall) {
  Bullet b;
  set_friction(b.soft, 0.8);
  b.body(GetParam().make(b), 0, {0, 0, kTop - GetParam().below});
  const dfm_body ball = soft_ball(b, {0, 0, kTop + 0.105}, {}, 3e4, 30);
  b.run(0.25);
  EXPECT_GT(stats(b.soft).contacts, 0u);
  EXPECT_GT(lowest(ball), kTop - GetParam().play - 1e-6);
  EXPECT_LT(lowest(ball), kTop + 2e-3);
}

// The same shape on a heavy body without gravity: what the ball loses it has.
TEST_P(BulletSolid, OfABody_PushesWithItsMass) {
  Bullet b({0, 0, 0});
  btRigidBody *const body =
      b.body(GetParam().make(b), 5, {0, 0, kTop - GetParam().below}, {}, {0.3, 0.35, 0.4});
  const dfm_body ball = soft_ball(b, {0.05, 0, kTop + 0.105}, {0, 0, -1});
  Momenta start, end;
  add(start, measure(ball));
  b.add_to(start, body);
  b.run(0.1);
  add(end, measure(ball));
  b.add_to(end, body);
  EXPECT_LT(velocity(body)[2], -0.1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
}

std::string name_of(const ::testing::TestParamInfo<Stand> &p) { return p.param.name; }
INSTANTIATE_TEST_SUITE_P(All, BulletStand, ::testing::ValuesIn(kStands), name_of);
INSTANTIATE_TEST_SUITE_P(All, BulletSolid, ::testing::ValuesIn(kStands, kStands + 9), name_of);

// Sizes, children and scales that change are seen in the next tick; arrays when the caller says so.
TEST(BulletShapes, ThatChange_AreSeenInTheNextTick) {
  Bullet b;
  auto *const both = b.shape<btCompoundShape>();
  both->addChildShape(at({0, 0, 0}), b.shape<btBoxShape>(bt({0.3, 0.3, 0.1})));
  btRigidBody *const body = b.body(both, 0, {0, 0, 0});
  b.step();
  EXPECT_EQ(b.stats().shapes, 1u);
  both->addChildShape(at({0, 0, 0.5}), b.shape<btSphereShape>(s(0.1)));
  b.step();
  EXPECT_EQ(b.stats().shapes, 2u);
  dfm_obstacle leaf = 0;
  ok(dfm_bullet_obstacle(b.adapter, body, 1, &leaf));
  both->updateChildTransform(1, at({0, 0, 0.7}));
  b.step();
  dfm_obstacle moved = 0;
  ok(dfm_bullet_obstacle(b.adapter, body, 1, &moved));
  EXPECT_NE(leaf, moved);
  both->removeChildShapeByIndex(0);
  b.step();
  EXPECT_EQ(b.stats().shapes, 1u);
  EXPECT_EQ(dfm_bullet_obstacle(b.adapter, body, 1, &moved), DFM_E_ARG);
}

TEST(BulletShapes, ChildOfACompoundThatBecomesTheShape_StandsWhereTheObjectIs) {
  Bullet b;
  auto *const cube = b.shape<btBoxShape>(bt({0.1, 0.1, 0.1}));
  auto *const around = b.shape<btCompoundShape>();
  around->addChildShape(at({1, 0, 0}), cube);
  btRigidBody *const body = b.body(around, 0);
  b.step();
  body->setCollisionShape(cube);
  b.step();
  dfm_obstacle leaf = 0;
  ok(dfm_bullet_obstacle(b.adapter, body, 0, &leaf));
  dfm_pose pose{};
  ok(dfm_obstacle_get_pose(leaf, &pose));
  EXPECT_EQ(pose.position[0], 0);
}

namespace {

struct Unheard : btEmptyShape {
  Unheard() { m_shapeType = INVALID_SHAPE_PROXYTYPE; }
};

}  // namespace

// Of an object that is known already, too.
TEST(BulletShapes, ThatBecomeUnknown_AreRefused) {
  Bullet b;
  btRigidBody *const body = b.box({0.1, 0.1, 0.1}, 0, {});
  b.step();
  body->setCollisionShape(b.shape<Unheard>());
  b.world.stepSimulation(btScalar(1e-3), 0);
  EXPECT_EQ(dfm_bullet_last_tick(b.adapter, nullptr), DFM_E_UNSUPPORTED);
  EXPECT_EQ(b.stats().shapes, 1u);
  dfm_bullet_object left_out{};
  left_out.size = sizeof left_out;
  left_out.ignore = 1;
  ok(dfm_bullet_set_object(b.adapter, body, &left_out));
  b.step();
  EXPECT_EQ(b.stats().shapes, 0u);
}

// Filters of Bullet count for soft bodies too, whose category is 1.
TEST(BulletShapes, MaskWithoutSoftBodies_LetsThemThrough) {
  Bullet b;
  btRigidBody *const floor = b.box({1, 1, 0.1}, 0, {0, 0, -0.1});
  b.world.removeRigidBody(floor);
  b.world.addRigidBody(floor, 2, 4);
  const dfm_body ball = soft_ball(b, {0, 0, 0.101});
  b.run(0.2);
  EXPECT_LT(measure(ball).com[2], 0);
}

TEST(BulletShapes, WithoutResponse_TakeNoPart) {
  Bullet b;
  btRigidBody *const trigger = b.box({1, 1, 0.1}, 0, {0, 0, 0});
  trigger->setCollisionFlags(trigger->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  b.step();
  EXPECT_EQ(b.stats().shapes, 0u);
  EXPECT_EQ(b.stats().refused, 1u);
}
