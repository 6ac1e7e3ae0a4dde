// Every scene is cut in the middle of its contact: a new process takes the snapshot and ends with the same
// bits. The program runs itself as `PROGRAM --continue SCENE FILE STEPS THREADS`.
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "scenes.h"
#include "support.h"

int main(int argc, char **argv) {
  if (argc == 6 && std::strcmp(argv[1], "--continue") == 0) {
    const test::Context c{uint32_t(std::atoi(argv[5]))};
    for (const scenes::Scene &s : scenes::all) {
      if (s.name != std::string(argv[2])) continue;
      const dfm_world w = s.build(c);
      const std::string data = test::read_file(argv[3]);
      if (dfm_world_restore(w, data.data(), data.size()) != DFM_OK) {
        std::fprintf(stderr, "%s\n", dfm_last_error());
        return 1;
      }
      scenes::advance(w, std::atoi(argv[4]));
      std::printf("%s\n", scenes::hex(dfm_world_hash(w)).c_str());
    }
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}

namespace {

class Process : public testing::TestWithParam<scenes::Scene> {};
INSTANTIATE_TEST_SUITE_P(Scenes, Process, testing::ValuesIn(scenes::all),
                         [](const auto &i) { return std::string(i.param.name); });

TEST_P(Process, ThatRestoresASnapshotTakenInContact_EndsWithTheSameBits) {
  const scenes::Scene s = GetParam();
  const std::string name = s.name;
  const bool early = name == "ball_on_floor" || name == "shape_matching_ball";  // they bounce early
  int before = s.steps * (early ? 1 : 6) / 10;
  const test::Context c;
  const dfm_world w = s.build(c);
  scenes::advance(w, before);
  // what bounces is cut while it touches
  for (; test::stats(w).contacts == 0 && before < s.steps * 9 / 10; ++before) scenes::advance(w, 1);
  const int after = s.steps - before;
  EXPECT_GT(test::stats(w).contacts, 0u) << "nothing touches: the snapshot shows little";
  EXPECT_EQ(test::stats(w).asleep > 0, s.name == std::string("woken"));
  if (s.name == std::string("remembered")) {
    uint32_t loaded = 0, n = 0;
    test::ok(dfm_world_contacts(w, 0, nullptr, &n));
    std::vector<dfm_contact> contacts(n);
    test::ok(dfm_world_contacts(w, n, contacts.data(), &n));
    for (const dfm_contact &k : contacts)
      loaded |= std::hypot(k.bristle[0], k.bristle[1]) > 0 ? 1u << k.law : 0;
    EXPECT_EQ(std::popcount(loaded), 4) << "bristles of all four laws are loaded where the run is cut";
  }
  const std::string data = test::snapshot(w);
  const std::string file = test::scratch(std::string("process_") + s.name) + "/cut.bin";
  test::write_file(file, data);
  scenes::advance(w, after);
  EXPECT_EQ(test::stats(w).asleep, s.name == std::string("woken") ? 1u : 0u)
      << "the ball has woken one of two";
  const std::string self = std::filesystem::read_symlink("/proc/self/exe");  // that may be an emulator's
  const test::CommandResult r = test::run({self, "--continue", s.name, file, std::to_string(after), "3"});
  EXPECT_EQ(r.exit_code, 0) << r.err;
  EXPECT_EQ(r.out, scenes::hex(dfm_world_hash(w)) + "\n");
}

}  // namespace
