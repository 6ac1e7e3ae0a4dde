// Time of the forces of second-order tetrahedra and hexahedra per cell, through the plugin ABI, beside the
// products of their stiffness alone, and bytes per cell. `--csv FILE --commit ID` appends the figures.
#include "cell_meshes.h"
#include "machine.h"
#include "model_common/cell_blocks.h"

namespace {

using namespace model_test;
using bench::least_ns;

Mesh mesh_of(uint32_t kind, uint32_t across) {
  if (kind == DFM_CELL_TET10) return second_order(kuhn_bar(across, across, across, 0.01, 0));
  const Mesh bricks = brick_bar(across, across, across, {0.01, 0.01, 0.01});
  return kind == DFM_CELL_HEX8 ? bricks : with_middles(bricks, kind, 0);
}

// The products of the cells' stiffness alone, nothing gathered, turned or added up.
double plain_ns(uint32_t nodes, uint32_t cells) {
  model::CellBlocks blocks;
  blocks.nodes = nodes;
  const std::vector<double> k(9 * blocks.each() * cells, 1.0);
  std::vector<double> u(3 * size_t(nodes) * cells, 1e-3), out(u.size());
  const auto at = [&](std::vector<double> &of, uint32_t c) {
    return reinterpret_cast<double (*)[3]>(&of[3 * size_t(nodes) * c]);
  };
  return least_ns(300, [&] {
    for (uint32_t c = 0; c < cells; ++c) blocks.apply(&k[9 * blocks.each() * c], at(u, c), at(out, c));
  });
}

}  // namespace

int main(int argc, char **argv) {
  bench::Csv table(argc, argv, "model,cells,points,kind,ns_per_cell,plain_ns_per_cell,bytes_per_cell");
  constexpr struct {
    uint32_t kind, nodes, across;
  } kKinds[] = {
      {DFM_CELL_TET10, 10, 4}, {DFM_CELL_HEX8, 8, 7}, {DFM_CELL_HEX20, 20, 4}, {DFM_CELL_HEX27, 27, 4}};
  for (const char *model : {"model_linear_fem", "model_corotational_fem"})
    for (const auto &of : kKinds) {
      const dfm_type &type = type_of(model);
      std::vector<double> values;
      for (uint32_t n = 0; n < type.nparam; ++n)
        values.insert(values.end(), type.params[n].width, type.params[n].def);
      Host host;
      ModelInstance b(host, type, mesh_of(of.kind, of.across), values);
      std::mt19937 random(1);
      std::uniform_real_distribution<double> u(-1e-5, 1e-5);
      for (uint32_t i = 0; i < b.stride * b.size(); ++i) b.x[i] += u(random);
      const uint32_t cells = b.mesh.ncell();
      const dfm_kin kin = b.kin();
      const double ns = least_ns(300, [&] { b.ops->add_forces(b.self, &kin, b.f); }) / cells,
                   plain = plain_ns(of.nodes, cells) / cells, bytes = double(host.live) / cells;
      std::printf("%-22s %2u points %5u cells %7.0f ns per cell, %7.0f plain, %6.0f bytes\n", model, of.nodes,
                  cells, ns, plain, bytes);
      if (table.csv)
        std::fprintf(table.csv, "%s,%s,%u,%u,%u,%.4g,%.4g,%.4g\n", table.head.c_str(), model, cells,
                     b.mesh.npoint(), of.nodes, ns, plain, bytes);
    }
}
