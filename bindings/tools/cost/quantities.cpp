#include "quantities.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>

#include "file.h"

namespace fs = std::filesystem;

namespace cli::cost {
namespace {

constexpr double kNever = std::numeric_limits<double>::quiet_NaN();
constexpr double kSameTime = 1e-9;  // relative: sums of steps of different lengths

using Row = std::vector<std::string>;
struct Table {
  std::map<std::string, size_t> columns;
  std::vector<Row> rows;
  double number(const Row &row, const char *column) const {
    const auto found = columns.find(column);
    return found == columns.end() ? kNever : std::strtod(row[found->second].c_str(), nullptr);
  }
  const std::string &text(const Row &row, const char *column) const { return row[columns.at(column)]; }
};

Table read_table(const std::string &path) {
  Table out;
  std::error_code error;
  if (!fs::exists(path, error)) return out;
  const std::string text = read_file(path, uint64_t(1) << 30, "a table");
  for (size_t at = 0, end; (end = text.find('\n', at)) != std::string::npos; at = end + 1) {
    const Row row = csv_cells(text.substr(at, end - at));
    if (at == 0)
      for (size_t i = 0; i < row.size(); ++i) out.columns[row[i]] = i;
    else if (row.size() == out.columns.size()) out.rows.push_back(row);
  }
  return out;
}

Quantity &of(Quantities &all, const std::string &name, const char *family, const char *unit, unsigned width) {
  Quantity &q = all[name];
  q.family = family;
  q.unit = unit;
  q.width = width;
  return q;
}

// After the others: a probe may have the name of one of them, or the word for all figures of a kind.
void read_probes(const Table &probes, Quantities &out) {
  static const std::set<std::string> families = {"com",   "force", "work", "volume",  "energy",
                                                 "touch", "slip",  "rest", "liftoff", "probe"};
  for (const Row &row : probes.rows) {
    const std::string &name = probes.text(row, "probe");
    if (!std::isfinite(probes.number(row, "x"))) continue;  // a cut has taken its cell
    const auto same = out.find(name);
    const bool taken = families.count(name) || (same != out.end() && same->second.family != "probe");
    Quantity &q = of(out, taken ? "probe." + name : name, "probe", "m", 3);
    q.t.push_back(probes.number(row, "t"));
    for (const char *c : {"x", "y", "z"}) q.values.push_back(probes.number(row, c));
    for (const char *c : {"vx", "vy", "vz"}) q.rates.push_back(probes.number(row, c));
  }
}

void read_bodies(const Table &bodies, Quantities &out) {
  std::map<double, double> energy;
  for (const Row &row : bodies.rows) {
    const std::string &name = bodies.text(row, "body");
    const double t = bodies.number(row, "t");
    Quantity &com = of(out, "com." + name, "com", "m", 3);
    com.t.push_back(t);
    for (const char *c : {"com_x", "com_y", "com_z"}) com.values.push_back(bodies.number(row, c));
    for (const char *c : {"vel_x", "vel_y", "vel_z"}) com.rates.push_back(bodies.number(row, c));
    Quantity &volume = of(out, "volume." + name, "volume", "of the start", 1);
    volume.t.push_back(t);
    volume.values.push_back(bodies.number(row, "volume"));
    const double sum = bodies.number(row, "kinetic_J") + bodies.number(row, "elastic_J");
    energy.try_emplace(t, 0).first->second += sum;
  }
  for (const auto &[t, joules] : energy) {
    Quantity &all = of(out, "energy", "energy", "J", 1);
    all.t.push_back(t);
    all.values.push_back(joules);
  }
  for (auto &[name, q] : out)  // rigid bodies have none
    if (q.family == "volume" && q.values[0] > 0)
      for (size_t i = q.values.size(); i-- > 0;) q.values[i] /= q.values[0];
}

// The first record from which on the body's kinetic energy stays below a thousandth of its largest.
void add_rests(const Table &bodies, Quantities &out) {
  std::map<std::string, std::vector<std::pair<double, double>>> kinetic;
  for (const Row &row : bodies.rows)
    kinetic[bodies.text(row, "body")].emplace_back(bodies.number(row, "t"), bodies.number(row, "kinetic_J"));
  for (const auto &[name, rows] : kinetic) {
    double most = 0, at = kNever;
    for (const auto &[t, joules] : rows) most = std::max(most, joules);
    for (size_t i = rows.size(); i-- > 0 && rows[i].second <= 1e-3 * most;) at = rows[i].first;
    Quantity &q = of(out, "rest." + name, "rest", "s", 1);
    q.event = true;
    q.values = {at};
  }
}

void read_contacts(const Table &contacts, const std::vector<double> &times, Quantities &out) {
  std::map<std::string, std::map<double, const Row *>> pairs;
  for (const Row &row : contacts.rows)
    pairs[contacts.text(row, "body_a") + "/" + contacts.text(row, "body_b")][contacts.number(row, "t")] =
        &row;
  for (const auto &[pair, rows] : pairs) {
    double touch = kNever, slip = kNever, work = 0;
    bool stuck = false;
    for (const double t : times) {
      const auto found = rows.find(t);
      const Row *const row = found == rows.end() ? nullptr : found->second;
      Quantity &force = of(out, "force." + pair, "force", "N", 1);
      force.t.push_back(t);
      force.values.push_back(row ? contacts.number(*row, "normal_N") : 0);
      if (row) work = contacts.number(*row, "friction_work_J");
      Quantity &done = of(out, "work." + pair, "work", "J", 1);
      done.t.push_back(t);
      done.values.push_back(work);
      if (!row) continue;
      if (std::isnan(touch)) touch = t;
      const double sticking = contacts.number(*row, "sticking");
      if (stuck && sticking == 0 && std::isnan(slip)) slip = t;
      stuck |= 2 * sticking >= contacts.number(*row, "count");
    }
    double leave = kNever;
    if (!rows.empty() && rows.rbegin()->first < times.back()) leave = rows.rbegin()->first;
    const std::pair<const char *, double> events[] = {{"touch", touch}, {"slip", slip}, {"liftoff", leave}};
    for (const auto &[family, t] : events) {
      Quantity &q = of(out, std::string(family) + "." + pair, family, "s", 1);
      q.event = true;
      q.values = {t};
    }
  }
}

}  // namespace

Quantities read_quantities(const std::string &folder) {
  Quantities out;
  const Table bodies = read_table(folder + "/bodies.csv");
  read_bodies(bodies, out);
  add_rests(bodies, out);
  std::vector<double> times;
  for (const Row &row : bodies.rows)
    if (const double t = bodies.number(row, "t"); times.empty() || t > times.back()) times.push_back(t);
  if (!times.empty()) read_contacts(read_table(folder + "/contacts.csv"), times, out);
  read_probes(read_table(folder + "/probes.csv"), out);
  return out;
}

void value_at(const Quantity &q, double t, double *values, double *rates) {
  const size_t n = q.t.size();
  size_t i = size_t(std::ranges::upper_bound(q.t, t) - q.t.begin());
  i = std::clamp<size_t>(i, 1, n > 1 ? n - 1 : 1) - 1;
  for (unsigned k = 0; k < q.width; ++k) {
    const double a = q.values[i * q.width + k];
    values[k] = a;
    rates[k] = q.rates.empty() ? 0 : q.rates[i * q.width + k];
    if (n < 2) continue;
    const double b = q.values[(i + 1) * q.width + k];
    const double h = q.t[i + 1] - q.t[i], s = std::clamp((t - q.t[i]) / h, 0.0, 1.0);
    values[k] = a + s * (b - a);
    if (q.rates.empty()) continue;
    const double va = h * q.rates[i * q.width + k], vb = h * q.rates[(i + 1) * q.width + k];
    values[k] = a + s * s * (3 - 2 * s) * (b - a) + s * (1 - s) * ((1 - s) * va - s * vb);
    rates[k] = (va + s * (vb - va)) / h;
  }
}

double scale_of(const Quantity &reference, double least, double duration) {
  if (reference.event) return duration;
  double sum = 0, most = 0;
  const size_t n = reference.t.size(), w = reference.width;
  for (size_t i = 0; i < n; ++i)
    for (size_t k = 0; k < w; ++k) {
      const double d = reference.values[i * w + k] - reference.values[k];
      sum += d * d;
      most = std::max(most, std::fabs(reference.values[i * w + k]));
    }
  return reference.width == 3 ? std::max(std::sqrt(sum / double(n)), least) : most;
}

double error_of(const Quantity &q, const Quantity &reference, double scale) {
  if (q.event || reference.event) {
    const bool one = std::isfinite(q.values[0]), other = std::isfinite(reference.values[0]);
    if (one != other) return 1;
    return one ? std::fabs(q.values[0] - reference.values[0]) / scale : 0;
  }
  if (q.t.empty() || reference.t.empty() || !(scale > 0)) return kNever;
  // Weighted by time: records lie unevenly where steps are long. After the end of either there is nothing to
  // compare: a cut has taken what it is of.
  const double end = reference.t.back() + kSameTime * std::fabs(reference.t.back());
  double sum = 0, weight = 0, now[3], rates[3];
  for (size_t i = 0; i < q.t.size() && q.t[i] <= end; ++i) {
    const double before = i > 0 ? q.t[i - 1] : q.t[i], after = i + 1 < q.t.size() ? q.t[i + 1] : q.t[i];
    value_at(reference, q.t[i], now, rates);
    for (unsigned k = 0; k < q.width; ++k) {
      const double d = q.values[i * q.width + k] - now[k];
      sum += (after - before) / 2 * d * d;
    }
    weight += (after - before) / 2;
  }
  return weight > 0 ? std::sqrt(sum / weight) / scale : kNever;
}

std::vector<std::string> named(const Quantities &all, const std::string &word) {
  std::vector<std::string> out;
  for (const auto &[name, q] : all)
    if (name == word) return {name};
  for (const auto &[name, q] : all)
    if (q.family == word) out.push_back(name);
  return out;
}

}  // namespace cli::cost
