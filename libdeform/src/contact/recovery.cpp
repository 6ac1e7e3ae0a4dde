#include "contact/recovery.h"

#include <algorithm>

#include "contact/friction_kernel.h"

namespace dfm {
namespace {

// Of a contact that opens alone: what contacts of one stack need together is a few times the sum of theirs.
constexpr double kAllowed = 10;

// m/s, the opening that is left after the compliance of the contact under its load.
double opening(const ContactRows &rows, uint32_t i) {
  return -(rows.rate[i] + given(rows.impulse[size_t(i) * 3], &rows.yields[size_t(i) * 2]));
}

// J: what the impulses l do beyond impulses that allow u = 0, if the response is linear,
//     sum l.(u0 + u) / 2 + l.b + soft l^2 / 2    with the velocities u0 without impulses,
// where depths that open count no bias b.
double work_of_opening(const ContactRows &rows, const RowsPart &part) {
  double sum = 0;
  const auto add = [&](uint32_t i, Vec3 bias, double soft) {
    const Vec3 l = load3(&rows.impulse[size_t(i) * 3]);
    if (l.x == 0 && l.y == 0 && l.z == 0) return;
    const Vec3 both = rows.velocity(i) + rows.velocity(i, rows.y_free.data());
    sum += 0.5 * dot(l, both) + dot(l, bias) + 0.5 * soft * norm2(l);
  };
  each_row(part.contacts, [&](uint32_t i) {
    add(i, {rows.rate[i] + std::max(0.0, opening(rows, i)), 0, 0}, 0);
  });
  each_row(part.bonds, [&](uint32_t i) {
    const ContactRows::BondRow &bond = rows.bond[i - rows.n];
    add(i, bond.rate, bond.soft);
  });
  return sum;
}

}  // namespace

bool opens_dearly(const ContactRows &rows, const RowsPart &part, double slow) {
  double put_in = 0, allowed = 0;
  bool any = false;
  each_row(part.contacts, [&](uint32_t i) {
    const double l = rows.impulse[size_t(i) * 3], r = opening(rows, i);
    if (!(l > 0 && r > 0)) return;
    const double counted = std::max(r, slow);
    any = any || (l * r * rows.wn[i] > 0.5 * kAllowed * counted * counted);
    put_in += l * r;
    allowed += (0.5 * kAllowed) * counted * counted / rows.wn[i];
  });
  return any && put_in > allowed && work_of_opening(rows, part) > allowed;
}

void stop_opening(ContactRows &rows, const RowsPart &part) {
  each_row(part.contacts, [&](uint32_t i) { rows.rate[i] = std::max(rows.rate[i], 0.0); });
  const auto drop = [&](uint32_t i) { std::fill_n(&rows.impulse[size_t(i) * 3], 3, 0.0); };
  each_row(part.contacts, drop);
  each_row(part.bonds, drop);
  rows.restore(part);
}

}  // namespace dfm
