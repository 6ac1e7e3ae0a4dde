// Surface nets (Gibson, Constrained elastic surface nets, MICCAI 1998) of several labels at once. The
// quadrilaterals are the voxel faces between labels, so that a surface is closed where its voxels form a
// solid; smoothing moves their corners. A vertex stays within half a voxel of its corner along each axis, and
// on the border of the volume within its plane.
//
// Smoothing is Taubin's (A signal processing approach to fair surface design, 1995, section 3.1): a step
// inward by lambda and one outward by mu leave what is longer than a few voxels. Where three labels meet,
// vertices are averaged along that line alone. Then the volumes are set right: with g_a(x) the gradient of
// the volume of label a, vertices move by sum_a p_a g_a / A, A the area around a vertex, and the pressures
// p_a are those for which every volume meets its target to first order.
#include "label_surface.h"

#include <algorithm>
#include <cmath>

#include "crossing.h"

namespace labels {
namespace {

constexpr double kReach = 0.49;  // voxels that a vertex may move along an axis
constexpr double kInward = 0.6307, kOutward = -0.6732;
constexpr int kVolumeRounds = 4;

// Solves the symmetric positive semidefinite system a x = b in place; what has no pivot stays 0.
void solve(std::vector<double> &a, std::vector<double> &b, size_t n) {
  double largest = 0;
  for (size_t i = 0; i < n; ++i) largest = std::max(largest, a[i * n + i]);
  for (size_t k = 0; k < n; ++k) {
    const double pivot = a[k * n + k];
    if (!(pivot > 1e-12 * largest)) {
      for (size_t i = 0; i < n; ++i) a[i * n + k] = a[k * n + i] = 0;
      a[k * n + k] = 1;
      b[k] = 0;
      continue;
    }
    for (size_t i = k + 1; i < n; ++i) {
      const double factor = a[i * n + k] / pivot;
      if (factor == 0) continue;
      for (size_t j = k; j < n; ++j) a[i * n + j] -= factor * a[k * n + j];
      b[i] -= factor * b[k];
    }
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t j = k + 1; j < n; ++j) b[k] -= a[k * n + j] * b[j];
    b[k] /= a[k * n + k];
  }
}

class Net {
 public:
  Net(const Volume &v, const std::vector<double> &target) : v_(v), target_(target) {
    for (size_t k = 0; k < 3; ++k) n_[k] = v.size[k];
    set_grid();
    build();
    find_neighbors();
    at_ = corner_;
  }

  Surfaces run(uint32_t passes) {
    for (uint32_t pass = 0; pass < passes; ++pass) {
      smooth(kInward);
      smooth(kOutward);
    }
    if (passes > 0)
      for (int round = 0; round < kVolumeRounds; ++round) set_volumes();
    Surfaces out;
    uncross(out);
    fill(out);
    return out;
  }

 private:
  // corners in turn, seen from the front; labels behind and in front
  struct Quad {
    uint32_t corner[4];
    uint16_t behind, front;
  };

  uint16_t label(int64_t i, int64_t j, int64_t k) const {
    const bool in = i >= 0 && j >= 0 && k >= 0 && i < n_[0] && j < n_[1] && k < n_[2];
    return in ? v_.voxel[size_t(i + n_[0] * (j + n_[1] * k))] : kOutside;
  }
  static bool between(uint16_t a, uint16_t b) {
    return a != b && !(a == 0 && b == kOutside) && !(a == kOutside && b == 0);
  }

  // Vertices and quadrilaterals layer by layer: numbers of two layers of corners are enough.
  void build() {
    const size_t row = size_t(n_[0]) + 1, layer = row * (size_t(n_[1]) + 1);
    std::vector<uint32_t> below(layer, UINT32_MAX), above(layer, UINT32_MAX);
    const auto vertex = [&](std::vector<uint32_t> &numbers, int64_t i, int64_t j, int64_t k) {
      uint32_t &number = numbers[size_t(i) + row * size_t(j)];
      if (number == UINT32_MAX) {
        number = uint32_t(corner_.size());
        corner_.push_back({double(i) - 0.5, double(j) - 0.5, double(k) - 0.5});
      }
      return number;
    };
    for (int64_t k = 0; k <= n_[2]; ++k) {
      for (int64_t j = 0; j <= n_[1]; ++j)
        for (int64_t i = 0; i <= n_[0]; ++i) {
          const uint16_t own = label(i, j, k), left = label(i - 1, j, k), front = label(i, j - 1, k),
                         under = label(i, j, k - 1);
          if (between(under, own))
            add({vertex(below, i, j, k), vertex(below, i + 1, j, k), vertex(below, i + 1, j + 1, k),
                 vertex(below, i, j + 1, k)},
                under, own);
          if (between(left, own))
            add({vertex(below, i, j, k), vertex(below, i, j + 1, k), vertex(above, i, j + 1, k + 1),
                 vertex(above, i, j, k + 1)},
                left, own);
          if (between(front, own))
            add({vertex(below, i, j, k), vertex(above, i, j, k + 1), vertex(above, i + 1, j, k + 1),
                 vertex(below, i + 1, j, k)},
                front, own);
        }
      below.swap(above);
      std::ranges::fill(above, UINT32_MAX);
    }
  }
  void add(const std::array<uint32_t, 4> &c, uint16_t behind, uint16_t front) {
    quads_.push_back({{c[0], c[1], c[2], c[3]}, behind, front});
  }

