// Undamped bodies at "auto": 1e6 steps of what dfm_world_stable_step answers, on every mesh that is shipped
// and on meshes of the thesis, a row each (doc/concepts/step.md). Rows that the table has are left alone, so
// that the run may be stopped and taken up again.
//
//   step_study TABLE.csv [--commit ID] [--only TEXT] [--steps N] [--seconds N]
//       rows whose name contains TEXT; begins no row after N seconds
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <set>

#include "machine.h"
#include "step_energy.h"
#include "support.h"

namespace {

using namespace test::step_energy;

constexpr const char *kThesis[] = {"cyl_222", "cyl_coarse", "cyl_coarse_q", "cyl_fine_q"};

// Each mesh once before any mesh twice, small ones first.
std::vector<Case> cases() {
  // size of the file; made here: about
  std::vector<std::pair<uintmax_t, std::string>> meshes = {
      {20000, "beam"}, {20000, "cylinder"}, {20000, "ball"}};
  for (const auto &entry : std::filesystem::directory_iterator(DEFORM_SOURCE_DIR "/examples/data"))
    if (entry.path().extension() == ".msh") meshes.push_back({entry.file_size(), entry.path().string()});
  for (const char *name : {"rabbit", "organ"})
    meshes.push_back({100000, std::string(DEFORM_SOURCE_DIR "/examples/data/") + name + ".obj"});
  for (const char *name : kThesis) {
    const std::string path = test::mesh_dir() + "/thesis/" + name + ".msh";
    meshes.push_back({std::filesystem::file_size(path), path});
  }
  std::sort(meshes.begin(), meshes.end());
  std::vector<Case> out;
  // negative: as it follows from Poisson's ratio
  struct Run {
    const char *motion;
    double volume;
  };
  for (const Run &run : {Run{"spin", 1},
                         {"spin", 0},
                         {"hung", 1},
                         {"ring", 1},
                         {"hung", 0},
                         {"ring", 0},
                         {"wrung", 1},
                         {"whirl", -1}})
    for (const auto &[size, path] : meshes) {
      const char *const made = path.find('.') == std::string::npos ? "made_" : "";
      const char *const volume = run.volume > 0 ? ",1" : run.volume < 0 ? ",auto" : ",0";
      out.push_back({made + std::filesystem::path(path).stem().string() + "," + run.motion + volume, path,
                     run.motion, run.volume});
    }
  return out;
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "step_study TABLE.csv [--commit ID] [--only TEXT] [--steps N] [--seconds N]\n");
    return 2;
  }
  std::string only, commit = "unknown";
  double seconds = 1e9;
  uint64_t steps = 1000000;
  for (int i = 2; i + 1 < argc; ++i) {
    if (!std::strcmp(argv[i], "--only")) only = argv[i + 1];
    if (!std::strcmp(argv[i], "--commit")) commit = argv[i + 1];
    if (!std::strcmp(argv[i], "--seconds")) seconds = std::atof(argv[i + 1]);
    if (!std::strcmp(argv[i], "--steps")) steps = uint64_t(std::atof(argv[i + 1]));
  }
  const std::set<std::string> done = bench::names_in(argv[1], 3, 3);  // after machine, compiler and commit
  std::FILE *table = std::fopen(argv[1], "a");
  if (!table) {
    std::perror(argv[1]);
    return 2;
  }
  if (done.empty())
    std::fprintf(table,
                 "machine,compiler,commit,mesh,motion,volume,steps,substeps,changes,energy_J,block_least,"
                 "block_most,trend_per_1e6,sample_least,sample_most,inverted,cpu_s\n");
  const auto start = std::chrono::steady_clock::now();
  test::Context context;
  int bad = 0;
  std::printf("%-30s %9s %7s %12s %10s %10s %10s\n", "mesh,motion,volume", "steps", "changes", "energy J",
              "least", "most", "trend");
  for (const Case &c : cases()) {
    if (done.count(c.name) || c.name.find(only) == std::string::npos) continue;
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > seconds) continue;
    const double cpu = bench::process_seconds();
    const Result r = run_case(context, c, steps, 100);
    const bool keeps = !r.stopped && r.least > -0.02 && r.most < 0.02;
    bad += !keeps;
    std::fprintf(table, "%s,%s,%s,%s,%llu,%llu,%llu,%.6g,%.3g,%.3g,%.3g,%.3g,%.3g,%llu,%.1f\n",
                 bench::machine().c_str(), bench::compiler(), commit.c_str(), c.name.c_str(),
                 static_cast<unsigned long long>(r.steps), static_cast<unsigned long long>(r.substeps),
                 static_cast<unsigned long long>(r.changes), r.scale, r.least, r.most, r.trend, r.lowest,
                 r.highest, static_cast<unsigned long long>(r.inverted), bench::process_seconds() - cpu);
    std::fflush(table);
    std::printf("%-30s %9llu %7llu %12.4g %10.2e %10.2e %10.2e %s\n", c.name.c_str(),
                static_cast<unsigned long long>(r.steps), static_cast<unsigned long long>(r.changes), r.scale,
                r.least, r.most, r.trend, keeps ? "" : "NOT KEPT");
    std::fflush(stdout);
  }
  std::fclose(table);
  return bad > 0;
}
