#include <gtest/gtest.h>

#include "core/hash.h"
#include "detect_scene.h"
#include "narrow/list_memory.h"

namespace {

using namespace dfm;
using namespace test;

// Surfaces roll over each other and tremble, fast and slowly, and their lists are renewed.
// unsanitized: too slow there; shorter tests run the same code
TEST(FindContacts, KnownDistances_DoNotChangeContacts) {
  for (const uint32_t threads : {1u, 3u}) {
    Scene scene;
    const Mesh cylinder = cylinder_mesh(0.2, 1, 16, 8);
    scene.add(cylinder);
    scene.add(moved(cylinder, turn({0, 0, 1}, 0.02), {0.4005, 0.01, 0.003}));
    scene.add(moved(box_mesh({1, 1, 1}, 2, 2, 2), {0.1, 0.2, 0.3, 0.9}, {0.2, 0.75, 0}));
    Tasks tasks(threads, nullptr, nullptr);
    BroadPhase broad(Memory::standard());
    NarrowBlocks blocks(Memory::standard());
    ListMemory memory;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(-1, 1);
    size_t found = 0, skipped = 0;
    for (int step = 0; step < 60; ++step) {
      const double speed = std::pow(10, 2 * u(random)) / scene.h * scene.offset;  // m/s
      for (auto &s : scene.surfaces) {
        const Vec3 common{speed * u(random), speed * u(random), speed * u(random)};
        for (uint32_t i = 0; i < s->nsurfel; ++i)
          for (int k = 0; k < 3; ++k) s->v[4 * size_t{i} + size_t(k)] = common[k] + 0.1 * speed * u(random);
      }
      broad.set_skin_steps(double(1 + step % 7));
      broad.update(scene.bodies, scene.obstacles, scene.filter, scene.h, scene.offset);
      const Array<Candidate> &list = broad.candidates();
      memory.follow(list, &tasks);
      Array<ContactPoint> out;
      Array<uint8_t> lent;
      find_contacts(scene.bodies, scene.obstacles, list, scene.h, scene.offset, {}, lent, out, &blocks,
                    &tasks, &memory);
      ASSERT_TRUE(same_bits(out, scene.contacts(list))) << threads << " threads, step " << step;
      found += out.size();
      // they move by what narrow/ has assumed, once in three times
      const double h = step % 3 ? 0.1 * scene.h : scene.h;
      for (auto &run : memory.runs) {
        skipped += memory.apart[run.begin] > run.way;
        run.travel = h * (largest_speed(*scene.bodies[run.of.slot_a].surface) +
                          largest_speed(*scene.bodies[run.of.slot_b].surface));
      }
      memory.keep();
      for (auto &s : scene.surfaces)
        for (size_t i = 0; i < s->x.size(); ++i) s->x[i] += h * s->v[i];
    }
    EXPECT_GT(found, 500u);
    EXPECT_GT(skipped, 50u);
  }
}

}  // namespace
