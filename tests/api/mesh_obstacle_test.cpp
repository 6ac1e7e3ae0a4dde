// Obstacles of triangles and voxels through the public API: what is refused and how, what comes back, rays,
// snapshots, threads, the scene's keys.
#include "obstacle.h"
#include "query.h"

#include <unistd.h>

#include <cstring>

#include "support.h"

namespace {

const test::Triangles &box() {
  static const test::Triangles m = test::box_surface({0.3, 0.3, 0.1}, 4);
  return m;
}

double hilly(double x, double y) { return 0.02 * std::sin(20 * x) * std::cos(17 * y); }

// A soft block with friction on a moving hilly mesh and against a box of voxels.
struct Mixed {
  test::Context context;
  dfm_world world;
  explicit Mixed(uint32_t threads, const test::Triangles &floor) : context(threads) {
    world = test::make_world(context);
    test::BodyOptions o;
    o.young = 2e5;
    o.damping_stiffness = 1e-3;
    o.name = "block";
    o.position = {-0.05, -0.05, 0.03};
    test::make_body(context, world, "beam", {0.1, 0.1, 0.1}, 300, o);
    o.name = "ball";
    o.position = {0.2, 0, 0.1};
    test::make_body(context, world, "ball", {0.05, 0, 0}, 300, o);
    test::set_friction(world, 0.4);
    dfm_obstacle_def d = test::mesh_def("floor", floor);
    const dfm_pose_key keys[2] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}},
                                  {1, {{0.1, 0, 0.02}, {0, 0, 0.1, 0.99498744}}}};
    d.nkey = 2;
    d.keys = keys;
    dfm_obstacle obstacle = 0;
    test::ok(dfm_obstacle_create(world, &d, &obstacle));
    d = test::mesh_def("wall", box(), DFM_SHAPE_VOXELS, 8000);
    d.pose.position[0] = 0.56;
    test::ok(dfm_obstacle_create(world, &d, &obstacle));
  }
  uint64_t hash() const { return dfm_world_hash(world); }
};

const test::Triangles &hills() {
  static const test::Triangles m = test::height_field(0.5, 20, hilly);
  return m;
}

}  // namespace

TEST(MeshObstacle, WrongInput_IsReported) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  const double nan = std::nan("");
  test::Triangles bad_point = box(), far = box(), twice = box(), inward = box(), open = box();
  bad_point.points[7] = nan;
  far.tris[5] = 100000;
  twice.tris[4] = twice.tris[3];
  for (size_t t = 0; t < inward.tris.size(); t += 3) std::swap(inward.tris[t], inward.tris[t + 1]);
  open.tris.resize(open.tris.size() - 3);
  struct Case {
    dfm_obstacle_def def;
    std::vector<const char *> words;
  };
  dfm_obstacle_def none = test::mesh_def("m", box()), few = test::mesh_def("m", box(), DFM_SHAPE_VOXELS, 63);
  none.points = nullptr;
  const Case cases[] = {
      {none, {"'m'", "at least 3 points"}},
      {test::mesh_def("m", bad_point), {"point 2", "finite"}},
      {test::mesh_def("m", far), {"triangle 1", "100000"}},
      {test::mesh_def("m", twice), {"triangle 1", "twice"}},
      {test::mesh_def("m", inward, DFM_SHAPE_VOXELS, 1000), {"inward", "reverse its triangles"}},
      {test::mesh_def("m", open, DFM_SHAPE_VOXELS, 1000), {"closed", "shape mesh"}},
      {few, {"63 cells", "64"}},
  };
  for (const Case &c : cases) {
    dfm_obstacle o = 0;
    EXPECT_EQ(dfm_obstacle_create(w, &c.def, &o), DFM_E_ARG);
    for (const char *word : c.words)
      EXPECT_NE(std::strstr(dfm_last_error(), word), nullptr) << word << " in: " << dfm_last_error();
  }
  uint32_t n = 1;
  test::ok(dfm_world_obstacles(w, 0, nullptr, &n));
  EXPECT_EQ(n, 0u);
  test::add_mesh(w, "m", open);  // a mesh may be open, or face inward: a room
  test::add_mesh(w, "n", inward);
}

