// What an engine's adapter costs. 100 rigid boxes, 10 of them on a soft bed, 90 on the engine's plane, at
// rest and awake. Of a step: the engine's own collision and constraints, the soft bodies' stages, and the
// rest, which is the adapter: looking over the engine's world, predictions, responses, states in and out.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "load.h"
#include "machine.h"

namespace {

struct Parts { double total, engine, soft, sync, host; };

double stage_seconds(dfm_world w, bool rigid) {
  uint32_t n = 0;
  test::ok(dfm_world_profile(w, 0, nullptr, &n));
  std::vector<dfm_stage_time> stages(n);
  test::ok(dfm_world_profile(w, n, stages.data(), &n));
  double sum = 0;
  for (const dfm_stage_time &s : stages)
    if ((std::string(s.name).rfind("rigid", 0) == 0) == rigid && std::string(s.name) != "step")
      sum += s.seconds;
  return sum;
}

Parts now(const test::Engine &engine) {
  const double own = engine.engine_seconds();
  return {0, own, stage_seconds(engine.soft, false), engine.stats().sync_seconds,
          stage_seconds(engine.soft, true) - own};
}

}  // namespace

int main() {
  test::Engine engine;
  test::fill_load(engine);
  engine.run(0.5);
  constexpr int kWindows = 20, kSteps = 25;
  std::vector<Parts> windows;
  for (int k = 0; k < kWindows; ++k) {
    const Parts before = now(engine);
    engine.run(kSteps * 1e-3);
    const Parts after = now(engine);
    Parts p{0, after.engine - before.engine, after.soft - before.soft, after.sync - before.sync,
            after.host - before.host};
    windows.push_back(p);
  }
  // The median of each part by itself: a window in which another process was let in spoils one part of it,
  // seldom the same.
  const auto median = [&](double Parts::*part) {
    std::sort(windows.begin(), windows.end(),
              [&](const Parts &a, const Parts &b) { return a.*part < b.*part; });
    return windows[kWindows / 2].*part;
  };
  Parts p{0, median(&Parts::engine), median(&Parts::soft), median(&Parts::sync), median(&Parts::host)};
  p.total = p.engine + p.soft + p.sync + p.host;
  const double ms = 1e3 / kSteps;
  const dfm_world_stats w = test::stats(engine.soft);
  std::printf(
      "machine,compiler,engine,rigid,touching contacts,sub-steps,step ms,engine ms,soft ms,look over the "
      "world "
      "ms,solve's questions ms,adapter share,state\n");
  std::printf("%s,%s,%s,%u,%u,%u,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f,%016llx\n", bench::machine().c_str(),
              bench::compiler(), test::kEngine, engine.stats().bodies, w.contacts, w.last_substeps,
              ms * p.total, ms * p.engine, ms * p.soft, ms * p.sync, ms * p.host, (p.sync + p.host) / p.total,
              static_cast<unsigned long long>(dfm_world_hash(engine.soft)));
  return (p.sync + p.host) / p.total <= 0.05 ? 0 : 1;
}
