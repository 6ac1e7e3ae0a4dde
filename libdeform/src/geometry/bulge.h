// Surfaces that mean to be smooth: over each triangle a quadratic patch through its corners,
//
//     p(u) = sum_k u_k x_k + 4 (u_0 u_1 D_0 + u_1 u_2 D_1 + u_2 u_0 D_2),
//
// D_k how far the middle of edge k lies off the straight edge. At rest a patch has the curve that the
// normals of its corners ask for (the middle of a cubic edge of Vlachos et al., Curved PN triangles, 2001);
// there D_k is written in the corners and a fourth surfel off the triangle's plane, so it goes with the body:
//
//     D_k = c_k0 (x_1 - x_0) + c_k1 (x_2 - x_0) + c_k2 (x_o - x_0).
//
// A point of a patch is a sum of surfels whose weights depend on u alone. It moves as the body does where
// that moves as a rigid one, its gap changes by its weights times the velocities of surfels, and impulses on
// it keep angular momentum. Where a load has pressed the surfels flat, so is the patch.
#pragma once
#include <algorithm>

#include "geometry/surface.h"
#include "math/vec3.h"

namespace dfm {

// Makes the patches of a surface at rest. Edges whose faces' normals differ by at most `degrees` are smooth.
// Patches that would be hollow stay flat.
void make_bulges(Surface &surface, double degrees);

struct Patch {
  uint32_t node[4];  // the triangle's corners and the fourth surfel
  const double *c;   // [3,3]

  Patch(const Surface &s, uint32_t t)
      : node{s.tri[3 * size_t{t}], s.tri[3 * size_t{t} + 1], s.tri[3 * size_t{t} + 2], s.bulge_from[t]},
        c(&s.bulge[9 * size_t{t}]) {}
  void weights(const double u[3], double w[4]) const {
    for (int k = 0; k < 3; ++k) w[k] = u[k];
    w[3] = 0;
    for (int k = 0; k < 3; ++k) {
      const double f = 4 * u[k] * u[(k + 1) % 3];
      w[0] -= f * (c[3 * k] + c[3 * k + 1] + c[3 * k + 2]);
      for (int i = 0; i < 3; ++i) w[i + 1] += f * c[3 * k + i];
    }
  }
  // D_k; at(surfel): its place
  template <class At>
  Vec3 off(int k, At &&at) const {
    const Vec3 x = at(node[0]);
    return c[3 * k] * (at(node[1]) - x) + c[3 * k + 1] * (at(node[2]) - x) + c[3 * k + 2] * (at(node[3]) - x);
  }
};

// The heights of a patch over a plane: of its corners, and of D_k.
struct PatchHeights {
  double corner[3], off[3];

  template <class At>
  PatchHeights(const Patch &patch, Vec3 normal, At &&at) {
    double h[4];
    for (int i = 0; i < 4; ++i) h[i] = dot(normal, at(patch.node[i]));
    for (int k = 0; k < 3; ++k) {
      const double *const c = &patch.c[3 * k];
      corner[k] = h[k];
      off[k] = c[0] * (h[1] - h[0]) + c[1] * (h[2] - h[0]) + c[2] * (h[3] - h[0]);
    }
  }
  double at(const double u[3]) const {
    double sum = 0;
    for (int k = 0; k < 3; ++k) sum += u[k] * corner[k] + 4 * u[k] * u[(k + 1) % 3] * off[k];
    return sum;
  }
  // No place is lower.
  double least() const {
    return std::min({corner[0], corner[1], corner[2]}) + 4.0 / 3 * std::min({0.0, off[0], off[1], off[2]});
  }
  // The lowest point of the curve over edge k, of the surface over the triangle, also beyond their ends,
  // where some u < 0. False: there is none.
  bool lowest_of_edge(int k, double u[3]) const;
  bool lowest(double u[3]) const;
};

inline bool in_triangle(const double u[3]) { return u[0] >= 0 && u[1] >= 0 && u[2] >= 0; }

}  // namespace dfm
