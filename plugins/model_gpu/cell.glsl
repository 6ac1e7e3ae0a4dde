// A linear tetrahedron whose strain is measured in its own frame, as GLSL and as C++ (doc/models/
// corotational_fem.md): nothing but + - * /, roots and choices, each rounded alike on both. Matrices are
// row-major, symmetric ones xx yy zz xy yz zx. A product with 1/3 or 1/10 is written as a quotient, because a
// constant of GLSL is binary32.

// d: edges from corner 0 to the others; g: rest gradients of their shape functions.
void gradient_of(IN(d, 9), IN(g, 9), OUT(f, 9)) {
  UNROLLED for (uint i = 0u; i < 3u; ++i)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      f[3u * i + j] = (d[i] * g[j] + d[3u + i] * g[3u + j]) + d[6u + i] * g[6u + j];
}

// The rotation nearest to any F: the eigenvector of the largest eigenvalue of Horn's matrix of the quaternion.
// Squares of the matrix, made positive by 3 |F| at most, leave that one alone: 32 of them tell stretches apart
// that cancel to 1e-9. Of no use on its way: it takes as long as twenty cells.
void turn_by_squares(IN(f, 9), double n, OUT(r, 9)) {
  precise double m[16];
  precise double shift = sqrt(3.0 * n) + double(1e-30f);
  precise double x = f[7] - f[5];
  precise double y = f[2] - f[6];
  precise double z = f[3] - f[1];
  m[0] = ((f[0] + f[4]) + f[8]) + shift;
  m[5] = ((f[0] - f[4]) - f[8]) + shift;
  m[10] = ((f[4] - f[0]) - f[8]) + shift;
  m[15] = ((f[8] - f[0]) - f[4]) + shift;
  m[1] = x;
  m[2] = y;
  m[3] = z;
  m[6] = f[1] + f[3];
  m[7] = f[2] + f[6];
  m[11] = f[5] + f[7];
  m[4] = m[1];
  m[8] = m[2];
  m[12] = m[3];
  m[9] = m[6];
  m[13] = m[7];
  m[14] = m[11];
  for (uint k = 0u; k < 32u; ++k) {
    precise double all = ((m[0] + m[5]) + m[10]) + m[15];
    precise double own[16];
    for (uint e = 0u; e < 16u; ++e) own[e] = m[e] / all;
    for (uint i = 0u; i < 4u; ++i)
      for (uint j = 0u; j < 4u; ++j)
        m[4u * i + j] = (own[4u * i] * own[j] + own[4u * i + 1u] * own[4u + j]) +
                        (own[4u * i + 2u] * own[8u + j] + own[4u * i + 3u] * own[12u + j]);
  }
  uint best = 0u;
  for (uint k = 1u; k < 4u; ++k)
    if (m[5u * k] > m[5u * best]) best = k;
  precise double a = m[best];
  precise double b = m[4u + best];
  precise double c = m[8u + best];
  precise double d = m[12u + best];
  precise double s = 2.0 / ((a * a + b * b) + (c * c + d * d));
  r[0] = 1.0 - s * (c * c + d * d);
  r[4] = 1.0 - s * (b * b + d * d);
  r[8] = 1.0 - s * (b * b + c * c);
  r[1] = s * (b * c - d * a);
  r[3] = s * (b * c + d * a);
  r[2] = s * (b * d + c * a);
  r[6] = s * (b * d - c * a);
  r[5] = s * (c * d - b * a);
  r[7] = s * (c * d + b * a);
}

