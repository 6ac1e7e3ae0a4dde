// Meshes and voxels as obstacles: the same contacts as between bodies, on the body's dofs alone.
#include <gtest/gtest.h>

#include "body/obstacle_mesh.h"
#include "detect_scene.h"
#include "geometry/voxel_grid.h"

namespace {

using namespace dfm;
using namespace test;

struct MeshScene : Scene {
  std::vector<std::unique_ptr<ObstacleMesh>> meshes;
  std::vector<std::unique_ptr<VoxelGrid>> grids;

  ObstacleView &add_mesh(const Mesh &m, Vec3 position = {}, Quat rotation = {}, Vec3 velocity = {},
                         Vec3 spin = {}) {
    meshes.push_back(
        std::make_unique<ObstacleMesh>(Memory::standard(), m.npoint(), m.x.data(), m.ntri(), m.tri.data()));
    ObstacleView &o = add(Shape::mesh, position, rotation);
    o.velocity = velocity;
    o.spin = spin;
    o.surface = &meshes.back()->surface;
    o.extent = meshes.back()->extent;
    meshes.back()->place(position, rotation, velocity, spin);
    return o;
  }
  ObstacleView &add_voxels(const Mesh &m, uint32_t cells, Vec3 position = {}, Quat rotation = {}) {
    grids.push_back(
        std::make_unique<VoxelGrid>(Memory::standard(), m.x.data(), m.ntri(), m.tri.data(), cells));
    ObstacleView &o = add(Shape::voxels, position, rotation);
    o.grid = grids.back().get();
    o.extent = o.grid->extent();
    return o;
  }
  // Every pair of features that may be the first to touch.
  Array<Candidate> every() const {
    Array<Candidate> c;
    const BodyView &a = bodies[0];
    const Surface &s = *a.surface;
    for (const ObstacleView &o : obstacles) {
      if (o.shape == Shape::voxels) {
        for (uint32_t i = 0; i < s.nsurfel; ++i) c.push_back({a.slot, o.slot, i, 0, 0, 1});
        for (uint32_t i = 0; i < s.ntri; ++i) c.push_back({a.slot, o.slot, i, 0, 2, 1});
        continue;
      }
      const Surface &b = *o.surface;
      std::vector<uint8_t> vertex(b.nsurfel), edge(b.nedge);
      for (uint32_t t = 0; t < b.ntri; ++t)
        for (int k = 0; k < 3; ++k) {
          vertex[b.tri[3 * t + k]] |= b.tri_owns[t] >> k & 1;
          edge[b.tri_edge[3 * t + k]] |= b.tri_owns[t] >> (3 + k) & 1;
        }
      for (uint32_t i = 0; i < s.nsurfel; ++i)
        for (uint32_t j = 0; j < b.ntri; ++j) c.push_back({a.slot, o.slot, i, j, 0, 1});
      for (uint32_t i = 0; i < s.nedge; ++i)
        for (uint32_t j = 0; j < b.nedge; ++j)
          if (edge[j]) c.push_back({a.slot, o.slot, i, j, 1, 1});
      for (uint32_t i = 0; i < b.nsurfel; ++i)
        for (uint32_t j = 0; vertex[i] && j < s.ntri; ++j) c.push_back({a.slot, o.slot, i, j, 2, 1});
    }
    return c;
  }
};

}  // namespace

TEST(MeshObstacle, FeaturesThatMayTouchFirst_AreConvexOrOpen) {
  const auto counts = [](const Mesh &m) {
    const ObstacleMesh o(Memory::standard(), m.npoint(), m.x.data(), m.ntri(), m.tri.data());
    std::array<int, 2> n{};
    for (const uint32_t owns : o.surface.tri_owns)
      for (int k = 0; k < 6; ++k) n[k / 3] += owns >> k & 1;
    return n;
  };
  EXPECT_EQ(counts(box_mesh({1, 1, 1}, 4, 4, 4)), (std::array<int, 2>{8 + 12 * 3, 12 * 4}))
      << "those of its rims";
  Mesh inward = box_mesh({1, 1, 1}, 3, 3, 3);
  for (size_t t = 0; t < inward.tri.size(); t += 3) std::swap(inward.tri[t], inward.tri[t + 1]);
  EXPECT_EQ(counts(inward), (std::array<int, 2>{0, 0})) << "a room has none";
  Welder sheet;
  sheet.patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 3, 3);
  EXPECT_EQ(counts(sheet.mesh), (std::array<int, 2>{12, 12})) << "an open sheet: its rim";
}

