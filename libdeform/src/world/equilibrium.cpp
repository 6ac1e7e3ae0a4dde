#include "world/equilibrium.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>
#include <functional>

#include "core/error.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"
#include "world/change_energy.h"
#include "world/rest_loads.h"
#include "plugin/plugin_solver.h"
#include "dynamics/line_search.h"
#include "math/linear_solver.h"
#include "dynamics/stiffness.h"
#include "dynamics/dynamics.h"
#include "dynamics/at_rest.h"

namespace dfm {
namespace {

// The equilibrium of the points of one body: f(x) + loads = 0 in all components that are not held, by
// Newton's method with line search on the stiffness of the model.

struct EquilibriumLimits {
  double tolerance = 1e-10;  // N left per N of the largest load or reaction
  uint32_t iterations = 200;
};
struct EquilibriumResult {
  bool found = false;
  uint32_t iterations = 0;  // linear solves
  double left = 0;          // N, largest component of an unbalanced force
  double scale = 0;         // N, largest component of a load or of a reaction
};

class Equilibrium {
 public:
  // Throws Error if the model has no stiffness.
  Equilibrium(const Memory &memory, Phyxels &points, ModelInstance &model, const ImplicitOptions &options);

  // Writes loads at the present positions, weight included, into f [npoint,4] N.
  using Loads = std::function<void(double *f)>;
  // Goes from the present positions to the equilibrium. softness: [npoint] N/m, stiffness of the loads, added
  // to the matrix. free: no point is held, so the matrix must be regularized. If no equilibrium is found,
  // positions are undefined. Velocities are taken as zero.
  EquilibriumResult find(const EquilibriumLimits &limits, double time, const Loads &loads,
                         const double *softness, bool free);

 private:
  Phyxels &p_;
  ModelInstance &model_;
  ModelStiffness stiffness_;
  std::unique_ptr<LinearSolver> solver_;
  double solve_tolerance_;
  AtRest rest_;
  Array<double> residual_, way_;  // [npoint,3] N; m
  Array<uint8_t> held_;           // as in the present factor
  double floor_ = 0;              // N, rounding of forces at the present positions
  double scale_ = 0;              // N, the largest load or reaction
  bool factored_ = false;

