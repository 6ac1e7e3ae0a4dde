#include "contact/redundant.h"

#include <algorithm>
#include <cmath>

#include "contact/friction_kernel.h"

namespace dfm {
namespace {

// Share of the tolerance by which one sweep may still change a velocity.
constexpr double kStands = 0.5;
// Factor on the remaining slip: sweeps end at half of the tolerance, and laws are evaluated once more.
constexpr double kAllows = 2.5;

bool carries(const ContactRows &rows, uint32_t i) {
  return rows.wn[i] > 0 && rows.impulse[size_t(3) * i] > 0;
}

}  // namespace

Redundant::Redundant(const Memory &m) { use_memory(m, before_, left_, touched_); }

bool Redundant::found(const ContactRows &rows, const RowsPart &part) {
  touched_.assign(rows.ndof, 0);
  uint32_t loaded = 0, dofs = 0;
  const auto touch = [&](uint32_t dof) {
    dofs += !touched_[dof];
    touched_[dof] = 1;
  };
  each_row(part.contacts, [&](uint32_t i) {
    if (!carries(rows, i)) return;
    ++loaded;
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) touch(rows.dof[j]);
    if (rows.rigid.empty() || rows.rigid[i] == kNone) return;
    touch(rows.rigid[i]);
    touch(rows.rigid[i] + 1);
  });
  return loaded > dofs;
}

void Redundant::note(const ContactRows &rows, const RowsPart &part) {
  before_.resize(size_t(3) * part.n);
  double *to = before_.data();
  each_row(part.contacts, [&](uint32_t i) {
    if (rows.wn[i] > 0) store3(to, rows.velocity(i));
    to += 3;
  });
}

bool Redundant::stands(const ContactRows &rows, const RowsPart &part, const ContactState &state, double h,
                       const Tolerance &tolerance) {
  const double *from = before_.data();
  bool still = true;
  each_row(part.contacts, [&](uint32_t i) {
    const Vec3 before = load3(from);
    from += 3;
    if (!still || !carries(rows, i)) return;
    const Vec3 d = rows.velocity(i) - before;
    still = std::fabs(d.x) <= kStands * tolerance.most_normal &&
            std::sqrt(d.y * d.y + d.z * d.z) <= kStands * tolerance.tangent[i];
  });
  if (!still) return false;
  if (left_.empty()) left_.assign(part.n, 0.0);
  const LawView law = state.view();
  double *left = left_.data();
  each_row(part.contacts, [&](uint32_t i) {
    double &own = *left++;
    if (!carries(rows, i) || !(rows.wt[i] > 0)) return;
    const Vec3 u = rows.velocity(i);
    const double *const l = &rows.impulse[size_t(3) * i];
    const Pair t = friction_impulse(law, i, h, rows.wt[i], l[1], l[2], l[0], u.y, u.z);
    const double a = t.a - l[1], b = t.b - l[2];
    const double slip = kAllows * rows.wt[i] * std::sqrt(a * a + b * b);
    own = std::max(own, std::min(slip, tolerance.most_normal));
  });
  allow(part, tolerance);
  return true;
}

void Redundant::allow(const RowsPart &part, const Tolerance &tolerance) const {
  if (left_.empty()) return;
  const double *left = left_.data();
  each_row(part.contacts,
           [&](uint32_t i) { tolerance.tangent[i] = std::max(tolerance.tangent[i], *left++); });
}

}  // namespace dfm
