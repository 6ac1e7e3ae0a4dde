// Elasticity of a homogeneous body from its closed surface: boundary integral equations of first and second
// kind by Galerkin's method (Sirtori 1979; Steinbach 2008, Numerical Approximation Methods for Elliptic
// Boundary Value Problems, 6.7 and 12.3). Displacements are linear on the triangles, tractions constant, so a
// uniform stress on a body with flat faces and sharp edges is represented exactly.
#pragma once
#include <deform/plugin.h>

#include <vector>

#include "../model_common/buffer.h"
#include "reduced_kernel.h"

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

  // kWide vectors side by side, [3 npoint,kWide]: forces of inner points go to the surface; displacements of
  // the surface lead the inner points.
  template <size_t kWide>
  void gather(double *f) const;
  template <size_t kWide>
  void spread(const Kernels &kernels, double *u) const;

 private:
  struct Triangle;
  const dfm_host *host_ = nullptr;
  // Of the quadrature, before the projections: the norm of forces under rigid motions, over that of the
  // stiffness; the difference of an integral over two triangles and the one in the other order, over the
  // largest integral.
  double rigid_error_ = 0, asymmetry_ = 0;
  size_t ntriangle() const { return triangles_.size() / 3; }
  std::vector<uint32_t> triangles_;  // [.,3] counter-clockwise from outside, places in `point`
  Buffer<double> follow_;            // [3 inner, padded 3 surface]
  mutable Buffer<double> packed_;    // [padded 3 surface, kLanes]; behind it [3 inner, kLanes]
  size_t padded() const { return (3 * point.size() + kLanes - 1) / kLanes * kLanes; }
  void add_pairs(const std::vector<Triangle> &t, double young, double poisson, std::vector<double> &single,
                 std::vector<double> &both, double *block);
  size_t pair(size_t i, size_t j) const { return i * (2 * point.size() - i - 1) / 2 + (j - i - 1); }
  double *block_at(double *block, size_t i, size_t j) const;
  void lead_inner(const char *id, const Kernels &kernels, const std::vector<Triangle> &t, const double *rest,
                  double young, double poisson, const std::vector<double> &traction);
  void make_rigid_exact(const double *rest, double *block);
};

}  // namespace reduced
