// The rigid-limit cases of reference/contact, run with stiff `msm` bodies. The test compares some
// rows, the bench prints all of them.
#pragma once
#include <functional>
#include <memory>

#include "cells.h"
#include "coupled.h"

namespace test::reference {

inline constexpr double kG = 9.81, kDegree = 3.14159265358979323846 / 180;
using Vector = std::array<double, 3>;
inline Vector tilted(double theta_deg) {
  return {kG * std::sin(theta_deg * kDegree), 0, -kG * std::cos(theta_deg * kDegree)};
}

struct Friction {
  double mu_s, mu_c;
  const char *law = "coulomb";
  double dv = 0;
};

// Along x, to all points.
inline void add_speed(dfm_body body, double speed) {
  auto [x, v] = State(body);
  const uint32_t n = uint32_t(x.size() / 3);
  for (uint32_t i = 0; i < n; ++i) v[3 * i] += speed;
  ok(dfm_body_set_state(body, n, x.data(), v.data()));
}

// A block on a plane at z = 0 whose surface may run as a belt along x.
struct Block {
  Context context;
  dfm_world world;
  dfm_body body;
  Vector start{};
  struct Shape {
    Vector size{0.1, 0.1, 0.1};
    uint32_t cells = 96;
    double density = 1000, young = 1e7, damping = 2e-4;
  };

