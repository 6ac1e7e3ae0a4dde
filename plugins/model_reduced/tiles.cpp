#include "tiles.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "sparse.h"

namespace reduced {
namespace {

// What may be left out of a tile, of its norm; columns that the search for its range takes at once.
constexpr double kLeftOut = 1e-5;
constexpr size_t kSample = 24;

struct Arithmetic {
  const dfm_host *host;
  const Kernels *kernels;

  // c += a b, or -= ; turned: a^T b
  void add(const Table &a, bool turned, const Table &b, Table &c, bool minus = false) const {
    const size_t row = turned ? 1 : a.stride(), column = turned ? a.stride() : 1;
    kernels->multiply({c.rows, kLanes * c.lanes(), b.rows, a.row(0), row, column, b.row(0), b.stride(),
                       c.row(0), c.stride(), minus});
  }
  Table product(const Table &a, bool turned, const Table &b) const {
    Table c;
    c.create(host, turned ? a.columns : a.rows, b.columns);
    add(a, turned, b, c);
    return c;
  }
  Table transposed(const Table &a) const {
    Table out;
    out.create(host, a.columns, a.rows);
    for (size_t i = 0; i < a.rows; ++i)
      for (size_t j = 0; j < a.columns; ++j) out.row(j)[i] = a.row(i)[j];
    return out;
  }
  void subtract(const Tile &a, bool turned, const Tile &b, Table &f) const {
    if (!a.thin()) {
      if (!b.thin()) add(a.left, turned, b.left, f, true);
      else add(product(a.left, turned, b.left), false, b.right, f, true);
      return;
    }
    const Table &first = turned ? a.right : a.left, &second = turned ? a.left : a.right;
    const Table core = product(second, turned, b.left);
    if (!b.thin()) add(first, turned, core, f, true);
    else if (core.rows < core.columns) add(first, turned, product(core, false, b.right), f, true);
    else add(product(first, turned, core), false, b.right, f, true);
  }
};

double dot_of(size_t n, const double *a, const double *b) {
  double sum[kLanes] = {};
  size_t i = 0;
  for (; i + kLanes <= n; i += kLanes)
    for (size_t l = 0; l < kLanes; ++l) sum[l] += a[i + l] * b[i + l];
  for (; i < n; ++i) sum[0] += a[i] * b[i];
  return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
}

// y += a x, a^T x; or -=
void add_rows(const Table &a, const double *x, double *y, bool minus) {
  for (size_t i = 0; i < a.rows; ++i) y[i] += (minus ? -1 : 1) * dot_of(a.columns, a.row(i), x);
}
void add_turned(const Table &a, const double *x, double *y, bool minus) {
  for (size_t i = 0; i < a.rows; ++i) {
    const double *const row = a.row(i), times = minus ? -x[i] : x[i];
    for (size_t j = 0; j < a.columns; ++j) y[j] += times * row[j];
  }
}

void transpose(const Arithmetic &with, const Tile &from, Tile &out) {
  out.left = with.transposed(from.thin() ? from.right : from.left);
  if (from.thin()) out.right = with.transposed(from.left);
}

// Inverts the factor of the lower triangle of a.
void invert_factor(Table &a) {
  const size_t n = a.rows;
  for (size_t i = 0; i < n; ++i) {
    double *const own = a.row(i);
    for (size_t j = 0; j <= i; ++j) {
      const double *const other = a.row(j);
      double sum = own[j];
      for (size_t k = 0; k < j; ++k) sum -= own[k] * other[k];
      if (j < i) {
        own[j] = sum * other[j];
      } else {
        if (!(sum > 0)) throw kIndefinite;
        own[j] = 1 / std::sqrt(sum);
      }
    }
  }
  // the diagonal is inverted by now
  std::vector<double> sum(n);
  for (size_t i = 0; i < n; ++i) {
    double *const own = a.row(i);
    std::fill(sum.begin(), sum.end(), 0.0);
    for (size_t k = 0; k < i; ++k) {
      const double *const other = a.row(k);
      for (size_t j = 0; j <= k; ++j) sum[j] -= own[k] * other[j];
    }
    for (size_t j = 0; j < i; ++j) own[j] = sum[j] * own[i];
    std::fill(own + i + 1, own + n, 0.0);
  }
}

}  // namespace

double Table::square() const {
  double sum = 0;
  for (size_t i = 0; i < rows; ++i)
    for (size_t j = 0; j < columns; ++j) sum += row(i)[j] * row(i)[j];
  return sum;
}

void Tiles::create(const dfm_host *host, const Kernels *kernels, std::vector<size_t> row,
                   std::vector<size_t> column) {
  host_ = host;
  kernels_ = kernels;
  most_ = 0;
  const auto places = [&](const std::vector<size_t> &from, std::vector<size_t> &to) {
    to.assign(1, 0);
    for (const size_t n : from) {
      to.push_back(to.back() + n);
      most_ = std::max(most_, n);
    }
  };
  places(row, row_);
  places(column, column_);
  tile_.clear();
  tile_.resize(nrow() * ncolumn());
  side_.create(host, 2 * kLanes * most_);
}

// Its range by products with random signs (Halko, Martinsson and Tropp 2011), until a further one finds
// nothing; then the largest parts of it.
void Tiles::compress(Table &&full, double norm, Tile &out) const {
  const Arithmetic with{host_, kernels_};
  const size_t m = full.rows, n = full.columns, most = m * n / (2 * (m + n)) / kSample * kSample;
  const double nothing = kLeftOut * norm;
  uint64_t random = 0x9e3779b97f4a7c15u;
  Table range;  // orthonormal columns, zeros behind them
  range.create(host_, m, most);
  size_t k = 0;
  bool found = false;
  while (!found && k < most) {
    Table signs;
    signs.create(host_, n, kSample);
    for (size_t j = 0; j < n; ++j)
      for (size_t s = 0; s < kSample; ++s) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        signs.row(j)[s] = random >> 63 ? 1 : -1;
      }
    Table image = with.product(full, false, signs);
    for (int twice = 0; k > 0 && twice < 2; ++twice)
      with.add(range, false, with.product(range, true, image), image, true);
    found = std::sqrt(image.square() / double(kSample)) <= nothing;
    Table fresh = with.transposed(image);
    for (size_t s = 0; !found && s < kSample; ++s) {
      double *const own = fresh.row(s);
      for (int twice = 0; twice < 2; ++twice)
        for (size_t before = 0; before < s; ++before) {
          const double part = dot_of(m, own, fresh.row(before));
          for (size_t i = 0; i < m; ++i) own[i] -= part * fresh.row(before)[i];
        }
      const double length = std::sqrt(dot_of(m, own, own));
      const bool any = length > 1e-3 * nothing;
      for (size_t i = 0; i < m; ++i) {
        own[i] = any ? own[i] / length : 0;
        range.row(i)[k + s] = own[i];
      }
    }
    if (!found) k += kSample;
  }
  if (!found) {
    out.left = std::move(full);
    out.right = {};
    return;
  }
  const Table right = with.product(range, true, full);
  Eigen::MatrixXd gram(k, k);
  const Table turned = with.transposed(right), product = with.product(right, false, turned);
  for (size_t a = 0; a < k; ++a)
    for (size_t b = 0; b < k; ++b) gram(Eigen::Index(a), Eigen::Index(b)) = product.row(a)[b];
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  if (k > 0) solver.compute(gram);
  size_t skip = 0;
  for (double sum = 0; skip < k; ++skip) {
    sum += std::max(0.0, solver.eigenvalues()[Eigen::Index(skip)]);
    if (sum > nothing * nothing) break;
  }
  const size_t kept = std::max<size_t>(1, k - skip);
  Table part;
  part.create(host_, most, kept);
  for (size_t a = 0; a < k; ++a)
    for (size_t b = 0; b < kept && skip + b < k; ++b)
      part.row(a)[b] = solver.eigenvectors()(Eigen::Index(a), Eigen::Index(skip + b));
  out.left = with.product(range, false, part);
  out.right = with.product(part, true, right);
}

