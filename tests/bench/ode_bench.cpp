// What the ODE adapter costs. 100 rigid boxes, 10 of them on a soft bed, 90 on ODE's plane, at rest and
// awake. Of a dfm_ode_step: ODE's own collision and dWorldStep, the soft bodies' stages, and the rest, which
// is the adapter: looking over the space, predictions, responses, states in and out.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "machine.h"
#include "ode.h"

namespace {

struct Parts { double total, ode, soft, sync, host; };

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

Parts now(const test::Ode &ode) {
  const dfm_ode_stats s = ode.stats();
  return {0, s.ode_seconds, stage_seconds(ode.soft, false), s.sync_seconds,
          stage_seconds(ode.soft, true) - s.ode_seconds};
}

}  // namespace

int main() {
  test::Ode ode;
  dCreatePlane(ode.space, 0, 0, 1, 0);
  test::BodyOptions o;
  o.name = "bed";
  o.young = 4e4;
  o.damping_stiffness = 0.003;
  o.damping_mass = 4;
  o.position = {0, 0, 0.001};
  const dfm_body bed = test::make_body(ode.context, ode.soft, "beam", {1.0, 0.4, 0.1}, 4000, o);
  test::hold_bottom(bed);
  for (int i = 0; i < 10; ++i)
    ode.box({0.04, 0.04, 0.04}, 0.3, {0.1 + 0.2 * (i % 5), 0.1 + 0.2 * (i / 5), 0.142});
  for (int i = 0; i < 90; ++i) ode.box({0.04, 0.04, 0.04}, 0.3, {2 + 0.2 * (i % 10), 0.2 * (i / 10), 0.04});
  ode.run(0.5);
  constexpr int kWindows = 20, kSteps = 25;
  std::vector<Parts> windows;
  for (int k = 0; k < kWindows; ++k) {
    const Parts before = now(ode);
    ode.run(kSteps * 1e-3);
    const Parts after = now(ode);
    Parts p{0, after.ode - before.ode, after.soft - before.soft, after.sync - before.sync,
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
  Parts p{0, median(&Parts::ode), median(&Parts::soft), median(&Parts::sync), median(&Parts::host)};
  p.total = p.ode + p.soft + p.sync + p.host;
  const double ms = 1e3 / kSteps;
  const dfm_world_stats w = test::stats(ode.soft);
  std::printf(
      "machine,compiler,rigid,touching contacts,sub-steps,step ms,ODE ms,soft ms,look over the space "
      "ms,solve's questions ms,adapter share\n");
  std::printf("%s,%s,%u,%u,%u,%.4f,%.4f,%.4f,%.4f,%.4f,%.4f\n", bench::machine().c_str(), bench::compiler(),
              ode.stats().bodies, w.contacts, w.last_substeps, ms * p.total, ms * p.ode, ms * p.soft,
              ms * p.sync, ms * p.host, (p.sync + p.host) / p.total);
  return (p.sync + p.host) / p.total <= 0.05 ? 0 : 1;
}
