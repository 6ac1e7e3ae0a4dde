// A mesh from a file, filled with cells, and cut: the smallest mass and the thinnest cell are not its own.
#include <random>

#include "cut_scenes.h"

using namespace test::cutting;

// Ten planes through the rabbit of the examples, each anywhere and at any angle, while it moves. Cells of a
// filled mesh hold as little material as a hundredth.
// unsanitized: too slow there; shorter tests run the same code
TEST(CutMesh, RabbitCutByTenPlanes_KeepsItsMassAndHalfOfItsStep) {
  for (const char *model : kModels)
    for (const bool share : {false, true}) {
      test::Context context;
      const dfm_world w = test::make_world(context, {0, 0, 0}, DFM_INTEGRATOR_SYMPLECTIC_EULER);
      dfm_mesh_handle skin = 0;
      dfm_mesh_handle mesh = 0;
      test::ok(
          dfm_mesh_load(context, DEFORM_SOURCE_DIR "/examples/data/rabbit.obj", DFM_MESH_SURFACE, &skin));
      test::ok(dfm_mesh_fill(skin, 600, &mesh));
      dfm_body_def d = dfm_body_def_default();
      const dfm_mesh_info info = test::lend(mesh, d);
      if (share) d.cell_share = info.share;
      test::BodyOptions o;
      o.young = 5e4;
      o.damping_stiffness = 1e-3;
      d.material = test::make_material(w, o);
      d.model = model;
      d.name = "rabbit";
      dfm_body b = 0;
      test::ok(dfm_body_create(w, &d, &b));
      const auto bound = [&] {
        steps(w, 40, 2e-4);  // the bound is found anew every few steps
        return test::stats(w).stable_step;
      };
      const double before = bound();
      const dfm_body_measure whole = test::measure(b);
      std::mt19937 random(8);
      const auto next = [&] { return double(random() % 20001) / 10000 - 1; };
      uint32_t parts = 1;
      for (int i = 0; i < 10; ++i) {
        const double at[3] = {whole.com[0] + 0.02 * next(), whole.com[1] + 0.02 * next(),
                              whole.com[2] + 0.02 * next()};
        double u[3], v[3];
        for (int k = 0; k < 3; ++k) {
          u[k] = next();
          v[k] = next();
        }
        dfm_cut_def blade = plane(0, 0, DFM_CUT_SPLIT);
        const double corner[4][2] = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
        for (int c = 0; c < 4; ++c)
          for (int k = 0; k < 3; ++k)
            blade.blade[3 * c + k] = at[k] + corner[c][0] * u[k] + corner[c][1] * v[k];
        parts = cut(b, blade).parts;
        EXPECT_GE(bound(), 0.5 * before) << model << " " << share << " " << i;
        EXPECT_NEAR(test::measure(b).mass, whole.mass, 1e-13 * whole.mass);
      }
      EXPECT_GT(parts, 5u);
      const State end(b);
      for (const double value : end.x) ASSERT_TRUE(std::isfinite(value)) << model;
      test::ok(dfm_mesh_destroy(mesh));
      test::ok(dfm_mesh_destroy(skin));
    }
}
