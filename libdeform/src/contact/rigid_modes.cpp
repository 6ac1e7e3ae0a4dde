#include "contact/rigid_modes.h"

#include <algorithm>
#include <cmath>

#include "math/block3.h"

namespace dfm {
RigidModes::RigidModes(const Memory &m) { use_memory(m, bodies_, body_of_dof_, arm_, matrix_, sums_, seen_); }

void RigidModes::find_bodies(const MatrixPoints &points) {
  bodies_.clear();
  for (const MatrixPoints::Loose &l : points.loose) {
    Body b{l.first, l.n, 0, 0, {}, {}, {}};
    for (uint32_t i = l.first; i < l.first + l.n; ++i) {
      b.mass += points.mass[i];
      b.center += points.mass[i] * load3(points.x + size_t(4) * i);
    }
    b.center = (1 / b.mass) * b.center;
    for (uint32_t i = l.first; i < l.first + l.n; ++i) {
      const Vec3 r = load3(points.x + size_t(4) * i) - b.center;
      const double m = points.mass[i], rr = norm2(r);
      b.radius = std::max(b.radius, std::sqrt(rr));
      for (int j = 0; j < 3; ++j)
        for (int k = 0; k < 3; ++k) b.inertia[3 * j + k] += m * ((j == k ? rr : 0) - r[j] * r[k]);
    }
    // points on a line turn about it for nothing
    const double least = 1e-9 * (b.inertia[0] + b.inertia[4] + b.inertia[8]);
    for (int j = 0; j < 3; ++j) b.inertia[4 * j] += least;
    // fewer than two points in different places have no rigid rotation
    if (!(least > 0)) continue;
    inverse3(b.inertia, b.inverse);
    bodies_.push_back(b);
  }
  sums_.resize(6 * bodies_.size());
  matrix_.resize(36 * bodies_.size() * bodies_.size());
}

void RigidModes::start(const ContactRows &rows, const MatrixPoints &points, std::span<const uint32_t> place) {
  find_bodies(points);
  body_of_dof_.assign(rows.ndof, kNone);
  arm_.resize(rows.ndof);
  for (uint32_t d = 0; d < rows.ndof; ++d)
    for (uint32_t k = 0; k < bodies_.size() && place[d] != kNone; ++k)
      if (place[d] >= bodies_[k].first && place[d] < bodies_[k].first + bodies_[k].n) {
        body_of_dof_[d] = k;
        arm_[d] = load3(points.x + size_t(4) * place[d]) - bodies_[k].center;
      }
}

void RigidModes::see(const ContactRows &rows, uint32_t i) {
  seen_.clear();
  const double *const f = &rows.frame[size_t(i) * 9];
  for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) {
    const uint32_t body = body_of_dof_[rows.dof[j]];
    if (body == kNone) continue;
    Seen *to = nullptr;
    for (Seen &s : seen_)
      if (s.body == body) to = &s;
    if (!to) {
      seen_.push_back({body, {}});
      to = &seen_.back();
    }
    for (uint32_t axis = 0; axis < 3; ++axis) {
      // e . (t + w x r) = e . t + (r x e) . w
      const Vec3 e = rows.weight[j] * load3(f + 3 * size_t(axis)), m = cross(arm_[rows.dof[j]], e);
      double *const row = to->by + 6 * size_t(axis);
      store3(row, load3(row) + e);
      store3(row + 3, load3(row + 3) + m);
    }
  }
}

