// Types as the library keeps them: of its own size whatever the plugin was built against, checked,
// found by name.
#include "tiny_support.h"

using tiny::Context;
using tiny::plugin;

namespace {

const dfm_type *type_of(const Context &c, const std::string &name) {
  const dfm_type *type = nullptr;
  EXPECT_EQ(dfm_law_type(c.open(name), &type), DFM_OK);
  return type;
}

TEST(Registry, OldStructs_ReadZeroPastTheirEnd) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_old").c_str()), DFM_OK) << dfm_last_error();
  const dfm_type *type = type_of(c, "old");
  const auto *law = static_cast<const dfm_friction *>(type->ops);
  EXPECT_EQ(type->size, sizeof(dfm_type));
  EXPECT_EQ(law->size, sizeof(dfm_friction));
  EXPECT_EQ(law->check, nullptr);
  EXPECT_EQ(law->prepare, nullptr);
  EXPECT_EQ(law->release, nullptr);
  ASSERT_EQ(type->nparam, 2u);
  EXPECT_EQ(type->param_size, sizeof(dfm_param));
  EXPECT_STREQ(type->params[1].key, "second");
  EXPECT_EQ(type->params[1].def, 2);
  EXPECT_EQ(type->params[0].names, nullptr);
}

TEST(Registry, NewStructs_LoseWhatThisLibraryDoesNotKnow) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_new").c_str()), DFM_OK) << dfm_last_error();
  const dfm_type *type = type_of(c, "new");
  EXPECT_EQ(type->size, sizeof(dfm_type));
  ASSERT_EQ(type->nparam, 2u);
  EXPECT_STREQ(type->params[1].key, "second");
  EXPECT_EQ(type->params[1].max, 10);
  const auto *law = static_cast<const dfm_friction *>(type->ops);
  ASSERT_EQ(law->nslot, 2u);
  EXPECT_EQ(law->slot_size, sizeof(dfm_slot));
  EXPECT_EQ(law->slots[1].width, 3u);
  EXPECT_EQ(law->slots[1].kind, uint32_t(DFM_SLOT_SCALAR));
}

// Rows of slots that are longer, from the table of the type (5 values) and from dfm_friction.state, whose
// parameters ask for the first slot alone.
TEST(Registry, LongerRowsOfSlots_AreCountedByTheirOwnSize) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_new").c_str()), DFM_OK) << dfm_last_error();
  const dfm_law law = c.open("new");
  for (const auto &[second, states] : {std::pair{2.0, 5u}, std::pair{0.0, 2u}}) {
    tiny::Batch b(3, {1, second}, states);
    for (uint32_t i = 0; i < states * b.stride; ++i) b.state_out[i] = -1;
    ASSERT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK) << dfm_last_error();
    for (uint32_t column = 0; column < states; ++column)
      EXPECT_EQ(b.state_out[column * b.stride + 2], column) << states;
  }
}

TEST(Registry, OldAndNewLaws_AreEvaluatedWithTheirParameters) {
  for (const std::string name : {"old", "new"}) {
    Context c;
    ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_" + name).c_str()), DFM_OK);
    const dfm_law law = c.open(name);
    const double five = 5;
    const dfm_param_value given{"second", &five, 1};
    const dfm_params params{sizeof params, 1, &given};
    double values[2];
    ASSERT_EQ(dfm_law_pack(law, &params, 2, values, nullptr), DFM_OK) << dfm_last_error();
    tiny::Batch b(3, {values[0], values[1]});
    ASSERT_EQ(dfm_law_eval(law, &b.in, &b.out), DFM_OK);
    EXPECT_EQ(b.ft[2], 1);
    EXPECT_EQ(b.ft[b.stride + 2], 5);
  }
}

TEST(Registry, BadSelfDescriptions_AreRefusedWithASentence) {
  const std::pair<const char *, const char *> cases[] = {{"bad_no_source", "lacks \"source\""},
                                                         {"bad_bad_id", "reverse-DNS"},
                                                         {"bad_bad_range", "\"first\": the range [0, 10]"},
                                                         {"bad_double_key", "\"first\" is listed twice"},
                                                         {"bad_foreign_slot", "slot 0"},
                                                         {"bad_foreign_need", "bits 0x40 of needs"},
                                                         {"bad_foreign_claim", "does not know (0x10000)"},
                                                         {"bad_foreign_flag", "parameter \"first\""},
                                                         {"bad_short_slot", "rows of 12 bytes, at least 16"},
                                                         {"bad_no_eval", "eval"},
                                                         {"bad_unknown_kind", "kind 4 is unknown"}};
  for (const auto &[file, part] : cases) {
    Context c;
    EXPECT_EQ(dfm_plugin_load(c.c, plugin(file).c_str()), DFM_E_UNSUPPORTED) << file;
    EXPECT_NE(std::string(dfm_last_error()).find(part), std::string::npos)
        << file << ": " << dfm_last_error();
    EXPECT_TRUE(c.ids().empty());
  }
}

TEST(Registry, ShortNameOrFullId_FindsTheType) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_law").c_str()), DFM_OK);
  EXPECT_EQ(type_of(c, "drag"), type_of(c, "org.tiny.drag"));
}

TEST(Registry, UnknownName_ListsWhatIsLoadedAndTheNearest) {
  Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_law").c_str()), DFM_OK);
  ASSERT_EQ(dfm_plugin_load(c.c, plugin("tiny_old").c_str()), DFM_OK);
  dfm_law law = 0;
  EXPECT_EQ(dfm_law_open(c.c, "darg", &law), DFM_E_UNSUPPORTED);
  EXPECT_STREQ(dfm_last_error(), "no law \"darg\" is loaded; did you mean \"drag\"?; loaded: drag, old");
  // a part of a name is nearer to that name than a short one with few letters in common
  EXPECT_EQ(dfm_law_open(c.c, "tiny.d", &law), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("did you mean \"org.tiny.drag\""), std::string::npos)
      << dfm_last_error();
  Context empty;
  EXPECT_EQ(dfm_law_open(empty.c, "coulomb", &law), DFM_E_UNSUPPORTED);
  EXPECT_NE(std::string(dfm_last_error()).find("no plugin with a law is loaded"), std::string::npos)
      << dfm_last_error();
}

TEST(Registry, Visit_GoesByKindAndId) {
  Context c;
  for (const char *name : {"tiny_throw", "tiny_old", "tiny_law"})
    ASSERT_EQ(dfm_plugin_load(c.c, plugin(name).c_str()), DFM_OK);
  EXPECT_EQ(c.ids(), (std::vector<std::string>{"org.tiny.checks", "org.tiny.discards", "org.tiny.drag",
                                               "org.tiny.fails", "org.tiny.guarded", "org.tiny.old",
                                               "org.tiny.throws"}));
}

}  // namespace
