// Contact islands: how contacts are divided among them, and the solve of each (doc/concepts/contact.md): the
// sweeps of contact/sweeps.cpp, then Newton's method of contact/newton.cpp.
#include "step/solve/solve_islands.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact/bonds.h"
#include "contact/solve_settings.h"
#include "core/lists.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/friction_memory.h"
#include "step/solve/tolerance.h"
#include "step/stages.h"

namespace dfm {
namespace {

using Set = SolveSettings;

// m/s, the residual of the start, at least.
double start_residual(const StepContext &step, const SolveIsland &own) {
  const uint32_t *const sides = step.solve_islands->sides();
  double most = 0;
  each_row(own.part.contacts, [&](uint32_t i) {
    for (const size_t k : {2 * size_t{i}, 2 * size_t{i} + 1})
      if (sides[k] != kNone) most = std::max(most, step.start_residual[2 * size_t{sides[k]} + 1]);
  });
  each_row(own.part.bonds, [&](uint32_t i) { most = std::max(most, norm(bond_residual(step.rows, i))); });
  return most;
}

void begin_newton(StepContext &step, SolveIsland &own) {
  if (!own.newton)
    own.newton = std::make_unique<ContactNewton>(step.contact_memory, &own.world->context->tasks);
  own.newton->begin(step.rows, own.part, step.systems, step.state, own, step.h);
}

// What a Newton solve has found.
void clear_slides(StepContext &step, const SolveIsland &own) {
  each_row(own.part.contacts, [&](uint32_t i) { step.state.slides[i] = 0; });
}

// After sweeps. Where rows contradict each other, the better result counts. tolerance, normal: m/s, as of
// ContactNewton::solve().
void solve_rigid(StepContext &step, SolveIsland &own, double tolerance, double normal) {
  const double swept = own.residual.speed;
  if (own.bad || swept <= tolerance) return;
  own.swept.resize(3 * size_t{own.part.all()});
  take_impulses(step.rows, own.part, own.swept.data());
  begin_newton(step, own);
  const bool found = own.newton->solve(tolerance, normal, Set::inner);
  own.sweeps += own.newton->steps();
  own.residual = own.newton->residual();
  if (found && !own.bad && own.residual.speed <= swept) return;
  own.bad = nullptr;  // a law that fails on the way need not fail there
  put_impulses(step.rows, own.part, own.swept.data());
  clear_slides(step, own);
  own.judge(own.residual);
}

// Evaluates the laws at the present state, and its residual. False: a law has failed.
bool evaluate_laws(const World &w, StepContext &step, SolveIsland &own) {
  spend(w, step, own.spent, 4 * uint64_t{own.part.all()});
  const double *const response = step.rows.wt.data();
  set_trial(step.rows, own.part, step.h, response, step.state);
  // The sweeps are the next Newton step: from a slip with this relative error they reach its square.
  if ((own.bad = own.batches.evaluate_local(step.h, response, 0.1 * tangent_at_rest(w, w, step.h),
                                            Set::of_start, step.state)))
    return false;
  if (own.batches.has_smooth()) linearize(step.rows, own.part, step.h, step.state);
  ++own.passes;
  return true;
}

// m/s, what normals may be off by.
double normal_tolerance(const World &w, const StepContext &step, const SolveIsland &own) {
  // static mode: no later sub-step corrects what this solve leaves
  if (w.prescribed.is_static()) return tangent_at_rest(w, w, step.h);
  return (own.batches.remembers() ? Set::remembered : 1) * normal_at_rest(w, step.h);
}

// Evaluates the laws at the warm start.
void start_island(const World &w, StepContext &step, SolveIsland &own) {
  own.world = &w;
  own.step = &step;
  if (own.implicit) begin_newton(step, own);
  clear_slides(step, own);
  evaluate_laws(w, step, own);
}

// m/s, of the velocities of bodies: that of the contact that needs most.
double motion_tolerance(const SolveIsland &own) {
  double least = own.part.nbond ? own.tolerance.bond : std::numeric_limits<double>::infinity();
  each_row(own.part.contacts,
           [&](uint32_t i) { least = std::min({least, own.tolerance.tangent[i], own.tolerance.normal[i]}); });
  return least;
}

// Impulses become the share of them that does the least work. False: that is all of them.
bool take_least_work(ContactRows &rows, const RowsPart &part) {
  const double share = share_of_least_work(rows, part);
  if (share == 1) return false;
  each_row(part, [&](uint32_t i) {
    double *const l = &rows.impulse[3 * size_t{i}];
    store3(l, share * load3(l));
  });
  rows.restore(part);
  return true;
}

// Impulses that are no solution (the budget has ended, or rows contradict each other) may do work that no law
// allows. Of implicit bodies the method itself sees to that (ContactNewton::penalties_alone).
void limit_work(StepContext &step, SolveIsland &own) {
  if (own.implicit || own.bad || own.failed || own.residual.required <= 1) return;
  if (!take_least_work(step.rows, own.part)) return;
  set_trial(step.rows, own.part, step.h, step.rows.wt.data(), step.state);  // slips as they are now
  own.residual = residual_of(step.rows, own.part, step.state, step.h, own.tolerance);
}

void solve_island(const World &w, StepContext &step, SolveIsland &own) {
  if (own.bad) return;
  const double normal = normal_tolerance(w, step, own), least = tangent_at_rest(w, w, step.h);
  const ToleranceBounds bounds{least,
                               own.implicit              ? least
                               : own.batches.remembers() ? Set::exact * least
                                                         : normal,
                               normal};
  const auto allow = [&] {
    set_tolerance(step.rows, own.part, step.contacts, step.h, bounds, step.solve_islands->sides(),
                  step.start_residual.data(), own.tolerance);
    // static mode: the start, a guess with the last forces, is no measure of what a bond may be off by
    if (w.prescribed.is_static()) own.tolerance.bond = least;
  };
  allow();
  const double exact = Set::exact * least;
  if (own.all_rigid) {
    double scale = 0;  // m/s, of what rounds
    each_row(own.part.contacts, [&](uint32_t i) {
      scale = std::max(scale,
                       std::fabs(step.rows.rate[i]) + norm(step.rows.velocity(i, step.rows.y_free.data())));
    });
    const double sought = own.tolerance.most_normal = std::max(Set::exact * exact, 0x1p-49 * scale);
    each_row(own.part.contacts,
             [&](uint32_t i) { own.tolerance.normal[i] = own.tolerance.tangent[i] = sought; });
  }
  find_slip_back(w, step, own);
  if (step.on_solve) step.on_solve(&own);
  if (!own.implicit) {
    const SweepLimits limits{w.def.max_sweeps, w.def.max_passes, start_residual(step, own)};
    const bool done =
        own.sweeping.solve(step.rows, own.part, step.state, own, own.tolerance, limits, step.h, own.residual);
    own.sweeps = own.sweeping.count();
    if (done) return;
    if (own.all_rigid) {
      solve_rigid(step, own, exact, normal);
      allow();
      if (!own.bad) own.residual = residual_of(step.rows, own.part, step.state, step.h, own.tolerance);
      return;
    }
    begin_newton(step, own);
  }
  own.failed = !own.newton->solve(motion_tolerance(own), normal);
  own.sweeps += own.newton->steps();
  own.residual = own.newton->residual();
  if (!own.bad && !own.failed) own.newton->take();
}

}  // namespace

bool SolveIsland::evaluate_local(const double *response, double slip) {
  bad = batches.evaluate_local(step->h, response, slip, 0, step->state, false);
  return !bad;
}

bool SolveIsland::judge(Residual &found) {
  if (!evaluate_laws(*world, *step, *this)) return false;
  found = residual = residual_of(step->rows, part, step->state, step->h, tolerance);
  return true;
}

void SolveIsland::spend(uint64_t rows) { dfm::spend(*world, *step, spent, rows); }

bool SolveIsland::goes_on() { return !solve_ends(*step, spent); }

SolveIslands::SolveIslands(const Memory &m) : memory_(m), joined_(m) {
  use_memory(m, owner_, sides_, between_rigids_, of_cuts_, order_, contact_, bond_, block_, begin_);
}

// Joins rows that move the same unknown, and those of the same two bodies.
void SolveIslands::join(const StepContext &step) {
  const ContactRows &rows = step.rows;
  joined_.start(rows.all());
  owner_.assign(rows.ndof + step.systems.size(), kNone);
  for (uint32_t i = 0; i < rows.all(); ++i) {
    const auto move = [&](uint32_t dof) {
      const uint32_t block = rows.block[dof], s = block == kNone ? rows.source[dof] : kNone;
      const bool implicit = s != kNone && step.systems[s];  // an impulse at one of its points moves all
      uint32_t &owner = owner_[implicit ? rows.ndof + s : block == kNone ? dof : rows.blocks[block].first];
      if (owner != kNone) joined_.join(owner, i);
      owner = i;
    };
    for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j) move(rows.dof[j]);
    for (const Array<uint32_t> *const rigid : {&rows.rigid, &rows.rigid_a})
      if (!rigid->empty() && (*rigid)[i] != kNone) move((*rigid)[i]);
  }
  const auto keep_together = [&](const auto &all, uint32_t first) {  // they are neighbors in the list
    for (uint32_t i = 1; i < all.size(); ++i) {
      const auto &a = all[i - 1], &b = all[i];
      if (a.slot_a == b.slot_a && a.slot_b == b.slot_b && a.obstacle == b.obstacle)
        joined_.join(first + i - 1, first + i);
    }
  };
  keep_together(step.contacts, 0);
  keep_together(step.bonds, rows.n);
  count_ = joined_.number();
}

