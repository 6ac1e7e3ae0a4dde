// A filled box against elasticity and against the same box meshed by the generator: its lattice lies askew to
// its walls, so the shares of the cut cells are what gives it the right cross-section.
#include "support.h"
#include "coupled.h"

namespace {

constexpr std::array<double, 3> kSize{0.06, 0.08, 0.4};
constexpr double kYoung = 1e5, kStrain = 0.01, kEnd = 0.06;

struct Box {
  test::Context context;
  dfm_world world = test::make_world(context, {0, 0, 0});
  dfm_body body = 0;
  std::vector<double> rest;

  Box(bool filled, uint32_t cells, double density) {
    test::BodyOptions o;
    o.young = kYoung;
    o.damping_mass = 20;
    o.volume = 1;
    if (!filled) {
      body = test::make_body(context, world, "beam", kSize, cells, o);
    } else {
      dfm_mesh_handle skin = 0;
      dfm_mesh_handle mesh = 0;
      test::ok(dfm_mesh_make(context, "beam", kSize.data(), DFM_MESH_SURFACE, 2000, &skin));
      test::ok(dfm_mesh_fill(skin, uint32_t(cells * density), &mesh));
      make(skin, mesh, o);
    }
    dfm_body_info info{};
    info.size = sizeof info;
    test::ok(dfm_body_get_info(body, &info));
    rest.resize(3 * size_t(info.npoint));
    test::ok(dfm_body_get_rest(body, info.npoint, rest.data(), 0, nullptr));
  }

  void make(dfm_mesh_handle skin, dfm_mesh_handle mesh, const test::BodyOptions &o) {
    dfm_mesh_info info{};
    dfm_mesh_info surface{};
    info.size = sizeof info;
    surface.size = sizeof surface;
    test::ok(dfm_mesh_get_info(mesh, &info));
    test::ok(dfm_mesh_get_info(skin, &surface));
    dfm_surface_def def{};
    def.size = sizeof def;
    def.npoint = surface.npoint;
    def.ntriangle = surface.ntriangle;
    def.points = surface.points;
    def.triangles = surface.faces;
    dfm_body_def d = dfm_body_def_default();
    d.points = info.points;
    d.tets = info.tets;
    d.cell_share = info.share;
    dfm_material_def md = dfm_material_def_default();
    md.young = o.young;
    md.poisson = 0.3;
    md.damping_mass = o.damping_mass;
    test::ok(dfm_material_create(world, &md, &d.material));
    const dfm_param_value volume{"volume", &o.volume, 1};
    d.model_params = {sizeof(dfm_params), 1, &volume};
    d.npoint = info.npoint;
    d.ntet = info.ntet;
    d.surface = &def;
    test::ok(dfm_body_create(world, &d, &body));
  }

  // Pulls both ends apart and returns the strain between two sections far from them.
  double stretched() {
    std::vector<uint32_t> points;
    std::vector<double> force;
    for (const bool top : {false, true}) {
      const size_t first = points.size();
      for (uint32_t i = 0; i < rest.size() / 3; ++i)
        if (top ? rest[3 * i + 2] > kSize[2] - kEnd : rest[3 * i + 2] < kEnd) points.push_back(i);
      const double each =
          (top ? 1 : -1) * kYoung * kSize[0] * kSize[1] * kStrain / double(points.size() - first);
      for (size_t i = first; i < points.size(); ++i) force.insert(force.end(), {0, 0, each});
    }
    test::ok(dfm_body_add_load(body, uint32_t(points.size()), points.data(), force.data(), 0, nullptr,
                               nullptr, nullptr));
    const std::vector<double> before = test::surface_positions(body);
    test::run(world, 1.0, 5e-4);
    const std::vector<double> after = test::surface_positions(body);
    // Slope of the displacement over the height, by least squares over the middle half of the surface.
    double n = 0, sz = 0, su = 0, szz = 0, szu = 0;
    for (size_t i = 2; i < before.size(); i += 3) {
      const double z = before[i], u = after[i] - before[i];
      if (z < 0.25 * kSize[2] || z > 0.75 * kSize[2]) continue;
      n += 1;
      sz += z;
      su += u;
      szz += z * z;
      szu += z * u;
    }
    return (n * szu - sz * su) / (n * szz - sz * sz);
  }
};

}  // namespace

TEST(FilledBox, Mass_IsThatOfTheBox) {
  const Box box(true, 1500, 1);
  const double mass = 1000 * kSize[0] * kSize[1] * kSize[2];
  EXPECT_NEAR(test::measure(box.body).mass, mass, 1e-9 * mass);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(test::measure(box.body).com[k], kSize[size_t(k)] / 2, 0.002 * kSize[2]);
}

TEST(FilledBox, Stretch_LikeTheMeshedBeam) {
  const double meshed = Box(false, 1500, 1).stretched();
  EXPECT_NEAR(meshed, kStrain, 0.04 * kStrain);
  for (const double density : {0.8, 1.0, 1.3}) {  // other pitches: the walls cut the cells elsewhere
    const double filled = Box(true, 2500, density).stretched();
    RecordProperty("filled_over_meshed_" + std::to_string(int(100 * density)),
                   std::to_string(filled / meshed));
    EXPECT_NEAR(filled, meshed, 0.04 * meshed) << density;
  }
}
