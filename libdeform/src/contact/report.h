// Data of the last sub-step for the report: contacts in key order with their solution.
#pragma once
#include "contact/contact_set.h"
#include "core/memory.h"

namespace dfm {

struct Report {
  uint32_t n = 0;
  double h = 0;  // s, of that sub-step
  Array<ContactPoint> contacts;
  Array<double> frame, impulse, slip;  // [n,9], [n,3] N s, [n,2] m/s
  Array<uint8_t> mode;

  explicit Report(const Memory &memory);
};

// Calls f(width, column of each report). Memory, reserved room, the data of sleepers and the copy for the
// budget of a step use this list.
template <class F, class... R>
void each_report_column(F &&f, R &...r) {
  f(size_t{1}, r.contacts...);
  f(size_t{9}, r.frame...);
  f(size_t{3}, r.impulse...);
  f(size_t{2}, r.slip...);
  f(size_t{1}, r.mode...);
}

inline Report::Report(const Memory &memory) {
  each_report_column([&](size_t, auto &column) { use_memory(memory, column); }, *this);
}

}  // namespace dfm
