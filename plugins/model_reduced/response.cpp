// What impulses at surfels change. In the world, with rows J of the surfels' velocities by the spin, the
// center's velocity and the rates of the modes:
//
//   du = J B J^T p,   B = diag( 1/m, inverse inertia, 1 / (1 + h d_k + h^2 l_k) )
//
// An impulse is a force over the length of the step, taken with its end: backward Euler. A condensed body
// adds what its modes leave out, on its way to the response at rest: (1 - a) C_rest p / h^2.
#include <algorithm>

#include "body.h"
#include "small.h"

namespace reduced {
// From the center of mass to a surfel.
void Body::arm(const dfm_kin &k, uint32_t s, double *r) const {
  for (size_t a = 0; a < 3; ++a) {
    r[a] = -at_.c[a];
    for (uint32_t e = row_[s]; e < row_[s + 1]; ++e) r[a] += weight_[e] * k.x[size_t(col_[e]) * k.stride + a];
  }
}

// modal_ = rates of the modes by impulses at all surfels; sum and moment of these, floating.
void Body::take_impulses(const dfm_kin &k, const double *p, double *sum, double *moment) {
  const size_t count = modes_.count;
  std::fill(modal_.data(), modal_.data() + count, 0.0);
  for (uint32_t s = 0; s < nsurfel_; ++s) {
    const double *const impulse = p + 3 * size_t(s);
    if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) continue;
    double local[3], r[3];
    if (elastic_.floating) {
      arm(k, s, r);
      cross_add(r, impulse, 1, moment);
      for (size_t a = 0; a < 3; ++a) sum[a] += impulse[a];
    }
    transposed_product(at_.r, impulse, local);
    const double *const w = surface_.data() + 3 * size_t(s) * count;
    for (size_t m = 0; m < count; ++m)
      modal_[m] += (local[0] * w[m] + local[1] * w[count + m]) + local[2] * w[2 * count + m];
  }
  for (size_t m = 0; m < count; ++m) modal_[m] *= softened_[m];
}

// rows_ = J of these surfels, [3 n, width].
void Body::gather(const dfm_kin &k, uint32_t n, const uint32_t *surfel) {
  const size_t count = modes_.count, width = row_width();
  for (uint32_t c = 0; c < n; ++c) {
    const double *const w = surface_.data() + 3 * size_t(surfel[c]) * count;
    double *const rows = rows_.data() + 3 * width * c;
    for (size_t a = 0; a < 3; ++a) {
      const double *const r = at_.r + 3 * a;
      for (size_t m = 0; m < count; ++m)
        rows[a * width + m] = (r[0] * w[m] + r[1] * w[count + m]) + r[2] * w[2 * count + m];
    }
    if (!elastic_.floating) continue;
    double d[3];
    arm(k, surfel[c], d);
    for (size_t a = 0; a < 3; ++a) {
      double *const rigid = rows + a * width + count;
      const size_t b = (a + 1) % 3, e = (a + 2) % 3;
      for (size_t m = 0; m < 6; ++m) rigid[m] = m == a;
      rigid[3 + b] = d[e];
      rigid[3 + e] = -d[b];
    }
  }
}

// lanes_ = B J^T p of up to kLanes right-hand sides, [width, kLanes].
void Body::weigh(uint32_t n, uint32_t nrhs, const double *p) {
  const size_t count = modes_.count, width = row_width();
  double *const y = lanes_.data();
  std::fill(y, y + kLanes * width, 0.0);
  for (size_t l = 0; l < nrhs; ++l)
    for (size_t c = 0; c < n; ++c) {
      const double *const at = p + 3 * (n * l + c);
      if (at[0] == 0 && at[1] == 0 && at[2] == 0) continue;
      for (size_t a = 0; a < 3; ++a) {
        if (at[a] == 0) continue;
        const double *const row = rows_.data() + width * (3 * c + a);
        for (size_t m = 0; m < width; ++m) y[kLanes * m + l] += at[a] * row[m];
      }
    }
  for (size_t m = 0; m < count; ++m)
    for (size_t l = 0; l < kLanes; ++l) y[kLanes * m + l] *= softened_[m];
  for (size_t l = 0; elastic_.floating && l < nrhs; ++l) {
    double *const own = y + kLanes * count + l;
    const double moment[3] = {own[3 * kLanes], own[4 * kLanes], own[5 * kLanes]};
    double turn[3];
    product(turning_, moment, turn);
    for (size_t a = 0; a < 3; ++a) {
      own[a * kLanes] *= rigid_ / elastic_.total;
      own[(3 + a) * kLanes] = rigid_ * turn[a];
    }
  }
}

