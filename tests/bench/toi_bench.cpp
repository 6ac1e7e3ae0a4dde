// The finders of the time of impact against each other and against the scheme of Zerbato 2010 (4.2):
// evaluations, time, what they miss, what they find late.
// 1. Queries: ours through the C API on the exact reference queries and random ones; beside them the scheme
//    of Zerbato 2010, 4.2: one bracket [0,1], a change of sign of the distance, an inside test at the root.
//    --published FOLDER adds the samples of Tight Inclusion (optional: they are not in the repository).
// 2. Roots: values of the function per root to 1e-12, for (4.7) as printed, for the distance to the plane and
//    for the cubic.
// 3. Guard: the whole list of feature pairs of two fine spheres that roll on each other and of two that
//    crash, per listed pair.
// --csv FILE --commit ID appends the figures. Of the repetitions the least time counts: others
// share the machine.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <numeric>

#include "../unit/ccd/guard_scene.h"
#include "../unit/ccd/toi_support.h"
#include "../unit/narrow/detect_scene.h"
#include "ccd/toi_finders.h"
#include "machine.h"

namespace {

using namespace test;

constexpr int kRepetitions = 15;

using Sink = bench::Csv;

// The published queries, in a folder with a table of their exact answers. Numerators and denominators are
// exact as doubles, and so is their quotient.
std::vector<ToiQuery> published_queries(const std::string &folder) {
  std::vector<ToiQuery> out;
  std::string open;
  std::vector<std::vector<std::string>> rows;
  const auto number = [](const std::string &s) { return std::strtod(s.c_str(), nullptr); };
  for (const std::vector<std::string> &label : read_csv(folder + "/exact_labels.csv")) {
    if (label[0] == "file") continue;
    if (label[0] != open) {
      open = label[0];
      rows = read_csv(folder + "/" + open);
    }
    ToiQuery q;
    q.id = label[0] + ":" + label[1];
    q.edges = label[2] == "ee";
    q.hit = label[4] == "1";
    q.multiplicity = 1;
    q.toi = q.hit ? number(label[5]) : 0;
    q.latest = std::nextafter(q.toi, 2.0);
    const size_t first = 8 * size_t(std::atoi(label[1].c_str()));
    for (size_t r = 0; r < 8; ++r)
      for (size_t i = 0; i < 3; ++i)
        (r < 4 ? q.m[r].p0 : q.m[r - 4].p1)[i] =
            number(rows[first + r][2 * i]) / number(rows[first + r][2 * i + 1]);
    for (int k = 1; k < 4; ++k)
      for (int i = 0; i < 3; ++i) q.extent = std::max(q.extent, std::fabs(q.m[k].p0[i] - q.m[0].p0[i]));
    out.push_back(q);
  }
  return out;
}

// ---- the functions of Zerbato 2010 ------------------------------------------------------------------------

struct D3 { double x, y, z; };
D3 minus(D3 a, D3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double times(D3 a, D3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
D3 product(D3 a, D3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double size(D3 a) { return std::sqrt(times(a, a)); }
D3 place(const dfm_motion &m, double t) {
  const auto one = [&](int i) { return (1 - t) * m.p0[i] + t * m.p1[i]; };
  return {one(0), one(1), one(2)};
}

struct Frame { D3 r, e1, e2; };
Frame frame(const ToiQuery &q, double t) {
  const D3 a = place(q.m[0], t), b = place(q.m[1], t), c = place(q.m[2], t), d = place(q.m[3], t);
  return q.edges ? Frame{minus(a, c), minus(b, a), minus(d, c)}
                 : Frame{minus(a, b), minus(c, b), minus(d, b)};
}
double cubic(const ToiQuery &q, double t) {
  const Frame f = frame(q, t);
  return times(f.r, product(f.e1, f.e2));
}
double plane_distance(const ToiQuery &q, double t) {
  const Frame f = frame(q, t);
  const D3 n = product(f.e1, f.e2);
  return times(f.r, n) / size(n);
}
// (4.7) as printed: the sign of the side times the distance to the vertex.
double printed(const ToiQuery &q, double t) {
  const Frame f = frame(q, t);
  const double side = times(f.r, product(f.e1, f.e2));
  return side > 0 ? size(f.r) : side < 0 ? -size(f.r) : 0;
}

// (4.9) as printed, for the table of roots.
template <class F>
double plain_regula_falsi(const F &f, dfm::toi::Bracket b, double width, int most, uint32_t &evaluations) {
  double x = b.lo, last = b.hi;
  for (int i = 0; i < most && std::fabs(x - last) > width; ++i) {
    last = x;
    x = (b.lo * b.f_hi - b.hi * b.f_lo) / (b.f_hi - b.f_lo);
    const double value = f(x);
    ++evaluations;
    if (value == 0) return x;
    if ((value > 0) == (b.f_lo > 0)) {
      b.lo = x;
      b.f_lo = value;
    } else {
      b.hi = x;
      b.f_hi = value;
    }
  }
  return x;
}

// Zerbato 2010, 4.2: a change of sign over the step, one root, is it inside.
double source_scheme(const ToiQuery &q, uint32_t &evaluations) {
  const auto f = [&](double t) { return plane_distance(q, t); };
  const dfm::toi::Bracket b = {0, 1, f(0), f(1)};
  evaluations += 2;
  if (!(b.f_lo * b.f_hi <= 0)) return kNever;
  const double t = dfm::toi::bisection(f, b, 1e-12, 100, evaluations);
  const Frame at = frame(q, t);
  const D3 n = product(at.e1, at.e2);
  const double area2 = times(n, n), sign = q.edges ? -1 : 1;
  const double u = times(product(at.r, at.e2), n) / area2 * sign, v = times(product(at.e1, at.r), n) / area2;
  const bool inside = u >= 0 && v >= 0 && (q.edges ? u <= 1 && v <= 1 : u + v <= 1);
  return inside ? t : kNever;
}

// ---- queries ----------------------------------------------------------------------------------------------

struct Figures {
  size_t hits = 0, missed = 0, false_alarms = 0, late = 0;
  double late_by = 0, evaluations = 0, ns = HUGE_VAL;
  uint32_t most = 0;
};

template <class Ask>  // double ask(query, evaluations &)
Figures measure(const std::vector<ToiQuery> &queries, bool labeled, const Ask &query_one) {
  Figures f;
  for (const ToiQuery &q : queries) {
    uint32_t evaluations = 0;
    const double t = query_one(q, evaluations);
    const bool hit = t <= 1;
    f.hits += hit;
    f.evaluations += evaluations;
    f.most = std::max(f.most, evaluations);
    if (!labeled) continue;
    f.missed += q.hit && !hit;
    f.false_alarms += !q.hit && hit;
    if (q.hit && hit && t > q.latest) {
      ++f.late;
      f.late_by = std::max(f.late_by, t - q.latest);
    }
  }
  f.evaluations /= double(queries.size());
  for (int repetition = 0; repetition < kRepetitions; ++repetition) {
    uint32_t unused = 0;
    double sum = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (const ToiQuery &q : queries) sum += std::min(query_one(q, unused), 2.0);
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    if (sum >= 0) f.ns = std::min(f.ns, 1e9 * spent.count() / double(queries.size()));
  }
  return f;
}

void row(const Sink &sink, const char *set, const char *finder, size_t n, bool labeled, const Figures &f) {
  std::printf("%-10s %-14s %6zu %6zu %9.2f %6u %6.0f", set, finder, n, f.hits, f.evaluations, f.most, f.ns);
  if (labeled) std::printf(" %7zu %6zu %5zu %9.1e", f.missed, f.false_alarms, f.late, f.late_by);
  std::printf("\n");
  if (!sink.csv) return;
  std::fprintf(sink.csv, "%s,%s,%s,%zu,%zu,%.2f,%u,%.0f", sink.head.c_str(), set, finder, n, f.hits,
               f.evaluations, f.most, f.ns);
  if (labeled) std::fprintf(sink.csv, ",%zu,%zu,%zu,%.2g\n", f.missed, f.false_alarms, f.late, f.late_by);
  else std::fprintf(sink.csv, ",,,,\n");
}

void queries(const Sink &sink, const char *set, const std::vector<ToiQuery> &all, bool labeled) {
  if (all.empty()) return;
  row(sink, set, "source", all.size(), labeled, measure(all, labeled, source_scheme));
  for (int method = 0; method < 4; ++method) {
    const dfm_toi_options options = {sizeof options, method, 0, 0, 0};
    const auto ours = [&](const ToiQuery &q, uint32_t &evaluations) {
      double t = 0, at[3];
      if (q.edges) dfm_toi_edge_edge(q.m, q.m + 2, &options, &t, at);
      else dfm_toi_point_triangle(q.m, q.m + 1, &options, &t, at);
      evaluations = dfm_toi_evaluations();
      return t;
    };
    row(sink, set, kFinderNames[method], all.size(), labeled, measure(all, labeled, ours));
  }
}

std::vector<ToiQuery> random_queries() {
  std::vector<ToiQuery> out(20000);
  Random random(1);
  for (size_t n = 0; n < out.size(); ++n) {
    out[n].edges = n & 1;
    for (dfm_motion &m : out[n].m)
      for (int i = 0; i < 3; ++i) {
        m.p0[i] = random.real(-1, 1);
        m.p1[i] = m.p0[i] + random.real(-0.5, 0.5);
      }
  }
  return out;
}

// ---- values of the function per root ----------------------------------------------------------------------

void roots(const Sink &sink) {
  Random random(2);
  std::vector<ToiQuery> crossing;  // one change of sign from 0 to 1
  while (crossing.size() < 300) {
    ToiQuery q;
    for (dfm_motion &m : q.m)
      for (int i = 0; i < 3; ++i) {
        m.p0[i] = random.real(-1, 1);
        m.p1[i] = m.p0[i] + random.real(-0.5, 0.5);
      }
    int changes = 0;
    for (int k = 0; k < 64; ++k) changes += (cubic(q, k / 64.0) > 0) != (cubic(q, (k + 1) / 64.0) > 0);
    if (changes == 1) crossing.push_back(q);
  }
  std::printf("\n%-24s %10s %22s %22s %8s\n", "values per root to 1e-12", "bisection", "regula falsi (4.9)",
              "regula falsi, Illinois", "Brent");
  using Function = double (*)(const ToiQuery &, double);
  const std::pair<const char *, Function> functions[] = {
      {"(4.7) as printed", printed}, {"distance to the plane", plane_distance}, {"cubic", cubic}};
  for (const auto &[name, function] : functions) {
    double mean[4] = {};
    for (const ToiQuery &q : crossing) {
      const auto f = [&, g = function](double t) { return g(q, t); };
      const dfm::toi::Bracket b = {0, 1, f(0), f(1)};
      uint32_t n[4] = {2, 2, 2, 2};
      dfm::toi::bisection(f, b, 1e-12, 200, n[0]);
      plain_regula_falsi(f, b, 1e-12, 200, n[1]);
      dfm::toi::regula_falsi(f, b, 1e-12, 200, n[2]);
      dfm::toi::brent(f, b, 1e-12, 200, n[3]);
      for (int k = 0; k < 4; ++k) mean[k] += n[k] / double(crossing.size());
    }
    std::printf("%-24s %10.1f %22.1f %22.1f %8.1f\n", name, mean[0], mean[1], mean[2], mean[3]);
    static const char *const kColumns[4] = {"bisection", "regula_falsi_plain", "regula_falsi", "brent"};
    for (int k = 0; k < 4 && sink.csv; ++k)
      std::fprintf(sink.csv, "%s,roots: %s,%s,%zu,%zu,%.2f,,,,,,\n", sink.head.c_str(), name, kColumns[k],
                   crossing.size(), crossing.size(), mean[k]);
  }
}

// ---- guard ------------------------------------------------------------------------------------------------

void guard(const Sink &sink) {
  std::printf("\n%-24s %10s %8s %14s\n", "guard", "pairs", "hits", "ns per pair");
  for (const bool crash : {false, true}) {
    Scene scene;
    const Mesh ball = sphere_mesh(0.1, 4);
    scene.offset = 1e-3 * 0.012;
    scene.h = 1e-3;
    const double fall = crash ? -5 : 0, slide = crash ? 0 : 0.5;
    const dfm::Vec3 velocity{slide, 0, fall};
    scene.add(ball);
    scene.add(moved(ball, {}, dfm::Vec3{0, 0, 0.2 + scene.offset}), velocity);
    dfm::BroadPhase broad(dfm::Memory::standard());
    broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
    std::vector<std::vector<double>> end(2);
    for (size_t b = 0; b < 2; ++b) {
      const dfm::Surface &surface = *scene.surfaces[b];
      for (size_t i = 0; i < surface.x.size(); ++i) end[b].push_back(surface.x[i] + scene.h * surface.v[i]);
    }
    const double floor = scene.offset / 2;
    dfm::GuardScene requested = test::guard_scene(scene.bodies, end, floor, 0.1 * floor);
    dfm::Array<dfm::GuardHit> hits;
    const size_t pairs = broad.candidates().size();
    std::vector<uint32_t> which(pairs);
    std::iota(which.begin(), which.end(), 0u);
    double best = HUGE_VAL;
    for (int repetition = 0; repetition < kRepetitions; ++repetition) {
      const auto begin = std::chrono::steady_clock::now();
      dfm::guard_pairs(requested, broad.candidates(), which, hits);
      const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
      best = std::min(best, 1e9 * spent.count() / double(pairs));
    }
    const char *const name = crash ? "guard: crash at 5 m/s" : "guard: sliding at rest";
    std::printf("%-24s %10zu %8zu %14.1f\n", name + 7, pairs, hits.size(), best);
    if (sink.csv)
      std::fprintf(sink.csv, "%s,%s,guard,%zu,%zu,,,%.1f,,,,\n", sink.head.c_str(), name, pairs, hits.size(),
                   best);
  }
}

}  // namespace

int main(int argc, char **argv) {
  Sink sink(argc, argv,
            "set,finder,queries,hits,evaluations,evaluations_max,ns_per_query,missed,false,late,late_by_max");
  std::printf("%-10s %-14s %6s %6s %9s %6s %6s %7s %6s %5s %9s\n", "set", "finder", "number", "hits",
              "values", "most", "ns", "missed", "false", "late", "by");
  queries(sink, "reference", reference_queries(), true);
  for (int n = 1; n + 1 < argc; ++n)
    if (!std::strcmp(argv[n], "--published"))
      queries(sink, "published", published_queries(argv[n + 1]), true);
  queries(sink, "random", random_queries(), false);
  roots(sink);
  guard(sink);
  return 0;
}
