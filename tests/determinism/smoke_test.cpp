// The one hash that is recorded: that of ten small bodies in a box, the same number for gcc and clang, with
// optimization or without, on every processor. A change of the method changes it; the commit says why.
// Between builds all scenes are compared: `PROGRAM --hashes` prints a line for each.
#include <cstring>

#include "scenes.h"
#include "support.h"

int main(int argc, char **argv) {
  if (argc == 2 && std::strcmp(argv[1], "--hashes") == 0) {
    for (const scenes::Scene &s : scenes::all)
      std::printf("%s,%d,%s\n", s.name, s.steps, scenes::hex(scenes::run(s)).c_str());
    return testing::UnitTest::GetInstance()->ad_hoc_test_result().Failed();
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}

TEST(Smoke, StateHash_IsTheRecordedOne) {
  const scenes::Scene scene = {"ten_in_a_box", [](dfm_context *c) { return scenes::ten_in_a_box(c); }, 80};
  EXPECT_EQ(scenes::hex(scenes::run(scene)), "f2db41443b7f564e");
}