  // Neighbors along edges; where three or more labels meet, along edges where as many do.
  void find_neighbors() {
    struct Side {
      uint32_t a, b;
      uint16_t labels[2];
    };
    std::vector<Side> sides;
    sides.reserve(4 * quads_.size());
    for (const Quad &q : quads_)
      for (int c = 0; c < 4; ++c) {
        const uint32_t a = q.corner[c], b = q.corner[(c + 1) & 3];
        sides.push_back({std::min(a, b), std::max(a, b), {q.behind, q.front}});
      }
    std::ranges::sort(sides, [](const Side &s, const Side &t) { return s.a != t.a ? s.a < t.a : s.b < t.b; });
    struct Edge {
      uint32_t a, b;
      bool line;  // three labels or more
    };
    std::vector<Edge> edges;
    std::vector<uint32_t> lines(corner_.size(), 0);
    for (size_t i = 0; i < sides.size();) {
      Edge e = {sides[i].a, sides[i].b, false};
      const uint16_t one = sides[i].labels[0], other = sides[i].labels[1];
      for (; i < sides.size() && sides[i].a == e.a && sides[i].b == e.b; ++i)
        for (const uint16_t l : sides[i].labels) e.line = e.line || (l != one && l != other);
      if (e.line) {
        ++lines[e.a];
        ++lines[e.b];
      }
      edges.push_back(e);
    }
    const auto takes = [&](uint32_t vertex, const Edge &e) {
      return lines[vertex] == 0 || (lines[vertex] > 1 && e.line);  // the end of a line stays
    };
    first_.assign(corner_.size() + 1, 0);
    for (const Edge &e : edges) {
      first_[e.a + 1] += takes(e.a, e);
      first_[e.b + 1] += takes(e.b, e);
    }
    for (size_t v = 0; v < corner_.size(); ++v) first_[v + 1] += first_[v];
    neighbor_.resize(first_.back());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (const Edge &e : edges) {
      if (takes(e.a, e)) neighbor_[next[e.a]++] = e.b;
      if (takes(e.b, e)) neighbor_[next[e.b]++] = e.a;
    }
  }

  // Within reach of its corner; what lies on the border of the volume stays there.
  void place(uint32_t vertex, const double to[3]) {
    for (int k = 0; k < 3; ++k) {
      const double c = corner_[vertex][k];
      const bool on_border = c < 0 || c > double(n_[k]) - 1;
      at_[vertex][k] = on_border ? c : std::min(std::max(to[k], c - kReach), c + kReach);
    }
  }

  void smooth(double weight) {
    const std::vector<Vec> old = at_;
    for (uint32_t v = 0; v < corner_.size(); ++v) {
      const uint32_t n = first_[v + 1] - first_[v];
      if (n == 0) continue;
      double to[3];
      for (int k = 0; k < 3; ++k) {
        double sum = 0;
        for (uint32_t e = first_[v]; e < first_[v + 1]; ++e) sum += old[neighbor_[e]][k];
        to[k] = old[v][k] + weight * (sum / n - old[v][k]);
      }
      place(v, to);
    }
  }

  // m, relative to the first voxel: smaller numbers lose fewer digits in volumes
  Vec meters(const Vec &p) const {
    Vec out{};
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c) out[c] += p[k] * v_.axis[k][c];
    return out;
  }

