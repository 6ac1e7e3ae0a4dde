// Every kind of geom carries a soft ball, as part of the world and as part of a body.
#include <gtest/gtest.h>

#include <functional>

#include "ode.h"
#include "query.h"

namespace {

using namespace test;

constexpr double kTop = 0.2;  // every stand ends at this height, flat or round

struct Stand {
  const char *name;
  std::function<dGeomID(Ode &)> make;
  std::function<double(Vec)> outside;  // distance of a point from the shape, below the top
};

double above_plane(Vec p) { return p[2] - kTop; }
double from_axis(Vec p) { return std::hypot(p[1], p[2] - (kTop - 0.5)) - 0.5; }
double from_center(Vec p) { return std::hypot(p[0], p[1], p[2] - (kTop - 0.5)) - 0.5; }

dGeomID at(dGeomID g, double z) {
  dGeomSetPosition(g, 0, 0, z);
  return g;
}
dGeomID lying(dGeomID g, double z) {  // axis along x
  dQuaternion q = {std::sqrt(0.5), 0, std::sqrt(0.5), 0};
  dGeomSetQuaternion(g, q);
  return at(g, z);
}

// A table of eight points whose triangles ODE keeps by reference.
const double kTable[8][4] = {{-0.3, -0.3, -0.1, 0}, {0.3, -0.3, -0.1, 0}, {0.3, 0.3, -0.1, 0},
                             {-0.3, 0.3, -0.1, 0},  {-0.3, -0.3, 0.1, 0}, {0.3, -0.3, 0.1, 0},
                             {0.3, 0.3, 0.1, 0},    {-0.3, 0.3, 0.1, 0}};
const dTriIndex kFaces[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                              1, 2, 6, 1, 6, 5, 2, 3, 7, 2, 7, 6, 3, 0, 4, 3, 4, 7};
dTriMeshDataID table_data() {
  static const dTriMeshDataID data = [] {  // of all stands
    const dTriMeshDataID made = dGeomTriMeshDataCreate();
    dGeomTriMeshDataBuildDouble(made, kTable, sizeof kTable[0], 8, kFaces, 36, 3 * sizeof(dTriIndex));
    return made;
  }();
  return data;
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-declarations"
dGeomID transformed(Ode &o) {
  const dGeomID outer = dCreateGeomTransform(o.space), inner = dCreateBox(nullptr, 0.6, 0.6, 0.2);
  dGeomTransformSetCleanup(outer, 1);
  dGeomTransformSetGeom(outer, inner);
  dGeomSetPosition(inner, 0, 0, -0.4);
  return at(outer, kTop + 0.3);
}
#pragma GCC diagnostic pop

const Stand kStands[] = {
    {"box", [](Ode &o) { return at(dCreateBox(o.space, 0.6, 0.6, 0.2), kTop - 0.1); }, above_plane},
    {"sphere", [](Ode &o) { return at(dCreateSphere(o.space, 0.5), kTop - 0.5); }, from_center},
    {"capsule", [](Ode &o) { return lying(dCreateCapsule(o.space, 0.5, 1), kTop - 0.5); }, from_axis},
    {"cylinder_standing", [](Ode &o) { return at(dCreateCylinder(o.space, 0.4, 0.3), kTop - 0.15); },
     above_plane},
    {"cylinder_lying", [](Ode &o) { return lying(dCreateCylinder(o.space, 0.5, 1), kTop - 0.5); },
     [](Vec p) { return from_axis(p) + 0.001; }},
    {"trimesh",
     [](Ode &o) { return at(dCreateTriMesh(o.space, table_data(), nullptr, nullptr, nullptr), kTop - 0.1); },
     above_plane},
    {"transform", transformed, above_plane},
    {"nested",
     [](Ode &o) {
       const dSpaceID inner = dSimpleSpaceCreate(o.space);
       return at(dCreateBox(dHashSpaceCreate(inner), 0.6, 0.6, 0.2), kTop - 0.1);
     },
     above_plane},
    // the last one: it has no body
    {"plane", [](Ode &o) { return dCreatePlane(o.space, 0, 0, 1, kTop); }, above_plane},
};

class OdeStand : public ::testing::TestWithParam<Stand> {};
class OdeSolid : public OdeStand {};

double lowest(dfm_body b, const std::function<double(Vec)> &outside) {
  uint32_t n = 0;
  ok(dfm_surface_positions(b, 0, nullptr, &n));
  std::vector<double> x(3 * n);
  ok(dfm_surface_positions(b, n, x.data(), &n));
  double least = 1e9;
  for (uint32_t i = 0; i < n; ++i) least = std::min(least, outside(vec(&x[3 * i])));
  return least;
}

}  // namespace

TEST_P(OdeStand, OfTheWorld_CarriesABall) {
  Ode ode;
  set_friction(ode.soft, 0.8);
  GetParam().make(ode);
  const dfm_body ball = soft_ball(ode, {0, 0, kTop + 0.105}, {}, 3e4, 30);
  ode.run(0.25);
  EXPECT_GT(stats(ode.soft).contacts, 0u);
  EXPECT_GT(lowest(ball, GetParam().outside), 0);
  EXPECT_LT(lowest(ball, GetParam().outside), 2e-3);  // not above something larger than the geom
}

// The same geom on a heavy body that ODE lets fall: the ball in free fall beside it is pushed by
// nothing but the body.
TEST_P(OdeSolid, OfABody_PushesWithItsMass) {
  Ode ode({0, 0, 0});
  const dGeomID g = GetParam().make(ode);
  const dBodyID b = ode.body(5, {0.3, 0.35, 0.4}, {0, 0, kTop - 0.1});
  const Vec was = vec(dGeomGetPosition(g));
  dQuaternion q;
  dGeomGetQuaternion(g, q);
  dGeomSetBody(g, b);
  dGeomSetOffsetWorldPosition(g, was[0], was[1], was[2]);
  dGeomSetOffsetWorldQuaternion(g, q);
  const dfm_body ball = soft_ball(ode, {0.05, 0, kTop + 0.105}, {0, 0, -1});
  Momenta start, end;
  add(start, ball);
  add(start, b);
  ode.run(0.1);
  add(end, ball);
  add(end, b);
  EXPECT_LT(velocity(b)[2], -0.1);
  EXPECT_LT(apart(start.linear, end.linear), 1e-12 * start.size);
  EXPECT_LT(apart(start.angular, end.angular), 1e-12 * start.size);
}

std::string name_of(const ::testing::TestParamInfo<Stand> &p) { return p.param.name; }
INSTANTIATE_TEST_SUITE_P(All, OdeStand, ::testing::ValuesIn(kStands), name_of);
INSTANTIATE_TEST_SUITE_P(All, OdeSolid, ::testing::ValuesIn(kStands, kStands + std::size(kStands) - 1),
                         name_of);

TEST(OdeShapes, Trimeshes_AreReadOnceAndAgainOnRequest) {
  Ode ode;
  double points[8][4];
  std::copy(&kTable[0][0], &kTable[0][0] + 32, &points[0][0]);
  const dTriMeshDataID data = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildDouble(data, points, sizeof points[0], 8, kFaces, 36, 3 * sizeof(dTriIndex));
  const dGeomID g = dCreateTriMesh(ode.space, data, nullptr, nullptr, nullptr);
  dfm_obstacle o = 0;
  const auto width = [&] {
    ok(dfm_ode_obstacle(ode.adapter, g, &o));
    dfm_obstacle_def d{};
    d.size = sizeof d;
    ok(dfm_obstacle_get_def(o, &d));
    EXPECT_EQ(d.npoint, 8u);  // corners of one place are one point
    EXPECT_EQ(d.ntriangle, 12u);
    double most = 0;
    for (uint32_t i = 0; i < d.npoint; ++i) most = std::max(most, d.points[3 * i]);
    return most;
  };
  EXPECT_NEAR(width(), 0.3, 1e-7);  // ODE keeps single precision
  for (auto &p : points) p[0] *= 2;
  dGeomTriMeshDataUpdate(data);
  ode.step();
  EXPECT_NEAR(width(), 0.3, 1e-7);  // ODE keeps single precision
  ok(dfm_ode_refresh(ode.adapter, g));
  EXPECT_NEAR(width(), 0.6, 1e-7);
  dGeomTriMeshDataDestroy(data);
}

TEST(OdeShapes, ConvexWithoutArrays_IsRefusedAndNothingMoves) {
  Ode ode;
  dReal planes[6 * 4];
  for (int k = 0; k < 3; ++k)
    for (int side = 0; side < 2; ++side) {
      dReal *const p = planes + 4 * (2 * k + side);
      p[0] = p[1] = p[2] = 0;
      p[k] = side ? 1 : -1;
      p[3] = k == 2 ? 0.1 : 0.3;
    }
  dReal points[24];
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) points[3 * i + k] = kTable[i][k];
  unsigned polygons[] = {4, 0, 3, 2, 1, 4, 4, 5, 6, 7, 4, 0, 1, 5, 4,
                         4, 1, 2, 6, 5, 4, 2, 3, 7, 6, 4, 3, 0, 4, 7};
  const dGeomID g = dCreateConvex(ode.space, planes, 6, points, 8, polygons);
  dGeomSetPosition(g, 0, 0, kTop - 0.1);
  const dfm_body ball = soft_ball(ode, {0, 0, kTop + 0.105}, {}, 3e4, 30);
  const double before = measure(ball).com[2];
  EXPECT_EQ(dfm_ode_step(ode.adapter, 1e-3), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("dfm_ode_set_convex"), std::string::npos) << dfm_last_error();
  EXPECT_EQ(measure(ball).com[2], before);
  ok(dfm_ode_set_convex(ode.adapter, g, 8, points, 6, polygons));
  ode.run(0.25);
  EXPECT_GT(lowest(ball, above_plane), 0);
  EXPECT_LT(lowest(ball, above_plane), 2e-3);
  polygons[1] = 8;
  EXPECT_EQ(dfm_ode_set_convex(ode.adapter, g, 8, points, 6, polygons), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("names point 8"), std::string::npos) << dfm_last_error();
}

