#include "contact/bonds.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

// A fine surface on coarse cells has more bonds than its points have motions. Sweeps from bond to bond
// converge so slowly there that every sub-step ends at the cap, and the warm start adds up what each has
// left: a hanging body is shaken to pieces. Conjugate residuals (Stiefel 1955) end after as many passes as
// there are motions; bonds that contradict each other end at the least residual.
constexpr uint32_t kMostPasses = 100;
// If the Rayleigh quotient of the residual (scaled by the response of each bond) is below this, no impulse
// reduces the residual.
constexpr double kNothingMoves = 1e-10;

// Of w l: a drag slower than this through the material sticks, a faster one does the work that is left.
constexpr double kSlips = 1e-9;

// f(number in the part, row)
template <class F>
void each_bond(const RowsPart &part, F &&f) {
  uint32_t k = 0;
  each_row(part.bonds, [&](uint32_t row) { f(k++, row); });
}

// The impulse of a drag along its way, at the impulses that the others have. One unknown, it is found
// in closed form: what stops the edge, the limit, or what does the work that is left (due),
//
//     l (s - w l) = due with the speed s without it,   l = 2 due / (s + sqrt(s^2 - 4 w due))
struct Drag { double impulse, limit; };
Drag drag_of(const ContactRows &rows, uint32_t row) {
  const ContactRows::BondRow &b = rows.bond[row - rows.n];
  const double now = dot(b.along, load3(&rows.impulse[size_t{3} * row]));
  const double speed = b.w * now - dot(b.along, rows.velocity(row));
  if (!(speed > 0)) return {0, b.most};
  const double l = b.w > 0 ? std::min(b.most, speed / b.w) : b.most;
  if (l * (speed - b.w * l) <= b.due) return {l, b.most};
  const double paid = 2 * b.due / (speed + std::sqrt(std::max(0.0, speed * speed - 4 * b.w * b.due)));
  return {paid, paid};
}

void solve_drag(ContactRows &rows, uint32_t row) {
  double *const l = &rows.impulse[size_t{3} * row];
  const Vec3 next = drag_of(rows, row).impulse * rows.bond[row - rows.n].along, change = next - load3(l);
  if (change.x == 0 && change.y == 0 && change.z == 0) return;
  rows.apply(row, change);
  store3(l, next);
}

struct Vectors {
  double *change, *residual, *z, *p, *az, *ap, *undone, *velocity;  // [nbond,3] each
};

Vectors vectors_in(Array<double> &scratch, size_t n) {
  scratch.assign(8 * n, 0.0);
  double *const a = scratch.data();
  return {a, a + n, a + 2 * n, a + 3 * n, a + 4 * n, a + 5 * n, a + 6 * n, a + 7 * n};
}

// Preconditions by the inverse of each bond's own response.
void scale(const ContactRows &rows, const RowsPart &part, const double *from, double *to) {
  each_bond(part, [&](uint32_t k, uint32_t row) {
    const ContactRows::BondRow &b = rows.bond[row - rows.n];
    const Vec3 r = load3(from + size_t{3} * k), *const inverse = b.inverse;
    if (b.drags()) store3(to + size_t{3} * k, b.sticks ? (dot(b.along, r) / b.w) * b.along : Vec3{});
    else store3(to + size_t{3} * k, {dot(inverse[0], r), dot(inverse[1], r), dot(inverse[2], r)});
  });
}

// Of a residual, what the bond's impulse is to bring to zero.
Vec3 counted(const ContactRows::BondRow &b, Vec3 r) {
  if (b.drags()) return b.sticks ? dot(b.along, r) * b.along : Vec3{};
  for (int c = 0; c < 3; ++c)
    if (b.inverse[c][c] == 0) r[c] = 0;
  return r;
}

