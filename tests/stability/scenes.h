// The shipped scenes as tests: each runs through the command, has a criterion, and a mutation of it that must
// fail the criterion.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "support.h"

namespace test {

#ifdef DEFORM_HAS_ODE
constexpr bool kHasOde = true;
#else
constexpr bool kHasOde = false;
#endif
// Is this rigid host built?
inline bool has_host(const std::string &host) {
#ifdef DEFORM_HAS_BULLET
  if (host == "bullet_float") return true;
#endif
#ifdef DEFORM_HAS_BULLET64
  if (host == "bullet_double") return true;
#endif
  return host == "builtin" || (host == "ode" && kHasOde);
}
constexpr const char *kFrictionless = R"(/contact/friction=[{"between": ["*", "*"], "law": "none"}])";

// One row of bodies.csv.
struct BodyRow { double t, com[3], velocity[3], spin_momentum[3], kinetic, volume; };

class SceneRun {
 public:
  SceneRun(const std::string &scene, std::vector<std::string> arguments, const std::string &command = "run") {
    static int counter = 0;
    out_ = scratch("scenes_" + std::to_string(getpid())) + "/" + scene + "_" + std::to_string(counter++);
    arguments.insert(arguments.begin(),
                     {command, std::string(DEFORM_SOURCE_DIR) + "/examples/scenes/" + scene + ".json",
                      "--quiet", "--out", out_});
    const CommandResult result = deform(arguments);
    EXPECT_EQ(result.exit_code, 0) << scene << ": " << result.err;
    summary_ = read_file(out_ + "/summary.json");
    bodies_ = read_csv(out_ + "/bodies.csv");
    probes_ = read_csv(out_ + "/probes.csv");
    contacts_ = read_csv(out_ + "/contacts.csv");
    std::filesystem::remove_all(out_);
  }

  // Number behind a key of the summary; NaN where it is null or absent. A key inside an object is found after
  // the object's own key.
  double number(const std::string &key, const std::string &inside = "") const {
    size_t at = inside.empty() ? 0 : summary_.find("\"" + inside + "\": ");
    if (at != std::string::npos) at = summary_.find("\"" + key + "\": ", at);
    if (at == std::string::npos) return std::numeric_limits<double>::quiet_NaN();
    const std::string text = summary_.substr(at + key.size() + 4, 40);
    char *end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    return end == text.c_str() ? std::numeric_limits<double>::quiet_NaN() : value;
  }
  std::string hash() const {
    const size_t at = summary_.find("\"state_hash\": \"");
    return at == std::string::npos ? "" : summary_.substr(at + 15, 16);
  }
  bool finite() const { return summary_.find("\"finite\": true") != std::string::npos; }
  double creep_um_per_s() const { return number("creep_max_um_per_s", "hold"); }
  double contacts_max() const { return number("max", "contacts"); }
  double contacts_mean() const { return number("mean", "contacts"); }

  std::vector<BodyRow> rows(const std::string &body) const {
    std::vector<BodyRow> rows;
    for (size_t i = 1; i < bodies_.size(); ++i) {
      const auto &c = bodies_[i];
      if (c.size() != 17 || c[1] != body) continue;
      auto d = [&](size_t k) { return std::stod(c[k]); };
      rows.push_back({d(0), {d(2), d(3), d(4)}, {d(5), d(6), d(7)}, {d(8), d(9), d(10)}, d(11), d(13)});
    }
    EXPECT_FALSE(rows.empty()) << "no rows of body " << body;
    if (rows.empty()) rows.emplace_back();
    return rows;
  }
  bool has(const std::string &body) const {
    return std::any_of(bodies_.begin(), bodies_.end(),
                       [&](auto &row) { return row.size() > 1 && row[1] == body; });
  }
  BodyRow last(const std::string &body) const { return rows(body).back(); }
  // Last place of a probe.
  std::vector<double> probe(const std::string &name) const {
    for (size_t i = probes_.size(); i-- > 1;)
      if (probes_[i].size() == 8 && probes_[i][1] == name)
        return {std::stod(probes_[i][2]), std::stod(probes_[i][3]), std::stod(probes_[i][4])};
    ADD_FAILURE() << "no probe " << name;
    return {0, 0, 0};
  }

  // Sum of the normal forces between a side and its partners in the last record.
  double contact_force(const std::string &side) const {
    double sum = 0;
    for (const auto &c : contacts_)
      if (c.size() == 10 && c[0] == contacts_.back()[0] && (c[1] == side || c[2] == side))
        sum += std::stod(c[5]);
    return sum;
  }
  // Counts of contacts with a side in the records from a time on.
  std::set<int> contact_counts(const std::string &side, double from) const {
    std::set<int> counts;
    for (size_t i = 1; i < contacts_.size(); ++i) {
      const auto &c = contacts_[i];
      if (c.size() == 10 && std::stod(c[0]) > from && (c[1] == side || c[2] == side))
        counts.insert(std::stoi(c[3]));
    }
    return counts;
  }
  // All places of a probe: t, x, y, z.
  std::vector<std::array<double, 4>> probe_rows(const std::string &name) const {
    std::vector<std::array<double, 4>> rows;
    for (const auto &c : probes_)
      if (c.size() == 8 && c[1] == name)
        rows.push_back({std::stod(c[0]), std::stod(c[2]), std::stod(c[3]), std::stod(c[4])});
    EXPECT_FALSE(rows.empty()) << "no probe " << name;
    return rows;
  }

  // What holds in every scene: finite, no crossing triangle pair in any recorded state, and at least so many
  // contacts, so that something was tested.
  void expect_valid(double least_contacts, const std::string &what) const {
    EXPECT_TRUE(finite()) << what;
    EXPECT_GT(number("states_checked"), 1) << what;
    EXPECT_EQ(number("intersections_max"), 0) << what;
    EXPECT_GE(contacts_max(), least_contacts) << what;
  }

 private:
  std::string out_, summary_;
  std::vector<std::vector<std::string>> bodies_, probes_, contacts_;
};

// Whether this is `make soak`, which has the time for all seeds.
inline bool soaks() { return std::getenv("DEFORM_SOAK") != nullptr; }

// Runs with seeds from..to, none above 3 but in `make soak`: sound, criterion met by each, and no two alike.
template <class Criterion>
void expect_jittered(const std::string &scene, int from, int to, std::vector<std::string> arguments,
                     double least_contacts, Criterion meets) {
  std::set<std::string> hashes;
  if (!soaks()) to = std::min(to, 3);
  for (int seed = from; seed <= to; ++seed) {
    std::vector<std::string> with_seed = arguments;
    with_seed.insert(with_seed.end(), {"--jitter", std::to_string(seed)});
    const SceneRun run(scene, with_seed);
    run.expect_valid(least_contacts, scene + ", seed " + std::to_string(seed));
    EXPECT_TRUE(meets(run)) << scene << ", seed " << seed;
    hashes.insert(run.hash());
  }
  EXPECT_EQ(hashes.size(), size_t(to - from + 1));
}

}  // namespace test
