// Shared by tests of set-valued laws: one contact, and a mass on a plane driven by a force.
#pragma once
#include "tiny_support.h"

namespace tiny {

struct LawOutput {
  double fx, fy, limit;
  int mode;
  double dv[4], dn[2];
};

// Normal force, slip, stopping force, area. Straight to the plugin, so that a NaN comes back to be looked at.
inline LawOutput one_contact(const dfm_friction &ops, std::vector<double> params, double fn, double vx,
                             double vy, double sx, double sy, double area = 1) {
  Batch b(1, std::move(params));
  b.fn[0] = fn;
  b.vt[0] = vx;
  b.vt[b.stride] = vy;
  b.stop[0] = sx;
  b.stop[b.stride] = sy;
  b.area[0] = area;
  EXPECT_EQ(ops.eval(&b.in, &b.out), DFM_OK);
  LawOutput a{b.ft[0], b.ft[b.stride], b.limit[0], b.mode[0], {}, {b.dn[0], b.dn[b.stride]}};
  for (int k = 0; k < 4; ++k) a.dv[k] = b.dv[k * b.stride];
  return a;
}

// A mass that a force f drives against friction, by implicit steps: the slip under the friction force is the
// fixed point of the smooth part.
struct Rig {
  double m = 1, v = 0, x = 0, force = 0;
  void step(const dfm_friction &ops, const std::vector<double> &params, double h, double f, double fn) {
    const double free = v + h * f / m;
    double u = free;
    for (int pass = 0; pass < 30; ++pass) {
      const LawOutput a = one_contact(ops, params, fn, pass == 0 ? free : u, 0, -m * free / h, 0);
      const double next = a.mode == 1 ? 0 : free + h * a.fx / m;
      force = a.fx;
      if (next == u && pass) break;
      u = next;
    }
    v = u;
    x += h * v;
  }
};

}  // namespace tiny
