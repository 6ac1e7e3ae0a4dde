#include "step/watch/energy_watch.h"

#include <algorithm>

#include "state/world.h"

namespace dfm {

double moving_energy(const Body &b) {
  double sum = 0;
  for (uint32_t i = 0; i < b.p.n; ++i)
    for (size_t k = 0, at = size_t{kStride} * i; k < 3; ++k, ++at)
      if (b.p.moves(at)) sum += 0.5 * b.p.mass[i] * (b.p.v[at] * b.p.v[at]);
  return sum;
}

void ready_change_work(Body &b, const SubStep &now) {
  if (b.changes.open && !b.motions.empty() && b.dynamics->abilities().damps) b.dynamics->end_forces(now);
}

void book_change_work(const World &w, Body &b, double h) {
  ChangeBook &book = b.changes;
  if (!book.open) return;
  const Phyxels &p = b.p;
  const double *const before = p.x_end.data();  // the two have been swapped
  const bool driven = !b.motions.empty();
  double sum = 0;
  for (uint32_t i = 0; i < p.n; ++i)
    for (size_t k = 0, at = size_t{kStride} * i; k < 3; ++k, ++at) {
      const double way = p.x[at] - before[at];
      if (p.moves(at)) sum += (p.load[at] + p.mass[i] * w.gravity.now[int(k)]) * way;
      else if (driven) sum -= (p.f[at] - p.load[at]) * way;  // work of the hold against the inner forces
    }
  if (w.plan.touches())
    for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
      const double *const q = &b.surfel_impulse[3 * size_t{s}];
      if (q[0] == 0 && q[1] == 0 && q[2] == 0) continue;
      b.surface.each_phyxel(s, [&](uint32_t point, double weight) {
        for (size_t k = 0, at = size_t{kStride} * point; k < 3; ++k, ++at)
          if (p.moves(at)) sum += weight * q[k] * (p.x[at] - before[at]) / h;
      });
    }
  book.work += sum;
  book.largest = std::max(book.largest, moving_energy(b) - std::max(0.0, book.unpaid));
}

}  // namespace dfm
