// Whether a scene keeps up with its own clock: processor time of each step on one thread, median and the
// largest of a thousand, and what a probe feels. All steps count from the first on, first touches included.
//
// real_time_bench SCENE [--model NAME] [--integrator NAME] [--cells N] [--time S] [--step S] [--set TEXT]
//                 [--wander S] [--series FILE] [--against FILE] [--csv FILE --commit HASH]
//                 [--histogram FILE] [--times FILE] [--paced yes]
//
// --paced has the steps wait for the clock, and counts the clock's time from when each should have begun:
// what a loop sees that runs with the time, with the other threads of its core.
// --wander has the first obstacle go to and fro over the top of probe_block.json for so long, at the scene's
// speed, on lanes side by side, over surfels that nothing has touched before. --series writes t, the force on
// the first body (N) and the place of the first probe (m) at each millisecond; --against compares with such a
// file: the largest difference over the largest value. --histogram adds rows to a CSV file: steps by time.
// --times writes a line of names, and then for each step its milliseconds, its units of work, whether it cuts
// (1) or follows one that does (2), and the milliseconds of each stage. Where tools cut, steps that cut, and
// the step after each of them, which makes its tables anew, are told apart from the others.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "deform/deform.h"
#include "machine.h"

namespace {

double wall_seconds() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

void sleep_until(double seconds) {
  timespec t{};
  t.tv_sec = time_t(seconds);
  t.tv_nsec = long(1e9 * (seconds - double(t.tv_sec)));
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

void ok(dfm_status status) {
  if (status == DFM_OK) return;
  std::fprintf(stderr, "real_time_bench: %s\n", dfm_last_error());
  std::exit(2);
}

struct Sample { double t, force[3], place[3]; };

struct Run {
  std::vector<double> seconds;
  std::vector<uint64_t> work;  // units of each step, which no load of the machine changes
  dfm_world_stats last{};
  std::vector<uint8_t> cut;                           // 1: the step has cut; 2: the one before it has
  std::vector<std::map<std::string, double>> stages;  // s, of each step, by name: a cut may change the plan
  std::vector<Sample> series;
  double contacts = 0;
};

// s, of each stage since the world was made
std::map<std::string, double> profile(dfm_world world) {
  dfm_stage_time stages[32];
  uint32_t n = 0;
  ok(dfm_world_profile(world, 32, stages, &n));
  std::map<std::string, double> out;
  for (uint32_t i = 0; i < n; ++i) out[stages[i].name] = stages[i].seconds;
  return out;
}

bool has_cut(dfm_world world) {
  static std::vector<dfm_contact_event> events(4096);
  uint32_t n = 0;
  ok(dfm_world_events(world, uint32_t(events.size()), events.data(), &n));
  return std::any_of(events.begin(), events.begin() + n, [](const dfm_contact_event &e) {
    return e.kind == DFM_EVENT_CUT || e.kind == DFM_EVENT_TEAR;
  });
}

// places: ask for the probe's place each ten milliseconds; a body whose inner points are late finds them.
// paced: steps begin at the clock's multiples of the step, and their time is that of the clock from there to
// their end, so what else runs on the core counts too.
Run run(dfm_scene scene, dfm_world world, double duration, double step, bool places, bool paced) {
  Run out;
  double next = wall_seconds();
  const long steps = std::lround(duration / step), every = std::max(1L, std::lround(1e-3 / step));
  double force[3] = {};
  std::map<std::string, double> before = profile(world);
  for (long n = 0; n < steps; ++n) {
    if (paced) {
      next += step;
      if (const double now = wall_seconds(); now > next) next = now;
      sleep_until(next);
    }
    const double at = paced ? next : bench::cpu_seconds();
    ok(dfm_world_step(world, step, nullptr));
    out.seconds.push_back((paced ? wall_seconds() : bench::cpu_seconds()) - at);
    out.cut.push_back(has_cut(world) ? 1 : !out.cut.empty() && out.cut.back() == 1 ? 2 : 0);
    const std::map<std::string, double> now = profile(world);
    out.stages.emplace_back();
    for (const auto &[name, seconds] : now) out.stages.back()[name] = seconds - before[name];
    before = now;
    dfm_pair_impulse pair[16] = {};
    uint32_t pairs = 0;
    ok(dfm_world_pair_impulses(world, 16, pair, &pairs));
    for (uint32_t i = 0; i < pairs; ++i)
      for (int a = 0; a < 3; ++a) force[a] += pair[i].impulse[a] / (step * double(every));
    dfm_world_stats stats{};
    stats.size = sizeof stats;
    ok(dfm_world_get_stats(world, &stats));
    out.contacts += double(stats.contacts) / double(steps);
    out.work.push_back(stats.work);
    out.last = stats;
    if ((n + 1) % every != 0) continue;
    Sample s{double(n + 1) * step, {force[0], force[1], force[2]}, {}};
    if (!places) continue;
    if (every == 1 && (n + 1) % 10 != 0 && !out.series.empty())
      std::copy(out.series.back().place, out.series.back().place + 3, s.place);
    else ok(dfm_scene_probe(scene, 0, nullptr, s.place, nullptr));
    out.series.push_back(s);
    std::fill(force, force + 3, 0.0);
  }
  return out;
}

// Of the ten-millisecond means of the force, and of the place at the ends of these: the largest difference
// over the largest value, the place counted from where it began.
void compare(const std::vector<Sample> &now, const std::vector<Sample> &with, double error[2]) {
  double most[2] = {}, apart[2] = {};
  for (size_t n = 9; n < std::min(now.size(), with.size()); n += 10) {
    double value[2] = {}, other[2] = {};
    for (int a = 0; a < 3; ++a) {
      double f = 0, g = 0;
      for (size_t k = n - 9; k <= n; ++k) {
        f += now[k].force[a] / 10;
        g += with[k].force[a] / 10;
      }
      value[0] += g * g;
      other[0] += (f - g) * (f - g);
      const double u = with[n].place[a] - with[9].place[a], d = now[n].place[a] - with[n].place[a];
      value[1] += u * u;
      other[1] += d * d;
    }
    for (int i = 0; i < 2; ++i) {
      most[i] = std::max(most[i], value[i]);
      apart[i] = std::max(apart[i], other[i]);
    }
  }
  for (int i = 0; i < 2; ++i) error[i] = std::sqrt(apart[i] / most[i]);
}

// Keyframes on lanes of 8 cm, 5 mm apart, after the scene's own way down; 0.15 m/s.
std::string lanes(double duration) {
  std::string out = "/obstacles/0/motion/keyframes=[{\"t\":0,\"position\":[0.06,0.06,0.151]}";
  const auto add = [&](double t, double x, double y) {
    char text[120];
    std::snprintf(text, sizeof text, ",{\"t\":%.4f,\"position\":[%.4f,%.4f,0.142]}", t, x, y);
    out += text;
  };
  double t = 0.15;
  for (int lane = 0; t < duration; ++lane) {
    const double y = 0.06 + 0.005 * (lane % 17);
    add(t, lane % 2 ? 0.14 : 0.06, y);
    add(t += 0.08 / 0.15, lane % 2 ? 0.06 : 0.14, y);
    t += 0.08 / 0.15 / 4;
  }
  return out + "]";
}

// Steps by their time, ms: a bin's upper end is a quarter above its lower one.
void write_histogram(const char *path, const std::vector<double> &sorted, const std::string &row) {
  std::FILE *csv = std::fopen(path, "a");
  if (std::ftell(csv) == 0)
    std::fprintf(csv, "machine,compiler,commit,model,points,contacts,below_ms,steps\n");
  size_t at = 0;
  for (double end = 0.1; at < sorted.size(); end *= 1.25) {
    const size_t first = at;
    while (at < sorted.size() && 1e3 * sorted[at] < end) ++at;
    if (at > first) std::fprintf(csv, "%s,%.3f,%zu\n", row.c_str(), end, at - first);
  }
  std::fclose(csv);
}

// Of the steps of one kind.
void print_kind(const Run &run, uint8_t kind, const char *what, double step) {
  std::vector<double> t;
  for (size_t n = 0; n < run.seconds.size(); ++n)
    if (run.cut[n] == kind) t.push_back(run.seconds[n]);
  if (t.empty()) return;
  std::sort(t.begin(), t.end());
  const auto late = t.end() - std::upper_bound(t.begin(), t.end(), step);
  std::printf("    %-22s %7zu steps: median %.3f, 99.9 %% %.3f, most %.3f ms, %td above the step\n", what,
              t.size(), 1e3 * t[t.size() / 2], 1e3 * t[t.size() * 999 / 1000], 1e3 * t.back(), late);
}

// What a unit of contact takes: of steps without a cut, the hundredth with the most units against those
// around the median. Then the units that fit into nine tenths of a step; the rest counts no units.
void print_max_work(const Run &run, double step) {
  std::vector<std::pair<double, double>> steps;  // units, s
  for (size_t n = 0; n < run.seconds.size(); ++n)
    if (run.cut[n] == 0) steps.emplace_back(double(run.work[n]), run.seconds[n]);
  if (steps.size() < 100) return;
  std::sort(steps.begin(), steps.end());
  const auto mean = [&](size_t from, size_t to) {
    std::pair<double, double> sum;
    for (size_t k = from; k < to; ++k) {
      sum.first += steps[k].first / double(to - from);
      sum.second += steps[k].second / double(to - from);
    }
    return sum;
  };
  const size_t n = steps.size();
  const auto usual = mean(n * 45 / 100, n * 55 / 100), hard = mean(n * 99 / 100, n);
  const double more = hard.first - usual.first, longer = hard.second - usual.second;
  if (!(more > 0.05 * usual.first) || !(longer > 0)) return;
  const double fits = usual.first + (0.9 * step - usual.second) * more / longer;
  std::printf("    hard steps take %.0f ns for each unit beyond the usual %.0f: ", 1e9 * longer / more,
              usual.first);
  if (fits > usual.first) std::printf("\"max_work\": %.0f for steps of %g ms\n", fits, 1e3 * step);
  else std::printf("no \"max_work\" makes these steps as short as %g ms\n", 1e3 * step);
}

std::vector<Sample> read(const char *path) {
  std::vector<Sample> out;
  std::ifstream in(path);
  Sample s{};
  while (in >> s.t >> s.force[0] >> s.force[1] >> s.force[2] >> s.place[0] >> s.place[1] >> s.place[2])
    out.push_back(s);
  return out;
}

}  // namespace

int main(int argc, char **argv) {
  std::vector<std::string> set;
  std::string name = "scene", integrator = "explicit", model = "scene";
  const char *series = nullptr, *against = nullptr, *csv_file = nullptr, *histogram = nullptr,
             *times = nullptr, *commit = "unknown";
  double duration = 0, step = 0;
  bool paced = false;
  for (int i = 2; i + 1 < argc; i += 2) {
    const std::string key = argv[i], value = argv[i + 1];
    if (key == "--model") set.push_back("/bodies/0/model/type=\"" + (model = value) + '"');
    if (key == "--integrator") set.push_back("/time/integrator=\"" + (integrator = value) + '"');
    if (key == "--cells") set.push_back("/bodies/0/mesh/cells=" + value);
    if (key == "--set") set.push_back(value);
    if (key == "--paced") paced = value == "yes";
    if (key == "--time") duration = std::atof(argv[i + 1]);
    if (key == "--step") step = std::atof(argv[i + 1]);
    if (key == "--series") series = argv[i + 1];
    if (key == "--against") against = argv[i + 1];
    if (key == "--wander") set.push_back(lanes(duration = std::atof(argv[i + 1])));
    if (key == "--histogram") histogram = argv[i + 1];
    if (key == "--times") times = argv[i + 1];
    if (key == "--csv") csv_file = argv[i + 1];
    if (key == "--commit") commit = argv[i + 1];
  }
  if (argc < 2) return 2;
  std::vector<const char *> texts;
  for (const std::string &s : set) texts.push_back(s.c_str());
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  def.threads = 1;
  dfm_context *context = nullptr;
  ok(dfm_context_create(&def, &context));
  dfm_scene_options options{};
  options.size = sizeof options;
  options.nset = uint32_t(texts.size());
  options.set = texts.data();
  dfm_scene scene = 0;
  dfm_world world = 0;
  const double start = bench::cpu_seconds();
  ok(dfm_scene_open(context, argv[1], &options, &scene));
  ok(dfm_scene_world(scene, &world));
  const double made = bench::cpu_seconds() - start;
  dfm_scene_settings settings{};
  settings.size = sizeof settings;
  ok(dfm_scene_get_settings(scene, &settings));
  if (!(step > 0)) step = settings.step;
  if (!(duration > 0)) duration = settings.duration;
  dfm_body body = 0;
  uint32_t bodies = 0;
  ok(dfm_world_bodies(world, 1, &body, &bodies));
  dfm_body_info info{};
  info.size = sizeof info;
  ok(dfm_body_get_info(body, &info));

  Run found = run(scene, world, duration, step, series || against, paced);
  const std::map<std::string, double> stages = profile(world);
  if (series) {
    std::FILE *out = std::fopen(series, "w");
    for (const Sample &s : found.series)
      std::fprintf(out, "%.6f %.9g %.9g %.9g %.9g %.9g %.9g\n", s.t, s.force[0], s.force[1], s.force[2],
                   s.place[0], s.place[1], s.place[2]);
    std::fclose(out);
  }
  if (times) {
    std::FILE *out = std::fopen(times, "w");
    std::fprintf(out, "# ms, units, cut");
    for (const auto &[stage, sum] : stages) std::fprintf(out, ", %s", stage.c_str());
    std::fprintf(out, "\n");
    for (size_t n = 0; n < found.seconds.size(); ++n) {
      std::fprintf(out, "%.4f %llu %u", 1e3 * found.seconds[n], (unsigned long long)found.work[n],
                   unsigned(found.cut[n]));
      for (const auto &[stage, sum] : stages) std::fprintf(out, " %.4f", 1e3 * found.stages[n][stage]);
      std::fprintf(out, "\n");
    }
    std::fclose(out);
  }
  double error[2] = {NAN, NAN};
  if (against) compare(found.series, read(against), error);
  std::vector<double> sorted = found.seconds;
  std::sort(sorted.begin(), sorted.end());
  const double median = 1e3 * sorted[sorted.size() / 2], worst = 1e3 * sorted[sorted.size() * 999 / 1000];
  const auto late = sorted.end() - std::upper_bound(sorted.begin(), sorted.end(), step);
  std::printf(
      "%s %s %g ms: %u points, %.1f contacts, made in %.1f s; ms per step: median %.3f, "
      "99.9 %% %.3f, most %.3f, %td of %zu above the step; ",
      model.c_str(), integrator.c_str(), 1e3 * step, info.npoint, found.contacts, made, median, worst,
      1e3 * sorted.back(), late, sorted.size());
  if (against) std::printf("error of force %.3g, of tip %.3g\n", error[0], error[1]);
  else std::printf("errors: give a finer run's series with --against\n");
  std::vector<size_t> slow(found.seconds.size());
  for (size_t n = 0; n < slow.size(); ++n) slow[n] = n;
  const size_t most = std::min<size_t>(10, slow.size());
  std::partial_sort(slow.begin(), slow.begin() + std::ptrdiff_t(most), slow.end(),
                    [&](size_t a, size_t b) { return found.seconds[a] > found.seconds[b]; });
  std::printf("    slowest:");
  for (size_t n = 0; n < most; ++n) std::printf(" %.2f (%zu)", 1e3 * found.seconds[slow[n]], slow[n] + 1);
  std::printf(" ms (step)\n");
  print_max_work(found, step);
  std::sort(found.work.begin(), found.work.end());
  std::printf(
      "    units of work: median %llu, 99.9 %% %llu, most %llu; at most %u passes, %u sweeps, "
      "unconverged sub-steps %llu\n",
      (unsigned long long)found.work[found.work.size() / 2],
      (unsigned long long)found.work[found.work.size() * 999 / 1000], (unsigned long long)found.work.back(),
      found.last.passes_max, found.last.sweeps_max, (unsigned long long)found.last.unconverged);
  std::printf(
      "    steps simplified %llu, shortened %llu; guard: solves %llu, cuts %llu, motion lost %.3g ms; "
      "largest gain of energy %.3g J, most energy %.3g J\n",
      (unsigned long long)found.last.cheapened, (unsigned long long)found.last.shortened,
      (unsigned long long)found.last.guard_solves, (unsigned long long)found.last.guard_cuts,
      1e3 * found.last.guard_lost, found.last.energy_gain, found.last.energy_max);
  if (std::any_of(found.cut.begin(), found.cut.end(), [](uint8_t k) { return k != 0; })) {
    print_kind(found, 0, "without a cut", step);
    print_kind(found, 2, "after a cut", step);
    print_kind(found, 1, "that cut", step);
  }
  for (const auto &[stage, sum] : stages)
    std::printf("    %-18s %8.4f ms\n", stage.c_str(), 1e3 * sum / double(found.seconds.size()));
  if (histogram) {
    char row[200];
    std::snprintf(row, sizeof row, "%s,%s,%s,%s,%u,%.1f", bench::machine().c_str(), bench::compiler(), commit,
                  model.c_str(), info.npoint, found.contacts);
    write_histogram(histogram, sorted, row);
  }
  if (csv_file) {
    std::FILE *csv = std::fopen(csv_file, "a");
    if (std::ftell(csv) == 0)
      std::fprintf(csv,
                   "machine,compiler,commit,model,integrator,step_ms,points,contacts,made_s,median_ms,"
                   "p999_ms,force_error,tip_error\n");
    std::fprintf(csv, "%s,%s,%s,%s,%s,%g,%u,%.1f,%.1f,%.3f,%.3f,%.3g,%.3g\n", bench::machine().c_str(),
                 bench::compiler(), commit, model.c_str(), integrator.c_str(), 1e3 * step, info.npoint,
                 found.contacts, made, median, worst, error[0], error[1]);
    std::fclose(csv);
  }
  ok(dfm_scene_close(scene));
  dfm_context_destroy(context);
  return 0;
}
