// Two closed triangles share a point if and only if an edge of one meets the other. Edge against triangle
// needs signs of volumes only; coplanar cases drop one axis and need signs of areas. All signs are exact, so
// there is no tolerance to choose: they are taken from floating point where Shewchuk's error bound allows
// (Adaptive precision floating-point arithmetic, 1997, section 4.3), else from floating-point expansions
// (his theorem 10).
#include "crossing.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace crossing {
namespace {

constexpr double kEps = 0x1p-53;

// A sum of doubles, exactly: components do not overlap and rise in magnitude, so the last one has the
// sign of the whole.
class Expansion {
 public:
  Expansion() = default;
  void add(double b) {  // grow-expansion with zeros left out
    int n = 0;
    double q = b;
    for (int i = 0; i < n_; ++i) {
      const double sum = q + e_[i], v = sum - q, error = (q - (sum - v)) + (e_[i] - v);
      if (error != 0) e_[n++] = error;
      q = sum;
    }
    if (q != 0) e_[n++] = q;
    n_ = n;
  }
  void add_product(double a, double b) {
    const double p = a * b, sa = 134217729.0 * a, sb = 134217729.0 * b;
    const double ah = sa - (sa - a), al = a - ah, bh = sb - (sb - b), bl = b - bh;
    add(al * bl - (((p - ah * bh) - al * bh) - ah * bl));
    add(p);
  }
  void add_product(const Expansion &a, const Expansion &b, double sign) {
    for (int i = 0; i < a.n_; ++i)
      for (int j = 0; j < b.n_; ++j) add_product(sign * a.e_[i], b.e_[j]);
  }
  static Expansion difference(double a, double b) {
    Expansion d;
    d.add(a);
    d.add(-b);
    return d;
  }
  int sign() const { return n_ == 0 ? 0 : e_[n_ - 1] > 0 ? 1 : -1; }

 private:
  int n_ = 0;
  double e_[192];  // three minors of 16 components times a difference of 2, doubled by each product
};

int sign_of(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

int exact_volume(const double a[3], const double b[3], const double c[3], const double d[3]) {
  Expansion m[3][3];
  const double *rows[3] = {a, b, c};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) m[i][k] = Expansion::difference(rows[i][k], d[k]);
  Expansion sum;
  for (int k = 0; k < 3; ++k) {
    const int u = (k + 1) % 3, v = (k + 2) % 3;
    Expansion minor;
    minor.add_product(m[1][u], m[2][v], 1);
    minor.add_product(m[1][v], m[2][u], -1);
    sum.add_product(m[0][k], minor, 1);
  }
  return sum.sign();
}

}  // namespace

int orientation(const double a[3], const double b[3], const double c[3], const double d[3]) {
  const double ax = a[0] - d[0];
  const double ay = a[1] - d[1];
  const double az = a[2] - d[2];
  const double bx = b[0] - d[0];
  const double by = b[1] - d[1];
  const double bz = b[2] - d[2];
  const double cx = c[0] - d[0], cy = c[1] - d[1], cz = c[2] - d[2];
  const double bcx = by * cz, cbx = bz * cy, bcy = bz * cx, cby = bx * cz, bcz = bx * cy, cbz = by * cx;
  const double det = ax * (bcx - cbx) + ay * (bcy - cby) + az * (bcz - cbz);
  const double permanent = std::fabs(ax) * (std::fabs(bcx) + std::fabs(cbx)) +
                           std::fabs(ay) * (std::fabs(bcy) + std::fabs(cby)) +
                           std::fabs(az) * (std::fabs(bcz) + std::fabs(cbz));
  const double bound = (7 + 56 * kEps) * kEps * permanent;
  // Below this the products may have lost bits to underflow, which the bound does not know.
  if (std::fabs(det) > bound && permanent > 1e-250) return sign_of(det);
  return exact_volume(a, b, c, d);
}

