// `deform plugin check`: every shipped plugin keeps every rule, and each broken law or model
// (tests/plugin/broken) breaks the one rule that is meant for it and no other: a rule that nothing fails
// would prove nothing, and one that fails with others would not tell what to mend.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SANITIZED 1
#endif
#endif
#ifndef SANITIZED
#define SANITIZED 0
#endif
#if defined(__SANITIZE_THREAD__)
#define FINDS_RACES 1
#else
#define FINDS_RACES 0
#endif

namespace {

// What a law that hangs costs; a sanitizer slows the sound rules down, too.
const char *const kLimit = SANITIZED ? "8" : "2";
// What does not hang costs nothing by a longer limit.
const char *const kPatient = "100";

std::string broken(const std::string &name) {
  return std::string(DEFORM_BINARY_DIR) + "/lib/broken/" + name + ".so";
}
std::string shipped(const std::string &name) { return std::string(DEFORM_PLUGIN_DIR) + "/" + name + ".so"; }

test::CommandResult check(const std::string &file, std::vector<std::string> more = {},
                          const char *limit = kLimit) {
  std::vector<std::string> args{"plugin", "check", file, "--limit", limit};
  args.insert(args.end(), more.begin(), more.end());
  return test::deform(args);
}

// Rules whose line says `word`.
std::vector<std::string> rules_that(const std::string &word, const std::string &out) {
  std::vector<std::string> ids;
  for (size_t at = 0, end; at < out.size(); at = end + 1) {
    end = std::min(out.find('\n', at), out.size());
    const std::string line = out.substr(at, end - at);
    if (line.size() > 10 && line[5] == ' ' && line.compare(6, word.size() + 1, word + " ") == 0)
      ids.push_back(line.substr(2, 3));
  }
  return ids;
}

// As the last line counts them: rules that are skipped for one reason share a line.
int skipped(const std::string &out) {
  std::smatch number;
  return std::regex_search(out, number, std::regex(R"((\d+) skipped\n)")) ? std::stoi(number[1]) : -1;
}

// The sentence under the line of a rule that failed.
std::string sentence(const std::string &id, const std::string &out) {
  const size_t at = out.find("  " + id + " FAIL"), begin = at == std::string::npos ? at : out.find('\n', at);
  return begin == std::string::npos ? "" : out.substr(begin + 1, out.find('\n', begin + 1) - begin - 1);
}

// ---- broken laws ------------------------------------------------------------------------------------------

std::string lower(std::string text) {
  for (char &c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

struct Case { const char *law, *rule, *says; };
std::ostream &operator<<(std::ostream &out, const Case &c) { return out << c.law; }

class BrokenLaw : public testing::TestWithParam<Case> {};

// unsanitized: its rules have limits of time; other tests run them
TEST_P(BrokenLaw, FailsItsRuleOnly) {
  const test::CommandResult r = check(broken(GetParam().law));
  EXPECT_EQ(r.exit_code, 1) << r.out << r.err;
  const std::vector<std::string> expected{GetParam().rule};
  std::vector<std::string> failed = rules_that("FAIL", r.out);
  // A sanitizer build asks a law from several threads (V10). They collide in a shared variable by chance,
  // which ThreadSanitizer does not depend on.
  if (SANITIZED && std::string(GetParam().law).find("shares_a_static") != std::string::npos) {
    const bool found = std::erase(failed, "V10") == 1;
    EXPECT_TRUE(found || !FINDS_RACES) << r.out;
  }
  EXPECT_EQ(failed, expected) << r.out;
  const std::string why = sentence(GetParam().rule, r.out);
  // a sanitizer that sees it first says "null pointer"
  EXPECT_NE(lower(why).find(lower(GetParam().says)), std::string::npos) << why;
  EXPECT_NE(why.find("; "), std::string::npos) << "a finding and a remedy: " << why;
}

INSTANTIATE_TEST_SUITE_P(
    Plugin, BrokenLaw,
    testing::Values(
        Case{"second_symbol", "V01", "broken_helper"}, Case{"wrong_abi", "V02", "draft 7"},
        Case{"deaf_to_abi", "V02", "cannot know"}, Case{"rows_nowhere", "V02", "row 1 of nparam 2"},
        Case{"id_nowhere", "V02", "its id lies outside"}, Case{"id_of_two_lines", "V03", "reverse-DNS"},
        Case{"row_too_many", "V03", "row 3 of nparam 3"},
        Case{"rows_of_another_size", "V03", "row 2 of nparam 2"}, Case{"no_source", "V03", "\"source\""},
        Case{"without_eval", "V03", "set dfm_friction.eval"}, Case{"fills_reserved", "V03", "9 in reserved"},
        Case{"misspelt_promise", "V03", "\"stiction\""},
        Case{"refuses_its_defaults", "V04", "must be above 0.9"},
        Case{"not_finite_at_the_end_of_a_range", "V04", "\"mu\" = 0"},
        Case{"allocates", "V05", "calls malloc"}, Case{"reads_the_environment", "V05", "calls getenv"},
        Case{"writes_past_the_end", "V06", "past the end of limit"},
        Case{"writes_its_input", "V06", "writes into fn"}, Case{"reads_a_null_output", "V06", "NULL"},
        Case{"leaves_out_the_mode", "V06", "lane 0 of mode"},
        Case{"steps_where_watched", "V06", "which others are requested"},
        Case{"remembers", "V07", "keeps data"}, Case{"asks_who_it_is", "V07", "in another process"},
        Case{"spreads_nan", "V08", "changed lane"}, Case{"hides_nan", "V08", "finite force"},
        Case{"hangs", "V08", "did not come back"}, Case{"leaks", "V09", "on the heap"},
        Case{"keeps_host_memory", "V09", "host's memory"}, Case{"stays_loaded", "V09", "stays in memory"},
        Case{"pushes_at_rest", "F01", "at rest"}, Case{"axis_by_axis", "F02", "turned by"},
        Case{"signed_sine", "F02", "turned by"}, Case{"turns_no_state", "F02", "DFM_SLOT_TANGENT"},
        Case{"stores_less", "F03", "reports as stored"}, Case{"wrong_sign", "F03", "closed loop"},
        Case{"not_passive", "F03", "random steps"}, Case{"knows_its_place", "F04", "in a batch of"},
        Case{"half_the_derivative", "F05", "dft_dvt"}, Case{"creeps", "F06", "in 1000 s"},
        Case{"promises_stribeck", "F07", "falls nowhere"}, Case{"promises_viscous", "F08", "does not rise"},
        Case{"promises_presliding", "F09", "no presliding"}, Case{"promises_hysteresis", "F10", "loop of"},
        Case{"promises_breakaway", "F11", "the peak is"}, Case{"explicit_lag", "F12", "at steps of 0.0333"},
        Case{"drifts", "F13", "per cycle"}, Case{"spikes", "F14", "spike"},
        Case{"asks_the_time", "V05", "calls time"},
        Case{"rounds_upward_at_load", "V11", "loading it leaves the rounding mode"},
        Case{"rounds_upward_in_eval", "V11", "eval leaves the rounding mode"},
        Case{"flushes_denormals", "V11", "denormal"}, Case{"prints_at_load", "V12", "my law 1.0"},
        Case{"changes_folder", "V12", "loading it changes the current folder"},
        Case{"sets_environment", "V12", "OMP_NUM_THREADS"},
        Case{"sets_locale", "V12", "using it changes the locale"},
        Case{"catches_signals", "V12", "handlers of signals"},
        Case{"closes_output", "V12", "closes standard output"},
        Case{"changes_umask", "V12", "mask of new files"}, Case{"leaves_a_thread", "V12", "1 thread"},
        Case{"wears_out", "V13", "other contacts"}, Case{"counts_in_sixteen_bits", "V13", "uint32_t"},
        Case{"shares_a_static", "V14", "\"shared\""}, Case{"doubles_its_state", "F15", "no longer finite"},
        Case{"turned_by_half_a_radian", "F16", "0.5 rad off"},
        Case{"depends_on_the_step", "F17", "does not converge"}),
    [](const auto &one) { return std::string(one.param.law); });

INSTANTIATE_TEST_SUITE_P(
    Models, BrokenLaw,
    testing::Values(
        Case{"model_claims_too_much", "V03", "without energy"},
        Case{"model_fills_the_free_place", "V03", "fetch"},
        Case{"model_answers_any_id", "V03", "cannot know"},
        Case{"model_rows_without_size", "V03", "row_size 0"},
        Case{"model_fills_its_slots", "V03", "7 in reserved"},
        Case{"model_fills_a_row", "V03", "5 in reserved"},
        Case{"model_table_without_function", "V03", "has no function"},
        Case{"model_without_bound", "V03", "bound is NULL"}, Case{"model_of_unheard_cells", "V03", "0x100"},
        Case{"model_cannot_change", "V03", "no set_params"}, Case{"solver_of_unheard_kind", "V03", "0x4"},
        Case{"model_refuses_in_silence", "V04", "without a reason"},
        Case{"model_allocates", "V05", "calls malloc"}, Case{"model_writes_between", "V06", "stride"},
        Case{"model_clears_forces", "V06", "after add_forces"},
        Case{"model_bound_sets_the_step", "V06", "let it only fall"},
        Case{"model_asks_who_it_is", "V07", "in another process"},
        Case{"model_hides_nan", "V08", "finite results"}, Case{"model_leaks", "V09", "on the heap"},
        Case{"model_releases_twice", "V09", "had released before"},
        Case{"model_rounds_upward", "V11", "add_forces leaves the rounding mode"},
        Case{"model_prints", "V12", "my model 1.0"}, Case{"model_shares_a_static", "V14", "\"shared\""},
        Case{"model_pulls_at_rest", "M01", "the rest pose has forces"},
        Case{"model_knows_up", "M02", "off the forces turned by as much"},
        Case{"model_flies_off", "M03", "sum to"},
        Case{"model_brakes_the_free", "M03", "the momentum of a free body changes"},
        Case{"model_other_energy", "M04", "the energy falls by"},
        Case{"model_forces_of_later_state", "M04", "not of state_out"},
        Case{"model_softer_stiffness", "M05", "off the differences"},
        Case{"model_indefinite", "M05", "a positive direction"},
        Case{"model_counts_points", "M09", "numbered otherwise"},
        Case{"model_counts_steps", "M10", "continues in a new instance"},
        Case{"model_divides_by_length", "M11", "at one place"},
        Case{"model_visits_all", "M12", "faster than the body"},
        Case{"model_bound_too_small", "M13", "would explode"},
        Case{"model_bound_too_large", "M13", "times as many steps"},
        Case{"model_commits_less", "M14", "off predict plus respond"},
        Case{"model_sums_cells_twice", "M16", "the energies of the cells"},
        Case{"model_sums_as_they_come", "M17", "parallel_for"},
        Case{"model_lopsided", "M18", "not symmetric"}, Case{"model_many_otherwise", "M18", "respond_many"},
        Case{"model_low_diagonal", "M19", "below what respond answers"},
        Case{"model_constant_claim", "M20", "DFM_CAP_CONSTANT_STIFFNESS"},
        Case{"model_pumps", "M21", "dampers that push"},
        Case{"model_hides_dampers", "M21", "does not claim DFM_CAP_DAMPING"},
        Case{"model_forgets_damping", "M21", "do not change with velocities"},
        Case{"model_single_without_forces", "V03", "lacks prepare or add_forces"},
        Case{"model_single_otherwise", "M22", "off those in double"},
        Case{"model_single_rounds", "M22", "sum to"},
        Case{"model_single_refuses_in_silence", "M22", "without a reason"},
        Case{"model_gives_a_part_beyond", "M23", "part 2, and"},
        Case{"model_leaves_out_a_part", "M23", "part 1 0 times"},
        Case{"model_parts_otherwise", "M23", "off those of add_forces"}),
    [](const auto &one) { return std::string(one.param.law); });

TEST(BrokenLaw, EveryBrokenLaw_IsInTheTable) {
  std::vector<std::string> known{
      "sound",        "sound_rate_and_state", "model_sound",     "model_sound_stepper", "model_sound_second",
      "hangs_always", "crashes_always",       "sleeps_for_ever", "no_force_at_speed"};
  for (int s = 0; s < testing::UnitTest::GetInstance()->total_test_suite_count(); ++s)
    for (int t = 0; t < testing::UnitTest::GetInstance()->GetTestSuite(s)->total_test_count(); ++t) {
      const std::string name = testing::UnitTest::GetInstance()->GetTestSuite(s)->GetTestInfo(t)->name();
      if (name.find('/') != std::string::npos) known.push_back(name.substr(name.find('/') + 1));
    }
  for (const auto &entry :
       std::filesystem::directory_iterator(std::string(DEFORM_SOURCE_DIR) + "/tests/plugin/broken"))
    EXPECT_TRUE(entry.path().extension() != ".c" ||
                std::find(known.begin(), known.end(), entry.path().stem().string()) != known.end())
        << entry.path();
}

// What a model of forces alone is not asked; V10 needs a sanitizer.
const std::vector<std::string> kSkipsOfSound{"V10", "M14", "M18", "M19", "M20", "M22", "M23"};

TEST(BrokenLaw, CorrectTemplates_PassEveryRule) {
  const test::CommandResult r = check(broken("sound"));
  EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_GE(rules_that("pass", r.out).size(), 20u) << r.out;
  // Both kinds of models together are asked every rule.
  const test::CommandResult forces = check(broken("model_sound")),
                            steps = check(broken("model_sound_stepper"));
  EXPECT_EQ(forces.exit_code, 0) << forces.out << forces.err;
  EXPECT_EQ(steps.exit_code, 0) << steps.out << steps.err;
  std::vector<std::string> skips = kSkipsOfSound;
  if (SANITIZED) skips.erase(skips.begin());
  EXPECT_EQ(rules_that("skip", forces.out), skips) << forces.out;
  for (const char *rule : {"M03", "M10", "M14", "M16", "M18", "M19"})
    EXPECT_NE(steps.out.find(std::string(rule) + " pass"), std::string::npos) << steps.out;
}

// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, CorrectTemplateOfSecondOrder_PassesEveryRule) {
  const test::CommandResult r = check(broken("model_sound_second"));
  EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_EQ(rules_that("skip", r.out), kSkipsOfSound) << r.out;
}

// A law that never answers costs two rules, not all of them.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, ThatAlwaysHangs_EndsAfterTwoRulesThatDidNotComeBack) {
  const test::CommandResult r = check(broken("hangs_always"));
  EXPECT_EQ(r.exit_code, 1) << r.out;
  EXPECT_EQ(rules_that("FAIL", r.out).size(), 2u) << r.out;
  EXPECT_GE(skipped(r.out), 20) << r.out;
  EXPECT_NE(
      r.out.find("  the other rules are skipped: two rules crashed or did not return; fix them first\n"),
      std::string::npos)
      << r.out;
}

// Nor does a law that always crashes fill the screen with signals.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, ThatAlwaysCrashes_EndsAfterTwoRulesAndTheOneThatSaysWhere) {
  const test::CommandResult r = check(broken("crashes_always"));
  EXPECT_EQ(r.exit_code, 1) << r.out;
  EXPECT_EQ(rules_that("FAIL", r.out), (std::vector<std::string>{"V09", "V12", "V06"})) << r.out;
  EXPECT_NE(sentence("V06", r.out).find("writes through a pointer that is NULL"), std::string::npos) << r.out;
  EXPECT_GE(skipped(r.out), 20) << r.out;
  EXPECT_NE(r.out.find("two rules crashed or did not return"), std::string::npos) << r.out;
}

