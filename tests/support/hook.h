// A body that can touch itself: two legs on one back, made of cubes, sheared so that no vertex
// stands over another.
//
//      z   ___________
//      |  |  ________|  upper leg, x up to 6 cells
//      |  | |           gap of one cell
//      |  | |________
//      |__|__________|  x
#pragma once
#include <map>

#include "world.h"

namespace test {

struct HookOptions : BodyOptions {
  double cell = 0.01, close = 0;  // m; m/s, speed at which each leg's tip moves to the other
  double pinch = 0;               // N on each tip, toward the other
  bool held = false;              // by its back
};

struct Hook {
  std::vector<double> points;
  std::vector<uint32_t> tets;
  static constexpr int kLength = 6, kWidth = 3;
  explicit Hook(double cell) {
    std::map<std::array<int, 3>, uint32_t> number;
    auto corner = [&](int i, int j, int k) {
      const auto [at, fresh] = number.try_emplace({i, j, k}, uint32_t(points.size() / 3));
      if (fresh) points.insert(points.end(), {cell * (i + 0.23 * k), cell * (j + 0.31 * k), cell * k});
      return at->second;
    };
    for (int i = 0; i < kLength; ++i)
      for (int j = 0; j < kWidth; ++j)
        for (int k = 0; k < 3; ++k) {
          if (k == 1 && i > 0) continue;
          // six tetrahedra about a diagonal; odd ones are turned
          static const int paths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
          for (int p = 0; p < 6; ++p) {
            std::array<int, 3> c{i, j, k};
            uint32_t t[4] = {corner(c[0], c[1], c[2])};
            for (int s = 0; s < 3; ++s) {
              ++c[size_t(paths[p][s])];
              t[s + 1] = corner(c[0], c[1], c[2]);
            }
            if (p >= 3) std::swap(t[1], t[2]);
            tets.insert(tets.end(), t, t + 4);
          }
        }
  }
};

inline dfm_body make_hook(dfm_world w, const HookOptions &o) {
  const Hook hook(o.cell);
  dfm_material_def md = dfm_material_def_default();
  md.density = o.density;
  md.young = o.young;
  md.poisson = o.poisson;
  md.damping_mass = o.damping_mass;
  md.damping_stiffness = o.damping_stiffness;
  dfm_material material = 0;
  ok(dfm_material_create(w, &md, &material));
  dfm_body_def d = dfm_body_def_default();
  d.name = o.name.empty() ? "hook" : o.name.c_str();
  d.npoint = uint32_t(hook.points.size() / 3);
  d.ntet = uint32_t(hook.tets.size() / 4);
  d.points = hook.points.data();
  d.tets = hook.tets.data();
  d.material = material;
  d.surface = o.surface;
  for (int k = 0; k < 3; ++k) {
    d.pose.position[k] = o.position[k];
    d.velocity[k] = o.velocity[k];
    d.spin[k] = o.spin[k];
  }
  for (int k = 0; k < 4; ++k) d.pose.rotation[k] = o.rotation[k];
  dfm_body body = 0;
  ok(dfm_body_create(w, &d, &body));
  std::vector<double> x(hook.points.size()), v(hook.points.size());
  uint32_t n = 0;
  ok(dfm_body_get_state(body, d.npoint, x.data(), v.data(), &n));
  std::vector<uint32_t> tips, back;
  std::vector<double> force;
  for (uint32_t i = 0; i < n; ++i) {
    const double level = hook.points[3 * i + 2] / o.cell;
    const double along = (hook.points[3 * i] / o.cell - 0.23 * level) / Hook::kLength;
    const double to = level > 1.5 ? -1 : 1;
    v[3 * i + 2] += to * o.close * along;
    if (along < 0.01) back.push_back(i);
    if (along < 0.99) continue;
    tips.push_back(i);
    force.insert(force.end(), {0, 0, to * o.pinch / (2 * (Hook::kWidth + 1))});
  }
  ok(dfm_body_set_state(body, n, x.data(), v.data()));
  if (o.held) ok(dfm_body_hold(body, uint32_t(back.size()), back.data(), 7));
  if (o.pinch != 0)
    ok(dfm_body_add_load(body, uint32_t(tips.size()), tips.data(), force.data(), 0, nullptr, nullptr,
                         nullptr));
  return body;
}

inline dfm_world make_self_world(dfm_context *c, bool self = true, std::array<double, 3> gravity = {0, 0, 0},
                                 uint32_t flags = 0) {
  dfm_world_def d = dfm_world_def_default();
  d.flags = flags;
  for (int k = 0; k < 3; ++k) d.gravity[k] = gravity[k];
  d.self_contact = self;
  dfm_world w = 0;
  ok(dfm_world_create(c, &d, &w));
  return w;
}

}  // namespace test
