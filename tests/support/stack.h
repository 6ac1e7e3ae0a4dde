// Two soft cubes on a floor, one on the other: the smallest world in which everything touches.
#pragma once
#include <algorithm>

#include "world.h"

namespace test {

struct Stack {
  dfm_world world = 0;
  dfm_body lower = 0, upper = 0;
  dfm_obstacle floor = 0;
};

// drop: how far above its place the upper cube starts, m.
inline Stack make_stack(dfm_context *c, double drop = 1e-4, double mu = 0.5,
                        int32_t integrator = DFM_INTEGRATOR_AUTO) {
  Stack s;
  s.world = make_world(c, {0, 0, -9.81}, integrator);
  s.floor = add_plane(s.world, "floor");
  set_friction(s.world, mu);
  BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.volume = 1;
  o.name = "lower";
  o.position = {0, 0, 1e-4};
  s.lower = make_body(c, s.world, "beam", {0.1, 0.1, 0.1}, 60, o);
  o.name = "upper";
  o.position = {0.013, 0.007, 0.1 + 2e-4 + drop};
  s.upper = make_body(c, s.world, "beam", {0.1, 0.1, 0.1}, 60, o);
  return s;
}

// Opens the faces of the upper cube across its center of mass.
inline void split_upper(const Stack &s) {
  dfm_cut_def cut = dfm_cut_def_default();
  cut.shape = DFM_CUT_PLANE;
  cut.how = DFM_CUT_SPLIT;
  const dfm_body_measure m = measure(s.upper);
  std::copy_n(m.com, 3, cut.blade);
  cut.blade[3] = 1;
  ok(dfm_body_cut(s.upper, &cut, nullptr));
}

inline std::vector<dfm_pair_report> pairs(dfm_world w) { return listed(dfm_world_pairs, w); }
inline std::vector<dfm_contact_event> events(dfm_world w) { return listed(dfm_world_events, w); }

}  // namespace test
