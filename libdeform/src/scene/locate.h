// Finds the cell that contains a point, for probes and for surface points coupled to cells, by the bins of a
// uniform grid.
#pragma once
#include <cstdint>
#include <vector>

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
  struct Best {
    double away;
    uint32_t cell;
    double weights[4];
  };
  int bin(double x, int axis) const;
  void look(int i, int j, int k, const double *point, Best &best) const;
  const BodyMesh &mesh_;
  int n_[3];
  double lo_[3], width_[3], least_width_;
  std::vector<uint32_t> begin_, cell_;  // cells of each bin, ascending
};

}  // namespace dfm::scene
