// Frictional contact problems as others know them: the text format of Siconos and the HDF5 format of FCLIB.
//
//     u = W r + q;   with u_n' = u_n + mu |u_t|: (u_n', u_t) in the dual cone, r in the cone, complementary
//
// Three rows per contact: normal, two tangents. A global problem M v = f + H r, u = H' v + w is condensed to
// W = H' M^-1 H, q = H' M^-1 f + w. One in two dimensions gets a second tangent along which nothing moves.
#pragma once
#include <string>
#include <vector>

namespace contact {

struct Matrix {
  size_t rows = 0, columns = 0;
  std::vector<double> value;  // row-major
  Matrix(size_t r, size_t c) : rows(r), columns(c), value(r * c) {}
  double &operator()(size_t r, size_t c) { return value[r * columns + c]; }
  double operator()(size_t r, size_t c) const { return value[r * columns + c]; }
};

struct LocalProblem {
  Matrix W{0, 0};
  std::vector<double> q, mu;
};

// Throws std::runtime_error with one sentence where the file holds no such problem.
LocalProblem read_local_problem(const std::string &path);
// Writes FCLIB's local form.
void write_local_problem(const std::string &path, const LocalProblem &problem);

}  // namespace contact