  // The shorter diagonal divides a quadrilateral, of equal ones the first, whatever side is considered.
  bool first_diagonal(const Quad &q) const {
    const Vec d0 = meters(at_[q.corner[2]] - at_[q.corner[0]]),
              d1 = meters(at_[q.corner[3]] - at_[q.corner[1]]);
    return dot(d0, d0) <= dot(d1, d1);
  }
  // Corners of its triangles, counter-clockwise seen from the front also where the axes are left-handed.
  void triangles(const Quad &q, uint32_t out[2][3]) const {
    const int s = first_diagonal(q) ? 0 : 1;
    const uint32_t c[4] = {q.corner[s], q.corner[s + 1], q.corner[s + 2], q.corner[(s + 3) & 3]};
    const bool turned = v_.cell() < 0;
    const uint32_t plain[2][3] = {{c[0], c[1], c[2]}, {c[0], c[2], c[3]}};
    for (int t = 0; t < 2; ++t)
      for (int i = 0; i < 3; ++i) out[t][i] = plain[t][turned ? 2 - i : i];
  }

  std::vector<double> volumes() const {
    std::vector<double> out(v_.value.size(), 0.0);
    for (const Quad &q : quads_) {
      uint32_t t[2][3];
      triangles(q, t);
      for (const auto &c : t) {
        const double six = dot(meters(at_[c[0]]), cross(meters(at_[c[1]]), meters(at_[c[2]])));
        if (q.behind != kOutside) out[q.behind] += six / 6;
        if (q.front != kOutside) out[q.front] -= six / 6;
      }
    }
    return out;
  }

  void set_volumes() {
    struct Pull {
      uint32_t vertex;
      uint16_t label;
      Vec gradient;
    };
    const size_t nlabel = v_.value.size();
    std::vector<Pull> pulls;
    std::vector<double> area(corner_.size(), 0.0);
    for (const Quad &q : quads_) {
      if (q.behind == kOutside || q.front == kOutside) continue;  // planes of the border
      uint32_t t[2][3];
      triangles(q, t);
      for (const auto &c : t) {
        const Vec a = meters(at_[c[0]]), b = meters(at_[c[1]]), d = meters(at_[c[2]]);
        Vec normal = cross(b - a, d - a);
        const double size = std::sqrt(dot(normal, normal));
        for (double &x : normal) x /= 6;  // a third of the triangle's area, to each corner
        for (const uint32_t v : c) {
          area[v] += size / 6;
          pulls.push_back({v, q.behind, normal});
          for (double &x : normal) x = -x;
          pulls.push_back({v, q.front, normal});
          for (double &x : normal) x = -x;
        }
      }
    }
    std::ranges::stable_sort(pulls, [](const Pull &a, const Pull &b) {
      return a.vertex != b.vertex ? a.vertex < b.vertex : a.label < b.label;
    });
    size_t n = 0;
    for (size_t i = 0; i < pulls.size(); ++i) {
      if (n > 0 && pulls[n - 1].vertex == pulls[i].vertex && pulls[n - 1].label == pulls[i].label)
        for (int k = 0; k < 3; ++k) pulls[n - 1].gradient[k] += pulls[i].gradient[k];
      else pulls[n++] = pulls[i];
    }
    pulls.resize(n);
    std::vector<double> matrix(nlabel * nlabel, 0.0), pressure(nlabel, 0.0);
    const std::vector<double> now = volumes();
    for (size_t l = 1; l < nlabel; ++l) pressure[l] = target_[l] - now[l];
    for (size_t begin = 0, end; begin < n; begin = end) {
      for (end = begin; end < n && pulls[end].vertex == pulls[begin].vertex; ++end) {}
      for (size_t i = begin; i < end; ++i)
        for (size_t j = begin; j < end; ++j)
          if (pulls[i].label != 0 && pulls[j].label != 0)
            matrix[pulls[i].label * nlabel + pulls[j].label] +=
                dot(pulls[i].gradient, pulls[j].gradient) / area[pulls[i].vertex];
    }
    solve(matrix, pressure, nlabel);
    pressure[0] = 0;
    const std::array<Vec, 3> inverse = v_.inverse();
    for (size_t begin = 0, end; begin < n; begin = end) {
      Vec step{};
      for (end = begin; end < n && pulls[end].vertex == pulls[begin].vertex; ++end)
        for (int k = 0; k < 3; ++k)
          step[k] += pressure[pulls[end].label] * pulls[end].gradient[k] / area[pulls[end].vertex];
      const uint32_t v = pulls[begin].vertex;
      double to[3];
      for (size_t k = 0; k < 3; ++k) to[k] = at_[v][k] + dot(inverse[k], step);
      place(v, to);
    }
  }

  // ---- nothing may cross ----

