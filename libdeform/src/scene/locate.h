// Finds the cell that contains a point, for probes and for surface points coupled to cells.
#pragma once
#include "geometry/rest_tree.h"

namespace dfm::scene {

struct BodyMesh;

double volume6(const double *const corner[4]);  // six times that of a cell, with sign

class Locator {
 public:
  explicit Locator(const BodyMesh &mesh);  // borrows the mesh
  // Cell that holds the point, or the nearest one (of equals the first), and the point's barycentric
  // coordinates there, which then lie outside [0,1]; returns the distance to the cell.
  double find(const double point[3], uint32_t corners[4], double weights[4]) const;

 private:
  const BodyMesh &mesh_;
  RestTree tree_;
};

}  // namespace dfm::scene
