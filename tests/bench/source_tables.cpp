// The measurements of Zerbato 2010 taken again, on meshes of the sizes printed there, all made here:
// detection, update and friction times over a run (figures 4.7, 4.8), triangles left overlapping by three
// finders (4.9), and what anisotropy adds (tables 6.1, 6.2). Times are processor time of one thread, or for
// the stages of a step the median over a window of steps.
// --csv FILE --commit ID appends rows; --overlaps FILE writes the triangles of 4.9 for its picture; --only
// run, overlaps or anisotropy.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ccd/toi_finders.h"
#include "crossing.h"
#include "deform/deform.h"
#include "geometry/box_tree.h"
#include "machine.h"

namespace {

using Points = std::vector<double>;

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + long(values.size() / 2), values.end());
  return values[values.size() / 2];
}

[[noreturn]] void die(const std::string &what) {
  std::fprintf(stderr, "source_tables: %s: %s\n", what.c_str(), dfm_last_error());
  std::exit(2);
}

struct Rows {
  const bench::Csv &sink;
  void add(const char *figure, const std::string &series, double at, double value, const char *unit) const {
    std::printf("%-10s %-34s %10.4g %12.5g %s\n", figure, series.c_str(), at, value, unit);
    if (sink.csv)
      std::fprintf(sink.csv, "%s,%s,%s,%.5g,%.5g,%s\n", sink.head.c_str(), figure, series.c_str(), at, value,
                   unit);
  }
};

// A scene with changed values, and its world.
struct Opened {
  dfm_scene scene = 0;
  dfm_world world = 0;
  Opened(dfm_context *context, const std::string &path, const std::vector<std::string> &set) {
    std::vector<const char *> text;
    for (const auto &s : set) text.push_back(s.c_str());
    dfm_scene_options options{};
    options.size = sizeof options;
    options.nset = uint32_t(text.size());
    options.set = text.data();
    if (dfm_scene_open(context, path.c_str(), &options, &scene) != DFM_OK ||
        dfm_scene_world(scene, &world) != DFM_OK)
      die(path);
  }
  ~Opened() { dfm_scene_close(scene); }
  Opened(const Opened &) = delete;
  Opened &operator=(const Opened &) = delete;
  std::map<std::string, double> stages() const {
    dfm_stage_time t[32];
    uint32_t n = 0;
    if (dfm_world_profile(world, 32, t, &n) != DFM_OK) die("profile");
    std::map<std::string, double> out;
    for (uint32_t i = 0; i < n; ++i) out[t[i].name] = t[i].seconds;
    return out;
  }
  uint32_t contacts() const {
    dfm_world_stats s{};
    s.size = sizeof s;
    if (dfm_world_get_stats(world, &s) != DFM_OK) die("stats");
    return s.contacts;
  }
};

struct Skin {
  Points x;  // [n,3]
  std::vector<uint32_t> tri;
  explicit Skin(dfm_body body) {
    uint32_t n = 0, ntri = 0;
    if (dfm_surface_positions(body, 0, nullptr, &n) != DFM_OK ||
        dfm_surface_triangles(body, 0, nullptr, &ntri) != DFM_OK)
      die("surface");
    x.resize(3 * size_t(n));
    tri.resize(3 * size_t(ntri));
    if (dfm_surface_positions(body, n, x.data(), &n) != DFM_OK ||
        dfm_surface_triangles(body, ntri, tri.data(), &ntri) != DFM_OK)
      die("surface");
  }
};

// ---- 4.7, 4.8: times over the run -------------------------------------------------------------------------

void trees(const Rows &rows, const std::string &name, double t, const std::vector<dfm_body> &bodies) {
  double build = 0, refit = 0;
  for (const dfm_body body : bodies) {
    const Skin skin(body);
    std::vector<double> x(skin.x.size() / 3 * 4, 0.0);
    for (size_t i = 0; i < skin.x.size(); ++i) x[i / 3 * 4 + i % 3] = skin.x[i];
    double least[2] = {HUGE_VAL, HUGE_VAL};
    dfm::BoxTree tree(dfm::Memory::standard());
    for (int repetition = 0; repetition < 5; ++repetition) {
      const double t0 = bench::cpu_seconds();
      tree.build(skin.tri, x.data());
      const double t1 = bench::cpu_seconds();
      tree.refit(skin.tri, x.data());
      least[0] = std::min(least[0], t1 - t0);
      least[1] = std::min(least[1], bench::cpu_seconds() - t1);
    }
    build += least[0];
    refit += least[1];
  }
  rows.add("4.7", name + ": tree built", t, 1e3 * build, "ms");
  rows.add("4.7", name + ": tree renewed", t, 1e3 * refit, "ms");
}