// NaN from a speed on is no wrong sign: the sentence names the speed.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, ForceThatIsNotFiniteAtSpeed_IsReportedWithTheSpeed) {
  const test::CommandResult r =
      check(broken("no_force_at_speed"), {"--only", "F03", "--only", "F12", "--only", "F16"});
  EXPECT_EQ(rules_that("FAIL", r.out), (std::vector<std::string>{"F03", "F12", "F16"})) << r.out;
  for (const char *id : {"F12", "F16"})
    EXPECT_NE(sentence(id, r.out).find("the force is not finite"), std::string::npos) << r.out;
  EXPECT_NE(sentence("F03", r.out).find("not finite at a slip of 1.78 m/s"), std::string::npos) << r.out;
  const std::string bounded = sentence("F12", r.out);
  std::smatch speed;
  ASSERT_TRUE(std::regex_search(bounded, speed, std::regex(R"(not finite .* at a slip of (\S+) m/s)")))
      << r.out;
  EXPECT_GT(std::stod(speed[1]), 1) << r.out;
}

// A function that is missing is named once; what would call it is not run.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, WithoutEval_IsReportedInOneSentence) {
  const test::CommandResult r = check(broken("without_eval"));
  EXPECT_EQ(rules_that("FAIL", r.out), std::vector<std::string>{"V03"}) << r.out;
  EXPECT_EQ(r.out.find("SIG"), std::string::npos) << r.out;
  EXPECT_LE(std::count(r.out.begin(), r.out.end(), '\n'), 9) << r.out;
  EXPECT_NE(r.out.find("  the other rules are skipped: it cannot be used (V03 says why)\n"),
            std::string::npos)
      << r.out;
  // V03 says which, even where another rule was asked for
  const test::CommandResult one = check(broken("without_eval"), {"--only", "F03"});
  EXPECT_EQ(one.exit_code, 1) << one.out;
  EXPECT_EQ(rules_that("FAIL", one.out), std::vector<std::string>{"V03"}) << one.out;
}