  // Coordinates are decimals of a ten thousandth of a voxel, so that files are half as long. They are rounded
  // before crossings are looked for.
  void set_grid() {
    double least = INFINITY;
    for (const auto &axis : v_.axis)
      least = std::min(least, std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]));
    for (int digits = 0; digits < 15 && per_meter_ * least < 1e4; ++digits) per_meter_ *= 10;
  }
  Vec world(uint32_t vertex) const {
    Vec out = meters(at_[vertex]);
    for (int k = 0; k < 3; ++k) out[k] = std::round((out[k] + v_.origin[k]) * per_meter_) / per_meter_;
    return out;
  }

  // Whether two triangles share more than the corners that are one vertex of both.
  bool in_each_other(const uint32_t a[3], const uint32_t b[3]) const {
    const double *pa[3], *pb[3];
    int shared_a[3], shared_b[3], n = 0;
    for (int i = 0; i < 3; ++i) {
      pa[i] = world_[a[i]].data();
      pb[i] = world_[b[i]].data();
      for (int j = 0; j < 3; ++j)
        if (a[i] == b[j]) {
          shared_a[n] = i;
          shared_b[n++] = j;
        }
    }
    if (n == 0) return crossing::meet(pa, pb);
    if (n == 1) {  // the edge across from the shared corner reaches the other triangle
      const double *ea[3] = {pa[(shared_a[0] + 1) % 3], pa[(shared_a[0] + 2) % 3], pa[(shared_a[0] + 2) % 3]};
      const double *eb[3] = {pb[(shared_b[0] + 1) % 3], pb[(shared_b[0] + 2) % 3], pb[(shared_b[0] + 2) % 3]};
      return crossing::meet(ea, pb) || crossing::meet(eb, pa);
    }
    if (n == 3) return true;
    // folded flat onto each other: in one plane, on one side of the shared edge
    const int ra = 3 - shared_a[0] - shared_a[1], rb = 3 - shared_b[0] - shared_b[1];
    const double *p = pa[shared_a[0]], *q = pa[shared_a[1]];
    if (crossing::orientation(p, q, pa[ra], pb[rb]) != 0) return false;
    for (int u = 0; u < 3; ++u) {
      const int w = (u + 1) % 3, s = crossing::orientation(p, q, pa[ra], u, w);
      if (s != 0) return s == crossing::orientation(p, q, pb[rb], u, w);
    }
    return true;  // no area
  }

  // Numbers of the quadrilaterals whose triangles reach into each other. They lie at most two voxels apart.
  std::vector<uint32_t> crossing_quads(size_t &pairs) {
    world_.resize(at_.size());
    for (uint32_t v = 0; v < at_.size(); ++v) world_[v] = world(v);
    struct Entry {
      uint64_t key;
      uint32_t quad;
    };
    const auto key = [](int64_t i, int64_t j, int64_t k) {
      return (uint64_t(k + 8) << 40) | (uint64_t(j + 8) << 20) | uint64_t(i + 8);
    };
    std::vector<Entry> entries;
    const auto corner = [&](uint32_t q, int k) {
      const uint32_t *c = quads_[q].corner;
      double least = corner_[c[0]][k];
      for (int i = 1; i < 4; ++i) least = std::min(least, corner_[c[i]][k]);
      return int64_t(least + 0.75);
    };
    for (uint32_t q = 0; q < quads_.size(); ++q)
      entries.push_back({key(corner(q, 0), corner(q, 1), corner(q, 2)), q});
    std::ranges::sort(entries, [](const Entry &a, const Entry &b) {
      return a.key != b.key ? a.key < b.key : a.quad < b.quad;
    });
    std::vector<uint8_t> found(quads_.size(), 0);
    pairs = 0;
    const auto test = [&](uint32_t q, uint32_t r) {
      uint32_t a[2][3], b[2][3];
      triangles(quads_[q], a);
      triangles(quads_[r], b);
      for (const auto &s : a)
        for (const auto &t : b)
          if (boxes_meet(s, t) && in_each_other(s, t)) {
            ++pairs;
            found[q] = found[r] = 1;
          }
    };
    for (uint32_t q = 0; q < quads_.size(); ++q) {
      uint32_t t[2][3];
      triangles(quads_[q], t);
      if (in_each_other(t[0], t[1])) {
        ++pairs;
        found[q] = 1;
      }
      for (int64_t k = -2; k <= 2; ++k)
        for (int64_t j = -2; j <= 2; ++j) {
          const int64_t i = corner(q, 0), y = corner(q, 1) + j, z = corner(q, 2) + k;
          auto e = std::ranges::lower_bound(entries, key(i - 2, y, z), {}, &Entry::key);
          for (; e != entries.end() && e->key <= key(i + 2, y, z); ++e)
            if (e->quad > q) test(q, e->quad);
        }
    }
    std::vector<uint32_t> out;
    for (uint32_t q = 0; q < quads_.size(); ++q)
      if (found[q]) out.push_back(q);
    return out;
  }
  bool boxes_meet(const uint32_t a[3], const uint32_t b[3]) const {
    for (int k = 0; k < 3; ++k) {
      const double a0 = world_[a[0]][k], a1 = world_[a[1]][k], a2 = world_[a[2]][k];
      const double b0 = world_[b[0]][k], b1 = world_[b[1]][k], b2 = world_[b[2]][k];
      if (std::max({a0, a1, a2}) < std::min({b0, b1, b2}) || std::max({b0, b1, b2}) < std::min({a0, a1, a2}))
        return false;
    }
    return true;
  }

  // Vertices of crossing triangles go halfway back, the sixth time all the way: voxel faces never cross.
  void uncross(Surfaces &out) {
    std::vector<uint8_t> times(corner_.size(), 0);
    for (int round = 0; round < 200; ++round) {
      const std::vector<uint32_t> crossing = crossing_quads(out.crossing);
      if (crossing.empty()) break;
      std::vector<uint8_t> moves(corner_.size(), 0);
      for (const uint32_t q : crossing)
        for (const uint32_t v : quads_[q].corner) moves[v] = 1;
      for (uint32_t v = 0; v < corner_.size(); ++v) {
        if (!moves[v]) continue;
        const double keep = ++times[v] < 6 ? 0.5 : 0;
        for (int k = 0; k < 3; ++k) at_[v][k] = corner_[v][k] + keep * (at_[v][k] - corner_[v][k]);
        times[v] = std::min<uint8_t>(times[v], 100);
      }
    }
    for (const uint8_t t : times) out.restored += t > 0;
  }

  void fill(Surfaces &out) const {
    out.volume = volumes();
    out.volume[0] = 0;
    for (const Vec &p : world_) out.points.insert(out.points.end(), p.begin(), p.end());
    for (const Quad &q : quads_) {
      uint32_t t[2][3];
      triangles(q, t);
      for (const auto &c : t) {
        out.triangles.insert(out.triangles.end(), c, c + 3);
        out.sides.push_back({q.behind, q.front});
      }
    }
  }

  const Volume &v_;
  const std::vector<double> &target_;
  int64_t n_[3];
  double per_meter_ = 1;                  // steps of the decimals of coordinates
  std::vector<Vec> corner_, at_, world_;  // voxels, voxels, m
  std::vector<Quad> quads_;
  std::vector<uint32_t> first_, neighbor_;
};

}  // namespace

