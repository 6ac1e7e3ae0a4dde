#include "read_problem.h"

#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace contact {
namespace {

struct Entries {
  struct One {
    size_t row, column;
    double value;
  };
  size_t rows = 0, columns = 0;
  std::vector<One> list;
  void add(size_t r, size_t c, double value) {
    if (r >= rows || c >= columns) throw std::runtime_error("an entry is outside of its matrix");
    if (value != 0) list.push_back({r, c, value});
  }
};

struct GlobalProblem {
  Entries M, H;
  std::vector<double> f, w, mu;
};

[[noreturn]] void refuse(const std::string &why) { throw std::runtime_error(why); }

// Three rows per contact out of two.
LocalProblem padded(const Entries &W, const std::vector<double> &q, std::vector<double> mu, size_t dim) {
  const size_t n = mu.size();
  if (dim != 2 && dim != 3) refuse("rolling friction (dimension " + std::to_string(dim) + ")");
  if (n == 0) refuse("there are no contacts to solve");
  if (W.rows != dim * n || W.columns != W.rows || q.size() != W.rows) refuse("sizes do not fit each other");
  LocalProblem out;
  out.W = Matrix(3 * n, 3 * n);
  out.q.assign(3 * n, 0.0);
  const auto place = [&](size_t k) { return k / dim * 3 + k % dim; };
  for (size_t r = 0; r < W.rows; ++r) out.q[place(r)] = q[r];
  for (const Entries::One &e : W.list) out.W(place(e.row), place(e.column)) += e.value;
  out.mu = std::move(mu);
  return out;
}

// L of M = L L', in the lower triangle.
void factor(Matrix &l) {
  for (size_t k = 0; k < l.rows; ++k)
    for (size_t r = k; r < l.rows; ++r) {
      double sum = l(r, k);
      for (size_t c = 0; c < k; ++c) sum -= l(r, c) * l(k, c);
      if (r == k && !(sum > 0)) refuse("the mass matrix is not positive definite");
      l(r, k) = r == k ? std::sqrt(sum) : sum / l(k, k);
    }
}

// The part of M that is coupled, and what it adds to W and q: H' M^-1 H and H' M^-1 f.
void condense(const std::vector<size_t> &own, const std::vector<std::vector<Entries::One>> &m,
              const std::vector<std::vector<Entries::One>> &h, const std::vector<double> &f,
              std::vector<size_t> &place, Matrix &W, std::vector<double> &q) {
  const size_t n = own.size();
  std::vector<size_t> columns;
  for (size_t k = 0; k < n; ++k) {
    place[own[k]] = k;
    for (const Entries::One &e : h[own[k]]) columns.push_back(e.column);
  }
  std::ranges::sort(columns);
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  if (columns.empty()) return;
  Matrix l(n, n), x(n, columns.size() + 1);  // L; L^-1 (H, f)
  for (size_t k = 0; k < n; ++k) {
    for (const Entries::One &e : m[own[k]]) l(k, place[e.column]) += e.value;
    for (const Entries::One &e : h[own[k]])
      x(k, size_t(std::ranges::lower_bound(columns, e.column) - columns.begin())) += e.value;
    x(k, columns.size()) = f[own[k]];
  }
  factor(l);
  for (size_t r = 0; r < n; ++r)
    for (size_t c = 0; c < x.columns; ++c) {
      double sum = x(r, c);
      for (size_t k = 0; k < r; ++k) sum -= l(r, k) * x(k, c);
      x(r, c) = sum / l(r, r);
    }
  for (size_t k = 0; k < n; ++k)
    for (size_t r = 0; r < columns.size(); ++r) {
      for (size_t c = 0; c < columns.size(); ++c) W(columns[r], columns[c]) += x(k, r) * x(k, c);
      q[columns[r]] += x(k, r) * x(k, columns.size());
    }
}

LocalProblem condensed(const GlobalProblem &g, size_t dim) {
  const size_t n = g.M.rows, rows = g.w.size();
  if (g.M.columns != n || g.H.rows != n || g.H.columns != rows || g.f.size() != n)
    refuse("sizes do not fit each other");
  std::vector<std::vector<Entries::One>> m(n), h(n);
  for (const Entries::One &e : g.M.list) m[e.row].push_back(e);
  for (const Entries::One &e : g.H.list) h[e.row].push_back(e);
  Matrix W(rows, rows);
  std::vector<double> q = g.w;
  std::vector<size_t> place(n);
  std::vector<char> seen(n);
  for (size_t start = 0; start < n; ++start) {
    if (seen[start]) continue;
    seen[start] = 1;
    std::vector<size_t> own = {start};
    for (size_t k = 0; k < own.size(); ++k)
      for (const Entries::One &e : m[own[k]])
        if (!seen[e.column]) {
          seen[e.column] = 1;
          own.push_back(e.column);
        }
    condense(own, m, h, g.f, place, W, q);
  }
  Entries all{rows, rows, {}};
  for (size_t r = 0; r < rows; ++r)
    for (size_t c = 0; c < rows; ++c) all.add(r, c, W(r, c));
  return padded(all, q, g.mu, dim);
}

// Numbers of a text, one after the other.
class Text {
 public:
  explicit Text(const std::string &path) : in_(path) {}
  double number() {
    double x;
    if (!(in_ >> x)) refuse("the text ends too early, or is none");
    return x;
  }
  size_t count() {
    const double x = number();
    if (!(x >= 0 && x < 1e6)) refuse("a count is out of range");
    return size_t(x);
  }
  std::vector<double> numbers(size_t n) {
    std::vector<double> out(n);
    for (double &x : out) x = number();
    return out;
  }
  std::vector<size_t> counts(size_t n) {
    std::vector<size_t> out(n);
    for (size_t &x : out) x = count();
    return out;
  }
  // Matrix by columns, or blocks by rows, each by columns.
  Entries matrix() {
    const size_t storage = count(), rows = count(), columns = count();
    Entries out{rows, columns, {}};
    const auto fill = [&](size_t row, size_t column, size_t height, size_t width) {
      for (size_t c = 0; c < width; ++c)
        for (size_t r = 0; r < height; ++r) out.add(row + r, column + c, number());
    };
    if (storage == 0) {
      if (count() != rows || count() != columns) refuse("sizes do not fit each other");
      fill(0, 0, rows, columns);
      return out;
    }
    if (storage != 1) refuse("a matrix of storage " + std::to_string(storage));
    const size_t blocks = count(), high = count(), wide = count();
    const std::vector<size_t> bottom = counts(high), right = counts(wide);
    const size_t first = count(), second = count();
    const std::vector<size_t> begin = counts(first), column = counts(second);
    for (size_t row = 0, b = 0; row + 1 < first; ++row)
      for (size_t k = begin[row]; k < begin[row + 1]; ++k, ++b) {
        if (count() != b || b >= blocks) refuse("blocks are not in order");
        const size_t c = column.at(k), top = row ? bottom.at(row - 1) : 0, left = c ? right.at(c - 1) : 0;
        fill(top, left, bottom.at(row) - top, right.at(c) - left);
      }
    return out;
  }

