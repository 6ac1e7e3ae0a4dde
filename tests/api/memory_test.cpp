// Memory: a settled step allocates nothing; every allocation may fail; what the hooks gave comes back.
#include <atomic>
#include <cstdlib>
#include <filesystem>

#include "bristle_law.h"
#include "coupled.h"
#include "heap_calls.h"
#include "obstacle.h"
#include "rigid.h"
#include "support.h"

namespace {

// Hooks that count, and refuse the n-th allocation and every one after it until told otherwise.
struct Hooks {
  std::atomic<int64_t> calls{0}, live_bytes{0}, live_blocks{0}, wrong_align{0}, fail_from{-1};
  dfm_context_def def() {
    dfm_context_def d = dfm_context_def_default();
    d.user = this;
    d.plugin_dir = DEFORM_PLUGIN_DIR;
    d.log = [](void *, int32_t, const char *) {};
    d.alloc = [](void *user, size_t bytes, size_t align) -> void * {
      Hooks &h = *static_cast<Hooks *>(user);
      const int64_t call = h.calls++;
      if (h.fail_from >= 0 && call >= h.fail_from) return nullptr;
      h.live_bytes += int64_t(bytes);
      ++h.live_blocks;
      return std::aligned_alloc(align, (bytes + align - 1) / align * align + align);
    };
    d.release = [](void *user, void *p, size_t bytes, size_t align) {
      Hooks &h = *static_cast<Hooks *>(user);
      h.live_bytes -= int64_t(bytes);
      --h.live_blocks;
      h.wrong_align += reinterpret_cast<uintptr_t>(p) % align != 0;
      std::free(p);
    };
    return d;
  }
};

// Counts allocations since it was made.
struct Calls {
  const Hooks &hooks;
  const int64_t by_hook = hooks.calls;
  const uint64_t by_new = test::heap_calls;
  void expect_none() const {
    EXPECT_EQ(hooks.calls - by_hook, 0) << "calls of the allocation hook";
    EXPECT_EQ(test::heap_calls - by_new, 0u) << "calls of operator new";
  }
};

}  // namespace

TEST(Memory, ASettledStep_AllocatesNothing) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  {
    const test::Stack s = test::make_stack(c);
    std::vector<dfm_contact> contacts(4096);
    std::vector<double> forces(3 * 4096);
    for (int i = 0; i < 1500; ++i)
      ASSERT_EQ(dfm_world_step(s.world, 1e-3, nullptr), DFM_OK) << dfm_last_error();
    ASSERT_EQ(test::pairs(s.world).size(), 2u) << "the bodies rest on each other and on the floor";
    test::events(s.world);
    std::vector<dfm_contact_event> events(65536);
    const Calls before{hooks};
    uint64_t sticking = 0;
    dfm_status bad = DFM_OK;
    auto check = [&](dfm_status status) {
      if (status != DFM_OK) bad = status;
    };
    for (int i = 0; i < 1000; ++i) {
      uint32_t trouble = 0, n = 0;
      check(dfm_world_step(s.world, 1e-3, &trouble));
      dfm_world_stats stats{};
      stats.size = sizeof stats;
      check(dfm_world_get_stats(s.world, &stats));
      check(dfm_world_contacts(s.world, 4096, contacts.data(), &n));
      check(dfm_world_events(s.world, 65536, events.data(), &n));
      check(dfm_surface_forces(s.upper, 4096, forces.data(), &n));
      check(dfm_surface_normals(s.upper, 4096, forces.data(), &n));
      dfm_body_measure m{};
      m.size = sizeof m;
      check(dfm_body_get_measure(s.upper, &m));
      sticking += stats.sticking;
    }
    EXPECT_EQ(bad, DFM_OK) << dfm_last_error();
    EXPECT_GT(sticking, 5000u);
    before.expect_none();
    size_t bytes = 0;
    test::ok(dfm_world_snapshot(s.world, nullptr, &bytes));
    EXPECT_GT(test::heap_calls, before.by_new)
        << "the library's calls are not counted: the zero above shows nothing";
  }
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
  EXPECT_EQ(hooks.live_blocks, 0);
  EXPECT_EQ(hooks.wrong_align, 0);
}

