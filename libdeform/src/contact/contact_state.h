// Data shared by contact/ and friction/ in the solve of one sub-step: columns over the contacts, in their
// order. Pairs in the tangent plane are [2,stride], 2x2 matrices [4,stride] row-major; stride is a multiple
// of 8.
#pragma once
#include <cmath>
#include <cstdint>

#include "core/memory.h"

namespace dfm {

// The part of a law's dft/dvt that dissipates: its symmetric part without the positive eigenvalue, and its
// antisymmetric part, which does no work. [a b; c d], N s/m; v.D v <= 0 for every v.
struct Slope { double a, b, c, d; };
// How a law is solved: by its slopes, by projection on the disc of radius limit, or not at all (no force).
enum LawForm : uint8_t { kSmoothLaw, kSetValuedLaw, kNoFriction };
// A smooth law about a slip: slope D, and 1 - h w_t D as [m11 m12; m21 m22] with its determinant.
struct LinearLaw {
  Slope slope;
  double m11, m12, m21, m22, det;
};

struct ContactState {
  uint32_t n = 0, stride = 0, nstate = 0;
  Array<uint32_t> law;  // [n] index into the world's law table
  // Trial: the state at which the laws are evaluated.
  Array<double> fn;           // N
  Array<double> vt;           // [2,stride] m/s, mean slip of side a against side b
  Array<double> ft_stop;      // [2,stride] N, force that makes the mean slip zero
  Array<double> slip;         // [2,stride] m/s, of the state at which the laws were evaluated
  Array<double> area, dwell;  // m2, s
  // Where ContactNewton has found a set-valued law to slide. By ft_stop alone, which takes all others to hold
  // still, the law might stop it.
  Array<uint8_t> slides;
  // [nstate,stride] law state at the start of the sub-step, nstate = the largest of all laws
  Array<double> bristle;
  // [n] factor on the normal force in the law, if the host scales friction; empty: 1
  Array<double> scale;
  // Results of the laws at the trial.
  Array<double> ft;           // [2,stride] N, force on side a
  Array<double> dft_dvt;      // [4,stride] N s/m
  Array<double> dft_dfn;      // [2,stride]
  Array<double> limit;        // N
  Array<double> bristle_out;  // [nstate,stride]
  Array<uint8_t> mode;        // 0 open, 1 stick, 2 slip
  Array<uint8_t> form;        // LawForm
  Array<LinearLaw> linear;    // [n] of smooth laws, by linearize()

  void use(const Memory &m) {
    use_memory(m, law, fn, vt, ft_stop, area, dwell, bristle, ft, dft_dvt, dft_dfn, limit, bristle_out, mode,
               form, slip, scale, linear, slides);
  }
  void resize(uint32_t count, uint32_t states) {
    n = count;
    nstate = states;
    stride = (count + 7) & ~7u;
    for (Array<double> *a : {&fn, &area, &dwell, &limit}) a->resize(stride);
    for (Array<double> *a : {&vt, &ft_stop, &slip, &ft, &dft_dfn}) a->resize(size_t(2) * stride);
    dft_dvt.resize(size_t(4) * stride);
    bristle.resize(size_t(nstate) * stride);
    bristle_out.resize(size_t(nstate) * stride);
    law.resize(stride);
    mode.resize(stride);
    form.resize(stride);
    slides.assign(stride, 0);
    linear.resize(n);
  }
};

// Residual of a state. Of each contact, m/s: r_n = |min(w_n lambda_n, u_n + gap/h)|, r_t = w_t |lambda_t -
// law|. `relative` is the worst over its tolerance: at most 1 is converged. `required` is the same with
// most_normal for normal[i]: the required accuracy; the rest may be left to the warm start of the next
// sub-step. `normal` is the worst r_n alone, m/s.
struct Residual { double relative = 0, required = 0, speed = 0, normal = 0; };

inline Slope dissipative_slope(const ContactState &s, uint32_t i) {
  const uint32_t n = s.stride;
  const double a = s.dft_dvt[i];
  const double c = s.dft_dvt[3 * size_t(n) + i];
  const double b1 = s.dft_dvt[size_t(n) + i], b2 = s.dft_dvt[2 * size_t(n) + i];
  const double b = 0.5 * (b1 + b2), turn = 0.5 * (b1 - b2);
  const double mean = 0.5 * (a + c), dev = 0.5 * (a - c), spread = std::sqrt(dev * dev + b * b);
  const double top = mean + spread, bottom = mean - spread;
  if (bottom >= 0) return {0, turn, -turn, 0};
  if (!(top > 0)) return {a, b1, b2, c};
  // keep only bottom * p p^T of the symmetric part, p p^T = (top I - D) / (top - bottom)
  const double scale = bottom / (top - bottom);
  return {scale * (top - a), turn - scale * b, -turn - scale * b, scale * (top - c)};
}

// Linearizes a smooth law, for a contact with this response over the sub-step, s/kg.
inline LinearLaw linear_law(const ContactState &s, uint32_t i, double response) {
  LinearLaw l;
  l.slope = dissipative_slope(s, i);
  l.m11 = 1 - response * l.slope.a;
  l.m22 = 1 - response * l.slope.d;
  l.m12 = -response * l.slope.b;
  l.m21 = -response * l.slope.c;
  l.det = l.m11 * l.m22 - l.m12 * l.m21;
  return l;
}

}  // namespace dfm
