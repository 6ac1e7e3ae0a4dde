// Every model with every coupling, partner, law and integrator: the axes of the product, its names, and the
// rows of it that hold every pair of levels at least once.
#pragma once
#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <string>
#include <vector>

namespace test::cover {

enum Axis : size_t { kModel, kCoupling, kPartner, kLaw, kIntegrator, kAxes };

// The partner "soft:MODEL" is a second soft body of that model; "self" is the body's own other half.
inline const std::array<std::vector<std::string>, kAxes> &levels() {
  static const std::array<std::vector<std::string>, kAxes> all = [] {
    std::array<std::vector<std::string>, kAxes> a;
    // msm_gpu and corotational_fem_gpu need a driver, and 1 ms of it for each sub-step: tests/gpu
    // boundary is condensed but for its stiffness, and its bodies have no cells (plugins/model_reduced)
    a[kModel] = {"msm", "corotational_fem", "linear_fem", "modal", "condensed", "shape_matching", "meshless"};
    a[kCoupling] = {"identity", "barycentric", "mls", "thesis"};
    a[kPartner] = {"plane", "box", "mesh", "voxels", "rigid", "self"};
    for (const std::string &model : a[kModel]) a[kPartner].push_back("soft:" + model);
    a[kLaw] = {"none", "coulomb", "karnopp", "dahl", "lugre", "elastoplastic", "gms"};
    a[kIntegrator] = {"symplectic_euler", "implicit_euler", "tr_bdf2"};
    return a;
  }();
  return all;
}

using Row = std::array<size_t, kAxes>;

inline const std::string &level(const Row &row, Axis axis) { return levels()[axis][row[axis]]; }

// Columns of a table.
inline std::string columns(const Row &row) {
  std::string out;
  for (size_t a = 0; a < kAxes; ++a) out += (a ? "," : "") + levels()[a][row[a]];
  return out;
}

// A name of letters, digits and underlines.
inline std::string name(const Row &row) {
  std::string out = columns(row);
  std::replace(out.begin(), out.end(), ',', '_');
  std::replace(out.begin(), out.end(), ':', '_');
  return out;
}

// The whole product, in steps of 0.618 of it: what is stopped early has seen all levels of each axis about
// equally often.
inline std::vector<Row> product() {
  std::vector<Row> in_order;
  Row row{};
  for (size_t a = 0; a < kAxes;) {
    in_order.push_back(row);
    for (a = 0; a < kAxes && ++row[a] == levels()[a].size(); ++a) row[a] = 0;
  }
  const size_t n = in_order.size();
  size_t step = n * 618 / 1000;
  while (std::gcd(step, n) > 1) ++step;
  std::vector<Row> out(n);
  for (size_t k = 0; k < n; ++k) out[k] = in_order[k * step % n];
  return out;
}

// Pairs of levels of two axes that `rows` do not have.
class Pairs {
 public:
  Pairs() {
    for (size_t a = 0; a < kAxes; ++a)
      for (size_t b = a + 1; b < kAxes; ++b) open_[a][b].assign(levels()[a].size() * levels()[b].size(), 1);
  }
  bool open(size_t a, size_t i, size_t b, size_t j) const {
    return a < b ? open_[a][b][i * levels()[b].size() + j] : open_[b][a][j * levels()[a].size() + i];
  }
  void take(const Row &row) {
    for (size_t a = 0; a < kAxes; ++a)
      for (size_t b = a + 1; b < kAxes; ++b) open_[a][b][row[a] * levels()[b].size() + row[b]] = 0;
  }
  // The first one, as a row with the other axes at kNone; false: none is left.
  bool first(Row &row) const;
  static constexpr size_t kNone = size_t(-1);

 private:
  std::array<std::array<std::vector<char>, kAxes>, kAxes> open_;
};

inline bool Pairs::first(Row &row) const {
  for (size_t a = 0; a < kAxes; ++a)
    for (size_t b = a + 1; b < kAxes; ++b)
      for (size_t at = 0; at < open_[a][b].size(); ++at) {
        if (!open_[a][b][at]) continue;
        row.fill(kNone);
        row[a] = at / levels()[b].size();
        row[b] = at % levels()[b].size();
        return true;
      }
  return false;
}

// Rows that hold every pair of levels of two axes, by greed: each begins with the first pair that is open and
// takes, axis by axis, the level that closes most; of equal ones that which was taken least so far.
inline std::vector<Row> pairwise() {
  Pairs pairs;
  std::array<std::vector<size_t>, kAxes> taken;
  for (size_t a = 0; a < kAxes; ++a) taken[a].assign(levels()[a].size(), 0);
  std::vector<Row> out;
  for (Row row; pairs.first(row);) {
    // the axis with most levels is the hardest to fit
    std::array<size_t, kAxes> order{kPartner, kModel, kLaw, kCoupling, kIntegrator};
    for (const size_t a : order) {
      if (row[a] != Pairs::kNone) continue;
      size_t best = 0, most = 0;
      for (size_t i = 0; i < levels()[a].size(); ++i) {
        size_t closes = 0;
        for (size_t b = 0; b < kAxes; ++b)
          if (b != a && row[b] != Pairs::kNone) closes += pairs.open(a, i, b, row[b]);
        if (i == 0 || closes > most || (closes == most && taken[a][i] < taken[a][best])) {
          most = closes;
          best = i;
        }
      }
      row[a] = best;
    }
    pairs.take(row);
    for (size_t a = 0; a < kAxes; ++a) ++taken[a][row[a]];
    out.push_back(row);
  }
  return out;
}

}  // namespace test::cover