void Tiles::set(size_t i, size_t j, Table &&from) {
  const double norm = std::sqrt(from.square());
  compress(std::move(from), norm, at(i, j));
}

void Tiles::cut(size_t i, size_t j, const Table &from, size_t row, size_t column) {
  Table own;
  table(i, j, own);
  for (size_t n = 0; n < own.rows; ++n) std::copy_n(from.row(row + n) + column, own.columns, own.row(n));
  set(i, j, std::move(own));
}

void Tiles::get(size_t i, size_t j, Table &out) const {
  const Tile &t = at(i, j);
  table(i, j, out);
  const Arithmetic with{host_, kernels_};
  if (t.thin()) return with.add(t.left, false, t.right, out);
  std::copy_n(t.left.row(0), t.left.rows * t.left.stride(), out.row(0));
}

void Tiles::factorize() {
  const Arithmetic with{host_, kernels_};
  for (size_t j = 0; j < nrow(); ++j) {
    std::vector<Tile> before(j);  // L_jk^T
    for (size_t k = 0; k < j; ++k) transpose(with, at(j, k), before[k]);
    Table last;
    for (size_t i = j; i < nrow(); ++i) {
      Table f;
      get(i, j, f);
      const double norm = std::sqrt(f.square());
      for (size_t k = 0; k < j; ++k) with.subtract(at(i, k), false, before[k], f);
      Tile &own = at(i, j);
      if (i == j) {
        invert_factor(f);
        last = with.transposed(f);
        own.left = std::move(f);
        own.right = {};
        continue;
      }
      compress(std::move(f), norm, own);
      Table &end = own.thin() ? own.right : own.left;
      end = with.product(end, false, last);
    }
  }
}