// R of F = R S by the closed form of model_common/polar_lanes.h where that is accurate. A device may round a
// quotient to the 24th bit: the last one is refined, the others are steps toward a root.
void polar_of(IN(f, 9), OUT(r, 9)) {
  precise double c[6];
  precise double q[9];
  c[0] = (f[0] * f[0] + f[3] * f[3]) + f[6] * f[6];
  c[1] = (f[1] * f[1] + f[4] * f[4]) + f[7] * f[7];
  c[2] = (f[2] * f[2] + f[5] * f[5]) + f[8] * f[8];
  c[3] = (f[0] * f[1] + f[3] * f[4]) + f[6] * f[7];
  c[4] = (f[1] * f[2] + f[4] * f[5]) + f[7] * f[8];
  c[5] = (f[2] * f[0] + f[5] * f[3]) + f[8] * f[6];
  q[0] = f[4] * f[8] - f[5] * f[7];
  q[1] = f[5] * f[6] - f[3] * f[8];
  q[2] = f[3] * f[7] - f[4] * f[6];
  q[3] = f[2] * f[7] - f[1] * f[8];
  q[4] = f[0] * f[8] - f[2] * f[6];
  q[5] = f[1] * f[6] - f[0] * f[7];
  q[6] = f[1] * f[5] - f[2] * f[4];
  q[7] = f[2] * f[3] - f[0] * f[5];
  q[8] = f[0] * f[4] - f[1] * f[3];
  precise double n = (c[0] + c[1]) + c[2];
  precise double det2 = 2.0 * ((f[0] * q[0] + f[1] * q[1]) + f[2] * q[2]);
  precise double own = (c[0] * c[0] + c[1] * c[1]) + c[2] * c[2];
  precise double mixed = (c[3] * c[3] + c[4] * c[4]) + c[5] * c[5];
  precise double constant = 2.0 * (own + 2.0 * mixed) - n * n;
  precise double t = sqrt(3.0 * n);
  precise double last = t;
  UNROLLED for (uint k = 0u; k < 3u; ++k) {
    precise double square = t * t;
    precise double slope = t * (square - n) - det2;
    precise double p = (square * (square - 2.0 * n) - 4.0 * (det2 * t)) + constant;
    last = (2.0 * (p * slope)) / (8.0 * (slope * slope) - p * (3.0 * square - n));
    t = t - last;
  }
  precise double divisor = t * (t * t - n) - det2;
  if (!(divisor > 0.25 * ((t * t) * t) && t > 1048576.0 * abs(last) && n > double(1e-30f))) {
    turn_by_squares(f, n, r);
    return;
  }
  precise double inverse = 1.0 / divisor;
  inverse = inverse * (2.0 - divisor * inverse);
  precise double linear = (t * t + n) * inverse;
  precise double cubic = 2.0 * inverse;
  precise double cofactor = t * cubic;
  UNROLLED for (uint i = 0u; i < 9u; i += 3u) {
    precise double x = (f[i] * c[0] + f[i + 1u] * c[3]) + f[i + 2u] * c[5];
    precise double y = (f[i] * c[3] + f[i + 1u] * c[1]) + f[i + 2u] * c[4];
    precise double z = (f[i] * c[5] + f[i + 1u] * c[4]) + f[i + 2u] * c[2];
    r[i] = (linear * f[i] + cofactor * q[i]) - cubic * x;
    r[i + 1u] = (linear * f[i + 1u] + cofactor * q[i + 1u]) - cubic * y;
    r[i + 2u] = (linear * f[i + 2u] + cofactor * q[i + 2u]) - cubic * z;
  }
}

// Symmetric part of R^T F less the identity.
void strain_of(IN(r, 9), IN(f, 9), OUT(e, 6)) {
  precise double a[9];
  UNROLLED for (uint i = 0u; i < 3u; ++i)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      a[3u * i + j] = (r[i] * f[j] + r[3u + i] * f[3u + j]) + r[6u + i] * f[6u + j];
  e[0] = a[0] - 1.0;
  e[1] = a[4] - 1.0;
  e[2] = a[8] - 1.0;
  e[3] = 0.5 * (a[1] + a[3]);
  e[4] = 0.5 * (a[5] + a[7]);
  e[5] = 0.5 * (a[6] + a[2]);
}

void stress_of(IN(e, 6), double mu2, double lambda, OUT(s, 6)) {
  precise double pressure = lambda * ((e[0] + e[1]) + e[2]);
  UNROLLED for (uint k = 0u; k < 3u; ++k) {
    s[k] = mu2 * e[k] + pressure;
    s[k + 3u] = mu2 * e[k + 3u];
  }
}

// What the rows of the step bound count beyond the rest shape, over |g_a| |g_b|: x of the stiffness, y of the
// dampers' (corot_bound.cpp derives them).
dvec2 growth_of(IN(f, 9), IN(e, 6), double mu2, double lambda) {
  precise double n = f[0] * f[0];
  UNROLLED for (uint k = 1u; k < 9u; ++k) n = n + f[k] * f[k];
  precise double more = (e[0] + e[1]) + e[2];
  precise double t = more + 3.0;
  precise double mean = t / 3.0;
  precise double variance = max(n / 3.0 - mean * mean, 0.0);
  precise double far = sqrt(2.0 * variance);
  precise double least = max(2.0 * mean - far, t / 10.0) + double(1e-30f);
  precise double most = (2.0 * mean + far) + double(1e-30f);
  precise double uneven = (6.0 * variance) / (least * least);
  precise double c = lambda * more - mu2;
  precise double twist = 0.5 * max(mu2 + (2.0 * c) / (c > 0.0 ? least : most), 0.0);
  precise double damper = mu2 * uneven;
  return dvec2(twist, damper);
}

