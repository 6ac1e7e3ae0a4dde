#include "contact/recovery.h"

#include <algorithm>

#include "contact/fixed_limits.h"
#include "contact/friction_kernel.h"

namespace dfm {
namespace {

// Of a contact that opens alone: what contacts of one stack need together is a few times the sum of theirs.
constexpr double kAllowed = 10;

// m/s, the opening that is left after the compliance of the contact under its load.
double opening(const ContactRows &rows, uint32_t i) {
  return -(rows.rate[i] + given(rows.impulse[size_t(i) * 3], &rows.yields[size_t(i) * 2]));
}

}  // namespace

bool opens_dearly(const ContactRows &rows, const RowsPart &part, double slow) {
  const double least = 0.5 * kAllowed * slow * slow;
  for (const RowRun &run : part.contacts)
    for (uint32_t i = run.first; i < run.first + run.n; ++i) {
      const double r = opening(rows, i);
      if (!(r > 0)) continue;
      const double asked = rows.impulse[size_t(i) * 3] * r * rows.wn[i];
      if (asked > least && asked > 0.5 * kAllowed * r * r) return true;
    }
  return false;
}

OpeningWork opening_work(const ContactRows &rows, const RowsPart &part, double slow) {
  OpeningWork out;
  each_row(part.contacts, [&](uint32_t i) {
    const double l = rows.impulse[size_t(i) * 3], r = opening(rows, i);
    if (!(l > 0 && r > 0)) return;
    const double counted = std::max(r, slow);
    out.put_in += l * r;
    out.allowed += (0.5 * kAllowed) * counted * counted / rows.wn[i];
  });
  return out;
}

// J (fixed_limits.h) without its part -l.r.
double work_of_opening(const ContactRows &rows, const RowsPart &part, double put_in) {
  return excess_work(rows, part).work + put_in;
}

void slow_opening(ContactRows &rows, const RowsPart &part, double share) {
  each_row(part.contacts, [&](uint32_t i) {
    if (rows.rate[i] < 0) rows.rate[i] *= share;
  });
}

}  // namespace dfm
