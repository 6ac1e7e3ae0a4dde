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
  uint32_t highest = 0;
  for (uint32_t i = 0; i < mesh.npoint; ++i) highest = std::max(highest, mesh.file_point[i]);
  Table table(path, kHeader, highest + uint64_t(1), 7);
  std::vector<uint32_t> point_of(size_t(highest) + 1, UINT32_MAX);
  for (uint32_t i = 0; i < mesh.npoint; ++i) point_of[mesh.file_point[i]] = i;
  std::vector<NodalRow> rows;
  std::string_view text;
  size_t line = 1;
  for (; table.next(text); ++line) {
    const std::string_view trimmed = trim(text);
    if (line == 1) {
      if (trimmed != kHeader) fail(DFM_E_FORMAT, "%s:1: expected the header %s", path.c_str(), kHeader);
      continue;
    }
    if (trimmed.empty()) continue;
    double cell[7];
    split_row(path, line, trimmed, kHeader, 7, cell);
    if (cell[0] < 0 || cell[0] != std::floor(cell[0]) || cell[0] > highest)
      fail(DFM_E_ARG, "%s:%zu: there is no node %g; the mesh file has the nodes 0 to %u", path.c_str(), line,
           cell[0], highest);
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
  if (line == 1)
    fail(DFM_E_FORMAT, "%s: nothing to read; expected the header %s and a row for each node", path.c_str(),
         kHeader);
  return rows;
}

}  // namespace dfm::scene