// The force of such a law changes by the same amount with each tenfold slip, so F17 must not compare
// forces at times at which the slip goes through zero.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, LogarithmOfTheSlip_ConvergesWithTheStep) {
  const test::CommandResult r = check(broken("sound_rate_and_state"));
  EXPECT_EQ(r.exit_code, 0) << r.out;
  EXPECT_NE(r.out.find("F17 pass"), std::string::npos) << r.out;
}

// The sentence says in which slip and when.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, ThatDependsOnTheStep_IsReportedWhereMost) {
  const test::CommandResult r = check(broken("depends_on_the_step"), {"--only", "F17"});
  const std::string why = sentence("F17", r.out);
  const std::regex where(R"(: \S+ and \S+ N, \d+ ms after the state was 0, in a slip that swings by )");
  EXPECT_TRUE(std::regex_search(why, where)) << why;
}

// What waits uses no processor time, so it is not that which ends it; the line of the rule before is
// there meanwhile.
// unsanitized: its rules have limits of time; other tests run them
TEST(BrokenLaw, ThatWaitsForEver_IsEndedWhileResultsArePrintedAsTheyCome) {
  FILE *command = popen(("'" + std::string(DEFORM_COMMAND) + "' plugin check '" + broken("sleeps_for_ever") +
                         "' --only V01 --only F01")
                            .c_str(),
                        "r");
  ASSERT_NE(command, nullptr);
  setvbuf(command, nullptr, _IONBF, 0);
  char line[512] = "";
  std::string out;
  bool waited = false;
  while (std::fgets(line, sizeof line, command)) {
    out += line;
    pollfd more{fileno(command), POLLIN, 0};
    if (out.find("V01 pass") != std::string::npos && out.find("F01") == std::string::npos)
      waited |= poll(&more, 1, 0) == 0;
  }
  EXPECT_EQ(WEXITSTATUS(pclose(command)), 1);
  EXPECT_TRUE(waited) << "all came at once";
  EXPECT_EQ(rules_that("FAIL", out), std::vector<std::string>{"F01"}) << out;
  EXPECT_NE(out.find("waited for 5 s for something that never comes"), std::string::npos) << out;
}

