// The world by which an engine's adapter is measured: 100 rigid boxes, 10 of them on a soft bed, 90 on the
// engine's plane, awake.
#pragma once
#include "engine.h"

namespace test {

inline void fill_load(Engine &engine) {
  engine.ground();
  BodyOptions o;
  o.name = "bed";
  o.young = 4e4;
  o.damping_stiffness = 0.003;
  o.damping_mass = 4;
  o.position = {0, 0, 0.001};
  hold_bottom(make_body(engine.context, engine.soft, "beam", {1.0, 0.4, 0.1}, 4000, o));
  for (int i = 0; i < 10; ++i)
    engine.box({0.04, 0.04, 0.04}, 0.3, {0.1 + 0.2 * (i % 5), 0.1 + 0.2 * (i / 5), 0.142});
  for (int i = 0; i < 90; ++i)
    engine.box({0.04, 0.04, 0.04}, 0.3, {2 + 0.2 * (i % 10), 0.2 * (i / 10), 0.04});
}

}  // namespace test
