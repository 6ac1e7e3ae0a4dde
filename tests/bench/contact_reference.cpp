// Every row of the tables in reference/contact that a soft body can be put to: the rigid limits
// against the tables' tolerances, the elastic cases with the model's own error.
// libdeform/doc/reference/contact_reference.md holds what it prints.
//
//   contact_reference [rigid|elastic|TABLE|BODY] [--write PAGE]      exit code 1: a rigid limit is missed
//
// TABLE: one of the elastic ones; BODY: "thin hoop" and so on, without writing.
#include "contact_reference.h"

#include "contact_reference_elastic.h"
#include "reference_table.h"
#include "support.h"

namespace {

namespace ref = test::reference;
using bench::percent;
using bench::text;

std::vector<std::vector<std::string>> table(const char *name) {
  auto rows = test::read_csv(test::reference_dir() + "/contact/tables/" + name + ".csv");
  rows.erase(rows.begin());
  return rows;
}

// The worst of each quantity over the rows of one table, and who missed its tolerance.
class Limits {
 public:
  // both in one unit
  struct Got {
    std::string quantity;
    double error, tolerance;
  };
  bench::Table table{{"table", "rows", "quantity", "worst error", "where", "tolerance"}, {}};
  bool met = true;

  // run(i) names a row and says how far off it is; empty: the row asks for nothing.
  void add(const std::string &name, size_t n, const char *unit,
           const std::function<std::pair<std::string, std::vector<Got>>(size_t)> &run) {
    std::vector<std::pair<std::string, std::vector<Got>>> all(n);
    bench::in_parallel(n, [&](size_t i) { all[i] = run(i); });
    struct Worst {
      Got got;
      std::string where;
      size_t rows;
    };
    std::vector<Worst> worst;
    for (const auto &[where, quantities] : all)
      for (const Got &g : quantities) {
        size_t k = 0;
        while (k < worst.size() && worst[k].got.quantity != g.quantity) ++k;
        if (k == worst.size()) worst.push_back({g, where, 0});
        ++worst[k].rows;
        if (!(std::fabs(g.error) <= std::fabs(worst[k].got.error))) {
          worst[k].got = g;
          worst[k].where = where;
        }
        if (std::fabs(g.error) <= g.tolerance) continue;
        met = false;
        std::fprintf(stderr, "%s, %s: %s %+.3g%s, tolerance %g\n", name.c_str(), where.c_str(),
                     g.quantity.c_str(), g.error, unit, g.tolerance);
      }
    for (const Worst &w : worst)
      table.rows.push_back({name, std::to_string(w.rows), w.got.quantity, text("%+.2g%s", w.got.error, unit),
                            w.where, text("%g%s", w.got.tolerance, unit)});
    std::fprintf(stderr, "%s done\n", name.c_str());
  }
};

void blocks(Limits &limits) {
  const auto incline = table("incline_block");
  limits.add("incline_block, slides", incline.size(), " %",
             [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
               const auto &r = incline[i];
               if (std::stod(r[2]) == 0 || std::fabs(std::stod(r[6]) - 1) < 0.01) return {};
               const ref::Incline got = ref::incline(std::stod(r[0]), std::stod(r[1]));
               return {r[0] + " degrees, mu " + r[1],
                       {{"acceleration", percent(got.acceleration, std::stod(r[3])), 2}}};
             });
  limits.add("incline_block, holds", incline.size(), " mm",
             [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
               const auto &r = incline[i];
               if (std::stod(r[2]) != 0 || std::fabs(std::stod(r[6]) - 1) < 0.01) return {};
               const ref::Incline got = ref::incline(std::stod(r[0]), std::stod(r[1]));
               return {r[0] + " degrees, mu " + r[1], {{"creep in 0.9 s", 1e3 * got.creep, 1}}};
             });
  for (const bool belt : {false, true}) {
    const char *const name = belt ? "conveyor" : "sliding_stop";
    const auto rows = table(name);
    limits.add(name, rows.size(), " %",
               [&, belt](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
                 const auto &r = rows[i];
                 const ref::Slide got = ref::slide(std::stod(r[0]), std::stod(r[1]), belt);
                 return {r[0] + " m/s, mu " + r[1],
                         {{"time", percent(got.time, std::stod(r[belt ? 2 : 3])), 2},
                          {"way", percent(got.distance, std::stod(r[belt ? 3 : 2])), 2}}};
               });
  }
  const auto toppling = table("incline_toppling");
  limits.add(
      "incline_toppling", toppling.size(), "",
      [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
        const auto &r = toppling[i];
        const double slope = std::tan(std::stod(r[0]) * ref::kDegree), ratio = std::stod(r[1]);
        // at mu = 1 it slides from 45 degrees on
        if (std::fabs(slope / ratio - 1) < 0.05 || slope > 0.95) return {};
        return {r[0] + " degrees, width/height " + r[1],
                {{"wrong verdicts", ref::topples(std::stod(r[0]), ratio) != (r[2] == "1") ? 1.0 : 0.0, 0}}};
      });
  const auto across = table("oblique_incline");
  limits.add(
      "oblique_incline", across.size(), " %",
      [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
        const auto v = [&](int k) { return std::stod(across[i][size_t(k)]); };
        const ref::Oblique got = ref::oblique(v(0), v(1), v(2), {v(3)})[0];
        const double path = std::hypot(v(4), v(5));
        return {text("%g degrees, mu %g, %g s", v(0), v(1), v(3)),
                {{"place / path", 100 * std::hypot(got.across - v(4), got.down - v(5)) / path, 1},
                 {"velocity / start", 100 * std::hypot(got.v_across - v(6), got.v_down - v(7)) / v(2), 1}}};
      });
  const auto slips = table("stick_slip");
  limits.add(
      "stick_slip", slips.size(), " %", [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
        const auto v = [&](int k) { return std::stod(slips[i][size_t(k)]); };
        const ref::StickSlip got =
            ref::stick_slip(v(0), v(1), v(2), v(3), v(4), 1e-4, 2.3 * v(11) + v(5) / v(4), 8e-4 * v(4));
        return {text("%g kg", v(0)),
                {{"period", percent(got.period, v(11)), 2},
                 {"swing", percent(got.x_max - got.x_min, v(6) - v(8)), 2}}};
      });
}

void rounds(Limits &limits, const std::string &only) {
  for (const ref::RoundShape &shape : ref::kRounds) {
    if (!only.empty() && only != shape.name) continue;
    std::vector<std::vector<std::string>> rolls, skids;
    for (const auto &r : table("rolling_incline"))
      if (r[0] == shape.name) rolls.push_back(r);
    for (const auto &r : table("skid_to_roll"))
      if (r[0] == shape.name) skids.push_back(r);
    limits.add(std::string("rolling_incline, ") + shape.name, rolls.size(), " %",
               [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
                 const auto &r = rolls[i];
                 const double a = std::stod(r[5]);
                 const ref::Roll got = ref::roll(shape, std::stod(r[1]), std::stod(r[2]));
                 return {r[1] + " degrees, mu " + r[2],
                         {{"a", percent(got.acceleration, a), 5},
                          {"R alpha / a", 100 * (got.turning - std::stod(r[6])) / a, 5}}};
               });
    limits.add(std::string("skid_to_roll, ") + shape.name, skids.size(), " %",
               [&](size_t i) -> std::pair<std::string, std::vector<Limits::Got>> {
                 const auto &r = skids[i];
                 const ref::Skid got = ref::skid(shape, std::stod(r[1]), std::stod(r[2]));
                 return {r[1] + " m/s, mu " + r[2],
                         {{"time", percent(got.time, std::stod(r[3])), 5},
                          {"speed", percent(got.speed, std::stod(r[4])), 5},
                          {"way", percent(got.distance, std::stod(r[5])), 5}}};
               });
  }
}

}  // namespace

