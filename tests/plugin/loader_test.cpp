// Discovery: what is loaded, from where, and the reason for everything that is not.
#include <atomic>
#include <chrono>
#include <fstream>
#include <thread>

#include "tiny_support.h"

namespace fs = std::filesystem;
using tiny::Context;
using tiny::folder;
using tiny::plugin;

namespace {

using Ids = std::vector<std::string>;

dfm_status load(const Context &c, const std::string &path) { return dfm_plugin_load(c.c, path.c_str()); }
bool says(const std::string &part) { return std::string(dfm_last_error()).find(part) != std::string::npos; }

struct Environment {
  std::string name, before;
  bool had;
  Environment(const char *n, const std::string &value)
      : name(n), before(std::getenv(n) ? std::getenv(n) : ""), had(std::getenv(n)) {
    setenv(n, value.c_str(), 1);
  }
  ~Environment() { had ? setenv(name.c_str(), before.c_str(), 1) : unsetenv(name.c_str()); }
};

// A plugin that fills statics of its own when it is let in, and counts.
std::atomic<uint32_t> inside{0}, together{0};
uint32_t entered = 0, left = 0;  // without a lock: who runs two of these at once spoils them
void pass(uint32_t &count) {
  if (inside.fetch_add(1) != 0) ++together;
  const uint32_t before = count;
  std::this_thread::sleep_for(std::chrono::microseconds(200));
  count = before + 1;
  inside.fetch_sub(1);
}
const dfm_plugin *counted_entry(const dfm_host *host, uint32_t, uint32_t) {
  if (!DFM_ABI_OK(host)) return nullptr;
  static const dfm_friction ops = {
      sizeof(dfm_friction),
      0,
      0,
      0,
      nullptr,
      [](const dfm_friction_in *, dfm_friction_out *) { return dfm_status{DFM_OK}; },
      nullptr,
      nullptr,
      nullptr,
      nullptr,
      0,
      0,
      nullptr};
  static const dfm_type type = {sizeof(dfm_type),
                                DFM_KIND_FRICTION,
                                "test.counted",
                                "counted",
                                "1",
                                "MIT",
                                "none",
                                nullptr,
                                0,
                                sizeof(dfm_param),
                                nullptr,
                                &ops};
  static const dfm_type *const types[] = {&type};
  static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, [] { pass(left); }};
  pass(entered);
  return &plugin;
}

TEST(Loader, ContextsOnSeveralThreads_LetPluginsInAndOutOneAtATime) {
  constexpr uint32_t kThreads = 4, kContexts = 20;
  entered = left = 0;
  const std::string empty = folder("none_for_threads");
  std::vector<std::thread> threads;
  for (uint32_t k = 0; k < kThreads; ++k)
    threads.emplace_back([&] {
      for (uint32_t i = 0; i < kContexts; ++i) {
        dfm_context_def def = dfm_context_def_default();
        def.plugin_dir = empty.c_str();
        dfm_context *c = nullptr;
        EXPECT_EQ(dfm_context_create(&def, &c), DFM_OK);
        EXPECT_EQ(dfm_plugin_register_static(c, counted_entry, "counted"), DFM_OK);
        EXPECT_EQ(dfm_plugin_load(c, plugin("tiny_law").c_str()), DFM_OK);
        dfm_context_destroy(c);
      }
    });
  for (std::thread &t : threads) t.join();
  EXPECT_EQ(together, 0u);
  EXPECT_EQ(entered, kThreads * kContexts);
  EXPECT_EQ(left, kThreads * kContexts);
}

TEST(Loader, ExplicitPath_LoadsTheFile) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_law")), DFM_OK) << dfm_last_error();
  EXPECT_EQ(c.ids(), Ids{"org.tiny.drag"});
  EXPECT_EQ(c.file_of("org.tiny.drag"), plugin("tiny_law"));
}

TEST(Loader, TheSameFileTwice_IsHarmless) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_law")), DFM_OK);
  EXPECT_EQ(load(c, plugin("tiny_law")), DFM_OK);
  EXPECT_EQ(load(c, std::string(DEFORM_BINARY_DIR) + "/lib/../lib/tiny/tiny_law.so"), DFM_OK);
  EXPECT_EQ(c.ids().size(), 1u);
}

