// Time of the corotational model's passes per tetrahedron, through the plugin ABI, beside the arithmetic of
// the cells alone (bound/corot_bound.h), for every instruction set, and bytes per tetrahedron. `--csv FILE
// --commit ID` appends the figures; --mesh FILE takes another mesh than the fine cylinder. The least of the
// repetitions counts: others share the machine.
#include "bound/corot_bound.h"
#include "corot_host.h"
#include "machine.h"

namespace {

using namespace corot_test;
using bench::least_ns;

struct Row {
  std::string isa, what;
  double ns, bytes;
};

struct alignas(64) Aligned : corot::Group {};
static_assert(sizeof(Aligned) == sizeof(corot::Group));

double time_plain(const Mesh &mesh, corot_bound::Kernel kernel) {
  const uint32_t groups = (mesh.ncell() + corot::kGroup - 1) / corot::kGroup;
  std::vector<double> storage(2 * size_t(groups) * 72 + 16);
  std::vector<Aligned> group(groups);
  double *at = storage.data();
  while (reinterpret_cast<uintptr_t>(at) % 64) ++at;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-0.01, 0.01);
  for (size_t n = 0; n < 2 * size_t(groups); ++n)
    for (size_t k = 0; k < 9; ++k)
      for (size_t lane = 0; lane < 4; ++lane) at[36 * n + 4 * k + lane] = (k % 4 == 0) + u(random);
  for (corot::Group &g : group) {
    for (auto &row : g.g) std::fill(std::begin(row), std::end(row), 100.0);
    std::fill(std::begin(g.mu2), std::end(g.mu2), 1.0);
    std::fill(std::begin(g.lambda), std::end(g.lambda), 1.0);
  }
  const corot_bound::Cells cells = {groups, group.data(), at, at + 72 * size_t(groups)};
  return least_ns(300, [&] { kernel(cells); });
}

}  // namespace

int main(int argc, char **argv) {
  bench::Csv table(argc, argv, "mesh,points,cells,isa,pass,ns_per_cell,bytes_per_cell");
  std::string path = test::mesh_dir() + "/thesis/cyl_fine.msh";
  for (int n = 1; n + 1 < argc; n += 2)
    if (!std::strcmp(argv[n], "--mesh")) path = argv[n + 1];
  const Mesh mesh = read_msh(path);
  if (!mesh.ncell()) {
    std::fprintf(stderr, "corot_kernel_bench: %s has no tetrahedra; give --mesh FILE\n", path.c_str());
    return 2;
  }
  const std::pair<const char *, Params> kinds[] = {{"forces", {}},
                                                   {"forces_damped", {{"damping_stiffness", {0.002}}}},
                                                   {"forces_fibers", {{"anisotropy_young", {1e6}}}},
                                                   {"forces_neo_hookean", {{"energy", {1}}}},
                                                   {"forces_stvk", {{"energy", {2}}}}};
  const std::pair<const char *, corot_bound::Kernel> plain[] = {{"sse2", corot_bound::plain_sse2()},
                                                                {"avx2", corot_bound::plain_avx2()},
                                                                {"avx512", corot_bound::plain_avx512()}};
  std::vector<Row> rows;
  for (const auto &[isa, kernel] : plain) {
    setenv("DEFORM_SIMD", isa, 1);
    for (const auto &[what, params] : kinds) {
      Host host;
      Instance b(host, mesh, params);
      if (!host.logged.empty()) break;  // not on this processor
      const double bytes = double(host.live) / mesh.ncell();
      b.shake(1e-4, 0.1);
      const dfm_kin kin = b.kin();
      rows.push_back({isa, what, least_ns(300, [&] { b.ops->add_forces(b.self, &kin, b.f); }), bytes});
      if (rows.back().what != "forces") continue;
      rows.push_back({isa, "plain", time_plain(mesh, kernel), 0});
      double joule = 0, h = 1;
      std::vector<double> k(b.size()), c(b.size());
      rows.push_back({isa, "energy", least_ns(100, [&] { b.ops->energy(b.self, &kin, &joule); }), bytes});
      rows.push_back(
          {isa, "bound", least_ns(100, [&] { b.ops->bound(b.self, &kin, k.data(), c.data(), &h); }), bytes});
      uint32_t nb = 0;
      b.ops->pattern(b.self, &nb, nullptr);
      std::vector<double> blk(9 * size_t(nb));
      rows.push_back({isa, "stiffness",
                      least_ns(100, [&] { b.ops->stiffness(b.self, &kin, 1, 0, blk.data()); }), bytes});
    }
  }
  unsetenv("DEFORM_SIMD");
  const std::string name = path.substr(path.rfind('/') + 1);
  for (const Row &r : rows) {
    const double ns = r.ns / mesh.ncell();
    std::printf("%-7s %-20s %8.1f ns per tetrahedron  %5.0f bytes\n", r.isa.c_str(), r.what.c_str(), ns,
                r.bytes);
    if (table.csv)
      std::fprintf(table.csv, "%s,%s,%u,%u,%s,%s,%.4g,%.4g\n", table.head.c_str(), name.c_str(),
                   mesh.npoint(), mesh.ncell(), r.isa.c_str(), r.what.c_str(), ns, r.bytes);
  }
}