// ---- shipped plugins --------------------------------------------------------------------------------------

// unsanitized: minutes there; each plugin has tests of its own
TEST(PluginCheck, ShippedPluginsButTheReduced_KeepEveryRule) {
  int laws = 0, models = 0;
  for (const auto &entry : std::filesystem::directory_iterator(DEFORM_PLUGIN_DIR)) {
    if (entry.path().stem() == "model_gpu") continue;      // needs a driver: tests/gpu
    if (entry.path().stem() == "model_reduced") continue;  // below
    const test::CommandResult r = check(entry.path().string(), {}, kPatient);
    EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
    laws += r.out.find("\nlaw ") != std::string::npos;
    for (size_t at = 0; (at = r.out.find("\nmodel ", at)) != std::string::npos; ++at) ++models;
  }
  EXPECT_GE(laws, 3);
  EXPECT_GE(models, 5);
}

// Each of their bodies solves for its modes. Left out are the rules that make most bodies.
// unsanitized: minutes there; each plugin has tests of its own
TEST(PluginCheck, ReducedModels_KeepTheRulesOfFewBodies) {
  std::vector<std::string> only;
  for (const char *rule :
       {"V03", "V04", "V05", "V09", "V11", "V12", "V14", "M01", "M03", "M14", "M17", "M18", "M19"})
    only.insert(only.end(), {"--only", rule});
  const test::CommandResult r = check(shipped("model_reduced"), only, kPatient);
  EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_EQ(rules_that("pass", r.out).size(), 2 + 3 * 11u) << r.out;
}