TEST(Loader, NoSuchFile_IsAnIoErrorWithItsName) {
  Context c;
  EXPECT_EQ(load(c, "/nowhere/x.so"), DFM_E_IO);
  EXPECT_TRUE(says("/nowhere/x.so") && says("No such file")) << dfm_last_error();
  EXPECT_EQ(dfm_plugin_load(c.c, ""), DFM_E_ARG);
  EXPECT_EQ(dfm_plugin_load(nullptr, "x.so"), DFM_E_ARG);
  uint32_t n = 7;
  EXPECT_EQ(dfm_plugin_scan(c.c, "/nowhere", &n), DFM_E_IO);
  EXPECT_EQ(n, 7u);
}

TEST(Loader, SymbolicLink_IsFollowed) {
  const std::string dir = folder("links");
  fs::create_symlink(plugin("tiny_law"), dir + "/a.so");
  fs::create_symlink(dir + "/a.so", dir + "/b.so");
  fs::create_symlink("/nowhere/c.so", dir + "/c.so");
  Context c;
  uint32_t loaded = 0;
  EXPECT_EQ(dfm_plugin_scan(c.c, dir.c_str(), &loaded), DFM_OK);
  EXPECT_EQ(loaded, 1u);
  EXPECT_EQ(c.file_of("org.tiny.drag"), dir + "/a.so");
  EXPECT_NE(c.reason("b.so").find("link to a plugin that is loaded"), std::string::npos) << c.reason("b.so");
  EXPECT_NE(c.reason("c.so").find("No such file"), std::string::npos) << c.reason("c.so");
}

TEST(Loader, ForeignAbi_IsRefusedByTheLibrary) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_foreign")), DFM_E_UNSUPPORTED);
  EXPECT_TRUE(says("ABI 7 draft 3") && says("this library has ABI 1 draft 0") && says("rebuild"))
      << dfm_last_error();
  EXPECT_TRUE(c.ids().empty());
}

TEST(Loader, ForeignHost_IsRefusedByThePluginWithItsOwnWords) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_refuse")), DFM_E_UNSUPPORTED);
  EXPECT_TRUE(says("refuses this library") && says("built for ABI 1 draft 99")) << dfm_last_error();
  EXPECT_EQ(load(c, plugin("tiny_silent")), DFM_E_UNSUPPORTED);
  EXPECT_TRUE(says("which has plugin ABI 1") && says("gave no reason") && says("if it was built for a draft"))
      << dfm_last_error();
}

TEST(Loader, PluginOfADraft_IsRefusedInOneSentenceWithWhatToDo) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_draft")), DFM_E_UNSUPPORTED);
  EXPECT_EQ(std::string(dfm_last_error()),
            plugin("tiny_draft") +
                ": built for a draft of the plugin ABI (ABI 0 draft 1), which no library has accepted "
                "since ABI 1; rebuild it against this library's deform/plugin.h");
}

// A plugin built with the header of the draft sees that this host is not of the draft.
TEST(Loader, HostOfTheLibrary_ReportsItsAbis) {
  Context c;
  ASSERT_EQ(load(c, plugin("tiny_host")), DFM_OK);
  dfm_host future{};
  const auto ok = [&](uint32_t abi, uint32_t draft, uint32_t min) {
    future.abi = abi;
    future.abi_draft = draft;
    future.abi_min = min;
    return DFM_ABI_OK(&future);
  };
  EXPECT_TRUE(ok(1, 0, 1));
  EXPECT_TRUE(ok(1, 0, 0)) << "abi_min was not filled in";
  EXPECT_TRUE(ok(2, 0, 1));
  EXPECT_TRUE(ok(3, 4, 1)) << "its newest ABI is a draft, ours is not";
  EXPECT_FALSE(ok(0, 1, 0)) << "a host of a draft";
  EXPECT_FALSE(ok(1, 5, 1));
  EXPECT_FALSE(ok(2, 0, 2));
  EXPECT_FALSE(ok(2, 0, 0));
}

TEST(Loader, LibraryWithoutEntry_IsRefusedBeforeItsConstructorsRun) {
  unsetenv("TINY_NOENTRY_RAN");
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_noentry")), DFM_E_UNSUPPORTED);
  EXPECT_TRUE(says("no symbol dfm_plugin_entry")) << dfm_last_error();
  EXPECT_EQ(std::getenv("TINY_NOENTRY_RAN"), nullptr);
}

TEST(Loader, TakenId_IsAStateErrorThatNamesTheHolder) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_law")), DFM_OK);
  EXPECT_EQ(load(c, plugin("tiny_taken")), DFM_E_STATE);
  EXPECT_TRUE(says("org.tiny.drag") && says("tiny_law.so")) << dfm_last_error();
  EXPECT_EQ(c.ids().size(), 1u);
}

