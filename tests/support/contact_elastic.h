// The elastic cases of reference/contact with `msm` bodies: what the model makes of Hertz, Mindlin,
// squeezed bodies, impacts and stacks.
#pragma once
#include <algorithm>
#include <memory>
#include <utility>

#include "cells.h"
#include "zoned.h"

namespace test::elastic {

using Vector = std::array<double, 3>;

// The volume term that gives a Poisson ratio of 1/4 or more exactly (doc/models/msm.md).
inline double volume_for(double nu) { return nu > 0.25 ? 3 * (4 * nu - 1) / (2 * (1 + nu)) : 0; }

// A ball whose cells become finer toward its south pole, (1 + s)/(1 - s) times those of the plain one there
// and as much coarser at the other. The map is a Moebius map of the ball onto itself (Ahlfors 1981): it
// keeps angles, hence the shape of cells and the even directions of springs. The poles are the middles of
// two faces of the generator's icosahedron, points of the mesh where 3 divides the layers: the lattice is
// regular there. A corner, where five cones meet, is stiff along the axis and soft across it: depth -5 %,
// tangential shift +35 %.
inline Cells graded_ball(dfm_context *c, double radius, uint32_t layers, double s) {
  Cells ball = make_cells(c, "ball", {radius, 0, 0}, 20 * layers * layers * layers);
  // The innermost layer has the twelve corners; u: the middle of a face, three corners that are nearest
  // to each other.
  std::vector<std::array<double, 3>> corner;
  for (size_t i = 0; i < ball.points.size(); i += 3) {
    const double *const p = &ball.points[i];
    const double r = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) * layers / radius;
    if (std::fabs(r - 1) < 1e-6)
      corner.push_back({p[0] * layers / radius, p[1] * layers / radius, p[2] * layers / radius});
  }
  const auto near = [](const auto &a, const auto &b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > 0.4 && a != b;
  };
  double u[3] = {};
  for (const auto &p : corner)
    for (const auto &q : corner)
      if (u[0] == 0 && u[1] == 0 && u[2] == 0 && near(corner[0], p) && near(corner[0], q) && near(p, q))
        for (size_t k = 0; k < 3; ++k) u[k] = corner[0][k] + p[k] + q[k];
  const double length = std::sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
  for (double &x : u) x /= length;
  // turns u to t = -e_z: x - (u + t) ((u + t).x) / (1 + u.t) + 2 t (u.x)
  for (size_t i = 0; i < ball.points.size(); i += 3) {
    double *const p = &ball.points[i];
    const double ux = u[0] * p[0] + u[1] * p[1] + u[2] * p[2], share = (ux - p[2]) / (1 - u[2]);
    p[0] -= share * u[0];
    p[1] -= share * u[1];
    p[2] -= share * (u[2] - 1) + 2 * ux;
  }
  for (size_t i = 0; i < ball.points.size(); i += 3) {
    double *const p = &ball.points[i], x[3] = {p[0] / radius, p[1] / radius, p[2] / radius};
    const double xx = x[0] * x[0] + x[1] * x[1] + x[2] * x[2];
    const double to = xx - 2 * s * x[2] + s * s;
    const double below = 1 - 2 * s * x[2] + s * s * xx;
    for (int k = 0; k < 3; ++k)
      p[k] = radius * ((1 - s * s) * (x[k] - (k == 2 ? s : 0)) - (k == 2 ? to * s : 0)) / below;
  }
  return ball;
}

// A disc of the cylinder generator with its axis along y: `rings` cells from the middle to the
// rim, two thick.
inline Cells disc(dfm_context *c, double radius, uint32_t rings) {
  Cells cells = make_cells(c, "cylinder", {radius, 2 * radius / rings, 0}, 18 * rings * rings * 2);
  for (size_t i = 0; i < cells.points.size(); i += 3) {
    const double y = cells.points[i + 1];
    cells.points[i + 1] = cells.points[i + 2];
    cells.points[i + 2] = -y;
  }
  return cells;
}

