#include "scene/rotation.h"

#include <cmath>

namespace dfm::scene {
namespace {

constexpr double kPi = 3.14159265358979323846;

// Taylor series on [-pi/4, pi/4], where the first term left out is below 1e-17.
double sine(double x) {
  const double s = x * x;
  double sum = 0;
  for (int k = 17; k >= 3; k -= 2) sum = (1.0 + sum) * -s / (k * (k - 1));
  return x * (1.0 + sum);
}

double cosine(double x) {
  const double s = x * x;
  double sum = 0;
  for (int k = 18; k >= 2; k -= 2) sum = (1.0 + sum) * -s / (k * (k - 1));
  return 1.0 + sum;
}

void sine_cosine_deg(double degrees, double *s, double *c) {
  const double turn = std::remainder(degrees, 360.0);  // exact, as are the next two
  const double quarter = std::nearbyint(turn / 90.0), rest = (turn - 90.0 * quarter) * (kPi / 180.0);
  double a = sine(rest), b = cosine(rest);
  if (turn - 90.0 * quarter == 45.0) a = b = std::sqrt(0.5);
  if (turn - 90.0 * quarter == -45.0) a = -(b = std::sqrt(0.5));
  switch (((static_cast<int>(quarter) % 4) + 4) % 4) {
    case 0:
      *s = a;
      *c = b;
      break;
    case 1:
      *s = b;
      *c = -a;
      break;
    case 2:
      *s = -a;
      *c = -b;
      break;
    default:
      *s = -b;
      *c = a;
      break;
  }
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
