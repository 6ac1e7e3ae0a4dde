// dfm_law_*: handles, what is asked of the caller, what is done with a plugin that misbehaves, what
// the host lends.
#include <algorithm>
#include <atomic>
#include <thread>

#include "tiny_support.h"

using tiny::Batch;
using tiny::Context;

namespace {

bool says(const std::string &part) { return std::string(dfm_last_error()).find(part) != std::string::npos; }

struct Law : testing::Test {
  Context c;
  dfm_law law(const std::string &file, const std::string &name) {
    EXPECT_EQ(dfm_plugin_load(c.c, tiny::plugin(file).c_str()), DFM_OK) << dfm_last_error();
    return c.open(name);
  }
};

TEST_F(Law, OpenByPath_LoadsTheFile) {
  const dfm_law law = c.open(tiny::plugin("tiny_law"));
  const dfm_type *type = nullptr;
  ASSERT_EQ(dfm_law_type(law, &type), DFM_OK);
  EXPECT_STREQ(type->id, "org.tiny.drag");
  EXPECT_EQ(dfm_law_close(law), DFM_OK);
  EXPECT_EQ(dfm_law_close(law), DFM_E_HANDLE);
  EXPECT_EQ(dfm_law_type(law, &type), DFM_E_HANDLE);
  EXPECT_TRUE(says("law handle")) << dfm_last_error();
}

TEST_F(Law, OpenByPathOfSeveral_RequiresAnId) {
  dfm_law law = 0;
  EXPECT_EQ(dfm_law_open(c.c, tiny::plugin("tiny_throw").c_str(), &law), DFM_E_ARG);
  EXPECT_TRUE(says("org.tiny.fails, org.tiny.guarded")) << dfm_last_error();
  EXPECT_EQ(dfm_law_open(c.c, "/nowhere/law.so", &law), DFM_E_IO);
  EXPECT_EQ(dfm_law_open(c.c, "law.so", &law), DFM_E_IO);
  EXPECT_EQ(dfm_law_open(c.c, nullptr, &law), DFM_E_ARG);
}

TEST(LawHandles, DestroyedContext_LeavesStaleHandles) {
  dfm_law law = 0;
  {
    Context c;
    law = c.open(tiny::plugin("tiny_host"));
    Batch b(8, {3});
    ASSERT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK);
  }
  const dfm_type *type = nullptr;
  EXPECT_EQ(dfm_law_type(law, &type), DFM_E_HANDLE);
}

TEST_F(Law, ThrowingLaw_FailsAndTheHostContinues) {
  const dfm_law bare = law("tiny_throw", "throws");
  Batch b(4);
  EXPECT_EQ(dfm_law_eval(bare, &b.in, &b.out), DFM_E_FATAL);
  EXPECT_TRUE(says("org.tiny.throws")) << dfm_last_error();
  EXPECT_TRUE(c.logged("org.tiny.throws: eval threw"));
  EXPECT_EQ(dfm_law_eval(c.open("guarded"), &b.in, &b.out), DFM_E_FATAL);
  EXPECT_EQ(dfm_law_eval(c.open("fails"), &b.in, &b.out), DFM_E_FATAL);
  EXPECT_TRUE(c.logged("org.tiny.fails: eval returned DFM_E_FATAL"));
  EXPECT_EQ(dfm_law_eval(c.open("discards"), &b.in, &b.out), DFM_DISCARD);
}

TEST_F(Law, ValueThatIsNotFinite_DiscardsTheBatchUnderTheLawsName) {
  const dfm_law spoilt = law("tiny_nan", "nan");
  const double kLimit = 3, kNan = 1, kInfinity = 2;
  for (double where = 0; where < 6; ++where)
    for (double value = 0; value < 3; ++value) {
      c.log.clear();
      Batch b(5, {where, value}, 1);
      // an infinite limit means: none
      const bool fine = value == 0 || (where == kLimit && value == kInfinity);
      EXPECT_EQ(dfm_law_eval(spoilt, &b.in, &b.out), fine ? DFM_OK : DFM_DISCARD) << where << " " << value;
      EXPECT_EQ(c.logged("org.tiny.nan"), !fine) << where << " " << value;
    }
  Batch unwanted(5, {0, kNan}, 1);
  unwanted.out.ft = nullptr;
  EXPECT_EQ(dfm_law_eval(spoilt, &unwanted.in, &unwanted.out), DFM_OK) << "what is not wanted is not judged";
}