// soak: a minute; the test above has the rules of few bodies
TEST(PluginCheck, ReducedModels_KeepEveryRule) {
  const test::CommandResult r = check(shipped("model_reduced"), {}, kPatient);
  EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
}

// What strangers copy is checked like what is shipped, and is no part of it.
TEST(PluginCheck, Template_KeepsEveryRuleInUnderSixtyLinesAndIsNotShipped) {
  const test::CommandResult r = check(std::string(DEFORM_BINARY_DIR) + "/lib/template/template_friction.so");
  EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
  EXPECT_GE(rules_that("pass", r.out).size(), 20u) << r.out;
  const std::string source =
      test::read_file(std::string(DEFORM_SOURCE_DIR) + "/plugins/template_friction/template_friction.c");
  EXPECT_GT(source.size(), 1000u);
  EXPECT_LT(std::count(source.begin(), source.end(), '\n'), 60);
  EXPECT_FALSE(std::filesystem::exists(shipped("template_friction")));
}

// unsanitized: too slow there; shorter tests run the same code
TEST(PluginCheck, TemplatesOfModels_KeepEveryRuleAndAreNotShipped) {
  for (const char *name : {"template_model", "template_model_cpp"}) {
    const test::CommandResult r = check(std::string(DEFORM_BINARY_DIR) + "/lib/template/" + name + ".so");
    EXPECT_EQ(r.exit_code, 0) << r.out << r.err;
    EXPECT_GE(rules_that("pass", r.out).size(), 20u) << r.out;
  }
  EXPECT_FALSE(std::filesystem::exists(shipped("template_model")));
}

