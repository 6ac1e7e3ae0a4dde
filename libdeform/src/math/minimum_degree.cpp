#include "math/minimum_degree.h"

#include <vector>

#include <Eigen/SparseCore>
#include <Eigen/OrderingMethods>

namespace dfm {

void minimum_degree(const BlockPattern &pattern, uint32_t *order) {
  if (!pattern.n) return;
  std::vector<Eigen::Triplet<double, int>> entries;
  entries.reserve(2 * size_t{pattern.nb});
  for (uint32_t b = 0; b < pattern.nb; ++b) {
    const int i = int(pattern.ij[2 * size_t{b}]), j = int(pattern.ij[2 * size_t{b} + 1]);
    entries.emplace_back(i, j, 1.0);
    if (i != j) entries.emplace_back(j, i, 1.0);
  }
  const int n = int(pattern.n);
  Eigen::SparseMatrix<double, Eigen::ColMajor, int> points(n, n);
  points.setFromTriplets(entries.begin(), entries.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> found;
  Eigen::AMDOrdering<int>()(points, found);
  for (uint32_t k = 0; k < pattern.n; ++k) order[k] = uint32_t(found.indices()[int(k)]);
}

}  // namespace dfm
