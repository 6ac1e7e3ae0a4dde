// With W, K, D of the single layer, the double layer and the hypersingular operator, t the tractions:
//
//   W t = (1/2 + K) u,   f = D u + (1/2 + K)^T t:   stiffness D + (1/2 + K)^T W^-1 (1/2 + K)
//
// symmetric and positive semidefinite as it stands. Tangential derivatives of the kernels are moved to u and
// to the test function (Kupradze 1979; Han 1994), c_a = n x grad of the shape function of a corner:
//
//   U = k ((3 - 4 nu) 1/r + r r^T/r^3),   k = (1 + nu) / (8 pi E (1 - nu))
//   K u = int d/dn(1/(4 pi r)) u + int (2 mu U - 1/(4 pi r)) [c_a]x u_a
//   v.D u = mu/(4 pi) int int 1/r (2 c_b.c_a v.u - (c_b.v)(c_a.u))
//           - v.[c_b]x int int (mu/(2 pi r) - 4 mu^2 U) [c_a]x u
//
// so that every integral is of 1/r, r r^T/r^3 or the solid angle: none is stronger than weakly singular. The
// inner one is in closed form (Wilton et al. 1984), the outer by Gauss points, on parts of the triangle that
// are halved towards the other one.
#include "boundary.h"

#include <algorithm>
#include <cmath>

#include "../model_common/entry.h"
#include "small.h"

namespace reduced {

namespace {

constexpr double kPi = 0x1.921fb54442d18p+1;
constexpr size_t kCluster = 128;  // triangles, points
constexpr size_t kMaxTriangles = 10000;
constexpr int kDeepest = 3;

// Of (x, y) against the axis x, in -pi .. pi: the angle is halved three times, then a series.
double angle_of(double y, double x) {
  if (x < 0) return (y < 0 ? -kPi : kPi) - angle_of(y, -x);
  double t = y / (x + std::sqrt(x * x + y * y));
  for (int n = 0; n < 2; ++n) t /= 1 + std::sqrt(1 + t * t);
  constexpr double kParts[] = {1.0 / 23, 1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13,
                               1.0 / 11, 1.0 / 9,  1.0 / 7,  1.0 / 5,  1.0 / 3,  1.0};
  const double square = t * t;
  double sum = 0;
  for (const double part : kParts) sum = part - square * sum;
  return 8 * t * sum;
}

// Integrals of a triangle's points y against a point x, or over x too; r = y - x.
struct Integrals {
  double inverse = 0;     // 1/r
  double dyad[9] = {};    // r r^T/r^3
  double normal[3] = {};  // d/dn_y(1/r) times the shape function of each corner

