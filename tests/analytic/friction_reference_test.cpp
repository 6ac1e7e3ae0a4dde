// `deform friction` against the trajectories of reference/friction: errors within three times those
// that the set states for a first-order implicit step, or 2e-3 of a column's largest value at a step of 1e-4
// s; stick-slip periods; half the step, half the error.
#include <gtest/gtest.h>

#include <map>

#include "friction_rig.h"

namespace {

using test::rig::Outcome;
using test::rig::Rows;

struct Case {
  const char *id;
  const char *step = "";    // s, that is halved
  const char *halved = "";  // columns whose error halves
  double ratio = 1.89;
};

// A mass on bristles is of second order, an eighth less for what adds up over many rings; where it turns
// within a step of its own slip (gross) the kink of |v| makes the factor jump about. All else is of the law's
// first order. Of stick-slip the path is compared, whose error is that of the events' times; of ramps what
// does not hang on which step the peak falls into.
const Case kCases[] = {
    {"rig_sub_coulomb"},
    {"rig_sub_karnopp"},
    {"rig_sub_dahl", "0.0002", "x v F z", 3.5},
    {"rig_sub_lugre", "0.0002", "x v F z", 3.5},
    {"rig_sub_ep", "0.0002", "x v F z", 3.5},
    {"rig_gross_coulomb", "0.0001", "x v F"},
    {"rig_gross_karnopp", "0.0001", "x v F"},
    {"rig_gross_dahl", "0.0002", "x v F z", 2},
    {"rig_gross_lugre", "0.0002", "x v F z", 2},
    {"rig_gross_ep", "0.0002", "x v F z", 2},
    {"sinvel_V1_coulomb", "0.0001", "F"},
    {"sinvel_V1_dahl", "0.0001", "F z"},
    {"sinvel_V1_lugre", "0.0001", "F z"},
    {"sinvel_V1_ep", "0.0001", "F z"},
    {"sinvel_V2_coulomb", "0.0001", "F"},
    {"sinvel_V2_dahl", "0.0001", "F z"},
    {"sinvel_V2_lugre", "0.0001", "F z"},
    {"sinvel_V2_ep", "0.0001", "F z"},
    {"sinvel_presliding_coulomb", "0.0001", "F"},
    {"sinvel_presliding_dahl", "0.0001", "F z"},
    {"sinvel_presliding_lugre", "0.0001", "F z"},
    {"sinvel_presliding_ep", "0.0001", "F z"},
    {"stickslip_coulomb_plain", "0.0002", "x"},
    {"stickslip_coulomb", "0.0002", "x"},
    {"stickslip_karnopp", "0.0002", "x"},
    {"stickslip_dahl", "0.0002", "x", 2.8},
    {"stickslip_lugre", "0.0002", "x", 3.5},
    {"stickslip_ep", "0.0002", "x", 3.5},
    {"breakaway_lugre", "0.0002", "F_ba t_v_eq_v_s", 3.5},
    {"breakaway_ep", "0.0002", "F_ba t_v_eq_v_s", 3.5},
    {"drift_elastic_dahl", "0.0002", "x v F z", 2.8},
    {"drift_elastic_lugre", "0.0002", "x v F z", 2.8},
    {"drift_elastic_ep", "0.0002", "x v F z", 2.8},
    {"drift_plastic_dahl", "0.0002", "x v F z", 2.8},
    {"drift_plastic_lugre", "0.0002", "x v F z", 2.8},
    {"drift_plastic_ep", "0.0002", "x v F z", 2.8},
    {"vector_circle_lugre", "0.0001", "zx zy Fx Fy"},
    {"vector_turn_lugre", "0.0001", "zx zy Fx Fy"},
    {"vector_turn_ep_associated", "0.0001", "zx zy Fx Fy"},
    {"vector_turn_ep_cosine", "0.0001", "zx zy Fx Fy"},
    {"normal_load_lugre_projected", "0.0001", "z F_elastic"},
    {"sinvel_V1_gms", "0.0001", "F f1 f2 f3 f4"},
    {"sinvel_V2_gms", "0.0001", "F f1 f2 f3 f4"},
    {"sinvel_presliding_gms", "0.0001", "F f1"},
};

std::string text_of(const Case &c) {
  return test::read_file(test::reference_dir() + "/friction/" + c.id + ".json");
}
std::string file_of(const Case &c) { return test::reference_dir() + "/friction/" + c.id + ".json"; }
Rows reference(const Case &c) {
  return test::rig::read_rows(test::reference_dir() + "/friction/" + c.id + ".csv");
}
bool is(const Case &c, const char *part) { return std::string(c.id).find(part) != std::string::npos; }

// Where a force jumps in no time, its row says nothing: a static law at v = 0, and what stick-slip does
// within 0.1 s of a change between the two.
std::vector<bool> rows_left_out(const Case &c, const Rows &ref, const std::string &column) {
  std::vector<bool> out(ref.values.size(), false);
  if (is(c, "sinvel") && is(c, "coulomb")) {
    const std::vector<double> v = ref.column("v");
    for (size_t i = 0; i < v.size(); ++i) out[i] = std::fabs(v[i]) < 1e-12;
  }
  if (is(c, "stickslip") && (column == "F" || column == "z")) {
    const std::vector<double> v = ref.column("v");
    const double slow = 0.02;  // m/s: slip ends and begins in less than 0.1 s below that
    for (size_t i = 0; i < v.size(); ++i)
      for (const size_t k : {i ? i - 1 : 0, std::min(i + 1, v.size() - 1)})
        out[i] = out[i] || (std::fabs(v[i]) < slow) != (std::fabs(v[k]) < slow);
  }
  return out;
}

struct ColumnError { double error = 0, largest = 0; };

std::map<std::string, ColumnError> errors(const Case &c, const Outcome &out, const Rows &ref) {
  std::map<std::string, ColumnError> all;
  EXPECT_EQ(out.rows.names, ref.names);
  EXPECT_EQ(out.rows.values.size(), ref.values.size());
  for (const std::string &name : ref.names) {
    const std::vector<double> ours = out.rows.column(name), theirs = ref.column(name);
    const std::vector<bool> left_out = rows_left_out(c, ref, name);
    ColumnError &e = all[name];
    for (size_t i = 0; i < std::min(ours.size(), theirs.size()); ++i) {
      if (left_out[i]) continue;
      EXPECT_EQ(std::isnan(ours[i]), std::isnan(theirs[i])) << c.id << " " << name << " row " << i;
      if (std::isnan(theirs[i])) continue;
      e.error = std::max(e.error, std::fabs(ours[i] - theirs[i]));
      e.largest = std::max(e.largest, std::fabs(theirs[i]));
    }
  }
  return all;
}

Outcome run(const Case &c, const std::string &step) { return test::rig::run(file_of(c), {"--step", step}); }

class FrictionReference : public testing::TestWithParam<Case> {
 protected:
  const Case c = GetParam();
  const std::string text = text_of(c);
  const Rows ref = reference(c);