// Rigid bodies count as bodies in islands with rows between rigid things, else as obstacles.
void SolveIslands::set_sides(const StepContext &step, uint32_t bodies) {
  const ContactRows &rows = step.rows;
  sides_.assign(2 * size_t{rows.n}, kNone);
  between_rigids_.assign(count_, 0);
  for (uint32_t i = rows.soft(); i < rows.n; ++i) between_rigids_[joined_.of[i]] = 1;
  for (uint32_t i = 0; i < rows.n; ++i) {
    uint32_t *const side = &sides_[2 * size_t{i}];
    if (i < rows.soft()) {
      const ContactPoint &c = step.contacts[i];
      side[0] = c.slot_a;
      if (!c.obstacle) side[1] = c.slot_b;
    }
    if (!between_rigids_[joined_.of[i]]) continue;
    if (rows.rigid_a[i] != kNone) side[0] = bodies + rows.rigid_a[i];
    if (rows.rigid[i] != kNone) side[1] = bodies + rows.rigid[i];
  }
}

void SolveIslands::find_cuts(const World &w, const StepContext &step) {
  const auto cut = [&](uint32_t slot) {
    const Surface &s = w.bodies[slot]->surface;
    return s.slit || s.back > 0;
  };
  of_cuts_.clear();
  if (std::none_of(w.bodies.begin(), w.bodies.end(), [&](auto &b) { return cut(b->slot); })) return;
  for (const ContactPoint &c : step.contacts)
    of_cuts_.push_back(!c.obstacle && cut(c.slot_a) && cut(c.slot_b));
}