 private:
  std::ifstream in_;
};

LocalProblem read_text(const std::string &path, bool global) {
  Text in(path);
  const size_t dim = in.count(), n = in.count();
  const Entries first = in.matrix();
  if (!global) {
    const std::vector<double> q = in.numbers(dim * n);
    return padded(first, q, in.numbers(n), dim);
  }
  GlobalProblem g;
  g.M = first;
  g.H = in.matrix();
  g.f = in.numbers(g.M.rows);
  g.w = in.numbers(dim * n);
  g.mu = in.numbers(n);
  return condensed(g, dim);
}

class Hdf5 {
 public:
  explicit Hdf5(hid_t file) : file_(file) {
    if (file_ < 0) refuse("HDF5 cannot open it");
  }
  Hdf5(const Hdf5 &) = delete;
  Hdf5 &operator=(const Hdf5 &) = delete;
  ~Hdf5() { H5Fclose(file_); }
  bool has(const std::string &name) const { return H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0; }
  std::vector<double> numbers(const std::string &name) const {
    const hid_t set = H5Dopen2(file_, name.c_str(), H5P_DEFAULT);
    if (set < 0) refuse("there is no " + name);
    const hid_t space = H5Dget_space(set);
    std::vector<double> out(size_t(H5Sget_simple_extent_npoints(space)));
    const herr_t status = H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, out.data());
    H5Sclose(space);
    H5Dclose(set);
    if (status < 0) refuse("HDF5 cannot read " + name);
    return out;
  }
  size_t count(const std::string &name) const { return size_t(numbers(name).at(0)); }
  void group(const std::string &name) const {
    const hid_t made = H5Gcreate2(file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (made < 0 || H5Gclose(made) < 0) refuse("HDF5 cannot write " + name);
  }
  void write(const std::string &name, const std::vector<int> &values) const {
    write(name, values.size(), values.data(), H5T_NATIVE_INT);
  }
  void write(const std::string &name, const std::vector<double> &values) const {
    write(name, values.size(), values.data(), H5T_NATIVE_DOUBLE);
  }
  // nz: the number of triplets, -1: columns, -2: rows
  Entries matrix(const std::string &name) const {
    Entries out{count(name + "/m"), count(name + "/n"), {}};
    const double nz = numbers(name + "/nz").at(0);
    const std::vector<double> p = numbers(name + "/p"), i = numbers(name + "/i"), x = numbers(name + "/x");
    if (nz >= 0) {
      for (size_t k = 0; k < size_t(nz); ++k) out.add(size_t(i.at(k)), size_t(p.at(k)), x.at(k));
      return out;
    }
    const size_t lines = nz == -1 ? out.columns : out.rows;
    for (size_t line = 0; line < lines; ++line)
      for (size_t k = size_t(p.at(line)); k < size_t(p.at(line + 1)); ++k) {
        if (nz == -1) out.add(size_t(i.at(k)), line, x.at(k));
        else out.add(line, size_t(i.at(k)), x.at(k));
      }
    return out;
  }

 private:
  hid_t file_;
  void write(const std::string &name, hsize_t n, const void *values, hid_t type) const {
    const hid_t space = H5Screate_simple(1, &n, nullptr);
    const hid_t set = H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const herr_t status = set < 0 ? -1 : H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
    H5Sclose(space);
    if (set >= 0) H5Dclose(set);
    if (status < 0) refuse("HDF5 cannot write " + name);
  }
};

LocalProblem read_hdf5(const std::string &path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Hdf5 in(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT));
  if (in.has("fclib_local")) {
    const std::string at = "fclib_local/";
    if (in.has(at + "V")) refuse("equality constraints");
    return padded(in.matrix(at + "W"), in.numbers(at + "vectors/q"), in.numbers(at + "vectors/mu"),
                  in.count(at + "spacedim"));
  }
  if (!in.has("fclib_global")) refuse("neither fclib_local nor fclib_global (rolling friction?)");
  const std::string at = "fclib_global/";
  if (in.has(at + "G")) refuse("equality constraints");
  GlobalProblem g;
  g.M = in.matrix(at + "M");
  g.H = in.matrix(at + "H");
  g.f = in.numbers(at + "vectors/f");
  g.w = in.numbers(at + "vectors/w");
  g.mu = in.numbers(at + "vectors/mu");
  return condensed(g, in.count(at + "spacedim"));
}

}  // namespace

