// Time of the mass-spring forces per spring and per cell, through the plugin ABI, beside plain kernels
// (bound/msm_bound.h) for the layouts of the points, each for every instruction set. `--csv FILE --commit ID`
// appends the figures; --mesh FILE takes another mesh than the fine cylinder; --only options leaves out the
// plain kernels, --only single all but the forces of damped springs and cells in both precisions. The least
// of the repetitions counts: others share the machine. Options of the model are timed against the same body
// without them, in turn: the median of eleven pairs counts.
#include <benchmark/benchmark.h>
#include <sys/utsname.h>

#include <fstream>

#include "bound/msm_bound.h"
#include "machine.h"
#include "model_msm/msm_body.h"
#include "msm_host.h"

namespace {

using namespace msm_test;

Mesh &mesh() {
  static Mesh m;
  return m;
}
const Params kDamped = {1e5, 0.3, 0.002, 0, 0}, kPlain = {1e5, 0.3, 0, 0, 0},
             kVolume = {1e5, 0.3, 0.002, 0, 1};
double springs() { return double(mesh().edges.size() / 2); }

enum What { kForces, kSingleForces, kRowSums };
void through_abi(benchmark::State &state, const char *isa, const Params &p, What what) {
  setenv("DEFORM_SIMD", isa, 1);
  Host host;
  Instance b(host, mesh(), p);
  unsetenv("DEFORM_SIMD");
  if (!host.logged.empty()) return state.SkipWithError("not on this processor");
  b.shake(1e-3, 0.1);
  std::vector<double> k(b.size()), c(b.size());
  const dfm_kin kin = b.kin();
  double h = 1;
  const auto *single = static_cast<const dfm_f32 *>(b.ops->extension(b.self, DFM_EXT_F32));
  if (what == kSingleForces && single->prepare(b.self) != DFM_OK)
    return state.SkipWithError("no single precision");
  for (auto _ : state) {
    if (what == kRowSums) b.ops->bound(b.self, &kin, k.data(), c.data(), &h);
    else if (what == kSingleForces) single->add_forces(b.self, &kin, b.f);
    else b.ops->add_forces(b.self, &kin, b.f);
  }
}

// Flat arrays for the plain kernels, points in the plugin's order so that both see the same locality.
struct Flat {
  std::vector<uint32_t> order, i, j, begin, neighbor;
  std::vector<double> storage;
  double *stiffness, *rest, *row_stiffness, *row_rest, *x[3], *v[3], *f;  // x, v: padded, packed, split
  uint32_t npoint;
  bound::Springs s{};

