// Coarse meshes of a mesh generator, cut at the defaults: the energy watch must not stop them. The teeth of
// such a cut leave contacts whose normals oppose each other, with impulses that nearly cancel
// (doc/decisions/energy_watch.md).
#include <cmath>

#include "support.h"
#include "world.h"

namespace {

// A bar of 167 cells and 80 mm on a floor, cut across at 20 ms.
std::string bar(const std::string &mesh, const char *model, const char *x) {
  return R"({"format": "deform-scene", "version": 1, "time": {"duration": 0.022, "step": 0.001},
    "materials": {"jelly": {"young": 3e4, "damping": {"mass": 2, "stiffness": 2e-3}}},
    "bodies": [{"name": "jelly", "mesh": ")" +
         mesh + R"(", "material": "jelly", "model": {"type": ")" + model +
         R"("}, "separate": {}, "pose": {"scale": 0.008, "position": [-0.04, 0, 1e-4]}}],
    "obstacles": [{"name": "floor", "shape": "plane"}],
    "cuts": [{"body": "jelly", "t": 0.02, "shape": "plane", "point": [)" +
         x + R"(, 0, 0], "normal": [1, 0, 0]}]})";
}

}  // namespace

// The first by the work of both sides of the pair of pieces, the others by that of a piece on the floor,
// which a solve that is not converged takes from the pair of pieces.
TEST(CutOwnMesh, BarCutByAPlane_IsNotStopped) {
  const std::string mesh = test::mesh_dir() + "/misc/bar_coarse.msh";
  const std::string out = test::scratch("cut_own_mesh");
  const struct {
    const char *model, *x;
  } cases[] = {{"corotational_fem", "0.005"}, {"corotational_fem", "-0.007"}, {"msm", "-0.007"}};
  for (const auto &c : cases) {
    test::write_file(out + "/bar.json", bar(mesh, c.model, c.x));
    const test::CommandResult r =
        test::deform({"run", out + "/bar.json", "--quiet", "--out", out + "/result"});
    EXPECT_EQ(r.exit_code, 0) << c.model << " at " << c.x << ": " << r.err;
  }
}

// A blade comes down through a torus. In its teeth an opening contact and one that opposes it carry impulses
// of a hundred times the velocities, and the solve is within its tolerance.
TEST(CutOwnMesh, TorusCutByABlade_IsNotStopped) {
  const std::string path = test::mesh_dir() + "/misc/torus_coarse.msh";
  test::Context context;
  const dfm_world_def wd = dfm_world_def_default();
  dfm_world w = 0;
  test::ok(dfm_world_create(context, &wd, &w));
  const dfm_obstacle_def floor = dfm_obstacle_def_default();
  dfm_obstacle obstacle = 0;
  test::ok(dfm_obstacle_create(w, &floor, &obstacle));
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_load(context, path.c_str(), DFM_MESH_CELLS, &mesh));
  const dfm_mesh_info info = test::info_of(mesh);
  dfm_body_def def = dfm_body_def_default();
  const double *const points = info.points;
  def.tets = info.tets;
  const double scale = .08 / (info.hi[0] - info.lo[0]);
  std::vector<double> placed(3 * size_t{info.npoint});
  for (size_t i = 0; i < info.npoint; ++i) {
    for (size_t k = 0; k < 2; ++k)
      placed[3 * i + k] = scale * (points[3 * i + k] - .5 * (info.lo[k] + info.hi[k]));
    placed[3 * i + 2] = scale * (points[3 * i + 2] - info.lo[2]) + 1e-4;
  }
  def.points = placed.data();
  def.npoint = info.npoint;
  def.ntet = info.ntet;
  def.model = "corotational_fem";
  dfm_material_def material = dfm_material_def_default();
  material.young = 3e4;
  material.damping_mass = 2;
  material.damping_stiffness = 2e-3;
  test::ok(dfm_material_create(w, &material, &def.material));
  dfm_body body = 0;
  test::ok(dfm_body_create(w, &def, &body));
  const dfm_separate_def pieces = dfm_separate_def_default();
  test::ok(dfm_body_set_separate(body, &pieces));
  dfm_tool_def blade = dfm_tool_def_default();
  blade.shape = DFM_TOOL_BLADE;
  blade.half_size[0] = 5e-4;
  blade.half_size[1] = .06;
  blade.half_size[2] = .02;
  blade.pose.position[0] = .005;
  blade.pose.position[2] = .1;
  dfm_tool tool = 0;
  test::ok(dfm_tool_create(w, &blade, &tool));
  test::ok(dfm_tool_set_cuts(tool, DFM_CUT_SPLIT, 0, 1, &body));
  for (int s = 1; s <= 300; ++s) {
    const double t = s * 1e-3;
    dfm_pose pose{};
    pose.position[0] = .005;
    pose.position[2] = t < .3 ? .1 - .1 * t / .3 : 0;
    test::ok(dfm_tool_set_pose(tool, &pose, nullptr));
    ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << "step " << s << ": " << dfm_last_error();
  }
  test::ok(dfm_mesh_destroy(mesh));
}
