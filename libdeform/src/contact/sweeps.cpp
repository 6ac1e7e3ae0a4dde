#include "contact/sweeps.h"

#include <algorithm>
#include <cmath>

#include "contact/bonds.h"
#include "contact/solve_settings.h"

namespace dfm {
namespace {

using Set = SolveSettings;

// Decides after which sweeps the residual is computed. For explicit bodies it costs as much as a sweep. A
// sweep seldom reduces the residual to less than a quarter, and seldom to less than a half if the sweeps
// before left more than 0.7 of it; so the residual is computed when it could be small enough at the earliest
// (doc/decisions/contact_solver.md).
class ResidualSchedule {
 public:
  bool is_time(const RowsPart &part, uint32_t sweeps, uint32_t most) const {
    return sweeps >= std::min({next_, Set::inner, most}) || !part.blocks.empty();
  }
  void note(uint32_t sweeps, const Residual &left) {
    const int size = std::ilogb(left.required / Set::accuracy);  // in halves
    const bool slow = known_ && 2 * (size_ - size) <= int(sweeps - at_);
    const int sweeps_left = slow ? size + 1 : (size + 2) / 2;
    next_ = sweeps + uint32_t(std::clamp(sweeps_left, 1, int(Set::rounds)));
    known_ = true;
    size_ = size;
    at_ = sweeps;
  }

 private:
  bool known_ = false;
  int size_ = 0;
  uint32_t at_ = 0, next_ = 0;
};

}  // namespace

AcceleratedImpulses::AcceleratedImpulses(const Memory &memory) : anderson_(memory) {
  use_memory(memory, from_, to_, jump_);
}

void AcceleratedImpulses::start(const ContactRows &rows, const RowsPart &part) {
  constexpr double kGrowth = 4;  // |f| has doubled: contacts have opened or begun to slip
  jump_.clear();
  each_row(part, [&](uint32_t i) { jump_.insert(jump_.end(), {rows.wn[i], rows.wt[i], rows.wt[i]}); });
  anderson_.start(jump_, kGrowth);
  from_.resize(jump_.size());
  to_.resize(jump_.size());
  take_impulses(rows, part, from_.data());
}

void AcceleratedImpulses::follow(ContactRows &rows, const RowsPart &part) {
  take_impulses(rows, part, to_.data());
  if (anderson_.next(from_.data(), to_.data(), jump_.data())) leap(rows, part, jump_.data());
  take_impulses(rows, part, from_.data());
}

Sweeps::Sweeps(const Memory &memory) : acceleration_(memory), start_(memory) {}

bool Sweeps::good(const Residual &left, double fraction) const {
  return left.relative <= fraction || (left.required <= fraction && count_ >= Set::inner);
}

void Sweeps::sweep_once() {
  laws_->spend(part_->all());
  sweep(*rows_, *part_, *state_, h_);
  sweep_bonds(*rows_, *part_);
  ++count_;
}

// With the laws as they were last evaluated. False: not finite.
bool Sweeps::pass() {
  acceleration_.start(*rows_, *part_);
  for (ResidualSchedule schedule;;) {
    sweep_once();
    if (schedule.is_time(*part_, count_, most_)) {
      const Residual left = residual_of(*rows_, *part_, *state_, h_, *tolerance_);
      if (!std::isfinite(left.relative)) return false;
      if (good(left, Set::accuracy) || count_ >= most_ || !laws_->goes_on()) return true;
      schedule.note(count_, left);
    }
    acceleration_.follow(*rows_, *part_);
  }
}

bool Sweeps::solve(ContactRows &rows, const RowsPart &part, ContactState &state, SolveLaws &laws,
                   const Tolerance &tolerance, const SweepLimits &limits, double h, Residual &left) {
  rows_ = &rows;
  part_ = &part;
  state_ = &state;
  laws_ = &laws;
  tolerance_ = &tolerance;
  h_ = h;
  count_ = 0;
  most_ = limits.sweeps;
  start_.resize(3 * size_t{part.all()});
  take_impulses(rows, part, start_.data());
  // block Gauss-Seidel need not converge in a jam with strong friction
  const auto stop_sweeps = [&] {
    put_impulses(rows, part, start_.data());
    return !laws.judge(left) || !laws.goes_on();
  };
  for (uint32_t passes = 1;; ++passes) {
    // at least one sweep on a warm start is part of the method
    if (!pass()) return stop_sweeps();
    if (!laws.judge(left) || good(left, 1)) return true;
    const bool ends = !laws.goes_on();
    if (ends || count_ >= most_ || passes >= limits.passes) {
      if (left.required <= 1) return true;
      return left.speed <= limits.start ? ends : stop_sweeps();
    }
  }
}

}  // namespace dfm
