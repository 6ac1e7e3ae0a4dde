// Which points of a mesh a selection means, and how a total force is shared among them.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "scene/defs.h"
#include "mesh/cell_finder.h"

namespace dfm {
struct Coupling;
}

namespace dfm::scene {

// A surface that was given as such: that of a filled body, or one of its own over cells.
struct Skin {
  std::vector<double> points;  // [n,3] rest, scaled
  const uint32_t *triangles = nullptr, *triangle_group = nullptr;
  const char *const *group_names = nullptr;
  uint32_t npoint = 0, ntriangle = 0, ngroup = 0;
};

// A mesh file read once, with the scale of one body.
struct BodyMesh {
  std::vector<double> points;  // [n,3] rest, scaled
  dfm_mesh_info info{};        // the rest of it, not scaled
  bool filled = false;         // the cells are ours, the file's shape is the skin
  bool renumbered = false;     // points are not those of the file
  bool wears_skin = false;     // the skin is the body's surface; else that is the boundary of the cells
  Skin skin;                   // npoint 0: none
  // [ntet] mass per volume of each cell relative to the others; empty: the same
  std::vector<double> cell_weight;
  double lo[3] = {}, hi[3] = {}, size = 0;                // of the scaled points; size: diagonal
  mutable std::shared_ptr<const CellFinder> cells_found;  // made at first use, as the next one
  mutable std::shared_ptr<const Coupling> rows;           // of the skin

  const CellFinder &finder() const;
  double share_of(uint32_t tet) const;  // of its volume, that is material
};

// The point of each node of the mesh file; UINT32_MAX: none.
std::vector<uint32_t> points_of_nodes(const BodyMesh &mesh);

// Points to hold: by physical group of the cells or of the skin (then the corners of the cells that hold its
// points), or those in a box. On a filled body the box takes the skin's points in it too, by the corners of
// their cells: what is held then includes the given surface.
std::vector<uint32_t> select(const Selection &where, const BodyMesh &mesh, const std::string &file);

// Surfels of a body that wears its skin: the skin's points in a box, or the corners of a group's triangles.
std::vector<uint32_t> select_skin(const Selection &where, const BodyMesh &mesh, const std::string &file);

// Weights that sum to 1, one per selected point. triangles: boundary, point numbers.
std::vector<double> share_by_mass(const std::vector<uint32_t> &points, const BodyMesh &mesh);
// By boundary area: a third of each triangle whose three corners are selected. Empty if there is no
// such triangle.
std::vector<double> share_by_area(const std::vector<uint32_t> &points, const BodyMesh &mesh,
                                  const std::vector<uint32_t> &triangles);

// Which points carry a force, and how much of it each.
struct Shared {
  std::vector<uint32_t> points;
  std::vector<double> weights;
};
// By area of the skin: a third of each triangle to each of its points, from there to the corners of its cell
// by its barycentric weights, so that force and torque are those of the traction.
Shared share_on_skin(const std::vector<uint32_t> &triangles, const BodyMesh &mesh);
Shared share(const Force &force, const BodyMesh &mesh, const std::string &file);

std::string span_of(const BodyMesh &mesh);  // for errors

}  // namespace dfm::scene
