#include "world/change_energy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "step/watch/energy_watch.h"
#include "world/measure.h"

namespace dfm {
namespace {

// Relative to the largest energy of the body: the unpaid energy that is allowed, and the amount that counts
// as none.
constexpr double kMax = 0.1, kLittle = 0.01;
// Relative to its elastic energy, if the body has lost what earlier changes added.
constexpr double kAnother = 4;
// Relative to its energies: counts as none.
constexpr double kSmallJump = 1e-9;

double finite_or_none(double joule) { return std::isfinite(joule) ? joule : 0; }
double energy_now(Body &b) { return moving_energy(b) + finite_or_none(elastic_energy(b)); }
double jump_of(const Swap &s) { return finite_or_none(s.after) - finite_or_none(s.before); }

}  // namespace

double rounded_energy(const Body &b) {
  double young = 0;
  for (const Material &m : b.composition.materials) young = std::max(young, m.def.young);
  return std::numeric_limits<double>::epsilon() * young * b.rest_volume;
}

ChangeBook check_changes(const Body &b, double elastic) {
  ChangeBook out = b.changes;
  const double now = moving_energy(b) + finite_or_none(elastic);
  // energy that changes have removed may be returned by later ones
  if (out.open) out.unpaid = std::max(std::min(0.0, out.unpaid), out.unpaid - (out.level + out.work - now));
  out.largest = std::max(out.largest, now - std::max(0.0, out.unpaid));
  out.level = now;
  out.work = 0;
  return out;
}

// Above that share, a body that has lost what earlier changes added may gain a multiple of its elastic
// energy, because models and materials that bear the same load differ by that much. No sequence of such
// changes can grow, since the body must lose each jump before the next. If the old model has no energy, the
// jump is unknown.
void check_unpaid(const Body &b, const ChangeBook &before, Swap &swap) {
  const double jump = jump_of(swap), share = kMax * before.largest;
  const bool paid = before.unpaid <= kLittle * before.largest;
  const double none = rounded_energy(b) + kSmallJump * std::max(before.largest, finite_or_none(swap.before));
  if (!(jump > none) || (paid && std::isnan(swap.before))) return;
  double limit = std::max(share, paid ? kAnother * swap.before : 0);
  if (std::isfinite(swap.max_jump)) limit = std::max(limit, swap.max_jump);
  if (before.unpaid + jump <= limit) return;
  swap.unpaid = true;
  refuse(b, DFM_DISCARD,
         ": from '%s' to '%s' its elastic energy would rise by %.3g J, and earlier changes have put in %.3g "
         "J that it has not lost since; together that is more than the %.3g J that changes may put in by "
         "default (a tenth of its largest energy; its elastic energy, where nothing is left of earlier "
         "changes); change the model where the body is less deformed and has turned less, give its material "
         "damping, or set max_jump, which counts instead where it is larger; nothing was changed",
         swap.from->id, swap.to->id, jump, std::max(0.0, before.unpaid), limit);
}

void book_change(const Body &b, ChangeBook &book, const Swap &swap) {
  book.open = true;
  book.unpaid = std::max(-book.largest, book.unpaid + jump_of(swap));
  book.level = moving_energy(b) + finite_or_none(swap.after);
  book.work = 0;
}

void clear_change_energy(Body &b) {
  if (!b.changes.open) return;
  b.changes.unpaid = std::min(0.0, b.changes.unpaid);
  b.changes.work = 0;
  b.changes.level = energy_now(b);
}

HostWork::HostWork(Body &b) : b_(b) {
  if (b.changes.open) before_ = energy_now(b);
}

HostWork::~HostWork() {
  if (b_.changes.open) b_.changes.work += energy_now(b_) - before_;
}

}  // namespace dfm
