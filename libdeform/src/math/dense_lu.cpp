#include "math/dense_lu.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

constexpr size_t kPivots = 6;  // that a pass over the rest takes: those of a rigid body
using Two = double __attribute__((vector_size(16)));
using Loose = double __attribute__((vector_size(16), aligned(8), may_alias));

// Columns of a row less multiples of the pivots' rows.
void subtract(const double *factor, const double *const *row, size_t count, size_t at, double *to) {
  Two sum[kLuColumns / 2];
  for (size_t c = 0; c < kLuColumns / 2; ++c) sum[c] = *reinterpret_cast<const Loose *>(to + 2 * c);
  for (size_t k = 0; k < count; ++k) {
    const Two f = {factor[k], factor[k]};
    for (size_t c = 0; c < kLuColumns / 2; ++c)
      sum[c] -= f * *reinterpret_cast<const Loose *>(row[k] + at + 2 * c);
  }
  for (size_t c = 0; c < kLuColumns / 2; ++c) *reinterpret_cast<Loose *>(to + 2 * c) = sum[c];
}

// Pivots of the columns [begin, end), whose factors take the place of what they eliminate.
bool take_pivots(size_t n, size_t begin, size_t end, double *a, double *x) {
  const size_t row = lu_row(n);
  for (size_t k = begin; k < end; ++k) {
    size_t best = k;
    for (size_t i = k + 1; i < n; ++i)
      if (std::fabs(a[i * row + k]) > std::fabs(a[best * row + k])) best = i;
    if (!(std::fabs(a[best * row + k]) > 0)) return false;
    if (best != k) {
      std::swap_ranges(a + k * row + begin, a + (k + 1) * row, a + best * row + begin);
      std::swap(x[k], x[best]);
    }
    for (size_t i = k + 1; i < n; ++i) {
      double *const to = a + i * row;
      if (to[k] == 0) continue;
      const double f = to[k] /= a[k * row + k];
      for (size_t j = k + 1; j < end; ++j) to[j] -= f * a[k * row + j];
      x[i] -= f * x[k];
    }
  }
  return true;
}

}  // namespace

bool solve_lu(size_t n, double *a, double *x, std::vector<size_t> &live) {
  const size_t row = lu_row(n);
  for (size_t begin = 0; begin < n; begin += kPivots) {
    const size_t end = std::min(n, begin + kPivots);
    if (!take_pivots(n, begin, end, a, x)) return false;
    for (size_t i = begin + 1; i < end; ++i)
      for (size_t k = begin; k < i; ++k) {
        const double f = a[i * row + k];
        if (f == 0) continue;
        for (size_t j = end; j < row; ++j) a[i * row + j] -= f * a[k * row + j];
      }
    // the rest, where the pivots' rows have anything
    const size_t aligned = std::min(row, lu_row(end));
    live.clear();
    for (size_t j = aligned; j < row; j += kLuColumns) {
      bool any = false;
      for (size_t k = begin; k < end; ++k)
        for (size_t c = 0; c < kLuColumns; ++c) any |= a[k * row + j + c] != 0;
      if (any) live.push_back(j);
    }
    for (size_t i = end; i < n; ++i) {
      double factor[kPivots];
      const double *from[kPivots];
      size_t count = 0;
      for (size_t k = begin; k < end; ++k)
        if (a[i * row + k] != 0) {
          factor[count] = a[i * row + k];
          from[count++] = a + k * row;
        }
      if (count == 0) continue;
      for (size_t k = 0; k < count; ++k)
        for (size_t j = end; j < aligned; ++j) a[i * row + j] -= factor[k] * from[k][j];
      for (const size_t j : live) subtract(factor, from, count, j, a + i * row + j);
    }
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t j = k + 1; j < n; ++j) x[k] -= a[k * row + j] * x[j];
    x[k] /= a[k * row + k];
  }
  return true;
}

}  // namespace dfm
