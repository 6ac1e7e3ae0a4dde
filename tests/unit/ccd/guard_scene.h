// What the guard is asked about, with ends of surfels that the test gives.
#pragma once
#include <span>
#include <vector>

#include "ccd/toi_guard.h"

namespace test {

// end: of each body, [nsurfel,4].
inline dfm::GuardScene guard_scene(std::span<const dfm::BodyView> bodies,
                                   const std::vector<std::vector<double>> &end, double floor, double margin) {
  dfm::GuardScene scene;
  scene.bodies = bodies;
  scene.round = 1;
  scene.floor = floor;
  scene.margin = margin;
  for (size_t i = 0; i < bodies.size(); ++i) {
    dfm::GuardSide side;
    side.surface = bodies[i].surface;
    side.end.assign(end[i].begin(), end[i].end());
    side.stamp.assign(bodies[i].surface->nsurfel, 1);
    scene.sides.push_back(side);
  }
  return scene;
}

}  // namespace test
