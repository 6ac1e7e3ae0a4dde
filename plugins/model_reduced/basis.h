// Displacements of a body as sums of few: [size] numbers times modes, in pieces of kPiece numbers so that one
// pass over memory serves several right-hand sides, in an order of sums that no compiler changes.
#pragma once
#include <cstddef>
#include <cstdint>

#include "../model_common/buffer.h"
#include "reduced_kernel.h"

namespace reduced {

using model::Buffer;

class Basis {
 public:
  static constexpr uint32_t kMaxAtOnce = 3;
  static size_t padded(size_t size) { return (size + kPiece - 1) / kPiece * kPiece; }

  void create(const dfm_host *host, const Kernels *kernels, size_t size, uint32_t nmode);
  void set(uint32_t mode, const double *w);  // [size]
  double at(size_t row, uint32_t mode) const {
    return data_[(row / kPiece * nmode_ + mode) * kPiece + row % kPiece];
  }
  // out[v][k] = sum_i W_ik in[v][i]; in [padded(size)], zero behind size
  void project(uint32_t n, const double *const *in, double *const *out) const;
  // out[v][i] = sum_k W_ik in[v][k], n 1 or 2; out [padded(size)]
  void expand(uint32_t n, const double *const *in, double *const *out) const;

 private:
  const Kernels *kernels_ = nullptr;
  size_t pieces_ = 0;
  uint32_t nmode_ = 0;
  Buffer<double> data_;
  mutable Buffer<double> sums_;  // [kMaxAtOnce, nmode, kLanes]
};

}  // namespace reduced