  void add(const Integrals &o, double w) {
    inverse += w * o.inverse;
    for (int i = 0; i < 9; ++i) dyad[i] += w * o.dyad[i];
    for (int i = 0; i < 3; ++i) normal[i] += w * o.normal[i];
  }
};

struct Kelvin {
  double mu, nu, k;
  Kelvin(double young, double poisson)
      : mu(young / (2 * (1 + poisson))), nu(poisson), k((1 + poisson) / (8 * kPi * young * (1 - poisson))) {}
  void u(const Integrals &i, double *out) const {
    for (int a = 0; a < 9; ++a) out[a] = k * (i.dyad[a] + (a % 4 ? 0 : (3 - 4 * nu) * i.inverse));
  }
  // of (1/2 + K) for a corner, without the 1/2
  void double_layer(const Integrals &i, const double *u, int corner, const double *c, double *out) const {
    double m[9];
    for (int a = 0; a < 9; ++a) m[a] = 2 * mu * u[a] - (a % 4 ? 0 : i.inverse / (4 * kPi));
    for (int r = 0; r < 3; ++r) {  // m [c]x
      const double *const row = m + 3 * r;
      out[3 * r] = row[1] * c[2] - row[2] * c[1];
      out[3 * r + 1] = row[2] * c[0] - row[0] * c[2];
      out[3 * r + 2] = row[0] * c[1] - row[1] * c[0];
      out[4 * r] += i.normal[corner] / (4 * kPi);
    }
  }
};

// Orders the n numbers of `own` by neighbors in space, in so many parts of like size, each by number: halves
// of the longest side of what holds them. out: the sizes of the parts.
void divide(const std::vector<double> &x, uint32_t *own, size_t n, size_t parts, std::vector<size_t> &out) {
  if (parts == 1) {
    std::sort(own, own + n);
    return out.push_back(n);
  }
  double most = -1;
  size_t side = 0;
  for (size_t a = 0; a < 3; ++a) {
    const auto less = [&](uint32_t i, uint32_t j) { return x[3 * size_t(i) + a] < x[3 * size_t(j) + a]; };
    const auto [low, high] = std::minmax_element(own, own + n, less);
    const double length = x[3 * size_t(*high) + a] - x[3 * size_t(*low) + a];
    if (!(length > most)) continue;
    most = length;
    side = a;
  }
  const size_t half = n * (parts / 2) / parts;
  std::nth_element(own, own + half, own + n, [&](uint32_t i, uint32_t j) {
    const double a = x[3 * size_t(i) + side], b = x[3 * size_t(j) + side];
    return a < b || (a == b && i < j);
  });
  divide(x, own, half, parts / 2, out);
  divide(x, own + half, n - half, parts - parts / 2, out);
}

// The order of places in space; numbers of components in each of its clusters.
std::vector<size_t> clusters_of(const std::vector<double> &x, std::vector<uint32_t> &order) {
  order.resize(x.size() / 3);
  for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::vector<size_t> out;
  if (!order.empty()) divide(x, order.data(), order.size(), (order.size() + kCluster - 1) / kCluster, out);
  for (size_t &n : out) n *= 3;
  return out;
}

}  // namespace

struct Boundary::Triangle {
  uint32_t corner[3];
  double y[3][3], n[3], c[3][3], center[3];  // c: n x gradient of a corner's shape function
  double area, radius;                       // radius: about the center
  // Each side, from its corner to the next: direction, outward normal in the plane, length. Gradients of the
  // shape functions.
  double along[3][3], beside[3][3], side[3], gradient[3][3];

  void take(const uint32_t *corners, const double *const *x) {
    double e[3], f[3];
    for (int a = 0; a < 3; ++a) {
      corner[a] = corners[a];
      std::copy(x[a], x[a] + 3, y[a]);
    }
    for (int k = 0; k < 3; ++k) {
      e[k] = y[1][k] - y[0][k];
      f[k] = y[2][k] - y[0][k];
      n[k] = 0;
      center[k] = (y[0][k] + y[1][k] + y[2][k]) / 3;
    }
    cross_add(e, f, 1, n);
    const double twice = std::sqrt(dot(n, n));
    area = 0.5 * twice;
    radius = 0;
    for (int a = 0; a < 3; ++a) {
      n[a] /= twice;
      double d[3];
      for (int k = 0; k < 3; ++k) {
        c[a][k] = (y[(a + 1) % 3][k] - y[(a + 2) % 3][k]) / twice;
        d[k] = y[a][k] - center[k];
      }
      radius = std::max(radius, std::sqrt(dot(d, d)));
    }
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      for (int k = 0; k < 3; ++k) {
        along[a][k] = y[b][k] - y[a][k];
        beside[a][k] = gradient[a][k] = 0;
      }
      side[a] = std::sqrt(dot(along[a], along[a]));
      for (double &k : along[a]) k /= side[a];
      cross_add(along[a], n, 1, beside[a]);
      cross_add(c[a], n, 1, gradient[a]);
    }
  }