// Statics asks nothing of the density: cells are as heavy as makes their step that of a cell of size `even`,
// in steps of a half octave.
inline CellMaterials even_step(const Cells &cells, double density, double young, double even) {
  CellMaterials m;
  constexpr int kMax = 24;
  for (int k = -kMax; k <= kMax; ++k) m.materials.push_back({density * std::pow(2, 0.5 * k), young});
  m.kind = [&cells, even](uint32_t t) {
    const double size = std::cbrt(6 * std::sqrt(2.0) * cells.volume(t));
    return uint32_t(kMax + std::clamp(std::lround(4 * std::log2(even / size)), long(-kMax), long(kMax)));
  };
  return m;
}

// N; sqrt of the force's second moment about its middle, m; share of
struct Touch {
  double force = 0, reach = 0, stick = 0;
  uint32_t points = 0;
};
// the touching area that
// sticks; contacts that carry
template <class Counts>
Touch touch(dfm_world world, bool line, Counts counts) {
  Touch t;
  double at[2] = {}, square = 0, area = 0;
  const std::vector<dfm_contact> all = contacts(world);
  for (const dfm_contact &c : all)
    if (c.fn > 0 && counts(c)) {
      t.force += c.fn;
      ++t.points;
      area += c.area;
      t.stick += c.flags & 1 ? c.area : 0;
      for (int k = 0; k < 2; ++k) at[k] += c.fn * c.point[k];
    }
  if (!t.points) return t;
  for (double &x : at) x /= t.force;
  for (const dfm_contact &c : all)
    if (c.fn > 0 && counts(c))
      square += c.fn * (std::pow(c.point[0] - at[0], 2) + (line ? 0 : std::pow(c.point[1] - at[1], 2)));
  t.reach = std::sqrt(square / t.force);
  t.stick /= area;
  return t;
}

// A ball, or a disc of a long cylinder, between a plane at z = 0 and one that comes down. It starts with its
// middle at height R. Static: cells are as heavy as makes the step even, drag takes the motion out.
struct Pressed {
  Context context;
  dfm_world world = 0;
  dfm_obstacle bottom = 0, top = 0;
  // partner: a second ball below, upside down; the pole in question is between the two
  dfm_body body = 0, partner = 0;
  Cells cells, flipped;
  std::vector<double> volume;  // of every point
  double R, offset, gap = 0, h = 0, period = 0;
  bool line;
  std::vector<uint32_t> axis;  // points whose x and y are held

  // depth: about what it will be pressed in, at the force `load`; stiffness and drag are taken from it.
  Pressed(const std::function<Cells(dfm_context *)> &mesh, double radius, bool is_line, double even,
          double young, double nu, double load, double depth, bool two = false)
      : R(radius), offset(2e-5 * radius), line(is_line) {
    dfm_world_def wd = dfm_world_def_default();
    wd.gravity[2] = 0;
    wd.contact_offset = offset;
    ok(dfm_world_create(context, &wd, &world));
    cells = mesh(context);
    volume = cells.lumped([](uint32_t) { return 1.0; });
    const CellMaterials materials = even_step(cells, 1000, young, even);
    const std::vector<double> mass =
        cells.lumped([&](uint32_t t) { return materials.materials[materials.kind(t)].density; });
    double all = 0;
    for (const double m : mass) all += m;
    const double rate = std::sqrt(3 * load / depth / all);  // both contacts, each 3/2 F/depth
    period = 6.28 / rate;
    BodyOptions o;
    o.name = "soft";
    o.poisson = nu;
    o.volume = volume_for(nu);
    o.damping_mass = 1.4 * rate;
    o.position = {0, 0, R + offset};
    std::vector<uint8_t> fixed(cells.npoint(), uint8_t(line ? 2 : 0));
    for (const double height : {-0.3 * R, 0.5 * R}) {  // it must not roll away
      uint32_t best = 0;
      const auto far = [&](uint32_t i) {
        const double *const p = cells.point(i);
        return std::hypot(p[0], line ? 0 : p[1], 0.02 * (p[2] - height));
      };
      for (uint32_t i = 1; i < cells.npoint(); ++i)
        if (far(i) < far(best)) best = i;
      axis.push_back(best);
      fixed[best] = uint8_t(fixed[best] | 3);
    }
    body = make_body(world, cells, o, &materials, fixed.data());
    if (two) {
      flipped = cells;
      for (size_t i = 0; i < flipped.points.size(); i += 3) {
        flipped.points[i + 1] = -flipped.points[i + 1];
        flipped.points[i + 2] = -flipped.points[i + 2];
      }
      o.name = "partner";
      o.position = {0, 0, -R};
      partner = make_body(world, flipped, o, &materials, fixed.data());
    }
    bottom = add_plane(world, "bottom", {0, 0, two ? -2 * R - offset : 0});
    top = add_plane(world, "top", {0, 0, 2 * (R + offset)}, {1, 0, 0, 0});
    set_friction(world, 0, "none");
    run(world, 1e-9 * period, 1e-9 * period);
    h = stats(world).stable_step;
  }
  ~Pressed() { dfm_world_destroy(world); }

