// Matrices in tiles, by clusters of rows and columns. A tile of clusters far from each other is, to a
// tolerance, the product of two thin matrices, and so are tiles of the factor (block low-rank: Amestoy et al.
// 2015, SIAM J. Sci. Comput. 37). Which tiles are thin is found from their numbers, not from distances.
#pragma once
#include <vector>

#include "../model_common/buffer.h"
#include "reduced_kernel.h"

namespace reduced {

using model::Buffer;

// Numbers by rows, each filled with zeros to an odd multiple of kLanes: the rows of a part then lie in
// different sets of the cache.
class Table {
 public:
  size_t rows = 0, columns = 0;
  void create(const dfm_host *host, size_t r, size_t c) {
    rows = r;
    columns = c;
    data_.create(host, r * stride());
  }
  size_t lanes() const { return (columns + kLanes - 1) / kLanes; }
  size_t stride() const { return kLanes * (lanes() | 1); }
  double *row(size_t i) { return data_.data() + i * stride(); }
  const double *row(size_t i) const { return data_.data() + i * stride(); }
  double square() const;

 private:
  Buffer<double> data_;
};

// left, or left right
struct Tile {
  Table left, right;
  bool thin() const { return right.rows > 0; }
};

class Tiles {
 public:
  // Numbers of rows and columns of each cluster.
  void create(const dfm_host *host, const Kernels *kernels, std::vector<size_t> row,
              std::vector<size_t> column);
  size_t nrow() const { return row_.size() - 1; }
  size_t ncolumn() const { return column_.size() - 1; }
  size_t row(size_t i) const { return row_[i]; }  // the first of a cluster
  size_t column(size_t j) const { return column_[j]; }
  void table(size_t i, size_t j, Table &out) const {
    out.create(host_, row_[i + 1] - row_[i], column_[j + 1] - column_[j]);
  }

  void set(size_t i, size_t j, Table &&from);                                  // thin, if it can be
  void cut(size_t i, size_t j, const Table &from, size_t row, size_t column);  // from a larger table
  void get(size_t i, size_t j, Table &out) const;
  // Factorizes the lower triangle of a positive definite matrix, inverted on the diagonal. Throws
  // kIndefinite.
  void factorize();
  // x = L^-1 x
  void reduce(Tiles &x) const;
  // f -= x_a^T y_b, sums over all tiles of a column of each
  static void subtract_gram(const Tiles &x, size_t a, size_t b, Table &f);
  // For kWide vectors side by side, 1 or kLanes: L L^T x = b in place; y += A x; y += A^T x.
  template <size_t kWide>
  void solve(double *x) const;
  template <size_t kWide>
  void add(const double *x, double *y) const;
  template <size_t kWide>
  void add_transposed(const double *x, double *y) const;

 private:
  const dfm_host *host_ = nullptr;
  const Kernels *kernels_ = nullptr;
  std::vector<size_t> row_, column_;
  size_t most_ = 0;
  std::vector<Tile> tile_;
  mutable Buffer<double> side_;  // [2, most rows of a tile, kLanes]
  Tile &at(size_t i, size_t j) { return tile_[i * ncolumn() + j]; }
  const Tile &at(size_t i, size_t j) const { return tile_[i * ncolumn() + j]; }
  template <size_t kWide>
  void apply(const Tile &t, bool turned, const double *x, double *y, bool minus) const;
  void compress(Table &&full, double norm, Tile &out) const;
};

}  // namespace reduced