  const Outcome &at(const std::string &step) {
    const auto found = runs_.find(step);
    return found != runs_.end() ? found->second : runs_.emplace(step, run(c, step)).first->second;
  }
  void stay_within_what_is_stated() {
    bool stated = false;
    for (const char *step : {"0.001", "0.0001"}) {
      const std::string key = "h=" + std::string(step);
      if (text.find('"' + key + '"') == std::string::npos) continue;
      stated = true;
      const Outcome &out = at(step);
      for (const auto &[name, e] : errors(c, out, ref)) {
        const std::string block = text.substr(text.find('"' + key + '"'));
        const double prototype = test::rig::json_number(block.substr(0, block.find('}')), {name.c_str()});
        if (std::isnan(prototype)) continue;
        EXPECT_LE(e.error, 3 * prototype) << c.id << " " << key << " " << name;
        const double end = test::rig::json_number(block.substr(0, block.find('}')), {"x_end"});
        if (name == "x") {
          EXPECT_LE(std::fabs(out.rows.column("x").back() - ref.column("x").back()), 3 * end)
              << c.id << " " << key;
        }
      }
    }
    if (stated) return;
    for (const auto &[name, e] : errors(c, at("0.0001"), ref))
      EXPECT_LE(e.error, 2e-3 * e.largest + 1e-12) << c.id << " " << name;
  }
  void halve_with_the_step() {
    if (!*c.step) {  // what holds is exact at any step
      for (const auto &[name, e] : errors(c, at("0.01"), ref))
        EXPECT_LE(e.error, 1e-12 * (1 + e.largest)) << c.id << " " << name;
      return;
    }
    const bool finer = c.step == std::string("0.0001");
    const auto coarse = errors(c, at(c.step), ref), fine = errors(c, at(finer ? "0.00005" : "0.0001"), ref);
    for (const auto &[name, e] : coarse) {
      if ((" " + std::string(c.halved) + " ").find(" " + name + " ") == std::string::npos) continue;
      EXPECT_GT(e.error, 1e-12 * e.largest) << c.id << " " << name << ": nothing to halve";
      EXPECT_GE(e.error, c.ratio * fine.at(name).error) << c.id << " " << name;
    }
  }
  void have_the_period() {
    const auto stated = [&](const char *name) { return test::rig::json_number(text, {"summary", name}); };
    const Outcome &out = at("0.0001");
    // first order, those with bristles second
    const bool jumps = is(c, "coulomb") || is(c, "karnopp");
    EXPECT_NEAR(out.figure("period"), stated("period"), (jumps ? 1e-4 : 1e-6) * stated("period")) << c.id;
    EXPECT_NEAR(out.figure("spring_force_max"), stated("spring_force_max"), 1e-4) << c.id;
    EXPECT_NEAR(out.figure("spring_force_min"), stated("spring_force_min"), 1e-4) << c.id;
    EXPECT_NEAR(out.figure("v_max"), stated("v_max"), 1e-3 * stated("v_max")) << c.id;
  }