// unsanitized: its rules have limits of time; other tests run them
TEST(PluginCheck, AnotherSeed_FindsNothingInTheShippedLaws) {
  for (const char *seed : {"2", "77"})
    for (const char *law : {"friction_coulomb", "friction_karnopp"})
      EXPECT_EQ(check(shipped(law), {"--seed", seed}).exit_code, 0) << law << " " << seed;
}

TEST(PluginCheck, Model_IsCheckedWithEachOptionAndByNoRuleOfLaws) {
  const test::CommandResult r =
      check(shipped("model_corotational_fem"), {"--only", "M04", "--only", "F01"}, kPatient);
  EXPECT_EQ(r.exit_code, 0) << r.out;
  EXPECT_EQ(rules_that("pass", r.out), std::vector<std::string>{"M04"}) << r.out;
  // the defaults, damping, two energies, two rotations, the exact tangent and a remedy for locking; the first
  // two with four more kinds of cells
  EXPECT_NE(r.out.find("16 sets of parameters"), std::string::npos) << r.out;
  EXPECT_EQ(r.out.find("F01"), std::string::npos);
}

// ---- the command ------------------------------------------------------------------------------------------

TEST(PluginCheck, WithoutASanitizer_SkipsThatRuleAndGivesTheReason) {
  if (SANITIZED) return;
  const test::CommandResult r = check(shipped("friction_coulomb"), {"--only", "V10"});
  EXPECT_EQ(r.exit_code, 0);
  EXPECT_EQ(rules_that("skip", r.out), std::vector<std::string>{"V10"}) << r.out;
  EXPECT_NE(r.out.find("--preset asan"), std::string::npos) << r.out;
}

TEST(PluginCheck, OneRule_IsRunAlone) {
  const test::CommandResult r = check(broken("wrong_sign"), {"--only", "F02", "--only", "F03"});
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_EQ(rules_that("pass", r.out), std::vector<std::string>{"F02"}) << r.out;
  EXPECT_EQ(rules_that("FAIL", r.out), std::vector<std::string>{"F03"}) << r.out;
  EXPECT_EQ(check(broken("wrong_sign"), {"--only", "F02"}).exit_code, 0);
}

