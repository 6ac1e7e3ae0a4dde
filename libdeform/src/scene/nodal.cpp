// Boundary conditions node by node: node,fixx,fixy,fixz,fx,fy,fz with the mesh file's node numbers from 0.
#include <cmath>

#include "core/error.h"
#include "scene/select.h"
#include "scene/table.h"

namespace dfm::scene {
namespace {

constexpr const char *kHeader = "node,fixx,fixy,fixz,fx,fy,fz";

}  // namespace

std::vector<NodalRow> read_nodal(const std::string &path, const BodyMesh &mesh) {
  const std::vector<uint32_t> point_of = points_of_nodes(mesh);
  Table table(path, kHeader, point_of.size(), 7);
  if (table.empty())
    fail(DFM_E_FORMAT, "%s: nothing to read; expected the header %s and a row for each node", path.c_str(),
         kHeader);
  if (table.first() != kHeader) table.refuse_header();
  table.begin(kHeader);
  std::vector<NodalRow> rows;
  double cell[7];
  while (table.next(cell)) {
    const size_t line = table.line();
    if (cell[0] < 0 || cell[0] != std::floor(cell[0]) || cell[0] >= double(point_of.size()))
      fail(DFM_E_ARG, "%s:%zu: there is no node %g; the mesh file has the nodes 0 to %zu", path.c_str(), line,
           cell[0], point_of.size() - 1);
    NodalRow row = {point_of[size_t(cell[0])], 0, {cell[4], cell[5], cell[6]}};
    for (int k = 0; k < 3; ++k) {
      if (cell[1 + k] != 0 && cell[1 + k] != 1)
        fail(DFM_E_ARG, "%s:%zu: fix%c is 0 or 1, found %g", path.c_str(), line, "xyz"[k], cell[1 + k]);
      if (cell[1 + k] == 1) row.axes = uint8_t(row.axes | (1u << k));
    }
    if (row.point == UINT32_MAX) {
      // A node without cells has no phyxel: holding it has no effect, and a force on it would be lost.
      if (cell[4] != 0 || cell[5] != 0 || cell[6] != 0)
        fail(DFM_E_ARG, "%s:%zu: node %g belongs to no tetrahedron, so no force can act on it", path.c_str(),
             line, cell[0]);
      continue;
    }
    rows.push_back(row);
  }
  return rows;
}

}  // namespace dfm::scene