TEST(OdeShapes, Heightfield_CarriesWhereOdeSaysItIs) {
  Ode ode;
  double heights[9] = {0, 0, 0, 0, 0.1, 0.05, 0, 0, 0.1};
  const dHeightfieldDataID data = dGeomHeightfieldDataCreate();
  dGeomHeightfieldDataBuildDouble(data, heights, 1, 1, 1, 3, 3, 1, 0, 1, 0);
  const dGeomID g = dCreateHeightfield(ode.space, data, 1);
  dQuaternion up = {std::sqrt(0.5), std::sqrt(0.5), 0, 0};  // its y to the world's z
  dGeomSetQuaternion(g, up);
  EXPECT_EQ(dfm_ode_step(ode.adapter, 1e-3), DFM_E_UNSUPPORTED);
  ok(dfm_ode_set_heights(ode.adapter, g, 1, 1, 3, 3, heights));
  ode.step();
  // Rays of ODE and of libdeform meet it at the same heights, over its corners and edges, where both cut
  // its cells alike.
  const dGeomID ray = dCreateRay(nullptr, 2);
  for (const Vec p : {Vec{0.01, 0.01, 1}, Vec{0.499, -0.499, 1}, Vec{0.4999, 0.0, 1}, Vec{-0.25, 0.001, 1}}) {
    dGeomRaySet(ray, p[0], p[1], p[2], 0, 0, -1);
    dContactGeom c[8];
    const int n = dCollide(ray, g, 8, c, sizeof c[0]);
    const dfm_query_hit hit = test::ray(ode.soft, p, {0, 0, -1}, 2);
    if (n == 0) continue;  // ODE finds no ray on a heightfield's border
    EXPECT_NEAR(hit.point[2], c[0].pos[2], 2e-3) << p[0] << " " << p[1];
  }
  dGeomDestroy(ray);
  dGeomDestroy(g);
  dGeomHeightfieldDataDestroy(data);
}

