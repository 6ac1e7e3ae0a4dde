#include <algorithm>
#include <new>

#include "sparse.h"

namespace reduced {

Factor::~Factor() {
  if (self_) direct_->solver->release(self_);
}

void Factor::create(const dfm_host *host, uint32_t n, const std::vector<uint32_t> &ij,
                    const std::vector<double> &blk, const double *places) {
  n_ = n;
  if (host->extension) direct_ = static_cast<const dfm_direct *>(host->extension(host->ctx, DFM_HOST_DIRECT));
  if (!direct_ || direct_->size < sizeof(dfm_direct)) throw "the host has no solver \"" DFM_HOST_DIRECT "\"";
  if (direct_->analyse(host, n_, uint32_t(ij.size() / 2), ij.data(), places, &self_) != DFM_OK) {
    self_ = nullptr;
    throw std::bad_alloc();
  }
  const dfm_status status = direct_->solver->factor(self_, blk.data());
  if (status == DFM_DISCARD) throw kIndefinite;
  if (status != DFM_OK) throw std::bad_alloc();
  wide_.create(host, 2 * kLanes * 3 * size_t(n_));
}

// The first [nrhs,n,3] of wide_, whose results are stored behind the room for kLanes of them.
void Factor::solve_wide(uint32_t nrhs) const {
  double *const b = wide_.data();
  const dfm_status status = direct_->solver->solve(self_, nrhs, b, b + kLanes * 3 * size_t(n_), 0);
  if (status == DFM_E_NOMEM) throw std::bad_alloc();
  if (status != DFM_OK) throw "the host's solver failed";
}

void Factor::inverse_at(uint32_t nsel, const uint32_t *sel, double *w) const {
  if (direct_->inverse_at(self_, nsel, sel, w) != DFM_OK) throw std::bad_alloc();
}

void Factor::solve(const double *b, double *x) const {
  const size_t size = 3 * size_t(n_);
  std::copy(b, b + size, wide_.data());
  solve_wide(1);
  std::copy(wide_.data() + kLanes * size, wide_.data() + (kLanes + 1) * size, x);
}

void Factor::solve_eight(const double *b, double *x) const {
  const size_t size = 3 * size_t(n_);
  double *const side = wide_.data();
  for (size_t j = 0; j < size; ++j)
    for (size_t l = 0; l < kLanes; ++l) side[l * size + j] = b[kLanes * j + l];
  solve_wide(kLanes);
  for (size_t j = 0; j < size; ++j)
    for (size_t l = 0; l < kLanes; ++l) x[kLanes * j + l] = side[(kLanes + l) * size + j];
}

}  // namespace reduced
