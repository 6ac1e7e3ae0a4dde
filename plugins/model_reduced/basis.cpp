#include "basis.h"

#include <algorithm>

namespace reduced {

void Basis::create(const dfm_host *host, const Kernels *kernels, size_t size, uint32_t nmode) {
  kernels_ = kernels;
  pieces_ = padded(size) / kPiece;
  nmode_ = nmode;
  data_.create(host, pieces_ * kPiece * nmode);
  sums_.create(host, kMaxAtOnce * kLanes * nmode);
}

void Basis::set(uint32_t mode, const double *w) {
  for (size_t p = 0; p < pieces_; ++p)
    std::copy(w + p * kPiece, w + (p + 1) * kPiece, data_.data() + (p * nmode_ + mode) * kPiece);
}

void Basis::project(uint32_t n, const double *const *in, double *const *out) const {
  std::fill(sums_.data(), sums_.data() + n * kLanes * nmode_, 0.0);
  kernels_->project(data_.data(), pieces_, nmode_, n, in, sums_.data());
  for (uint32_t v = 0; v < n; ++v)
    for (size_t k = 0; k < nmode_; ++k) {
      const double *const s = sums_.data() + (v * nmode_ + k) * kLanes;
      out[v][k] = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    }
}

void Basis::expand(uint32_t n, const double *const *in, double *const *out) const {
  kernels_->expand(data_.data(), pieces_, nmode_, n, in, out);
}

}  // namespace reduced
