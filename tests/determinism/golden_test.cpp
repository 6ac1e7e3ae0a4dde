// The hash of each scene is the same number for gcc and clang, with and without optimization, on every
// processor: golden.csv holds it. A change of the method changes it: look at why, then write it anew with
// DEFORM_WRITE_GOLDEN=1.
#include <cstdlib>

#include "scenes.h"
#include "support.h"

TEST(Golden, StateHash_IsTheStoredOne) {
  const std::string path = std::string(DEFORM_SOURCE_DIR) + "/tests/determinism/golden.csv";
  std::string now = "scene,steps,hash\n";
  for (const scenes::Scene &s : scenes::all)
    now += std::string(s.name) + "," + std::to_string(s.steps) + "," + scenes::hex(scenes::run(s)) + "\n";
  std::printf("%s", now.c_str());
  if (std::getenv("DEFORM_WRITE_GOLDEN")) test::write_file(path, now);
  EXPECT_EQ(now, test::read_file(path));
}
