#include <algorithm>
#include <new>

#include "sparse.h"

namespace reduced {

Factor::~Factor() {
  if (self_) direct_->solver->release(self_);
}

bool Factor::use_host_solver(const dfm_host *host, const std::vector<uint32_t> &ij,
                             const std::vector<double> &blk, const double *places) {
  if (!host->extension) return false;
  const auto *const offered = static_cast<const dfm_direct *>(host->extension(host->ctx, DFM_HOST_DIRECT));
  if (!offered || offered->size < sizeof(dfm_direct)) return false;
  direct_ = offered;
  if (direct_->analyse(host, n_, uint32_t(ij.size() / 2), ij.data(), places, &self_) != DFM_OK) {
    self_ = nullptr;
    throw std::bad_alloc();
  }
  const dfm_status status = direct_->solver->factor(self_, blk.data());
  if (status == DFM_DISCARD) throw kIndefinite;
  if (status != DFM_OK) throw std::bad_alloc();
  wide_.create(host, 2 * kLanes * 3 * size_t(n_));
  return true;
}

// The first [nrhs,n,3] of wide_, whose results are stored behind the room for kLanes of them.
void Factor::solve_by_host(uint32_t nrhs) const {
  double *const b = wide_.data();
  const dfm_status status = direct_->solver->solve(self_, nrhs, b, b + kLanes * 3 * size_t(n_), 0);
  if (status == DFM_E_NOMEM) throw std::bad_alloc();
  if (status != DFM_OK) throw "the host's solver failed";
}

void Factor::inverse_at(const Kernels &kernels, uint32_t nsel, const uint32_t *sel, double *w) const {
  if (self_) {
    if (direct_->inverse_at(self_, nsel, sel, w) != DFM_OK) throw std::bad_alloc();
    return;
  }
  responses_at(n_, nsel, sel, w, [&](double *eight) { solve_eight(kernels, eight, eight); });
}

void Factor::solve(const double *b, double *x) const {
  const size_t size = 3 * size_t(n_);
  if (self_) {
    std::copy(b, b + size, wide_.data());
    solve_by_host(1);
    std::copy(wide_.data() + kLanes * size, wide_.data() + (kLanes + 1) * size, x);
    return;
  }
  double *const y = ordered_.data();
  for (size_t i = 0; i < n_; ++i)
    for (size_t k = 0; k < 3; ++k) y[3 * size_t(place_[i]) + k] = b[3 * i + k];
  for (size_t j = 0; j < n_; ++j) {
    const uint32_t first = begin_[j];
    const double *const d = block_.data() + 9 * size_t(first);
    double *const own = y + 3 * j;
    own[0] /= d[0];
    own[1] = (own[1] - d[3] * own[0]) / d[4];
    own[2] = ((own[2] - d[6] * own[0]) - d[7] * own[1]) / d[8];
    const double y0 = own[0], y1 = own[1], y2 = own[2];
    for (uint32_t s = first + 1; s < begin_[j + 1]; ++s) {
      const double *const l = block_.data() + 9 * size_t(s);
      double *const to = y + 3 * size_t(row_[s]);
      to[0] -= (l[0] * y0 + l[1] * y1) + l[2] * y2;
      to[1] -= (l[3] * y0 + l[4] * y1) + l[5] * y2;
      to[2] -= (l[6] * y0 + l[7] * y1) + l[8] * y2;
    }
  }
  for (size_t j = n_; j-- > 0;) {
    const uint32_t first = begin_[j];
    double *const own = y + 3 * j;
    double y0 = own[0], y1 = own[1], y2 = own[2];
    for (uint32_t s = first + 1; s < begin_[j + 1]; ++s) {
      const double *const l = block_.data() + 9 * size_t(s);
      const double *const from = y + 3 * size_t(row_[s]);
      y0 -= (l[0] * from[0] + l[3] * from[1]) + l[6] * from[2];
      y1 -= (l[1] * from[0] + l[4] * from[1]) + l[7] * from[2];
      y2 -= (l[2] * from[0] + l[5] * from[1]) + l[8] * from[2];
    }
    const double *const d = block_.data() + 9 * size_t(first);
    own[2] = y2 / d[8];
    own[1] = (y1 - d[7] * own[2]) / d[4];
    own[0] = ((y0 - d[3] * own[1]) - d[6] * own[2]) / d[0];
  }
  for (size_t i = 0; i < n_; ++i)
    for (size_t k = 0; k < 3; ++k) x[3 * i + k] = y[3 * size_t(place_[i]) + k];
}

// Numbers of one entry lie side by side.
void Factor::solve_eight(const Kernels &kernels, const double *b, double *x) const {
  constexpr size_t kPoint = 3 * kLanes;
  if (self_) {
    const size_t size = 3 * size_t(n_);
    double *const side = wide_.data();
    for (size_t j = 0; j < size; ++j)
      for (size_t l = 0; l < kLanes; ++l) side[l * size + j] = b[kLanes * j + l];
    solve_by_host(kLanes);
    for (size_t j = 0; j < size; ++j)
      for (size_t l = 0; l < kLanes; ++l) x[kLanes * j + l] = side[(kLanes + l) * size + j];
    return;
  }
  double *const y = ordered_.data();
  for (size_t i = 0; i < n_; ++i) std::copy(b + kPoint * i, b + kPoint * (i + 1), y + kPoint * place_[i]);
  kernels.solve({n_, begin_.data(), row_.data(), block_.data()}, y);
  for (size_t i = 0; i < n_; ++i)
    std::copy(y + kPoint * place_[i], y + kPoint * (size_t(place_[i]) + 1), x + kPoint * i);
}

}  // namespace reduced
