// What differs from cell to cell: fields, materials by cell, cells that are material only in part.
#include <functional>

#include "world.h"

namespace {

// A block 0.1 m wide of about 60 cells over a floor, with what a test gives its def.
struct Block {
  test::Context context;
  dfm_world world = 0;
  dfm_mesh_handle mesh = 0;
  dfm_body_def def = dfm_body_def_default();
  dfm_mesh_info info{};

  Block() {
    world = test::make_world(context);
    test::add_plane(world, "floor");
    const double size[3] = {0.1, 0.1, 0.1};
    test::ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 60, &mesh));
    info.size = sizeof info;
    test::ok(dfm_mesh_get_info(mesh, &info));
    def.points = info.points;
    def.tets = info.tets;
    def.name = "block";
    def.npoint = info.npoint;
    def.ntet = info.ntet;
    def.pose.position[2] = 0.02;
  }

  dfm_material material(const char *name, double density, double young, double poisson = 0.3) {
    dfm_material_def d = dfm_material_def_default();
    d.name = name;
    d.density = density;
    d.young = young;
    d.poisson = poisson;
    d.damping_stiffness = 1e-3;
    dfm_material m = 0;
    test::ok(dfm_material_create(world, &d, &m));
    return m;
  }

  dfm_body create() {
    dfm_body b = 0;
    test::ok(dfm_body_create(world, &def, &b));
    return b;
  }

  // State after a fall and an impact.
  uint64_t hash_after_run() {
    create();
    test::run(world, 0.1, 1e-3);
    return dfm_world_hash(world);
  }

  double volume(uint32_t t) const {
    const uint32_t *c = def.tets + size_t(4) * t;
    double e[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        e[i][k] = def.points[size_t(3) * c[i + 1] + size_t(k)] - def.points[size_t(3) * c[0] + size_t(k)];
    return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
            e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
            e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
           6;
  }
  double center_z(uint32_t t) const {
    double z = 0;
    for (int k = 0; k < 4; ++k) z += def.points[size_t(3) * def.tets[size_t(4) * t + size_t(k)] + 2] / 4;
    return z;
  }
};

// Each cell's material or value by whether it lies in the upper half.
template <class T>
std::vector<T> halves(const Block &b, T lower, T upper) {
  std::vector<T> out(b.info.ntet);
  for (uint32_t t = 0; t < b.info.ntet; ++t) out[t] = b.center_z(t) > 0.05 ? upper : lower;
  return out;
}

uint64_t hash_with(
    const std::function<void(Block &, std::vector<double> &, std::vector<dfm_material> &)> &prepare) {
  Block b;
  std::vector<double> values;
  std::vector<dfm_material> materials;
  dfm_cell_field field{"young", nullptr, 1};
  prepare(b, values, materials);
  field.values = values.data();
  if (!values.empty()) {
    b.def.nfield = 1;
    b.def.fields = &field;
  }
  if (!materials.empty()) b.def.cell_materials = materials.data();
  return b.hash_after_run();
}

void expect_refused(Block &b, dfm_status status, const std::vector<std::string> &parts) {
  dfm_body body = 77;
  EXPECT_EQ(dfm_body_create(b.world, &b.def, &body), status);
  EXPECT_EQ(body, 77u);
  for (const std::string &part : parts)
    EXPECT_NE(std::string(dfm_last_error()).find(part), std::string::npos)
        << part << " in: " << dfm_last_error();
}

}  // namespace

TEST(Fields, SameValueInEveryCell_IsTheParameterToTheBit) {
  // A power of two, so that E * sum V and sum (E V) round alike.
  const uint64_t one =
      hash_with([](Block &b, auto &, auto &) { b.def.material = b.material("gel", 1000, 32768); });
  auto field = [](double first) {
    return hash_with([=](Block &b, auto &values, auto &) {
      b.def.material = b.material("gel", 1000, 1e4);  // the field wins
      values.assign(b.info.ntet, 32768);
      values[0] = first;
    });
  };
  EXPECT_EQ(one, field(32768));
  EXPECT_NE(one, field(65536));
}