  bool residual(double time, const Loads &loads);
  bool linearize(double time, const double *softness, bool free);
  bool factor(double share);
  bool search(double time, const Loads &loads);
  void move(double share);
  double left() const;
};

constexpr uint32_t kCuts = 12;  // halvings of a correction that is too long
// Share of its diagonal that is first added to a singular matrix; a hundred times as much if that is not
// enough.
constexpr double kMinRegular = 1e-9, kMaxRegular = 1e-1;

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
  double nan_flag = 0;
  for (uint32_t i = 0; i < p_.n; ++i)
    for (uint32_t c = 0; c < 3; ++c) {
      const size_t at = size_t{kStride} * i + c;
      const bool moves = p_.moves(at);
      residual_[size_t{3} * i + c] = moves ? p_.f[at] : 0;
      if (!moves) scale_ = std::max(scale_, std::fabs(p_.f[at]));
      nan_flag += 0.0 * p_.f[at];
    }
  return nan_flag == 0;
}

// The blocks of A are set; adds a share of the diagonal, applies the held components, and factors.
bool Equilibrium::factor(double share) {
  stiffness_.each_own([&](uint32_t, double *block) {
    const double mean = (block[0] + block[4] + block[8]) / 3;
    for (size_t c = 0; c < 9; c += 4) block[c] += share * mean;
  });
  Array<double> &blocks = stiffness_.blocks();
  hold_components(stiffness_.pattern(), p_.held.data(), blocks.data());
  solver_->place(p_.x.data(), kStride);
  return solver_->factor(blocks.data());
}

bool Equilibrium::linearize(double time, const double *softness, bool free) {
  if (factored_ && stiffness_.constant() && held_ == p_.held) return true;
  for (double share = free ? kMinRegular : 0; share <= kMaxRegular;
       share = share > 0 ? 100 * share : kMinRegular) {
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

// How often a load step without a solution is halved.
constexpr uint32_t kHalvings = 6;
// Limit on alternations between relaxation and equilibrium, which depend on each other.
constexpr uint32_t kRelaxations = 4;

class Search {
 public:
  Search(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info)
      : w_(w), info_(info), start_{w.time, def.load_from}, end_{w.time + def.time, def.load_to} {
    if (def.tolerance > 0) limits_.tolerance = def.tolerance;
    if (def.max_iterations) limits_.iterations = def.max_iterations;
    for (const auto &b : w.bodies) bodies_.push_back(make(*b, w.implicit));
    keep();
  }
  Search(const Search &) = delete;
  ~Search() {
    if (!done_) restore_state(first_);
    set_gravity_now(w_);
    for (auto &b : w_.bodies) set_loads(*b, w_.time, 1);
  }

  void run(uint32_t load_steps) {
    first_ = kept_;
    Station at = start_;
    for (uint32_t k = 1; k <= load_steps; ++k) {
      const double done = double(k) / load_steps;
      const Station to = k == load_steps ? end_ : between(start_, end_, done);
      go(at, to, 0);
      at = to;
    }
    for (auto &b : w_.bodies) {
      std::fill(b->p.v.begin(), b->p.v.end(), 0.0);
      relax_dampers(b->p);
    }
    done_ = true;
  }

 private:
  struct One {
    Body *body;
    std::unique_ptr<Equilibrium> solver;
    std::unique_ptr<AtRest> rest;
    std::vector<double> softness;  // [npoint] N/m of the body's springs
    bool free;                     // without held points and without springs
  };
  struct Kept {
    double time;
    std::vector<std::vector<double>> x, state;
  };

  One make(Body &b, const ImplicitOptions &options) const {
    return {&b, std::make_unique<Equilibrium>(w_.memory(), b.p, b.model, options),
            std::make_unique<AtRest>(w_.memory(), b.p, b.model), softness_of(b), is_free(b)};
  }

  void keep() {
    kept_ = {w_.time, {}, {}};
    for (const auto &b : w_.bodies) {
      kept_.x.emplace_back(b->p.x.begin(), b->p.x.end());
      kept_.state.emplace_back(b->model.state.begin(), b->model.state.end());
    }
  }
  void restore_state(const Kept &kept) {
    w_.time = kept.time;
    for (size_t i = 0; i < w_.bodies.size(); ++i) {
      std::copy(kept.x[i].begin(), kept.x[i].end(), w_.bodies[i]->p.x.begin());
      std::copy(kept.state[i].begin(), kept.state[i].end(), w_.bodies[i]->model.state.begin());
    }
  }

  // Goes from an equilibrium at `from` to one at `to`; halves the step if it finds none.
  void go(const Station &from, const Station &to, uint32_t halved) {
    const Kept before = kept_;
    const One *failed = nullptr;
    EquilibriumResult result;
    if (reach(to, failed, result)) {
      ++info_.load_steps;
      keep();
      return;
    }
    if (halved == kHalvings || (from.time == to.time && from.share == to.share)) refuse(*failed, to, result);
    restore_state(before);
    const Station middle = {0.5 * (from.time + to.time), 0.5 * (from.share + to.share)};
    go(from, middle, halved + 1);
    go(middle, to, halved + 1);
  }

  bool reach(const Station &to, const One *&failed, EquilibriumResult &result) {
    w_.time = to.time;
    set_gravity_now(w_);
    if (w_.gravity.keys.empty()) w_.gravity.now = to.share * w_.gravity.now;
    info_.residual = 0;
    for (One &one : bodies_) {
      Body &b = *one.body;
      set_loads(b, to.time, to.share);
      each_held_place(b, to.time, [&](uint32_t point, Vec3 x) {
        for (int k = 0; k < 3; ++k)
          if (b.p.held[point] & (1 << k)) b.p.x[size_t(point) * kStride + size_t(k)] = x[k];
      });
      check_balance(one);
      for (uint32_t round = 0;; ++round) {
        result = one.solver->find(
            limits_, to.time, [&](double *f) { loads_at_rest(w_, b, f); }, one.softness.data(), one.free);
        info_.iterations += result.iterations;
        if (!result.found) {
          failed = &one;
          return false;
        }
        // done when relaxation changes nothing
        if ((round > 0 && result.iterations <= 1) || round == kRelaxations || !one.rest->relax(to.time))
          break;
      }
      info_.residual = std::max(info_.residual, result.scale > 0 ? result.left / result.scale : 0);
    }
    return true;
  }

  void check_balance(const One &one) const {
    if (!one.free) return;
    const Body &b = *one.body;
    Vec3 sum;
    double all = 0;
    for (size_t i = 0; i < b.p.n; ++i) {
      const Vec3 f = load3(&b.p.load[i * kStride]) + b.p.mass[i] * w_.gravity.now;
      sum += f;
      all += std::sqrt(norm2(f));
    }
    if (!(std::sqrt(norm2(sum)) > 1e-9 * all)) return;
    fail(DFM_E_DIVERGED,
         "body '%s' has no equilibrium: nothing holds it, and its loads sum to [%g, %g, %g] N; hold some of "
         "its points (fix), or balance its loads",
         b.name.c_str(), sum.x, sum.y, sum.z);
  }

  [[noreturn]] void refuse(const One &one, const Station &at, const EquilibriumResult &r) const {
    fail(DFM_E_DIVERGED,
         "body '%s': no equilibrium was found at %g of the loads (%u iterations; %g N are not balanced, the "
         "largest load or reaction is %g N); lower the loads, hold what may move freely, or look for "
         "parameters that leave the body without stiffness",
         one.body->name.c_str(), at.share, r.iterations, r.left, r.scale);
  }

  World &w_;
  dfm_equilibrium_info &info_;
  Station start_, end_;
  EquilibriumLimits limits_;
  std::vector<One> bodies_;
  Kept kept_, first_;
  bool done_ = false;
};

}  // namespace

void check_equilibrium(const World &w) {
  if (!w.rigid_sets.empty())
    fail(DFM_E_UNSUPPORTED,
         "static mode does not support moving rigid bodies; remove them, or run the world in time");
  for (const auto &b : w.bodies)
    if (b->model.stepper)
      fail(DFM_E_UNSUPPORTED,
           "body '%s': model '%s' steps itself and gives no stiffness, which an equilibrium needs; choose "
           "another model",
           b->name.c_str(), b->model.type->id);
}

void find_equilibrium(World &w, const dfm_equilibrium_def &def, dfm_equilibrium_info &info) {
  prepare(w);
  check_equilibrium(w);
  if (w.plan.touches()) return find_contact_equilibrium(w, def, info);
  {
    Search search(w, def, info);
    search.run(def.load_steps ? def.load_steps : 1);
  }
  wake_all(w);
  for (auto &b : w.bodies) {
    b->dynamics->points_changed();
    forget_energy(*b);
    clear_change_energy(*b);
    ++b->x_version;
    w.overlaps.place(b->id);
  }
  for (auto &o : w.obstacles)
    if (o->moves()) o->pose = o->pose_at_time(w.time);
  w.bound.age = kNone;
  ++w.placements;
  w.stats.time = w.time;
}

}  // namespace dfm
