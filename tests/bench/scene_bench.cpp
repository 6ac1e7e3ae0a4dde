// Full steps per second of processor time, on the scene files that are examples and tests too. What is timed
// is dfm_world_step alone: model, detection, contact and friction, one core. Prints a table with the figure
// to reach and where the time goes;
// --csv FILE appends rows; --only TEXT takes scenes whose name contains it; --law NAME puts that law, with
// the same coefficient, into their first rule.
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "deform/deform.h"
#include "machine.h"
#include "support.h"

namespace {

struct Case {
  const char *name, *scene;
  std::vector<std::string> set;
  double settle, timed;  // s simulated before and during the measurement
  double reach;          // full steps per second; 0: none stated
};

[[noreturn]] void die(const std::string &what) {
  std::fprintf(stderr, "scene_bench: %s: %s\n", what.c_str(), dfm_last_error());
  std::exit(2);
}

void run(dfm_context *context, const Case &c, std::FILE *csv, const std::string &commit) {
  std::vector<const char *> set;
  for (const auto &s : c.set) set.push_back(s.c_str());
  dfm_scene_options options{};
  options.size = sizeof options;
  options.nset = static_cast<uint32_t>(set.size());
  options.set = set.data();
  dfm_scene scene = 0;
  dfm_world world = 0;
  const std::string path = std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/" + c.scene;
  if (dfm_scene_open(context, path.c_str(), &options, &scene) != DFM_OK ||
      dfm_scene_world(scene, &world) != DFM_OK) {
    std::printf("%-40s left out: %s\n", c.name, dfm_last_error());
    return;
  }
  dfm_scene_settings settings{};
  settings.size = sizeof settings;
  if (dfm_scene_get_settings(scene, &settings) != DFM_OK) die(c.name);
  const double h = settings.step;
  auto steps = [&](double seconds) {
    const long n = static_cast<long>(seconds / h + 0.5);
    for (long i = 0; i < n; ++i)
      if (dfm_world_step(world, h, nullptr) != DFM_OK) die(c.name);
    return n;
  };
  auto stats = [&] {
    dfm_world_stats s{};
    s.size = sizeof s;
    if (dfm_world_get_stats(world, &s) != DFM_OK) die(c.name);
    return s;
  };
  steps(c.settle);
  const dfm_world_stats before = stats();
  dfm_stage_time t0[16], t1[16];
  uint32_t n = 0;
  dfm_world_profile(world, 16, t0, &n);
  const double start = bench::process_seconds();
  // Slices of the timed part: the fastest tells what the machine can do, the whole what it did.
  double fastest = 0;
  long total = 0;
  uint64_t contacts = 0, sweeps = 0, slices = 20;
  for (uint64_t k = 0; k < slices; ++k) {
    const double at = bench::process_seconds();
    const long done = steps(c.timed / double(slices));
    total += done;
    fastest = std::max(fastest, double(done) / (bench::process_seconds() - at));
    contacts += stats().contacts;
    sweeps += stats().sweeps;
  }
  const double rate = double(total) / (bench::process_seconds() - start);
  dfm_world_profile(world, 16, t1, &n);
  const dfm_world_stats after = stats();
  const double substeps = double(after.substeps - before.substeps) / double(total);
  std::printf("%-40s %8.0f (best %.0f)", c.name, rate, fastest);
  if (c.reach > 0) std::printf("  reach %6.0f: %3.0f %%", c.reach, 100 * rate / c.reach);
  if (after.guard_steps > before.guard_steps)
    std::printf("  guard acted in %g sub-steps", double(after.guard_steps - before.guard_steps));
  std::printf("  contacts %.0f  sub-steps %.2f  sweeps %.1f\n", double(contacts) / double(slices), substeps,
              double(sweeps) / double(slices));
  double all = 0;
  for (uint32_t i = 0; i < n; ++i) all += t1[i].seconds - t0[i].seconds;
  for (uint32_t i = 0; i < n; ++i)
    std::printf("    %-18s %5.1f %%\n", t1[i].name, 100 * (t1[i].seconds - t0[i].seconds) / all);
  if (csv)
    std::fprintf(csv, "%s,%s,%s,%s,%.0f,%.0f,%.0f,%.1f,%.2f\n", bench::machine().c_str(), bench::compiler(),
                 commit.c_str(), c.name, rate, fastest, c.reach, double(contacts) / double(slices), substeps);
  dfm_scene_close(scene);
}

}  // namespace

