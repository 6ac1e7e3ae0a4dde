// A body that is cut half way and whose upper part is then pulled, sheared and pressed: the two sides of the
// slit keep each other out, and contact adds no energy.
#include <algorithm>
#include <set>

#include "crossing.h"
#include "cut_scenes.h"

namespace {

using namespace test::cutting;

struct Slit {
  test::Context context;
  dfm_world w;
  dfm_body b = 0;
  double size = 0;  // m
  explicit Slit(const char *model, bool rabbit) : w(test::make_world(context, {0, 0, 0})) {
    test::set_friction(w, 0.3);
    dfm_mesh_handle mesh = 0;
    const double edges[] = {0.1, 0.1, 0.1};
    if (rabbit) {
      dfm_mesh_handle skin = 0;
      test::ok(
          dfm_mesh_load(context, DEFORM_SOURCE_DIR "/examples/data/rabbit.obj", DFM_MESH_SURFACE, &skin));
      test::ok(dfm_mesh_fill(skin, 1500, &mesh));
      test::ok(dfm_mesh_destroy(skin));
    } else {
      test::ok(dfm_mesh_make(context, "beam", edges, DFM_MESH_CELLS, 700, &mesh));
    }
    dfm_body_def d = dfm_body_def_default();
    test::lend(mesh, d);
    test::BodyOptions o;
    o.young = 2e4;
    o.damping_mass = 2;
    o.damping_stiffness = 2e-3;
    d.material = test::make_material(w, o);
    d.model = model;
    test::ok(dfm_body_create(w, &d, &b));
    test::ok(dfm_mesh_destroy(mesh));
    std::vector<double> x = State(b).x;
    double lo[3] = {9, 9, 9}, hi[3] = {-9, -9, -9};
    for (size_t i = 0; i < x.size(); ++i) {
      lo[i % 3] = std::min(lo[i % 3], x[i]);
      hi[i % 3] = std::max(hi[i % 3], x[i]);
    }
    const double height = hi[2] - lo[2], z = lo[2] + 0.503 * height, to = lo[0] + 0.6 * (hi[0] - lo[0]);
    size = std::cbrt(height * (hi[0] - lo[0]) * (hi[1] - lo[1]));
    dfm_cut_def blade = dfm_cut_def_default();
    blade.shape = DFM_CUT_BLADE;
    blade.how = DFM_CUT_SPLIT;
    const double corner[12] = {-9, -9, z, -9, 9, z, to, 9, z, to, -9, z};
    std::copy(corner, corner + 12, blade.blade);
    EXPECT_GT(cut(b, blade).points, 10u);
    x = State(b).x;
    std::vector<uint32_t> below, above;
    for (uint32_t i = 0; 3 * size_t{i} < x.size(); ++i) {
      if (x[3 * size_t{i} + 2] < lo[2] + 0.15 * height) below.push_back(i);
      if (x[3 * size_t{i} + 2] > hi[2] - 0.15 * height) above.push_back(i);
    }
    test::ok(dfm_body_hold(b, uint32_t(below.size()), below.data(), 7));
    test::ok(dfm_body_hold(b, uint32_t(above.size()), above.data(), 7));
    const double way[7][4] = {{0, 0, 0, 0},
                              {0.1, 0, 0, -0.1},
                              {0.25, 0.15, 0.1, -0.12},
                              {0.4, -0.15, -0.1, -0.12},
                              {0.55, 0, 0, 0.1},
                              {0.7, 0.1, 0, -0.15},
                              {0.8, 0, 0, 0}};
    dfm_pose_key keys[7] = {};
    for (int k = 0; k < 7; ++k) {
      keys[k].t = way[k][0];
      keys[k].pose.rotation[3] = 1;
      for (int i = 0; i < 3; ++i) keys[k].pose.position[i] = size * way[k][i + 1];
    }
    test::ok(dfm_body_move_held(b, uint32_t(above.size()), above.data(), 7, keys, nullptr));
  }

  // The deepest crossing of two triangles that share no corner, in edges.
  double deepest() const {
    const dfm_body_info i = info(b);
    std::vector<double> x(3 * size_t{i.nsurfel});
    std::vector<uint32_t> t(3 * size_t{i.ntriangle});
    uint32_t n = 0;
    test::ok(dfm_surface_positions(b, i.nsurfel, x.data(), &n));
    test::ok(dfm_surface_triangles(b, i.ntriangle, t.data(), &n));
    double most = 0;
    for (size_t p = 0; p < i.ntriangle; ++p)
      for (size_t q = 0; q < p; ++q) {
        const uint32_t *const c = &t[3 * p], *const d = &t[3 * q];
        const double *u[3], *v[3];
        bool share = false, apart = false;
        for (int k = 0; k < 3; ++k) {
          u[k] = &x[3 * size_t{c[k]}];
          v[k] = &x[3 * size_t{d[k]}];
          share = share || std::find(d, d + 3, c[k]) != d + 3;
        }
        for (int k = 0; k < 3; ++k)
          apart = apart || std::max({u[0][k], u[1][k], u[2][k]}) < std::min({v[0][k], v[1][k], v[2][k]}) ||
                  std::max({v[0][k], v[1][k], v[2][k]}) < std::min({u[0][k], u[1][k], u[2][k]});
        if (!share && !apart) most = std::max(most, crossing::depth(u, v) / edge(u));
      }
    return most;
  }

 private:
  static double edge(const crossing::Triangle t) {
    double square = 0;
    for (int k = 0; k < 3; ++k) square += (t[1][k] - t[0][k]) * (t[1][k] - t[0][k]);
    return std::sqrt(square);
  }
};

}  // namespace

// Without contact beyond half an edge of slip, and of copies of points alone: a sixth of an edge deep.
// With copies that hold for a tenth of an edge (doc/decisions/cutting.md): up to 0.026.
TEST(Slit, ShearedAndPressed_KeepsItsSidesApart) {
  for (const bool rabbit : {false, true})
    for (const char *model : kModels) {
      Slit s(model, rabbit);
      double deepest = 0;
      for (int i = 0; i < 50; ++i) {
        steps(s.w, 20);  // asks for no energy of contact
        deepest = std::max(deepest, s.deepest());
      }
      EXPECT_LT(deepest, 0.004) << model << " " << rabbit;
      const dfm_body_measure end = test::measure(s.b);
      EXPECT_EQ(end.inverted, 0u);
      // back in its shape, at rest
      EXPECT_LT(end.kinetic + end.elastic, 1e-2 * test::stats(s.w).energy_max) << model << " " << rabbit;
      EXPECT_EQ(test::stats(s.w).energy_gain, 0) << model << " " << rabbit;
    }
}