void run(dfm_context *context, const Rows &rows, const std::string &name, const std::string &file, int cells,
         const std::vector<std::string> &more) {
  std::vector<std::string> set = more;
  if (cells > 0)
    for (const char *body : {"0", "1"})
      set.push_back(std::string("/bodies/") + body +
                    "/mesh={\"make\":\"cylinder\",\"radius\":0.02,\"length\":" + "0.16,\"cells\":" +
                    std::to_string(cells) + "}");
  const Opened s(context, std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/" + file, set);
  dfm_scene_settings settings{};
  settings.size = sizeof settings;
  if (dfm_scene_get_settings(s.scene, &settings) != DFM_OK) die(name);
  std::vector<dfm_body> bodies(2);
  uint32_t n = 0;
  if (dfm_world_bodies(s.world, 2, bodies.data(), &n) != DFM_OK) die(name);
  const double h = settings.step;
  const int window = 200, steps = int(settings.duration / h + 0.5);
  const std::vector<std::pair<std::string, std::vector<std::string>>> groups{
      {"detection", {"broad", "narrow"}},
      {"guard", {"guard"}},
      {"model", {"model", "predict"}},
      {"contact and friction", {"contact+friction", "distribute"}}};
  std::vector<std::vector<double>> spent(groups.size());
  auto before = s.stages();
  for (int i = 1; i <= steps; ++i) {
    if (dfm_world_step(s.world, h, nullptr) != DFM_OK) die(name);
    const auto after = s.stages();
    for (size_t g = 0; g < groups.size(); ++g) {
      double sum = 0;
      for (const auto &stage : groups[g].second)
        if (after.count(stage)) sum += after.at(stage) - before.at(stage);
      spent[g].push_back(sum);
    }
    before = after;
    if (i % window) continue;
    for (size_t g = 0; g < groups.size(); ++g) {
      rows.add("4.8", name + ": " + groups[g].first, i * h, 1e3 * median(spent[g]), "ms");
      spent[g].clear();
    }
    rows.add("4.8", name + ": contacts", i * h, s.contacts(), "contacts");
    if (i % (2 * window) == 0) trees(rows, name, i * h, bodies);
  }
}

// ---- 4.9: triangles that three finders leave overlapping --------------------------------------------------

struct V { double x, y, z; };
V minus(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
V cross(V a, V b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// A body's surface over one step.
struct Moving {
  Points from, to;
  std::vector<uint32_t> tri;
  V at(uint32_t i, double t) const {
    const double *a = &from[3 * size_t(i)], *b = &to[3 * size_t(i)];
    return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
  }
  dfm_motion motion(uint32_t i) const {
    dfm_motion m;
    std::copy_n(&from[3 * size_t(i)], 3, m.p0);
    std::copy_n(&to[3 * size_t(i)], 3, m.p1);
    return m;
  }
  Points rolled_back(const std::vector<double> &time) const {
    Points out(from.size());
    for (size_t i = 0; i < out.size(); ++i) out[i] = from[i] + time[i / 3] * (to[i] - from[i]);
    return out;
  }
};

struct Bounds {
  double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void add(const double *p) {
    for (int k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], p[k]);
      hi[k] = std::max(hi[k], p[k]);
    }
  }
  bool meets(const Bounds &b) const {
    for (int k = 0; k < 3; ++k)
      if (lo[k] > b.hi[k] || b.lo[k] > hi[k]) return false;
    return true;
  }
};

Bounds swept(const Moving &m, const uint32_t *corner, int n) {
  Bounds b;
  for (int k = 0; k < n; ++k) {
    b.add(&m.from[3 * size_t(corner[k])]);
    b.add(&m.to[3 * size_t(corner[k])]);
  }
  return b;
}

using Finder = std::function<double(const std::function<double(double)> &, dfm::toi::Bracket)>;

// 4.2 as printed, with the distance to the plane in (4.7): vertices of one body against triangles of the
// other, one bracket, the inside test at its root; every vertex of a touch keeps the share of its motion up
// to its own earliest time.
void source_times(const Moving &points, const Moving &faces, const Finder &finder,
                  std::vector<double> &of_points, std::vector<double> &of_faces) {
  std::vector<Bounds> boxes;
  for (size_t f = 0; f < faces.tri.size(); f += 3) boxes.push_back(swept(faces, &faces.tri[f], 3));
  for (uint32_t p = 0; p < of_points.size(); ++p) {
    const Bounds mine = swept(points, &p, 1);
    for (size_t f = 0; f < boxes.size(); ++f) {
      if (!mine.meets(boxes[f])) continue;
      const uint32_t *c = &faces.tri[3 * f];
      const auto frame = [&](double t, V &r, V &e1, V &e2) {
        const V a = faces.at(c[0], t);
        r = minus(points.at(p, t), a);
        e1 = minus(faces.at(c[1], t), a);
        e2 = minus(faces.at(c[2], t), a);
      };
      const auto distance = [&](double t) {
        V r, e1, e2;
        frame(t, r, e1, e2);
        const V n = cross(e1, e2);
        return dot(r, n) / std::sqrt(dot(n, n));
      };
      const dfm::toi::Bracket b = {0, 1, distance(0), distance(1)};
      if (!(b.f_lo * b.f_hi <= 0)) continue;
      const double t = finder(distance, b);
      V r, e1, e2;
      frame(t, r, e1, e2);
      const V n = cross(e1, e2);
      const double u = dot(cross(r, e2), n) / dot(n, n), v = dot(cross(e1, r), n) / dot(n, n);
      if (u < 0 || v < 0 || u + v > 1) continue;
      of_points[p] = std::min(of_points[p], t);
      for (int k = 0; k < 3; ++k) of_faces[c[k]] = std::min(of_faces[c[k]], t);
    }
  }
}

// Points against triangles and edges against edges with the library's conservative query: one time for all.
double first_touch(const Moving &a, const Moving &b) {
  double first = 1;
  const auto pick = [&](const dfm_motion *m, bool edges) {
    double t = 0;
    if ((edges ? dfm_toi_edge_edge(m, m + 2, nullptr, &t, nullptr)
               : dfm_toi_point_triangle(m, m + 1, nullptr, &t, nullptr)) != DFM_OK)
      die("time of impact");
    first = std::min(first, t);
  };
  const auto points = [&](const Moving &p, const Moving &f) {
    for (uint32_t i = 0; i < p.from.size() / 3; ++i) {
      const Bounds mine = swept(p, &i, 1);
      for (size_t k = 0; k < f.tri.size(); k += 3) {
        if (!mine.meets(swept(f, &f.tri[k], 3))) continue;
        const dfm_motion m[4] = {p.motion(i), f.motion(f.tri[k]), f.motion(f.tri[k + 1]),
                                 f.motion(f.tri[k + 2])};
        pick(m, false);
      }
    }
  };
  points(a, b);
  points(b, a);
  const auto edges = [](const Moving &m) {
    std::vector<uint32_t> out;
    for (size_t k = 0; k < m.tri.size(); ++k) {
      const uint32_t i = m.tri[k], j = m.tri[k % 3 == 2 ? k - 2 : k + 1];
      if (i < j) out.insert(out.end(), {i, j});
    }
    return out;
  };
  const auto ea = edges(a), eb = edges(b);
  std::vector<Bounds> boxes;
  for (size_t k = 0; k < eb.size(); k += 2) boxes.push_back(swept(b, &eb[k], 2));
  for (size_t i = 0; i < ea.size(); i += 2) {
    const Bounds mine = swept(a, &ea[i], 2);
    for (size_t k = 0; k < boxes.size(); ++k) {
      if (!mine.meets(boxes[k])) continue;
      const dfm_motion m[4] = {a.motion(ea[i]), a.motion(ea[i + 1]), b.motion(eb[2 * k]),
                               b.motion(eb[2 * k + 1])};
      pick(m, true);
    }
  }
  return first;
}

// Which triangles of both pass through one of the other's.
std::vector<std::vector<bool>> overlapping(const Moving &a, const Points &xa, const Moving &b,
                                           const Points &xb) {
  std::vector<std::vector<bool>> hit{std::vector<bool>(a.tri.size() / 3),
                                     std::vector<bool>(b.tri.size() / 3)};
  std::vector<Bounds> boxes(b.tri.size() / 3);
  for (size_t k = 0; k < b.tri.size(); ++k) boxes[k / 3].add(&xb[3 * size_t(b.tri[k])]);
  for (size_t i = 0; i < hit[0].size(); ++i) {
    Bounds mine;
    const double *ta[3], *tb[3];
    for (size_t c = 0; c < 3; ++c) mine.add(ta[c] = &xa[3 * size_t(a.tri[3 * i + c])]);
    for (size_t k = 0; k < boxes.size(); ++k) {
      if (!mine.meets(boxes[k])) continue;
      for (size_t c = 0; c < 3; ++c) tb[c] = &xb[3 * size_t(b.tri[3 * k + c])];
      if (crossing::pass_through(ta, tb)) hit[0][i] = hit[1][k] = true;
    }
  }
  return hit;
}

void overlaps(dfm_context *context, const Rows &rows, std::FILE *triangles) {
  const Opened s(context, std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/two_cylinders_fine.json", {});
  std::vector<dfm_body> bodies(2);
  uint32_t n = 0;
  if (dfm_world_bodies(s.world, 2, bodies.data(), &n) != DFM_OK) die("bodies");
  std::vector<Moving> pair;
  for (const dfm_body body : bodies) {
    const Skin skin(body);
    pair.push_back({skin.x, skin.x, skin.tri});
  }
  // One step: the upper cylinder, 3 mm above the lower one, goes down by 20 mm and turns by 10 degrees
  // about its middle.
  double middle[3] = {};
  const size_t count = pair[1].from.size() / 3;
  for (size_t i = 0; i < 3 * count; ++i) middle[i % 3] += pair[1].from[i] / double(count);
  const double turn = M_PI / 18;
  for (size_t i = 0; i < count; ++i) {
    double *p = &pair[1].to[3 * i];
    const double x = p[0] - middle[0], y = p[1] - middle[1];
    p[0] = middle[0] + std::cos(turn) * x - std::sin(turn) * y;
    p[1] = middle[1] + std::sin(turn) * x + std::cos(turn) * y;
    p[2] -= 0.02;
  }
  // as many values of the distance as the best of them needs for a root to 1e-12
  const int most = 8;
  uint32_t unused = 0;
  const auto plain = [](const std::function<double(double)> &f, dfm::toi::Bracket b) {
    double x = b.lo;
    for (int i = 0; i < most; ++i) {
      x = (b.lo * b.f_hi - b.hi * b.f_lo) / (b.f_hi - b.f_lo);
      const double value = f(x);
      const bool low = (value > 0) == (b.f_lo > 0);
      (low ? b.lo : b.hi) = x;
      (low ? b.f_lo : b.f_hi) = value;
      if (value == 0) break;
    }
    return x;
  };
  const std::vector<std::pair<std::string, Finder>> finders{
      {"bisection", [&](const auto &f, auto b) { return dfm::toi::bisection(f, b, 1e-12, most, unused); }},
      {"regula falsi", plain},
      {"Brent", [&](const auto &f, auto b) { return dfm::toi::brent(f, b, 1e-12, most, unused); }}};
  const auto report = [&](const std::string &name, const std::vector<std::vector<double>> &time) {
    const Points x[2] = {pair[0].rolled_back(time[0]), pair[1].rolled_back(time[1])};
    const auto hit = overlapping(pair[0], x[0], pair[1], x[1]);
    size_t all = 0;
    for (size_t b = 0; b < 2; ++b) all += size_t(std::count(hit[b].begin(), hit[b].end(), true));
    rows.add("4.9", name, 0, double(all), "triangles");
    for (size_t b = 0; b < 2 && triangles; ++b)
      for (size_t k = 0; k < hit[b].size(); ++k) {
        std::fprintf(triangles, "%s,%zu,%d", name.c_str(), b, int(hit[b][k]));
        for (size_t c = 0; c < 3; ++c)
          for (size_t axis = 0; axis < 3; ++axis)
            std::fprintf(triangles, ",%.5g", x[b][3 * size_t(pair[b].tri[3 * k + c]) + axis]);
        std::fprintf(triangles, "\n");
      }
  };
  const auto all_at = [&](double t) {
    std::vector<std::vector<double>> time;
    for (const Moving &m : pair) time.emplace_back(m.from.size() / 3, t);
    return time;
  };
  if (triangles) std::fprintf(triangles, "finder,body,overlaps,x0,y0,z0,x1,y1,z1,x2,y2,z2\n");
  report("no rollback", all_at(1));
  for (const auto &[name, finder] : finders) {
    auto time = all_at(1);
    source_times(pair[0], pair[1], finder, time[0], time[1]);
    source_times(pair[1], pair[0], finder, time[1], time[0]);
    report(name, time);
  }
  report("one time for the island", all_at(first_touch(pair[0], pair[1])));
}

// ---- tables 6.1, 6.2: what anisotropy adds ----------------------------------------------------------------

void anisotropy(dfm_context *context, const Rows &rows) {
  for (const int cells : {561, 15092, 16383}) {
    const std::string mesh =
        "{\"make\":\"cylinder\",\"radius\":0.02,\"length\":0.16,\"cells\":" + std::to_string(cells) + "}";
    const std::vector<std::string> plain{"/bodies/0/mesh=" + mesh};
    const auto open = [&](const char *kind) {
      std::vector<std::string> set = plain;
      if (kind)
        set.push_back(
            std::string("/bodies/0/anisotropy={\"axis\":[0,0,1],\"params\":{\"slope\":1,\"kind\":\"") + kind +
            "\"}}");
      return std::make_unique<Opened>(
          context, std::string(DEFORM_SOURCE_DIR) + "/tests/bench/source_tables.json", set);
    };
    const std::unique_ptr<Opened> worlds[3] = {open(nullptr), open("softer"), open("stiffer")};
    dfm_body body = 0;
    uint32_t n = 0;
    if (dfm_world_bodies(worlds[0]->world, 1, &body, &n) != DFM_OK) die("bodies");
    const std::string size = std::to_string(cells) + " cells";
    dfm_body_info info{};
    info.size = sizeof info;
    if (dfm_body_get_info(body, &info) != DFM_OK) die("body");
    rows.add("6.1", size, info.npoint, info.ntet, "tetrahedra");
    // in turn, so that a busy machine hits all three; the least of many short spells counts
    double least[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
    for (int spell = 0; spell < 60; ++spell)
      for (int k = 0; k < 3; ++k) {
        const int steps = cells < 1000 ? 200 : 10;
        const double start = bench::cpu_seconds();
        for (int i = 0; i < steps; ++i)
          if (dfm_world_step(worlds[k]->world, 1e-5, nullptr) != DFM_OK) die("step");
        least[k] = std::min(least[k], (bench::cpu_seconds() - start) / steps);
      }
    static const char *const kNames[3] = {"isotropic", "softer along an axis", "stiffer along an axis"};
    for (int k = 0; k < 3; ++k) rows.add("6.2", size + ": " + kNames[k], cells, 1e3 * least[k], "ms");
  }
}

}  // namespace

int main(int argc, char **argv) {
  const bench::Csv sink(argc, argv, "figure,series,at,value,unit");
  std::string only;
  std::FILE *triangles = nullptr;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (!std::strcmp(argv[i], "--only")) only = argv[i + 1];
    if (!std::strcmp(argv[i], "--overlaps")) triangles = std::fopen(argv[i + 1], "w");
  }
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = DEFORM_PLUGIN_DIR;
  dfm_context *context = nullptr;
  if (dfm_context_create(&def, &context) != DFM_OK) die("context");
  const Rows rows{sink};
  if (only.empty() || only == "overlaps") overlaps(context, rows, triangles);
  if (only.empty() || only == "anisotropy") anisotropy(context, rows);
  if (only.empty() || only == "run") {
    run(context, rows, "coarse", "two_cylinders_fine.json", 2729, {});
    run(context, rows, "fine", "two_cylinders_fine.json", 15092, {});
  }
  dfm_context_destroy(context);
  if (triangles) std::fclose(triangles);
  return 0;
}
