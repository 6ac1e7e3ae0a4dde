#include "math/nested_dissection.h"

#include <algorithm>
#include <vector>

#include <Eigen/SparseCore>
#include <Eigen/OrderingMethods>

#include "core/lists.h"

namespace dfm {
namespace {

constexpr size_t kWhole = 120;  // points that are not cut any more

struct Dissection {
  const BlockPattern &pattern;
  const double *places;
  uint32_t *next;
  std::vector<uint32_t> begin, other;  // neighbors
  std::vector<uint32_t> part, local;   // by point: the part it is in; its index there
  uint32_t parts = 0;

  Dissection(const BlockPattern &p, const double *x, uint32_t *order)
      : pattern(p), places(x), next(order), part(p.n, 0), local(p.n, 0) {
    const auto each = [&](const auto &use) {
      for (uint32_t k = 0; k < 2 * p.nb; ++k)
        if (p.ij[k] != p.ij[k ^ 1u]) use(p.ij[k], p.ij[k ^ 1u]);
    };
    make_lists(p.n, each, begin, other);
  }

  double place(uint32_t i, size_t axis) const { return places[3 * size_t{i} + axis]; }

  void finish(const std::vector<uint32_t> &points) {
    const uint32_t own = ++parts;
    for (uint32_t k = 0; k < points.size(); ++k) {
      part[points[k]] = own;
      local[points[k]] = k;
    }
    std::vector<uint32_t> ij;
    for (uint32_t k = 0; k < points.size(); ++k) {
      ij.insert(ij.end(), {k, k});
      for (uint32_t e = begin[points[k]]; e < begin[points[k] + 1]; ++e)
        if (part[other[e]] == own && local[other[e]] > k) ij.insert(ij.end(), {k, local[other[e]]});
    }
    std::vector<uint32_t> found(points.size());
    minimum_degree({uint32_t(points.size()), uint32_t(ij.size() / 2), ij.data()}, found.data());
    for (const uint32_t k : found) *next++ = points[k];
  }

  void cut(std::vector<uint32_t> points) {
    if (points.size() <= kWhole) return finish(points);
    size_t axis = 0;
    double longest = -1;
    for (size_t a = 0; a < 3; ++a) {
      const auto [low, high] = std::minmax_element(
          points.begin(), points.end(), [&](uint32_t i, uint32_t j) { return place(i, a) < place(j, a); });
      const double length = place(*high, a) - place(*low, a);
      if (length > longest) {
        longest = length;
        axis = a;
      }
    }
    const auto before = [&](uint32_t i, uint32_t j) {
      return place(i, axis) != place(j, axis) ? place(i, axis) < place(j, axis) : i < j;
    };
    std::sort(points.begin(), points.end(), before);
    // a cut between two layers, nearest to the middle
    size_t middle = points.size() / 2;
    const double plane = place(points[middle], axis);
    size_t first = middle, last = middle;
    while (first > 0 && place(points[first - 1], axis) == plane) --first;
    while (last < points.size() && place(points[last], axis) == plane) ++last;
    if (first > 0 && (middle - first < last - middle || last == points.size())) middle = first;
    else if (last < points.size()) middle = last;
    const uint32_t upper = ++parts;
    for (size_t k = middle; k < points.size(); ++k) part[points[k]] = upper;
    std::vector<uint32_t> low, between;
    for (size_t k = 0; k < middle; ++k) {
      const uint32_t i = points[k];
      bool meets = false;
      for (uint32_t e = begin[i]; e < begin[i + 1] && !meets; ++e) meets = part[other[e]] == upper;
      (meets ? between : low).push_back(i);
    }
    const std::vector<uint32_t> high(points.begin() + std::ptrdiff_t(middle), points.end());
    if (low.empty() || between.size() == points.size()) return finish(points);
    cut(low);
    cut(high);
    for (const uint32_t i : between) *next++ = i;
  }
};

}  // namespace

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

void nested_dissection(const BlockPattern &pattern, const double *places, uint32_t *order) {
  Dissection work(pattern, places, order);
  std::vector<uint32_t> all(pattern.n);
  for (uint32_t i = 0; i < pattern.n; ++i) all[i] = i;
  if (pattern.n) work.cut(std::move(all));
}

}  // namespace dfm