TEST_F(Law, MissingInput_IsNamed) {
  const dfm_law drag = law("tiny_law", "drag");
  Batch b(4, {2, 0, 0, 0, 4});
  b.in.vt = nullptr;
  EXPECT_EQ(dfm_law_eval(drag, &b.in, &b.out), DFM_E_ARG);
  EXPECT_TRUE(says("needs vt")) << dfm_last_error();
  b = Batch(4, {2, 0, 0, 0, 4});
  b.in.params = nullptr;
  EXPECT_EQ(dfm_law_eval(drag, &b.in, &b.out), DFM_E_ARG);
  b = Batch(4, {2, 0, 0, 0, 4});
  b.in.stride = 3;
  EXPECT_EQ(dfm_law_eval(drag, &b.in, &b.out), DFM_E_ARG);
  b = Batch(4, {2, 0, 0, 0, 4});
  b.in.size = 4;
  EXPECT_EQ(dfm_law_eval(drag, &b.in, &b.out), DFM_E_ARG);
  EXPECT_TRUE(says("size")) << dfm_last_error();
  EXPECT_EQ(dfm_law_eval(drag, nullptr, &b.out), DFM_E_ARG);
  b = Batch(4, {2, 0, 0, 0, 4});
  b.in.n = 0;
  b.in.vt = b.vt;
  EXPECT_EQ(dfm_law_eval(drag, &b.in, &b.out), DFM_OK);
}

TEST_F(Law, PlainArraysOfAnyStride_AreCopied) {
  const dfm_law drag = law("tiny_law", "drag");
  std::vector<double> memory(64, 7.0);
  double *vt = memory.data() + 1, *ft = memory.data() + 21;
  for (int k = 0; k < 10; ++k) vt[k] = k;
  std::vector<double> params{2, 0, 0, 0, 4};
  dfm_friction_in in{};
  in.size = sizeof in;
  in.n = 5;
  in.stride = 5;
  in.params = params.data();
  in.vt = vt;
  dfm_friction_out out{};
  out.size = sizeof out;
  out.ft = ft;
  ASSERT_EQ(dfm_law_eval(drag, &in, &out), DFM_OK) << dfm_last_error();
  for (int k = 0; k < 10; ++k) EXPECT_EQ(ft[k], -2.0 * k);
  EXPECT_EQ(ft[-1], 7);
  EXPECT_EQ(ft[10], 7);
}

TEST_F(Law, HostServices_ReachThePlugin) {
  const dfm_law host = law("tiny_host", "host");
  for (double factor : {3.0, 3.0, 4.0}) {
    Batch b(1000, {factor});
    for (uint32_t i = 0; i < b.n; ++i) b.fn[i] = i;
    for (int repeat = 0; repeat < 3; ++repeat) {
      ASSERT_EQ(dfm_law_eval(host, &b.in, &b.out), DFM_OK) << dfm_last_error();
      for (uint32_t i = 0; i < b.n; ++i) ASSERT_EQ(b.ft[i], 2.0 * i);
      EXPECT_EQ(b.ft[b.stride], 2 * factor);
    }
  }
  const auto count = [&](const char *text) {
    return std::count_if(c.log.begin(), c.log.end(), [&](const tiny::Logged &l) { return l.text == text; });
  };
  EXPECT_EQ(count("prepared"), 2) << "once per set of parameters";
  EXPECT_EQ(count("released"), 1);
  EXPECT_EQ(dfm_law_close(host), DFM_OK);
  EXPECT_EQ(count("released"), 2);
}