LocalProblem read_local_problem(const std::string &path) {
  if (path.ends_with(".hdf5")) return read_hdf5(path);
  const std::string name = path.substr(path.rfind('/') + 1);
  return read_text(path, name.starts_with("GFC3D") && name.find("condensed") == std::string::npos);
}

// By columns.
void write_local_problem(const std::string &path, const LocalProblem &problem) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Matrix &W = problem.W;
  std::vector<int> begin{0}, row;
  std::vector<double> value;
  for (size_t c = 0; c < W.columns; ++c) {
    for (size_t r = 0; r < W.rows; ++r) {
      if (W(r, c) == 0) continue;
      row.push_back(int(r));
      value.push_back(W(r, c));
    }
    begin.push_back(int(row.size()));
  }
  const Hdf5 out(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
  for (const char *name : {"/fclib_local", "/fclib_local/W", "/fclib_local/vectors"}) out.group(name);
  out.write("/fclib_local/spacedim", std::vector<int>{3});
  const std::string at = "/fclib_local/W/";
  out.write(at + "nzmax", std::vector<int>{int(row.size())});
  out.write(at + "m", std::vector<int>{int(W.rows)});
  out.write(at + "n", std::vector<int>{int(W.columns)});
  out.write(at + "nz", std::vector<int>{-1});
  out.write(at + "p", begin);
  out.write(at + "i", row);
  out.write(at + "x", value);
  out.write("/fclib_local/vectors/q", problem.q);
  out.write("/fclib_local/vectors/mu", problem.mu);
}

}  // namespace contact
