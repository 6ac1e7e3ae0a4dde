// Rest compression: a block on a plane, and a block on a block on a plane, against their static shape.
//
//   plane   a block on a plane, free to become wider
//   column  two blocks, every point of which moves along z alone
//   pair    two blocks that are free to become wider, upright: the points of their axes move along z alone;
//           Poisson's ratio 0
//
// Nothing rubs, so that the answer depends on no path. The static shape comes from dfm_world_equilibrium
// without any contact: the same mesh with its lower face held along z, and two of it joined where they
// touch. The joint changes nothing in a column. In a pair it may carry shear, of which a column of one
// material under its weight has none but for the error of the mesh: 0.3 % of the compression with Poisson's
// ratio 0 (and 1 % with 0.3, where the held face adds some).
#pragma once
#include <ctime>

#include "cells.h"

namespace test::compression {

constexpr double kSide = 0.1, kDensity = 1000, kG = 9.81, kOffset = 5e-5, kTouch = 1e-9;  // touch: m
constexpr uint32_t kCells = 60;

struct Case {
  std::string scene, model;
  int32_t integrator;
  double step, young;
  size_t blocks() const { return scene == "plane" ? 1 : 2; }
};
struct Result {
  double error = 0;  // of heights of blocks and of centers of mass, over what the static shape has, the worst
  double expected = 0;  // m, by which the lowest block is lower
  double gap = 0;       // m, distance of two faces less d_c, the worst
  double speed = 0;     // m/s, of the fastest point at the end
  uint64_t substeps = 0;
  double simulated = 0, seconds = 0;  // seconds: of the processor
};

// Mean height of the upper and the lower face and of the center of mass of one block.
struct Shape { double top = 0, bottom = 0, middle = 0; };
inline Shape shape_of(const Cells &rest, const double *x) {
  const std::vector<double> mass = rest.lumped([](uint32_t) { return kDensity; });
  Shape s;
  double all = 0, above = 0, below = 0;
  for (uint32_t i = 0; i < rest.npoint(); ++i) {
    const double z = x[3 * size_t(i) + 2];
    s.middle += mass[i] * z;
    all += mass[i];
    if (rest.point(i)[2] > kSide - kTouch) {
      s.top += z;
      ++above;
    }
    if (rest.point(i)[2] < kTouch) {
      s.bottom += z;
      ++below;
    }
  }
  return {s.top / above, s.bottom / below, s.middle / all};
}

inline void hold(dfm_body b, const Cells &cells, const std::function<uint8_t(const double *)> &axes) {
  for (uint32_t i = 0; i < cells.npoint(); ++i)
    if (const uint8_t a = axes(cells.point(i))) ok(dfm_body_hold(b, 1, &i, a));
}

inline bool in_the_middle(double x) { return std::fabs(x - 0.5 * kSide) < kTouch; }
inline bool on_axis(const double *p) { return in_the_middle(p[0]) && in_the_middle(p[1]); }

// Axes along which a point of a block does not move. Without a guide the upper block of a pair slides off the
// lower one, whose upper face is not quite flat.
inline uint8_t guide(const Case &c, const double *p) {
  return c.scene == "column" || (c.scene == "pair" && on_axis(p)) ? 3 : 0;
}

inline BodyOptions material_of(const Case &c) {
  BodyOptions o;
  o.name = "lower";
  o.model = c.model;
  o.young = c.young;
  o.density = kDensity;
  if (c.scene == "pair") o.poisson = 0;
  return o;
}

// Blocks in turn upside down, so that faces that touch are the same triangles.
inline Cells block_of(dfm_context *context, size_t k) {
  Cells cells = make_cells(context, "beam", {kSide, kSide, kSide}, kCells);
  for (size_t i = 2; k % 2 && i < cells.points.size(); i += 3) cells.points[i] = kSide - cells.points[i];
  for (size_t t = 0; k % 2 && t < cells.tets.size(); t += 4) std::swap(cells.tets[t], cells.tets[t + 1]);
  return cells;
}

// The static shapes, lowest block first.
inline std::vector<Shape> statics(const Case &c) {
  Context context;
  const dfm_world w = make_world(context, {0, 0, -kG});
  const Cells block = block_of(context, 0), above = block_of(context, 1);
  Cells column = block;
  std::vector<uint32_t> of_upper(above.npoint());  // its points in the column
  for (uint32_t i = 0; c.blocks() > 1 && i < above.npoint(); ++i) {
    const double at[3] = {above.point(i)[0], above.point(i)[1], above.point(i)[2] + kSide};
    of_upper[i] = column.npoint();
    for (uint32_t j = 0; j < block.npoint(); ++j)
      if (std::hypot(block.point(j)[0] - at[0], block.point(j)[1] - at[1], block.point(j)[2] - at[2]) <
          kTouch)
        of_upper[i] = j;
    if (of_upper[i] == column.npoint()) column.points.insert(column.points.end(), at, at + 3);
  }
  if (c.blocks() > 1)
    for (const uint32_t p : above.tets) column.tets.push_back(of_upper[p]);
  const dfm_body b = make_body(w, column, material_of(c));
  // a point in the middle of an edge keeps it from turning about z, and carries nothing
  hold(b, column, [&](const double *p) {
    const bool low = p[2] < kTouch;
    return uint8_t(guide(c, p) | (low && on_axis(p) ? 3 : 0) |
                   (low && p[0] > kSide - kTouch && in_the_middle(p[1]) ? 2 : 0) | (low ? 4 : 0));
  });
  ok(dfm_world_equilibrium(w, nullptr, nullptr));
  uint32_t n = column.npoint();
  std::vector<double> x(3 * size_t(n)), upper;
  ok(dfm_body_get_state(b, n, x.data(), nullptr, &n));
  std::vector<Shape> out{shape_of(block, x.data())};
  if (c.blocks() > 1) {
    for (const uint32_t p : of_upper) upper.insert(upper.end(), &x[3 * size_t(p)], &x[3 * size_t(p)] + 3);
    out.push_back(shape_of(above, upper.data()));
  }
  dfm_world_destroy(w);
  return out;
}

inline Result run_case(const Case &c) {
  const std::vector<Shape> expected = statics(c);
  const std::clock_t start = std::clock();
  Context context;
  dfm_world_def d = dfm_world_def_default();
  d.gravity[2] = -kG;
  d.integrator = c.integrator;
  d.contact_offset = kOffset;
  dfm_world w = 0;
  ok(dfm_world_create(context, &d, &w));
  add_plane(w, "floor");
  set_friction(w, 0, "none");
  // drag that lets the slowest swing die soon; it carries nothing at rest
  const double swing =
      0.5 * 3.14159265358979 / (kSide * double(c.blocks())) * std::sqrt(c.young / kDensity);  // 1/s
  std::vector<dfm_body> bodies;
  std::vector<Cells> blocks;
  for (size_t k = 0; k < c.blocks(); ++k) {
    BodyOptions o = material_of(c);
    if (k) o.name = "upper";
    o.damping_mass = 1.4 * swing;
    o.position = {0, 0, double(k) * kSide + 1.01 * double(k + 1) * kOffset};
    blocks.push_back(block_of(context, k));
    bodies.push_back(make_body(w, blocks[k], o));
    hold(bodies[k], blocks[k], [&](const double *p) { return guide(c, p); });
  }
  Result r;
  r.simulated = std::max(18 / swing, 40 * c.step);
  run(w, r.simulated, c.step);
  std::vector<Shape> now;
  for (size_t k = 0; k < c.blocks(); ++k) {
    uint32_t n = blocks[k].npoint();
    std::vector<double> x(3 * size_t(n));
    ok(dfm_body_get_state(bodies[k], n, x.data(), nullptr, &n));
    now.push_back(shape_of(blocks[k], x.data()));
    r.speed = std::max(r.speed, measure(bodies[k]).speed_max);
  }
  const auto compare = [&](double is, double should) {
    r.error = std::max(r.error, std::fabs(is - should) / std::fabs(should));
  };
  double gaps = 0;
  for (size_t k = 0; k < c.blocks(); ++k) {
    const double gap = now[k].bottom - (k ? now[k - 1].top : 0);
    gaps += gap;
    r.gap = std::max(r.gap, std::fabs(gap - kOffset));
    compare(now[k].top - now[k].bottom - kSide, expected[k].top - expected[k].bottom - kSide);
    const double middle = (double(k) + 0.5) * kSide;
    compare(now[k].middle - gaps - middle, expected[k].middle - middle);
  }
  r.expected = kSide - (expected[0].top - expected[0].bottom);
  r.substeps = stats(w).substeps;
  r.seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  dfm_world_destroy(w);
  return r;
}

}  // namespace test::compression