Surfaces surfaces_of(const Volume &volume, const std::vector<double> &target, uint32_t passes) {
  return Net(volume, target).run(passes);
}

Shell shell_of(const Surfaces &s, const std::vector<bool> &inside) {
  Shell out;
  const auto in = [&](uint16_t label) { return label != kOutside && inside[label]; };
  std::vector<uint32_t> number(s.points.size() / 3, UINT32_MAX);
  for (size_t t = 0; t < s.sides.size(); ++t) {
    const bool behind = in(s.sides[t][0]), front = in(s.sides[t][1]);
    if (behind == front) continue;
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t v = s.triangles[3 * t + (behind ? i : 2 - i)];
      if (number[v] == UINT32_MAX) {
        number[v] = uint32_t(out.from.size());
        out.from.push_back(v);
        out.points.insert(out.points.end(), &s.points[3 * size_t(v)], &s.points[3 * size_t(v)] + 3);
      }
      out.triangles.push_back(number[v]);
    }
    out.beyond.push_back(s.sides[t][behind ? 1 : 0]);
  }
  // an edge and its reverse, once each
  std::vector<std::array<uint32_t, 3>> edges;
  for (size_t t = 0; t < out.beyond.size(); ++t)
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = out.triangles[3 * t + i], b = out.triangles[3 * t + (i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b});
    }
  std::ranges::sort(edges);
  for (size_t i = 0, n; i < edges.size(); i += n) {
    for (n = 1; i + n < edges.size() && edges[i + n][0] == edges[i][0] && edges[i + n][1] == edges[i][1];
         ++n) {}
    out.open_edges += n != 2 || edges[i][2] == edges[i + 1][2];
  }
  if (!out.points.empty()) {
    const Vec o = at(out.points, 0);
    for (size_t t = 0; t < out.beyond.size(); ++t) {
      Vec p[3];
      for (size_t i = 0; i < 3; ++i) p[i] = at(out.points, out.triangles[3 * t + i]);
      out.volume += dot(p[0] - o, cross(p[1] - o, p[2] - o)) / 6;
    }
  }
  return out;
}

}  // namespace labels
