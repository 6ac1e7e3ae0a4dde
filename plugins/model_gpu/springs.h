// Springs of a mesh, and the volume terms of its cells: what org.deform.msm_gpu moves points by. Equations:
// doc/models/msm.md, doc/models/msm_gpu.md.
#pragma once
#include "../model_common/mass_spring.h"
#include "corners.h"
#include "parts.h"

namespace gpu {

class Springs : public Parts, public msm::Material {
 public:
  static constexpr const char *kId = "org.deform.msm_gpu";
  static constexpr dfm_fact kCount = {"springs", "springs, each read from both ends in a sub-step", "1", 0};
  // The rows of org.deform.msm, and the device.
  enum Param : uint32_t { kParamCount = msm::kParamCount + 1 };
  static constexpr uint32_t kDevice = msm::kValueCount, kValueCount = kDevice + 1;  // of the values
  struct Rows {
    dfm_param of[kParamCount];
    constexpr Rows() : of() {
      for (uint32_t r = 0; r < msm::kParamCount; ++r) of[r] = msm::kParams[r];
      of[msm::kParamCount] = kDeviceRow;
    }
  };
  static const Rows kRows;
  static bool valid(const dfm_host *h, const double *values);

  void create(const dfm_host *h, const dfm_mesh &m);
  void fill(const double *values);
  void put_stiffness();  // of springs that are on, and of their cells
  // Adds what the present shape asks of the rows of the bound.
  void add_growth(const dfm_kin &k, double *ksum, double *csum);
  Work work() const;
  uint32_t count() const { return nspring_; }
  // Energies of springs, then of cells.
  uint32_t energies() const { return nspring_ + (cells_on ? ncell : 0); }
  double energy(const dfm_kin &k, uint32_t begin, uint32_t end) const;
  const char *idle(Param which) const { return Material::idle(msm::Param(which)); }

  // Lays out points and edges [n,2] alone, and their stiffness (N/m) and square of the rest length (m2).
  void lay_out(const dfm_host *h, uint32_t points, uint32_t n, const uint32_t *springs);
  void put(const double *stiffness, const double *rest_square);

 private:
  uint32_t nspring_ = 0;
  size_t room_ = 0;                    // for both ends of each
  Buffer<uvec2> places_;               // [npoint] of a point's springs: the first, how many
  Buffer<uvec4> ends_;                 // [room] other end, stiffness, square of the rest length
  Buffer<uvec2> options_;              // [room] w^2, share of `damping`, as floats
  Buffer<uint32_t> edge_of_, end_of_;  // [room] whose spring it is; [nspring] one of its ends
  Buffer<double> stiffness_;           // [nspring] N/m
  Buffer<double> rest_square_;
  Corners corners_;        // empty while cells have no term
  Buffer<dvec4> volumes_;  // [ncell] stiffness, that against collapse, 6 V0, limit

  Buffer<double> grown_;  // [npoint] of add_growth(), N/m

  void put_options();
  void put_cells();
  void find_rows();
};

}  // namespace gpu
