#include "contact/fixed_limits.h"

#include <algorithm>
#include <cmath>

#include "contact/friction_kernel.h"

namespace dfm {

ExcessWork excess_work(const ContactRows &rows, const RowsPart &part) {
  ExcessWork out;
  const auto add = [&](uint32_t i, Vec3 bias, double soft) {
    const Vec3 l = load3(&rows.impulse[size_t(i) * 3]);
    if (l.x == 0 && l.y == 0 && l.z == 0) return;
    const Vec3 free = rows.velocity(i, rows.y_free.data());
    const double start = dot(l, free + bias);
    out.work += 0.5 * dot(l, rows.velocity(i) - free) + 0.5 * soft * norm2(l) + start;
    out.scale += std::fabs(start);
  };
  // Without what contacts give (rows.yields), which only dissipates.
  each_row(part.contacts, [&](uint32_t i) { add(i, {rows.rate[i], 0, 0}, 0); });
  each_row(part.bonds, [&](uint32_t i) {
    const ContactRows::BondRow &bond = rows.bond[i - rows.n];
    add(i, bond.rate, bond.soft);
  });
  return out;
}

void drop_impulses(ContactRows &rows, const RowsPart &part) {
  const auto drop = [&](uint32_t i) { std::fill_n(&rows.impulse[size_t(i) * 3], 3, 0.0); };
  each_row(part.contacts, drop);
  each_row(part.bonds, drop);
  rows.restore(part);
}

void fix_limits(const ContactRows &rows, const RowsPart &part, const ContactState &law,
                Array<double> &limit) {
  limit.clear();
  each_row(part.contacts, [&](uint32_t i) {
    const double ln = rows.impulse[size_t(i) * 3], fn = law.fn[i];
    limit.push_back(ln > 0 && fn > 0 && law.form[i] != kNoFriction ? law.limit[i] / fn * ln : 0.0);
  });
}

void sweep_fixed(ContactRows &rows, const RowsPart &part, const double *limit) {
  each_row(part.contacts, [&](uint32_t i) {
    const double most = *limit++;
    if (!(rows.wn[i] > 0)) return;  // both sides are held: impulses have no effect
    double *const l = &rows.impulse[size_t(i) * 3];
    const Vec3 u = rows.velocity(i);
    const double ln = normal_impulse(l[0], u.x + rows.rate[i], rows.wn[i], &rows.yields[size_t(i) * 2]),
                 d = ln - l[0];
    double t1 = 0, t2 = 0;
    if (most > 0 && rows.wt[i] > 0) {
      t1 = l[1] - (u.y + rows.cross[2 * size_t(i)] * d) / rows.wt[i];
      t2 = l[2] - (u.z + rows.cross[2 * size_t(i) + 1] * d) / rows.wt[i];
      const double size = std::sqrt(t1 * t1 + t2 * t2);
      if (size > most) {
        t1 *= most / size;
        t2 *= most / size;
      }
    }
    if (d == 0 && t1 == l[1] && t2 == l[2]) return;
    rows.apply(i, {d, t1 - l[1], t2 - l[2]});
    l[0] = ln;
    l[1] = t1;
    l[2] = t2;
  });
}

}  // namespace dfm
