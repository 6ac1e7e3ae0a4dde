// Frictional contact problems of others: the text format of Siconos and the HDF5 format of FCLIB.
//
//     u = W r + q;   with u_n' = u_n + mu |u_t|: (u_n', u_t) in the dual cone, r in the cone, complementary
//
// Three rows per contact: normal, two tangents. A global problem M v = f + H r, u = H' v + w is condensed to
// W = H' M^-1 H, q = H' M^-1 f + w. One in two dimensions gets a second tangent along which nothing moves.
#pragma once
#include <string>
#include <vector>

#include "dense.h"

namespace test {

struct ContactProblem {
  Dense W{0, 0};
  std::vector<double> q, mu;
  size_t unknowns = 0;  // of a global problem, else 0
};

// Throws std::runtime_error with one sentence where the file holds no such problem.
ContactProblem read_contact_problem(const std::string &path);

}  // namespace test
