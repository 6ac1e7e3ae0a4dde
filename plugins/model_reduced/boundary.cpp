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
#include "sparse.h"

namespace reduced {

namespace {

constexpr double kPi = 0x1.921fb54442d18p+1;
constexpr size_t kMaxTriangles = 1600;
constexpr int kDeepest = 3;

// Of (x, y) against the axis x, in -pi .. pi: the angle is halved three times, then a series.
double angle_of(double y, double x) {
  if (x < 0) return (y < 0 ? -kPi : kPi) - angle_of(y, -x);
  double t = y / (x + std::sqrt(x * x + y * y));
  for (int n = 0; n < 2; ++n) t /= 1 + std::sqrt(1 + t * t);
  double sum = 0;
  for (int n = 23; n > 0; n -= 2) sum = 1.0 / n - t * t * sum;
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

}  // namespace

struct Boundary::Triangle {
  uint32_t corner[3];
  double y[3][3], n[3], c[3][3], center[3];  // c: n x grad of a corner's shape function
  double area, radius;                       // radius: about the center

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
      double s[3], m[3] = {};
      for (int k = 0; k < 3; ++k) s[k] = y[b][k] - y[a][k];
      const double side = std::sqrt(dot(s, s));
      for (double &k : s) k /= side;
      cross_add(s, n, 1, m);
      const double from = dot(to[a], s), until = from + side, t = dot(to[a], m);
      const double f = from + until > 0 ? dfm_log((length[b] + until) / (length[a] + from))
                                        : dfm_log((length[a] - from) / (length[b] - until));
      inverse += t * f;
      const double along = length[b] - length[a];
      for (int i = 0; i < 3; ++i) {
        line[i] += f * m[i];
        for (int j = 0; j < 3; ++j) plane[3 * i + j] -= m[i] * (t * f * m[j] + along * s[j]);
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
      // grad of the shape function = c x n
      double g[3] = {}, d[3];
      cross_add(c[a], n, 1, g);
      for (int k = 0; k < 3; ++k) d[k] = -to[a][k];
      out.normal[a] = (1 + dot(g, d)) * solid - height * dot(g, line);
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
  if (ntriangle() > kMaxTriangles) {
    model::refuse(host, id,
                  "%zu triangles; boundary elements of more than %zu are refused, because time grows "
                  "with their cube; take a coarser surface, or the model condensed",
                  ntriangle(), kMaxTriangles);
  }
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

double *Boundary::block_at(double *block, size_t i, size_t j) const {
  const size_t npoint = point.size() + inner.size();
  return block + 9 * (i == j ? size_t(point[i]) : npoint + pair(i, j));
}

// single [pairs of triangles, 9] in the order of rows p and columns q >= p; both [3 surface in lanes of 8]
void Boundary::add_pairs(const std::vector<Triangle> &t, double young, double poisson,
                         std::vector<double> &single, std::vector<double> &both, double *block) {
  const Kelvin kelvin(young, poisson);
  const size_t rows = 3 * t.size();
  const auto row_of = [&](size_t p, size_t i, size_t a, size_t b) -> double & {
    const size_t column = 3 * i + b;
    return both[(column / kLanes * rows + 3 * p + a) * kLanes + column % kLanes];
  };
  double largest = 0, apart = 0;
  for (size_t p = 0; p < t.size(); ++p)
    for (size_t q = p; q < t.size(); ++q) {
      Integrals pair[2];  // over x in p, and over x in q
      t[p].outer(t[q], t[p].y, 1, 0, pair[0]);
      if (p == q) pair[1] = pair[0];
      else t[q].outer(t[p], t[q].y, 1, 0, pair[1]);
      double u[2][9], mean[9];
      for (int side = 0; side < 2; ++side) kelvin.u(pair[side], u[side]);
      for (int r = 0; r < 3; ++r)
        for (int s = 0; s < 3; ++s) {
          const double a = u[0][3 * r + s], b = u[1][3 * s + r];
          mean[3 * r + s] = 0.5 * (a + b);
          largest = std::max(largest, std::fabs(a));
          apart = std::max(apart, std::fabs(a - b));
        }
      single.insert(single.end(), mean, mean + 9);
      for (int side = 0; side < (p == q ? 1 : 2); ++side) {
        const size_t at = side ? q : p;
        const Triangle &y = side ? t[p] : t[q];
        for (int a = 0; a < 3; ++a) {
          double k[9];
          kelvin.double_layer(pair[side], u[side], a, y.c[a], k);
          for (size_t r = 0; r < 3; ++r)
            for (size_t s = 0; s < 3; ++s) row_of(at, y.corner[a], r, s) += k[3 * r + s];
          if (p == q)
            for (size_t r = 0; r < 3; ++r) row_of(at, y.corner[a], r, r) += y.area / 6;
        }
      }
      const double inverse = 0.5 * (pair[0].inverse + pair[1].inverse),
                   over = kelvin.mu / (4 * kPi) * inverse;
      double g[9];
      for (int a = 0; a < 9; ++a) g[a] = (a % 4 ? 0 : 2 * over) - 4 * kelvin.mu * kelvin.mu * mean[a];
      for (int b = 0; b < 3; ++b)
        for (int a = 0; a < 3; ++a) {
          const double *const cb = t[p].c[b], *const ca = t[q].c[a];
          double right[9], f[9];
          for (int r = 0; r < 3; ++r) {  // g [ca]x
            const double *const row = g + 3 * r;
            right[3 * r] = row[1] * ca[2] - row[2] * ca[1];
            right[3 * r + 1] = row[2] * ca[0] - row[0] * ca[2];
            right[3 * r + 2] = row[0] * ca[1] - row[1] * ca[0];
          }
          for (int s = 0; s < 3; ++s) {  // -[cb]x right
            f[s] = cb[2] * right[3 + s] - cb[1] * right[6 + s];
            f[3 + s] = cb[0] * right[6 + s] - cb[2] * right[s];
            f[6 + s] = cb[1] * right[s] - cb[0] * right[3 + s];
          }
          for (int r = 0; r < 3; ++r)
            for (int s = 0; s < 3; ++s)
              f[3 * r + s] += over * ((r == s ? 2 * dot(cb, ca) : 0) - cb[r] * ca[s]);
          const size_t i = t[p].corner[b], j = t[q].corner[a];
          if (p == q && i > j) continue;
          double *const to = block_at(block, std::min(i, j), std::max(i, j));
          for (int r = 0; r < 3; ++r)
            for (int s = 0; s < 3; ++s) {
              if (i <= j) to[3 * r + s] += f[3 * r + s];
              else to[3 * r + s] += f[3 * s + r];
              if (i == j && p != q) to[3 * r + s] += f[3 * s + r];
            }
        }
    }
  asymmetry_ = apart / largest;
}

void Boundary::assemble(const char *id, const Kernels &kernels, const double *rest, double young,
                        double poisson, double *block) {
  const size_t n = point.size(), many = ntriangle(), rows = 3 * many;
  std::vector<Triangle> t(many);
  std::vector<double> places;
  for (size_t k = 0; k < many; ++k) {
    const uint32_t *const corner = triangles_.data() + 3 * k;
    const double *x[3];
    for (int a = 0; a < 3; ++a) x[a] = rest + 3 * size_t(point[corner[a]]);
    t[k].take(corner, x);
    places.insert(places.end(), t[k].center, t[k].center + 3);
  }
  const size_t lanes = (3 * n + kLanes - 1) / kLanes;
  std::vector<double> both(lanes * rows * kLanes), traction(both.size());
  {
    std::vector<double> single;
    single.reserve(9 * (many * (many + 1) / 2));
    add_pairs(t, young, poisson, single, both, block);
    std::vector<uint32_t> ij;
    ij.reserve(many * (many + 1));
    for (uint32_t p = 0; p < many; ++p)
      for (uint32_t q = p; q < many; ++q) ij.insert(ij.end(), {p, q});
    Factor factor;
    factor.create(host_, uint32_t(many), ij, single, places.data());
    for (size_t l = 0; l < lanes; ++l)
      factor.solve_eight(kernels, both.data() + l * rows * kLanes, traction.data() + l * rows * kLanes);
  }
  for (size_t l = 0; l < lanes; ++l)
    for (size_t m = l; m < lanes; ++m) {
      double sum[kLanes * kLanes] = {};
      kernels.gram(rows, both.data() + l * rows * kLanes, traction.data() + m * rows * kLanes, sum);
      for (size_t a = 0; a < kLanes; ++a)
        for (size_t b = 0; b < kLanes; ++b) {
          const size_t row = kLanes * l + a, column = kLanes * m + b;
          if (column >= 3 * n || row / 3 > column / 3) continue;
          // on the diagonal blocks of the lanes both orders are there; one of them is taken
          double *const to = block_at(block, row / 3, column / 3);
          to[3 * (row % 3) + column % 3] += sum[kLanes * a + b];
          if (row / 3 == column / 3 && row / kLanes != column / kLanes)
            to[3 * (column % 3) + row % 3] += sum[kLanes * a + b];
        }
    }
  lead_inner(id, kernels, t, rest, young, poisson, traction);
  make_rigid_exact(rest, block);
  model::say(host_, asymmetry_ > 1e-3 ? 2 : 1, id,
             "%zu triangles; before they are made exact, the symmetry of the integrals is off by %.2g, and "
             "forces under rigid motions are %.2g of the stiffness",
             many, asymmetry_, rigid_error_);
}

// u(x) = sum of U t - K u for x inside (Somigliana's identity), t = W^-1 (1/2 + K) u.
void Boundary::lead_inner(const char *id, const Kernels &kernels, const std::vector<Triangle> &t,
                          const double *rest, double young, double poisson,
                          const std::vector<double> &traction) {
  const Kelvin kelvin(young, poisson);
  const size_t rows = 3 * t.size(), columns = 3 * point.size(), own = 3 * inner.size(), row_size = padded();
  follow_.create(host_, own * row_size);
  packed_.create(host_, kLanes * (row_size + own));
  std::vector<double> loads(rows * kLanes);
  for (size_t first = 0; first < own; first += kLanes) {
    const size_t many = std::min(kLanes, own - first);
    for (size_t i = first / 3; 3 * i < first + many; ++i) {
      double solid = 0;
      for (size_t q = 0; q < t.size(); ++q) {
        Integrals at;
        t[q].inner(rest + 3 * size_t(inner[i]), false, at);
        double u[9], k[9];
        kelvin.u(at, u);
        solid += at.normal[0] + at.normal[1] + at.normal[2];
        for (size_t r = 0; r < 3; ++r) {
          const size_t row = 3 * i + r;
          if (row < first || row >= first + many) continue;
          for (size_t s = 0; s < 3; ++s) loads[(3 * q + s) * kLanes + row - first] = u[3 * r + s];
        }
        for (int a = 0; a < 3; ++a) {
          kelvin.double_layer(at, u, a, t[q].c[a], k);
          for (size_t r = 0; r < 3; ++r) {
            const size_t row = 3 * i + r;
            if (row < first || row >= first + many) continue;
            for (size_t s = 0; s < 3; ++s) follow_[row * row_size + 3 * t[q].corner[a] + s] -= k[3 * r + s];
          }
        }
      }
      if (std::fabs(solid + 4 * kPi) < 1) continue;  // NaN on an edge
      model::refuse(
          host_, id,
          "point %u is a corner of cells, but not inside their border: flat cells are there; remove "
          "them, or take the model condensed",
          inner[i]);
    }
    for (size_t l = 0; kLanes * l < columns; ++l) {
      double sum[kLanes * kLanes] = {};
      kernels.gram(rows, loads.data(), traction.data() + l * rows * kLanes, sum);
      for (size_t a = 0; a < many; ++a)
        for (size_t b = 0; b < kLanes && kLanes * l + b < columns; ++b)
          follow_[(first + a) * row_size + kLanes * l + b] += sum[kLanes * a + b];
    }
  }
}

// The six rigid motions r, orthonormal on the surface: the stiffness becomes P K P, P = 1 - r r^T, and inner
// points follow a rigid motion of the surface exactly.
void Boundary::make_rigid_exact(const double *rest, double *block) {
  const size_t n = point.size(), size = 3 * n, all = size + 3 * inner.size();
  std::vector<double> rigid[6], force[6];
  const auto along = [&](const std::vector<double> &a, const std::vector<double> &b) {
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
    for (int twice = 0; twice < 2; ++twice)
      for (size_t l = 0; l < k; ++l) {
        const double part = along(own, rigid[l]);
        for (size_t j = 0; j < all; ++j) own[j] -= part * rigid[l][j];
      }
    const double scale = 1 / std::sqrt(along(own, own));
    for (double &x : own) x *= scale;
  }
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
    left += along(force[k], force[k]);
  }
  rigid_error_ = std::sqrt(left / norm);
  // P K P = K - g r^T - r g^T,  g = K r - r (r^T K r)/2
  double between[6][6];
  for (size_t k = 0; k < 6; ++k)
    for (size_t l = 0; l < 6; ++l) between[k][l] = along(rigid[k], force[l]);
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
  for (size_t row = 0; row < 3 * inner.size(); ++row) {
    double *const follows = follow_.data() + row * padded();
    for (const std::vector<double> &r : rigid) {
      double missing = r[size + row];
      for (size_t j = 0; j < size; ++j) missing -= follows[j] * r[j];
      for (size_t j = 0; j < size; ++j) follows[j] += missing * r[j];
    }
  }
}

template <size_t kWide>
void Boundary::gather(double *f) const {
  const size_t size = 3 * point.size(), row_size = padded();
  double *const own = packed_.data();
  std::fill(own, own + kWide * size, 0.0);
  bool any = false;
  for (size_t row = 0; row < 3 * inner.size(); ++row) {
    double *const from = f + kWide * (3 * size_t(inner[row / 3]) + row % 3);
    if (std::all_of(from, from + kWide, [](double a) { return a == 0; })) continue;
    any = true;
    const double *const follows = follow_.data() + row_size * row;
    for (size_t j = 0; j < size; ++j)
      for (size_t w = 0; w < kWide; ++w) own[kWide * j + w] += follows[j] * from[w];
    std::fill(from, from + kWide, 0.0);
  }
  for (size_t j = 0; any && j < size; ++j)
    for (size_t w = 0; w < kWide; ++w)
      f[kWide * (3 * size_t(point[j / 3]) + j % 3) + w] += own[kWide * j + w];
}

// Of one vector eight sums side by side.
template <size_t kWide>
void Boundary::spread(const Kernels &kernels, double *u) const {
  const size_t size = 3 * point.size(), row_size = padded(), rows = 3 * inner.size();
  double *const own = packed_.data(), *const led = own + kLanes * row_size;
  for (size_t j = 0; j < row_size; ++j)
    for (size_t w = 0; w < kWide; ++w)
      own[kWide * j + w] = j < size ? u[kWide * (3 * size_t(point[j / 3]) + j % 3) + w] : 0;
  if constexpr (kWide == 1) {
    for (size_t row = 0; row < rows; ++row) {
      const double *const follows = follow_.data() + row_size * row;
      double sum[kLanes] = {};
      for (size_t j = 0; j < row_size; j += kLanes)
        for (size_t w = 0; w < kLanes; ++w) sum[w] += follows[j + w] * own[j + w];
      led[row] = ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
    }
  } else {
    kernels.rows(follow_.data(), rows, row_size, own, led);
  }
  for (size_t row = 0; row < rows; ++row)
    std::copy_n(led + kWide * row, kWide, u + kWide * (3 * size_t(inner[row / 3]) + row % 3));
}

template void Boundary::gather<1>(double *) const;
template void Boundary::gather<kLanes>(double *) const;
template void Boundary::spread<1>(const Kernels &, double *) const;
template void Boundary::spread<kLanes>(const Kernels &, double *) const;

}  // namespace reduced