void SolveIslands::find(const World &w, StepContext &step) {
  join(step);
  set_sides(step, static_cast<uint32_t>(w.bodies.size()));
  find_cuts(w, step);
  while (islands_.size() < count_) islands_.emplace_back(memory_);
  assign_rows(0, step.rows.n, contact_, &RowsPart::contacts, &RowsPart::n);
  assign_rows(step.rows.n, step.rows.all(), bond_, &RowsPart::bonds, &RowsPart::nbond);
  const Array<ContactRows::Block> &blocks = step.rows.blocks;
  const auto of_block = [&](uint32_t b) { return joined_.of[owner_[blocks[b].first]]; };
  list_by(count_, blocks.size(), of_block, begin_, block_);
  prepare(w, step);
  std::sort(order_.begin(), order_.end(), [&](uint32_t l, uint32_t r) {
    const uint32_t a = islands_[l].part.all(), b = islands_[r].part.all();
    return a != b ? a > b : l < r;
  });
}

void SolveIslands::assign_rows(uint32_t from, uint32_t end, Array<RowRun> &runs,
                               std::span<const RowRun> RowsPart::*rows, uint32_t RowsPart::*number) {
  const auto each = [&](const auto &use) {
    for (uint32_t i = from; i < end;) {
      const uint32_t k = joined_.of[i];
      RowRun run{i, 1};
      while (++i < end && joined_.of[i] == k) ++run.n;
      use(k, run);
    }
  };
  make_lists(count_, each, begin_, runs);
  for (uint32_t k = 0; k < count_; ++k) {
    RowsPart &part = islands_[k].part;
    part.*rows = slice(runs, k);
    part.*number = 0;
    for (const RowRun &r : part.*rows) part.*number += r.n;
  }
}

