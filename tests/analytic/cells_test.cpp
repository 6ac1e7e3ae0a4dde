// Bars of second-order tetrahedra and of hexahedra against the converged value of the reference set
// (reference/elasticity, bar_tip), and near poisson 1/2.
#include <deform/plugin.h>

#include <cstring>

#include "statics.h"

namespace {

constexpr double kSide = 0.1, kForce = 0.01;

// A bar of 1 x 0.1 x 0.1 m of `across` cells in each direction across, of the cells that the file has.
std::string bar_file(dfm_context *context, const char *kind, uint32_t across, bool second) {
  const double size[3] = {1, kSide, kSide};
  const uint32_t cubes = 10 * across * across * across;
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_make(context, kind, size, DFM_MESH_CELLS,
                         std::strcmp(kind, "bricks") ? 12 * cubes : cubes, &mesh));
  if (second) test::ok(dfm_mesh_second_order(mesh, &mesh));
  const std::string path = test::scratch("cells_bar") + "/bar.vtu";
  test::ok(dfm_mesh_write(mesh, path.c_str()));
  return path;
}

// Tip deflection under a uniform traction at the end over `exact`, by the work of its consistent loads.
double tip(const char *model, const char *kind, uint32_t across, bool second, double poisson, double exact) {
  test::Context context;
  const std::string path = bar_file(context, kind, across, second);
  test::Statics s(path, model, 1e5, poisson);
  dfm_mesh_handle mesh = 0;
  test::ok(dfm_mesh_load(context, path.c_str(), DFM_MESH_CELLS, &mesh));
  const dfm_mesh_info info = test::info_of(mesh);
  const uint32_t *const nodes = info.cells ? info.cells : info.tets;
  const double *const x = info.points;
  const uint32_t k = info.cell == DFM_CELL_HEX27   ? 27
                     : info.cell == DFM_CELL_HEX8  ? 8
                     : info.cell == DFM_CELL_TET10 ? 10
                                                   : 4;
  std::vector<double> weight(info.npoint);
  double all = 0;
  for (uint32_t c = 0; c < info.ncell; ++c) {
    const auto at_end = [&](uint32_t a) { return x[3 * nodes[k * c + a]] > 1 - 1e-9; };
    uint32_t on = 0;
    for (uint32_t a = 0; a < k; ++a) on += at_end(a);
    if (on != (k == 27 ? 9 : k == 8 ? 4 : k == 10 ? 6 : 3)) continue;
    for (uint32_t a = k == 10 ? 4 : 0; a < k; ++a)
      weight[nodes[k * c + a]] += at_end(a) * (k < 27 || a < 8 ? 1 : a < 20 ? 4 : 16);
  }
  for (double w : weight) all += w;
  for (uint32_t i = 0; i < info.npoint; ++i) {
    const double force[3] = {0, 0, -kForce * weight[i] / all};
    if (x[3 * i] < 1e-9) s.hold(i, 7);
    if (weight[i] > 0) s.load(i, force);
  }
  s.solve();
  const std::vector<double> u = s.displacement();
  double work = 0;
  for (uint32_t i = 0; i < info.npoint; ++i) work += u[3 * i + 2] * weight[i] / all;
  return -work / exact;
}

constexpr double kExact = 0.004003982437917666;

TEST(Cells, BarOfOneCellAcross_BendsAsTheReferenceSet) {
  for (const char *model : {"linear_fem", "corotational_fem"}) {
    EXPECT_NEAR(tip(model, "beam", 1, true, 0.3, kExact), 1, 0.02) << model;
    EXPECT_NEAR(tip(model, "bricks", 1, false, 0.3, kExact), 1, 0.02) << model;
    EXPECT_NEAR(tip(model, "bricks", 1, true, 0.3, kExact), 1, 0.02) << model;
  }
  EXPECT_LT(tip("linear_fem", "beam", 1, false, 0.3, kExact), 0.5);
}

TEST(Cells, BarOfMoreCellsAcross_IsNearer) {
  EXPECT_NEAR(tip("linear_fem", "beam", 2, true, 0.3, kExact), 1, 0.005);
  EXPECT_NEAR(tip("linear_fem", "bricks", 4, false, 0.3, kExact), 1, 0.005);
  EXPECT_NEAR(tip("linear_fem", "bricks", 2, true, 0.3, kExact), 1, 0.005);
}

// Against two HEX27 across, which three change by 0.06 %; first-order tetrahedra give 0.06.
TEST(Cells, BarNearlyIncompressible_DoesNotLock) {
  const double exact = kExact * tip("linear_fem", "bricks", 2, true, 0.499, kExact);
  for (const bool second : {false, true})
    EXPECT_NEAR(tip("linear_fem", "bricks", 1, second, 0.499, exact), 1, 0.02) << second;
  for (const uint32_t across : {1u, 2u})
    EXPECT_NEAR(tip("linear_fem", "beam", across, true, 0.499, exact), 1, 0.02) << across;
}

}  // namespace
