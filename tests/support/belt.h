// A soft pad of 1 kg on a belt at 0.1 m/s, held by a spring of 2 N/m: the stick-slip rig of the reference set
// (F_C = 1 N, F_S = 1.5 N, v_s = 1 mm/s, sigma0 = 1e5 N/m, sigma1 = sqrt(1e5) N s/m, sigma2 = 0.4 N s/m),
// with a body where that has a point mass. Low and wide, so that the pull does not tilt it.
#pragma once
#include <algorithm>

#include "world.h"

namespace test::belt {

constexpr double kG = 9.81, kSpeed = 0.1, kStiffness = 2, kEdge = 0.2, kHeight = 0.025, kArea = kEdge * kEdge,
                 kMass = 1;
// Periods and spring forces of a rigid mass in the same rig, from the reference set
// (stickslip_*.json, `summary`).
struct Rigid {
  const char *law;
  double period, force_max, force_min;
};
constexpr Rigid kRigid[] = {{"coulomb", 6.512322313761814, 1.5278225050875456, 0.7285768272586317},
                            {"lugre", 6.36271982106561, 1.5079878330379515, 0.7412391718011939},
                            {"elastoplastic", 6.375860727916319, 1.5097574406065437, 0.7401094644137878}};

struct Sample { double t, force; };
inline constexpr double kStep = 1e-3;
struct Result {
  double period = 0, force_max = 0, force_min = 0;
  int cycles = 0;
  uint64_t substeps = 0;
  std::vector<Sample> trace;  // every 5 ms
  std::vector<double> speed;  // m/s, of the pad's center of mass, every kStep
};

inline void set_law(dfm_world w, const std::string &law) {
  const double weight = kMass * kG;
  LawValues v{{"mu_C", 1 / weight}};
  if (law != "dahl")
    v.insert(v.end(), {{"mu_S", 1.5 / weight}, {"v_s", 1e-3}, {"delta", 2}, {"sigma2", 0.4 / kArea}});
  if (law != "coulomb") v.push_back({"sigma0", 1e5 / kArea});
  if (law == "lugre" || law == "elastoplastic")
    v.insert(v.end(), {{"sigma1", std::sqrt(1e5) / kArea}, {"sigma1_form", 1}});
  if (law == "elastoplastic") v.push_back({"kappa", 0.7});
  ok(add_friction(w, law.c_str(), v));
}

// The times at which the spring's force rises through the middle of its range tell the period.
inline void judge(Result &r, double from) {
  r.force_max = -INFINITY;
  r.force_min = INFINITY;
  for (const Sample &s : r.trace)
    if (s.t >= from) {
      r.force_max = std::max(r.force_max, s.force);
      r.force_min = std::min(r.force_min, s.force);
    }
  const double middle = 0.5 * (r.force_max + r.force_min);
  double first = 0, last = 0;
  int rises = 0;
  for (size_t i = 1; i < r.trace.size(); ++i) {
    const Sample &a = r.trace[i - 1], &b = r.trace[i];
    if (a.t < from || !(a.force < middle && b.force >= middle)) continue;
    last = a.t + (b.t - a.t) * (middle - a.force) / (b.force - a.force);
    if (!rises++) first = last;
  }
  r.cycles = rises - 1;
  r.period = r.cycles > 0 ? (last - first) / r.cycles : INFINITY;
}

inline Result run(const std::string &law, double young, uint32_t cells, double seconds, double from) {
  Context context;
  const dfm_world world = make_world(context, {0, 0, -kG});
  BodyOptions o;
  o.young = young;
  o.damping_stiffness = 2e-3;
  o.position = {0, 0, 1e-4};
  const dfm_body pad = make_body(context, world, "beam", {kEdge, kEdge, kHeight}, cells, o);
  dfm_obstacle_def floor = dfm_obstacle_def_default();
  floor.name = "belt";
  floor.shape = DFM_SHAPE_PLANE;
  floor.velocity_surface[0] = kSpeed;
  dfm_obstacle plane = 0;
  ok(dfm_obstacle_create(world, &floor, &plane));
  set_law(world, law);

  dfm_body_info info{};
  info.size = sizeof info;
  ok(dfm_body_get_info(pad, &info));
  std::vector<uint32_t> points(info.npoint);
  for (uint32_t i = 0; i < info.npoint; ++i) points[i] = i;
  const dfm_body_measure rest = measure(pad);
  dfm_spring_def d{};
  d.size = sizeof d;
  d.npoint = info.npoint;
  d.points = points.data();
  d.stiffness = kStiffness;
  std::copy_n(rest.com, 3, d.to);
  ok(dfm_body_add_spring(pad, &d, nullptr));

  Result r;
  for (int i = 1; i * kStep <= seconds; ++i) {
    ok(dfm_world_step(world, kStep, nullptr));
    const dfm_body_measure now = measure(pad);
    r.speed.push_back(now.velocity[0]);
    if (i % 5 == 0) r.trace.push_back({i * kStep, kStiffness * (now.com[0] - rest.com[0])});
  }
  r.substeps = stats(world).substeps;
  judge(r, from);
  ok(dfm_world_destroy(world));
  return r;
}

}  // namespace test::belt
