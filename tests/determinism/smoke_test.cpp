// The one hash that is recorded: that of ten small bodies in a box, the same number for gcc and clang, with
// optimization or without, on every processor. A change of the method changes it; the commit says why.
#include "scenes.h"
#include "support.h"

TEST(Smoke, StateHash_IsTheRecordedOne) {
  const scenes::Scene scene = {"ten_in_a_box", [](dfm_context *c) { return scenes::ten_in_a_box(c); }, 80};
  EXPECT_EQ(scenes::hex(scenes::run(scene)), "a82cd54fbf5c7a25");
}