// A body pair in which the other body has no dofs.
// unsanitized: too slow there; shorter tests run the same code
TEST(MeshObstacle, Contacts_AreThoseOfABodyPair) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  size_t all = 0;
  for (int i = 0; i < 40; ++i) {
    const Mesh a = i % 2 ? box_mesh({1, 1, 1}, 2, 2, 2) : sphere_mesh(0.5, 2);
    const Mesh b = i % 3 ? box_mesh({0.8, 0.6, 1}, 2, 1, 2) : sphere_mesh(0.4, 2);
    const Quat q = turn({u(random), u(random), u(random)}, 3 * u(random));
    const Vec3 way = normalized(Vec3{u(random), u(random), u(random)});
    const Vec3 velocity{0.3 * u(random), 0.3 * u(random), 0.3 * u(random)};
    for (double distance = 1.3; distance > 0.6; distance -= 0.02) {
      Scene pair;
      MeshScene alone;
      for (Scene *s : {&pair, static_cast<Scene *>(&alone)}) {
        s->h = 5e-3;
        s->offset = 2e-3;
        s->add(a);
      }
      pair.add(moved(b, q, distance * way), velocity);
      alone.add_mesh(b, distance * way, q, velocity);
      const Array<ContactPoint> want = pair.contacts(), got = alone.contacts(alone.every());
      if (want.empty()) continue;
      EXPECT_EQ(flaw(alone, got), "");
      // Flat vertices of b make contacts between bodies, which may bend; a rigid one's faces do
      // not need them.
      size_t kept = 0;
      for (const ContactPoint &c : got) {
        EXPECT_EQ(c.obstacle, 1);
        EXPECT_LT(norm(load3(c.velocity) - velocity), 1e-12);
        for (const ContactPoint &w : want)
          if (norm(load3(w.point) - load3(c.point)) < 1e-9 && std::fabs(w.distance - c.distance) < 1e-12) {
            const double sign = w.slot_a == 0 ? 1 : -1;
            if (norm(load3(c.normal) - sign * load3(w.normal)) < 1e-9) {
              ++kept;
              break;
            }
          }
      }
      EXPECT_EQ(kept, got.size());
      all += got.size();
      break;
    }
  }
  EXPECT_GT(all, 50u);
}

TEST(MeshObstacle, Lists_NeverChangeContacts) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  size_t all = 0;
  for (const bool voxels : {false, true}) {
    MeshScene s;
    s.add(box_mesh({1, 1, 1}, 3, 3, 3));
    const Mesh ball = sphere_mesh(0.5, 2);
    if (voxels) s.add_voxels(ball, 4000);
    else s.add_mesh(ball);
    BroadPhase broad(Memory::standard());
    for (int i = 0; i < 150; ++i) {
      ObstacleView &o = s.obstacles[0];
      o.position = {0.3 * std::sin(0.1 * i), 0.2, 0.98 + 0.05 * std::sin(0.07 * i)};
      o.rotation = turn({1, 0.5, 0.2}, 0.03 * i);
      o.velocity = {3 * u(random), 0, 3 * u(random)};
      if (!voxels) s.meshes[0]->place(o.position, o.rotation, o.velocity, o.spin);
      broad.set_skin_steps(10 + 10 * u(random));
      broad.update(s.bodies, s.obstacles, s.filter, s.h, s.offset);
      const Array<ContactPoint> listed = s.contacts(broad.candidates()), every = s.contacts(s.every());
      ASSERT_TRUE(same_bits(listed, every)) << i << (voxels ? " voxels" : " mesh");
      ASSERT_EQ(flaw(s, listed), "");
      all += listed.size();
    }
    EXPECT_LT(broad.stats().renewals, 150u);
  }
  EXPECT_GT(all, 300u) << "contacts were compared";
}

// The mesh's vertex against a face borrows the face's nearest free corner; side by side with surfels it takes
// nothing twice.
TEST(MeshObstacle, VertexUnderFace_HasTheFaceAsItsFeature) {
  MeshScene s;
  s.add(moved(box_mesh({1, 1, 1}, 1, 1, 1), {}, {0, 0, 0.5005}));
  s.add_mesh(tetrahedron_mesh({0.1, 0.2, 0}, {0.05, 0.2, -0.2}, {0.15, 0.15, -0.2}, {0.1, 0.3, -0.2}), {}, {},
             {0, 0, 0.5})
      .belt = {1, 0, 0};
  const Array<ContactPoint> c = s.contacts(s.every());
  ASSERT_EQ(c.size(), 1u);
  EXPECT_EQ(flaw(s, c), "");
  EXPECT_EQ(c[0].type_a, 2);
  EXPECT_EQ(c[0].nnode, 3);
  EXPECT_NEAR(c[0].distance, 5e-4, 1e-15);
  EXPECT_NEAR(c[0].normal[2], 1, 1e-15);
  EXPECT_NEAR(c[0].velocity[0], 1, 1e-15);
  EXPECT_NEAR(c[0].velocity[2], 0.5, 1e-15);
  EXPECT_GT(c[0].area, 0);
}
