// Scenes that are shot at each other: what crosses at the end of a step, by exact predicates, with the
// guard and without.
#pragma once
#include <functional>
#include <random>

#include "coupled.h"
#include "crossing.h"
#include "obstacle.h"
#include "rigid.h"

namespace test {

inline std::array<double, 3> turn(const double q[4], std::array<double, 3> p) {
  const std::array<double, 3> u{q[0], q[1], q[2]};
  const auto t = cross(u, p), s = cross(u, t);
  for (size_t k = 0; k < 3; ++k) p[k] += 2 * q[3] * t[k] + 2 * s[k];
  return p;
}

struct Shot {
  Context context;
  dfm_world world = 0;
  std::mt19937 random;
  std::vector<dfm_body> bodies;
  std::vector<std::vector<uint32_t>> triangles;
  struct Wall {
    Triangles surface;
    dfm_obstacle obstacle;
    dfm_rigid rigid;
  };
  // obstacles and rigid bodies that are looked at, as triangles in their frames
  std::vector<Wall> walls;
  std::function<void(int)> before;  // each step

  Shot(bool guarded, unsigned seed, uint32_t threads = 1, uint32_t self = 0)
      : context(threads), random(seed) {
    dfm_world_def d = dfm_world_def_default();
    d.self_contact = self;
    d.flags = guarded ? 0 : DFM_WORLD_UNGUARDED;
    d.gravity[2] = 0;
    ok(dfm_world_create(context, &d, &world));
    set_friction(world, 0.3);
  }
  double jitter(double by) { return by * std::uniform_real_distribution<double>(-1, 1)(random); }
  void add(const char *kind, Vec size, uint32_t cells, Vec at, Vec velocity,
           std::array<double, 4> turned = {0, 0, 0, 1}, double young = 1e6, Vec spin = {}) {
    BodyOptions o;
    o.young = young;
    o.damping_stiffness = 1e-4;
    const std::string name = "body" + std::to_string(bodies.size());
    o.name = name;
    o.position = at;
    o.velocity = velocity;
    o.rotation = turned;
    o.spin = spin;
    bodies.push_back(make_body(context, world, kind, size, cells, o));
    triangles.push_back(surface_triangles(bodies.back()));
  }
  dfm_obstacle add_wall(const Triangles &surface, uint32_t shape = DFM_SHAPE_MESH, uint32_t cells = 0) {
    walls.push_back({surface, add_mesh(world, "wall", surface, shape, cells), 0});
    return walls.back().obstacle;
  }
  void add_rigid_box(Vec half, double mass, Vec at, Vec velocity, Vec spin = {}) {
    dfm_rigid_def d = box("flyer", half, mass, at);
    for (int k = 0; k < 3; ++k) {
      d.velocity[k] = velocity[size_t(k)];
      d.spin[k] = spin[size_t(k)];
    }
    walls.push_back({box_surface(half, 1), 0, create(world, {d})[0]});
  }
  // Between two surfaces; what a body does to itself counts where the world's self contact is on.
  size_t crossings() const { return count().between; }
  crossing::Found count() const {
    std::vector<std::vector<double>> x;
    std::vector<crossing::Surface> surfaces;
    x.reserve(bodies.size() + walls.size());
    for (size_t i = 0; i < bodies.size(); ++i) {
      x.push_back(surface_positions(bodies[i]));
      surfaces.push_back(
          {x[i].data(), uint32_t(x[i].size() / 3), triangles[i].data(), uint32_t(triangles[i].size() / 3)});
    }
    for (const Wall &w : walls) {
      dfm_pose pose{};
      if (w.rigid) {
        const dfm_rigid_state s = state(w.rigid);
        for (int k = 0; k < 3; ++k) pose.position[k] = s.position[k];
        for (int k = 0; k < 4; ++k) pose.rotation[k] = s.rotation[k];
      } else {
        ok(dfm_obstacle_get_pose(w.obstacle, &pose));
      }
      x.push_back(w.surface.points);
      for (size_t p = 0; p < x.back().size(); p += 3) {
        const Vec at = turn(pose.rotation, {x.back()[p], x.back()[p + 1], x.back()[p + 2]});
        for (size_t k = 0; k < 3; ++k) x.back()[p + k] = at[k] + pose.position[k];
      }
      surfaces.push_back({x.back().data(), uint32_t(x.back().size() / 3), w.surface.tris.data(),
                          uint32_t(w.surface.tris.size() / 3), true});
    }
    return crossing::Counter().count(surfaces, crossing::Touching::counts);
  }
  Vec momentum(double *scale = nullptr) const {
    Vec sum{};
    const auto add_one = [&](const dfm_body_measure &m) {
      for (int k = 0; k < 3; ++k) {
        sum[size_t(k)] += m.momentum[k];
        if (scale) *scale += std::fabs(m.momentum[k]);
      }
    };
    for (const dfm_body b : bodies) add_one(measure(b));
    for (const Wall &w : walls)
      if (w.rigid) add_one(rigid_measure(w.rigid));
    return sum;
  }
};

struct Outcome {
  size_t crossed = 0;
  uint64_t steps = 0;
  double lost = 0;
  bool finite = true;
};
inline Outcome run(Shot &s, int steps, double dt) {
  Outcome out;
  for (int i = 0; i < steps; ++i) {
    if (s.before) s.before(i);
    uint32_t trouble = 0;
    if (dfm_world_step(s.world, dt, &trouble) != DFM_OK) {
      out.finite = false;
      return out;
    }
    out.crossed += s.crossings();
    for (const dfm_body b : s.bodies)
      for (const double x : surface_positions(b)) out.finite &= std::isfinite(x);
  }
  const dfm_world_stats now = stats(s.world);
  out.steps = now.guard_steps;
  out.lost = now.guard_lost;
  return out;
}

// Runs with jitter, ten if not said otherwise: no crossing and everything finite with the guard, crossings in
// some of them without it.
inline void ten_times(const std::function<void(Shot &)> &setup, int steps, double dt, unsigned first = 1,
                      unsigned last = 10) {
  size_t without = 0;
  uint64_t acted = 0;
  for (unsigned seed = first; seed <= last; ++seed) {
    Shot guarded(true, seed), bare(false, seed);
    setup(guarded);
    setup(bare);
    ASSERT_EQ(guarded.crossings(), 0u) << "the scene itself";
    const Outcome with = run(guarded, steps, dt);
    EXPECT_EQ(with.crossed, 0u) << "seed " << seed;
    EXPECT_TRUE(with.finite) << "seed " << seed << ": " << dfm_last_error();
    EXPECT_LE(with.lost, 0.5 * steps * dt) << "seed " << seed << ": the world goes on";
    acted += with.steps;
    const Outcome off = run(bare, steps, dt);
    without += off.crossed;
    EXPECT_EQ(off.steps, 0u);
    const dfm_world_stats s = stats(guarded.world);
    std::printf("%u: %g of %g sub-steps, %g solves, %g cuts, %g s lost; unguarded: %zu crossings\n", seed,
                double(s.guard_steps), double(s.substeps), double(s.guard_solves), double(s.guard_cuts),
                s.guard_lost, off.crossed);
  }
  EXPECT_GT(acted, 0u);
  EXPECT_GT(without, 0u) << "the scene does not need the guard";
}

}  // namespace test