TEST(OdeShapes, ShapesThatAreNotSolid_AreIgnored) {
  Ode ode;
  dCreateRay(ode.space, 1);
  const dGeomID off = dCreateSphere(ode.space, 1), ignored = dCreateSphere(ode.space, 1);
  dGeomDisable(off);
  dfm_ode_geom props{};
  props.size = sizeof props;
  props.ignore = 1;
  ok(dfm_ode_set_geom(ode.adapter, ignored, &props));
  ode.step();
  EXPECT_EQ(ode.stats().shapes, 0u);
  EXPECT_EQ(ode.stats().refused, 3u);
  dfm_obstacle o = 0;
  EXPECT_EQ(dfm_ode_obstacle(ode.adapter, off, &o), DFM_E_ARG);
  dGeomEnable(off);
  props.ignore = 0;
  props.name = "stone";
  ok(dfm_ode_set_geom(ode.adapter, ignored, &props));
  ok(dfm_ode_obstacle(ode.adapter, off, &o));
  dfm_obstacle_def d{};
  d.size = sizeof d;
  ok(dfm_ode_obstacle(ode.adapter, ignored, &o));
  ok(dfm_obstacle_get_def(o, &d));
  EXPECT_STREQ(d.name, "stone");
  EXPECT_EQ(ode.stats().shapes, 2u);
  const dGeomID elsewhere = dCreateSphere(nullptr, 1);
  EXPECT_EQ(dfm_ode_set_geom(ode.adapter, elsewhere, &props), DFM_E_ARG);
  dGeomDestroy(elsewhere);
}

TEST(OdeShapes, CategoryBitsOfOde_FilterSoftBodiesToo) {
  Ode ode;
  const dGeomID floor = dCreatePlane(ode.space, 0, 0, 1, kTop);
  dGeomSetCollideBits(floor, 2);
  const dfm_body ball = soft_ball(ode, {0, 0, kTop + 0.11});
  ode.run(0.2);
  EXPECT_LT(measure(ball).com[2], kTop);
  dGeomSetCollideBits(floor, ~0ul);
  dGeomPlaneSetParams(floor, 0, 0, 1, -1);
  ode.run(0.45);
  EXPECT_GT(lowest(ball, [](Vec p) { return p[2] + 1; }), 0);
}
