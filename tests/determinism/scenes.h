// Scenes whose state hash must be the same on every build, cut and processor.
#pragma once
#include <ostream>

#include "coupled.h"
#include "hook.h"
#include "obstacle.h"

namespace scenes {

// What a scene's bodies are made of and moved by, where it is not the default.
struct Kind {
  const char *model = "";
  int32_t integrator = DFM_INTEGRATOR_AUTO;
  test::BodyOptions body() const {
    test::BodyOptions o;
    o.model = model;
    o.integrator = integrator;
    return o;
  }
};

// A ball that spins and slides as it meets a floor.
inline dfm_world ball_on_floor(dfm_context *c, Kind kind = {}) {
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::set_friction(w, 0.4);
  test::BodyOptions o = kind.body();
  o.name = "ball";
  o.young = 2e4;
  o.damping_stiffness = 5e-4;
  o.position = {0, 0, 0.0503};
  o.velocity = {0.3, 0.1, -0.5};
  o.spin = {0, 20, 3};
  test::make_body(c, w, "ball", {0.05, 0, 0}, 400, o);
  return w;
}

// A beam held at both ends, another that falls across it: edges meet edges, with and without the volume term.
inline dfm_world crossing_beams(dfm_context *c, Kind kind = {}) {
  const dfm_world w = test::make_world(c);
  test::set_friction(w, 0.5);
  test::BodyOptions o = kind.body();
  o.name = "lower";
  o.young = 5e4;
  o.damping_stiffness = 5e-4;
  o.position = {-0.1, -0.02, 0};
  const dfm_body lower = test::make_body(c, w, "beam", {0.2, 0.04, 0.04}, 200, o);
  std::vector<double> x(3 * 4096);
  uint32_t n = 0;
  test::ok(dfm_body_get_state(lower, 4096, x.data(), nullptr, &n));
  std::vector<uint32_t> ends;
  for (uint32_t i = 0; i < n; ++i)
    if (std::fabs(x[3 * i]) > 0.0999) ends.push_back(i);
  test::ok(dfm_body_hold(lower, uint32_t(ends.size()), ends.data(), 7));
  o.name = "upper";
  if (!*kind.model) o.volume = 1;
  o.position = {-0.017, -0.1, 0.0403};
  o.velocity = {0.05, 0, -0.4};
  o.spin = {0, 0, 1};
  test::make_body(c, w, "beam", {0.04, 0.2, 0.04}, 200, o);
  return w;
}

// Ten small bodies thrown together in a box of five planes.
inline dfm_world ten_in_a_box(dfm_context *c, Kind kind = {}) {
  const dfm_world w = test::make_world(c);
  const double s = std::sqrt(0.5);
  test::add_plane(w, "floor");
  test::add_plane(w, "west", {-0.06, 0, 0}, {0, s, 0, s});
  test::add_plane(w, "east", {0.06, 0, 0}, {0, -s, 0, s});
  test::add_plane(w, "south", {0, -0.06, 0}, {-s, 0, 0, s});
  test::add_plane(w, "north", {0, 0.06, 0}, {s, 0, 0, s});
  test::set_friction(w, 0.3);
  const char *const kinds[] = {"ball", "beam", "cylinder"};
  const std::array<double, 3> sizes[] = {{0.015, 0, 0}, {0.025, 0.02, 0.02}, {0.012, 0.03, 0}};
  for (int i = 0; i < 10; ++i) {
    test::BodyOptions o = kind.body();
    o.young = 1e4;
    o.damping_stiffness = 1e-3;
    o.position = {-0.03 + 0.036 * (i % 2), -0.03 + 0.036 * (i / 2 % 2), 0.02 + 0.036 * (i / 4)};
    o.velocity = {0.2 - 0.04 * i, 0.05 * (i % 5) - 0.1, -0.6};
    o.spin = {double(i), 3.0 - i, 1};
    test::make_body(c, w, kinds[i % 3], sizes[i % 3], 60, o);
  }
  return w;
}

// One body large enough that its model cuts its own work (10,000 cells).
inline dfm_world fine_ball(dfm_context *c) {
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::set_friction(w, 0.4);
  test::BodyOptions o;
  o.name = "ball";
  o.young = 2e4;
  o.volume = 1;
  o.position = {0, 0, 0.0502};
  o.velocity = {0.3, 0.1, -0.5};
  o.spin = {0, 20, 3};
  test::make_body(c, w, "ball", {0.05, 0, 0}, 12000, o);
  return w;
}

// Two bodies with surfaces of their own: a ball that hangs by moving least squares falls on a block that
// hangs by cells, on a floor.
inline dfm_world coupled_pair(dfm_context *c, Kind kind = {}) {
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  test::set_friction(w, 0.4);
  const test::Skin box = test::box_skin({0.1, 0.1, 0.06}, 8), ball = test::ball_skin(0.048, 3);
  const dfm_surface_def below = box.def(), above = ball.def(DFM_COUPLING_MLS, 1.5);
  test::BodyOptions o = kind.body();
  o.young = 5e4;
  o.damping_stiffness = 5e-4;
  o.name = "block";
  o.position = {-0.05, -0.05, 1e-4};
  o.surface = &below;
  test::make_body(c, w, "beam", {0.1, 0.1, 0.06}, 60, o);
  o.name = "ball";
  o.position = {0.01, 0.005, 0.1085};
  o.velocity = {0.2, 0.1, -0.6};
  o.spin = {0, 10, 3};
  o.surface = &above;
  test::make_body(c, w, "ball", {0.05, 0, 0}, 100, o);
  return w;
}

// A ball rolls and a beam falls over a dale of irregular triangles that sinks at the same time.
inline dfm_world dale(dfm_context *c) {
  const dfm_world w = test::make_world(c);
  const test::Triangles ground =
      test::height_field(0.15, 12, [](double x, double y) { return 0.8 * (x * x + 0.5 * y * y); });
  const dfm_pose_key keys[] = {{0, {{0, 0, 0}, {0, 0, 0, 1}}}, {0.2, {{0, 0.002, -0.004}, {0, 0.02, 0, 1}}}};
  dfm_obstacle_def d = test::mesh_def("ground", ground);
  d.nkey = 2;
  d.keys = keys;
  dfm_obstacle o = 0;
  test::ok(dfm_obstacle_create(w, &d, &o));
  test::set_friction(w, 0.4);
  test::BodyOptions b;
  b.young = 5e4;
  b.damping_stiffness = 5e-4;
  b.position = {-0.03, 0.01, 0.0325};
  b.velocity = {0.3, 0, -0.3};
  b.spin = {0, 8, 0};
  test::make_body(c, w, "ball", {0.03, 0, 0}, 200, b);
  b.position = {0.02, -0.03, 0.035};
  b.velocity = {0, 0.1, -0.4};
  b.spin = {1, 0, 4};
  test::make_body(c, w, "beam", {0.06, 0.03, 0.03}, 100, b);
  return w;
}

// Two blocks come to rest and sleep; a ball falls on one of them and wakes it, the other sleeps on.
inline dfm_world woken(dfm_context *c) {
  dfm_world_def d = dfm_world_def_default();
  d.sleep = 1;
  d.sleep_time = 0.04;
  d.contact_offset = 2e-4;
  dfm_world w = 0;
  test::ok(dfm_world_create(c, &d, &w));
  test::add_plane(w, "floor");
  test::set_friction(w, 0.4);
  test::BodyOptions o;
  o.young = 2e5;
  o.damping_stiffness = 2e-3;
  o.damping_mass = 40;
  o.position = {0, 0, 1.6e-4};
  test::make_body(c, w, "beam", {0.1, 0.1, 0.06}, 100, o);
  o.position[0] = 0.3;
  test::make_body(c, w, "beam", {0.1, 0.1, 0.06}, 100, o);
  o.damping_mass = 0;
  o.position = {0.06, 0.045, 0.22};
  o.spin = {3, 1, 0};
  test::make_body(c, w, "ball", {0.04, 0, 0}, 100, o);
  return w;
}

// A hook is thrown on the floor while its legs are pressed together: they meet, slide on each
// other and stick.
inline dfm_world folded(dfm_context *c) {
  const dfm_world w = test::make_self_world(c, true, {0, 0, -9.81});
  test::add_plane(w, "floor");
  test::set_friction(w, 0.4);
  test::HookOptions o;
  o.young = 3e4;
  o.damping_stiffness = 1e-3;
  o.damping_mass = 5;
  o.position = {0, 0, 0.0005};
  o.velocity = {0.1, 0, -0.3};
  o.spin = {0, 2, 1};
  o.close = 0.5;
  o.pinch = 0.03;
  test::make_hook(w, o);
  return w;
}

// Every law with memory at once: three blocks on the floor and a ball thrown on one of them, each pair with a
// law of its own, pushed so that some contacts hold on loaded bristles and others slide.
inline dfm_world remembered(dfm_context *c) {
  const dfm_world w = test::make_world(c);
  test::add_plane(w, "floor");
  const double low = 0.3, high = 0.9, soft = 1e7, bent = 1.5;
  test::BodyOptions o;
  o.young = 1e5;
  o.damping_stiffness = 1e-3;
  const char *const names[] = {"dahl", "elastoplastic", "gms"};
  for (int i = 0; i < 3; ++i) {
    o.name = names[i];
    o.position = {0, 0.15 * i, 1e-4};
    o.velocity = {0.05 + 0.1 * i, 0.02 * i, 0};
    test::make_body(c, w, "beam", {0.1, 0.1, 0.06}, 60, o);
  }
  o.name = "ball";
  o.position = {0.05, 0.05, 0.1008};
  o.velocity = {0.1, 0.05, -0.2};
  o.spin = {3, 1, 2};
  test::make_body(c, w, "ball", {0.04, 0, 0}, 100, o);
  test::ok(test::add_friction(w, "dahl", {{"mu", low}, {"sigma0", soft}, {"alpha", bent}}, "dahl", "floor"));
  test::ok(test::add_friction(w, "elastoplastic", {{"mu_C", low}, {"mu_S", high}, {"sigma0", soft}, {"i", 3}},
                              "elastoplastic", "floor"));
  test::ok(test::add_friction(w, "gms", {{"mu_C", low}, {"mu_S", high}}, "gms", "floor"));
  test::ok(test::add_friction(w, "lugre", {{"mu_C", low}, {"mu_S", high}, {"delta", bent}, {"sigma0", soft}},
                              "ball", "dahl"));
  return w;
}

// The same by backward Euler, and by TR-BDF2.
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world msm(dfm_context *c) {
  return build(c, {"msm", DFM_INTEGRATOR_IMPLICIT_EULER});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world linear(dfm_context *c) {
  return build(c, {"linear_fem", DFM_INTEGRATOR_IMPLICIT_EULER});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world corotational(dfm_context *c) {
  return build(c, {"corotational_fem", DFM_INTEGRATOR_IMPLICIT_EULER});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world matched(dfm_context *c) {
  return build(c, {"shape_matching"});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world modal(dfm_context *c) {
  return build(c, {"modal"});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world condensed(dfm_context *c) {
  return build(c, {"condensed"});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world scattered_explicit(dfm_context *c) {
  return build(c, {"meshless", DFM_INTEGRATOR_SYMPLECTIC_EULER});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world scattered(dfm_context *c) {
  return build(c, {"meshless", DFM_INTEGRATOR_IMPLICIT_EULER});
}
template <dfm_world (*build)(dfm_context *, Kind)>
dfm_world second_order(dfm_context *c) {
  return build(c, {"corotational_fem", DFM_INTEGRATOR_TR_BDF2});
}

struct Scene {
  const char *name;
  dfm_world (*build)(dfm_context *);
  int steps;
};
// CTest's name of a test has it; without this, addresses.
inline void PrintTo(const Scene &scene, std::ostream *out) { *out << scene.name; }
inline const Scene all[] = {{"ball_on_floor", [](dfm_context *c) { return ball_on_floor(c); }, 150},
                            {"crossing_beams", [](dfm_context *c) { return crossing_beams(c); }, 150},
                            {"ten_in_a_box", [](dfm_context *c) { return ten_in_a_box(c); }, 80},
                            {"fine_ball", fine_ball, 20},
                            {"coupled_pair", [](dfm_context *c) { return coupled_pair(c); }, 80},
                            {"dale", dale, 100},
                            {"woken", woken, 220},
                            {"folded", folded, 120},
                            {"remembered", remembered, 70},
                            {"implicit_msm_ball", msm<ball_on_floor>, 40},
                            {"implicit_linear_ball", linear<ball_on_floor>, 40},
                            {"implicit_corotational_ball", corotational<ball_on_floor>, 40},
                            {"implicit_msm_beams", msm<crossing_beams>, 40},
                            {"implicit_linear_beams", linear<crossing_beams>, 40},
                            {"implicit_corotational_beams", corotational<crossing_beams>, 40},
                            {"implicit_msm_skins", msm<coupled_pair>, 15},
                            {"implicit_corotational_skins", corotational<coupled_pair>, 15},
                            {"shape_matching_ball", matched<ball_on_floor>, 100},
                            {"modal_ten", modal<ten_in_a_box>, 40},
                            {"condensed_ball", condensed<ball_on_floor>, 60},
                            {"meshless_ball", scattered_explicit<ball_on_floor>, 60},
                            {"implicit_meshless_ball", scattered<ball_on_floor>, 20},
                            {"implicit_corotational_ten", corotational<ten_in_a_box>, 40},
                            {"second_order_ten", second_order<ten_in_a_box>, 40}};

inline void advance(dfm_world w, int steps) {
  for (int i = 0; i < steps; ++i) ASSERT_EQ(dfm_world_step(w, 1e-3, nullptr), DFM_OK) << dfm_last_error();
}

inline uint64_t run(dfm_context *c, const Scene &scene) {
  const dfm_world w = scene.build(c);
  advance(w, scene.steps);
  EXPECT_GT(test::stats(w).contacts_max, 3u) << scene.name << ": a scene without contact shows nothing";
  return dfm_world_hash(w);
}

inline uint64_t run(const Scene &scene, uint32_t threads = 1) {
  const test::Context c(threads);
  return run(c, scene);
}

inline std::string hex(uint64_t h) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(h));
  return text;
}

}  // namespace scenes
