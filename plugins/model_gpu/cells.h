// Linear tetrahedra whose strain is measured in a frame of their own: what org.deform.corotational_fem_gpu
// moves points by. Equations: doc/models/corotational_fem.md, doc/models/corotational_fem_gpu.md.
#pragma once
#include "../model_common/tetrahedron.h"
#include "corners.h"
#include "parts.h"

namespace gpu {

class Cells : public Parts {
 public:
  static constexpr const char *kId = "org.deform.corotational_fem_gpu";
  enum Param : uint32_t { kYoung, kDampingStiffness, kDampingMass, kDevice, kPoisson, kParamCount };
  static constexpr uint32_t kValueCount = kParamCount;
  struct Rows { dfm_param of[kParamCount]; };
  static const Rows kRows;
  static bool valid(const dfm_host *h, const double *values) {
    return model::in_range(h, kId, kRows.of, kParamCount, values);
  }
  static constexpr dfm_fact kCount = {"cells", "tetrahedra, each read once in a sub-step", "1", 0};

  void create(const dfm_host *h, const dfm_mesh &m);
  void fill(const double *params);
  // Adds what the present shape asks of the rows of the bound.
  void add_growth(const dfm_kin &k, double *ksum, double *csum);
  Work work() const;
  uint32_t count() const { return ncell_; }
  uint32_t energies() const { return ncell_; }
  double energy(const dfm_kin &k, uint32_t begin, uint32_t end) const;
  const char *idle(Param) const { return nullptr; }
  const char *active_effects[4] = {};  // NULL-terminated

 private:
  struct Rest {
    model::Tetrahedron shape;
    double mu2, lambda;
  };  // mu2, lambda times the volume, N m
  uint32_t ncell_ = 0;
  Buffer<uint32_t> cells_;  // [ncell,4]
  Buffer<Rest> rest_;
  Buffer<double> field_[kParamCount];
  Corners corners_;
  Buffer<dvec4> shapes_;       // gradients of corners 1 to 3, mu2, lambda
  Buffer<float> twist_share_;  // [ncell,4] row of a corner per stiffness against turning

  double of(Param which, const double *params, uint32_t c) const {
    return field_[which].empty() ? params[which] : field_[which][c];
  }
  void strain(const dfm_kin &k, size_t c, double (&f)[9], double (&r)[9], double (&e)[6]) const;
  void find_rows();
};

}  // namespace gpu
