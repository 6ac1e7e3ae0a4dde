// What more threads can give a scene, from one thread: a host's parallel_for that runs the blocks of each job
// one after the other and takes their times. Per stage: microseconds of a step, the share of it that comes in
// blocks, jobs, blocks, microseconds on two threads; then the factor that n threads would give, the blocks of
// each job taken in turn by whoever is free, with `handout` microseconds for each job. What this program does
// between blocks counts for nothing. Steps that took three times the median were disturbed by other work of
// the machine, and are left out.
//   thread_shares SCENE SECONDS [HANDOUT]
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "deform/deform.h"

namespace {

constexpr uint32_t kThreads[] = {1, 2, 3, 4, 8, 16, 64};
constexpr size_t kCounts = sizeof kThreads / sizeof *kThreads;

// us. The clock of this thread's processor time would be a system call: a look costs 0.3 us, and as much
// again afterward in what the kernel has put out of the caches, which is no part of a block and so counts as
// serial.
double now() {
  const auto t = std::chrono::steady_clock::now().time_since_epoch();
  return 1e-3 * double(std::chrono::duration_cast<std::chrono::nanoseconds>(t).count());
}
double since(double start) { return now() - start; }

// us, between two looks at that clock
double cost_of_a_look() {
  std::vector<double> cost;
  for (int i = 0; i < 2001; ++i) cost.push_back(since(now()));
  std::nth_element(cost.begin(), cost.begin() + 1000, cost.end());
  return cost[1000];
}

struct Zone {
  std::string name;
  double time = 0, blocks_time = 0;
  double jobs = 0, blocks = 0;
  double saved = 0;  // by a second thread
};

struct Shares {
  std::vector<Zone> zones{{"outside stages"}}, step;
  size_t at = 0;
  double begun = 0;
  double look = cost_of_a_look(), paid = 0;  // us; for what is not the library's work
  double handout = 0.5;
  std::vector<double> times;
  std::vector<double> saved[kCounts];  // by count, then by step: what threads save of it

  static void begin(void *user, const char *name) {
    Shares &s = *static_cast<Shares *>(user);
    s.at = 1;
    while (s.at < s.zones.size() && s.zones[s.at].name != name) ++s.at;
    if (s.at == s.zones.size()) s.zones.push_back({name});
    s.begun = now() - s.paid;
  }
  static void end(void *user, const char *) {
    Shares &s = *static_cast<Shares *>(user);
    s.zones[s.at].time += since(s.begun + s.paid);
    s.at = 0;
  }
  static void run(void *user, uint32_t n, uint32_t grain, void (*fn)(void *, uint32_t, uint32_t),
                  void *task) {
    Shares &s = *static_cast<Shares *>(user);
    if (n <= grain) return fn(task, 0, n);
    const double entered = now();
    Zone &zone = s.zones[s.at];
    double total = 0;
    std::vector<double> free[kCounts];
    for (size_t k = 0; k < kCounts; ++k) free[k].assign(kThreads[k], 0.0);
    for (uint32_t from = 0; from < n; from += grain) {
      const double start = now();
      fn(task, from, std::min(n, from + grain));
      const double took = std::max(0.0, since(start) - s.look);
      total += took;
      for (auto &threads : free) *std::min_element(threads.begin(), threads.end()) += took;
      ++zone.blocks;
    }
    ++zone.jobs;
    zone.blocks_time += total;
    zone.saved += total - *std::max_element(free[1].begin(), free[1].end()) - s.handout;
    for (size_t k = 1; k < kCounts; ++k)
      s.saved[k].back() += total - *std::max_element(free[k].begin(), free[k].end()) - s.handout;
    s.paid += std::max(0.0, since(entered) - total);
  }
};

}  // namespace

int main(int argc, char **argv) {
  if (argc < 3) return 2;
  Shares shares;
  if (argc > 3) shares.handout = std::atof(argv[3]);
  dfm_context_def def = dfm_context_def_default();
  def.user = &shares;
  def.parallel_for = Shares::run;
  def.trace_begin = Shares::begin;
  def.trace_end = Shares::end;
  dfm_context *context = nullptr;
  dfm_scene scene = 0;
  dfm_world world = 0;
  dfm_scene_settings settings{};
  settings.size = sizeof settings;
  for (auto &saved : shares.saved) saved.push_back(0);
  if (dfm_context_create(&def, &context) != DFM_OK ||
      dfm_scene_open(context, argv[1], nullptr, &scene) != DFM_OK ||
      dfm_scene_world(scene, &world) != DFM_OK || dfm_scene_get_settings(scene, &settings) != DFM_OK) {
    std::fprintf(stderr, "thread_shares: %s\n", dfm_last_error());
    return 1;
  }
  for (auto &saved : shares.saved) saved.clear();
  const std::vector<Zone> loaded = shares.zones;
  shares.zones = {{"outside stages"}};
  const long n = long(std::atof(argv[2]) / settings.step + 0.5);
  for (long i = 0; i < n; ++i) {
    for (auto &saved : shares.saved) saved.push_back(0);
    const std::vector<Zone> before = shares.zones;
    const double start = now() - shares.paid;
    if (dfm_world_step(world, settings.step, nullptr) != DFM_OK) return 1;
    shares.times.push_back(since(start + shares.paid));
    double sum = 0;
    for (size_t z = 1; z < shares.zones.size(); ++z)
      sum += shares.zones[z].time - (z < before.size() ? before[z].time : 0);
    shares.zones[0].time += shares.times.back() - sum;
    std::vector<double> sorted = shares.times;
    if (i < 20) continue;
    if (sorted.size() > 101) sorted.erase(sorted.begin(), sorted.end() - 101);
    std::nth_element(sorted.begin(), sorted.begin() + long(sorted.size() / 2), sorted.end());
    if (shares.times.back() < 3 * sorted[sorted.size() / 2]) continue;
    shares.times.pop_back();
    for (auto &saved : shares.saved) saved.pop_back();
    shares.zones = before;
  }
  double all = 0, total = 0, blocks = 0;
  for (const double t : shares.times) all += t;
  for (const Zone &z : shares.zones) total += z.time;
  const double steps = double(shares.times.size());
  std::printf("%-18s %10s %8s %10s %8s %8s %12s\n", "stage", "us/step", "share", "in blocks", "jobs",
              "blocks", "on 2 threads");
  for (const Zone &z : shares.zones) {
    blocks += z.blocks_time;
    std::printf("%-18s %10.2f %7.1f%% %9.1f%% %8.2f %8.1f %12.2f\n", z.name.c_str(), z.time / steps,
                100 * z.time / total, z.time > 0 ? 100 * z.blocks_time / z.time : 0, z.jobs / steps,
                z.blocks / steps, (z.time - z.saved) / steps);
  }
  std::printf("%.0f of %ld steps, %.1f us each, p = %.3f, hand-out %.2f us\n", steps, n, all / steps,
              blocks / total, shares.handout);
  for (size_t k = 1; k < kCounts; ++k) {
    double left = all;
    for (const double s : shares.saved[k]) left -= s;
    std::printf("%2u threads: %.2f\n", kThreads[k], all / left);
  }
  dfm_scene_close(scene);
  dfm_context_destroy(context);
}
