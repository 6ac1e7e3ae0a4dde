// deform-ccd, started by `deform ccd QUERIES.csv`: times of impact of the queries in a file.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "arguments.h"
#include "become.h"
#include "file.h"
#include "json_text.h"
#include "messages.h"

namespace cli {
namespace {

// at their DFM_TOI_* values
const std::vector<std::string> kRoots = {"bisection", "regula_falsi", "brent", "conservative"};

constexpr uint64_t kMaxBytes = uint64_t(1) << 30;  // some two million queries of 17 digits

struct CcdOptions {
  std::string file, csv, root = "conservative";
  double tolerance = 0, separation = 0;
};

struct CcdQuery {
  std::string id;
  bool edges = false, labeled = false, hit = false;
  double latest = 0;  // labeled hits: the exact time or the next number above it
  dfm_motion motion[4];
};

class QueryFile {
 public:
  explicit QueryFile(const std::string &path) : path_(path) {
    const std::string text = read_file(path, kMaxBytes, "a table of queries (CSV)");
    for (size_t at = 0; at < text.size();) {
      const size_t end = std::min(text.find('\n', at), text.size());
      ++line_;
      const std::vector<std::string> cells = csv_cells(text.substr(at, end - at));
      at = end + 1;
      if (cells.size() == 1 && cells[0].empty()) continue;
      if (names_.empty()) header(cells);
      else row(cells);
    }
    if (names_.empty())
      throw Failure(kBadInput, path + " is empty; expected a line of column names and one line per query");
  }
  const std::vector<CcdQuery> &queries() const { return queries_; }

 private:
  [[noreturn]] void refuse(const std::string &what) const {
    throw Failure(kBadInput, path_ + ":" + std::to_string(line_) + ": " + what);
  }

  static std::string coordinate_name(int p, int end, int axis) {
    return "p" + std::to_string(p) + "_t" + std::to_string(end) + "_" + "xyz"[axis];
  }

  void header(const std::vector<std::string> &cells) {
    names_ = cells;
    id_ = column("id", true);
    kind_ = column("kind", true);
    hit_ = column("hit", false);
    toi_ = column("toi", false);
    latest_ = column("toi_hi", false);
    for (int p = 0; p < 4; ++p)
      for (int end = 0; end < 2; ++end)
        for (int axis = 0; axis < 3; ++axis)
          coordinate_[p][end][axis] = column(coordinate_name(p, end, axis), true);
  }

  int column(const std::string &name, bool needed) const {
    const auto found = std::ranges::find(names_, name);
    if (found != names_.end()) return int(found - names_.begin());
    if (!needed) return -1;
    std::vector<std::string> strange = names_;  // a right name is not a misspelt one
    for (int p = 0; p < 4; ++p)
      for (int end = 0; end < 2; ++end)
        for (int axis = 0; axis < 3; ++axis) std::erase(strange, coordinate_name(p, end, axis));
    const std::string near = nearest(name, strange);
    refuse("there is no column \"" + name + "\"" + (near.empty() ? "" : " (but \"" + near + "\")") +
           "; expected id, kind and p0_t0_x to p3_t1_z (the path of vertex 0 to 3 at t = 0 and 1)");
  }

  double number_at(const std::vector<std::string> &cells, int at) const {
    const std::string &cell = cells[size_t(at)];
    char *end = nullptr;
    const double x = std::strtod(cell.c_str(), &end);
    if (end == cell.c_str() || *end || !std::isfinite(x))
      refuse(names_[size_t(at)] + " is \"" + cell +
             "\", expected a finite number (decimal or C99 hexadecimal)");
    return x;
  }

  void row(const std::vector<std::string> &cells) {
    if (cells.size() != names_.size())
      refuse(std::to_string(cells.size()) + " cells, expected " + std::to_string(names_.size()) +
             " as the first line has");
    CcdQuery q;
    q.id = cells[size_t(id_)];
    const std::string &kind = cells[size_t(kind_)];
    if (kind != "vf" && kind != "ee")
      refuse("kind is \"" + kind + "\", expected \"vf\" (vertex, triangle) or \"ee\" (edge, edge)");
    q.edges = kind == "ee";
    for (int p = 0; p < 4; ++p)
      for (int axis = 0; axis < 3; ++axis) {
        q.motion[p].p0[axis] = number_at(cells, coordinate_[p][0][axis]);
        q.motion[p].p1[axis] = number_at(cells, coordinate_[p][1][axis]);
      }
    if (hit_ >= 0 && !cells[size_t(hit_)].empty()) {
      const double hit = number_at(cells, hit_);
      if (hit != 0 && hit != 1) refuse("hit is \"" + cells[size_t(hit_)] + "\", expected 0 or 1");
      q.labeled = true;
      q.hit = hit == 1;
      if (q.hit && latest_ >= 0) q.latest = number_at(cells, latest_);
      else if (q.hit && toi_ >= 0) q.latest = std::nextafter(number_at(cells, toi_), 2.0);
      else q.latest = 1;
    }
    queries_.push_back(q);
  }