TEST(Fields, MaterialsThatDiffer_AreTheFieldOfTheirValues) {
  const uint64_t by_material = hash_with([](Block &b, auto &, auto &materials) {
    const dfm_material soft = b.material("soft", 1000, 2e4), stiff = b.material("stiff", 1000, 8e4);
    materials = halves<dfm_material>(b, soft, stiff);
  });
  const uint64_t by_field = hash_with([](Block &b, auto &values, auto &) {
    b.def.material = b.material("gel", 1000, 1e5);
    values = halves<double>(b, 2e4, 8e4);
  });
  EXPECT_EQ(by_material, by_field);
  const uint64_t both = hash_with([](Block &b, auto &values, auto &materials) {
    const dfm_material soft = b.material("soft", 1000, 2e6), stiff = b.material("stiff", 1000, 1e4);
    materials = halves<dfm_material>(b, soft, stiff);
    values = halves<double>(b, 2e4, 8e4);
  });
  EXPECT_EQ(both, by_field) << "an explicit field wins over the materials";
}

TEST(Fields, OneMaterialForAllCells_IsTheBodysMaterial) {
  const uint64_t whole =
      hash_with([](Block &b, auto &, auto &) { b.def.material = b.material("gel", 1500, 4e4); });
  const uint64_t by_cell = hash_with(
      [](Block &b, auto &, auto &materials) { materials.assign(b.info.ntet, b.material("gel", 1500, 4e4)); });
  const uint64_t none = hash_with([](Block &b, auto &, auto &materials) {
    b.def.material = b.material("gel", 1500, 4e4);
    materials.assign(b.info.ntet, 0);
  });
  EXPECT_EQ(whole, by_cell);
  EXPECT_EQ(whole, none) << "0 is the body's material";
}

TEST(Fields, DensityByCell_IsLumpedAndMovesTheCenter) {
  Block b;
  const std::vector<dfm_material> materials =
      halves<dfm_material>(b, b.material("light", 500, 1e5), b.material("heavy", 2000, 1e5));
  b.def.cell_materials = materials.data();
  const dfm_body_measure m = test::measure(b.create());
  double mass = 0, moment = 0, volume = 0;
  for (uint32_t t = 0; t < b.info.ntet; ++t) {
    const double part = b.volume(t) * (b.center_z(t) > 0.05 ? 2000 : 500);
    mass += part;
    moment += part * b.center_z(t);
    volume += b.volume(t);
  }
  EXPECT_NEAR(m.mass, mass, 1e-13);
  EXPECT_NEAR(m.rest_volume, volume, 1e-16);
  EXPECT_NEAR(m.com[2], 0.02 + moment / mass, 1e-14);
  EXPECT_GT(m.com[2], 0.075) << "heavier above";
}

TEST(Share, HalfOfEveryCell_MovesAsHalfTheDensityAndStiffness) {
  Block full, half;
  full.def.material = full.material("gel", 500, 2e4);
  half.def.material = half.material("gel", 1000, 4e4);
  const std::vector<double> share(half.info.ntet, 0.5);
  half.def.cell_share = share.data();
  const dfm_body a = full.create(), b = half.create();
  EXPECT_NEAR(test::measure(b).rest_volume, 0.5e-3, 1e-16);
  EXPECT_NEAR(test::measure(b).mass, 0.5, 1e-13);
  EXPECT_NEAR(test::measure(b).volume, 0.5e-3, 1e-16) << "the part of the cells that is material";
  test::run(full.world, 0.05, 1e-3);
  test::run(half.world, 0.05, 1e-3);
  std::vector<double> xa(3 * full.info.npoint), xb(xa);
  uint32_t n = 0;
  test::ok(dfm_body_get_state(a, full.info.npoint, xa.data(), nullptr, &n));
  test::ok(dfm_body_get_state(b, half.info.npoint, xb.data(), nullptr, &n));
  for (size_t i = 0; i < xa.size(); ++i) ASSERT_NEAR(xa[i], xb[i], 1e-12) << i;
}