int orientation(const double a[3], const double b[3], const double c[3], int u, int v) {
  const double left = (a[u] - c[u]) * (b[v] - c[v]), right = (a[v] - c[v]) * (b[u] - c[u]);
  const double det = left - right, size = std::fabs(left) + std::fabs(right);
  if (std::fabs(det) > (3 + 16 * kEps) * kEps * size && size > 1e-250) return sign_of(det);
  Expansion sum;
  sum.add_product(Expansion::difference(a[u], c[u]), Expansion::difference(b[v], c[v]), 1);
  sum.add_product(Expansion::difference(a[v], c[v]), Expansion::difference(b[u], c[u]), -1);
  return sum.sign();
}

namespace {

// p is known to be collinear with a, b
bool on_segment(const double a[3], const double b[3], const double p[3], int u, int v) {
  return std::min(a[u], b[u]) <= p[u] && p[u] <= std::max(a[u], b[u]) && std::min(a[v], b[v]) <= p[v] &&
         p[v] <= std::max(a[v], b[v]);
}

bool segments_meet(const double a[3], const double b[3], const double c[3], const double d[3], int u, int v) {
  const int sc = orientation(a, b, c, u, v), sd = orientation(a, b, d, u, v);
  const int sa = orientation(c, d, a, u, v), sb = orientation(c, d, b, u, v);
  if (sc * sd < 0 && sa * sb < 0) return true;
  return (sc == 0 && on_segment(a, b, c, u, v)) || (sd == 0 && on_segment(a, b, d, u, v)) ||
         (sa == 0 && on_segment(c, d, a, u, v)) || (sb == 0 && on_segment(c, d, b, u, v));
}

// Segment and triangle in one plane.
bool coplanar_meet(const Triangle t, const double p[3], const double q[3]) {
  for (int drop = 0; drop < 3; ++drop) {
    const int u = (drop + 1) % 3, v = (drop + 2) % 3, turn = orientation(t[0], t[1], t[2], u, v);
    if (turn == 0) continue;
    bool inside = true;
    for (int i = 0; i < 3; ++i) inside = inside && orientation(t[i], t[(i + 1) % 3], p, u, v) * turn >= 0;
    if (inside) return true;
    for (int i = 0; i < 3; ++i)
      if (segments_meet(t[i], t[(i + 1) % 3], p, q, u, v)) return true;
    return false;
  }
  return false;  // no area: the other triangle is tested against this one's edges
}

bool segment_meets(const Triangle t, const double p[3], int side_p, const double q[3], int side_q) {
  if (side_p * side_q > 0) return false;
  if (side_p == 0 && side_q == 0) return coplanar_meet(t, p, q);
  bool positive = false, negative = false;
  for (int i = 0; i < 3; ++i) {
    const int s = orientation(p, q, t[i], t[(i + 1) % 3]);
    positive = positive || s > 0;
    negative = negative || s < 0;
  }
  return !(positive && negative);
}

struct Sides {
  int a[3], b[3];  // of a's corners about b's plane, and the reverse
  static bool apart(const int s[3]) { return s[0] == s[1] && s[1] == s[2] && s[0] != 0; }
  static bool both(const int s[3]) {
    return (s[0] > 0 || s[1] > 0 || s[2] > 0) && (s[0] < 0 || s[1] < 0 || s[2] < 0);
  }
};

bool meet(const Triangle a, const Triangle b, Sides &sides) {
  for (int i = 0; i < 3; ++i) sides.b[i] = orientation(a[0], a[1], a[2], b[i]);
  if (Sides::apart(sides.b)) return false;
  for (int i = 0; i < 3; ++i) sides.a[i] = orientation(b[0], b[1], b[2], a[i]);
  if (Sides::apart(sides.a)) return false;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (segment_meets(a, b[i], sides.b[i], b[j], sides.b[j]) ||
        segment_meets(b, a[i], sides.a[i], a[j], sides.a[j]))
      return true;
  }
  return false;
}

}  // namespace

namespace {

// Turns a triangle so that the corner alone on its side of the other's plane comes first; returns that side.
int first_alone(const Triangle t, const int sides[3], const double *out[3]) {
  const int positive = (sides[0] > 0) + (sides[1] > 0) + (sides[2] > 0), side = positive == 1 ? 1 : -1;
  int first = 0;
  while (sides[first] != side) ++first;
  for (int i = 0; i < 3; ++i) out[i] = t[(first + i) % 3];
  return side;
}

}  // namespace

