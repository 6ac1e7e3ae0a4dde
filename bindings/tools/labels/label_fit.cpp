#include "label_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace labels {
namespace {

constexpr double kMinQuality = 0.3;  // mean ratio below which no point is moved
constexpr int kRounds = 8;           // over all points; the last ones change little
constexpr int kPasses = 4;           // that restore the volume
constexpr uint32_t kNone = ~uint32_t(0);

// Ericson, Real-Time Collision Detection, 5.1.5: the regions of the plane around a triangle in turn.
Vec closest_of(const Vec &p, const Vec &a, const Vec &b, const Vec &c) {
  const Vec ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return a;
  if (d3 >= 0 && d4 <= d3) return b;
  if (d6 >= 0 && d5 <= d6) return c;
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b);
  const double all = va + vb + vc;
  return a + vb / all * ab + vc / all * ac;
}

// Triangles of a shell by the cubes of a grid that their boxes meet.
class Near {
 public:
  Near(const Shell &shell, double size) : shell_(shell), size_(size) {
    for (uint32_t t = 0; t < shell.beyond.size(); ++t) {
      Vec lo = corner(t, 0), hi = lo;
      for (size_t i = 1; i < 3; ++i)
        for (size_t k = 0; k < 3; ++k) {
          lo[k] = std::min(lo[k], corner(t, i)[k]);
          hi[k] = std::max(hi[k], corner(t, i)[k]);
        }
      const Key a = key(lo), b = key(hi);
      for (int64_t i = a[0]; i <= b[0]; ++i)
        for (int64_t j = a[1]; j <= b[1]; ++j)
          for (int64_t k = a[2]; k <= b[2]; ++k) cubes_[{i, j, k}].push_back(t);
    }
  }
  // Nearest point of the shell; `triangle` may be null. Cubes are searched outward until none can be nearer.
  Vec closest(const Vec &p, uint32_t *triangle) const {
    const Key c = key(p);
    Vec best = p;
    double least = std::numeric_limits<double>::infinity();
    for (int64_t reach = 0; reach < kMaxCubes; ++reach) {
      if (const double apart = double(reach - 1) * size_; apart > 0 && apart * apart > least) break;
      for (int64_t i = -reach; i <= reach; ++i)
        for (int64_t j = -reach; j <= reach; ++j)
          for (int64_t k = -reach; k <= reach; ++k) {
            if (std::max({std::abs(i), std::abs(j), std::abs(k)}) != reach) continue;
            const auto cube = cubes_.find({c[0] + i, c[1] + j, c[2] + k});
            if (cube == cubes_.end()) continue;
            for (const uint32_t t : cube->second) {
              const Vec q = closest_of(p, corner(t, 0), corner(t, 1), corner(t, 2)), d = q - p;
              if (dot(d, d) >= least) continue;
              least = dot(d, d);
              best = q;
              if (triangle) *triangle = t;
            }
          }
    }
    return best;
  }

 private:
  using Key = std::array<int64_t, 3>;
  static constexpr int64_t kMaxCubes = 16;  // a point of a cell that is half inside is nearer than two
  Vec corner(uint32_t t, size_t i) const { return at(shell_.points, shell_.triangles[3 * size_t(t) + i]); }
  Key key(const Vec &p) const {
    Key out;
    for (size_t k = 0; k < 3; ++k) out[k] = int64_t(std::floor(p[k] / size_));
    return out;
  }
  const Shell &shell_;
  double size_;
  std::map<Key, std::vector<uint32_t>> cubes_;
};

using Tet = std::array<uint32_t, 4>;
constexpr size_t kFace[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};  // outward

// The faces that one cell only has: [cell, face], in the order of the cells.
std::vector<std::array<uint32_t, 2>> outer_faces(const std::vector<Tet> &cells) {
  std::map<std::array<uint32_t, 3>, uint32_t> count;
  const auto face = [&](uint32_t c, uint32_t f) {
    std::array<uint32_t, 3> v = {cells[c][kFace[f][0]], cells[c][kFace[f][1]], cells[c][kFace[f][2]]};
    std::ranges::sort(v);
    return v;
  };
  for (uint32_t c = 0; c < cells.size(); ++c)
    for (uint32_t f = 0; f < 4; ++f) ++count[face(c, f)];
  std::vector<std::array<uint32_t, 2>> out;
  for (uint32_t c = 0; c < cells.size(); ++c)
    for (uint32_t f = 0; f < 4; ++f)
      if (count[face(c, f)] == 1) out.push_back({c, f});
  return out;
}

// Without cells that hang on by one face or less: they would be spikes.
void drop_spikes(std::vector<Tet> &cells) {
  for (bool more = true; more;) {
    std::vector<uint32_t> free_faces(cells.size(), 0);
    for (const auto &[c, f] : outer_faces(cells)) ++free_faces[c];
    std::vector<Tet> left;
    for (size_t c = 0; c < cells.size(); ++c)
      if (free_faces[c] < 3) left.push_back(cells[c]);
    more = left.size() < cells.size();
    cells.swap(left);
  }
}

class Fit {
 public:
  Fit(const Shell &shell, const std::vector<double> &points, std::vector<Tet> cells, double edge)
      : near_(shell, edge), cells_(std::move(cells)) {
    std::vector<uint32_t> number(points.size() / 3, kNone);
    for (Tet &cell : cells_)
      for (uint32_t &v : cell) {
        if (number[v] == kNone) {
          number[v] = uint32_t(x_.size());
          x_.push_back(at(points, v));
        }
        v = number[v];
      }
    outer_ = outer_faces(cells_);
    of_point_.resize(x_.size());
    beside_.resize(x_.size());
    on_.resize(x_.size(), false);
    for (uint32_t c = 0; c < cells_.size(); ++c)
      for (const uint32_t v : cells_[c]) of_point_[v].push_back(c);
    for (const auto &[c, f] : outer_)
      for (size_t i = 0; i < 3; ++i) {
        const uint32_t v = cells_[c][kFace[f][i]];
        on_[v] = true;
        for (const size_t j : {(i + 1) % 3, (i + 2) % 3}) beside_[v].push_back(cells_[c][kFace[f][j]]);
      }
  }