  std::string path_;
  size_t line_ = 0;
  std::vector<std::string> names_;
  int id_ = 0, kind_ = 0, hit_ = -1, toi_ = -1, latest_ = -1, coordinate_[4][2][3];
  std::vector<CcdQuery> queries_;
};

struct Tally {
  size_t edges = 0, hits = 0, labeled = 0, missed = 0, false_hits = 0, late = 0;
  double latest = 0;  // largest t - exact time
  uint64_t evaluations = 0;
  uint32_t most = 0;
  double seconds = 0;
};

Tally run_queries(const CcdOptions &options, const std::vector<CcdQuery> &queries, std::string &rows) {
  const auto method = std::ranges::find(kRoots, options.root) - kRoots.begin();
  const dfm_toi_options toi = {sizeof toi, int32_t(method), options.tolerance, options.separation, 0};
  Tally tally;
  std::vector<double> times(queries.size());
  std::vector<uint32_t> evaluations(queries.size());
  const std::clock_t begin = std::clock();  // processor time: others share the machine
  for (size_t k = 0; k < queries.size(); ++k) {
    const dfm_motion *const m = queries[k].motion;
    need(queries[k].edges ? dfm_toi_edge_edge(m, m + 2, &toi, &times[k], nullptr)
                          : dfm_toi_point_triangle(m, m + 1, &toi, &times[k], nullptr));
    evaluations[k] = dfm_toi_evaluations();
  }
  tally.seconds = double(std::clock() - begin) / CLOCKS_PER_SEC;
  for (size_t k = 0; k < queries.size(); ++k) {
    const CcdQuery &q = queries[k];
    const double t = times[k];
    const bool hit = t <= 1;
    tally.edges += q.edges;
    tally.hits += hit;
    tally.evaluations += evaluations[k];
    tally.most = std::max(tally.most, evaluations[k]);
    if (q.labeled) {
      ++tally.labeled;
      tally.missed += q.hit && !hit;
      tally.false_hits += !q.hit && hit;
      if (q.hit && hit && t > q.latest) {
        ++tally.late;
        tally.latest = std::max(tally.latest, t - q.latest);
      }
    }
    char row[64];
    std::snprintf(row, sizeof row, ",%d,%.17g,%u\n", hit, t, evaluations[k]);
    rows += q.id + row;
  }
  return tally;
}

void print(const CcdOptions &options, const Globals &globals, size_t n, const Tally &t) {
  const double per = n ? 1.0 / double(n) : 0, mean = per * double(t.evaluations), ns = per * 1e9 * t.seconds;
  if (globals.json) {
    JsonObject out, work;
    work.add("mean", mean, "max", t.most);
    out.add("file", quoted(options.file), "root", quoted(options.root), "queries", n, "edge_edge", t.edges,
            "hits", t.hits, "evaluations", work.text(), "ns_per_query", ns);
    if (t.labeled) {
      JsonObject labels;
      labels.add("queries", t.labeled, "missed", t.missed, "false", t.false_hits);
      out.add("labels", labels.add("late", t.late, "late_by_max", t.latest).text());
    }
    std::fputs(indented(out.text()).c_str(), stdout);
  } else if (!globals.quiet) {
    std::printf("%s\n", shown(options.file).c_str());
    std::printf("  finder       %s\n  queries      %zu (%zu point-triangle, %zu edge-edge)\n",
                options.root.c_str(), n, n - t.edges, t.edges);
    std::printf(
        "  touch        %zu\n  evaluations  %.2f per query, at most %u\n  time         %.0f ns per query\n",
        t.hits, mean, t.most, ns);
    if (t.labeled)
      std::printf("  labels       %zu: missed %zu, false alarms %zu, late %zu (by at most %.2g)\n", t.labeled,
                  t.missed, t.false_hits, t.late, t.latest);
  }
}

int ccd(const CcdOptions &options, const Globals &globals) {
  if (std::ranges::find(kRoots, options.root) == kRoots.end())
    throw Failure(kBadInput, "--root is \"" + options.root +
                                 "\", expected bisection, regula_falsi, brent or conservative" +
                                 did_you_mean(options.root, kRoots));
  if (!options.csv.empty()) refuse_same("--csv", options.csv, options.file);
  const QueryFile file(options.file);
  std::string rows = "id,hit,t,evaluations\n";
  const Tally tally = run_queries(options, file.queries(), rows);
  if (!options.csv.empty()) write_whole(options.csv, rows);
  print(options, globals, file.queries().size(), tally);
  return kDone;
}

void add_ccd(Command app, Globals &globals, int *exit_code) {
  const auto options = std::make_shared<CcdOptions>();
  Command sub = app.command(kCcd.name, kCcd.about);
  sub.option("QUERIES", options->file,
             "CSV with the columns id, kind (vf or ee), p0_t0_x to p3_t1_z; hit and toi_hi are compared with")
      .required();
  sub.option("--root", options->root, "bisection, regula_falsi, brent or conservative")
      .with_default()
      .type_name("FINDER");
  sub.option("--csv", options->csv, "answers: id,hit,t,evaluations (t inf for a miss)").type_name("OUT");
  sub.option("--tolerance", options->tolerance,
             "conservative: a distance, as a share of the extent; else a width of t; 0: 1e-12");
  sub.option("--separation", options->separation, "touching is a distance of at most that, m");
  sub.calls([=, &globals] { *exit_code = ccd(*options, globals); });
}

}  // namespace
}  // namespace cli

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::add_ccd); }