bool meet(const Triangle a, const Triangle b) {
  Sides sides;
  return meet(a, b, sides);
}

// Both triangles cut the common line of their planes in intervals; they pass through each other where these
// overlap by more than a point. Order of the ends by two signs (Devillers and Guigue, Faster
// triangle-triangle intersection tests, 2002, section 4), once each triangle begins with the corner that is
// alone on its side, and that side is the positive one.
bool pass_through(const Triangle a, const Triangle b) {
  Sides sides;
  if (!meet(a, b, sides) || !Sides::both(sides.a) || !Sides::both(sides.b)) return false;
  const double *p[3], *q[3];
  const int above_p = first_alone(a, sides.a, p), above_q = first_alone(b, sides.b, q);
  if (above_p < 0) std::swap(q[1], q[2]);  // turns b's plane over
  if (above_q < 0) std::swap(p[1], p[2]);
  return orientation(p[0], p[1], q[0], q[1]) < 0 && orientation(p[0], p[2], q[2], q[0]) < 0;
}

namespace {

struct Vec { double x, y, z; };
Vec between(const double a[3], const double b[3]) { return {b[0] - a[0], b[1] - a[1], b[2] - a[2]}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double size(Vec a) { return std::sqrt(dot(a, a)); }

double edges_through(const Triangle from, const Triangle to) {
  const Vec up = cross(between(to[0], to[1]), between(to[0], to[2]));
  const double area = size(up);
  double most = -1;
  if (!(area > 0)) return most;
  double side[3];
  for (int i = 0; i < 3; ++i) side[i] = dot(up, between(to[0], from[i])) / area;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (!(side[i] * side[j] < 0)) continue;
    const double at = side[i] / (side[i] - side[j]);
    double p[3], least = std::min(std::fabs(side[i]), std::fabs(side[j]));
    for (int k = 0; k < 3; ++k) p[k] = from[i][k] + at * (from[j][k] - from[i][k]);
    for (int k = 0; k < 3; ++k) {
      const Vec edge = between(to[k], to[(k + 1) % 3]);
      least = std::min(least, dot(cross(edge, between(to[k], p)), up) / (size(edge) * area));
    }
    most = std::max(most, least);
  }
  return most;
}

double longest_edge(const Triangle t) {
  return std::max({size(between(t[0], t[1])), size(between(t[1], t[2])), size(between(t[2], t[0]))});
}

}  // namespace

double depth(const Triangle a, const Triangle b) {
  return std::max(edges_through(a, b), edges_through(b, a));
}

// ---- which pairs to test: a box tree over all triangles, median split -------------------------------------

