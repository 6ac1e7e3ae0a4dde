// Elasticity of a homogeneous body from its closed surface: boundary integral equations of first and second
// kind by Galerkin's method (Sirtori 1979; Steinbach 2008, Numerical Approximation Methods for Elliptic
// Boundary Value Problems, 6.7 and 12.3). Displacements are linear on the triangles, tractions constant, so a
// uniform stress on a body with flat faces and sharp edges is represented exactly.
#pragma once
#include <deform/plugin.h>

#include <vector>

#include "../model_common/buffer.h"
#include "tiles.h"

namespace reduced {

using model::Buffer;

class Boundary {
 public:
  std::vector<uint32_t> point;  // of the surface, rising
  std::vector<uint32_t> inner;  // all others, rising: they follow the surface
  std::vector<uint32_t> edges;  // [.,2] all pairs of points of the surface, i < j, lexicographic

  // The triangles around the cells. Throws model::Refused where they are too many, or around separate pieces.
  void find(const dfm_host *host, const char *id, const dfm_mesh &m);
  // block [npoint + pairs, 9]: the stiffness. rest [npoint,3].
  void assemble(const char *id, const Kernels &kernels, const double *rest, double young, double poisson,
                double *block);

  // Factorizes the stiffness without these components of all points, which are to be zero in solve.
  void factorize(const Kernels &kernels, const double *block, const std::vector<uint8_t> &out);

  // kWide vectors side by side, [3 npoint,kWide]: forces of inner points go to the surface; displacements of
  // the surface by forces at it; they lead the inner points.
  template <size_t kWide>
  void gather(double *f) const;
  template <size_t kWide>
  void solve(double *u) const;
  template <size_t kWide>
  void spread(double *u) const;

 private:
  struct Triangle;
  const dfm_host *host_ = nullptr;
  // Errors of the quadrature, before the projections: the norm of forces under rigid motions, over that of
  // the stiffness; the difference of an integral over two triangles and the one in the other order, over the
  // largest integral.
  double rigid_error_ = 0, asymmetry_ = 0;
  size_t ntriangle() const { return triangles_.size() / 3; }
  std::vector<uint32_t> triangles_;  // [.,3] counter-clockwise from outside, places in `point`
  // In the order of clusters: places in `point` and `inner`, and back; numbers of components.
  std::vector<uint32_t> point_at_, order_, inner_at_, inner_order_;
  std::vector<size_t> clusters_;
  Tiles follow_;  // [3 inner, 3 surface], negative
  Tiles factor_;
  Buffer<double> rigid_,
      missing_;                    // [.,6] rigid motions at the surface; of inner points, what follow_ misses
  mutable Buffer<double> packed_;  // [3 surface, kLanes]; behind it [3 inner, kLanes]
  template <size_t kWide>
  void pack(const double *u) const;
  void add_pairs(const std::vector<Triangle> &t, double young, double poisson, Tiles &single, Tiles &both,
                 double *block);
  void add_inner(const char *id, const std::vector<Triangle> &t, const double *rest, double young,
                 double poisson, Tiles &both);
  void add_stiffness(size_t row, size_t column, const Table &f, double *block);
  size_t pair(size_t i, size_t j) const { return i * (2 * point.size() - i - 1) / 2 + (j - i - 1); }
  const double *block_at(const double *block, size_t i, size_t j) const;
  double *block_at(double *block, size_t i, size_t j) const {
    return const_cast<double *>(block_at(const_cast<const double *>(block), i, j));
  }
  void make_rigid_exact(const double *rest, double *block);
};

}  // namespace reduced
