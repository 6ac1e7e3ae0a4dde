#include "dynamics/equilibrium.h"

#include <algorithm>
#include <cmath>

#include "dynamics/line_search.h"
#include "plugin/plugin_solver.h"

namespace dfm {
namespace {

constexpr uint32_t kCuts = 12;  // halvings of a correction that is too long
// Share of its diagonal that is first added to a singular matrix; a hundred times as much if that is not
// enough.
constexpr double kLeastRegular = 1e-9, kMostRegular = 1e-1;

}  // namespace

Equilibrium::Equilibrium(const Memory &memory, Phyxels &points, ModelInstance &model,
                         const ImplicitOptions &options)
    : p_(points),
      model_(model),
      stiffness_(memory),
      solve_tolerance_(options.tolerance),
      rest_(memory, points, model) {
  use_memory(memory, residual_, way_, held_);
  residual_.assign(size_t{3} * p_.n, 0.0);
  way_ = residual_;
  stiffness_.create(model, p_.n);
  solver_ = make_solver({options.solver.c_str(), p_.n, stiffness_.constant() || p_.n <= kFactoredAtRest,
                         options.solver_iterations},
                        *static_cast<const dfm_context *>(model.host->ctx), memory, options.tasks);
  solver_->analyse(stiffness_.pattern());
}

// The unbalanced forces at the present positions, and the largest load or reaction.
bool Equilibrium::residual(double time, const Loads &loads) {
  loads(p_.f.data());
  scale_ = 0;
  for (const double f : p_.f) scale_ = std::max(scale_, std::fabs(f));
  if (!rest_.add_forces(time)) return false;
  double poison = 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c;
      const bool moves = p_.moves(at);
      residual_[size_t{3} * i + c] = moves ? p_.f[at] : 0;
      if (!moves) scale_ = std::max(scale_, std::fabs(p_.f[at]));
      poison += 0.0 * p_.f[at];
    }
  return poison == 0;
}

// The blocks of A are set; adds a share of the diagonal, applies the held components, and factors.
bool Equilibrium::factor(double share) {
  stiffness_.each_own([&](uint32_t, double *block) {
    const double mean = (block[0] + block[4] + block[8]) / 3;
    for (size_t c = 0; c < 9; c += 4) block[c] += share * mean;
  });
  Array<double> &blocks = stiffness_.blocks();
  hold_components(stiffness_.pattern(), p_.held.data(), blocks.data());
  return solver_->factor(blocks.data());
}

bool Equilibrium::linearize(double time, const double *softness, bool free) {
  if (factored_ && stiffness_.constant() && held_ == p_.held) return true;
  for (double share = free ? kLeastRegular : 0; share <= kMostRegular;
       share = share > 0 ? 100 * share : kLeastRegular) {
    if (!stiffness_.evaluate(model_, rest_.kin(time), -1, 0)) return false;
    double stiffest = 0, far = 0;
    stiffness_.each_own([&](uint32_t i, double *block) {
      for (size_t c = 0; c < 9; c += 4) {
        block[c] += softness[i];
        stiffest = std::max(stiffest, block[c]);
      }
    });
    for (const double x : p_.x) far = std::max(far, std::fabs(x));
    floor_ = kForceRounding * (stiffest * far);
    factored_ = factor(share);
    held_ = p_.held;
    if (factored_) return true;
  }
  return false;
}

void Equilibrium::move(double share) {
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) p_.x[size_t{kStride} * i + c] += share * way_[size_t{3} * i + c];
}

double Equilibrium::left() const {
  double most = 0;
  for (const double r : residual_) most = std::max(most, std::fabs(r));
  return most;
}

// Moves along the correction, and computes the residual there.
bool Equilibrium::search(double time, const Loads &loads) {
  return search_line(
      product(residual_, way_), kCuts, [&](double share) { move(share); },
      [&](double &slope) {
        const bool known = residual(time, loads);
        slope = product(residual_, way_);
        return known;
      });
}

EquilibriumResult Equilibrium::find(const EquilibriumLimits &limits, double time, const Loads &loads,
                                    const double *softness, bool free) {
  EquilibriumResult out;
  bool polished = false;
  if (!residual(time, loads)) return out;
  while (true) {
    out.left = left();
    out.scale = scale_;
    const bool small = out.left <= std::max(limits.tolerance * scale_, floor_);
    // one more correction after the residual is small: forces converge earlier than positions
    if ((small && polished) || (out.left == 0)) break;
    polished = small;
    if (out.iterations == limits.iterations || !linearize(time, softness, free)) return out;
    ++out.iterations;
    SolveInfo info;
    std::fill(way_.begin(), way_.end(), 0.0);
    if (!solver_->solve(1, residual_.data(), way_.data(), solve_tolerance_, info)) return out;
    if (!search(time, loads)) return out;
  }
  out.found = true;
  return out;
}

}  // namespace dfm
