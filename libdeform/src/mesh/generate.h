// What the generators share: checks, the choice of counts, points on circles.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "math/vec3.h"
#include "mesh/mesh.h"

namespace dfm {

inline constexpr uint32_t kMaxCells = 100'000'000;
inline constexpr double kTwoPi = 6.2831853071795864769, kSixth = 1.0471975511965977462;  // of a turn, pi/3
// rows of the triangular lattice lie sqrt(3)/2 edges apart
inline constexpr double kRow = 0.86602540378443864676;

inline void check_size(const char *what, double size) {
  if (!(size > 0) || !std::isfinite(size))
    fail(DFM_E_ARG, "the %s is %g m; expected a finite length above 0", what, size);
}
inline void check_cells(uint32_t cells) {
  if (cells < 1 || cells > kMaxCells) fail(DFM_E_ARG, "cells is %u; expected 1 to %u", cells, kMaxCells);
}
inline void check_beam(double x, double y, double z) {
  check_size("beam's x size", x);
  check_size("beam's y size", y);
  check_size("beam's z size", z);
}
inline void check_cylinder(double radius, double length) {
  check_size("cylinder's radius", radius);
  check_size("cylinder's length", length);
}
void check_tube(double inner, double outer, double length);

inline uint32_t rounded(double x) { return uint32_t(std::max(1.0, std::floor(x + 0.5))); }
// The ratio of two positive numbers, at least 1.
inline double apart(double a, double b) { return std::max(a, b) / std::min(a, b); }
// The cost of a choice of counts, 1 at best: weighs elongated cells (cheap up to 2:1; beyond that they spoil
// the mesh, and more cells are made instead) against a number of cells far from the requested one.
inline double choice_score(double elongation, double count, double requested) {
  const double excess = std::max(1.0, elongation / 2);
  return std::sqrt(elongation) * excess * excess * excess * apart(count, requested);
}
// The choice of the lowest score, the first of equal ones.
template <class T>
struct Best {
  T choice{};
  double score = HUGE_VAL;
  void offer(double its_score, const T &other) {
    if (!(its_score < score)) return;
    score = its_score;
    choice = other;
  }
};
// The number of cells may exceed the requested one only up to a limit.
inline void check_choice(const char *shape, double count, uint32_t requested) {
  if (count > 100.0 * std::max(requested, 100u))
    fail(DFM_E_ARG,
         "a %s of these proportions needs about %.2g cells to keep them in shape, %u were asked for; ask for "
         "more, or give sizes nearer to each other",
         shape, count, requested);
}

// sin and cos on [0, pi/3] by their series: libm's bits depend on the processor.
Vec3 unit_on_circle(double angle);
Vec3 turned_by_sixths(Vec3 u, uint64_t sixths);  // in the plane, 0 to 5
// The point at i/n of a full turn.
Vec3 unit_on_circle(uint64_t i, uint64_t n);
// Place j of n on ring k of `rings` from the inner circle to the outer: a triangular lattice, odd rings
// shifted by half a step.
Vec3 on_annulus(double inner, double outer, uint32_t k, uint32_t rings, uint32_t j, uint32_t n);

void add_point(RestMesh &mesh, Vec3 p);
void add_tet(RestMesh &mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d);  // turned to positive volume
// The prism over a triangle of a layer, cut in three by the colors of its corners; layers are mirrored in
// turn, so that the surface diagonals zigzag.
template <class Color>
void add_prism(RestMesh &mesh, uint32_t layer, uint32_t slab, std::array<uint32_t, 3> v, const Color &color) {
  std::sort(v.begin(), v.end(),
            [&](uint32_t a, uint32_t b) { return layer % 2 ? color(a) > color(b) : color(a) < color(b); });
  const uint32_t low = layer * slab, up = low + slab;
  add_tet(mesh, low + v[0], low + v[1], low + v[2], up + v[2]);
  add_tet(mesh, low + v[0], low + v[1], up + v[1], up + v[2]);
  add_tet(mesh, low + v[0], up + v[0], up + v[1], up + v[2]);
}
// without groups, points numbered in their order
RestMesh finished(RestMesh mesh);

// The icosahedron on the unit sphere.
struct Icosahedron {
  Vec3 corner[12];
  std::array<std::array<uint32_t, 3>, 20> face;  // corners ascending, faces too
  Icosahedron();
  // Neighbors are 1.05 apart, the next points 1.70.
  bool near(uint32_t a, uint32_t b) const { return norm2(corner[a] - corner[b]) < 2; }
};

}  // namespace dfm