TEST(Share, ScalesAFieldAndMaterialsToo) {
  const uint64_t shared = hash_with([](Block &b, auto &, auto &materials) {
    static std::vector<double> share;
    share = halves<double>(b, 1, 0.25);
    b.def.cell_share = share.data();
    materials = halves<dfm_material>(b, b.material("soft", 1000, 2e4), b.material("stiff", 4000, 8e4));
  });
  const uint64_t plain = hash_with([](Block &b, auto &values, auto &) {
    b.def.material = b.material("gel", 1000, 9e4);
    values.assign(b.info.ntet, 2e4);
  });
  EXPECT_EQ(shared, plain);
}

TEST(Fields, WrongOnes_AreRefused) {
  Block b;
  std::vector<double> values(3 * size_t(b.info.ntet), 1e4);
  dfm_cell_field f[2] = {{"yuong", values.data(), 1}, {"young", values.data(), 1}};
  b.def.nfield = 1;
  b.def.fields = f;
  expect_refused(b, DFM_E_ARG, {"'block'", "'yuong'", "did you mean 'young'"});
  f[0].key = "relaxation_time";
  expect_refused(b, DFM_E_ARG, {"relaxation_time", "whole body", "young"});
  f[0] = {"young", values.data(), 3};
  expect_refused(b, DFM_E_ARG, {"3 values per cell, 1 expected"});
  f[0] = {"young", nullptr, 1};
  expect_refused(b, DFM_E_ARG, {"field 0 has no values"});
  f[0] = {nullptr, values.data(), 1};
  expect_refused(b, DFM_E_ARG, {"field 0 has no key"});
  b.def.fields = nullptr;
  expect_refused(b, DFM_E_ARG, {"1 fields are announced"});
  b.def.fields = f;
  b.def.nfield = 2;
  f[0] = {"young", values.data(), 1};
  expect_refused(b, DFM_E_ARG, {"given twice"});
  b.def.nfield = 1;
  for (double bad : {-5.0, 0.0, 1e300, double(NAN), double(INFINITY)}) {
    values[5] = bad;
    expect_refused(b, DFM_E_ARG, {"field 'young': cell 5 is", "Pa"});
  }
  values[5] = 1e4;
  const double young = 3e4;
  const dfm_param_value given{"young", &young, 1};
  b.def.model_params = {sizeof(dfm_params), 1, &given};
  expect_refused(b, DFM_E_ARG, {"'young' is given both"});
}

TEST(Share, OutOfRange_IsRefused) {
  for (double bad : {0.0, -0.5, 1.0000001, double(NAN)}) {
    Block b;
    std::vector<double> share(b.info.ntet, 1);
    share[9] = bad;
    b.def.cell_share = share.data();
    expect_refused(b, DFM_E_ARG, {"share of cell 9"});
  }
}

TEST(CellMaterials, WrongOnes_AreRefused) {
  Block b, other;
  std::vector<dfm_material> materials(b.info.ntet, b.material("gel", 1000, 1e4));
  materials[11] = other.material("far", 1000, 1e4);
  b.def.cell_materials = materials.data();
  expect_refused(b, DFM_E_HANDLE, {"'far'", "another world"});
  materials[11] = 12345;
  expect_refused(b, DFM_E_HANDLE, {});
  // What the model takes for the whole body cannot differ, unless the body says it itself. relaxation_time is
  // such a row of msm.
  dfm_material_def d = dfm_material_def_default();
  const double slow = 3, time = 0.2;
  const dfm_param_value extra{"relaxation_time", &slow, 1}, given{"relaxation_time", &time, 1};
  d.name = "slow";
  d.young = 1e4;
  d.extra = {sizeof(dfm_params), 1, &extra};
  test::ok(dfm_material_create(b.world, &d, &materials[11]));
  expect_refused(b, DFM_E_ARG, {"'relaxation_time'", "'gel'", "'slow'", "differ"});
  b.def.model_params = {sizeof(dfm_params), 1, &given};
  b.create();
}

