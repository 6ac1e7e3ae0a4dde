// Runs a scene with a model, an integrator and a step of the caller's choice and sees what it does, on the
// public API alone: the stability suite, its soak and the table of scenes and models.
#pragma once
#include <ctime>

#include <algorithm>
#include <functional>
#include <map>
#include <random>

#include "coupled.h"
#include "crossing.h"
#include "obstacle.h"
#include "voxel_core.h"

namespace test::suite {

// step 0: the scene's own. Empty: as the scene says.
struct Combination {
  std::string model, integrator;  // integrator: "explicit" or "implicit", with the contact that belongs to it
  double step = 0;
};

inline std::string name_of(const Combination &c) {
  char step[32];
  if (c.step > 2e-3) std::snprintf(step, sizeof step, " 1/%.0f s", 1 / c.step);
  else if (c.step > 0) std::snprintf(step, sizeof step, " %g ms", 1e3 * c.step);
  return (c.model.empty() ? "scene's models" : c.model) +
         (c.integrator.empty() ? " scene's integrator" : " " + c.integrator) + (c.step > 0 ? step : "");
}

struct Settings {
  std::vector<std::string> set;
  Combination combination;
  uint64_t jitter = 0;
  double jitter_velocity = 0;  // m/s: instead of the scene's jitter, a random velocity for each body
  double duration = 0;         // s; 0: the scene's
  double cpu_seconds = 0;      // ends the run early; 0: never
  // extents of a body times these at the start, about the middle of its box
  std::map<std::string, std::array<double, 3>> stretch;
  // an obstacle that is moved by hand in every step, at `velocity` from `begin` to `end`
  struct Hand {
    std::string obstacle;
    double begin = 0, end = 0;
    std::array<double, 3> velocity{};
  } hand;
};

struct BodySeen {
  std::string name;
  std::array<double, 3> com_start{}, com{}, spin_start{}, spin{};
  double volume_ratio = 0;
  double misfit = 0;  // largest change of an edge of a cell at the end, over its rest length
  uint32_t inverted = 0;
  std::vector<std::array<double, 3>> path;  // of its center of mass, 100 samples
};

struct Seen {
  bool loaded = false;
  dfm_status status = DFM_OK;
  std::string reason;  // why it was refused or stopped
  bool finite = true, in_time = true;
  double time = 0, cpu = 0;  // s
  uint64_t steps = 0;
  size_t crossings = 0;  // most at once: between two surfaces, or points of a body inside a plain obstacle
  size_t self_last = 0;  // of bodies with themselves at the end
  // J: kinetic and elastic at most; kinetic, elastic and potential at the start, and the most above
  // that
  double energy_most = 0, start = 0, gain = 0;
  double speed_last = 0, reach = 0;  // m/s of the fastest point at the end; m, the largest coordinate ever
  dfm_world_stats stats{};
  std::vector<BodySeen> bodies;
};

namespace detail {

inline double cpu_now() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

// A vector of the scene, or zero if the key is missing.
inline std::array<double, 3> scene_vector(dfm_scene scene, const char *pointer) {
  std::array<double, 3> out{};
  size_t bytes = 0;
  if (dfm_scene_value(scene, pointer, nullptr, &bytes) != DFM_OK) return out;
  std::string text(bytes, '\0');
  if (dfm_scene_value(scene, pointer, text.data(), &bytes) != DFM_OK) return out;
  if (std::sscanf(text.c_str(), " [%lf,%lf,%lf", &out[0], &out[1], &out[2]) != 3) out = {};
  return out;
}

inline std::array<double, 3> turned(const double q[4], const double p[3], double sign) {
  const double u[3] = {sign * q[0], sign * q[1], sign * q[2]};
  double t[3], s[3];
  for (int k = 0; k < 3; ++k) t[k] = u[(k + 1) % 3] * p[(k + 2) % 3] - u[(k + 2) % 3] * p[(k + 1) % 3];
  for (int k = 0; k < 3; ++k) s[k] = u[(k + 1) % 3] * t[(k + 2) % 3] - u[(k + 2) % 3] * t[(k + 1) % 3];
  return {p[0] + 2 * q[3] * t[0] + 2 * s[0], p[1] + 2 * q[3] * t[1] + 2 * s[1],
          p[2] + 2 * q[3] * t[2] + 2 * s[2]};
}

class Observer {
 public:
  Observer(dfm_scene scene, dfm_world world, Seen &seen)
      : world_(world), seen_(seen), gravity_(scene_vector(scene, "/gravity")) {
    for (const dfm_body body : listed(dfm_world_bodies, world)) {
      BodyState b;
      b.handle = body;
      b.info.size = sizeof b.info;
      ok(dfm_body_get_info(body, &b.info));
      b.triangles = surface_triangles(body);
      b.rest.resize(3 * size_t(b.info.npoint));
      b.cells.resize(4 * size_t(b.info.ntet));
      ok(dfm_body_get_rest(body, b.info.npoint, b.rest.data(), b.info.ntet, b.cells.data()));
      seen_.bodies.emplace_back();
      seen_.bodies.back().name = b.info.name;
      bodies_.push_back(std::move(b));
    }
    for (const dfm_obstacle obstacle : listed(dfm_world_obstacles, world)) {
      Wall w;
      w.handle = obstacle;
      w.def.size = sizeof w.def;
      ok(dfm_obstacle_get_def(obstacle, &w.def));
      if (w.def.shape == DFM_SHAPE_BOX)
        w.surface = box_surface({w.def.half_size[0], w.def.half_size[1], w.def.half_size[2]}, 1);
      if (w.def.shape == DFM_SHAPE_MESH)
        w.surface = {{w.def.points, w.def.points + 3 * size_t(w.def.npoint)},
                     {w.def.triangles, w.def.triangles + 3 * size_t(w.def.ntriangle)}};
      if (w.def.shape == DFM_SHAPE_VOXELS)
        w.surface = {cli::voxel_core(w.def),
                     {w.def.triangles, w.def.triangles + 3 * size_t(w.def.ntriangle)}};
      walls_.push_back(std::move(w));
    }
    std::tie(seen_.start, seen_.energy_most) = energies();
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const dfm_body_measure m = measure(bodies_[b].handle);
      std::copy_n(m.com, 3, seen_.bodies[b].com_start.begin());
      std::copy_n(m.angular, 3, seen_.bodies[b].spin_start.begin());
    }
  }

