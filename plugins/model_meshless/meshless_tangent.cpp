// Second derivatives of the points that share a gradient.
//
// The step bound. The stiffness K is a sum over points, K_i <= volume (K_rest + excess G) + residual h in
// the order of matrices: K_rest the stiffness at rest in the frame of R, G = slope_a.slope_b, excess no less
// than any eigenvalue of psi'' less that at rest. Norms N_ab of the blocks of K_rest do not depend on R, so
// the diagonal of sum_b (volume N_ab + |h_ab|) + excess volume sum_b |G_ab| is no less than K_i
// (Gershgorin). Rows of the dampers are damping max(1, s^2) times those at rest, s the largest stretch:
// their blocks are F N_ab F^T, and what the turning of the residuals takes away is positive semidefinite.
#include <algorithm>
#include <cmath>

#include "../model_common/index.h"
#include "meshless_body.h"

namespace meshless {

namespace {

// Two stretches that cancel count as this share of their trace: the energy has a kink there.
constexpr double kMinPair = 0.1;

// Largest singular value of lambda a b^T + mu b a^T + mu (a.b) I: across both vectors, and in their plane.
double norm_of(const Solid &c, const double *a, const double *b) {
  const double aa = (a[0] * a[0] + a[1] * a[1]) + a[2] * a[2], ab = (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
  const double bb = (b[0] * b[0] + b[1] * b[1]) + b[2] * b[2];
  const double across2 = std::max(aa * bb - ab * ab, 0.0);  // |a|^2 of b's part across a
  const double m = (c.lambda + 2 * c.mu) * ab, n = c.mu * ab;
  const double sum = ((m * m + n * n) + (c.lambda * c.lambda + c.mu * c.mu) * across2);
  const double det = m * n - c.lambda * c.mu * across2;
  const double root = std::sqrt(std::max(sum * sum - 4 * det * det, 0.0));
  return std::max(std::sqrt(0.5 * (sum + root)), std::fabs(n));
}

using model::dot;

// By how much an eigenvalue may be above that at rest.
double excess_of(const Solid &c, const Modes &m) {
  double most = 0;
  for (int i = 0; i < 3; ++i) {
    double row = 0;
    for (int j = 0; j < 3; ++j) row += std::fabs(m.stretch[i][j] - (c.lambda + (i == j ? 2 * c.mu : 0)));
    most = std::max(std::max(most, row), std::max(m.turn[i], m.shear[i] - 2 * c.mu));
  }
  return most;
}

}  // namespace

void modes_of(Strain strain, const Solid &c, const double *s, Modes &out) {
  if (strain == kGreen) return model::venant_modes(c.lambda, c.mu, s, out);
  const double trace = (s[0] + s[1]) + s[2];
  for (int i = 0; i < 3; ++i) {
    const double x = s[(i + 1) % 3], y = s[(i + 2) % 3];
    for (int j = 0; j < 3; ++j) out.stretch[i][j] = c.lambda + (i == j ? 2 * c.mu : 0);
    const double pair = std::max(x + y, std::max(kMinPair * std::fabs(trace), 1e-3));
    out.turn[i] = 2 * c.mu + (2 * c.lambda * (trace - 3) - 4 * c.mu) / pair;
    out.shear[i] = 2 * c.mu;
  }
}

// Slopes of the point itself and of its neighbors, and the stiffness of their residuals h, in N/m.
uint32_t Body::stencil_of(uint32_t point, double *g, double *h) const {
  const uint32_t n = begin[point + 1] - begin[point] + 1;
  own_slope(point, g);
  std::copy_n(slope.data() + 3 * size_t(begin[point]), 3 * size_t(n - 1), g + 3);
  for (uint32_t b = 1; b < n; ++b) {
    double away[3];
    offset(point, begin[point] + b - 1, away);
    const double w = solid[point].residual * weight[begin[point] + b - 1];
    h[b] = 0;
    for (uint32_t a = 1; a < n; ++a) {
      const double value = (a == b ? w : 0) - w * dot(g + 3 * size_t(a), away);
      h[size_t(n) * a + b] = value;
      h[b] -= value;
    }
  }
  h[0] = 0;
  for (uint32_t b = 1; b < n; ++b) {
    h[size_t(n) * b] = h[b];
    h[0] -= h[b];
  }
  return n;
}

void Body::find_rows(uint32_t point) {
  double *const g = room.data(), *const h = room.data() + 3 * size_t(largest);
  const uint32_t n = stencil_of(point, g, h);
  const Solid &c = solid[point];
  for (uint32_t a = 0; a < n; ++a) {
    double row = 0, all = 0;
    for (uint32_t b = 0; b < n; ++b) {
      row += c.volume * norm_of(c, g + 3 * size_t(a), g + 3 * size_t(b)) + std::fabs(h[size_t(n) * a + b]);
      all += std::fabs(dot(g + 3 * size_t(a), g + 3 * size_t(b)));
    }
    (a ? rows[begin[point] + a - 1] : own_rows[point]) = row;
    (a ? spread[begin[point] + a - 1] : own_spread[point]) = all;
  }
}

void Body::bound(const dfm_kin &k, double *ksum, double *csum) {
  find_gradients(k);
  for (uint32_t i = 0; i < npoint; ++i) {
    const Solid &c = solid[i];
    Shape s;
    Modes m;
    shape_of(gradient.data() + 9 * size_t(i), s);
    modes_of(strain(), c, s.stretch, m);
    const double excess = c.volume * excess_of(c, m);
    double longest = 1;
    for (const double x : s.stretch) longest = std::max(longest, x * x);
    const auto add = [&](uint32_t to, double row, double all) {
      ksum[to] += row + excess * all;
      csum[to] += c.damping * longest * row;
    };
    add(i, own_rows[i], own_spread[i]);
    csum[i] += c.drag;
    for (uint32_t n = begin[i]; n < begin[i + 1]; ++n) add(neighbor[n], rows[n], spread[n]);
  }
}

// Two points answer each other where one gradient has both.
void Body::make_pattern() const {
  if (!row_begin.empty()) return;
  Buffer<uint32_t> first, list, row;
  Buffer<uint8_t> seen;
  first.create(host, size_t(npoint) + 1);
  row.create(host, npoint);
  seen.create(host, npoint);
  for (const bool fill : {false, true}) {
    if (fill) list.create(host, first[npoint]);
    for (uint32_t p = 0; p < npoint; ++p) {
      uint32_t n = 0;
      const auto meet = [&](uint32_t q) {
        if (q < p || seen[q]) return;
        seen[q] = 1;
        row[n++] = q;
      };
      const auto stencil = [&](uint32_t i) {
        meet(i);
        for (uint32_t m = begin[i]; m < begin[i + 1]; ++m) meet(neighbor[m]);
      };
      stencil(p);
      for (uint32_t b = back_begin[p]; b < back_begin[p + 1]; ++b) stencil(back[b].point);
      for (uint32_t m = 0; m < n; ++m) seen[row[m]] = 0;
      if (!fill) {
        first[p + 1] = model::after(first[p], n, "more than 4 billion pairs of points");
        continue;
      }
      std::sort(row.data(), row.data() + n);
      std::copy(row.data(), row.data() + n, list.data() + first[p]);
    }
  }
  row_point.swap(list);
  row_begin.swap(first);
}

uint32_t Body::pairs() const {
  make_pattern();
  return row_begin[npoint];
}

void Body::pattern(uint32_t *ij) const {
  make_pattern();
  for (uint32_t p = 0; p < npoint; ++p)
    for (uint32_t n = row_begin[p]; n < row_begin[p + 1]; ++n) {
      *ij++ = p;
      *ij++ = row_point[n];
    }
}

void Body::add_stiffness(const dfm_kin &k, double a, double b, double *blk) {
  find_gradients(k);
  for (uint32_t i = 0; i < npoint; ++i) add_point(k, i, a, b, blk);
  for (uint32_t i = 0; drag_on && i < npoint; ++i)
    for (size_t n = 0; n < 9; n += 4) blk[9 * size_t(row_begin[i]) + n] -= b * solid[i].drag;
}

// In the axes of S, with y = V^T slope, a pair's block of the energy is
//   stretch_pq y_a[p] y_b[q] + (p = q: sum_r same_pr y_a[r] y_b[r]) + (p != q: crossed_pq y_a[q] y_b[p]),
// same and crossed half the sum and half the difference of shear and turn.
void Body::add_point(const dfm_kin &k, uint32_t point, double a, double b, double *blk) {
  double *const g = room.data(), *const h = g + 3 * size_t(largest), *const y = h + size_t(largest) * largest;
  double *const turned = y + 3 * size_t(largest), *const twist = turned + 3 * size_t(largest);
  const uint32_t n = stencil_of(point, g, h);
  const Solid &c = solid[point];
  const double *const f = gradient.data() + 9 * size_t(point);
  const double damp = b * c.damping;
  Shape s;
  Modes m;
  shape_of(f, s);
  modes_of(strain(), c, s.stretch, m);
  model::cut_negative(m);
  double u[9], ff[9], inverse[9];  // R V, F F^T
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      u[3 * i + j] = (s.rotation[3 * i] * s.axis[0][j] + s.rotation[3 * i + 1] * s.axis[1][j]) +
                     s.rotation[3 * i + 2] * s.axis[2][j];
      ff[3 * i + j] = dot(f + 3 * i, f + 3 * j);
    }
  for (uint32_t e = 0; e < n; ++e)
    for (size_t i = 0; i < 3; ++i) {
      const double *const ge = g + 3 * size_t(e);
      y[3 * size_t(e) + i] = (s.axis[0][i] * ge[0] + s.axis[1][i] * ge[1]) + s.axis[2][i] * ge[2];
      turned[3 * size_t(e) + i] = dot(f + 3 * i, ge);
    }
  if (damp != 0) find_twists(k, point, n, twist, inverse);
  for (uint32_t p = 0; p < n; ++p)
    for (uint32_t q = 0; q < n; ++q) {
      const uint32_t from = p ? neighbor[begin[point] + p - 1] : point;
      const uint32_t to = q ? neighbor[begin[point] + q - 1] : point;
      if (from > to) continue;
      double one[9], block[9];
      model::elastic_block(m, y + 3 * size_t(p), y + 3 * size_t(q), one);
      const double left = h[size_t(n) * p + q];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          double sum = 0;
          for (int r = 0; r < 3; ++r)
            sum += u[3 * i + r] *
                   ((one[3 * r] * u[3 * j] + one[3 * r + 1] * u[3 * j + 1]) + one[3 * r + 2] * u[3 * j + 2]);
          block[3 * i + j] = a * (c.volume * sum + (i == j ? left : 0));
        }
      if (damp != 0) {
        const double *const fp = turned + 3 * size_t(p), *const fq = turned + 3 * size_t(q);
        const double gg = c.mu * dot(g + 3 * size_t(p), g + 3 * size_t(q));
        const double *const bp = twist + 9 * size_t(p), *const bq = twist + 9 * size_t(q);
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            double turning_part = 0;  // (B_p^T J^-1 B_q)_ij
            for (int r = 0; r < 3; ++r)
              turning_part += bp[3 * r + i] * ((inverse[3 * r] * bq[j] + inverse[3 * r + 1] * bq[3 + j]) +
                                               inverse[3 * r + 2] * bq[6 + j]);
            block[3 * i + j] +=
                damp * (c.volume * (c.lambda * fp[i] * fq[j] + gg * ff[3 * i + j] + c.mu * fq[i] * fp[j]) +
                        ((i == j ? left : 0) - c.residual * turning_part));
          }
      }
      const uint32_t *const row = row_point.data(), *const end = row + row_begin[from + 1];
      double *const out = blk + 9 * size_t(std::lower_bound(row + row_begin[from], end, to) - row);
      for (int e = 0; e < 9; ++e) out[e] -= block[e];
    }
}

// B_p of sum_p B_p v_p = sum w r x r', and J^-1.
void Body::find_twists(const dfm_kin &k, uint32_t point, uint32_t n, double *twist, double *inverse) {
  double *const residuals = pull.data() + 3 * size_t(begin[point]);
  for (uint32_t p = 0; p + 1 < n; ++p) residual(k, point, begin[point] + p, residuals + 3 * size_t(p));
  turning_inverse(residuals, point, inverse);
  std::fill(twist, twist + 9, 0.0);
  for (uint32_t p = 1; p < n; ++p) {
    const double *const r = residuals + 3 * size_t(p - 1), w = weight[begin[point] + p - 1];
    const double cross[9] = {0, -w * r[2], w * r[1], w * r[2], 0, -w * r[0], -w * r[1], w * r[0], 0};
    for (int e = 0; e < 9; ++e) {
      twist[9 * size_t(p) + size_t(e)] = cross[e];
      twist[e] -= cross[e];
    }
  }
}

}  // namespace meshless