TEST_F(Law, FromManyThreads_EachHasItsOwnScratch) {
  const dfm_law host = law("tiny_host", "host");
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      Batch b(257, {3.0});
      for (uint32_t i = 0; i < b.n; ++i) b.fn[i] = i + 1000 * t;
      for (int repeat = 0; repeat < 50; ++repeat) {
        if (dfm_law_eval(host, &b.in, &b.out) != DFM_OK) ++wrong;
        for (uint32_t i = 0; i < b.n; ++i) wrong += b.ft[i] != 2.0 * (i + 1000 * t);
      }
    });
  for (auto &thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

// Memory goes through the hooks, all of it comes back, and a refusal is an error code.
struct Counting { size_t live = 0, calls = 0, fail_at = ~size_t(0); };

dfm_context_def counting(Counting &count, const std::string &dir) {
  dfm_context_def def = dfm_context_def_default();
  def.user = &count;
  def.plugin_dir = dir.c_str();
  def.alloc = [](void *user, size_t bytes, size_t align) -> void * {
    Counting &n = *static_cast<Counting *>(user);
    if (n.calls++ == n.fail_at) return nullptr;
    n.live += bytes;
    return std::aligned_alloc(align < 8 ? 8 : align, (bytes + align - 1) / align * align);
  };
  def.release = [](void *user, void *p, size_t bytes, size_t) {
    static_cast<Counting *>(user)->live -= bytes;
    std::free(p);
  };
  return def;
}

TEST(LawMemory, EveryRefusedAllocation_IsAnErrorAndLosesNothing) {
  const std::string dir = tiny::folder("memory");
  int refused = 0;
  for (size_t fail_at = 0; fail_at < 12; ++fail_at) {
    Counting count;
    count.fail_at = fail_at;
    const dfm_context_def def = counting(count, dir);
    dfm_context *context = nullptr;
    ASSERT_EQ(dfm_context_create(&def, &context), DFM_OK);
    dfm_law law = 0;
    dfm_status status = dfm_law_open(context, tiny::plugin("tiny_host").c_str(), &law);
    Batch b(100, {3.0});
    if (status == DFM_OK) status = dfm_law_eval(law, &b.in, &b.out);
    if (status == DFM_OK) {
      EXPECT_EQ(b.ft[99], 2.0) << fail_at;
    } else {
      EXPECT_TRUE(status == DFM_E_NOMEM || status == DFM_E_FATAL) << dfm_status_name(status);
    }
    refused += status != DFM_OK;
    dfm_context_destroy(context);
    EXPECT_EQ(count.live, 0u) << fail_at;
  }
  EXPECT_GE(refused, 3) << "prepare and two pieces of scratch need memory";
}

TEST(LawMemory, SettledEvaluation_AllocatesNothing) {
  Counting count;
  const std::string dir = tiny::folder("settled");
  const dfm_context_def def = counting(count, dir);
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(&def, &context), DFM_OK);
  dfm_law law = 0;
  ASSERT_EQ(dfm_law_open(context, tiny::plugin("tiny_host").c_str(), &law), DFM_OK);
  Batch b(100, {3.0});
  for (int i = 0; i < 3; ++i) ASSERT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK);
  const size_t before = count.calls;
  for (int i = 0; i < 100; ++i) ASSERT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK);
  EXPECT_EQ(count.calls, before);
  dfm_context_destroy(context);
}

TEST(Base, VersionAndStatusNames_AreAsDocumented) {
  int major = -1, minor = -1, patch = -1;
  EXPECT_STREQ(dfm_version(&major, &minor, &patch), "0.1.0");
  EXPECT_EQ(major * 10000 + minor * 100 + patch, 100);
  EXPECT_STREQ(dfm_version(nullptr, nullptr, nullptr), "0.1.0");
  for (int s = DFM_E_BUSY; s <= DFM_DISCARD; ++s)
    EXPECT_NE(std::string(dfm_status_name(s)), "unknown status") << s;
  EXPECT_STREQ(dfm_status_name(12345), "unknown status");
}

TEST(Base, HalfGivenHooks_AreRefused) {
  dfm_context_def def = dfm_context_def_default();
  def.alloc = [](void *, size_t, size_t) -> void * { return nullptr; };
  dfm_context *context = nullptr;
  EXPECT_EQ(dfm_context_create(&def, &context), DFM_E_ARG);
  EXPECT_TRUE(says("release is missing")) << dfm_last_error();
  def = dfm_context_def_default();
  def.size = 3;
  EXPECT_EQ(dfm_context_create(&def, &context), DFM_E_ARG);
  def = dfm_context_def_default();
  def.threads = 5000;
  EXPECT_EQ(dfm_context_create(&def, &context), DFM_E_ARG);
  EXPECT_EQ(dfm_context_create(nullptr, nullptr), DFM_E_ARG);
  dfm_context_destroy(nullptr);
}

}  // namespace
