#include "dynamics/rest_factor.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "math/block3.h"
#include "math/polar.h"

namespace dfm {
namespace {

constexpr uint32_t kRigid = 6;  // motions
// determinant of an inertia over the cube of its mean: below it the points are on a line
constexpr double kOnALine = 1e-9;

Vec3 times_transposed(const double *m, Vec3 a) {
  return {m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
          m[2] * a.x + m[5] * a.y + m[8] * a.z};
}

Vec3 axis(uint32_t k) { return {double(k == 0), double(k == 1), double(k == 2)}; }

// Displacement of a point at this arm by the rigid motion k.
Vec3 rigid_column(uint32_t k, Vec3 arm) { return k < 3 ? axis(k) : cross(axis(k - 3), arm); }

}  // namespace

RestFactor::RestFactor(const Memory &memory, const Phyxels &points, ModelInstance &model,
                       ModelStiffness &stiffness, std::unique_ptr<LinearSolver> solver)
    : p_(points), model_(model), stiffness_(stiffness), solver_(std::move(solver)) {
  use_memory(memory, rest_, state_, stiff_, damp_, diagonal_, turned_, b_, y_, arm_, moved_, asked_);
  use_memory(memory, left_, right_, held_);
  turns_ = !stiffness_.constant();
  rest_ = p_.x;
  if (rests_unplaced(*model_.type))
    for (uint32_t i = 0; i < p_.n; ++i) store3(&rest_[size_t{kStride} * i], load3(&p_.rest[size_t{3} * i]));
  state_.assign(model_.state.begin(), model_.state.end());
  for (Array<double> *a : {&diagonal_, &b_, &y_, &arm_}) a->assign(size_t{3} * p_.n, 0.0);
  turned_.assign(size_t{9} * p_.n, 0.0);
  for (size_t k = 0; k < turned_.size(); ++k) turned_[k] = k % 9 % 4 == 0;
  ask_model();  // steps run on any thread, where no memory may be allocated
}

// A model gives its stiffness at the state of its last force evaluation.
bool RestFactor::ask_model() {
  if (!stiff_.empty() && params_ == model_.params) return true;
  stiff_.clear();
  h_ = 0;
  const Array<double> still(rest_.size(), 0.0, rest_.get_allocator());
  Array<double> force(still);
  dfm_kin k{};
  k.size = sizeof k;
  k.stride = kStride;
  k.x = rest_.data();
  k.v = still.data();
  k.state = state_.data();
  if (model_.call("add_forces", [&] { return model_.ops->add_forces(model_.self, &k, force.data()); }) !=
          DFM_OK ||
      !stiffness_.evaluate(model_, k, 0, 1))
    return false;
  damp_ = stiffness_.blocks();
  if (!stiffness_.evaluate(model_, k, 1, 0)) return false;
  params_ = model_.params;
  stiff_ = stiffness_.blocks();
  return true;
}

bool RestFactor::prepare(double h) {
  if (h_ == h && held_ == p_.held && params_ == model_.params) return serves_;
  serves_ = false;
  try {
    if (!ask_model()) return false;
  } catch (const std::bad_alloc &) {  // new parameters, on any thread that moves this body
    return false;
  }
  h_ = h;
  held_ = p_.held;
  loose_ = std::all_of(held_.begin(), held_.end(), [](uint8_t held) { return held == 0; });
  const bool in_part =
      std::any_of(held_.begin(), held_.end(), [](uint8_t held) { return held != 0 && held != 7; });
  if (turns_ && in_part) return false;
  Array<double> &blocks = stiffness_.blocks();
  for (size_t k = 0; k < blocks.size(); ++k) blocks[k] = -h * damp_[k] - h * h * stiff_[k];
  stiffness_.each_own([&](uint32_t i, double *block) {
    for (uint32_t c = 0; c < 3; ++c) block[4 * c] += p_.mass[i];
    const double mean = (block[0] + block[4] + block[8]) / 3;
    for (uint32_t c = 0; c < 3; ++c)
      diagonal_[3 * size_t{i} + c] = p_.held[i] & (1 << c) ? 0 : turns_ ? mean : block[4 * c];
  });
  hold_components(stiffness_.pattern(), p_.held.data(), blocks.data());
  return serves_ = solver_->factor(blocks.data());
}

// Least squares over the pairs of coupled points, each by its direction; if a neighborhood is flat or
// inverted, the rotation of the whole body is used.
void RestFactor::find_turns(const double *x) {
  std::fill(turned_.begin(), turned_.end(), 0.0);
  const BlockPattern pattern = stiffness_.pattern();
  for (uint32_t b = 0; b < pattern.nb; ++b) {
    const size_t i = pattern.ij[2 * size_t{b}], j = pattern.ij[2 * size_t{b} + 1];
    const Vec3 rest = load3(&rest_[kStride * j]) - load3(&rest_[kStride * i]);
    const double square = norm2(rest);
    if (!(square > 0)) continue;
    const Vec3 now = (1 / square) * (load3(x + kStride * j) - load3(x + kStride * i));
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const double term = now[r] * rest[c];
        turned_[9 * i + size_t(3 * r + c)] += term;
        turned_[9 * j + size_t(3 * r + c)] += term;
      }
  }
  double whole[9] = {}, body[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (size_t k = 0; k < turned_.size(); ++k) whole[k % 9] += turned_[k];
  polar_rotation(whole, body);
  for (uint32_t i = 0; i < p_.n; ++i) {
    double *const own = &turned_[size_t{9} * i];
    if (!polar_rotation(own, own)) std::copy_n(body, 9, own);
  }
}

void RestFactor::find_rigid(const double *x) {
  rigid_ = {};
  for (uint32_t i = 0; i < p_.n; ++i) {
    rigid_.mass += p_.mass[i];
    rigid_.center += p_.mass[i] * load3(x + size_t{kStride} * i);
  }
  rigid_.center = (1 / rigid_.mass) * rigid_.center;
  double inertia[9] = {};
  for (uint32_t i = 0; i < p_.n; ++i) {
    const Vec3 r = load3(x + size_t{kStride} * i) - rigid_.center;
    store3(&arm_[size_t{3} * i], r);
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) inertia[3 * j + k] += p_.mass[i] * ((j == k ? norm2(r) : 0) - r[j] * r[k]);
  }
  const double mean = (inertia[0] + inertia[4] + inertia[8]) / 3;
  if (!(mean > 0)) return;
  for (double &value : inertia) value /= mean;
  // rotation about the line of the points moves nothing
  if (!(determinant3(inertia) > kOnALine))
    for (int j = 0; j < 3; ++j) inertia[4 * j] += kOnALine;
  inverse3(inertia, rigid_.inverse);
  for (double &value : rigid_.inverse) value /= mean;
}