TEST(MeshObstacle, Def_ComesBackWithItsTriangles) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  dfm_obstacle o;
  {
    const test::Triangles gone = box();
    o = test::add_mesh(w, "box", gone);
  }
  dfm_obstacle_def d{};
  d.size = sizeof d;
  test::ok(dfm_obstacle_get_def(o, &d));
  ASSERT_EQ(d.npoint, box().points.size() / 3);
  ASSERT_EQ(d.ntriangle, box().tris.size() / 3);
  EXPECT_EQ(std::memcmp(d.points, box().points.data(), box().points.size() * sizeof(double)), 0);
  EXPECT_EQ(std::memcmp(d.triangles, box().tris.data(), box().tris.size() * sizeof(uint32_t)), 0);
  test::ok(dfm_obstacle_get_def(test::add_mesh(w, "more", box()), &d));
}

TEST(MeshObstacle, Ray_MeetsItWhereItIs) {
  for (const uint32_t shape : {uint32_t(DFM_SHAPE_MESH), uint32_t(DFM_SHAPE_VOXELS)}) {
    test::Context context;
    const dfm_world w = test::make_world(context);
    dfm_obstacle_def d = test::mesh_def("box", box(), shape, 1000);
    d.pose.position[2] = 1;
    d.pose.rotation[1] = std::sqrt(0.5);
    d.pose.rotation[3] = std::sqrt(0.5);  // local x down
    dfm_obstacle o = 0;
    test::ok(dfm_obstacle_create(w, &d, &o));
    const dfm_query_hit hit = test::ray(w, {0.01, 0.02, 3}, {0, 0, -1}, 100);
    EXPECT_EQ(hit.thing, o);
    EXPECT_NEAR(hit.distance, 1.7, 1e-12);
    EXPECT_NEAR(hit.normal[2], 1, 1e-12);
    EXPECT_EQ(test::ray(w, {0.01, 0.02, 3}, {0, 1, 0}, 100).thing, 0u);
  }
}

TEST(MeshObstacle, SnapshotInMidContact_ContinuesWithTheSameBits) {
  Mixed a(1, hills()), b(1, hills());
  test::run(a.world, 0.15, 5e-4);
  ASSERT_GT(test::contacts(a.world).size(), 3u);
  const std::string data = test::snapshot(a.world);
  test::run(a.world, 0.1, 5e-4);
  test::ok(dfm_world_restore(b.world, data.data(), data.size()));
  test::run(b.world, 0.1, 5e-4);
  EXPECT_EQ(a.hash(), b.hash());
  test::Triangles other = hills();
  other.points[2] += 1e-3;
  Mixed c(1, other);
  EXPECT_EQ(dfm_world_restore(c.world, data.data(), data.size()), DFM_E_FORMAT) << "another floor";
}

TEST(MeshObstacle, Threads_GiveTheSameBits) {
  Mixed one(1, hills()), four(4, hills());
  for (Mixed *m : {&one, &four}) test::run(m->world, 0.2, 5e-4);
  EXPECT_EQ(one.hash(), four.hash());
  EXPECT_GT(test::stats(one.world).contacts_max, 8u);
}

TEST(MeshObstacle, Moved_ByTargetsCarriesAndIsWhereItWasSent) {
  test::Context context;
  const dfm_world w = test::make_world(context);
  test::BodyOptions o;
  o.young = 1e6;
  o.damping_stiffness = 1e-3;
  o.position = {-0.05, -0.05, 0.1001};
  const dfm_body body = test::make_body(context, w, "beam", {0.1, 0.1, 0.1}, 60, o);
  test::set_friction(w, 0.5);
  const dfm_obstacle slab = test::add_mesh(w, "slab", box());
  for (int k = 1; k <= 300; ++k) {
    const dfm_pose to = {{1e-4 * k, 0, 5e-5 * k}, {0, 0, 0, 1}};
    test::ok(dfm_obstacle_move_to(slab, &to));
    test::run(w, 1e-3, 1e-3);
  }
  EXPECT_NEAR(test::measure(body).velocity[0], 0.1, 2e-3);
  EXPECT_NEAR(test::measure(body).com[2], 0.1 + 0.05 + 300 * 5e-5, 1e-3);
  uint32_t n = 0;
  test::ok(dfm_world_pairs(w, 0, nullptr, &n));
  EXPECT_EQ(n, 1u);
}