 private:
  std::map<std::string, Outcome> runs_;  // by step
};

}  // namespace

// One test, which runs each step once.
TEST_P(FrictionReference, ErrorsAndPeriods_AreAsStatedAndHalveWithTheStep) {
  stay_within_what_is_stated();
  halve_with_the_step();
  if (is(c, "stickslip")) have_the_period();
}

INSTANTIATE_TEST_SUITE_P(Cases, FrictionReference, testing::ValuesIn(kCases),
                         [](const auto &each) { return std::string(each.param.id); });

TEST(FrictionReferencePath, ClosedForms_OfEveryLawWithBristles) {
  const Case c{"presliding"};
  const Rows ref = reference(c);
  const struct {
    const char *law, *column;
    double bound;
  } laws[] = {// ep: sigma1 v_q is 2e-4 N
              {"dahl", "F_dahl_alpha1", 1e-4},
              {"lugre", "F_lugre_at_v_q", 1e-4},
              {"ep", "F_ep_rate_independent", 4e-4}};
  for (const auto &law : laws) {
    const Outcome out = test::rig::run(file_of(c), {"--law", law.law, "--step", "1e-3"});
    const std::vector<double> ours = out.rows.column("F"), theirs = ref.column(law.column);
    EXPECT_EQ(out.rows.names, (std::vector<std::string>{"x", "segment", "F"}));
    ASSERT_EQ(ours.size(), theirs.size());
    EXPECT_EQ(out.rows.column("x"), ref.column("x"));
    for (size_t i = 0; i < ours.size(); ++i)
      EXPECT_NEAR(ours[i], theirs[i], law.bound) << law.law << " row " << i;
  }
}

// The exact work of each half cycle of a prescribed motion.
TEST(FrictionReferenceWork, HalfCycles_MatchTheStatedWork) {
  for (const char *id :
       {"sinvel_V1_dahl", "sinvel_V1_lugre", "sinvel_V1_ep", "sinvel_V2_lugre", "sinvel_V2_ep"}) {
    const Case c{id};
    const std::string text = text_of(c), ours = run(c, "1e-4").figures;
    const char *p = text.c_str() + text.find('[', text.find("work_per_half_cycle")) + 1;
    const char *q = ours.c_str() + ours.find('[', ours.find("work_per_half_cycle_J")) + 1;
    for (int k = 0; k < 4; ++k) {
      char *p_end = nullptr, *q_end = nullptr;
      const double stated = std::strtod(p, &p_end), got = std::strtod(q, &q_end);
      EXPECT_NEAR(got, stated, 5e-4 * stated) << id << " half cycle " << k;
      p = p_end + 1;
      q = q_end + 1;
    }
  }
}

// What cannot be run says so: the other forms of a varying load, tables, laws that we do not ship.
TEST(FrictionReferenceRefused, CasesThatAreNotRuns_Exit2) {
  const struct {
    const char *id, *word;
  } cases[] = {{"normal_load_lugre_scaled", "projection"},
               {"normal_load_lugre_constant_stiffness", "projection"},
               {"curves_alpha", "table"},
               {"curves_steady", "table"},
               {"rate_state_velocity_step", "table"},
               {"presliding", "--law"}};
  for (const auto &c : cases) {
    const test::CommandResult r = test::deform({"friction", file_of({c.id})});
    EXPECT_EQ(r.exit_code, 2) << c.id;
    EXPECT_NE(r.err.find(c.word), std::string::npos) << r.err;
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
  }
}