bool bench::put(const std::string &page, const std::string &name, const std::string &what) {
  std::string all = test::read_file(page);
  const std::string begin = "<!-- " + name + " -->\n", end = "<!-- /" + name + " -->";
  const size_t from = all.find(begin), to = all.find(end);
  if (from == std::string::npos || to == std::string::npos) return false;
  all.replace(from + begin.size(), to - from - begin.size(), what);
  test::write_file(page, all);
  return true;
}

int main(int argc, char **argv) {
  std::string half, page;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--write" && i + 1 < argc) page = argv[++i];
    else half = argv[i];
  }
  const auto give = [&](const std::string &name, const std::string &what) {
    std::printf("%s\n", what.c_str());
    return page.empty() || bench::put(page, name, what);
  };
  bool good = true;
  if (std::any_of(std::begin(ref::kRounds), std::end(ref::kRounds),
                  [&](const auto &shape) { return half == shape.name; })) {
    Limits limits;
    rounds(limits, half);
    std::printf("%s\n", limits.table.markdown().c_str());
    return limits.met ? 0 : 1;
  }
  if (half.empty() || half == "rigid") {
    Limits limits;
    blocks(limits);
    rounds(limits, "");
    good = give("rigid", limits.table.markdown()) && limits.met;
  }
  if (half != "rigid")
    for (const auto &[name, what] : bench::elastic_tables())
      if (half.empty() || half == "elastic" || half == name) good = give(name, what()) && good;
  return good ? 0 : 1;
}