  void look_at_energy() {
    const auto [all, mechanical] = energies();
    seen_.gain = std::max(seen_.gain, all - seen_.start);
    seen_.energy_most = std::max(seen_.energy_most, mechanical);
    if (!std::isfinite(all)) seen_.finite = false;
  }

  void check_surfaces() {
    std::vector<crossing::Surface> surfaces;
    size_t pierced = 0;
    for (BodyState &b : bodies_) {
      b.x = surface_positions(b.handle);
      for (const double x : b.x) {
        if (!std::isfinite(x)) seen_.finite = false;
        seen_.reach = std::max(seen_.reach, std::fabs(x));
      }
      surfaces.push_back(
          {b.x.data(), uint32_t(b.x.size() / 3), b.triangles.data(), uint32_t(b.triangles.size() / 3)});
    }
    if (!seen_.finite || seen_.reach > 1e6) return;
    for (Wall &w : walls_) {
      dfm_pose pose{};
      ok(dfm_obstacle_get_pose(w.handle, &pose));
      if (w.surface.tris.empty()) {
        for (const BodyState &b : bodies_) pierced += inside(w, pose, b.x);
        continue;
      }
      w.x = w.surface.points;
      for (size_t i = 0; i < w.x.size(); i += 3) {
        const auto at = turned(pose.rotation, &w.surface.points[i], 1);
        for (size_t k = 0; k < 3; ++k) w.x[i + k] = at[k] + pose.position[k];
      }
      surfaces.push_back({w.x.data(), uint32_t(w.x.size() / 3), w.surface.tris.data(),
                          uint32_t(w.surface.tris.size() / 3), true});
    }
    const crossing::Found found = crossing::Counter().count(surfaces, crossing::Touching::counts);
    seen_.crossings = std::max(seen_.crossings, found.between + pierced);
    seen_.self_last = found.within;
  }

  void sample_path() {
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const dfm_body_measure m = measure(bodies_[b].handle);
      seen_.bodies[b].path.push_back({m.com[0], m.com[1], m.com[2]});
    }
  }

  void finish() {
    look_at_energy();
    check_surfaces();
    seen_.stats = stats(world_);
    for (size_t b = 0; b < bodies_.size(); ++b) {
      const dfm_body_measure m = measure(bodies_[b].handle);
      BodySeen &out = seen_.bodies[b];
      std::copy_n(m.com, 3, out.com.begin());
      std::copy_n(m.angular, 3, out.spin.begin());
      out.volume_ratio = m.volume / m.rest_volume;
      out.inverted = m.inverted;
      out.misfit = misfit(bodies_[b]);
      seen_.speed_last = std::max(seen_.speed_last, m.speed_max);
    }
  }

