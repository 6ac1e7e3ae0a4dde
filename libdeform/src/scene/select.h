// Which points of a mesh a selection means, and how a total force is shared among them.
#pragma once
#include <string>
#include <vector>

#include "scene/defs.h"

namespace dfm::scene {

// A mesh file read once, with the scale of one body.
struct BodyMesh {
  std::vector<double> points;  // [n,3] rest, scaled
  const uint32_t *tets = nullptr, *file_point = nullptr;
  dfm_tetmesh handle = 0;      // lends the arrays and the points of its groups
  const char *const *group_names = nullptr;
  uint32_t npoint = 0, ntet = 0, ngroup = 0;
  double lo[3] = {}, hi[3] = {}, size = 0;  // of the scaled points; size: diagonal
};

std::vector<uint32_t> select(const Selection &where, const BodyMesh &mesh, const std::string &file);
// Weights that sum to 1, one per selected point. triangles: boundary, point numbers.
std::vector<double> share_by_mass(const std::vector<uint32_t> &points, const BodyMesh &mesh);
// By boundary area: a third of each triangle whose three corners are selected. Empty if there is no such triangle.
std::vector<double> share_by_area(const std::vector<uint32_t> &points, const BodyMesh &mesh, const std::vector<uint32_t> &triangles);
std::vector<double> share(const Force &force, const std::vector<uint32_t> &points, const BodyMesh &mesh,
                          const std::vector<uint32_t> &triangles, const std::string &file);

// Cell that holds a point (or the nearest one) and the point's barycentric coordinates there; returns the distance to the cell.
double locate(const BodyMesh &mesh, const double point[3], uint32_t corners[4], double weights[4]);

// Held components and forces by the file's node numbers.
struct NodalRow { uint32_t point; uint8_t axes; double force[3]; };
std::vector<NodalRow> read_nodal(const std::string &path, const BodyMesh &mesh);

}  // namespace dfm::scene
