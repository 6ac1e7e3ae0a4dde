// Elimination with pivots for dense systems that are small, or mostly zero: columns are taken a few at a
// time, and rows and columns without anything in these are left alone.
#pragma once
#include <cstddef>
#include <vector>

namespace dfm {

inline constexpr size_t kLuColumns = 8;
// Length of a row of a system of n unknowns; what is behind them is zero.
inline constexpr size_t lu_row(size_t n) { return (n + kLuColumns - 1) / kLuColumns * kLuColumns; }

// x = A^-1 x; A [n, lu_row(n)] is overwritten, live is scratch. False: singular.
bool solve_lu(size_t n, double *a, double *x, std::vector<size_t> &live);

}  // namespace dfm
