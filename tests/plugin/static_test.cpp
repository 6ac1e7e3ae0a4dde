// A plugin linked into the program (tiny_law.c built with -DDFM_STATIC_PLUGIN=tiny_law) and registered by it.
#include "tiny_support.h"

extern "C" const dfm_plugin *dfm_plugin_entry_tiny_law(const dfm_host *host, uint32_t host_abi,
                                                       uint32_t host_abi_min);

namespace {

TEST(StaticPlugin, Registered_IsFoundLikeALoadedOne) {
  tiny::Context c;
  ASSERT_EQ(dfm_plugin_register_static(c.c, dfm_plugin_entry_tiny_law, "tiny_law"), DFM_OK)
      << dfm_last_error();
  ASSERT_EQ(dfm_plugin_register_static(c.c, dfm_plugin_entry_tiny_law, "tiny_law"), DFM_OK)
      << "twice is harmless";
  EXPECT_EQ(c.file_of("org.tiny.drag"), "static:tiny_law");
  tiny::Batch b(1, {2, 0, 0, 0, 4});
  b.vt[0] = 3;
  ASSERT_EQ(dfm_law_eval(c.open("drag"), &b.in, &b.out), DFM_OK) << dfm_last_error();
  EXPECT_EQ(b.ft[0], -6);
  EXPECT_TRUE(std::isinf(b.limit[0]));
}

TEST(StaticPlugin, IdTakenByAFile_IsAStateError) {
  tiny::Context c;
  ASSERT_EQ(dfm_plugin_load(c.c, tiny::plugin("tiny_taken").c_str()), DFM_OK);
  EXPECT_EQ(dfm_plugin_register_static(c.c, dfm_plugin_entry_tiny_law, "tiny_law"), DFM_E_STATE);
}

TEST(StaticPlugin, MissingArguments_AreRefused) {
  tiny::Context c;
  EXPECT_EQ(dfm_plugin_register_static(c.c, nullptr, "x"), DFM_E_ARG);
  EXPECT_EQ(dfm_plugin_register_static(c.c, dfm_plugin_entry_tiny_law, ""), DFM_E_ARG);
}

}  // namespace