TEST(MeshObstacleScene, Keys_AreReadAndChecked) {
  const std::string dir = test::scratch("mesh_obstacle_" + std::to_string(getpid()));
  {
    test::Context context;
    dfm_mesh_handle cells = 0;
    const double size[3] = {0.1, 0.1, 0.1}, slab[3] = {1, 1, 0.2};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 40, &cells));
    test::ok(dfm_mesh_write(cells, (dir + "/block.msh").c_str()));
    dfm_mesh_handle surface = 0;
    test::ok(dfm_mesh_make(context, "beam", slab, DFM_MESH_SURFACE, 200, &surface));
    test::ok(dfm_mesh_write(surface, (dir + "/slab.ply").c_str()));
    dfm_mesh_handle sheet = 0;
    const dfm_obstacle_def d = test::mesh_def("sheet", hills());
    test::ok(dfm_mesh_create(context, d.npoint, d.points, d.ntriangle, d.triangles, &sheet));
    test::ok(dfm_mesh_write(sheet, (dir + "/sheet.obj").c_str()));
  }
  test::write_file(dir + "/scene.json",
                   R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.1, "step": 0.001},
    "bodies": [{"name": "block", "mesh": "block.msh", "pose": {"position": [0.2, 0.2, 0.101]}}],
    "obstacles": [{"name": "slab", "shape": "mesh", "mesh": "slab.ply", "pose": {"scale": 0.5}}],
    "output": {"every": 0.05}})");
  const auto run = [&](const std::string &set) {
    std::vector<std::string> arguments = {"run", dir + "/scene.json", "--quiet", "--out", dir + "/out"};
    if (!set.empty()) arguments.insert(arguments.end(), {"--set", set});
    return test::deform(arguments);
  };
  const char *const good_sets[] = {
      "", R"(/obstacles/0/shape="voxels")",
      R"(/obstacles/0={"name":"slab","shape":"voxels","mesh":"slab.ply","cells":4000,"pose":{"scale":0.5}})",
      R"(/obstacles/0={"name":"slab","shape":"mesh","mesh":"block.msh","pose":{"position":[0.2,0.2,0]}})"};
  for (const char *good : good_sets) {
    const test::CommandResult r = run(good);
    EXPECT_EQ(r.exit_code, 0) << good << r.err;
    const std::string summary = test::read_file(dir + "/out/summary.json");
    const size_t at = summary.find("\"com\": [");
    ASSERT_NE(at, std::string::npos);
    double x, y, z = 0;
    ASSERT_EQ(std::sscanf(summary.c_str() + at, "\"com\": [%lf, %lf, %lf]", &x, &y, &z), 3);
    EXPECT_NEAR(z, 0.15, 0.01) << good << ": it lies on the slab";
  }
  const std::vector<std::pair<std::string, std::vector<std::string>>> bad = {
      {R"(/obstacles/0={"name":"s","shape":"mesh"})", {"/obstacles/0", "mesh"}},
      {R"(/obstacles/0/mesh="none.obj")", {"/obstacles/0/mesh", "none.obj"}},
      {R"(/obstacles/0/cells=100)", {"/obstacles/0/cells", "voxels"}},
      {R"(/obstacles/0={"name":"s","shape":"voxels","mesh":"slab.ply","cells":10})",
       {"/obstacles/0/cells", "64"}},
      {R"(/obstacles/0={"name":"s","shape":"voxels","mesh":"slab.ply","cells":100.5})",
       {"/obstacles/0/cells", "whole"}},
      {R"(/obstacles/0={"name":"s","shape":"voxels","mesh":"sheet.obj"})",
       {"/obstacles/0", "closed", "shape mesh"}},
      {R"(/obstacles/0={"name":"s","shape":"sphere","radius":1,"pose":{"scale":2}})",
       {"/obstacles/0/pose/scale", "mesh and voxels"}},
      {R"(/obstacles/0={"name":"s","shape":"plane","mesh":"slab.ply"})", {"/obstacles/0/mesh", "plane"}},
      {R"(/obstacles/0/pose/scale=0)", {"/obstacles/0/pose/scale"}},
  };
  for (const auto &[set, words] : bad) {
    const test::CommandResult r = run(set);
    EXPECT_EQ(r.exit_code, 2) << set;
    for (const std::string &word : words)
      EXPECT_NE(r.err.find(word), std::string::npos) << set << ": " << r.err;
  }
}