  // Moves the upper plane down by `travel` in all, and waits.
  void press(double travel) {
    const int n = int(std::ceil(1.5 * period / h));
    for (int i = 1; i <= n; ++i) {
      const double u = double(i) / n, s = u * u * (3 - 2 * u);
      const dfm_pose pose{{0, 0, 2 * (R + offset) - gap - s * (travel - gap)}, {1, 0, 0, 0}};
      ok(dfm_obstacle_move_to(top, &pose));
      run(world, h, h);
    }
    gap = travel;
    settle();
  }
  void settle() {
    double last = 0;
    for (int k = 0; k < 12; ++k) {
      run(world, std::ceil(0.5 * period / h) * h, h);
      const double now = below().force, above = force_above();
      if (std::fabs(now - last) < 1e-3 * now && std::fabs(now - above) < 2e-3 * now) return;
      last = now;
    }
  }
  Touch below() const {
    return touch(world, line,
                 [this](const dfm_contact &c) { return partner ? c.kind != 2 : c.point[2] < R; });
  }
  double force_above() const {
    return touch(world, line, [this](const dfm_contact &c) { return c.point[2] > R; }).force;
  }
  double approach() const {
    return R + offset - frame(body, cells).height + (partner ? R + frame(partner, flipped).height : 0);
  }
  double surfel() const {  // mean edge of the surface around the lower pole
    double best = 1e300;
    for (uint32_t t = 0; t < cells.ntet(); ++t)
      best = std::min(best, std::cbrt(6 * std::sqrt(2.0) * cells.volume(t)));
    return best;
  }

  // Friction at the lower plane, and a force along x at the middle with the couple that keeps the
  // body from rolling.
  void shear(double force) {
    double inertia = 0, all = 0, middle = 0;
    for (uint32_t i = 0; i < cells.npoint(); ++i) {
      all += volume[i];
      middle += volume[i] * cells.point(i)[2];
    }
    middle /= all;
    const auto arm = [&](uint32_t i) { return cells.point(i)[2] - middle; };
    for (uint32_t i = 0; i < cells.npoint(); ++i)
      inertia += volume[i] * (std::pow(cells.point(i)[0], 2) + std::pow(arm(i), 2));
    const double turn = -force * (R + middle) / inertia;
    std::vector<uint32_t> points(cells.npoint());
    std::vector<double> f(3 * size_t(cells.npoint()));
    for (uint32_t i = 0; i < cells.npoint(); ++i) {
      points[i] = i;
      f[3 * size_t(i)] = volume[i] * (force / all + turn * arm(i));
      f[3 * size_t(i) + 2] = -volume[i] * turn * cells.point(i)[0];
    }
    if (shear_load) ok(dfm_body_remove_load(body, shear_load));
    else ok(dfm_body_hold(body, uint32_t(axis.size()), axis.data(), 0));
    ok(dfm_body_add_load(body, uint32_t(points.size()), points.data(), f.data(), 0, nullptr, nullptr,
                         &shear_load));
    run(world, std::ceil(2 * period / h) * h, h);
  }
  uint32_t shear_load = 0;