// unsanitized: too slow there; shorter tests run the same code
TEST(Memory, ASettledStepOnTrianglesAndVoxels_AllocatesNothing) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  {
    const dfm_world w = test::make_world(c);
    test::set_friction(w, 0.5);
    test::BodyOptions o;
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.name = "left";
    o.position = {-0.15, 0, 0.0101};
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    o.name = "right";
    o.position = {0.45, 0, 1e-4};
    test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
    o.name = "round";
    o.position = {2, 0, -0.9999};
    o.smooth = 40;
    test::make_body(c, w, "cylinder", {0.05, 0.05, 0}, 100, o);
    test::add_plane(w, "floor", {0, 0, -1});
    test::add_mesh(w, "hills", test::height_field(0.3, 20, [](double x, double y) {
                     return 0.01 * std::sin(20 * x) * std::cos(30 * y);
                   }));
    dfm_obstacle_def d = test::mesh_def("slab", test::Triangles{}, DFM_SHAPE_VOXELS, 4000);
    const test::Triangles slab = test::box_surface({0.2, 0.2, 0.05}, 1);
    d.npoint = uint32_t(slab.points.size() / 3);
    d.ntriangle = uint32_t(slab.tris.size() / 3);
    d.points = slab.points.data();
    d.triangles = slab.tris.data();
    d.pose.position[0] = 0.55;
    d.pose.position[2] = -0.05;
    dfm_obstacle obstacle = 0;
    test::ok(dfm_obstacle_create(w, &d, &obstacle));
    for (int i = 0; i < 2000; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
    ASSERT_EQ(test::pairs(w).size(), 3u) << "one on the hills, one on the slab, one on the floor";
    const Calls before{hooks};
    dfm_status bad = DFM_OK;
    for (int i = 0; i < 1000; ++i)
      if (const dfm_status s = dfm_world_step(w, 1e-3, nullptr); s != DFM_OK) bad = s;
    EXPECT_EQ(bad, DFM_OK);
    before.expect_none();
  }
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
}

// A surface of its own hangs, touches and is spread anew in every sub-step.
TEST(Memory, ASettledCoupledStep_AllocatesNothing) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  const test::Skin skin = test::box_skin({0.1, 0.1, 0.1}, 6);
  const dfm_surface_def surface = skin.def();
  test::BodyOptions o;
  o.young = 1e6;
  o.damping_stiffness = 1e-3;
  o.position = {0, 0, 2e-5};
  o.surface = &surface;
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  test::run(w, 0.5, 1e-3);
  const Calls before{hooks};
  for (int i = 0; i < 200; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK);
  before.expect_none();
  EXPECT_GT(test::stats(w).sticking, 3u);
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
}

// Free rigid bodies on a plane, on triangles and on each other, solved by Newton's method.
TEST(Memory, ASettledStepOfRigidBodies_AllocatesNothing) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world w = test::make_world(c, {1, 0.5, -9.81});
  test::add_plane(w, "floor");
  const test::Triangles floor = test::height_field(0.5, 9, [](double, double) { return 0.0; });
  dfm_obstacle_def d = test::mesh_def("triangles", floor);
  d.pose.position[2] = 1;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  test::create(w, {test::box("a", {0.05, 0.06, 0.04}, 1, {0, 0, 0.05}),
                   test::box("b", {0.05, 0.04, 0.04}, 2, {0.01, 0, 0.14}),
                   test::box("c", {0.05, 0.06, 0.04}, 1, {0, 0, 1.05})});
  test::run(w, 0.5, 1e-3);
  const Calls before{hooks};
  for (int i = 0; i < 200; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK);
  before.expect_none();
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
}

// Islands, the moment of falling asleep, the steps of a world that sleeps, waking by hand and by an obstacle.
TEST(Memory, FallingAsleepAndWaking_AllocatesNothing) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world w = test::make_world(c);
  test::ok(dfm_world_set_sleep(w, true));
  const dfm_obstacle floor = test::add_plane(w, "floor");
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 20;
  o.position = {0, 0, 4e-5};
  const dfm_body near = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  o.position[0] = 1;
  const dfm_body far = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  dfm_pose pose{};
  const auto round = [&] {
    bool slept = false, woke = false;
    for (int i = 0; i < 700; ++i) {
      EXPECT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK);
      slept |= test::stats(w).asleep == 2;
    }
    EXPECT_EQ(dfm_body_wake(far), DFM_OK);
    for (int i = 0; i < 20; ++i) EXPECT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK);
    woke = test::stats(w).asleep == 1;
    EXPECT_EQ(dfm_obstacle_get_pose(floor, &pose), DFM_OK);
    pose.position[2] -= 1e-6;
    EXPECT_EQ(dfm_obstacle_move_to(floor, &pose), DFM_OK);
    EXPECT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK);
    EXPECT_EQ(test::stats(w).asleep, 0u);
    return slept && woke;
  };
  for (int i = 0; i < 3; ++i) round();  // buffers find their size
  const Calls before{hooks};
  EXPECT_TRUE(round());
  before.expect_none();
  EXPECT_EQ(dfm_body_wake(near), DFM_OK);
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
}