// Adds to `all`, the stress in the frame, that of dampers for the rate of F: on dS/dt, without a torque, and
// faded where two stretches cancel.
void add_dampers(IN(r, 9), IN(rate, 9), IN(e, 6), double mu2, double lambda, OUT(all, 9)) {
  precise double s0 = e[0] + 1.0;
  precise double s1 = e[1] + 1.0;
  precise double s2 = e[2] + 1.0;
  precise double s3 = e[3];
  precise double s4 = e[4];
  precise double s5 = e[5];
  precise double t = (s0 + s1) + s2;
  precise double a = t - s0;
  precise double b = t - s1;
  precise double c = t - s2;
  precise double xx = b * c - s4 * s4;
  precise double xy = s5 * s4 + s3 * c;
  precise double zx = s3 * s4 + b * s5;
  precise double det = (a * xx - s3 * xy) - s5 * zx;
  precise double over = 1.0 / max(det, ((t * t) * t) / 10.0 + double(1e-30f));
  precise double share = det * over;
  precise double i0 = over * xx;   // share times the inverse of t I - S
  precise double i1 = over * (a * c - s5 * s5);
  precise double i2 = over * (a * b - s3 * s3);
  precise double i3 = over * xy;
  precise double i4 = over * (a * s4 + s3 * s5);
  precise double i5 = over * zx;
  precise double m[9];
  UNROLLED for (uint i = 0u; i < 3u; ++i)
    UNROLLED for (uint j = 0u; j < 3u; ++j)
      m[3u * i + j] = (r[i] * rate[j] + r[3u + i] * rate[3u + j]) + r[6u + i] * rate[6u + j];
  precise double x = m[7] - m[5];
  precise double y = m[2] - m[6];
  precise double z = m[3] - m[1];
  precise double w0 = (i0 * x + i3 * y) + i5 * z;
  precise double w1 = (i3 * x + i1 * y) + i4 * z;
  precise double w2 = (i5 * x + i4 * y) + i2 * z;
  precise double pxy = w2 * s3;
  precise double pyz = w0 * s4;
  precise double pzx = w1 * s5;
  precise double d[6];
  d[0] = share * m[0] - (pzx - pxy);
  d[1] = share * m[4] - (pxy - pyz);
  d[2] = share * m[8] - (pyz - pzx);
  precise double w01 = w2 * (s0 - s1) + (w1 * s4 - w0 * s5);
  precise double w12 = w0 * (s1 - s2) + (w2 * s5 - w1 * s3);
  precise double w20 = w1 * (s2 - s0) + (w0 * s3 - w2 * s4);
  d[3] = 0.5 * (share * (m[1] + m[3]) - w01);
  d[4] = 0.5 * (share * (m[5] + m[7]) - w12);
  d[5] = 0.5 * (share * (m[2] + m[6]) - w20);
  precise double p[6];
  stress_of(d, mu2, lambda, p);
  x = ((p[5] * s3 + p[4] * s1) + p[2] * s4) - ((p[3] * s5 + p[1] * s4) + p[4] * s2);
  y = ((p[0] * s5 + p[3] * s4) + p[5] * s2) - ((p[5] * s0 + p[4] * s3) + p[2] * s5);
  z = ((p[3] * s0 + p[1] * s3) + p[4] * s5) - ((p[0] * s3 + p[3] * s1) + p[5] * s4);
  w0 = (i0 * x + i3 * y) + i5 * z;
  w1 = (i3 * x + i1 * y) + i4 * z;
  w2 = (i5 * x + i4 * y) + i2 * z;
  all[0] = all[0] + share * p[0];
  all[4] = all[4] + share * p[1];
  all[8] = all[8] + share * p[2];
  all[1] = (all[1] + share * p[3]) + w2;
  all[3] = (all[3] + share * p[3]) - w2;
  all[5] = (all[5] + share * p[4]) + w0;
  all[7] = (all[7] + share * p[4]) - w0;
  all[6] = (all[6] + share * p[5]) + w1;
  all[2] = (all[2] + share * p[5]) - w1;
}