  // at x; own: x lies in the triangle, and the solid angle is its principal value, zero
  void inner(const double *x, bool own, Integrals &out) const {
    double to[3][3], length[3];
    for (int a = 0; a < 3; ++a) {
      for (int k = 0; k < 3; ++k) to[a][k] = y[a][k] - x[k];
      length[a] = std::sqrt(dot(to[a], to[a]));
    }
    const double height = own ? 0 : -dot(to[0], n);
    double solid = 0;  // positive on the side of the normal
    if (!own) {
      double cross[3] = {};
      cross_add(to[1], to[2], 1, cross);
      const double volume = dot(to[0], cross);
      const double below = length[0] * length[1] * length[2] + dot(to[0], to[1]) * length[2] +
                           dot(to[1], to[2]) * length[0] + dot(to[2], to[0]) * length[1];
      solid = -2 * angle_of(volume, below);
    }
    double line[3] = {}, plane[9] = {}, inverse = 0;
    for (int a = 0; a < 3; ++a) {
      const int b = (a + 1) % 3;
      const double *const s = along[a], *const m = beside[a];
      const double from = dot(to[a], s), until = from + side[a], t = dot(to[a], m);
      const double f = from + until > 0 ? dfm_log((length[b] + until) / (length[a] + from))
                                        : dfm_log((length[a] - from) / (length[b] - until));
      inverse += t * f;
      const double longer = length[b] - length[a];
      for (int i = 0; i < 3; ++i) {
        line[i] += f * m[i];
        for (int j = 0; j < 3; ++j) plane[3 * i + j] -= m[i] * (t * f * m[j] + longer * s[j]);
      }
    }
    inverse -= height * solid;
    out.inverse = inverse;
    // r = rho - height n; int rho/r^3 = -line
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        out.dyad[3 * i + j] = plane[3 * i + j] + ((i == j) - n[i] * n[j]) * inverse +
                              height * (line[i] * n[j] + n[i] * line[j]) + height * solid * n[i] * n[j];
    for (int a = 0; a < 3; ++a) {
      double d[3];
      for (int k = 0; k < 3; ++k) d[k] = -to[a][k];
      out.normal[a] = (1 + dot(gradient[a], d)) * solid - height * dot(gradient[a], line);
    }
  }

  // over x in a part of this triangle, against y in another one
  void outer(const Triangle &other, const double (*part)[3], double share, int depth, Integrals &out) const {
    double middle[3], d[3], size = 0;
    for (int k = 0; k < 3; ++k) middle[k] = (part[0][k] + part[1][k] + part[2][k]) / 3;
    for (int a = 0; a < 3; ++a) {
      for (int k = 0; k < 3; ++k) d[k] = part[a][k] - middle[k];
      size = std::max(size, std::sqrt(dot(d, d)));
    }
    for (int k = 0; k < 3; ++k) d[k] = middle[k] - other.center[k];
    const double apart = std::sqrt(dot(d, d)) - other.radius;
    if (depth < kDeepest && apart < 1.5 * size) {
      double half[3][3];
      for (int a = 0; a < 3; ++a)
        for (int k = 0; k < 3; ++k) half[a][k] = 0.5 * (part[a][k] + part[(a + 1) % 3][k]);
      for (int a = 0; a < 4; ++a) {
        double sub[3][3];
        for (int k = 0; k < 3; ++k) {
          sub[0][k] = a < 3 ? part[a][k] : half[0][k];
          sub[1][k] = a < 3 ? half[a][k] : half[1][k];
          sub[2][k] = a < 3 ? half[(a + 2) % 3][k] : half[2][k];
        }
        outer(other, sub, 0.25 * share, depth + 1, out);
      }
      return;
    }
    // Gauss points exact to degree 2, and 5 (Radon 1948)
    const double root = std::sqrt(15.0);
    const double in = (6 - root) / 21, on = (6 + root) / 21;
    const double few[] = {1.0 / 6, 1.0 / 3};
    const double many[] = {in, (155 - root) / 1200, on, (155 + root) / 1200};
    const bool fine = apart < 6 * size;
    const double *const ring = fine ? many : few;
    const auto add = [&](const double *x, double w) {
      Integrals at;
      other.inner(x, &other == this, at);
      out.add(at, w * share * area);
    };
    if (fine) add(middle, 9.0 / 40);
    for (int r = 0; r < (fine ? 2 : 1); ++r)
      for (int a = 0; a < 3; ++a) {
        double x[3];
        for (int k = 0; k < 3; ++k)
          x[k] = part[a][k] +
                 ring[2 * r] * ((part[(a + 1) % 3][k] - part[a][k]) + (part[(a + 2) % 3][k] - part[a][k]));
        add(x, ring[2 * r + 1]);
      }
  }
};