 private:
  struct BodyState {
    dfm_body handle = 0;
    dfm_body_info info{};
    std::vector<double> rest, x;
    std::vector<uint32_t> cells, triangles;
  };
  struct Wall {
    dfm_obstacle handle = 0;
    dfm_obstacle_def def{};
    Triangles surface;
    std::vector<double> x;
  };

  // With the potential of gravity, and without it.
  std::pair<double, double> energies() const {
    double all = 0, mechanical = 0;
    for (const BodyState &b : bodies_) {
      const dfm_body_measure m = measure(b.handle);
      const double e = m.kinetic + (std::isnan(m.elastic) ? 0 : m.elastic);
      mechanical += e;
      all += e;
      for (int k = 0; k < 3; ++k) all -= m.mass * gravity_[size_t(k)] * m.com[k];
    }
    return {all, mechanical};
  }

  // Surface points inside a plane's, sphere's or capsule's solid side; rounding of a touch is not inside.
  static size_t inside(const Wall &w, const dfm_pose &pose, const std::vector<double> &x) {
    size_t n = 0;
    for (size_t i = 0; i < x.size(); i += 3) {
      const double away[3] = {x[i] - pose.position[0], x[i + 1] - pose.position[1],
                              x[i + 2] - pose.position[2]};
      auto p = turned(pose.rotation, away, -1);
      double distance = p[2];
      if (w.def.shape != DFM_SHAPE_PLANE) {
        const double along = w.def.shape == DFM_SHAPE_CAPSULE ? w.def.half_length : 0;
        p[2] -= std::clamp(p[2], -along, along);
        distance = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) - w.def.radius;
      }
      n += distance < -1e-12;
    }
    return n;
  }

  static double misfit(const BodyState &b) {
    std::vector<double> x(b.rest.size());
    uint32_t n = 0;
    ok(dfm_body_get_state(b.handle, b.info.npoint, x.data(), nullptr, &n));
    const auto length = [](const std::vector<double> &p, size_t i, size_t j) {
      return std::hypot(p[3 * i] - p[3 * j], p[3 * i + 1] - p[3 * j + 1], p[3 * i + 2] - p[3 * j + 2]);
    };
    double most = 0;
    for (size_t c = 0; c < b.cells.size(); c += 4)
      for (size_t i = 0; i < 4; ++i)
        for (size_t j = 0; j < i; ++j) {
          const size_t p = b.cells[c + i], q = b.cells[c + j];
          most = std::max(most, std::fabs(length(x, p, q) / length(b.rest, p, q) - 1));
        }
    return most;
  }

  dfm_world world_;
  Seen &seen_;
  std::array<double, 3> gravity_;
  std::vector<BodyState> bodies_;
  std::vector<Wall> walls_;
};

inline void change_start(dfm_world world, const Settings &how) {
  std::mt19937 random(static_cast<uint32_t>(how.jitter));
  for (const dfm_body body : listed(dfm_world_bodies, world)) {
    dfm_body_info info{};
    info.size = sizeof info;
    ok(dfm_body_get_info(body, &info));
    std::vector<double> x(3 * size_t(info.npoint)), v(x.size());
    uint32_t n = 0;
    ok(dfm_body_get_state(body, info.npoint, x.data(), v.data(), &n));
    const auto found = how.stretch.find(info.name);
    for (size_t k = 0; k < 3; ++k) {
      double lo = HUGE_VAL, hi = -HUGE_VAL;
      for (size_t i = k; i < x.size(); i += 3) {
        lo = std::min(lo, x[i]);
        hi = std::max(hi, x[i]);
      }
      const double by = found == how.stretch.end() ? 1 : found->second[k];
      const double faster = how.jitter_velocity * std::uniform_real_distribution<double>(-1, 1)(random);
      for (size_t i = k; i < x.size(); i += 3) {
        if (by != 1) x[i] = (lo + hi) / 2 + by * (x[i] - (lo + hi) / 2);
        if (how.jitter) v[i] += faster;
      }
    }
    ok(dfm_body_set_state(body, n, x.data(), v.data()));
  }
}