void Body::respond(const dfm_kin &k, uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
                   double *du) {
  const size_t width = row_width(), size = 3 * size_t(n);
  gather(k, n, surfel);
  for (uint32_t first = 0; first < nrhs; first += kLanes) {
    const uint32_t many = std::min<uint32_t>(kLanes, nrhs - first);
    weigh(n, many, p + size * first);
    elastic_.kernels->rows(rows_.data(), size, width, lanes_.data(), responses_.data());
    for (size_t l = 0; l < many; ++l)
      for (size_t j = 0; j < size; ++j) du[size * (first + l) + j] = responses_[kLanes * j + l];
  }
  if (!condensed_) return;
  if (!can_be_late()) find_columns(n, surfel);
  add_response_at_rest(n, surfel, nrhs, p, du);
}

void Body::diagonal(const dfm_kin &k, uint32_t n, const uint32_t *surfel, double *w) {
  for (uint32_t c = 0; c < n; ++c)
    for (size_t a = 0; a < 3; ++a) {
      double unit[3] = {}, column[3];
      unit[a] = 1;
      respond(k, 1, surfel + c, 1, unit, column);
      for (size_t b = 0; b < 3; ++b) w[9 * size_t(c) + 3 * b + a] = column[b];
    }
}

// Computes columns of C_rest for those surfels that have none yet, eight at a time. They are kept, since they
// depend on the body alone. A held body needs them only where impulses move all of its points.
void Body::find_columns(uint32_t n, const uint32_t *surfel) {
  size_t wanted[kLanes], many = 0;
  for (uint32_t c = 0; c < n; ++c)
    for (size_t a = 0; a < 3; ++a) {
      const size_t column = 3 * size_t(surfel[c]) + a;
      if (!known_[column]) wanted[many++] = column;
      if (many == kLanes || (many && c + 1 == n && a == 2)) {
        make_columns(many, wanted);
        many = 0;
      }
    }
}

void Body::make_columns(size_t many, const size_t *wanted) {
  double *const f = eight_.data();
  std::fill(f, f + kLanes * size(), 0.0);
  for (size_t l = 0; l < many; ++l)
    for (uint32_t e = row_[wanted[l] / 3]; e < row_[wanted[l] / 3 + 1]; ++e)
      f[kLanes * (3 * size_t(col_[e]) + wanted[l] % 3) + l] += weight_[e];
  elastic_.compliance_of_eight(f, f);
  for (size_t l = 0; l < many; ++l) {
    const double *const w = surface_.data() + wanted[l] * modes_.count;
    for (uint32_t k = 0; k < modes_.count; ++k) modal_[k] = w[k] / modes_.lambda[k];
    const double *const in[] = {modal_.data()};
    double *const out[] = {w_.data()};
    modes_.shape.expand(1, in, out);
    double *const column = columns_.data() + 3 * size_t(nlead_) * wanted[l];
    for (size_t j = 0; j < size(); ++j) w_[j] = f[kLanes * j + l] - w_[j];
    for (size_t j = 0; j < 3 * size_t(nlead_); ++j) column[j] = w_[3 * size_t(point_[j / 3]) + j % 3];
    known_[wanted[l]] = 1;
  }
}

// C_rest from a component of a surfel's force to one of a near point's displacement.
inline double Body::between(uint32_t surfel, size_t component, uint32_t point, size_t other) const {
  const size_t to = 3 * size_t(place_[point]) + other;
  if (!can_be_late()) return columns_[3 * size_t(nlead_) * (3 * size_t(surfel) + component) + to];
  const size_t rows = 3 * size_t(nfree_);
  if (to >= rows) return 0;
  double sum = 0;
  for (uint32_t e = row_[surfel]; e < row_[surfel + 1]; ++e)
    if (place_[col_[e]] < nfree_)
      sum += weight_[e] * near_response_[rows * (3 * size_t(place_[col_[e]]) + component) + to];
  return sum;
}

// Held: all of it that a step can need. It is the inverse at these points, which the forward half of a
// solve gives (Factor::inverse_at), less what the modes hold.
void Body::find_near_response() {
  const size_t rows = 3 * size_t(nfree_), count = modes_.count;
  check_size(nfree_, nfree_);
  near_response_.create_raw(host, rows * rows);
  elastic_.compliance_between(nfree_, point_.data(), near_response_.data());
  const double *const in[] = {modal_.data()};
  double *const out[] = {near_x_.data()};
  for (size_t j = 0; j < rows; ++j) {
    for (uint32_t k = 0; k < count; ++k) modal_[k] = near_shape_.at(j, k) / modes_.lambda[k];
    near_shape_.expand(1, in, out);
    for (size_t i = 0; i < rows; ++i) near_response_[rows * j + i] -= near_x_[i];
  }
}