void Boundary::find(const dfm_host *host, const char *id, const dfm_mesh &m) {
  host_ = host;
  struct Face { uint32_t sorted[3], corner[3]; };
  std::vector<Face> faces;
  constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (size_t c = 0; c < m.ncell; ++c)
    for (const auto &f : kFaces) {
      Face face;
      for (int a = 0; a < 3; ++a) face.sorted[a] = face.corner[a] = m.cells[4 * c + size_t(f[a])];
      std::sort(face.sorted, face.sorted + 3);
      faces.push_back(face);
    }
  const auto less = [](const Face &a, const Face &b) {
    return std::lexicographical_compare(a.sorted, a.sorted + 3, b.sorted, b.sorted + 3);
  };
  std::stable_sort(faces.begin(), faces.end(), less);
  std::vector<uint32_t> place(m.npoint, UINT32_MAX);
  for (size_t n = 0; n < faces.size(); ++n) {
    const bool twice =
        (n > 0 && !less(faces[n - 1], faces[n])) || (n + 1 < faces.size() && !less(faces[n], faces[n + 1]));
    if (twice) continue;
    for (const uint32_t i : faces[n].corner) {
      triangles_.push_back(i);
      place[i] = 0;
    }
  }
  if (ntriangle() > kMaxTriangles)
    model::refuse(
        host, id,
        "%u triangles; more than %u are refused, because their matrices take minutes and gigabytes; "
        "take a coarser mesh, which a fine surface may hang on",
        unsigned(ntriangle()), unsigned(kMaxTriangles));
  // The first point of each piece leads its others.
  std::vector<uint32_t> leader(m.npoint);
  for (uint32_t i = 0; i < m.npoint; ++i) leader[i] = i;
  const auto lead = [&](uint32_t i) {
    while (leader[i] != i) i = leader[i] = leader[leader[i]];
    return i;
  };
  for (size_t c = 0; c < 4 * m.ncell; ++c) leader[lead(m.cells[c])] = lead(m.cells[c / 4 * 4]);
  for (size_t c = 0; c < 4 * m.ncell; ++c)
    if (lead(m.cells[c]) != lead(m.cells[0]))
      model::refuse(host, id,
                    "the cells are separate pieces; boundary elements take one: make a body of each");
  for (uint32_t i = 0; i < m.npoint; ++i) {
    if (place[i] == 0) {
      place[i] = uint32_t(point.size());
      point.push_back(i);
    } else {
      inner.push_back(i);
    }
  }
  for (uint32_t &i : triangles_) i = place[i];
  for (size_t i = 0; i < point.size(); ++i)
    for (size_t j = i + 1; j < point.size(); ++j) edges.insert(edges.end(), {point[i], point[j]});
}

const double *Boundary::block_at(const double *block, size_t i, size_t j) const {
  const size_t npoint = point.size() + inner.size();
  return block + 9 * (i == j ? size_t(point[i]) : npoint + pair(i, j));
}

