// dfm_world_memory: bytes by part, as the hooks of the context saw them.
#include <atomic>
#include <cstdlib>

#include "obstacle.h"

namespace {

std::atomic<int64_t> live{0};

struct Counted {
  dfm_context *c = nullptr;
  Counted() {
    dfm_context_def d = dfm_context_def_default();
    d.plugin_dir = DEFORM_PLUGIN_DIR;
    d.log = [](void *, int32_t, const char *) {};
    d.alloc = [](void *, size_t bytes, size_t align) -> void * {
      live += int64_t(bytes);
      return std::aligned_alloc(align, (bytes + align - 1) / align * align + align);
    };
    d.release = [](void *, void *p, size_t bytes, size_t) {
      if (p) live -= int64_t(bytes);
      std::free(p);
    };
    test::ok(dfm_context_create(&d, &c));
  }
  ~Counted() { dfm_context_destroy(c); }
};

dfm_memory memory(dfm_world w) {
  dfm_memory m{};
  m.size = sizeof m;
  test::ok(dfm_world_memory(w, &m));
  EXPECT_EQ(m.total, m.bodies + m.dynamics + m.obstacles + m.detection + m.contacts + m.steps);
  return m;
}

}  // namespace

TEST(WorldMemory, Parts_GrowWithWhatTheyHold_AndComeBack) {
  Counted context;
  const int64_t before = live;
  const dfm_world w = test::make_world(context.c, {0, 0, -9.81});
  const dfm_memory empty = memory(w);
  EXPECT_EQ(empty.bodies, 0u);
  EXPECT_EQ(empty.obstacles, 0u);
  test::add_mesh(w, "floor", test::height_field(0.5, 12, [](double, double) { return 0.0; }));
  const dfm_memory floor = memory(w);
  EXPECT_GT(floor.obstacles, 288u * 3 * sizeof(uint32_t));
  EXPECT_EQ(floor.bodies, 0u);
  test::BodyOptions o;
  o.position = {0, 0, 1e-3};
  o.integrator = DFM_INTEGRATOR_IMPLICIT_EULER;
  o.model = "corotational_fem";
  o.damping_stiffness = 1e-3;
  const dfm_body block = test::make_body(context.c, w, "beam", {0.1, 0.1, 0.05}, 200, o);
  test::run(w, 0.1, 1e-3);
  const dfm_memory one = memory(w);
  EXPECT_GT(one.bodies, 200u * 4 * sizeof(uint32_t));
  EXPECT_GT(one.dynamics, one.bodies / 10);  // matrix and factor
  EXPECT_GT(one.detection, 0u);
  EXPECT_GT(one.contacts, 0u);
  EXPECT_LE(int64_t(one.total), live - before);
  o.position = {0, 0, 0.1};
  const dfm_body other = test::make_body(context.c, w, "beam", {0.1, 0.1, 0.05}, 200, o);
  EXPECT_NEAR(double(memory(w).bodies), 2.0 * double(one.bodies), 0.1 * double(one.bodies));
  test::ok(dfm_body_destroy(other));
  EXPECT_NEAR(double(memory(w).bodies), double(one.bodies), 0.01 * double(one.bodies));
  test::ok(dfm_body_destroy(block));
  EXPECT_EQ(memory(w).bodies, 0u);
  EXPECT_EQ(dfm_world_memory(w, nullptr), DFM_E_ARG);
  test::ok(dfm_world_destroy(w));
  EXPECT_LE(live - before, 64 * 1024);  // handles, what models keep in their plugin
}

// A settled step takes no more, in any part.
TEST(WorldMemory, ASettledStep_ChangesNothing) {
  Counted context;
  const dfm_world w = test::make_world(context.c, {0, 0, -9.81});
  test::add_plane(w, "floor");
  test::BodyOptions o;
  o.damping_mass = 20;
  o.position = {0, 0, 1e-4};
  test::make_body(context.c, w, "beam", {0.1, 0.1, 0.05}, 60, o);
  test::run(w, 0.3, 1e-3);
  const dfm_memory before = memory(w);
  test::run(w, 0.1, 1e-3);
  const dfm_memory after = memory(w);
  EXPECT_EQ(before.total, after.total);
}