double product(const double *a, const double *b, size_t n) {
  double sum = 0;
  for (size_t i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

double largest(const double *a, uint32_t n) {
  double most = 0;
  for (uint32_t k = 0; k < n; ++k) most = std::max(most, norm(load3(a + size_t{3} * k)));
  return most;
}

// Adds the impulses z; response is the resulting change of the residual.
void respond(ContactRows &rows, const RowsPart &part, const double *z, double *velocity, double *response) {
  each_bond(part, [&](uint32_t k, uint32_t row) {
    if (const Vec3 l = load3(z + size_t{3} * k); l.x != 0 || l.y != 0 || l.z != 0) rows.apply(row, l);
  });
  each_bond(part, [&](uint32_t k, uint32_t row) {
    const ContactRows::BondRow &b = rows.bond[row - rows.n];
    const Vec3 now = rows.velocity(row);
    const Vec3 change = now - load3(velocity + size_t{3} * k) + b.soft * load3(z + size_t{3} * k);
    store3(response + size_t{3} * k, counted(b, change));
    store3(velocity + size_t{3} * k, now);
  });
}

// For one bond this is the solution.
void solve_one(ContactRows &rows, uint32_t row) {
  const ContactRows::BondRow &b = rows.bond[row - rows.n];
  const Vec3 r = bond_residual(rows, row);
  const Vec3 change{-dot(b.inverse[0], r), -dot(b.inverse[1], r), -dot(b.inverse[2], r)};
  if (change.x == 0 && change.y == 0 && change.z == 0) return;
  rows.apply(row, change);
  double *const l = &rows.impulse[size_t{3} * row];
  store3(l, load3(l) + change);
}

}  // namespace

Vec3 bond_residual(const ContactRows &rows, uint32_t row) {
  const ContactRows::BondRow &b = rows.bond[row - rows.n];
  const Vec3 l = load3(&rows.impulse[size_t{3} * row]);
  if (b.drags()) return b.w * (drag_of(rows, row).impulse * b.along - l);
  return counted(b, rows.velocity(row) + b.rate + b.soft * l);
}

void limit_drag(ContactRows &rows, uint32_t row) { rows.bond[row - rows.n].most = drag_of(rows, row).limit; }

namespace {

// All but drags that do not stick.
uint32_t solve_held(ContactRows &rows, const RowsPart &part, double tolerance, Array<double> &scratch) {
  const size_t n = size_t{3} * part.nbond;
  const Vectors v = vectors_in(scratch, n);
  each_bond(part, [&](uint32_t k, uint32_t row) {
    const ContactRows::BondRow &b = rows.bond[row - rows.n];
    const Vec3 r = rows.velocity(row) + b.rate + b.soft * load3(&rows.impulse[size_t{3} * row]);
    store3(v.residual + size_t{3} * k, -counted(b, r));
    store3(v.velocity + size_t{3} * k, rows.velocity(row));
  });
  if (!(largest(v.residual, part.nbond) > tolerance)) return 0;
  scale(rows, part, v.residual, v.z);
  uint32_t passes = 0;
  // undone: minus the sum of the impulses applied by respond()
  double before = 0;
  for (; passes < kMostPasses; ++passes) {
    respond(rows, part, v.z, v.velocity, v.az);
    for (size_t i = 0; i < n; ++i) v.undone[i] -= v.z[i];
    const double now = product(v.z, v.az, n);
    if (!(now > kNothingMoves * product(v.z, v.residual, n))) break;
    const double beta = passes ? now / before : 0;
    before = now;
    for (size_t i = 0; i < n; ++i) {
      v.p[i] = v.z[i] + beta * v.p[i];
      v.ap[i] = v.az[i] + beta * v.ap[i];
    }
    scale(rows, part, v.ap, v.az);
    const double alpha = now / product(v.ap, v.az, n);
    for (size_t i = 0; i < n; ++i) {
      v.change[i] += alpha * v.p[i];
      v.residual[i] -= alpha * v.ap[i];
      v.z[i] -= alpha * v.az[i];
    }
    if (!(largest(v.residual, part.nbond) > tolerance)) break;
  }
  each_bond(part, [&](uint32_t k, uint32_t row) {
    const Vec3 change = load3(v.change + size_t{3} * k);
    rows.apply(row, change + load3(v.undone + size_t{3} * k));
    double *const l = &rows.impulse[size_t{3} * row];
    store3(l, load3(l) + change);
  });
  return passes + 1;
}

// Solves of the bonds; between them, drags above their limit are set to it and no longer stick. After these
// solves the rest is a residual, which the sweeps reduce further.
constexpr uint32_t kMostTurns = 8;

}  // namespace

uint32_t solve_bonds(ContactRows &rows, const RowsPart &part, double tolerance, Array<double> &scratch) {
  uint32_t drags = 0, sticking = 0, passes = 0;
  each_bond(part, [&](uint32_t, uint32_t row) { drags += rows.bond[row - rows.n].drags(); });
  if (part.nbond == 1 && !drags) {
    solve_one(rows, part.bonds[0].first);
    return 1;
  }
  if (!drags) return solve_held(rows, part, tolerance, scratch);
  if (drags == part.nbond && part.alone) {  // each has its point
    each_bond(part, [&](uint32_t, uint32_t row) { solve_drag(rows, row); });
    return 1;
  }
  for (uint32_t turn = 0; turn < kMostTurns; ++turn) {
    bool same = turn > 0;
    sticking = 0;
    each_bond(part, [&](uint32_t, uint32_t row) {
      ContactRows::BondRow &b = rows.bond[row - rows.n];
      if (!b.drags()) return;
      const bool left = norm(bond_residual(rows, row)) > tolerance;
      same = same && !left;
      if (left || turn == 0) solve_drag(rows, row);
      const double l = dot(b.along, load3(&rows.impulse[size_t{3} * row]));
      const double speed = -dot(b.along, rows.velocity(row));
      b.sticks = b.w > 0 && l > 0 && l < b.most && std::fabs(speed) <= kSlips * b.w * l;
      sticking += b.sticks;
    });
    ++passes;
    if (same || (sticking == 0 && drags == part.nbond)) break;
    passes += solve_held(rows, part, tolerance, scratch);
  }
  return passes;
}

}  // namespace dfm
