// Linear tetrahedra whose strain is measured in a frame of their own: what org.deform.corotational_fem_gpu
// moves points by. Equations: doc/models/corotational_fem.md, doc/models/corotational_fem_gpu.md.
#pragma once
#include "../model_common/tetrahedron.h"
#include "parts.h"

namespace gpu {

class Cells : public Parts {
 public:
  static constexpr const char *kId = "org.deform.corotational_fem_gpu";
  static constexpr uint32_t kParams = kParamCount;
  static constexpr const char *kLongest =
      "sub-step that is stable near rest; where cells are drawn far, shorter";
  static constexpr double kShare = 0.9;  // of a sub-step that is stable: shapes change on the way
  static constexpr dfm_fact kCount = {"cells", "tetrahedra, each read once in a sub-step", "1", 0};

  void create(const dfm_host *h, const dfm_mesh &m);
  void fill(const double *params);
  void bound(const dfm_kin &k, double *ksum, double *csum);
  Work work() const;
  uint32_t count() const { return ncell_; }
  double energy(const dfm_kin &k, uint32_t begin, uint32_t end) const;

 private:
  struct Rest {
    model::Tetrahedron shape;
    double mu2, lambda;
  };  // mu2, lambda times the volume, N m
  uint32_t ncell_ = 0;
  size_t room_ = 0, entries_ = 0;  // for the forces of corners; of corners_ and shapes_
  Buffer<uint32_t> cells_;         // [ncell,4]
  Buffer<Rest> rest_;
  Buffer<double> field_[gpu::kParamCount];
  Buffer<uvec2> places_;        // [npoint] of a point's corners: the first, how many
  Buffer<uvec4> corners_;       // points, places of their forces, twist_share as float; 32 cells side by side
  Buffer<dvec4> shapes_;        // gradients of corners 1 to 3, mu2, lambda
  Buffer<float> twist_share_;   // [ncell,4] row of a corner per stiffness against turning
  Buffer<double> row_by_mass_;  // [npoint] 1/s2
  Buffer<double> twist_, damper_;  // [ncell] of bound()

  double of(Param which, const double *params, uint32_t c) const {
    return field_[which].empty() ? params[which] : field_[which][c];
  }
  void strain(const dfm_kin &k, size_t c, double (&f)[9], double (&r)[9], double (&e)[6]) const;
  void find_rows();
};

}  // namespace gpu
