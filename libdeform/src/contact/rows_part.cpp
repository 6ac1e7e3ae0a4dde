// Functions of ContactRows for one part of its rows, and the part of all rows.
#include <algorithm>

#include "contact/rows.h"

namespace dfm {

RowsPart ContactRows::whole() {
  every_row_[0] = {0, n};
  every_row_[1] = {n, nbond};
  every_block_.resize(blocks.size());
  for (uint32_t b = 0; b < every_block_.size(); ++b) every_block_[b] = b;
  return {{&every_row_[0], 1}, {&every_row_[1], nbond ? size_t{1} : 0}, every_block_, n, nbond};
}

void ContactRows::apply_last() {
  y_free.assign(y.begin(), y.end());
  for (uint32_t i = 0; i < n; ++i) {
    double *const l = &impulse[size_t(i) * 3];
    if (wn[i] > 0 && l[0] > 0) apply(i, load3(l));
    else l[0] = l[1] = l[2] = 0;  // what stayed here, sweeps would take back from y, which never had it
  }
  for (uint32_t i = n; i < all(); ++i) apply(i, load3(&impulse[size_t(i) * 3]));
}

void ContactRows::restore(const RowsPart &part) {
  for (const uint32_t b : part.blocks)
    std::copy_n(&y_free[size_t(4) * blocks[b].first], size_t(4) * blocks[b].count,
                &y[size_t(4) * blocks[b].first]);
  each_row(part, [&](uint32_t i) {
    for (uint32_t j = begin[i]; j < begin[i + 1]; ++j)
      if (block[dof[j]] == kNone) std::copy_n(&y_free[size_t(4) * dof[j]], 4, &y[size_t(4) * dof[j]]);
  });
  each_row(part, [&](uint32_t i) {
    const Vec3 l = load3(&impulse[size_t(i) * 3]);
    if (l.x != 0 || l.y != 0 || l.z != 0) apply(i, l);
  });
}

void take_impulses(const ContactRows &rows, const RowsPart &part, double *to) {
  for (const std::span<const RowRun> runs : {part.contacts, part.bonds})
    for (const RowRun &r : runs)
      to = std::copy_n(rows.impulse.data() + size_t{3} * r.first, size_t{3} * r.n, to);
}

void put_impulses(ContactRows &rows, const RowsPart &part, const double *from) {
  for (const std::span<const RowRun> runs : {part.contacts, part.bonds})
    for (const RowRun &r : runs) {
      std::copy_n(from, size_t{3} * r.n, rows.impulse.data() + size_t{3} * r.first);
      from += size_t{3} * r.n;
    }
  rows.restore(part);
}

}  // namespace dfm