void RestFactor::turn(const double *x) {
  if (turns_) find_turns(x);
  moved_.clear();
  if (turns_ && loose_) find_rigid(x);
}

// (U^T M U)^-1
RestFactor::Motion RestFactor::motion_of(Vec3 impulse, Vec3 moment) const {
  return {(1 / rigid_.mass) * impulse, times3(rigid_.inverse, moment)};
}

bool RestFactor::solve(const double *b, double *x) {
  SolveInfo info;
  if (!turns_) return solver_->solve(1, b, x, 0, info);
  Motion given;
  if (loose_) {
    Vec3 impulse, moment;
    for (uint32_t i = 0; i < p_.n; ++i) {
      const Vec3 own = load3(b + size_t{3} * i);
      impulse += own;
      moment += cross(load3(&arm_[size_t{3} * i]), own);
    }
    given = motion_of(impulse, moment);
  }
  const auto rigid_at = [&](const Motion &m, uint32_t i) {
    return m.speed + cross(m.spin, load3(&arm_[size_t{3} * i]));
  };
  for (uint32_t i = 0; i < p_.n; ++i) {
    const Vec3 own = load3(b + size_t{3} * i) - p_.mass[i] * rigid_at(given, i);
    store3(&b_[size_t{3} * i], times_transposed(&turned_[size_t{9} * i], own));
  }
  if (!solver_->solve(1, b_.data(), y_.data(), 0, info)) return false;
  Vec3 impulse, moment;
  for (uint32_t i = 0; i < p_.n; ++i) {
    const Vec3 own = times3(&turned_[size_t{9} * i], load3(&y_[size_t{3} * i]));
    store3(x + size_t{3} * i, own);
    impulse += p_.mass[i] * own;
    moment += cross(load3(&arm_[size_t{3} * i]), p_.mass[i] * own);
  }
  if (!loose_) return true;
  const Motion found = motion_of(impulse, moment);
  const Motion more{given.speed - found.speed, given.spin - found.spin};
  for (uint32_t i = 0; i < p_.n; ++i) store3(x + size_t{3} * i, load3(x + size_t{3} * i) + rigid_at(more, i));
  return true;
}