  // The middle as a rigid frame: least squares over the points within R/2 of it, by volume.
  struct Frame { double height, shift, turn; };  // of the middle, m; rotation about y
  Frame frame() const { return frame(body, cells); }
  Frame frame(dfm_body of, const Cells &at_rest) const {
    const std::vector<double> x = State(of).x;
    const uint32_t n = uint32_t(x.size() / 3);
    double w = 0, mean[3] = {}, u[3] = {};
    const auto inside = [&](uint32_t i) {
      const double *const p = at_rest.point(i);
      return p[0] * p[0] + (line ? 0 : p[1] * p[1]) + p[2] * p[2] < 0.25 * R * R;
    };
    for (uint32_t i = 0; i < n; ++i)
      if (inside(i)) {
        w += volume[i];
        for (size_t k = 0; k < 3; ++k) {
          mean[k] += volume[i] * at_rest.point(i)[k];
          u[k] += volume[i] * (x[3 * i + k] - at_rest.point(i)[k]);
        }
      }
    for (int k = 0; k < 3; ++k) {
      mean[k] /= w;
      u[k] /= w;
    }
    double xx = 0, zz = 0, xz = 0, ux_x = 0, ux_z = 0, uz_x = 0, uz_z = 0;
    for (uint32_t i = 0; i < n; ++i)
      if (inside(i)) {
        const double *const p = at_rest.point(i);
        const double dx = p[0] - mean[0];
        const double dz = p[2] - mean[2];
        const double du = x[3 * i] - p[0] - u[0];
        const double dw = x[3 * i + 2] - p[2] - u[2];
        xx += volume[i] * dx * dx;
        zz += volume[i] * dz * dz;
        xz += volume[i] * dx * dz;
        ux_x += volume[i] * du * dx;
        ux_z += volume[i] * du * dz;
        uz_x += volume[i] * dw * dx;
        uz_z += volume[i] * dw * dz;
      }
    const double det = xx * zz - xz * xz;
    const double dux_dx = (ux_x * zz - ux_z * xz) / det, dux_dz = (ux_z * xx - ux_x * xz) / det;
    const double duz_dx = (uz_x * zz - uz_z * xz) / det, duz_dz = (uz_z * xx - uz_x * xz) / det;
    return {u[2] - duz_dx * mean[0] - duz_dz * mean[2], u[0] - dux_dx * mean[0] - dux_dz * mean[2],
            0.5 * (dux_dz - duz_dx)};
  }
};

// What a ball of cells graded for a contact of radius a makes of Hertz: all against the closed form at the
// force that was reached.
inline double grading(double a_over_R) {
  return std::max(0.0, 1 - 2 / (1 + std::max(1.0, 0.357 / a_over_R)));
}
// E*, against something rigid
struct Sphere {
  double R, young, nu;
  double stiffness() const { return young / (1 - nu * nu); }
};
inline double hertz_radius(const Sphere &s, double force) {
  return std::cbrt(3 * force * s.R / (4 * s.stiffness()));
}

// Presses until the middle has come near by `depth`: facets and the upper contact take their share of
// the plane's way.
inline void reach(Pressed &p, double depth) {
  double travel = 2 * depth;
  for (int k = 0; k < 5; ++k) {
    p.press(travel);
    const double left = depth - p.approach();
    if (std::fabs(left) < 0.02 * depth) return;
    travel += 1.5 * left;
  }
}