// What the def has a member for, and what is there already, is no further entry.
TEST(CellMaterials, EntriesGivenTwice_AreRefused) {
  Block b;
  const double x = 0.4;
  const dfm_param_value twice[] = {{"friction", &x, 1}, {"friction", &x, 1}}, young{"young", &x, 1};
  dfm_material_def d = dfm_material_def_default();
  dfm_material out = 0;
  for (const auto &extra : {dfm_params{sizeof(dfm_params), 2, twice}, {sizeof(dfm_params), 1, &young}}) {
    d.extra = extra;
    EXPECT_EQ(dfm_material_create(b.world, &d, &out), DFM_E_ARG);
    test::says({"a second time"});
  }
}

TEST(Fields, ParametersWhileRunning_LeaveTheFieldAlone) {
  Block b;
  b.def.material = b.material("gel", 1000, 1e4);
  const std::vector<double> values = halves<double>(b, 2e4, 8e4);
  const dfm_cell_field f{"young", values.data(), 1};
  b.def.nfield = 1;
  b.def.fields = &f;
  const dfm_body body = b.create();
  const double young = 5e4, drag = 2;
  dfm_param_value v{"young", &young, 1};
  const dfm_params p{sizeof(dfm_params), 1, &v};
  EXPECT_EQ(dfm_body_set_params(body, &p), DFM_E_ARG);
  EXPECT_NE(std::string(dfm_last_error()).find("'young' differs by cell (from field)"), std::string::npos)
      << dfm_last_error();
  v = {"damping_mass", &drag, 1};
  DFM_OK_OR_DIE(dfm_body_set_params(body, &p));
}

TEST(Fields, Snapshot_NeedsTheSameFields) {
  auto make = [](Block &b, double upper) {
    b.def.material = b.material("gel", 1000, 1e4);
    const std::vector<double> values = halves<double>(b, 2e4, upper);
    const dfm_cell_field f{"young", values.data(), 1};
    b.def.nfield = 1;
    b.def.fields = &f;
    b.create();
  };
  Block a, same, other;
  make(a, 8e4);
  make(same, 8e4);
  make(other, 9e4);
  test::run(a.world, 0.05, 1e-3);
  const std::string data = test::snapshot(a.world);
  EXPECT_EQ(dfm_world_restore(other.world, data.data(), data.size()), DFM_E_FORMAT);
  EXPECT_NE(std::string(dfm_last_error()).find("fields"), std::string::npos);
  DFM_OK_OR_DIE(dfm_world_restore(same.world, data.data(), data.size()));
  test::run(a.world, 0.05, 1e-3);
  test::run(same.world, 0.05, 1e-3);
  EXPECT_EQ(dfm_world_hash(a.world), dfm_world_hash(same.world));
}

// What a cut leaves has the state of the whole, plastic strains too, where none of its cells yields.
TEST(Fields, PartWithoutCellsThatYield_IsSeparated) {
  Block b;
  const std::vector<double> yield = halves<double>(b, 0, 1e4);
  const dfm_cell_field field{"yield", yield.data(), 1};
  b.def.material = b.material("gel", 1000, 1e5);
  b.def.model = "corotational_fem";
  b.def.nfield = 1;
  b.def.fields = &field;
  const dfm_body body = b.create();
  dfm_cut_def cut = dfm_cut_def_default();
  cut.shape = DFM_CUT_PLANE;
  cut.how = DFM_CUT_SPLIT;
  cut.blade[2] = 0.07;
  cut.blade[5] = 1;
  dfm_cut_info done{};
  done.size = sizeof done;
  test::ok(dfm_body_cut(body, &cut, &done));
  test::ok(dfm_body_separate(body, nullptr, &done));
  EXPECT_EQ(done.pieces, 1u);
  test::run(b.world, 0.01, 1e-3);
}