  Flat() {
    const Mesh &m = mesh();
    npoint = (m.npoint() + 3) / 4 * 4;
    order.resize(m.npoint());
    begin.resize(model::partition_capacity(m.npoint()));
    model::partition_points(m.rest.data(), m.npoint(), order.data(), begin.data());
    std::vector<uint32_t> rank(m.npoint());
    for (uint32_t r = 0; r < m.npoint(); ++r) rank[order[r]] = r;
    std::vector<std::vector<uint32_t>> of(npoint);
    std::vector<std::pair<uint32_t, uint32_t>> pairs;
    for (size_t e = 0; e < m.edges.size(); e += 2) {
      const auto [a, b] = std::minmax(rank[m.edges[e]], rank[m.edges[e + 1]]);
      pairs.push_back({a, b});
      of[a].push_back(b);
      of[b].push_back(a);
    }
    std::sort(pairs.begin(), pairs.end());
    while (pairs.size() % 8) pairs.push_back(pairs.back());
    begin.assign(1, 0);
    for (uint32_t n = 0; n < npoint; n += 4) {
      size_t width = 0;
      for (uint32_t k = 0; k < 4; ++k) {
        std::sort(of[n + k].begin(), of[n + k].end());
        width = std::max(width, of[n + k].size());
      }
      begin.push_back(uint32_t(begin.back() + width));
    }
    const size_t ns = pairs.size(), nr = 4 * size_t(begin.back());
    storage.assign(2 * ns + 2 * nr + 28 * size_t(npoint) + 200, 0);
    double *at = storage.data();
    const auto take = [&](size_t n) {
      while (reinterpret_cast<uintptr_t>(at) % 64) ++at;
      return std::exchange(at, at + n);
    };
    stiffness = take(ns);
    rest = take(ns);
    row_stiffness = take(nr);
    row_rest = take(nr);
    for (int k = 0; k < 3; ++k) {
      x[k] = take(4 * npoint);
      v[k] = take(4 * npoint);
    }
    f = take(4 * npoint);
    const auto where = [&](uint32_t r) { return r < m.npoint() ? m.at(order[r]) : Vec{}; };
    for (size_t n = 0; n < ns; ++n) {
      const auto [a, b] = pairs[n];
      i.push_back(a);
      j.push_back(b);
      rest[n] = norm(where(b) - where(a));
      stiffness[n] = n < size_t(springs()) ? 10 : 0;
    }
    neighbor.assign(nr, 0);
    for (uint32_t n = 0; n < npoint; ++n)
      for (size_t k = 0; k < begin[n / 4 + 1] - begin[n / 4]; ++k) {
        const size_t to = 4 * (begin[n / 4] + k) + n % 4;
        const bool real = k < of[n].size();
        neighbor[to] = real ? of[n][k] : of[n].empty() ? n : of[n][0];
        row_stiffness[to] = real ? 10 : 0;
        row_rest[to] = real ? norm(where(neighbor[to]) - where(n)) : 0;
      }
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(-1, 1);
    for (uint32_t n = 0; n < npoint; ++n)
      for (uint32_t a = 0; a < 3; ++a) {
        const double px = where(n)[a] + 1e-3 * u(random), pv = 0.1 * u(random);
        x[0][4 * n + a] = x[1][3 * n + a] = x[2][a * npoint + n] = px;
        v[0][4 * n + a] = v[1][3 * n + a] = v[2][a * npoint + n] = pv;
      }
    s = {npoint, uint32_t(ns), i.data(),        j.data(),      stiffness, rest, npoint / 4,
         0,      begin.data(), neighbor.data(), row_stiffness, row_rest,  0.002};
  }
};

using Kernel = void (*)(const bound::Springs &, const bound::Points &);

void plain(benchmark::State &state, Kernel kernel, int layout) {
  Flat flat;
  const bound::Points p = {flat.x[layout], flat.v[layout], flat.f};
  for (auto _ : state) {
    std::fill(flat.f, flat.f + 4 * size_t(flat.npoint), 0.0);  // as a force kernel must
    kernel(flat.s, p);
    benchmark::ClobberMemory();
  }
}

// What an option costs: median over eleven pairs of (time with it) / (time without), and its time per spring.
struct Pair { double ratio, ns; };
Pair cost_of(const char *isa, const Params &without, const Params &with, const Fields &fields,
             bool row_sums) {
  setenv("DEFORM_SIMD", isa, 1);
  Host host;
  Instance plain(host, mesh(), without), option(host, mesh(), with, 4, fields);
  unsetenv("DEFORM_SIMD");
  if (!host.logged.empty()) return {0, 0};
  plain.shake(1e-3, 0.1);
  option.shake(1e-3, 0.1);
  std::vector<double> k(plain.size()), c(plain.size());
  const auto time = [&](Instance &b) {
    dfm_kin kin = b.kin();
    kin.state_out = b.state_out.data();
    double h = 1;
    double least = 1e300;
    for (int run = 0; run < 6; ++run) {
      const double start = 1e9 * bench::cpu_seconds();
      for (int n = 0; n < 20; ++n) {
        if (row_sums) b.ops->bound(b.self, &kin, k.data(), c.data(), &h);
        else b.ops->add_forces(b.self, &kin, b.f);
      }
      least = std::min(least, (1e9 * bench::cpu_seconds() - start) / 20);
    }
    return least;
  };
  time(plain);
  time(option);
  std::vector<double> ratio, ns;
  for (int n = 0; n < 11; ++n) {
    const bool first = n % 2;
    const double a = first ? time(option) : time(plain), b = first ? time(plain) : time(option);
    ratio.push_back(first ? a / b : b / a);
    ns.push_back(first ? a : b);
  }
  std::nth_element(ratio.begin(), ratio.begin() + 5, ratio.end());
  std::nth_element(ns.begin(), ns.begin() + 5, ns.end());
  return {ratio[5], ns[5] / springs()};
}

void print_options(std::ofstream &out, const std::string &head) {
  const auto make = [](double damp, double slope, bool form_a, int damper) {
    Params p = {1e5, 0.3, damp, 0, 0};
    p.slope = slope;
    p.axis = {1, 2, 3};
    p.form_a = form_a;
    p.damper = damper;
    return p;
  };
  const std::vector<double> uneven(mesh().ncell(), 0.002);
  const struct {
    const char *name;
    Params without, with;
    Fields fields;
    bool rows;
  } options[] = {{"anisotropic_B", make(0, 0, false, 0), make(0, 2, false, 0), {}, false},
                 {"anisotropic_B_damped", make(0.002, 0, false, 0), make(0.002, 2, false, 0), {}, false},
                 {"anisotropic_A", make(0, 0, false, 0), make(0, 2, true, 0), {}, false},
                 {"anisotropic_A_damped", make(0.002, 0, false, 0), make(0.002, 2, true, 0), {}, false},
                 {"anisotropic_B_bound", make(0, 0, false, 0), make(0, 2, false, 0), {}, true},
                 {"damping_by_cell",
                  make(0.002, 0, false, 0),
                  make(0.002, 0, false, 0),
                  {{"damping_stiffness", uneven}},
                  false},
                 {"maxwell", make(0.002, 0, false, 0), make(0, 0, false, 1), {}, false},
                 {"sls", make(0.002, 0, false, 0), make(0, 0, false, 2), {}, false},
                 {"the_same", make(0.002, 0, false, 0), make(0.002, 0, false, 0), {}, false}};
  std::printf(
      "\noptions, time with over time without, median of eleven pairs (the_same: what the machine's noise "
      "leaves)\n");
  for (const char *isa : {"sse2", "avx2", "avx512"})
    for (const auto &o : options) {
      const Pair p = cost_of(isa, o.without, o.with, o.fields, o.rows);
      if (p.ratio == 0) continue;
      std::printf("  %-7s %-28s %7.3f  %7.2f ns per spring\n", isa, o.name, p.ratio, p.ns);
      if (!out.is_open()) continue;
      out << head << isa << ",option_" << o.name << "_ratio," << p.ratio << ",\n"
          << head << isa << ",option_" << o.name << "," << p.ns << ",\n";
    }
}

// Collects the least time of each benchmark.
struct Reporter : benchmark::ConsoleReporter {
  std::vector<std::pair<std::string, double>> least;
  void ReportRuns(const std::vector<Run> &runs) override {
    for (const Run &run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      const std::string name = run.run_name.function_name;
      const double ns = run.GetAdjustedCPUTime();
      if (least.empty() || least.back().first != name) least.push_back({name, ns});
      least.back().second = std::min(least.back().second, ns);
    }
  }
  double of(const std::string &name) const {
    for (const auto &[key, ns] : least)
      if (key == name) return ns;
    return 0;
  }
};

#ifdef __clang__
const char *const kCompiler = "clang " __clang_version__;
#else
const char *const kCompiler = "gcc " __VERSION__;
#endif

std::string processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

void print(const Reporter &r, const std::string &csv, const std::string &commit, const std::string &mesh_name,
           bool options) {
  const double ns = springs(), nc = mesh().ncell();
  std::ofstream out;
  if (!csv.empty()) {
    const bool fresh = !std::ifstream(csv).good();
    out.open(csv, std::ios::app);
    if (fresh)
      out << "machine,compiler,commit,mesh,points,springs,cells,isa,kernel,ns_per_spring,ns_per_cell\n";
  }
  std::printf("\n%s: %u points, %.0f springs, %.0f cells; least of the repetitions\n", mesh_name.c_str(),
              mesh().npoint(), ns, nc);
  const auto row = [&](const char *isa, const char *kernel, double per_spring, double per_cell) {
    std::printf("  %-7s %-28s", isa, kernel);
    if (per_spring > 0) std::printf(" %7.2f ns per spring", per_spring);
    if (per_cell > 0) std::printf(" %7.2f ns per cell", per_cell);
    std::printf("\n");
    if (!out.is_open()) return;
    out << processor() << "," << kCompiler << "," << commit << "," << mesh_name << "," << mesh().npoint()
        << "," << ns << "," << nc << "," << isa << "," << kernel << ",";
    if (per_spring > 0) out << per_spring;
    out << ",";
    if (per_cell > 0) out << per_cell;
    out << "\n";
  };
  for (const char *isa : {"sse2", "avx2", "avx512"}) {
    const std::string at = std::string("/") + isa;
    if (r.of("plugin_single" + at) > 0) {
      row(isa, "plugin_forces", 0, r.of("plugin_volume" + at) / nc);
      row(isa, "plugin_forces_single", 0, r.of("plugin_single" + at) / nc);
    }
    if (r.of("plugin_damped" + at) == 0) continue;
    double best = 1e300;
    for (const char *kernel :
         {"scatter_padded", "scatter_packed", "scatter_split", "rows_padded", "rows_split"}) {
      const double t = r.of(kernel + at) / ns;
      row(isa, kernel, t, 0);
      best = std::min(best, t);
    }
    const double damped = r.of("plugin_damped" + at);
    row(isa, "plugin_undamped", r.of("plugin_undamped" + at) / ns, 0);
    row(isa, "plugin_damped", damped / ns, 0);
    row(isa, "plugin_volume", 0, (r.of("plugin_volume" + at) - damped) / nc);
    row(isa, "plugin_bound_of_step", 0, r.of("plugin_bound" + at) / nc);
    std::printf("  %-7s speed against the best plain kernel: %.0f %%\n", isa, 100 * best / (damped / ns));
  }
  std::ostringstream head;
  head << processor() << "," << kCompiler << "," << commit << "," << mesh_name << "," << mesh().npoint()
       << "," << ns << "," << nc << ",";
  if (options) print_options(out, head.str());
}

}  // namespace