// A ball between planes, or two balls; depth: of one.
inline std::unique_ptr<Pressed> pressed_ball(const Sphere &s, double depth, uint32_t layers,
                                             double longer = 1, bool two = false) {
  const double a = std::sqrt(s.R * depth);
  const double force = 4.0 / 3 * s.stiffness() * std::sqrt(s.R) * std::pow(depth, 1.5);
  auto p =
      std::make_unique<Pressed>([&](dfm_context *c) { return graded_ball(c, s.R, layers, grading(a / s.R)); },
                                s.R, false, s.R / layers, s.young, s.nu, force, depth, two);
  p->h *= longer;
  reach(*p, two ? 2 * depth : depth);
  return p;
}

// A disc between plates, pressed until its middle has come near by `depth`; `load`: about what
// that takes, N/m.
inline std::unique_ptr<Pressed> pressed_disc(double R, double young, double nu, double depth, double load,
                                             uint32_t rings) {
  auto p = std::make_unique<Pressed>([&](dfm_context *c) { return disc(c, R, rings); }, R, true, R / rings,
                                     young, nu, load * 2 * R / rings, depth);
  reach(*p, depth);
  return p;
}

// A long cylinder on a plane: the block of ten times five half widths around the line, its lower face curved
// by 1/R, its upper face held, y held everywhere; the plane comes up until it carries about `load`, N/m.
struct Line {
  double load, half_width;
  uint32_t points;
};
inline Line pressed_line(double R, double young, double nu, double load, uint32_t across) {
  Context context;
  const double a = std::sqrt(4 * load * R * (1 - nu * nu) / (3.14159265358979323846 * young));
  const double edge = a / across;
  const double width = 10 * a;
  const double height = 5 * a;
  dfm_world_def wd = dfm_world_def_default();
  wd.gravity[2] = 0;
  wd.contact_offset = 1e-4 * a * a / R;
  dfm_world world = 0;
  ok(dfm_world_create(context, &wd, &world));
  Cells cells = make_cells(context, "beam", {width, 2 * edge, height}, 12 * (10 * across) * 2 * (5 * across));
  std::vector<uint8_t> fixed(cells.npoint(), 2);
  for (uint32_t i = 0; i < cells.npoint(); ++i) {
    double *const p = &cells.points[3 * size_t(i)];
    if (p[2] > 0.9999 * height) fixed[i] = 7;
    p[0] -= width / 2;
    p[2] += p[0] * p[0] / (2 * R) * (1 - p[2] / height);
  }
  const double speed = 10;  // statics: a density that makes it so
  BodyOptions o;
  o.density = young / (speed * speed);
  o.young = young;
  o.poisson = nu;
  o.volume = volume_for(nu);
  o.damping_mass = 3 * speed / height;
  o.position = {0, 0, wd.contact_offset};
  const dfm_body body = make_body(world, cells, o, nullptr, fixed.data());
  const dfm_obstacle plane = add_plane(world, "plane");
  set_friction(world, 0, "none");
  run(world, 1e-9 * height / speed, 1e-9 * height / speed);
  const double h = stats(world).stable_step;
  double lift = 0;
  Line out{};
  for (int k = 0; k < 8; ++k) {
    const double from = lift;
    lift = k == 0 ? a * a / R : lift * (1 + 0.7 * (load / std::max(out.load, 0.1 * load) - 1));
    const int n = int(std::ceil((k ? 6 : 15) * height / speed / h));
    for (int i = 1; i <= n; ++i) {
      const double u = std::min(1.0, 2.0 * i / n), s = u * u * (3 - 2 * u);
      const dfm_pose pose{{0, 0, from + s * (lift - from)}, {0, 0, 0, 1}};
      ok(dfm_obstacle_move_to(plane, &pose));
      run(world, h, h);
    }
    const Touch t = touch(world, true, [](const dfm_contact &) { return true; });
    out = {t.force / (2 * edge), 2 * t.reach, t.points};
    if (k && std::fabs(out.load / load - 1) < 0.03) break;
  }
  (void)body;
  dfm_world_destroy(world);
  return out;
}
inline double line_half_width(double R, double young, double nu, double load) {
  return std::sqrt(4 * load * R * (1 - nu * nu) / (3.14159265358979323846 * young));
}

}  // namespace test::elastic