// G A0^-1 G^T M U
bool RestFactor::find_moved() {
  const size_t rows = size_t{3} * p_.n;
  asked_.resize(kRigid * rows);
  moved_.resize(kRigid * rows);
  for (uint32_t k = 0; k < kRigid; ++k)
    for (uint32_t i = 0; i < p_.n; ++i)
      store3(&asked_[k * rows + size_t{3} * i],
             times_transposed(&turned_[size_t{9} * i],
                              p_.mass[i] * rigid_column(k, load3(&arm_[size_t{3} * i]))));
  SolveInfo info;
  if (!solver_->solve(kRigid, asked_.data(), moved_.data(), 0, info)) return false;
  for (uint32_t k = 0; k < kRigid; ++k)
    for (uint32_t i = 0; i < p_.n; ++i) {
      double *const at = &moved_[k * rows + size_t{3} * i];
      store3(at, times3(&turned_[size_t{9} * i], load3(at)));
    }
  return true;
}

// T^T B T + U H U^T - B with B = G A0^-1 G^T, H = (U^T M U)^-1, Z = B M U and N = (M U)^T Z is
// -(L R^T + R L^T) with L = U H and R = Z - U (H N + 1) / 2.
bool RestFactor::add_rigid(uint32_t count, const uint32_t *points, double *w) {
  if (moved_.empty() && !find_moved()) return false;
  const size_t rows = size_t{3} * p_.n;
  double y[kRigid][kRigid];  // (H N + 1) / 2
  for (uint32_t k = 0; k < kRigid; ++k) {
    Vec3 impulse, moment;
    for (uint32_t i = 0; i < p_.n; ++i) {
      const Vec3 own = p_.mass[i] * load3(&moved_[k * rows + size_t{3} * i]);
      impulse += own;
      moment += cross(load3(&arm_[size_t{3} * i]), own);
    }
    const Motion m = motion_of(impulse, moment);
    for (uint32_t r = 0; r < kRigid; ++r)
      y[r][k] = 0.5 * ((r < 3 ? m.speed[int(r)] : m.spin[int(r) - 3]) + (r == k));
  }
  left_.resize(size_t{3} * kRigid * count);
  right_.resize(left_.size());
  for (uint32_t i = 0; i < count; ++i) {
    const Vec3 arm = load3(&arm_[size_t{3} * points[i]]);
    Vec3 u[kRigid];
    for (uint32_t k = 0; k < kRigid; ++k) u[k] = rigid_column(k, arm);
    for (uint32_t k = 0; k < kRigid; ++k) {
      Vec3 l, r = load3(&moved_[k * rows + size_t{3} * points[i]]);
      if (k < 3) l = (1 / rigid_.mass) * u[k];
      else
        for (uint32_t j = 0; j < 3; ++j) l += rigid_.inverse[3 * j + (k - 3)] * u[3 + j];
      for (uint32_t j = 0; j < kRigid; ++j) r -= y[j][k] * u[j];
      for (uint32_t c = 0; c < 3; ++c) {
        left_[(size_t{3} * i + c) * kRigid + k] = l[int(c)];
        right_[(size_t{3} * i + c) * kRigid + k] = r[int(c)];
      }
    }
  }
  const size_t wide = size_t{3} * count;
  for (size_t r = 0; r < wide; ++r)
    for (size_t c = 0; c <= r; ++c) {
      double sum = 0;
      for (size_t k = 0; k < kRigid; ++k)
        sum +=
            left_[r * kRigid + k] * right_[c * kRigid + k] + right_[r * kRigid + k] * left_[c * kRigid + k];
      w[c * wide + r] = w[r * wide + c] -= sum;
    }
  return true;
}

bool RestFactor::restricted(uint32_t count, const uint32_t *points, double *w) {
  SolveInfo info;
  if (!solver_->restricted(count, points, 0, w, info)) return false;
  if (!turns_) return true;
  const size_t wide = size_t{3} * count;
  for (uint32_t i = 0; i < count; ++i)
    for (uint32_t j = 0; j <= i; ++j) {
      const double *const left = &turned_[size_t{9} * points[i]], *const right =
                                                                      &turned_[size_t{9} * points[j]];
      double *const block = w + 3 * i * wide + 3 * size_t{j};
      double half[9];
      for (size_t r = 0; r < 3; ++r) store3(half + 3 * r, times3(right, load3(block + r * wide)));
      for (size_t r = 0; r < 3; ++r)
        for (size_t c = 0; c < 3; ++c) {
          if (i == j && c > r) continue;
          const double value =
              (left[3 * r] * half[c] + left[3 * r + 1] * half[3 + c]) + left[3 * r + 2] * half[6 + c];
          block[r * wide + c] = value;
          w[(3 * size_t{j} + c) * wide + 3 * i + r] = value;
        }
    }
  return !loose_ || add_rigid(count, points, w);
}

}  // namespace dfm
