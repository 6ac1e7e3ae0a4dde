// The step bound of the corotational model: a bound in every shape, near the truth at rest, and the truth
// where motion starts to grow.
#include "corot_host.h"
#include "model_operator.h"

namespace corot_test {
namespace {

// unsanitized: too slow there; shorter tests run the same code
TEST(CorotBound, RowSums_BoundTheTrueSpectrumInEveryShape) {
  const Mesh mesh = kuhn_bar(4, 2, 2, 0.1, 0.2);
  Fields uneven;
  for (uint32_t c = 0; c < mesh.ncell(); ++c) {
    uneven["damping_stiffness"].push_back(c % 3 ? 0 : 0.01);
    uneven["young"].push_back(c % 2 ? 1e5 : 3e4);
    uneven["poisson"].push_back(c % 4 * 0.1);
    uneven["damping_mass"].push_back(c % 5);
  }
  const Params soft = {{"poisson", {0.0}}}, damped = {{"damping_stiffness", {0.004}}, {"damping_mass", {3}}};
  const Params full = {{"poisson", {0.49}}}, negative = {{"poisson", {-0.5}}};
  const Params fibers = {{"anisotropy_young", {1e6}}, {"anisotropy_axis", {1, 1, 0.3}}};
  const Params damped_fibers = {{"anisotropy_young", {3e4}},
                                {"anisotropy_shear", {1e5}},
                                {"anisotropy_axis", {1, 1, 0.3}},
                                {"damping_stiffness", {0.004}}};
  for (const auto &[p, fields] : std::initializer_list<std::pair<Params, Fields>>{
           {{}, {}},
           {soft, {}},
           {damped, {}},
           {full, {}},
           {negative, {}},
           {fibers, {}},
           {{{"energy", {1}}}, {}},
           {{{"energy", {1}}, {"poisson", {0.45}}, {"damping_stiffness", {0.004}}}, {}},
           {{{"energy", {2}}, {"poisson", {0.45}}}, {}},
           {damped_fibers, {}},
           {{{"locking", {1}}, {"poisson", {0.49}}, {"damping_stiffness", {0.004}}}, {}},
           {{{"locking", {1}}}, uneven},
           {{{"yield", {1e3}}}, {}},
           {{{"collapse", {15}}}, {}},
           {{{"collapse", {60}}, {"poisson", {0.45}}, {"damping_stiffness", {0.004}}}, uneven},
           {{{"yield", {1e3}}, {"poisson", {0.45}}, {"damping_stiffness", {0.004}}}, {}},
           {{}, uneven}})
    for (const double size : {1.0, 0.3, 2.0, -1.0, 10.0, -30.0}) {
      Host host;
      Instance b(host, mesh, p, 4, fields);
      std::mt19937 random(9);
      std::uniform_real_distribution<double> noise(-0.03, 0.03);
      for (uint32_t i = 0; i < b.size(); ++i) {  // squeezed, stretched, turned inside out, and shaken
        const Vec x = b.mesh.at(i);
        b.set(b.x, i,
              {size * x[0] + noise(random), x[1] + noise(random),
               std::sqrt(std::abs(size)) * x[2] + noise(random)});
      }
      b.forces_and_step();  // plastic cells have a strain of their own then
      const double h = b.bound(), value = Operator(b).largest(h, 120);
      EXPECT_LE(value, 4 * (1 + 1e-6)) << (p.empty() ? "default" : p.begin()->first) << " " << size;
    }
}

// T3: table critical_time_step.csv, the linear critical step of Verlet, lumped masses.
// unsanitized: too slow there; shorter tests run the same code
TEST(CorotBound, CriticalStep_IsNeitherExceededNorFarAway) {
  const auto rows = test::read_csv(test::reference_dir() + "/elasticity/tables/critical_time_step.csv");
  int seen = 0;
  for (size_t n = 1; n < rows.size(); ++n) {
    if (rows[n][1] != "lumped") continue;
    const Mesh mesh = read_msh(test::mesh_dir() + "/" + rows[n][0]);
    if (mesh.ncell() > 16000) continue;
    const double limit = std::stod(rows[n][3]);
    Host host;
    Instance b(host, mesh, {{"young", {1e5}}, {"poisson", {0.3}}});
    const double h = b.bound();
    std::printf("%s: bound %.3f of the critical step\n", rows[n][0].c_str(), h / limit);
    EXPECT_LT(h, limit) << rows[n][0];
    EXPECT_GT(h, 0.7 * limit) << rows[n][0];
    if (mesh.ncell() < 1000) {
      EXPECT_NEAR(Operator(b).largest(limit, 250), 4, 0.05) << rows[n][0];
      for (const double part : {0.98, 1.02}) {
        Instance free(host, mesh, {{"young", {1e5}}, {"poisson", {0.3}}});
        free.shake(1e-9, 0);
        const double grown = growth(free, part * limit, 1000);
        if (part < 1) {
          EXPECT_LT(grown, 100) << rows[n][0];
        } else {
          EXPECT_GT(grown, 1e3) << rows[n][0];
        }
      }
      ++seen;
    }
  }
  EXPECT_GT(seen, 1);
}

}  // namespace
}  // namespace corot_test