TEST(Loader, ThrowingEntry_LeavesTheHostStanding) {
  Context c;
  EXPECT_EQ(load(c, plugin("tiny_throw_entry")), DFM_E_UNSUPPORTED);
  EXPECT_TRUE(says("threw an exception")) << dfm_last_error();
  EXPECT_EQ(load(c, plugin("tiny_law")), DFM_OK);
}

TEST(Loader, TruncatedFile_IsRefusedAtEveryLength) {
  const std::string whole = test::read_file(plugin("tiny_law")), path = folder("cut") + "/cut.so";
  ASSERT_GT(whole.size(), 4096u);
  Context c;
  for (size_t n : {size_t(0), size_t(1), size_t(4), size_t(63), size_t(64), size_t(200), size_t(1000),
                   size_t(4096), whole.size() / 2}) {
    test::write_file(path, whole.substr(0, n));
    EXPECT_EQ(load(c, path), DFM_E_UNSUPPORTED) << n;
  }
  EXPECT_TRUE(says("cut short")) << dfm_last_error();
  EXPECT_TRUE(c.ids().empty());
}

TEST(Loader, AnyByteOfTheHeadersChanged_DoesNotEndTheProcess) {
  const std::string whole = test::read_file(plugin("tiny_law")), path = folder("flip") + "/flip.so";
  Context c;
  for (size_t at = 4; at < 64; ++at) {
    std::string spoilt = whole;
    spoilt[at] = static_cast<char>(spoilt[at] ^ 0x55);
    if (at >= 24 && at < 32) continue;  // the entry address, which a library does not use
    test::write_file(path, spoilt);
    dfm_plugin_load(c.c, path.c_str());
    std::filesystem::remove(path);
  }
  SUCCEED();
}

TEST(Loader, Scan_TakesPluginsInNameOrderAndGivesAReasonForTheRest) {
  const std::string dir = folder("scan");
  for (const char *name :
       {"tiny_taken", "tiny_law", "tiny_old", "tiny_foreign", "tiny_noentry", "tiny_throw_entry"})
    fs::copy_file(plugin(name), dir + "/" + name + ".so");
  test::write_file(dir + "/text.so", "this is no library\n");
  test::write_file(dir + "/readme.txt", "text");
  fs::create_directory(dir + "/more");
  Context c(dir);
  EXPECT_EQ(c.ids(), (Ids{"org.tiny.drag", "org.tiny.old"}));
  EXPECT_EQ(c.file_of("org.tiny.drag"), dir + "/tiny_law.so");  // before tiny_taken.so
  EXPECT_NE(c.reason("tiny_taken.so").find("is taken by"), std::string::npos);
  EXPECT_NE(c.reason("tiny_taken.so").find("into a new context"), std::string::npos);  // nothing unloads
  EXPECT_NE(c.reason("tiny_foreign.so").find("ABI 7"), std::string::npos);
  EXPECT_NE(c.reason("tiny_noentry.so").find("dfm_plugin_entry"), std::string::npos);
  EXPECT_NE(c.reason("tiny_throw_entry.so").find("threw"), std::string::npos);
  EXPECT_NE(c.reason("text.so").find("not a shared library"), std::string::npos);
  EXPECT_NE(c.reason("readme.txt").find(".so"), std::string::npos);
  EXPECT_NE(c.reason("more").find("directory"), std::string::npos);
  EXPECT_EQ(c.reason("tiny_old.so"), "");
}

TEST(Loader, WrongPluginDirectory_FailsTheContext) {
  dfm_context_def def = dfm_context_def_default();
  def.plugin_dir = "/nowhere/plugins";
  dfm_context *context = nullptr;
  EXPECT_EQ(dfm_context_create(&def, &context), DFM_E_ARG);
  EXPECT_EQ(context, nullptr);
  EXPECT_TRUE(says("/nowhere/plugins")) << dfm_last_error();
}

