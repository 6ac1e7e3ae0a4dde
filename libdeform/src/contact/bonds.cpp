#include "contact/bonds.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

// The impulse of a drag along its way, at the impulses that the others have. It is one unknown and found in
// closed form: what stops the edge, the limit, or what does the remaining work W,
//
//     l (s - w l) = W with the speed s without it,   l = 2 W / (s + sqrt(s^2 - 4 w W))
struct Drag { double impulse, limit; };
Drag drag_of(const ContactRows &rows, uint32_t row) {
  const ContactRows::BondRow &b = rows.bond[row - rows.n];
  const double now = dot(b.along, load3(&rows.impulse[size_t{3} * row]));
  const double speed = b.w * now - dot(b.along, rows.velocity(row));
  if (!(speed > 0)) return {0, b.most};
  const double l = b.w > 0 ? std::min(b.most, speed / b.w) : b.most;
  if (l * (speed - b.w * l) <= b.max_work) return {l, b.most};
  const double paid =
      2 * b.max_work / (speed + std::sqrt(std::max(0.0, speed * speed - 4 * b.w * b.max_work)));
  return {paid, paid};
}

// The part of a residual that the bond's impulse is to bring to zero.
Vec3 counted(const ContactRows::BondRow &b, Vec3 r) {
  for (int c = 0; c < 3; ++c)
    if (b.inverse[c][c] == 0) r[c] = 0;
  return r;
}

// N s, by which the bond's impulse changes while all others stay.
Vec3 change_of(const ContactRows &rows, uint32_t row) {
  const ContactRows::BondRow &b = rows.bond[row - rows.n];
  if (b.drags()) return drag_of(rows, row).impulse * b.along - load3(&rows.impulse[size_t{3} * row]);
  const Vec3 r = bond_residual(rows, row);
  return {-dot(b.inverse[0], r), -dot(b.inverse[1], r), -dot(b.inverse[2], r)};
}

}  // namespace

Vec3 bond_residual(const ContactRows &rows, uint32_t row) {
  const ContactRows::BondRow &b = rows.bond[row - rows.n];
  const Vec3 l = load3(&rows.impulse[size_t{3} * row]);
  if (b.drags()) return b.w * (drag_of(rows, row).impulse * b.along - l);
  return counted(b, rows.velocity(row) + b.rate + b.soft * l);
}

void limit_drag(ContactRows &rows, uint32_t row) { rows.bond[row - rows.n].most = drag_of(rows, row).limit; }

void sweep_bonds(ContactRows &rows, const RowsPart &part) {
  each_row(part.bonds, [&](uint32_t row) {
    const Vec3 change = change_of(rows, row);
    if (change.x == 0 && change.y == 0 && change.z == 0) return;
    rows.apply(row, change);
    add3(&rows.impulse[size_t{3} * row], change);
  });
}

}  // namespace dfm