void Tiles::reduce(Tiles &x) const {
  const Arithmetic with{host_, kernels_};
  for (size_t a = 0; a < x.ncolumn(); ++a)
    for (size_t i = 0; i < nrow(); ++i) {
      Table f;
      x.get(i, a, f);
      const double norm = std::sqrt(f.square());
      for (size_t k = 0; k < i; ++k) with.subtract(at(i, k), false, x.at(k, a), f);
      Tile &own = x.at(i, a);
      compress(std::move(f), norm, own);
      own.left = with.product(at(i, i).left, false, own.left);
    }
}

void Tiles::subtract_gram(const Tiles &x, size_t a, size_t b, Table &f) {
  const Arithmetic with{x.host_, x.kernels_};
  for (size_t i = 0; i < x.nrow(); ++i) with.subtract(x.at(i, a), true, x.at(i, b), f);
}

// y += t x, or t^T x; or -=
template <size_t kWide>
void Tiles::apply(const Tile &t, bool turned, const double *x, double *y, bool minus) const {
  const auto step = [&](const Table &a, const double *from, double *to, bool less) {
    const size_t rows = turned ? a.columns : a.rows, columns = turned ? a.rows : a.columns;
    const size_t row = turned ? 1 : a.stride(), column = turned ? a.stride() : 1;
    if constexpr (kWide == 1) return turned ? add_turned(a, from, to, less) : add_rows(a, from, to, less);
    kernels_->multiply({rows, kWide, columns, a.row(0), row, column, from, kWide, to, kWide, less});
  };
  if (!t.thin()) return step(t.left, x, y, minus);
  double *const middle = side_.data();
  std::fill(middle, middle + kWide * t.right.rows, 0.0);
  step(turned ? t.left : t.right, x, middle, false);
  step(turned ? t.right : t.left, middle, y, minus);
}

template <size_t kWide>
void Tiles::solve(double *x) const {
  double *const own = side_.data() + kWide * most_;
  const auto end = [&](size_t j, bool turned) {
    double *const to = x + kWide * row_[j];
    const size_t size = kWide * (row_[j + 1] - row_[j]);
    std::copy(to, to + size, own);
    std::fill(to, to + size, 0.0);
    apply<kWide>(at(j, j), turned, own, to, false);
  };
  for (size_t j = 0; j < nrow(); ++j) {
    end(j, false);
    for (size_t i = j + 1; i < nrow(); ++i)
      apply<kWide>(at(i, j), false, x + kWide * row_[j], x + kWide * row_[i], true);
  }
  for (size_t j = nrow(); j-- > 0;) {
    for (size_t i = j + 1; i < nrow(); ++i)
      apply<kWide>(at(i, j), true, x + kWide * row_[i], x + kWide * row_[j], true);
    end(j, true);
  }
}

template <size_t kWide>
void Tiles::add(const double *x, double *y) const {
  for (size_t i = 0; i < nrow(); ++i)
    for (size_t j = 0; j < ncolumn(); ++j)
      apply<kWide>(at(i, j), false, x + kWide * column_[j], y + kWide * row_[i], false);
}

template <size_t kWide>
void Tiles::add_transposed(const double *x, double *y) const {
  for (size_t i = 0; i < nrow(); ++i)
    for (size_t j = 0; j < ncolumn(); ++j)
      apply<kWide>(at(i, j), true, x + kWide * row_[i], y + kWide * column_[j], false);
}

template void Tiles::solve<1>(double *) const;
template void Tiles::solve<kLanes>(double *) const;
template void Tiles::add<1>(const double *, double *) const;
template void Tiles::add<kLanes>(const double *, double *) const;
template void Tiles::add_transposed<1>(const double *, double *) const;
template void Tiles::add_transposed<kLanes>(const double *, double *) const;

}  // namespace reduced
