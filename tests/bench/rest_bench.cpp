// What rest costs. A world of 100 bodies that sleep, per step, with nothing awake and with one body awake
// among them; the same bodies kept awake; and how even the steps of a resting scene are: percentiles of
// processor time per step at 1 kHz. Memory is counted in tests/api/memory_test.cpp.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "coupled.h"
#include "machine.h"
#include "support.h"

namespace {

// A hundred blocks of 100 cells on a floor, two high: 50 islands.
struct Field {
  dfm_world world;
  std::vector<dfm_body> bodies;
  Field(dfm_context *c, bool sleep) {
    world = test::make_world(c);
    test::ok(dfm_world_set_sleep(world, sleep));
    test::add_plane(world, "floor");
    test::set_friction(world, 0.5);
    test::BodyOptions o;
    o.young = 2e5;
    o.damping_stiffness = 2e-3;
    o.damping_mass = 20;
    for (int i = 0; i < 100; ++i) {
      o.position = {0.3 * (i / 2 % 10), 0.3 * (i / 20), 4e-5 + 0.10004 * (i % 2)};
      bodies.push_back(test::make_body(c, world, "beam", {0.1, 0.1, 0.1}, 100, o));
    }
  }
};

struct Times { double median, p99, p999, mean; };

Times shares_of(std::vector<double> t) {
  double sum = 0;
  for (double x : t) sum += x;
  std::sort(t.begin(), t.end());
  return {t[t.size() / 2], t[t.size() * 99 / 100], t[t.size() * 999 / 1000], sum / double(t.size())};
}

// What a busy machine does not change: sub-steps, outer iterations and sweeps of a step.
struct Counts { std::vector<double> substeps, passes, sweeps; };

std::vector<double> times(dfm_world w, int n, double h, Counts *counts = nullptr) {
  std::vector<double> t;
  t.reserve(size_t(n));
  for (int i = 0; i < n; ++i) {
    const double at = bench::cpu_seconds();
    test::ok(dfm_world_step(w, h, nullptr));
    t.push_back(bench::cpu_seconds() - at);
    if (!counts) continue;
    const dfm_world_stats s = test::stats(w);
    counts->substeps.push_back(s.last_substeps);
    counts->passes.push_back(s.passes);
    counts->sweeps.push_back(s.sweeps);
  }
  return t;
}
Times steps(dfm_world w, int n, double h) { return shares_of(times(w, n, h)); }

void row(const char *name, const Times &t) {
  std::printf("%-44s median %9.2f us   mean %9.2f   99 %% %9.2f   99.9 %% %9.2f (%.2f of the median)\n", name,
              1e6 * t.median, 1e6 * t.mean, 1e6 * t.p99, 1e6 * t.p999, t.p999 / t.median);
}

void count_row(const char *name, const std::vector<double> &counts) {
  const Times t = shares_of(counts);
  std::printf("    %-18s median %4.0f   mean %7.2f   99 %% %4.0f   99.9 %% %4.0f   most %4.0f\n", name,
              t.median, t.mean, t.p99, t.p999, *std::max_element(counts.begin(), counts.end()));
}

// Two blocks of 1,000 cells, one on top of the other, that have settled for 2 s.
dfm_world make_stack(const test::Context &c) {
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::set_friction(w, 0.5);
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.volume = 1;
  o.position = {0, 0, 1e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 1000, o);
  o.position = {0.013, 0.007, 0.1003};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.1}, 1000, o);
  for (int i = 0; i < 2000; ++i) test::ok(dfm_world_step(w, 1e-3, nullptr));
  return w;
}

// Work that is the same each time and takes about `seconds`: what its times differ by is the machine's.
std::vector<double> empty_loops(int n, double seconds) {
  const auto turn = [](uint64_t turns) {
    const double at = bench::cpu_seconds();
    for (uint64_t i = 0; i < turns; ++i) __asm__ volatile("" : "+r"(i));
    return bench::cpu_seconds() - at;
  };
  double least = turn(100000);
  for (int i = 0; i < 20; ++i) least = std::min(least, turn(100000));
  const auto turns = static_cast<uint64_t>(100000 * seconds / least);
  std::vector<double> t;
  for (int i = 0; i < n; ++i) t.push_back(turn(turns));
  return t;
}

// The same run kRuns times: a step has the same work in each, so the least of its times is the step's own,
// and what the others have beyond it is the machine's.
void rest_of_a_stack(const test::Context &c) {
  constexpr int kSteps = 4000, kRuns = 5;
  std::vector<double> least, first;
  Counts counts;
  for (int run = 0; run < kRuns; ++run) {
    const dfm_world w = make_stack(c);
    const std::vector<double> t = times(w, kSteps, 1e-3, run ? nullptr : &counts);
    dfm_world_destroy(w);
    if (!run) least = first = t;
    for (size_t i = 0; i < t.size(); ++i) least[i] = std::min(least[i], t[i]);
  }
  const Times once = shares_of(first);
  row("resting stack of two, awake, 1 kHz", once);
  row("    least of five equal runs", shares_of(least));
  row("    empty loop as long as a step", shares_of(empty_loops(kSteps, once.median)));
  count_row("sub-steps", counts.substeps);
  count_row("outer iterations", counts.passes);
  count_row("sweeps", counts.sweeps);
}

}  // namespace

int main() {
  const test::Context c;
  {
    const Field asleep(c, true), awake(c, false);
    int settle = 0;
    for (; settle < 3000 && test::stats(asleep.world).asleep < 100; ++settle)
      test::ok(dfm_world_step(asleep.world, 1e-3, nullptr));
    std::printf("asleep after %d steps: %u of 100\n", settle, test::stats(asleep.world).asleep);
    row("100 bodies asleep", steps(asleep.world, 20000, 1e-3));
    test::ok(dfm_body_wake(asleep.bodies[0]));
    dfm_stage_time before[16], after[16];
    uint32_t n = 0;
    test::ok(dfm_world_profile(asleep.world, 16, before, &n));
    row("2 awake, 98 asleep", steps(asleep.world, 400, 1e-3));
    test::ok(dfm_world_profile(asleep.world, 16, after, &n));
    for (uint32_t i = 0; i < n; ++i)
      std::printf("    %-18s %8.2f us\n", after[i].name, 1e6 * (after[i].seconds - before[i].seconds) / 400);
    steps(awake.world, 300, 1e-3);
    row("100 bodies awake", steps(awake.world, 60, 1e-3));
  }
  rest_of_a_stack(c);
  return 0;
}
