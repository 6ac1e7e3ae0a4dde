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

// Of the largest weight of a contact: a point that has less adds less than 1 % to its response.
constexpr double kHolds = 0.1;

bool carries(const ContactRows &rows, uint32_t i) {
  return rows.wn[i] > 0 && rows.impulse[size_t(3) * i] > 0;
}

// f(dof) for the points that a contact holds against each other.
template <class F>
void each_held(const ContactRows &rows, uint32_t i, F &&f) {
  double most = 0;
  for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
    most = std::max(most, std::fabs(rows.weight[j]));
  for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
    if (std::fabs(rows.weight[j]) > kHolds * most) f(rows.dof[j]);
}

}  // namespace

Redundant::Redundant(const Memory &m) {
  use_memory(m, before_, left_, touched_, within_, held_, root_, surplus_);
}

// n points have n - 1 relative motions. Contacts that hold a point alone are removed first, because they are
// independent of the others, until all remaining points are held twice. The groups of these are counted.
bool Redundant::found_at_cuts(const ContactRows &rows, const RowsPart &part, const uint8_t *cut) {
  held_.assign(rows.ndof, 0);
  root_.resize(rows.ndof);
  surplus_.assign(rows.ndof, 0);
  within_.assign(part.n, 0);
  uint32_t k = 0;
  const auto each_within = [&](auto &&f) {
    k = 0;
    each_row(part.contacts, [&](uint32_t i) {
      if (within_[k++]) f(i);
    });
  };
  each_row(part.contacts, [&](uint32_t i) {
    within_[k++] = cut[i] && carries(rows, i);
    if (within_[k - 1]) each_held(rows, i, [&](uint32_t d) { ++held_[d]; });
  });
  for (bool peeled = true; peeled;) {
    peeled = false;
    each_within([&](uint32_t i) {
      bool alone = false;
      each_held(rows, i, [&](uint32_t d) { alone = alone || held_[d] == 1; });
      if (!alone) return;
      each_held(rows, i, [&](uint32_t d) { --held_[d]; });
      within_[k - 1] = 0;
      peeled = true;
    });
  }
  for (uint32_t d = 0; d < rows.ndof; ++d) root_[d] = d;
  const auto root = [&](uint32_t d) {
    while (root_[d] != d) d = root_[d] = root_[root_[d]];
    return d;
  };
  each_within([&](uint32_t i) {
    uint32_t first = kNone;
    each_held(rows, i, [&](uint32_t d) {
      if (first == kNone) first = root(d);
      else root_[root(d)] = first;
    });
  });
  const auto place = [&](uint32_t i) {
    uint32_t at = kNone;
    each_held(rows, i, [&](uint32_t d) { at = root(d); });
    return at;
  };
  for (uint32_t d = 0; d < rows.ndof; ++d)
    if (held_[d]) --surplus_[root(d)];
  each_within([&](uint32_t i) { ++surplus_[place(i)]; });
  bool any = false;
  each_within([&](uint32_t i) { any = any || surplus_[place(i)] >= 0; });
  return any;
}

bool Redundant::found(const ContactRows &rows, const RowsPart &part, const uint8_t *cut) {
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
  return loaded > dofs || (cut && found_at_cuts(rows, part, cut));
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