TEST(Loader, PluginPath_ComesBeforeTheLibrarysOwnDirectory) {
  const std::string first = folder("path_first"), second = folder("path_second");
  fs::copy_file(plugin("tiny_law"), first + "/x.so");
  fs::copy_file(plugin("tiny_taken"), second + "/x.so");
  const Environment path("DEFORM_PLUGIN_PATH", first + ":/nowhere::" + second);
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(nullptr, &context), DFM_OK);
  Context probe;
  std::swap(probe.c, context);
  EXPECT_EQ(probe.file_of("org.tiny.drag"), first + "/x.so");
  EXPECT_NE(probe.reason("path_second/x.so").find("is taken by"), std::string::npos);
  EXPECT_NE(probe.reason("/nowhere").find("no such directory"), std::string::npos);
  EXPECT_NE(probe.file_of("org.deform.coulomb").find(DEFORM_PLUGIN_DIR), std::string::npos)
      << probe.file_of("org.deform.coulomb");
  std::swap(probe.c, context);
  dfm_context_destroy(context);
}

// The author of a plugin reads why its law is missing, not only that it is.
TEST(Loader, SceneWithALawOfASkippedFile_SaysWhyItWasSkipped) {
  const std::string dir = folder("path_skipped");
  test::write_file(dir + "/org.tiny.absent.so", "this is no library\n");
  const Environment path("DEFORM_PLUGIN_PATH", "/nowhere:" + dir);
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(nullptr, &context), DFM_OK);
  dfm_world world = 0;
  for (const char *law : {"org.tiny.absent", "org.tiny.other"}) {
    test::write_file(dir + "/scene.json",
                     R"({"format": "deform-scene", "version": 1, "time": {"duration": 1},
                         "contact": {"friction": [{"between": ["*", "*"], "law": ")" +
                         std::string(law) + "\"}]}}");
    EXPECT_EQ(dfm_scene_load(context, (dir + "/scene.json").c_str(), &world), DFM_E_UNSUPPORTED);
    EXPECT_TRUE(says("no loaded plugin offers the law \"" + std::string(law) + "\"")) << dfm_last_error();
    // the file that speaks of it, else the first
    EXPECT_TRUE(
        says(std::string("; not loaded: ") + (law == std::string("org.tiny.absent") ? dir : "/nowhere")))
        << dfm_last_error();
  }
  dfm_context_destroy(context);
}

// The variable is named to who has a plugin in a folder of his own and forgot it.
TEST(Loader, SceneWithAModelOfNoFolder_NamesTheVariable) {
  unsetenv("DEFORM_PLUGIN_PATH");
  const std::string dir = folder("path_unset");
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(nullptr, &context), DFM_OK);
  dfm_world world = 0;
  const auto refused_with = [&](const std::string &model) {
    test::write_file(dir + "/scene.json",
                     R"({"format": "deform-scene", "version": 1, "time": {"duration": 1},
                         "bodies": [{"name": "b", "mesh": {"make": "beam", "size": [1, 1, 1]},
                                     "model": {"type": ")" +
                         model + R"("}}]})");
    EXPECT_EQ(dfm_scene_load(context, (dir + "/scene.json").c_str(), &world), DFM_E_UNSUPPORTED);
    return says("set DEFORM_PLUGIN_PATH to the folder of its plugin");
  };
  EXPECT_TRUE(refused_with("com.example.mymodel")) << dfm_last_error();
  EXPECT_FALSE(refused_with("mms")) << dfm_last_error();
  dfm_context_destroy(context);
}

TEST(Loader, WithoutAnySetting_FindsThePluginsOfTheBuild) {
  unsetenv("DEFORM_PLUGIN_PATH");
  dfm_context *context = nullptr;
  ASSERT_EQ(dfm_context_create(nullptr, &context), DFM_OK);
  dfm_law law = 0;
  EXPECT_EQ(dfm_law_open(context, "coulomb", &law), DFM_OK) << dfm_last_error();
  EXPECT_EQ(dfm_law_open(context, "org.deform.none", &law), DFM_OK) << dfm_last_error();
  dfm_context_destroy(context);
}

TEST(Loader, TwoContexts_ShareAFileButNotTheirTypes) {
  Context a, b;
  EXPECT_EQ(load(a, plugin("tiny_host")), DFM_OK);
  EXPECT_EQ(load(b, plugin("tiny_host")), DFM_OK);
  const dfm_type *ta = nullptr, *tb = nullptr;
  dfm_law_type(a.open("host"), &ta);
  dfm_law_type(b.open("host"), &tb);
  EXPECT_NE(ta, tb);
}

TEST(Loader, LoadAndDestroy_CanBeRepeated) {
  for (int i = 0; i < 100; ++i) {
    Context c;
    ASSERT_EQ(load(c, plugin("tiny_host")), DFM_OK);
  }
}

}  // namespace
