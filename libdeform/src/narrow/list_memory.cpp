#include "narrow/list_memory.h"

#include <algorithm>
#include <cmath>

namespace dfm {
namespace {

// Pairs that are worth a job, and runs of a job: most are short.
constexpr size_t kJob = 384, kTogether = 4;

}  // namespace

void ListMemory::follow(const Array<Candidate> &list, Tasks *tasks) {
  old_runs.swap(runs);
  old_features.swap(features);
  old_apart.swap(apart);
  old_normal.swap(normal);
  runs.clear();
  const size_t n = list.size();
  features.resize(n);
  apart.resize(n);
  normal.resize(3 * n);
  for (size_t i = 0; i < n;) {
    const size_t end = end_of_run(list, i);
    runs.push_back({uint32_t(i), uint32_t(end), list[i], 0, 0});
    i = end;
  }
  // Runs come in one order in all lists, pairs in a run by their features.
  size_t next = 0;
  before.assign(runs.size(), kNone);
  for (size_t r = 0; r < runs.size(); ++r) {
    const auto same = [&](const Run &o) { return same_run(o.of, runs[r].of); };
    const auto found = std::find_if(old_runs.begin() + std::ptrdiff_t(next), old_runs.end(), same);
    // nothing is known any more beyond the turn of a plane, whose motion has no bound
    if (found == old_runs.end() || !std::isfinite(found->way)) continue;
    before[r] = static_cast<uint32_t>(found - old_runs.begin());
    next = size_t{before[r]} + 1;
  }
  each_on(n > kJob ? tasks : nullptr, runs.size(), kTogether,
          [&](size_t r) { carry_over(list, runs[r], before[r]); });
}

void ListMemory::carry_over(const Array<Candidate> &list, Run &run, uint32_t from) {
  const size_t n = run.end - run.begin;
  uint64_t *const now = features.data() + run.begin;
  for (size_t i = 0; i < n; ++i)
    now[i] = uint64_t{list[run.begin + i].feature_a} << 32 | list[run.begin + i].feature_b;
  double *const to = apart.data() + run.begin, *const along = normal.data() + 3 * size_t{run.begin};
  if (from == kNone) {
    std::fill_n(to, n, -1.0);
    std::fill_n(along, 3 * n, 0.0);
    return;
  }
  const Run &old = old_runs[from];
  run.way = old.way;
  const uint64_t *const before_then = old_features.data() + old.begin;
  const double *const known = old_apart.data() + old.begin;
  const double *const known_along = old_normal.data() + 3 * size_t{old.begin};
  const size_t known_n = old.end - old.begin;
  if (std::equal(now, now + n, before_then, before_then + known_n)) {
    std::copy_n(known, n, to);
    std::copy_n(known_along, 3 * n, along);
    return;
  }
  for (size_t i = 0, j = 0; i < n; ++i) {
    while (j < known_n && before_then[j] < now[i]) ++j;
    const bool same = j < known_n && before_then[j] == now[i];
    to[i] = same ? known[j] : -1;
    for (size_t k = 0; k < 3; ++k) along[3 * i + k] = same ? known_along[3 * j + k] : 0;
  }
}

}  // namespace dfm
