// Springs of a mesh: what org.deform.msm_gpu moves points by. Equations: doc/models/msm_gpu.md.
#pragma once
#include "parts.h"

namespace gpu {

class Springs : public Parts {
 public:
  static constexpr const char *kId = "org.deform.msm_gpu";
  static constexpr uint32_t kParams = kPoisson;  // those before it
  static constexpr const char *kLongest = "sub-step that is stable in every shape";
  static constexpr double kShare = 1;  // of a sub-step that is stable
  static constexpr dfm_fact kCount = {"springs", "springs, each read from both ends in a sub-step", "1", 0};

  void create(const dfm_host *h, const dfm_mesh &m);
  void fill(const double *params);
  void bound(const dfm_kin &k, double *ksum, double *csum);
  Work work() const;
  uint32_t count() const { return nspring_; }
  double energy(const dfm_kin &k, uint32_t begin, uint32_t end) const;

  // Of points and edges [n,2] alone, and their stiffness (N/m) and square of the rest length (m2).
  void lay_out(const dfm_host *h, uint32_t points, uint32_t n, const uint32_t *edges);
  void put(const double *stiffness, const double *rest_square);

 private:
  uint32_t nspring_ = 0;
  size_t room_ = 0;           // for both ends of each
  Buffer<uvec2> places_;      // [npoint] of a point's springs: the first, how many
  Buffer<uvec4> ends_;        // [room] other end, stiffness, square of the rest length
  Buffer<uint32_t> edge_of_;  // [room] whose spring it is
  Buffer<uint32_t> edges_;
  Buffer<double> share_;      // [nspring] m2 stiffness over Young's modulus, or N/m where that came by cell
  Buffer<double> stiffness_;  // [nspring] N/m
  Buffer<double> rest_square_;
  bool by_cell_ = false;

  void find_rows();
};

}  // namespace gpu