TEST(PluginCheck, NameOfALawThatIsFound_IsCheckedInItsFile) {
  for (const char *name : {"coulomb", "org.deform.coulomb"}) {
    const test::CommandResult r = test::deform({"plugin", "check", name, "--only", "V02"});
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_NE(r.out.find("friction_coulomb.so"), std::string::npos) << r.out;
  }
  const test::CommandResult none = test::deform({"plugin", "check", "coulom"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_NE(none.err.find("a name of deform plugin list"), std::string::npos) << none.err;
}

// A rule of laws cannot pass for want of a law.
TEST(PluginCheck, OneRuleOfAFileThatDoesNotLoad_Fails) {
  const test::CommandResult r = check(broken("wrong_abi"), {"--only", "F03"});
  EXPECT_EQ(r.exit_code, 1) << r.out;
  EXPECT_EQ(rules_that("FAIL", r.out), std::vector<std::string>{"V02"}) << r.out;
}

// "31 rules" and "31 [rules](..)" stand in the pages.
// unsanitized: too slow there; shorter tests run the same code
TEST(PluginCheck, NumbersOfRules_AreThoseOfThePages) {
  std::set<std::string> counted;
  for (const char *plugin : {"friction_coulomb", "model_msm"}) {
    const test::CommandResult r = check(shipped(plugin));
    counted.insert(std::to_string(rules_that("pass", r.out).size() + rules_that("skip", r.out).size()));
  }
  for (const char *page :
       {"/README.md", "/libdeform/doc/howto/write-a-law.md", "/libdeform/doc/howto/write-a-model.md"}) {
    const std::string text = test::read_file(DEFORM_SOURCE_DIR + std::string(page));
    const std::regex number(R"((\d+) \[?rules)");
    size_t found = 0;
    for (std::sregex_iterator i(text.begin(), text.end(), number), end; i != end; ++i, ++found)
      EXPECT_TRUE(counted.count((*i)[1])) << page << ": " << i->str();
    EXPECT_GT(found, 0u) << page;
  }
}

// The one sentence that helps is not buried under thirty that say the same.
TEST(PluginCheck, FileThatDoesNotLoad_SkipsTheOtherRulesInOneLine) {
  const test::CommandResult r = check(broken("wrong_abi"));
  EXPECT_EQ(rules_that("FAIL", r.out), std::vector<std::string>{"V02"}) << r.out;
  EXPECT_LE(std::count(r.out.begin(), r.out.end(), '\n'), 8) << r.out;
  EXPECT_NE(r.out.find("  the other rules are skipped: it does not load (V02 says why)\n"), std::string::npos)
      << r.out;
}

// unsanitized: its rules have limits of time; other tests run them
TEST(PluginCheck, InThisProcess_GivesTheSameVerdicts) {
  for (const char *law : {"sound", "allocates", "writes_past_the_end", "wrong_sign"}) {
    const test::CommandResult apart = check(broken(law)), here = check(broken(law), {"--in-process"});
    EXPECT_EQ(apart.exit_code, here.exit_code) << law;
    EXPECT_EQ(rules_that("FAIL", apart.out), rules_that("FAIL", here.out)) << law;
  }
}

TEST(PluginCheck, Json_CarriesEveryRule) {
  const test::CommandResult r = check(broken("drifts"), {"--json", "--seed", "5"});
  EXPECT_EQ(r.exit_code, 1);
  EXPECT_NE(r.out.find("\"seed\": 5"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("\"failed\": 1"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("\"id\": \"F13\", \"title\": \"stiction: no drift under a biased oscillating load\", "
                       "\"result\": \"fail\""),
            std::string::npos)
      << r.out;
  for (const char *id : {"V01", "V10", "F01", "F14"})
    EXPECT_NE(r.out.find("\"id\": \"" + std::string(id) + "\""), std::string::npos) << id;
}

TEST(PluginCheck, BadUsage_ExitsTwoWithOneSentence) {
  const test::CommandResult missing = check("/nowhere/law.so");
  const test::CommandResult rule = check(broken("sound"), {"--only", "F99"});
  const test::CommandResult folder = check(DEFORM_PLUGIN_DIR);
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("/nowhere/law.so"), std::string::npos) << missing.err;
  EXPECT_EQ(rule.exit_code, 2);
  EXPECT_NE(rule.err.find("\"F99\""), std::string::npos) << rule.err;
  EXPECT_EQ(folder.exit_code, 2);
}

TEST(PluginCheck, FileThatIsNoLibrary_FailsTheRulesOfTheFile) {
  const std::string file = test::scratch("plugin_check") + "/text.so";
  test::write_file(file, "not a library\n");
  const test::CommandResult r = check(file);
  EXPECT_EQ(r.exit_code, 1) << r.err;
  EXPECT_EQ(rules_that("FAIL", r.out), (std::vector<std::string>{"V01", "V02"})) << r.out;
}

}  // namespace
