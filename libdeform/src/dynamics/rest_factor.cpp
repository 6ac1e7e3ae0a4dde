#include "dynamics/rest_factor.h"

#include <algorithm>

#include "math/polar.h"
#include "math/vec3.h"

namespace dfm {
namespace {

Vec3 times3(const double *m, Vec3 a) {
  return {m[0] * a.x + m[1] * a.y + m[2] * a.z, m[3] * a.x + m[4] * a.y + m[5] * a.z,
          m[6] * a.x + m[7] * a.y + m[8] * a.z};
}

Vec3 times_transposed(const double *m, Vec3 a) {
  return {m[0] * a.x + m[3] * a.y + m[6] * a.z, m[1] * a.x + m[4] * a.y + m[7] * a.z,
          m[2] * a.x + m[5] * a.y + m[8] * a.z};
}

}  // namespace

RestFactor::RestFactor(const Memory &memory, const Phyxels &points, ModelInstance &model,
                       ModelStiffness &stiffness, std::unique_ptr<LinearSolver> solver)
    : p_(points), model_(model), stiffness_(stiffness), solver_(std::move(solver)) {
  use_memory(memory, rest_, state_, stiff_, damp_, diagonal_, turned_, b_, y_, arm_, held_);
  turns_ = !stiffness_.constant();
  rest_ = p_.x;
  if (rests_unplaced(*model_.type))
    for (uint32_t i = 0; i < p_.n; ++i) store3(&rest_[size_t{kStride} * i], load3(&p_.rest[size_t{3} * i]));
  model_.put_initial(state_);  // not the present state: a world that is restored has made this at another one
  for (Array<double> *a : {&diagonal_, &b_, &y_, &arm_}) a->assign(size_t{3} * p_.n, 0.0);
  turned_.assign(size_t{9} * p_.n, 0.0);
  for (size_t k = 0; k < turned_.size(); ++k) turned_[k] = k % 9 % 4 == 0;
  query_stiffness();  // here, not in a step: it takes memory
}

// A model gives its stiffness at the state of its last force evaluation.
bool RestFactor::query_stiffness() {
  if (!stiff_.empty() && params_ == model_.params) return true;
  stiff_.clear();
  h_ = 0;
  const Array<double> still(rest_.size(), 0.0, rest_.get_allocator());
  Array<double> force(still);
  const dfm_kin k = kin_at(0, 0, rest_.data(), still.data(), state_.data());
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
  if (!query_stiffness()) return false;
  h_ = h;
  held_ = p_.held;
  loose_ = p_.held_anywhere() == 0;
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
  const auto place = [x](uint32_t i) { return load3(x + size_t{kStride} * i); };
  rigid_ = rigid_motion(p_.n, p_.mass.data(), place, [](uint32_t) { return Vec3{}; });
  for (uint32_t i = 0; i < p_.n; ++i) store3(&arm_[size_t{3} * i], place(i) - rigid_.center);
}

void RestFactor::turn(const double *x) {
  if (turns_) find_turns(x);
  if (turns_ && loose_) find_rigid(x);
}

// (U^T M U)^-1
RestFactor::Motion RestFactor::motion_of(Vec3 impulse, Vec3 moment) const {
  const Vec3 *const turns = rigid_.turns;
  return {(1 / rigid_.mass) * impulse, moment.x * turns[0] + moment.y * turns[1] + moment.z * turns[2]};
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
  for (uint32_t i = 0; i < p_.n; ++i) add3(x + size_t{3} * i, rigid_at(more, i));
  return true;
}

}  // namespace dfm