TEST(Memory, ParametersThatFindNoMemory_ReportNoMemoryAndChangeNothing) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  const dfm_world w = test::make_world(c);
  const dfm_body b = test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 60, {});
  test::run(w, 0.01, 1e-3);
  const double slope = 2;
  const dfm_param_value value{"anisotropy_slope", &slope, 1};
  const dfm_params params{sizeof(dfm_params), 1, &value};
  double before = 0, after = 0;
  dfm_world_stats stats{}, softer{};
  stats.size = softer.size = sizeof stats;
  test::ok(dfm_world_stable_step(w, &before, nullptr, nullptr));
  test::ok(dfm_world_get_stats(w, &stats));
  hooks.fail_from = hooks.calls.load();
  EXPECT_EQ(dfm_body_set_params(b, &params), DFM_E_NOMEM);
  EXPECT_NE(std::string(dfm_last_error()).find("ran out of memory"), std::string::npos) << dfm_last_error();
  hooks.fail_from = -1;
  test::ok(dfm_world_stable_step(w, &after, nullptr, nullptr));
  EXPECT_EQ(before, after);
  test::ok(dfm_body_set_params(b, &params));
  test::ok(dfm_world_stable_step(w, &after, nullptr, nullptr));
  EXPECT_EQ(before, after) << "an offered step grows with delay";
  test::ok(dfm_world_get_stats(w, &softer));
  EXPECT_GT(softer.stable_step, stats.stable_step) << "a softer body";
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
}

