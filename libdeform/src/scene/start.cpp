#include "scene/start.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "scene/jitter.h"
#include "scene/rotation.h"
#include "scene/table.h"

namespace dfm::scene {

std::vector<double> start_positions(const Start &start, const BodyMesh &mesh, const dfm_pose &pose) {
  std::vector<double> x(mesh.points);
  Jitter random(start.seed);
  const Quat turn = load_quat(pose.rotation);
  for (size_t i = 0; i < x.size(); i += 3) {
    for (size_t k = 0; k < 3; ++k) {
      const double center = (mesh.lo[k] + mesh.hi[k]) / 2, half = (mesh.hi[k] - mesh.lo[k]) / 2;
      switch (start.kind) {
        case StartKind::scramble: x[i + k] = center + half * random.symmetric(); break;
        // the plane keeps x and y, the line x alone
        case StartKind::plane:
          if (k > 1) x[i + k] = center;
          break;
        case StartKind::line:
          if (k > 0) x[i + k] = center;
          break;
        case StartKind::point: x[i + k] = center; break;
        case StartKind::invert: x[i + k] = 2 * center - x[i + k]; break;
        case StartKind::rest:
        case StartKind::state: break;
      }
    }
    double turned[3];
    rotate(turn, &x[i], turned);
    for (size_t k = 0; k < 3; ++k) x[i + k] = turned[k] + pose.position[k];
  }
  return x;
}

StartState read_start_state(const std::string &path, const BodyMesh &mesh) {
  const std::vector<uint32_t> point_of = points_of_nodes(mesh);
  Table table(path, kStateHeader, point_of.size(), 7);
  if (!table.empty() && table.first() != kStateHeader) table.refuse_header();
  table.begin(kStateHeader);
  StartState out;
  out.x.resize(3 * size_t(mesh.npoint));
  out.v.resize(out.x.size());
  std::vector<uint8_t> seen(mesh.npoint, 0);
  double cell[7];
  while (table.next(cell)) {
    const size_t line = table.line();
    if (cell[0] < 0 || cell[0] != std::floor(cell[0]) || cell[0] >= double(point_of.size()) ||
        point_of[size_t(cell[0])] == UINT32_MAX)
      fail(DFM_E_ARG, "%s:%zu: no tetrahedron of the mesh file has a node %g", path.c_str(), line, cell[0]);
    const size_t point = point_of[size_t(cell[0])];
    if (seen[point]) fail(DFM_E_ARG, "%s:%zu: node %g has a row already", path.c_str(), line, cell[0]);
    seen[point] = 1;
    std::copy_n(cell + 1, 3, &out.x[3 * point]);
    std::copy_n(cell + 4, 3, &out.v[3 * point]);
  }
  const auto missing = std::find(seen.begin(), seen.end(), uint8_t(0));
  if (missing != seen.end())
    fail(DFM_E_FORMAT, "%s: node %u of the mesh file has no row", path.c_str(),
         mesh.file_point[size_t(missing - seen.begin())]);
  return out;
}

}  // namespace dfm::scene