// near_given_ += of impulses at all surfels, over h^2 like rates.
void Body::add_near_response(const double *p_s) {
  const size_t rows = 3 * size_t(nfree_);
  const double scale = (1 - left_) / (h_ * h_);
  double *const force = near_force_.data(), *const given = near_given_.data();
  std::fill(force, force + rows, 0.0);
  for (uint32_t s = 0; s < nsurfel_; ++s) {
    const double *const impulse = p_s + 3 * size_t(s);
    if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) continue;
    double local[3];
    transposed_product(at_.r, impulse, local);
    for (uint32_t e = row_[s]; e < row_[s + 1]; ++e)
      for (size_t a = 0; a < 3; ++a)
        if (place_[col_[e]] < nfree_)
          force[3 * size_t(place_[col_[e]]) + a] += weight_[e] * (scale * local[a]);
  }
  for (size_t i = 0; i < nfree_; ++i) {
    const double *const f = force + 3 * i, *const c = near_response_.data() + 3 * i * rows;
    if (f[0] == 0 && f[1] == 0 && f[2] == 0) continue;
    for (size_t j = 0; j < rows; ++j) given[j] += (f[0] * c[j] + f[1] * c[rows + j]) + f[2] * c[2 * rows + j];
  }
}

// By surfel that is pushed: its columns, of the pushed ones alone, serve all right-hand sides.
void Body::add_response_at_rest(uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
                                double *du) {
  if (!own_points_) return add_coupled_response_at_rest(n, surfel, nrhs, p, du);
  const double scale = (1 - left_) / (h_ * h_);
  const size_t padded = (size_t(n) + kLanes - 1) / kLanes * kLanes;
  double *const blocks = between_.data(), *const out = blocks + 9 * padded;
  for (uint32_t from = 0; from < n; ++from) {
    bool gathered = false;
    for (size_t rhs = 0; rhs < nrhs; ++rhs) {
      const double *const impulse = p + 3 * (n * rhs + from);
      if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) continue;
      for (size_t to = 0; !gathered && to < n; ++to)
        for (size_t a = 0; a < 3; ++a)
          for (size_t b = 0; b < 3; ++b)
            blocks[(3 * a + b) * padded + to] = between(surfel[from], b, col_[row_[surfel[to]]], a);
      gathered = true;
      double local[3];
      transposed_product(at_.r, impulse, local);
      elastic_.kernels->turned(blocks, padded, at_.r, local, scale, out);
      double *const own = du + 3 * n * rhs;
      for (size_t to = 0; to < n; ++to)
        for (size_t a = 0; a < 3; ++a) own[3 * to + a] += out[a * padded + to];
    }
  }
}

void Body::add_coupled_response_at_rest(uint32_t n, const uint32_t *surfel, uint32_t nrhs, const double *p,
                                        double *du) const {
  const double scale = (1 - left_) / (h_ * h_);
  for (size_t rhs = 0; rhs < nrhs; ++rhs)
    for (uint32_t from = 0; from < n; ++from) {
      const double *const impulse = p + 3 * (n * rhs + from);
      if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) continue;
      double local[3], world[3];
      transposed_product(at_.r, impulse, local);
      for (uint32_t to = 0; to < n; ++to) {
        double u[3] = {};
        for (uint32_t e = row_[surfel[to]]; e < row_[surfel[to] + 1]; ++e)
          for (size_t a = 0; a < 3; ++a)
            u[a] += weight_[e] * ((between(surfel[from], 0, col_[e], a) * local[0] +
                                   between(surfel[from], 1, col_[e], a) * local[1]) +
                                  between(surfel[from], 2, col_[e], a) * local[2]);
        product(at_.r, u, world);
        for (size_t a = 0; a < 3; ++a) du[3 * (n * rhs + to) + a] += scale * world[a];
      }
    }
}

// The displacements at rest by impulses at all surfels, over h^2 like rates, are added to out.
void Body::add_displacement_at_rest(const double *p, double *out) {
  const double scale = (1 - left_) / (h_ * h_);
  for (uint32_t s = 0; s < nsurfel_; ++s) {
    const double *const impulse = p + 3 * size_t(s);
    if (impulse[0] == 0 && impulse[1] == 0 && impulse[2] == 0) continue;
    find_columns(1, &s);
    double local[3];
    transposed_product(at_.r, impulse, local);
    for (size_t a = 0; a < 3; ++a) {
      const double *const column = columns_.data() + 3 * size_t(nlead_) * (3 * size_t(s) + a);
      const double times = scale * local[a];
      for (size_t j = 0; j < 3 * size_t(nlead_); ++j)
        out[3 * size_t(point_[j / 3]) + j % 3] += times * column[j];
    }
  }
  elastic_.lead(out);
}

}  // namespace reduced