// Everything from the context to a step in contact, with the allocator failing at the n-th call, for all n
// that are ever reached. The folder has the plugins that the scene uses: each context loads what is there.
TEST(Memory, WhenTheNthAllocationFails_TheCallFailsCleanlyAndNothingLeaks) {
  const test::Triangles slab = test::box_surface({0.2, 0.2, 0.05}, 1);
  int failures[4] = {};
  bool through = false;
  const test::Skin skin = test::ball_skin(0.049, 1);
  const dfm_surface_def surface = skin.def(DFM_COUPLING_MLS, 1.5);
  const std::string plugins = test::scratch("memory_plugins");
  for (const char *file : {"/model_msm.so", "/friction_coulomb.so"}) {
    std::filesystem::remove(plugins + file);
    std::filesystem::create_symlink(std::string(DEFORM_PLUGIN_DIR) + file, plugins + file);
  }
  for (int64_t n = 0; !through && n < 20000; ++n) {
    Hooks hooks;
    hooks.fail_from = n;
    dfm_context_def def = hooks.def();
    def.plugin_dir = plugins.c_str();
    dfm_context *c = nullptr;
    dfm_world world = 0;
    dfm_mesh_handle mesh = 0;
    dfm_body bodies[2] = {};
    int stage = 0;
    dfm_status status = dfm_context_create(&def, &c);
    if (status == DFM_OK) {
      ++stage;
      const dfm_world_def wd = dfm_world_def_default();
      status = dfm_world_create(c, &wd, &world);
      dfm_obstacle floor = 0;
      const dfm_obstacle_def od = dfm_obstacle_def_default();
      dfm_friction_def remembers{};
      remembers.size = sizeof remembers;
      remembers.between[0] = remembers.between[1] = "*";
      remembers.law = "test.bristle";
      if (status == DFM_OK) status = dfm_plugin_register_static(c, dfm_plugin_entry_bristle, "bristle");
      if (status == DFM_OK) status = dfm_world_add_friction(world, &remembers);
      if (status == DFM_OK) status = dfm_obstacle_create(world, &od, &floor);
      for (const uint32_t shape : {uint32_t(DFM_SHAPE_MESH), uint32_t(DFM_SHAPE_VOXELS)}) {
        dfm_obstacle_def td = test::mesh_def(shape == DFM_SHAPE_MESH ? "slab" : "rock", slab, shape, 64);
        td.pose.position[2] = -0.05;
        if (status == DFM_OK) status = dfm_obstacle_create(world, &td, &floor);
      }
      const double size[3] = {0.05, 0, 0};
      if (status == DFM_OK) status = dfm_mesh_make(c, "ball", size, DFM_MESH_CELLS, 100, &mesh);
      if (status == DFM_OK) {
        ++stage;
        dfm_mesh_info info{};
        test::ok(dfm_mesh_get_info(mesh, &info));
        dfm_body_def bd = dfm_body_def_default();
        bd.npoint = info.npoint;
        bd.ntet = info.ntet;
        bd.points = info.points;
        bd.tets = info.tets;
        for (int k = 0; k < 2 && status == DFM_OK; ++k) {
          bd.pose.position[2] = 0.0501 + 0.1002 * k;
          bd.velocity[2] = -0.1;
          bd.smooth = 40;
          bd.surface = k ? &surface : nullptr;
          status = dfm_body_create(world, &bd, &bodies[k]);
        }
      }
      if (status == DFM_OK) {
        ++stage;
        for (int i = 0; i < 12 && status == DFM_OK; ++i) {
          const uint64_t before = dfm_world_hash(world);
          status = dfm_world_step(world, 1e-3, nullptr);
          EXPECT_TRUE(status == DFM_OK || dfm_world_hash(world) == before) << "allocation " << n;
        }
        if (status == DFM_OK) {
          through = true;
        } else {  // with memory again, the world goes on
          hooks.fail_from = -1;
          for (int i = 0; i < 3; ++i)
            EXPECT_EQ(dfm_world_step(world, 1e-3, nullptr), DFM_OK) << dfm_last_error();
        }
      } else if (world) {  // what was refused is not there; the rest is
        uint32_t count = 0;
        test::ok(dfm_world_bodies(world, 0, nullptr, &count));
        EXPECT_EQ(count, bodies[1] ? 2u : bodies[0] ? 1u : 0u) << "allocation " << n;
        hooks.fail_from = -1;
        EXPECT_EQ(dfm_world_step(world, 1e-3, nullptr), DFM_OK) << dfm_last_error();
      }
    }
    if (status != DFM_OK) {
      EXPECT_EQ(status, DFM_E_NOMEM) << "allocation " << n << " at stage " << stage << ": "
                                     << dfm_last_error();
      ++failures[stage];
    }
    dfm_context_destroy(c);
    ASSERT_EQ(hooks.live_bytes, 0) << "allocation " << n << " at stage " << stage;
    ASSERT_EQ(hooks.live_blocks, 0) << "allocation " << n << " at stage " << stage;
  }
  EXPECT_TRUE(through);
  EXPECT_GT(failures[1] + failures[2], 20) << "mesh, world and bodies take memory";
  EXPECT_GT(failures[3], 20) << "so do first steps in contact";
}

TEST(Memory, WhenRestoreHasNoMemory_ItReportsNoMemoryAndTheWorldContinues) {
  Hooks hooks;
  const dfm_context_def def = hooks.def();
  dfm_context *c = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  {
    const test::Stack s = test::make_stack(c);
    for (int i = 0; i < 100; ++i) ASSERT_EQ(dfm_world_step(s.world, 1e-3, nullptr), DFM_OK);
    size_t bytes = 0;
    test::ok(dfm_world_snapshot(s.world, nullptr, &bytes));
    std::vector<char> data(bytes);
    test::ok(dfm_world_snapshot(s.world, data.data(), &bytes));
    const uint64_t then = dfm_world_hash(s.world);
    for (int i = 0; i < 10; ++i) ASSERT_EQ(dfm_world_step(s.world, 1e-3, nullptr), DFM_OK);
    const uint64_t now = dfm_world_hash(s.world);
    dfm_status status = DFM_E_NOMEM;
    int refused = 0;
    for (int64_t n = 0; status != DFM_OK; ++n, ++refused) {
      hooks.fail_from = hooks.calls + n;
      status = dfm_world_restore(s.world, data.data(), bytes);
      if (status == DFM_OK) break;
      ASSERT_EQ(status, DFM_E_NOMEM) << dfm_last_error();
      ASSERT_EQ(dfm_world_hash(s.world), now) << "allocation " << n;
    }
    hooks.fail_from = -1;
    EXPECT_GT(refused, 3);
    EXPECT_EQ(dfm_world_hash(s.world), then);
    EXPECT_EQ(dfm_world_step(s.world, 1e-3, nullptr), DFM_OK) << dfm_last_error();
  }
  dfm_context_destroy(c);
  EXPECT_EQ(hooks.live_bytes, 0);
}
