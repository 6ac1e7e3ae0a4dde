#include "math/block_matrix.h"

#include <algorithm>

#include "math/width.h"

namespace dfm {

void hold_components(const BlockPattern &pattern, const uint8_t *mask, double *blk) {
  for (uint32_t b = 0; b < pattern.nb; ++b) {
    const uint32_t i = pattern.ij[2 * size_t{b}], j = pattern.ij[2 * size_t{b} + 1];
    if (!((mask[i] | mask[j]) & 7)) continue;
    double *const a = blk + 9 * size_t{b};
    for (uint32_t r = 0; r < 3; ++r)
      for (uint32_t c = 0; c < 3; ++c)
        if ((mask[i] >> r & 1) || (mask[j] >> c & 1)) a[3 * r + c] = i == j && r == c ? 1.0 : 0.0;
  }
}

BlockMatrix::BlockMatrix(const Memory &memory) : kernels_(block_kernels()) {
  use_memory(memory, row_, column_, diagonal_, upper_, lower_);
  use_memory(memory, value_);
}

void BlockMatrix::set_pattern(const BlockPattern &pattern) {
  n_ = pattern.n;
  nb_ = pattern.nb;
  row_.assign(size_t{n_} + 1, 0);
  for (uint32_t b = 0; b < nb_; ++b) {
    const uint32_t i = pattern.ij[2 * size_t{b}], j = pattern.ij[2 * size_t{b} + 1];
    ++row_[i + 1];
    if (i != j) ++row_[j + 1];
  }
  for (uint32_t i = 0; i < n_; ++i) row_[i + 1] = row_[i] + (row_[i + 1] + 1) / 2 * 2;
  const uint32_t count = row_[n_];
  column_.assign(count, UINT32_MAX);
  // Collect the columns of every row, sort them, then look up the two places of each block of the pattern.
  diagonal_.assign(row_.begin(), row_.end() - 1);
  for (uint32_t b = 0; b < nb_; ++b) {
    const uint32_t i = pattern.ij[2 * size_t{b}], j = pattern.ij[2 * size_t{b} + 1];
    column_[diagonal_[i]++] = j;
    if (i != j) column_[diagonal_[j]++] = i;
  }
  const auto place = [&](uint32_t i, uint32_t j) {
    return uint32_t(std::lower_bound(column_.begin() + row_[i], column_.begin() + row_[i + 1], j) -
                    column_.begin());
  };
  for (uint32_t i = 0; i < n_; ++i) {
    std::sort(column_.begin() + row_[i], column_.begin() + row_[i + 1]);
    diagonal_[i] = place(i, i);
  }
  upper_.resize(nb_);
  lower_.resize(nb_);
  for (uint32_t b = 0; b < nb_; ++b) {
    const uint32_t i = pattern.ij[2 * size_t{b}], j = pattern.ij[2 * size_t{b} + 1];
    upper_[b] = place(i, j);
    lower_[b] = place(j, i);
  }
  for (uint32_t i = 0; i < n_; ++i)
    if (column_[row_[i + 1] - 1] == UINT32_MAX) column_[row_[i + 1] - 1] = i;
  value_.assign(9 * size_t{count} + 1, 0.0);  // one more: the load of the last column reads it
}

void BlockMatrix::set_values(Tasks *tasks, const double *blk) {
  each_on(n_ > kAlone ? tasks : nullptr, nb_, kGrain, [&](size_t b) {
    const double *const a = blk + 9 * b;
    double *const u = &value_[9 * size_t{upper_[b]}], *const l = &value_[9 * size_t{lower_[b]}];
    for (uint32_t r = 0; r < 3; ++r)
      for (uint32_t c = 0; c < 3; ++c) u[3 * c + r] = a[3 * r + c];
    if (l != u) std::copy(a, a + 9, l);
  });
}

}  // namespace dfm