int main(int argc, char **argv) {
  std::string csv;
  std::string commit = "unknown";
  std::string path = test::mesh_dir() + "/thesis/cyl_fine.msh";
  std::string name = "cyl_fine.msh";
  std::string only;
  for (int n = 1; n + 1 < argc; n += 2) {
    const std::string key = argv[n];
    if (key == "--csv") csv = argv[n + 1];
    if (key == "--commit") commit = argv[n + 1];
    if (key == "--only") only = argv[n + 1];
    if (key == "--mesh") {
      path = argv[n + 1];
      name = path.substr(path.rfind('/') + 1);
    }
  }
  mesh() = read_msh(path);

  const bound::Kernels *tables[] = {bound::kernels_sse2(), bound::kernels_avx2(), bound::kernels_avx512()};
  const bool able[] = {true, bool(__builtin_cpu_supports("avx2")),
                       bool(__builtin_cpu_supports("avx512dq")) && bool(__builtin_cpu_supports("avx512vl"))};
  const char *isas[] = {"sse2", "avx2", "avx512"};
  for (int k = 0; k < 3; ++k) {
    if (!able[k]) continue;
    const bound::Kernels &t = *tables[k];
    const std::string at = std::string("/") + isas[k];
    const auto add = [&](const std::string &what, auto &&...args) {
      benchmark::RegisterBenchmark((what + at).c_str(), std::forward<decltype(args)>(args)...)
          ->Repetitions(15)
          ->MinTime(0.02);
    };
    add("plugin_volume", through_abi, isas[k], kVolume, kForces);
    add("plugin_single", through_abi, isas[k], kVolume, kSingleForces);
    if (only == "single") continue;
    add("scatter_padded", plain, t.scatter_padded, 0);
    add("scatter_packed", plain, t.scatter_packed, 1);
    add("scatter_split", plain, t.scatter_split, 2);
    add("rows_padded", plain, t.rows_padded, 0);
    add("rows_split", plain, t.rows_split, 2);
    add("plugin_undamped", through_abi, isas[k], kPlain, kForces);
    add("plugin_damped", through_abi, isas[k], kDamped, kForces);
    add("plugin_bound", through_abi, isas[k], kVolume, kRowSums);
  }
  int none = 1;
  benchmark::Initialize(&none, argv);
  Reporter reporter;
  if (only != "options") benchmark::RunSpecifiedBenchmarks(&reporter);
  print(reporter, csv, commit, name, only != "single");
}