Found Counter::count(const std::vector<Surface> &surfaces, Touching touching,
                     const std::vector<std::array<uint32_t, 2>> &joined) {
  surfaces_ = &surfaces;
  joined_ = &joined;
  touching_ = touching;
  found_ = {};
  items_.clear();
  nodes_.clear();
  for (uint32_t s = 0; s < surfaces.size(); ++s) {
    for (uint32_t t = 0; t < surfaces[s].ntri; ++t) {
      Item item = {{{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}, s, t};
      for (int c = 0; c < 3; ++c) {
        const double *p = surfaces[s].xyz + 3 * size_t(surfaces[s].tri[3 * size_t(t) + c]);
        for (int k = 0; k < 3; ++k) {
          item.box.lo[k] = std::min(item.box.lo[k], p[k]);
          item.box.hi[k] = std::max(item.box.hi[k], p[k]);
        }
      }
      items_.push_back(item);
    }
  }
  if (items_.empty()) return {};
  within(build(0, uint32_t(items_.size())));
  return found_;
}

uint32_t Counter::build(uint32_t begin, uint32_t end) {
  const uint32_t index = uint32_t(nodes_.size());
  Node node = {items_[begin].box, begin, end, 0, 0};
  for (uint32_t i = begin + 1; i < end; ++i) {
    for (int k = 0; k < 3; ++k) {
      node.box.lo[k] = std::min(node.box.lo[k], items_[i].box.lo[k]);
      node.box.hi[k] = std::max(node.box.hi[k], items_[i].box.hi[k]);
    }
  }
  nodes_.push_back(node);
  if (end - begin <= 6) return index;
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (node.box.hi[k] - node.box.lo[k] > node.box.hi[axis] - node.box.lo[axis]) axis = k;
  const uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(items_.begin() + begin, items_.begin() + middle, items_.begin() + end,
                   [axis](const Item &a, const Item &b) {
                     return a.box.lo[axis] + a.box.hi[axis] < b.box.lo[axis] + b.box.hi[axis];
                   });
  const uint32_t left = build(begin, middle), right = build(middle, end);
  nodes_[index].left = left;
  nodes_[index].right = right;
  return index;
}

namespace {
template <class B>
bool overlap(const B &a, const B &b) {
  for (int k = 0; k < 3; ++k)
    if (a.lo[k] > b.hi[k] || b.lo[k] > a.hi[k]) return false;
  return true;
}
}  // namespace

void Counter::within(uint32_t index) {
  const Node node = nodes_[index];
  if (node.left) {
    within(node.left);
    within(node.right);
    between(node.left, node.right);
    return;
  }
  for (uint32_t i = node.begin; i < node.end; ++i)
    for (uint32_t j = i + 1; j < node.end; ++j) test(items_[i], items_[j]);
}

void Counter::between(uint32_t ia, uint32_t ib) {
  const Node &a = nodes_[ia], &b = nodes_[ib];
  if (!overlap(a.box, b.box)) return;
  if (!a.left && !b.left) {
    for (uint32_t i = a.begin; i < a.end; ++i)
      if (overlap(items_[i].box, b.box))
        for (uint32_t j = b.begin; j < b.end; ++j) test(items_[i], items_[j]);
  } else if (!b.left || (a.left && a.end - a.begin >= b.end - b.begin)) {
    between(a.left, ib);
    between(a.right, ib);
  } else {
    between(ia, b.left);
    between(ia, b.right);
  }
}

void Counter::test(const Item &ia, const Item &ib) {
  if (!overlap(ia.box, ib.box)) return;
  const Surface &sa = (*surfaces_)[ia.surface], &sb = (*surfaces_)[ib.surface];
  if (sa.obstacle && sb.obstacle) return;
  if (!joined_->empty() && std::binary_search(joined_->begin(), joined_->end(),
                                              std::array<uint32_t, 2>{std::min(ia.surface, ib.surface),
                                                                      std::max(ia.surface, ib.surface)}))
    return;
  const uint32_t *ta = sa.tri + 3 * size_t(ia.triangle), *tb = sb.tri + 3 * size_t(ib.triangle);
  const double *a[3], *b[3];
  for (int i = 0; i < 3; ++i) {
    a[i] = sa.xyz + 3 * size_t(ta[i]);
    b[i] = sb.xyz + 3 * size_t(tb[i]);
  }
  if (ia.surface == ib.surface)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        if (ta[i] == tb[j] || std::memcmp(a[i], b[j], 3 * sizeof(double)) == 0) return;
  if (!(touching_ == Touching::counts ? meet(a, b) : pass_through(a, b))) return;
  if (sa.cut && sb.cut && depth(a, b) < kLaid * std::max(longest_edge(a), longest_edge(b))) return;
  if (ia.surface == ib.surface) {
    if (found_.within++ == 0) found_.crossed = ia.surface;
    return;
  }
  ++found_.between;
  const bool parts = sa.whole != 0 && sa.whole == sb.whole;
  const bool first = parts ? found_.parts == 0 : found_.between == found_.parts + 1;
  uint32_t *const names = parts ? found_.parted : found_.crossing;
  if (first) {
    names[0] = std::min(ia.surface, ib.surface);
    names[1] = std::max(ia.surface, ib.surface);
  }
  found_.parts += parts;
}

}  // namespace crossing