void RigidModes::factor(const ContactRows &rows, const double *slope) {
  const size_t width = 6 * bodies_.size();
  if (width == 0) return;
  std::fill(matrix_.begin(), matrix_.end(), 0.0);
  for (size_t b = 0; b < bodies_.size(); ++b)
    for (size_t j = 0; j < 3; ++j) {
      matrix_[(6 * b + j) * width + 6 * b + j] = bodies_[b].mass;
      for (size_t k = 0; k < 3; ++k)
        matrix_[(6 * b + 3 + j) * width + 6 * b + 3 + k] = bodies_[b].inertia[3 * j + k];
    }
  for (uint32_t i = 0; i < rows.n; ++i) {
    const double *const c = slope + size_t(4) * i;
    if (!(c[0] > 0 || c[1] > 0 || c[3] > 0)) continue;
    see(rows, i);
    for (const Seen &s : seen_) {
      double by[18];
      for (size_t k = 0; k < 6; ++k) {
        by[k] = c[0] * s.by[k];
        by[6 + k] = c[1] * s.by[6 + k] + c[2] * s.by[12 + k];
        by[12 + k] = c[2] * s.by[6 + k] + c[3] * s.by[12 + k];
      }
      for (const Seen &t : seen_)
        for (size_t r = 0; r < 6; ++r)
          for (size_t k = 0; k < 6; ++k)
            matrix_[(6 * t.body + r) * width + 6 * s.body + k] +=
                t.by[r] * by[k] + t.by[6 + r] * by[6 + k] + t.by[12 + r] * by[12 + k];
    }
  }
  for (size_t c = 0; c < width; ++c)
    for (size_t r = c; r < width; ++r) {
      double sum = matrix_[r * width + c];
      for (size_t k = 0; k < c; ++k) sum -= matrix_[r * width + k] * matrix_[c * width + k];
      matrix_[r * width + c] = r == c ? std::sqrt(sum) : sum / matrix_[c * width + c];
    }
}

void RigidModes::collect(const MatrixPoints &points, const double *r, double *sums) const {
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Body &body = bodies_[b];
    Vec3 sum, moment;
    for (uint32_t i = body.first; i < body.first + body.n; ++i) {
      const Vec3 p = load3(r + size_t(4) * i);
      sum += p;
      moment += cross(load3(points.x + size_t(4) * i) - body.center, p);
    }
    store3(sums + 6 * b, sum);
    store3(sums + 6 * b + 3, moment);
  }
}

double RigidModes::precondition(const MatrixPoints &points, const double *r, double *z) {
  const size_t width = 6 * bodies_.size();
  collect(points, r, sums_.data());
  for (size_t c = 0; c < width; ++c) {
    for (size_t k = 0; k < c; ++k) sums_[c] -= matrix_[c * width + k] * sums_[k];
    sums_[c] /= matrix_[c * width + c];
  }
  for (size_t c = width; c-- > 0;) {
    for (size_t k = c + 1; k < width; ++k) sums_[c] -= matrix_[k * width + c] * sums_[k];
    sums_[c] /= matrix_[c * width + c];
  }
  double most = 0;
  for (size_t b = 0; b < bodies_.size(); ++b) {
    const Body &body = bodies_[b];
    const Vec3 t = load3(&sums_[6 * b]), w = load3(&sums_[6 * b + 3]);
    most = std::max(most, norm(t) + body.radius * norm(w));
    for (uint32_t i = body.first; i < body.first + body.n; ++i) {
      double *const to = z + size_t(4) * i;
      store3(to, load3(to) + (t + cross(w, load3(points.x + size_t(4) * i) - body.center)));
    }
  }
  return most;
}

void RigidModes::give(const MatrixPoints &points, const double *r, double *v) const {
  for (const Body &body : bodies_) {
    Vec3 sum, moment;
    for (uint32_t i = body.first; i < body.first + body.n; ++i) {
      const Vec3 p = load3(r + size_t(4) * i);
      sum += p;
      moment += cross(load3(points.x + size_t(4) * i) - body.center, p);
    }
    const Vec3 t = (1 / body.mass) * sum, w = times3(body.inverse, moment);
    for (uint32_t i = body.first; i < body.first + body.n; ++i) {
      double *const to = v + size_t(4) * i;
      store3(to, load3(to) + (t + cross(w, load3(points.x + size_t(4) * i) - body.center)));
    }
  }
}

void RigidModes::add_response(const MatrixPoints &points, double *response) const {
  for (const Body &body : bodies_)
    for (uint32_t i = body.first; i < body.first + body.n; ++i) {
      const Vec3 r = load3(points.x + size_t(4) * i) - body.center;
      const Vec3 axes[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
      for (size_t k = 0; k < 3; ++k) {
        const Vec3 m = cross(r, axes[k]);
        response[size_t(4) * i + k] += 1 / body.mass + dot(m, times3(body.inverse, m));
      }
    }
}

}  // namespace dfm
