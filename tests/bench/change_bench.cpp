// What a change between two steps costs: the call, and what prepare() makes anew for it before the next step.
//
//   change_bench [--csv FILE --commit HASH]
//
// Worlds of 10, 30 and 100 cubes on a floor, with one rule of friction per cube.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <functional>

#include "machine.h"
#include "world.h"

namespace {

using Sink = bench::Csv;

struct Scene {
  test::Context c;
  dfm_world world = test::make_world(c);
  std::vector<dfm_body> bodies;
  explicit Scene(uint32_t n) {
    test::add_plane(world, "floor");
    for (uint32_t i = 0; i < n; ++i) {
      test::BodyOptions o;
      o.name = name(i);
      o.position = {0.2 * i, 0, 1e-4};
      bodies.push_back(test::make_body(c, world, "beam", {0.1, 0.1, 0.1}, 10, o));
      add(i, 0.5);
    }
    for (int i = 0; i < 5; ++i) test::ok(dfm_world_step(world, 1e-4, nullptr));
  }
  static std::string name(uint32_t i) { return "cube" + std::to_string(i); }
  void add(uint32_t i, double mu) const {
    const std::string a = name(i);
    const dfm_param_value v{"mu", &mu, 1};
    dfm_friction_def f{};
    f.size = sizeof f;
    f.between[0] = a.c_str();
    f.between[1] = "floor";
    f.law = "coulomb";
    f.params = {sizeof(dfm_params), 1, &v};
    test::ok(dfm_world_add_friction(world, &f));
  }
  void set(double mu) const {
    const dfm_param_value v{"mu", &mu, 1};
    const dfm_params params{sizeof params, 1, &v};
    test::ok(dfm_world_set_friction(world, "cube0", "floor", &params));
  }
  // All that the next step does before its first sub-step, but for the step bound.
  void prepare() const {
    uint32_t n = 0;
    test::ok(dfm_world_profile(world, 0, nullptr, &n));
  }
};

void measure(const Sink &sink, const Scene &s, const char *what, const std::function<void(int)> &change) {
  double best = HUGE_VAL;
  const int calls = 20;
  for (int round = 0; round < 5; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < calls; ++i) {
      change(round * calls + i);
      s.prepare();
    }
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    best = std::min(best, 1e6 * spent.count() / calls);
  }
  std::printf("%6zu %-28s %10.1f us\n", s.bodies.size(), what, best);
  if (sink.csv) std::fprintf(sink.csv, "%s,%zu,%s,%.1f\n", sink.head.c_str(), s.bodies.size(), what, best);
}

}  // namespace

int main(int argc, char **argv) {
  Sink sink(argc, argv, "bodies,change,us");
  for (const uint32_t n : {10u, 30u, 100u}) {
    const Scene s(n);
    uint32_t load = 0;
    const uint32_t point = 1;
    const double force[3] = {0.1, 0, 0};
    test::ok(dfm_body_add_load(s.bodies[0], 1, &point, force, 0, nullptr, nullptr, &load));
    measure(sink, s, "load replaced", [&](int) {
      test::ok(dfm_body_remove_load(s.bodies[0], load));
      test::ok(dfm_body_add_load(s.bodies[0], 1, &point, force, 0, nullptr, nullptr, &load));
    });
    measure(sink, s, "gravity", [&](int i) {
      const double g[3] = {0.001 * i, 0, -9.81};
      test::ok(dfm_world_set_gravity(s.world, g));
    });
    measure(sink, s, "mu set", [&](int i) { s.set(0.3 + 1e-4 * i); });
    measure(sink, s, "mu given again", [&](int i) { s.add(0, 0.3 + 1e-4 * i); });
    measure(sink, s, "rule removed and added", [&](int i) {
      test::ok(dfm_world_remove_friction(s.world, "cube0", "floor"));
      s.add(0, 0.3 + 1e-4 * i);
    });
  }
  return 0;
}
