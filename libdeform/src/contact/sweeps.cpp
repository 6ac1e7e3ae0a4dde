#include "contact/sweeps.h"

#include <algorithm>
#include <cmath>

#include "contact/bonds.h"

namespace dfm {
namespace {

// Residual::relative is stricter than what is required (Residual::due). At most this many sweeps are spent on
// it where the latter is met, because the next sub-step continues from there.
constexpr uint32_t kPolish = 20;
// The limit on sweeps is so many times larger where there are so many contacts, whose matrix is dearer.
constexpr uint32_t kMany = 100, kManySweeps = 4;

}  // namespace

Sweeps::Sweeps(const Memory &memory) : acceleration_(memory) { use_memory(memory, start_); }

bool Sweeps::good(bool precise, bool enough) const { return precise || (enough && count_ >= kPolish); }

// With the laws as they were last evaluated. A sweep has found what the one before has left, so the state is
// better than that.
void Sweeps::pass() {
  acceleration_.start(*rows_, *part_);
  for (;;) {
    laws_->spend(part_->all());
    const Found found = sweep(*rows_, *part_, *state_, *tolerance_, h_);
    ++count_;
    if (good(!found.any, !found.much) || count_ >= most_ || !laws_->goes_on()) return;
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
  most_ = limits.sweeps * (part.n < kMany ? 1 : kManySweeps);
  start_.resize(3 * size_t{part.all()});
  take_impulses(rows, part, start_.data());
  // block Gauss-Seidel need not converge in a jam with strong friction
  const auto give_up = [&] {
    put_impulses(rows, part, start_.data());
    return !laws.judge(left) || !laws.goes_on();
  };
  for (uint32_t passes = 1;; ++passes) {
    pass();  // at least one sweep on a warm start is part of the method
    if (!laws.judge(left) || good(left.relative <= 1, left.due <= 1)) return true;
    const bool ends = !laws.goes_on();
    if (ends || count_ >= most_ || passes >= limits.passes) {
      if (left.due <= 1) return true;
      return left.speed <= limits.start ? ends : give_up();
    }
    if (!laws.slopes()) return true;
  }
}

}  // namespace dfm