// single [triangles, triangles], both [triangles, points]. A row of triangles at a time; the stiffness takes
// half of each integral and of the one in the other order.
void Boundary::add_pairs(const std::vector<Triangle> &t, double young, double poisson, Tiles &single,
                         Tiles &both, double *block) {
  const Kelvin kelvin(young, poisson);
  const size_t n = point.size();
  double largest = 0, apart = 0;
  for (size_t cluster = 0; cluster < single.nrow(); ++cluster) {
    const size_t first = single.row(cluster) / 3, until = single.row(cluster + 1) / 3;
    Table row, column;
    row.create(host_, 3 * (until - first), 3 * t.size());
    column.create(host_, 3 * (until - first), 3 * n);
    for (size_t p = first; p < until; ++p) {
      std::vector<double> of_cross(9 * n), of_dot(3 * n);  // sums of g [ca]x, and of ca over r, by point
      double *to[3], *at[3];
      for (size_t r = 0; r < 3; ++r) {
        to[r] = row.row(3 * (p - first) + r);
        at[r] = column.row(3 * (p - first) + r);
      }
      for (size_t q = 0; q < t.size(); ++q) {
        Integrals pair;
        t[p].outer(t[q], t[p].y, 1, 0, pair);
        double u[9], g[9];
        kelvin.u(pair, u);
        for (size_t r = 0; r < 3; ++r) std::copy_n(u + 3 * r, 3, to[r] + 3 * q);
        const double over = kelvin.mu / (4 * kPi) * pair.inverse;
        for (int a = 0; a < 9; ++a) g[a] = (a % 4 ? 0 : 2 * over) - 4 * kelvin.mu * kelvin.mu * u[a];
        for (int a = 0; a < 3; ++a) {
          const size_t i = t[q].corner[a];
          const double *const c = t[q].c[a];
          double k[9];
          kelvin.double_layer(pair, u, a, c, k);
          for (size_t r = 0; r < 3; ++r)
            for (size_t s = 0; s < 3; ++s)
              at[r][3 * order_[i] + s] += k[3 * r + s] + (p == q && r == s ? t[p].area / 6 : 0);
          double *const cross = &of_cross[9 * i];
          for (int r = 0; r < 3; ++r) {
            const double *const from = g + 3 * r;
            cross[3 * r] += from[1] * c[2] - from[2] * c[1];
            cross[3 * r + 1] += from[2] * c[0] - from[0] * c[2];
            cross[3 * r + 2] += from[0] * c[1] - from[1] * c[0];
            of_dot[3 * i + size_t(r)] += over * c[r];
          }
        }
      }
      for (int b = 0; b < 3; ++b)
        for (size_t j = 0; j < n; ++j) {
          const size_t i = t[p].corner[b];
          const double *const c = t[p].c[b], *const x = &of_cross[9 * j], *const d = &of_dot[3 * j];
          const double twice = 2 * dot(c, d);
          double f[9];
          for (int s = 0; s < 3; ++s) {  // -[c]x
            f[s] = c[2] * x[3 + s] - c[1] * x[6 + s];
            f[3 + s] = c[0] * x[6 + s] - c[2] * x[s];
            f[6 + s] = c[1] * x[s] - c[0] * x[3 + s];
          }
          double *const half = block_at(block, std::min(i, j), std::max(i, j));
          for (int r = 0; r < 3; ++r)
            for (int s = 0; s < 3; ++s) {
              const double own = 0.5 * (f[3 * r + s] + ((r == s ? twice : 0) - c[r] * d[s]));
              if (i <= j) half[3 * r + s] += own;
              if (i >= j) half[3 * s + r] += own;
            }
        }
    }
    for (size_t other = 0; other < single.ncolumn(); ++other) {
      Table own, before;
      const size_t from = single.column(other);
      single.table(other, cluster, own);
      for (size_t i = 0; i < own.rows; ++i)
        for (size_t j = 0; j < own.columns; ++j) own.row(i)[j] = row.row(j)[from + i];
      if (other > cluster) {
        single.set(other, cluster, std::move(own));
        continue;
      }
      Table mean;
      single.table(cluster, other, mean);
      if (other < cluster) single.get(cluster, other, before);
      for (size_t i = 0; i < mean.rows; ++i)
        for (size_t j = 0; j < mean.columns; ++j) {
          const double a = own.row(j)[i], b = other < cluster ? before.row(i)[j] : own.row(i)[j];
          mean.row(i)[j] = 0.5 * (a + b);
          largest = std::max(largest, std::fabs(a));
          apart = std::max(apart, std::fabs(a - b));
        }
      single.set(cluster, other, std::move(mean));
    }
    for (size_t other = 0; both.column(other) < 3 * n; ++other)
      both.cut(cluster, other, column, 0, both.column(other));
  }
  asymmetry_ = apart / largest;
}