inline std::vector<std::string> assignments(const Settings &how, const std::vector<bool> &directed) {
  std::vector<std::string> out;
  const Combination &c = how.combination;
  if (!c.model.empty())
    for (size_t b = 0; b < directed.size(); ++b) {
      const std::string body = "/bodies/" + std::to_string(b);
      out.push_back(body + "/model={\"type\":\"" + c.model + "\"}");
      if (directed[b] && c.model != "msm") out.push_back(body + "/anisotropy/params={}");
    }
  if (c.integrator == "explicit") out.push_back("/time/integrator=symplectic_euler");
  if (c.integrator == "implicit") out.push_back("/time/integrator=implicit_euler");
  out.insert(out.end(), how.set.begin(), how.set.end());
  return out;
}

}  // namespace detail

// Bodies of a scene file, found without a reader by opening it once: has each parameters of a direction?
// Those are of the model that the scene names.
inline std::vector<bool> bodies_of(dfm_context *context, const std::string &path) {
  std::vector<bool> out;
  dfm_scene scene = 0;
  if (dfm_scene_open(context, path.c_str(), nullptr, &scene) != DFM_OK) return out;
  const auto has = [&](const std::string &key) {
    size_t bytes = 0;
    return dfm_scene_value(scene, ("/bodies/" + std::to_string(out.size()) + key).c_str(), nullptr, &bytes) ==
           DFM_OK;
  };
  while (has("/name")) out.push_back(has("/anisotropy/params"));
  ok(dfm_scene_close(scene));
  return out;
}

inline Seen run(const std::string &path, const Settings &how) {
  Seen seen;
  Context context;
  std::vector<std::string> set = detail::assignments(how, bodies_of(context, path));
  std::vector<const char *> texts;
  for (const std::string &s : set) texts.push_back(s.c_str());
  dfm_scene_options options{};
  options.size = sizeof options;
  options.nset = uint32_t(texts.size());
  options.set = texts.data();
  options.jitter_seed = how.jitter_velocity > 0 ? 0 : how.jitter;
  dfm_scene scene = 0;
  seen.status = dfm_scene_open(context, path.c_str(), &options, &scene);
  if (seen.status != DFM_OK) {
    seen.reason = dfm_last_error();
    return seen;
  }
  seen.loaded = true;
  dfm_world world = 0;
  ok(dfm_scene_world(scene, &world));
  dfm_scene_settings settings{};
  settings.size = sizeof settings;
  ok(dfm_scene_get_settings(scene, &settings));
  if ((how.jitter && how.jitter_velocity > 0) || !how.stretch.empty()) detail::change_start(world, how);
  dfm_obstacle hand = 0;
  dfm_pose at{};
  for (const dfm_obstacle o : listed(dfm_world_obstacles, world)) {
    dfm_obstacle_def def{};
    def.size = sizeof def;
    ok(dfm_obstacle_get_def(o, &def));
    if (how.hand.obstacle != def.name) continue;
    hand = o;
    ok(dfm_obstacle_get_pose(o, &at));
  }
  double step = how.combination.step > 0 ? how.combination.step : settings.step;
  if (!(step > 0)) ok(dfm_world_stable_step(world, &step, nullptr, nullptr));
  const double duration = how.duration > 0 ? how.duration : settings.duration;
  const uint64_t steps = uint64_t(std::ceil(duration / step - 1e-9));
  detail::Observer observer(scene, world, seen);
  // Every step of a short run is looked at, and a thousand of a long one.
  const uint64_t look = std::max<uint64_t>(1, steps / 1000), sample = std::max<uint64_t>(1, steps / 100);
  const double begin = detail::cpu_now();
  double looking = 0;
  while (seen.steps < steps) {
    const double t = double(seen.steps) * step;
    if (hand && t >= how.hand.begin && t < how.hand.end) {
      for (size_t k = 0; k < 3; ++k) at.position[k] += step * how.hand.velocity[k];
      seen.status = dfm_obstacle_move_to(hand, &at);
    }
    if (seen.status == DFM_OK) seen.status = dfm_world_step(world, step, nullptr);
    if (seen.status != DFM_OK) {
      seen.reason = dfm_last_error();
      break;
    }
    ++seen.steps;
    const double seeing = detail::cpu_now();
    if (seen.steps % look == 0) {
      observer.look_at_energy();
      observer.check_surfaces();
    }
    if (seen.steps % sample == 0) observer.sample_path();
    const double now = detail::cpu_now();
    looking += now - seeing;
    if (how.cpu_seconds > 0 && now - begin > how.cpu_seconds) {
      seen.in_time = seen.steps == steps;
      break;
    }
  }
  seen.cpu = detail::cpu_now() - begin - looking;
  seen.time = dfm_world_time(world);
  observer.finish();
  ok(dfm_scene_close(scene));
  return seen;
}

}  // namespace test::suite
