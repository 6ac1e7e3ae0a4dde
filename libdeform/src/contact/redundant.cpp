#include "contact/redundant.h"

#include <algorithm>
#include <cmath>

#include "contact/friction_kernel.h"

namespace dfm {
namespace {

// Of what is allowed, what one sweep may still change of a velocity.
constexpr double kStands = 0.5;
// Over the slip that is left: sweeps end at half of what is allowed, and laws are asked once more.
constexpr double kAllows = 2.5;

bool carries(const ContactRows &rows, uint32_t i) {
  return rows.wn[i] > 0 && rows.impulse[size_t(3) * i] > 0;
}

}  // namespace

Redundant::Redundant(const Memory &m) { use_memory(m, before_, left_, touched_); }

bool Redundant::found(const ContactRows &rows) {
  touched_.assign(rows.ndof, 0);
  uint32_t loaded = 0, dofs = 0;
  const auto touch = [&](uint32_t dof) {
    dofs += !touched_[dof];
    touched_[dof] = 1;
  };
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!carries(rows, i)) continue;
    ++loaded;
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) touch(rows.dof[j]);
    if (rows.rigid.empty() || rows.rigid[i] == kNone) continue;
    touch(rows.rigid[i]);
    touch(rows.rigid[i] + 1);
  }
  return loaded > dofs;
}

void Redundant::note(const ContactRows &rows) {
  before_.resize(size_t(3) * rows.n);
  for (uint32_t i = 0; i < rows.n; ++i)
    if (rows.wn[i] > 0) store3(&before_[size_t(3) * i], rows.velocity(i));
}

bool Redundant::stands(const ContactRows &rows, const ContactState &state, double h, Tolerance &tolerance) {
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!carries(rows, i)) continue;
    const Vec3 d = rows.velocity(i) - load3(&before_[size_t(3) * i]);
    if (!(std::fabs(d.x) <= kStands * tolerance.most_normal &&
          std::sqrt(d.y * d.y + d.z * d.z) <= kStands * tolerance.tangent[i]))
      return false;
  }
  if (left_.empty()) left_.assign(rows.n, 0.0);
  const LawView law = state.view();
  for (uint32_t i = 0; i < rows.n; ++i) {
    if (!carries(rows, i) || !(rows.wt[i] > 0)) continue;
    const Vec3 u = rows.velocity(i);
    const double *const l = &rows.impulse[size_t(3) * i];
    const Pair t = friction_impulse(law, i, h, rows.wt[i], l[1], l[2], l[0], u.y, u.z);
    const double a = t.a - l[1], b = t.b - l[2];
    const double slip = kAllows * rows.wt[i] * std::sqrt(a * a + b * b);
    left_[i] = std::max(left_[i], std::min(slip, tolerance.most_normal));
  }
  allow(tolerance);
  return true;
}

void Redundant::allow(Tolerance &tolerance) const {
  for (size_t i = 0; i < left_.size(); ++i) tolerance.tangent[i] = std::max(tolerance.tangent[i], left_[i]);
}

}  // namespace dfm