void Boundary::assemble(const char *id, const Kernels &kernels, const double *rest, double young,
                        double poisson, double *block) {
  const size_t many = ntriangle();
  std::vector<Triangle> made(many), t(many);
  std::vector<double> places;
  for (size_t k = 0; k < many; ++k) {
    const uint32_t *const corner = triangles_.data() + 3 * k;
    const double *x[3];
    for (int a = 0; a < 3; ++a) x[a] = rest + 3 * size_t(point[corner[a]]);
    made[k].take(corner, x);
    places.insert(places.end(), made[k].center, made[k].center + 3);
  }
  std::vector<uint32_t> kth;
  const std::vector<size_t> triangles = clusters_of(places, kth);
  for (size_t k = 0; k < many; ++k) t[k] = made[kth[k]];
  const auto order = [&](const std::vector<uint32_t> &points, std::vector<uint32_t> &at,
                         std::vector<uint32_t> &out) {
    places.clear();
    for (const uint32_t i : points)
      places.insert(places.end(), rest + 3 * size_t(i), rest + 3 * (size_t(i) + 1));
    const std::vector<size_t> clusters = clusters_of(places, at);
    out.resize(points.size());
    for (uint32_t k = 0; k < at.size(); ++k) out[at[k]] = k;
    return clusters;
  };
  clusters_ = order(point, point_at_, order_);
  const std::vector<size_t> inside = order(inner, inner_at_, inner_order_);
  std::vector<size_t> columns = clusters_;
  columns.insert(columns.end(), inside.begin(), inside.end());
  packed_.create(host_, kLanes * 3 * (point.size() + inner.size()));
  Tiles both;
  both.create(host_, &kernels, triangles, columns);
  follow_.create(host_, &kernels, inside, clusters_);
  {
    Tiles single;
    single.create(host_, &kernels, triangles, triangles);
    add_pairs(t, young, poisson, single, both, block);
    add_inner(id, t, rest, young, poisson, both);
    single.factorize();
    single.reduce(both);
  }
  const size_t nsurface = clusters_.size();
  for (size_t a = 0; a < columns.size(); ++a)
    for (size_t b = 0; b < nsurface; ++b) {
      if (a < nsurface && b > a) continue;
      Table f;
      if (a < nsurface) f.create(host_, columns[a], columns[b]);
      else follow_.get(a - nsurface, b, f);
      Tiles::subtract_gram(both, a, b, f);
      if (a < nsurface) {
        add_stiffness(both.column(a) / 3, both.column(b) / 3, f, block);
        continue;
      }
      follow_.set(a - nsurface, b, std::move(f));
    }
  make_rigid_exact(rest, block);
  model::say(host_, asymmetry_ > 1e-3 ? 2 : 1, id,
             "%u triangles; before they are made exact, the symmetry of the integrals is off by %.2g, and "
             "forces under rigid motions are %.2g of the stiffness",
             unsigned(many), asymmetry_, rigid_error_);
}

// block -= f, at clusters of points from which on
void Boundary::add_stiffness(size_t row, size_t column, const Table &f, double *block) {
  for (size_t a = 0; 3 * a < f.rows; ++a)
    for (size_t b = 0; 3 * b < f.columns; ++b) {
      const size_t i = point_at_[row + a], j = point_at_[column + b];
      if (row == column && i > j) continue;
      double *const to = block_at(block, std::min(i, j), std::max(i, j));
      for (size_t r = 0; r < 3; ++r)
        for (size_t s = 0; s < 3; ++s) to[i <= j ? 3 * r + s : 3 * s + r] -= f.row(3 * a + r)[3 * b + s];
    }
}

// u(x) = sum of U t - K u for x inside (Somigliana's identity), t = W^-1 (1/2 + K) u: U goes to both, K to
// follow_.
void Boundary::add_inner(const char *id, const std::vector<Triangle> &t, const double *rest, double young,
                         double poisson, Tiles &both) {
  const Kelvin kelvin(young, poisson);
  for (size_t cluster = 0; cluster < follow_.nrow(); ++cluster) {
    const size_t first = follow_.row(cluster) / 3, until = follow_.row(cluster + 1) / 3;
    Table load, lead;
    load.create(host_, 3 * t.size(), 3 * (until - first));
    lead.create(host_, 3 * (until - first), 3 * point.size());
    for (size_t k = first; k < until; ++k) {
      const uint32_t i = inner[inner_at_[k]];
      double solid = 0;
      for (size_t q = 0; q < t.size(); ++q) {
        Integrals at;
        t[q].inner(rest + 3 * size_t(i), false, at);
        double u[9], c[9];
        kelvin.u(at, u);
        solid += at.normal[0] + at.normal[1] + at.normal[2];
        for (size_t r = 0; r < 3; ++r)
          for (size_t s = 0; s < 3; ++s) load.row(3 * q + s)[3 * (k - first) + r] = u[3 * r + s];
        for (int a = 0; a < 3; ++a) {
          kelvin.double_layer(at, u, a, t[q].c[a], c);
          for (size_t r = 0; r < 3; ++r)
            for (size_t s = 0; s < 3; ++s)
              lead.row(3 * (k - first) + r)[3 * order_[t[q].corner[a]] + s] += c[3 * r + s];
        }
      }
      if (std::fabs(solid + 4 * kPi) < 1) continue;  // NaN on an edge
      model::refuse(
          host_, id,
          "point %u is a corner of cells, but not inside their border: flat cells are there; remove "
          "them, or take the model condensed",
          i);
    }
    for (size_t r = 0; r < both.nrow(); ++r) both.cut(r, clusters_.size() + cluster, load, both.row(r), 0);
    for (size_t c = 0; c < follow_.ncolumn(); ++c) follow_.cut(cluster, c, lead, 0, follow_.column(c));
  }
}

