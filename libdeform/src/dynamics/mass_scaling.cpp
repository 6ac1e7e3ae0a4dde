// A sub-step of h needs m >= (h^2 k + 2 h c) / 4 at each point. Points that have less for the wished h get
// the difference d. All points pay for it by a share of their masses that is a quadratic polynomial q of the
// place at rest,
//
//     m' = m + d - m q,     with   sum m' g = sum m g   for each quadratic polynomial g:
//
// q is the projection of d / m on these. So the total mass, the center and the moments of inertia stay, and
// with the second moments the kinetic energy of every velocity that is an affine function of the place: of
// any rigid motion and any uniform strain. Where u is a quadratic polynomial, as in bending and
// torsion, the kinetic energy changes by u.(m' - m) u, of which the largest share of u.m u is reported.
#include "dynamics/mass_scaling.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "dynamics/symplectic_euler.h"
#include "math/quadratics.h"

namespace dfm {
namespace {

constexpr int kTurns = 6;         // of what points get and what they pay
constexpr double kMaxPaid = 0.5;  // of its own mass, by a point
constexpr double kWorth = 1.25;   // longer sub-steps: they have four sizes to the octave
constexpr int kHalvings = 40;     // of the interval in which the sub-step lies

class Mover {
 public:
  Mover(const Phyxels &p, const RestRows &rows) : p_(p), rows_(rows), terms_(terms_of(p)), added_(p.n) {
    for (uint32_t i = 0; i < p.n; ++i) total_ += p.mass[i];
  }

  double total() const { return total_; }

  // kg, what points get for sub-steps of h; infinite: some point would pay too much. Who gets also pays, so
  // what points get and pay are found in turn.
  double move(double h) {
    double moved = 0;
    paid_ = {};
    for (int turn = 0; turn < kTurns; ++turn) {
      Quadratics paid{};
      moved = 0;
      for (uint32_t i = 0; i < p_.n; ++i) {
        const double share = share_paid(i),
                     needed = 0.25 * h * (h * rows_.stiffness[i] + 2 * rows_.damping[i]);
        added_[i] = std::max(0.0, needed - p_.mass[i] * (1 - std::max(0.0, share)));
        moved += added_[i];
        for (size_t k = 0; added_[i] > 0 && k < kQuadratics; ++k) paid[k] += added_[i] * terms_[i][k];
      }
      paid_ = paid;
    }
    for (uint32_t i = 0; i < p_.n; ++i)
      if (!(share_paid(i) <= kMaxPaid)) return std::numeric_limits<double>::infinity();
    return moved;
  }

  double changed(uint32_t i) const { return added_[i] - p_.mass[i] * share_paid(i); }

  // At least the largest share of u.m u that u.(m' - m) u has for a quadratic u, and at most 1.16 of it: the
  // eighth root of the Frobenius norm of the eighth power of the matrix between these.
  double energy_change() const {
    std::array<Quadratics, kQuadratics> change{};
    for (uint32_t i = 0; i < p_.n; ++i)
      for (size_t k = 0; k < kQuadratics; ++k)
        for (size_t l = 0; l < kQuadratics; ++l) change[k][l] += changed(i) * terms_[i][k] * terms_[i][l];
    for (int power = 1; power < 8; power *= 2) {
      const std::array<Quadratics, kQuadratics> a = std::exchange(change, {});
      for (size_t k = 0; k < kQuadratics; ++k)
        for (size_t l = 0; l < kQuadratics; ++l)
          for (size_t j = 0; j < kQuadratics; ++j) change[k][l] += a[k][j] * a[j][l];
    }
    double square = 0;
    for (const Quadratics &row : change)
      for (const double x : row) square += x * x;
    return std::sqrt(std::sqrt(std::sqrt(std::sqrt(square))));
  }

 private:
  const Phyxels &p_;
  const RestRows &rows_;
  std::vector<Quadratics> terms_;  // at the points; orthonormal with the masses as weights
  std::vector<double> added_;      // [n] kg
  Quadratics paid_{};
  double total_ = 0;

  static std::vector<Quadratics> terms_of(const Phyxels &p) {
    std::vector<Vec3> place;
    for (uint32_t i = 0; i < p.n; ++i) place.push_back(load3(&p.rest[size_t{3} * i]));
    const std::vector<double> mass(p.mass.begin(), p.mass.end());
    return OrthonormalQuadratics(place, mass, [](auto &&) {}).at;
  }
  double share_paid(uint32_t i) const {
    double sum = 0;
    for (size_t k = 0; k < kQuadratics; ++k) sum += paid_[k] * terms_[i][k];
    return sum;
  }
};

}  // namespace

double step_of_point(const Phyxels &p, const RestRows &rows, uint32_t point) {
  return stable_step(rows.stiffness[point], rows.damping[point], p.mass[point]);
}

MassScaling scale_mass(const Phyxels &p, const RestRows &rows, double share, std::vector<double> &mass) {
  mass.assign(p.mass.begin(), p.mass.end());
  std::vector<double> steps;
  for (uint32_t i = 0; i < p.n; ++i) steps.push_back(step_of_point(p, rows, i));
  const auto median = steps.begin() + p.n / 2;
  std::nth_element(steps.begin(), median, steps.end());
  const double least = *std::min_element(steps.begin(), median + 1);
  const MassScaling none{.requested = share, .step = least};
  if (!(*median > kWorth * least) || !std::isfinite(*median)) return none;
  Mover mover(p, rows);
  double low = least, high = *median;  // a level at which half of the points bound is that of the body
  for (int k = 0; k < kHalvings; ++k) {
    const double middle = 0.5 * (low + high);
    (mover.move(middle) > share * mover.total() ? high : low) = middle;
  }
  MassScaling out{.requested = share, .moved = mover.move(low) / mover.total(), .step = *median};
  for (uint32_t i = 0; i < p.n; ++i) {
    mass[i] += mover.changed(i);
    out.step = std::min(out.step, stable_step(rows.stiffness[i], rows.damping[i], mass[i]));
  }
  out.frequency = 0.5 * mover.energy_change();
  if (out.step > kWorth * least) return out;
  mass.assign(p.mass.begin(), p.mass.end());
  return none;
}

}  // namespace dfm