  Block(const Friction &f, Vector gravity, const Shape &s, double belt = 0) {
    world = make_world(context, gravity);
    BodyOptions o;
    o.name = "block";
    o.density = s.density;
    o.young = s.young;
    o.damping_stiffness = s.damping;
    o.velocity = {belt, 0, 0};
    o.position = {-s.size[0] / 2, -s.size[1] / 2, 2e-4 * s.size[2]};
    body = make_body(context, world, "beam", s.size, s.cells, o);
    dfm_obstacle_def d = dfm_obstacle_def_default();
    d.name = "floor";
    d.shape = DFM_SHAPE_PLANE;
    d.velocity_surface[0] = belt;
    dfm_obstacle floor = 0;
    ok(dfm_obstacle_create(world, &d, &floor));
    LawValues values = {{"mu_C", f.mu_c}, {"mu_S", f.mu_s}};
    if (f.mu_c != f.mu_s)  // from rest to kinetic friction at once
      values.insert(values.end(), {{"v_s", 1e-9}, {"delta", 2}});
    if (f.mu_c != f.mu_s && f.dv > 0) values.push_back({"dv", f.dv});
    ok(add_friction(world, f.law, values));
    mark();
  }
  ~Block() { dfm_world_destroy(world); }
  dfm_body_measure now() const { return measure(body); }
  void mark() { std::copy_n(now().com, 3, start.begin()); }
  double traveled() const { return now().com[0] - start[0]; }
  void push(double speed) { add_speed(body, speed); }
};

// Mean acceleration after the first 0.1 s, and how far it went in the rest of the second.
struct Incline { double acceleration, creep; };
inline Incline incline(double theta_deg, double mu) {
  Block b({mu, mu}, tilted(theta_deg), {});
  run(b.world, 0.1, 1e-3);
  b.mark();
  const double v = b.now().velocity[0];
  run(b.world, 0.4, 1e-3);
  const double a = (b.now().velocity[0] - v) / 0.4;
  if (std::fabs(b.traveled()) < 0.01) run(b.world, 0.5, 1e-3);  // it holds: watch it for the whole second
  return {a, b.traveled()};
}

// Pushed to v0 over a floor at rest, or held back to rest on a belt of that speed: time and way until
// both move as one.
struct Slide { double time, distance; };
inline Slide slide(double v0, double mu, bool belt) {
  Block b({mu, mu}, {0, 0, -kG}, {}, belt ? v0 : 0);
  run(b.world, 0.3, 1e-3);
  b.push(belt ? -v0 : v0);
  b.mark();
  const double end = belt ? v0 : 0, h = 5e-4;
  double t = 0, before = v0;
  int steps = 0;
  for (; t < 5; t += h) {
    run(b.world, h, h);
    ++steps;
    const double left = std::fabs(b.now().velocity[0] - end);
    if (left <= 5e-3 * v0) {
      t += h * (before - 5e-3 * v0) / (before - left);
      break;
    }
    before = left;
  }
  return {t, std::fabs((belt ? v0 * steps * h : 0) - b.traveled())};
}

// Thrown across an incline: where it is and how fast at the given times.
struct Oblique { double t, across, down, v_across, v_down; };
inline std::vector<Oblique> oblique(double theta_deg, double mu, double v0,
                                    const std::vector<double> &times) {
  Block b({mu, mu}, tilted(theta_deg), {});
  auto [x, v] = State(b.body);
  const uint32_t n = uint32_t(x.size() / 3);
  for (uint32_t i = 0; i < n; ++i) v[3 * i + 1] += v0;
  ok(dfm_body_set_state(b.body, n, x.data(), v.data()));
  std::vector<Oblique> out;
  double t = 0;
  for (const double at : times) {
    run(b.world, at - t, 1e-3);
    t = at;
    const dfm_body_measure m = b.now();
    out.push_back({t, m.com[1] - b.start[1], m.com[0] - b.start[0], m.velocity[1], m.velocity[0]});
  }
  return out;
}

// Gravity leans over within half a second; does the block lie on its side 1.5 s later?
inline bool topples(double theta_deg, double ratio) {
  const Vector size{0.1 * ratio, 0.05, 0.1};
  Block b({1, 1}, {0, 0, -kG}, {size, 60, 1000, 1e6, 1e-3});
  std::vector<dfm_vector_key> keys;
  for (int i = 0; i <= 100; ++i) {
    const double s = i / 100.0, a = theta_deg * s * s * (3 - 2 * s);
    const Vector g = tilted(a);
    keys.push_back({0.2 + 0.5 * s, {g[0], g[1], g[2]}});
  }
  ok(dfm_world_set_gravity_keys(b.world, uint32_t(keys.size()), keys.data()));
  for (int k = 0; k < 22; ++k) {
    run(b.world, 0.1, 1e-3);
    if (b.now().com[2] < 0.75 * 0.05) return true;
  }
  return false;
}

// The points that stand on something, and each one's share of the load.
inline void feet(dfm_body body, std::vector<uint32_t> *points, std::vector<double> *shares) {
  uint32_t n = 0;
  ok(dfm_surface_points(body, 0, nullptr, &n));
  std::vector<uint32_t> point(n);
  std::vector<double> force(3 * n);
  ok(dfm_surface_points(body, n, point.data(), &n));
  ok(dfm_surface_forces(body, n, force.data(), &n));
  double sum = 0;
  for (uint32_t s = 0; s < n; ++s) sum += force[3 * s + 2];
  for (uint32_t s = 0; s < n; ++s)
    if (force[3 * s + 2] > 0) {
      points->push_back(point[s]);
      shares->push_back(force[3 * s + 2] / sum);
    }
}

// A mass on a belt, held by a spring to the ground. The spring pulls at the feet, each by its share of the
// load: pulled at its center the block would lean, and the contacts that carry less would slip before the
// others, as those of a real block do.
struct StickSlip {
  double period, x_max, x_min;
  int cycles;
};
inline StickSlip stick_slip(double m, double k, double f_s, double f_k, double belt, double h, double until,
                            double dv, const char *law = "karnopp") {
  const double w = m * kG;
  Block::Shape s;
  // Stiff, so that its own shaking, about (F_s - F_k) / sqrt(stiffness mass), stays below the slip: a softer
  // block catches itself on the way.
  s.cells = 12;
  s.density = 1000 * m;
  s.young = 1e8 * m;
  s.damping = 1e-4;
  Block b({f_s / w, f_k / w, law, dv}, {0, 0, -kG}, s, belt);
  run(b.world, 0.3, h);
  b.mark();
  // A turn counts once x has come back from it by a twentieth of the swing; the first cycle starts from rest
  // and is left out.
  std::vector<uint32_t> points;
  std::vector<double> weights, force;
  feet(b.body, &points, &weights);
  force.resize(3 * points.size());
  uint32_t load = 0;
  const double enough = 0.05 * 2 * (f_s - f_k) / k;
  double top = 0, low = 0, t_top = 0, first = 0, last = 0, x_max = 0, x_min = 0;
  int tops = 0;
  bool rising = true;
  for (double t = 0; t < until; t += h) {
    for (size_t i = 0; i < points.size(); ++i) force[3 * i] = -k * b.traveled() * weights[i];
    if (load) ok(dfm_body_remove_load(b.body, load));
    ok(dfm_body_add_load(b.body, uint32_t(points.size()), points.data(), force.data(), 0, nullptr, nullptr,
                         &load));
    run(b.world, h, h);
    const double x = b.traveled();
    if (rising && x > top) {
      top = x;
      t_top = t;
    }
    if (!rising && x < low) low = x;
    if (rising && x < top - enough) {
      rising = false;
      low = x;
      if (tops++ == 0) first = t_top;
      else x_max += top;
      last = t_top;
    } else if (!rising && x > low + enough) {
      rising = true;
      top = x;
      x_min += low;
    }
  }
  const int n = tops - 1;
  return n > 0 ? StickSlip{(last - first) / n, x_max / n, x_min / (rising ? n + 1 : n), n} : StickSlip{};
}

// Round bodies of radius 0.05 m: coarse cells that wear a fine surface. A thin one keeps its mass in a skin
// of a twentieth of its radius, which light cells hold in shape.
struct RoundShape {
  const char *name;
  bool ball, thin;
};
inline constexpr RoundShape kRounds[] = {{"solid sphere", true, false},
                                         {"thin hollow sphere", true, true},
                                         {"solid cylinder", false, false},
                                         {"thin hoop", false, true}};
struct RoundMesh {
  uint32_t cells, facets;
  double young;
};
// What a skid is short of is the facets' doing (doc/reference/contact_reference.md); light cells cost
// many sub-steps.
inline RoundMesh round_mesh(const RoundShape &shape, bool skids) {
  const bool fine = skids && !shape.thin;
  return {fine ? 4000u : 2500u, fine ? 24000u : 6000u, 2e6};
}

struct Round {
  Context context;
  dfm_world world;
  dfm_body body;
  double radius = 0.05, inertia = 0;  // inertia: kg m2 about y
  Round(const RoundShape &shape, double mu, Vector gravity, const RoundMesh &fine) {
    world = make_world(context, gravity);
    const double length = shape.ball ? 0 : radius;
    const char *const kind = shape.ball ? "ball" : "cylinder";
    Cells cells = make_cells(context, kind, {radius, length, 0}, fine.cells);
    const auto from_axis = [&](const double *p) {
      return std::sqrt(p[0] * p[0] + p[1] * p[1] + (shape.ball ? p[2] * p[2] : 0));
    };
    CellMaterials light_inside{{{2000, fine.young}, {4, 0.1 * fine.young}}, nullptr};
    if (shape.thin) {
      double inner = 0;
      for (uint32_t i = 0; i < cells.npoint(); ++i) {
        const double r = from_axis(cells.point(i));
        if (r < 0.999 * radius) inner = std::max(inner, r);
      }
      std::vector<uint8_t> outside(cells.npoint());
      for (uint32_t i = 0; i < cells.npoint(); ++i) {
        outside[i] = from_axis(cells.point(i)) > 0.999 * radius;
        for (int k = 0; !outside[i] && k < (shape.ball ? 3 : 2); ++k)
          cells.points[3 * size_t(i) + size_t(k)] *= 0.95 * radius / inner;
      }
      light_inside.kind = [&cells, outside](uint32_t t) {
        const uint32_t *const q = cells.tet(t);
        return outside[q[0]] || outside[q[1]] || outside[q[2]] || outside[q[3]] ? 0u : 1u;
      };
    }
    const auto density = [&](uint32_t t) {
      return shape.thin ? light_inside.materials[light_inside.kind(t)].density : 1000;
    };
    const std::vector<double> mass = cells.lumped(density);
    for (uint32_t i = 0; i < cells.npoint(); ++i) {  // about its own axis; a ball's three are the same
      const double r = from_axis(cells.point(i));
      inertia += (shape.ball ? 2.0 / 3 : 1) * mass[i] * r * r;
    }
    const double size[3] = {radius, length, 0};
    dfm_mesh_handle mesh = 0;
    ok(dfm_mesh_make(context, kind, size, DFM_MESH_SURFACE, fine.facets, &mesh));
    const dfm_mesh_info info = info_of(mesh);
    const double *const points = info.points;
    const uint32_t *const triangles = info.faces;
    const dfm_surface_def skin{
        sizeof(dfm_surface_def), DFM_COUPLING_BARYCENTRIC, info.npoint, info.ntriangle, points, triangles, 0};
    BodyOptions o;
    o.young = fine.young;
    o.damping_stiffness = 2e-5;
    o.volume = 1;
    o.surface = &skin;
    // the ball starts on no face, edge or corner in particular; the cylinder lies along y, turned a little
    // about its axis
    const double half = 45 * kDegree;
    if (shape.ball) {
      o.rotation = {0.0848, 0.1696, 0.2544, 0.9483};
      o.position = {0, 0, 0.9995 * radius};
    } else {
      o.rotation = {std::sin(-half), 0, 0, std::cos(half)};
      o.position = {0, -radius / 2, 0.9999 * radius};
    }
    body = make_body(world, cells, o, shape.thin ? &light_inside : nullptr);
    ok(dfm_mesh_destroy(mesh));
    add_plane(world, "incline");
    set_friction(world, mu);
  }
  ~Round() { dfm_world_destroy(world); }
  double speed() const { return measure(body).velocity[0]; }
  double turning() const { return measure(body).angular[1] / inertia * radius; }  // R omega
  // Carried down through a syrup, which is gone afterwards: it stands still.
  void set_down(double seconds) {
    set_drag(150);
    run(world, seconds, 1e-3);
    set_drag(0);
  }
  void set_drag(double per_second) {
    const dfm_param_value drag{"damping_mass", &per_second, 1};
    const dfm_params params{sizeof(dfm_params), 1, &drag};
    ok(dfm_body_set_params(body, &params));
  }
  void push(double speed) { add_speed(body, speed); }
};

// Slopes of speed and R omega over 0.3 s by least squares.
struct Roll { double acceleration, turning; };
inline Roll roll(const RoundShape &shape, double theta_deg, double mu, double h = 2e-4) {
  Round r(shape, mu, tilted(theta_deg), round_mesh(shape, false));
  r.set_down(0.1);
  run(r.world, 0.04, h);
  constexpr int kSamples = 75;
  double tt = 0, tv = 0, tw = 0;
  for (int i = 0; i < kSamples; ++i) {
    const double t = (i - 0.5 * (kSamples - 1)) * 4e-3;
    tt += t * t;
    tv += t * r.speed();
    tw += t * r.turning();
    run(r.world, 4e-3, h);
  }
  return {tv / tt, tw / tt};
}

// Set down, then pushed without spin: when it rolls, at what speed, and how far it came. It rolls from where
// the line through its slip (between nine and two tenths of the start) ends: facets shake the slip itself.
struct Skid { double time, speed, distance; };
inline Skid skid(const RoundShape &shape, double v0, double mu, double h = 2e-4) {
  Round r(shape, mu, tilted(0), round_mesh(shape, true));
  r.set_down(0.2);
  r.push(v0);
  const double x0 = measure(r.body).com[0];
  std::vector<double> slip{v0}, x{0};
  while (slip.back() > 0.01 * v0 && slip.size() * h < 3) {
    run(r.world, h, h);
    const dfm_body_measure m = measure(r.body);
    slip.push_back(m.velocity[0] - m.angular[1] / r.inertia * r.radius);
    x.push_back(m.com[0] - x0);
  }
  double n = 0, st = 0, ss = 0, stt = 0, sts = 0;
  for (size_t i = 0; i < slip.size(); ++i) {
    if (slip[i] > 0.9 * v0 || slip[i] < 0.2 * v0) continue;
    const double t = double(i) * h;
    n += 1;
    st += t;
    ss += slip[i];
    stt += t * t;
    sts += t * slip[i];
  }
  const double slope = (n * sts - st * ss) / (n * stt - st * st), time = st / n - ss / n / slope;
  run(r.world, 0.02, h);
  double sum = 0;
  for (int i = 0; i < 10; ++i) {
    run(r.world, 2e-3, h);
    sum += r.speed() / 10;
  }
  const size_t at = std::min(size_t(time / h), x.size() - 1), next = std::min(at + 1, x.size() - 1);
  return {time, sum, x[at] + (time / h - double(at)) * (x[next] - x[at])};
}

}  // namespace test::reference