// The six rigid motions r, orthonormal on the surface: the stiffness becomes P K P, P = 1 - r r^T, and inner
// points follow a rigid motion of the surface exactly.
void Boundary::make_rigid_exact(const double *rest, double *block) {
  const size_t n = point.size(), size = 3 * n, all = size + 3 * inner.size();
  std::vector<double> rigid[6], force[6];
  double *row[6];
  const auto along = [&](const double *a, const double *b) {
    double sum = 0;
    for (size_t j = 0; j < size; ++j) sum += a[j] * b[j];
    return sum;
  };
  for (size_t k = 0; k < 6; ++k) {
    std::vector<double> &own = rigid[k];
    own.resize(all);
    for (size_t i = 0; i < n + inner.size(); ++i) {
      const double *const x = rest + 3 * size_t(i < n ? point[i] : inner[i - n]);
      if (k < 3) {
        own[3 * i + k] = 1;
      } else {
        own[3 * i + (k + 1) % 3] = -x[(k + 2) % 3];
        own[3 * i + (k + 2) % 3] = x[(k + 1) % 3];
      }
    }
    row[k] = own.data();
  }
  orthonormalize(row, all, along);
  double norm = 0, left = 0;
  for (size_t k = 0; k < 6; ++k) {
    force[k].assign(size, 0.0);
    for (size_t i = 0; i < n; ++i)
      for (size_t j = i; j < n; ++j) {
        const double *const b = block_at(block, i, j);
        for (size_t r = 0; r < 3; ++r)
          for (size_t s = 0; s < 3; ++s) {
            force[k][3 * i + r] += b[3 * r + s] * rigid[k][3 * j + s];
            if (i != j) force[k][3 * j + s] += b[3 * r + s] * rigid[k][3 * i + r];
            if (k == 0) norm += (i == j ? 1 : 2) * b[3 * r + s] * b[3 * r + s];
          }
      }
    left += along(force[k].data(), force[k].data());
  }
  rigid_error_ = std::sqrt(left / norm);
  // P K P = K - g r^T - r g^T,  g = K r - r (r^T K r)/2
  double between[6][6];
  for (size_t k = 0; k < 6; ++k)
    for (size_t l = 0; l < 6; ++l) between[k][l] = along(row[k], force[l].data());
  for (size_t k = 0; k < 6; ++k)
    for (size_t l = 0; l < 6; ++l)
      for (size_t j = 0; j < size; ++j) force[k][j] -= 0.5 * between[l][k] * rigid[l][j];
  for (size_t i = 0; i < n; ++i)
    for (size_t j = i; j < n; ++j) {
      double *const b = block_at(block, i, j);
      for (size_t r = 0; r < 3; ++r)
        for (size_t s = 0; s < 3; ++s)
          for (size_t k = 0; k < 6; ++k)
            b[3 * r + s] -=
                force[k][3 * i + r] * rigid[k][3 * j + s] + rigid[k][3 * i + r] * force[k][3 * j + s];
    }
  rigid_.create(host_, 6 * size);
  missing_.create(host_, 6 * 3 * inner.size());
  std::vector<double> lanes(kLanes * size), led(kLanes * 3 * inner.size());
  for (size_t k = 0; k < 6; ++k)
    for (size_t j = 0; j < size; ++j)
      lanes[kLanes * (3 * order_[j / 3] + j % 3) + k] = rigid_[6 * (3 * order_[j / 3] + j % 3) + k] =
          rigid[k][j];
  follow_.add<kLanes>(lanes.data(), led.data());  // -u of inner points
  for (size_t k = 0; k < 6; ++k)
    for (size_t j = 0; j < 3 * inner.size(); ++j) {
      const size_t to = 3 * inner_order_[j / 3] + j % 3;
      missing_[6 * to + k] = rigid[k][size + j] + led[kLanes * to + k];
    }
}