void SolveIslands::prepare(const World &w, StepContext &step) {
  const Array<ContactRows::Block> &blocks = step.rows.blocks;
  order_.resize(count_);
  for (uint32_t k = 0; k < count_; ++k) {
    SolveIsland &own = islands_[k];
    order_[k] = k;
    own.part.blocks = slice(block_, k);
    own.rigid = own.implicit = false;
    own.between_rigids = between_rigids_[k];
    own.all_rigid = own.part.nbond == 0 && own.part.contacts.front().first >= step.rows.soft();
    for (const uint32_t b : own.part.blocks) own.rigid = own.rigid || blocks[b].group != kNone;
    each_row(own.part, [&](uint32_t i) {
      for (uint32_t j = step.rows.begin[i]; j < step.rows.begin[i + 1]; ++j) {
        const uint32_t d = step.rows.dof[j];
        if (step.rows.block[d] != kNone || !step.systems[step.rows.source[d]]) continue;
        own.implicit = true;
        own.implicit_body = step.rows.source[d];
      }
    });
    own.batches.gather(w.pairs.laws, own.part.contacts, step.state);
  }
}

const SolveIsland *solve_islands(World &w, StepContext &step) {
  const size_t n = step.rows.n;
  step.tolerance.normal.resize(n);
  step.tolerance.tangent.resize(n);
  step.start_residual.assign(2 * (w.bodies.size() + (step.rows.rigid.empty() ? 0 : step.rows.ndof)), 0.0);
  const std::span<SolveIsland> all = step.solve_islands->all();
  uint64_t rows = 0;
  for (SolveIsland &own : all) {
    if (!own.open) continue;
    rows += own.part.all();
    own.passes = own.sweeps = 0;
    own.failed = own.drifts = false;
    own.spent = {0, 0, own.part.all(), false};
    own.residual = {};
    own.bad = nullptr;
    own.tolerance.normal = step.tolerance.normal.data();
    own.tolerance.tangent = step.tolerance.tangent.data();
  }
  for (SolveIsland &own : all) own.spent.all = rows;
  const std::span<const uint32_t> order = step.solve_islands->by_size();
  const auto run = [&](auto &&job) {
    each_on(&w.context->tasks, order.size(), 1, [&](size_t k) {
      if (SolveIsland &own = all[order[k]]; own.open) job(own);
    });
  };
  run([&](SolveIsland &own) { start_island(w, step, own); });
  // tolerances of a body follow from all of its islands
  for (SolveIsland &own : all)
    if (own.open && !own.bad)
      find_start_residual(step.rows, own.part, step.state, step.h, step.solve_islands->sides(),
                          step.start_residual.data());
  run([&](SolveIsland &own) {
    solve_island(w, step, own);
    limit_work(step, own);
    restore_drive(step, own);
  });
  for (const SolveIsland &own : all)
    if (own.open) charge(w, step, own.spent);
  if (step.on_solve) step.on_solve(nullptr);
  const SolveIsland *bad = nullptr;
  for (const SolveIsland &own : all) {
    if (!own.open) continue;
    if (own.bad && !bad) bad = &own;
  }
  return bad;
}

// Impulses that hold the whole forces would throw what has a part of them.
void take_part_of_contact(const World &w, StepContext &step, double share) {
  ContactRows &rows = step.rows;
  Array<uint8_t> &full = step.in_full;
  full.assign(w.bodies.size(), 0);
  const std::span<SolveIsland> all = step.solve_islands->all();
  const auto each_body = [&](const SolveIsland &own, auto &&f) {
    each_row(own.part, [&](uint32_t i) {
      for (uint32_t j = rows.begin[i]; j < rows.begin[i + 1]; ++j)
        if (const uint32_t s = rows.source[rows.dof[j]]; s != kNone) f(s);
    });
  };
  const auto keeps = [&](const SolveIsland &own) {
    bool any = own.implicit || !own.part.blocks.empty();
    each_body(own, [&](uint32_t slot) { any = any || full[slot]; });
    return any;
  };
  for (bool spreads = true; spreads;) {  // a body may be in several
    spreads = false;
    for (const SolveIsland &own : all)
      if (keeps(own))
        each_body(own, [&](uint32_t slot) { spreads = !std::exchange(full[slot], 1) || spreads; });
  }
  for (uint32_t d = 0; d < rows.ndof; ++d) {
    const uint32_t slot = rows.source[d];
    if (slot == kNone || full[slot]) continue;
    double *const free = &rows.y_free[size_t{kStride} * d];
    const double *const start = &w.bodies[slot]->p.v[size_t{kStride} * rows.point[d]];
    for (size_t c = 0; c < 3; ++c) free[c] = start[c] + share * (free[c] - start[c]);
  }
  for (const SolveIsland &own : all) {
    if (keeps(own)) continue;
    rows.restore(own.part);
    take_least_work(rows, own.part);
  }
  report_impulses(step, step, step);
}

}  // namespace dfm
