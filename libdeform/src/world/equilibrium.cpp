#include "world/equilibrium.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "core/error.h"
#include "dynamics/equilibrium.h"
#include "state/obstacle.h"
#include "state/world.h"
#include "step/stages.h"
#include "step/watch/energy_watch.h"
#include "world/change_energy.h"
#include "world/rest_loads.h"

namespace dfm {
namespace {

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
    if (!done_) put_back(first_);
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
      settle_dampers(b->p);
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
  void put_back(const Kept &kept) {
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
    put_back(before);
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
  if (w.plan.touches()) return settle(w, def, info);
  {
    Search search(w, def, info);
    search.run(def.load_steps ? def.load_steps : 1);
  }
  wake_all(w);
  for (auto &b : w.bodies) {
    b->dynamics->points_changed();
    forget_energy(*b);
    settle_changes(*b);
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