// -follow_ and what it misses of rigid motions.
template <size_t kWide>
void Boundary::gather(double *f) const {
  const size_t size = 3 * point.size(), rows = 3 * inner.size();
  double *const own = packed_.data(), *const from = own + kWide * size;
  bool any = false;
  std::fill(own, from + kWide * rows, 0.0);
  for (size_t row = 0; row < rows; ++row)
    for (size_t w = 0; w < kWide; ++w) {
      double &force = f[kWide * (3 * size_t(inner[row / 3]) + row % 3) + w];
      any = any || force != 0;
      from[kWide * (3 * inner_order_[row / 3] + row % 3) + w] = -force;
      force = 0;
    }
  if (!any) return;
  follow_.add_transposed<kWide>(from, own);
  double along[6][kWide] = {};
  for (size_t row = 0; row < rows; ++row)
    for (size_t k = 0; k < 6; ++k)
      for (size_t w = 0; w < kWide; ++w) along[k][w] -= missing_[6 * row + k] * from[kWide * row + w];
  for (size_t j = 0; j < size; ++j) {
    const size_t at = 3 * order_[j / 3] + j % 3;
    for (size_t w = 0; w < kWide; ++w) {
      double sum = own[kWide * at + w];
      for (size_t k = 0; k < 6; ++k) sum += rigid_[6 * at + k] * along[k][w];
      f[kWide * (3 * size_t(point[j / 3]) + j % 3) + w] += sum;
    }
  }
}

template <size_t kWide>
void Boundary::pack(const double *u) const {
  std::fill(packed_.data(), packed_.data() + kWide * 3 * (point.size() + inner.size()), 0.0);
  for (size_t j = 0; j < 3 * point.size(); ++j)
    for (size_t w = 0; w < kWide; ++w)
      packed_[kWide * (3 * order_[j / 3] + j % 3) + w] = u[kWide * (3 * size_t(point[j / 3]) + j % 3) + w];
}

template <size_t kWide>
void Boundary::spread(double *u) const {
  const size_t size = 3 * point.size(), rows = 3 * inner.size();
  pack<kWide>(u);
  double *const own = packed_.data(), *const led = own + kWide * size;
  follow_.add<kWide>(own, led);
  double along[6][kWide] = {};
  for (size_t j = 0; j < size; ++j)
    for (size_t k = 0; k < 6; ++k)
      for (size_t w = 0; w < kWide; ++w) along[k][w] += rigid_[6 * j + k] * own[kWide * j + w];
  for (size_t row = 0; row < rows; ++row) {
    const size_t at = 3 * inner_order_[row / 3] + row % 3;
    for (size_t w = 0; w < kWide; ++w) {
      double sum = -led[kWide * at + w];
      for (size_t k = 0; k < 6; ++k) sum += missing_[6 * at + k] * along[k][w];
      u[kWide * (3 * size_t(inner[row / 3]) + row % 3) + w] = sum;
    }
  }
}

template <size_t kWide>
void Boundary::solve(double *u) const {
  pack<kWide>(u);
  factor_.solve<kWide>(packed_.data());
  for (size_t j = 0; j < 3 * point.size(); ++j)
    for (size_t w = 0; w < kWide; ++w)
      u[kWide * (3 * size_t(point[j / 3]) + j % 3) + w] = packed_[kWide * (3 * order_[j / 3] + j % 3) + w];
}

void Boundary::factorize(const Kernels &kernels, const double *block, const std::vector<uint8_t> &out) {
  factor_.create(host_, &kernels, clusters_, clusters_);
  for (size_t a = 0; a < clusters_.size(); ++a)
    for (size_t b = 0; b <= a; ++b) {
      Table own;
      factor_.table(a, b, own);
      for (size_t n = 0; n < own.rows; ++n)
        for (size_t m = 0; m < own.columns; ++m) {
          const size_t row = factor_.row(a) + n, column = factor_.column(b) + m;
          const size_t i = point_at_[row / 3], j = point_at_[column / 3];
          const double *const from = block_at(block, std::min(i, j), std::max(i, j));
          const double value = i <= j ? from[3 * (row % 3) + column % 3] : from[3 * (column % 3) + row % 3];
          const bool off = out[3 * size_t(point[i]) + row % 3] || out[3 * size_t(point[j]) + column % 3];
          if (!off || row == column) own.row(n)[m] = value;
        }
      factor_.set(a, b, std::move(own));
    }
  factor_.factorize();
}

template void Boundary::gather<1>(double *) const;
template void Boundary::gather<kLanes>(double *) const;
template void Boundary::spread<1>(double *) const;
template void Boundary::spread<kLanes>(double *) const;
template void Boundary::solve<1>(double *) const;
template void Boundary::solve<kLanes>(double *) const;

}  // namespace reduced
