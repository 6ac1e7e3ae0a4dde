// What a plugin leaves changed in the thread that called it is put back: rounding mode, denormals, exception
// masks, the locale of numbers; the host says once which plugin it was, and can be asked which one runs.
#include <fenv.h>

#include <cfloat>
#include <clocale>

#include "tiny_support.h"

namespace {

using tiny::Batch;
using tiny::Context;

// Rounding, denormals and masks, each by what arithmetic does.
void expect_usual() {
  EXPECT_EQ(fegetround(), FE_TONEAREST);
  EXPECT_EQ(fegetexcept(), 0);
  volatile double small = DBL_MIN;
  EXPECT_GT(small / 4, 0.0) << "denormal numbers are flushed";
  EXPECT_STREQ(std::setlocale(LC_NUMERIC, nullptr), "C");
}

TEST(Boundary, LoadingThatChangesTheEnvironment_IsRestoredAndReported) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, tiny::plugin("tiny_rounds").c_str()), DFM_OK);
  expect_usual();
  EXPECT_TRUE(c.logged("tiny_rounds.so: loading it changed ")) << c.log.size();
}

TEST(Boundary, RefusedPlugin_LeavesTheEnvironmentToo) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, tiny::plugin("tiny_rounds").c_str()), DFM_OK);
  // the id is taken: refused after its constructors ran
  const std::string copy = tiny::folder("twice") + "/again.so";
  std::filesystem::copy_file(tiny::plugin("tiny_rounds"), copy);
  EXPECT_EQ(dfm_plugin_load(c.c, copy.c_str()), DFM_E_STATE);
  expect_usual();
}

TEST(Boundary, EvalThatChangesTheEnvironment_IsPutBackAndNamedOnce) {
  const char *const words[] = {"", "the rounding mode", "how denormal numbers are treated",
                               "which floating-point exceptions raise a signal", "the rounding mode"};
  for (int way = 1; way <= 4; ++way) {
#if !defined(__x86_64__)  // others need not raise signals
    if (way == 3) continue;
#endif
    Context c;
    ASSERT_EQ(dfm_plugin_load(c.c, tiny::plugin("tiny_rounds").c_str()), DFM_OK);
    const dfm_law law = c.open("rounds");
    c.log.clear();
    for (int k = 0; k < 3; ++k) {
      Batch b(5, {static_cast<double>(way)});
      b.out.state = nullptr;
      EXPECT_EQ(dfm_law_eval(law, &b.in, &b.out), way == 4 ? DFM_E_FATAL : DFM_OK) << dfm_last_error();
      expect_usual();
    }
    int said = 0;
    for (const tiny::Logged &l : c.log)
      said += l.text.find(std::string("org.tiny.rounds: eval changed ") + words[way]) != std::string::npos;
    EXPECT_EQ(said, 1) << way;
  }
}

// A host that computes with other settings on purpose keeps them.
TEST(Boundary, SettingsOfTheHost_StayItsOwn) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, tiny::plugin("tiny_rounds").c_str()), DFM_OK);
  const dfm_law law = c.open("rounds");
  std::fesetround(FE_DOWNWARD);
  Batch b(5, {1});
  EXPECT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK);
  EXPECT_EQ(fegetround(), FE_DOWNWARD);
  std::fesetround(FE_TONEAREST);
}

TEST(Boundary, RunningPlugin_CanBeQueried) {
  std::string seen;
  dfm_context_def def = dfm_context_def_default();
  def.user = &seen;
  const std::string none = tiny::folder("none");
  def.plugin_dir = none.c_str();
  def.log = [](void *user, int32_t, const char *text) {
    const char *what = nullptr, *who = dfm_plugin_running(&what);
    if (std::string(text) == "eval at work")
      *static_cast<std::string *>(user) = std::string(who ? who : "-") + " " + (what ? what : "-");
  };
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &context), DFM_OK);
  ASSERT_EQ(dfm_plugin_load(context, tiny::plugin("tiny_rounds").c_str()), DFM_OK);
  EXPECT_EQ(dfm_plugin_running(nullptr), nullptr);
  dfm_law law = 0;
  ASSERT_EQ(dfm_law_open(context, "rounds", &law), DFM_OK);
  Batch b(5, {0});
  EXPECT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK);
  EXPECT_EQ(seen, "org.tiny.rounds eval");
  EXPECT_EQ(dfm_plugin_running(nullptr), nullptr);
  dfm_context_destroy(context);
}

}  // namespace
