#include "narrow/list_memory.h"

#include <algorithm>

namespace dfm {
namespace {

// Pairs that are worth a job, and runs of a job: most are short.
constexpr size_t kJob = 384, kTogether = 4;

}  // namespace

void ListMemory::follow(const Array<Candidate> &list, Tasks *tasks) {
  old_runs.swap(runs);
  old_features.swap(features);
  old_rest.swap(rest);
  old_normal.swap(normal);
  runs.clear();
  const size_t n = list.size();
  features.resize(n);
  rest.resize(n);
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
    if (found == old_runs.end()) continue;
    before[r] = static_cast<uint32_t>(found - old_runs.begin());
    next = size_t{before[r]} + 1;
  }
  each_on(n > kJob ? tasks : nullptr, runs.size(), kTogether,
          [&](size_t r) { carry_over(list, runs[r], before[r]); });
}

void ListMemory::carry_over(const Array<Candidate> &list, Run &run, uint32_t from) {
  uint32_t j = 0, last = 0;
  if (from != kNone) {
    run.way = old_runs[from].way;
    j = old_runs[from].begin;
    last = old_runs[from].end;
  }
  for (uint32_t i = run.begin; i < run.end; ++i) {
    features[i] = uint64_t{list[i].feature_a} << 32 | list[i].feature_b;
    while (j < last && old_features[j] < features[i]) ++j;
    const bool known = j < last && old_features[j] == features[i];
    rest[i] = known ? old_rest[j] : -1;
    for (size_t k = 0; k < 3; ++k) normal[3 * size_t{i} + k] = known ? old_normal[3 * size_t{j} + k] : 0;
  }
}

}  // namespace dfm