  Fitted run(double volume) {
    for (int round = 0; round < kRounds; ++round)
      for (uint32_t v = 0; v < x_.size(); ++v) on_[v] ? move_outer(v) : move_inner(v);
    for (int pass = 0; pass < kPasses; ++pass) restore(volume);
    Fitted out;
    for (const Vec &x : x_) out.points.insert(out.points.end(), x.begin(), x.end());
    out.quality_min = 1;
    for (const Tet &cell : cells_) {
      out.tets.insert(out.tets.end(), cell.begin(), cell.end());
      out.quality_min = std::min(out.quality_min, quality(cell));
      out.quality_mean += quality(cell) / double(cells_.size());
    }
    for (const auto &[c, f] : outer_) {
      Vec middle = {0, 0, 0};
      for (size_t i = 0; i < 3; ++i) {
        out.faces.push_back(cells_[c][kFace[f][i]]);
        middle = middle + 1.0 / 3 * x_[out.faces.back()];
      }
      out.under.push_back(0);
      near_.closest(middle, &out.under.back());
    }
    for (uint32_t v = 0; v < x_.size(); ++v)
      if (on_[v]) {
        const Vec d = near_.closest(x_[v], nullptr) - x_[v];
        out.farthest = std::max(out.farthest, std::sqrt(dot(d, d)));
      }
    return out;
  }

 private:
  double quality(const Tet &cell) const {
    const Vec &a = x_[cell[0]], &b = x_[cell[1]], &c = x_[cell[2]], &d = x_[cell[3]];
    const double six = dot(cross(b - a, c - a), d - a);
    double sum = 0;
    for (const Vec &e : {b - a, c - a, d - a, c - b, d - b, d - c}) sum += dot(e, e);
    return six <= 0 ? 0.0 : 12 * std::cbrt(0.25 * six * six) / sum;  // 12 (3 V)^(2/3) / sum of squares
  }
  double worst(uint32_t v) const {
    double out = 1;
    for (const uint32_t c : of_point_[v]) out = std::min(out, quality(cells_[c]));
    return out;
  }
  // Moves the point if its worst cell is then good enough.
  bool moved(uint32_t v, const Vec &to, double enough) {
    const Vec old = x_[v];
    x_[v] = to;
    if (worst(v) >= enough) return true;
    x_[v] = old;
    return false;
  }
  // Onto the shell: between its neighbors, else the shortest way, else a part of it.
  void move_outer(uint32_t v) {
    Vec mean = {0, 0, 0};
    for (const uint32_t w : beside_[v]) mean = mean + 1.0 / double(beside_[v].size()) * x_[w];
    if (moved(v, near_.closest(0.5 * (x_[v] + mean), nullptr), kMinQuality)) return;
    const Vec way = near_.closest(x_[v], nullptr) - x_[v];
    for (const double part : {1.0, 0.5, 0.25})
      if (moved(v, x_[v] + part * way, kMinQuality)) return;
  }
  // Chords of a round surface lie inside it: all points go outward by what the volume lacks over the area.
  void restore(double volume) {
    std::vector<Vec> normal(x_.size(), Vec{0, 0, 0});
    double area = 0, held = 0;
    for (const auto &[c, f] : outer_) {
      const uint32_t v[3] = {cells_[c][kFace[f][0]], cells_[c][kFace[f][1]], cells_[c][kFace[f][2]]};
      const Vec n = 0.5 * cross(x_[v[1]] - x_[v[0]], x_[v[2]] - x_[v[0]]);
      area += std::sqrt(dot(n, n));
      held += dot(n, x_[v[0]]) / 3;
      for (const uint32_t i : v) normal[i] = normal[i] + n;
    }
    for (uint32_t v = 0; v < x_.size(); ++v)
      if (const double size = std::sqrt(dot(normal[v], normal[v])); on_[v] && size > 0)
        moved(v, x_[v] + (volume - held) / (area * size) * normal[v], kMinQuality);
  }
  // To the middle of its cells' points where that makes the worst of its cells better.
  void move_inner(uint32_t v) {
    Vec mean = {0, 0, 0};
    for (const uint32_t c : of_point_[v])
      for (const uint32_t w : cells_[c])
        if (w != v) mean = mean + 1.0 / (3 * double(of_point_[v].size())) * x_[w];
    moved(v, mean, worst(v));
  }

  Near near_;
  std::vector<Vec> x_;
  std::vector<Tet> cells_;
  std::vector<std::array<uint32_t, 2>> outer_;
  std::vector<std::vector<uint32_t>> of_point_, beside_;  // cells; neighbors on the boundary
  std::vector<bool> on_;                                  // the boundary
};

}  // namespace

Fitted fit_cells(const Shell &shell, const std::vector<double> &points, const std::vector<uint32_t> &tets,
                 const std::vector<double> &share, double edge) {
  std::vector<Tet> cells;
  for (size_t c = 0; c < share.size(); ++c)
    if (share[c] >= 0.5) cells.push_back({tets[4 * c], tets[4 * c + 1], tets[4 * c + 2], tets[4 * c + 3]});
  drop_spikes(cells);
  if (cells.empty()) return {};
  return Fit(shell, points, std::move(cells), edge).run(shell.volume);
}

}  // namespace labels
