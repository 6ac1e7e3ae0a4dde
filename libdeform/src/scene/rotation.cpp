#include "scene/rotation.h"

#include <cmath>

#include "math/elementary.h"

namespace dfm::scene {
namespace {

// 45 degrees have one number for both, so that quarter turns have equal halves.
void sine_cosine_deg(double degrees, double *s, double *c) {
  const double turn = std::remainder(degrees, 360.0);
  *s = dfm_sinpi(turn / 180);
  *c = dfm_cospi(turn / 180);
  if (std::fabs(std::remainder(turn, 90.0)) == 45) *c = std::copysign(*s, *c);
}

}  // namespace

Quat rotation(const double axis[3], double angle_deg) {
  double s, c;
  sine_cosine_deg(angle_deg / 2, &s, &c);
  // Scaled first: the square of a tiny or huge axis would leave the range of double.
  const double scale = std::fmax(std::fabs(axis[0]), std::fmax(std::fabs(axis[1]), std::fabs(axis[2])));
  const double x = axis[0] / scale;
  const double y = axis[1] / scale;
  const double z = axis[2] / scale;
  const double n = std::sqrt(x * x + y * y + z * z);
  return {s * x / n, s * y / n, s * z / n, c};
}

Quat rotation_to(const double direction[3]) {
  const double scale =
      std::fmax(std::fabs(direction[0]), std::fmax(std::fabs(direction[1]), std::fabs(direction[2])));
  double d[3] = {direction[0] / scale, direction[1] / scale, direction[2] / scale};
  const double n = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  for (double &x : d) x /= n;
  // Half-way construction, q = (z x d, 1 + z.d). Pointing down, 1 + d.z is written without its cancellation.
  const double across = d[0] * d[0] + d[1] * d[1];
  if (d[2] < 0 && across == 0) return {1, 0, 0, 0};
  return unit({-d[1], d[0], 0, d[2] < 0 ? across / (1 - d[2]) : 1 + d[2]});
}

void rotate(Quat q, const double v[3], double out[3]) {
  const double u[3] = {q.y * v[2] - q.z * v[1] + q.w * v[0], q.z * v[0] - q.x * v[2] + q.w * v[1],
                       q.x * v[1] - q.y * v[0] + q.w * v[2]};
  const double r[3] = {v[0] + 2 * (q.y * u[2] - q.z * u[1]), v[1] + 2 * (q.z * u[0] - q.x * u[2]),
                       v[2] + 2 * (q.x * u[1] - q.y * u[0])};
  for (int i = 0; i < 3; ++i) out[i] = r[i];
}

}  // namespace dfm::scene