int main(int argc, char **argv) {
  std::FILE *csv = nullptr;
  std::string commit = "unknown", only, law;
  for (int i = 1; i + 1 < argc; ++i) {
    if (!std::strcmp(argv[i], "--csv")) csv = std::fopen(argv[i + 1], "w");
    if (!std::strcmp(argv[i], "--commit")) commit = argv[i + 1];
    if (!std::strcmp(argv[i], "--only")) only = argv[i + 1];
    if (!std::strcmp(argv[i], "--law")) law = argv[i + 1];
  }
  if (csv)
    std::fprintf(csv, "machine,compiler,commit,scene,steps_per_cpu_s,best_slice,reach,contacts,substeps\n");
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  dfm_context *context = nullptr;
  if (dfm_context_create(&def, &context) != DFM_OK) die("context");
  // Springs alone carry the pair when they are stiffer (the step still is one sub-step); the bad cells of the
  // coarse mesh need more of it.
  const auto springs = [](const char *soft) {
    return std::vector<std::string>{"/bodies/0/model/params/volume=0", "/bodies/1/model/params/volume=0",
                                    "/materials/firm/young=6e5",
                                    std::string("/materials/soft/young=") + soft};
  };
  // The forces in single precision (dfm.f32/1).
  const auto single = [](std::vector<std::string> set) {
    for (const char *body : {"0", "1"})
      set.push_back(std::string("/bodies/") + body + "/model/precision=\"single\"");
    return set;
  };
  const std::vector<Case> cases{
      {"fine pair: springs", "two_cylinders_fine.json", springs("1.2e5"), 3, 1, 2000},
      {"fine pair: springs and volume", "two_cylinders_fine.json", {}, 3, 1, 1200},
      {"coarse pair: springs", "two_cylinders_coarse.json", springs("2.5e5"), 3, 1, 10000},
      {"coarse pair: springs and volume", "two_cylinders_coarse.json", {}, 3, 1, 6000},
      {"fine pair: springs, single", "two_cylinders_fine.json", single(springs("1.2e5")), 3, 1, 3000},
      {"fine pair: springs and volume, single", "two_cylinders_fine.json", single({}), 3, 1, 0},
      {"coarse pair: springs, single", "two_cylinders_coarse.json", single(springs("2.5e5")), 3, 1, 15000},
      {"coarse pair: springs and volume, single", "two_cylinders_coarse.json", single({}), 3, 1, 0},
      {"own pair (demo)", "two_cylinders.json", {}, 2, 1, 0},
      {"ten bodies", "ten_bodies.json", {}, 1, 0.5, 0},
      // What the guard costs: the same without it.
      {"fine pair, unguarded", "two_cylinders_fine.json", {"/contact/guard=false"}, 3, 1, 0},
      {"own pair, unguarded", "two_cylinders.json", {"/contact/guard=false"}, 2, 1, 0},
      {"ten bodies, unguarded", "ten_bodies.json", {"/contact/guard=false"}, 1, 0.5, 0},
  };
  std::printf("%-40s %8s\n", "scene", "full steps per second of processor time");
  for (Case c : cases) {
    if (std::string(c.name).find(only) == std::string::npos) continue;
    const char *const params = law == "none"   ? "{}"
                               : law == "dahl" ? "{\"mu_C\": 0.8}"
                                               : "{\"mu_C\": 0.8, \"mu_S\": 0.8}";
    if (!law.empty()) {
      c.set.push_back("/contact/friction/0/law=\"" + law + "\"");
      c.set.push_back(std::string("/contact/friction/0/params=") + params);
    }
    run(context, c, csv, commit);
  }
  dfm_context_destroy(context);
  if (csv) std::fclose(csv);
}
