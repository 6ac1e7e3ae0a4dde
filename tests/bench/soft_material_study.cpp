// Soft material at the defaults: nine materials, four shapes, three steps. Each body comes to rest under its
// weight, on a floor without friction or clamped at one end. Its sag is compared with linear theory and with
// the reference for large strain; the table also has the volume that is left and how many cells are inside
// out at rest, and how many were at most on the way. doc/models/msm.md explains the rows.
//
//   soft_material_study [TABLE.csv] [--only SHAPE]
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>

#include "../support/world.h"

namespace {

constexpr double kG = 9.81;

struct Substance { double young, density, poisson; };
constexpr Substance kSubstances[] = {{1e3, 1000, 0.3},  {3e3, 1000, 0.3},  {1e4, 1000, 0.3},
                                     {1e4, 1000, 0.45}, {1e5, 300, 0.0},   {1e5, 1000, 0.2},
                                     {1e5, 1100, 0.49}, {1e6, 1200, 0.45}, {1e7, 1200, 0.4}};
constexpr double kSteps[] = {1e-3, 1.0 / 240, 1.0 / 60};

double bisect(double low, double high, const std::function<bool(double)> &is_low) {
  for (int k = 0; k < 200; ++k) (is_low(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return 0.5 * (low + high);
}

// Stretch along the axis of a neo-Hookean bar (W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 ln^2 J) that is free in
// width, under the nominal stress p = P/E. Its width w satisfies mu (w^2 - 1) + lambda ln J = 0, its stress
// is [mu (s^2 - 1) + lambda ln J]/s = mu (s^2 - w^2)/s.
double stretch_under(double p, double nu) {
  const double mu = 1 / (2 * (1 + nu)), lambda = nu / ((1 + nu) * (1 - 2 * nu));
  const auto stress = [&](double s) {
    const double w = bisect(0.1, 10, [&](double width) {
      return mu * (width * width - 1) + lambda * std::log(s * width * width) < 0;
    });
    return mu * (s * s - w * w) / s;
  };
  return bisect(0.05, 1, [&](double s) { return stress(s) < p; });
}

// Height that the middle of a column of height `length` loses under its weight.
double column(const Substance &s, double length, double nu) {
  const int n = 400;
  double top = 0, middle = 0;
  for (int k = 0; k < n; ++k) {
    const double z = (k + 0.5) / n * length;
    const double part = stretch_under(-s.density * kG * (length - z) / s.young, nu) * length / n;
    middle += (top + 0.5 * part) / n;
    top += part;
  }
  return 0.5 * length - middle;
}

// Sag of the end of a cantilever of square section as a rod that bends, stretches and shears at any rotation
// (Reissner): the force in a section is the weight beyond it, E I turn'' = -(r' x force), turn(0) = 0,
// turn'(L) = 0. Found by its slope at the root.
double rod(const Substance &s, double length, double height, double nu) {
  const double weight = s.density * kG * height * height;
  const double stretch = s.young * height * height;
  const double shear = stretch / (2 * (1 + nu)) * 5 / 6;
  const double bend = s.young * std::pow(height, 4) / 12, h = length / 20000;
  double sag = 0;
  const auto turned_too_far = [&](double slope) {  // turn: downwards from the axis
    double turn = 0;
    sag = 0;
    for (int k = 0; k < 20000; ++k) {
      const double load = weight * (length - (k + 0.5) * h), c = std::cos(turn), d = std::sin(turn);
      const double along = 1 + load * d / stretch, across = load * c / shear;
      turn += slope * h;
      slope -= h * load * (along * c - across * d) / bend;
      sag += h * (along * d + across * c);
      if (turn > 3 || turn < -0.1) return turn > 0;
    }
    return slope > 0;
  };
  bisect(0, weight * length * length / bend, [&](double slope) { return !turned_too_far(slope); });
  return sag;
}

struct Shape {
  const char *name, *kind;
  std::array<double, 3> size;
  uint32_t cells;
  double length;  // m, what carries the weight
  bool clamped() const { return !std::strcmp(name, "cantilever"); }
  bool ball() const { return !std::strcmp(name, "ball"); }
  // The middle of a column, the end of a cantilever with shear (Timoshenko), the approach of a ball and a
  // plane (Hertz).
  double linear(const Substance &s) const {
    const double load = s.density * kG;
    if (ball()) {
      const double force = load * 4.0 / 3 * M_PI * std::pow(size[0], 3);
      const double stiff = s.young / (1 - s.poisson * s.poisson);
      return std::cbrt(9 * force * force / (16 * stiff * stiff * size[0]));
    }
    if (!clamped()) return load * length * length / (3 * s.young);
    const double height = size[2], shear = s.young / (2 * (1 + s.poisson));
    return load * std::pow(length, 4) / (8 * s.young * height * height / 12) +
           load * length * length / (2 * shear * 5 / 6);
  }
  double reference(const Substance &s) const {
    const double nu = std::max(s.poisson, 0.25);  // what the model gives
    return ball() ? linear(s) : clamped() ? rod(s, length, size[2], nu) : column(s, length, nu);
  }
  // rad/s, the slowest: for a damper that brings the body to rest; a ball's on its contact spring
  double frequency(const Substance &s) const {
    const double speed = std::sqrt(s.young / s.density);
    if (ball()) return std::min(M_PI / 2 * speed / length, std::sqrt(1.5 * kG / linear(s)));
    return clamped() ? 3.516 * size[2] / std::sqrt(12.0) / (length * length) * speed
                     : M_PI / 2 * speed / length;
  }
};
constexpr Shape kShapes[] = {{"cube", "beam", {0.1, 0.1, 0.1}, 1000, 0.1},
                             {"column", "cylinder", {0.04, 0.12, 0}, 1000, 0.12},
                             {"ball", "ball", {0.05, 0, 0}, 10000, 0.1},
                             {"cantilever", "beam", {0.3, 0.05, 0.05}, 8000, 0.3}};

std::vector<double> points(dfm_body body) {
  uint32_t n = 0;
  test::ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
  std::vector<double> x(size_t(3) * n);
  test::ok(dfm_body_get_state(body, n, x.data(), nullptr, &n));
  return x;
}

std::vector<uint32_t> where(const std::vector<double> &x, double low, double high) {
  std::vector<uint32_t> found;
  for (uint32_t i = 0; i < x.size() / 3; ++i)
    if (x[3 * i] >= low && x[3 * i] <= high) found.push_back(i);
  return found;
}

// Of a clamped body the mean height of its free end, of another that of its middle above its lowest point.
double height(dfm_body body, const std::vector<uint32_t> &end) {
  const std::vector<double> x = points(body);
  double mean = 0, lowest = HUGE_VAL;
  for (uint32_t i : end) mean += x[3 * size_t(i) + 2] / double(end.size());
  for (size_t i = 2; i < x.size(); i += 3) lowest = std::min(lowest, x[i]);
  return end.empty() ? test::measure(body).com[2] - lowest : mean;
}

struct Result {
  double sag, share, speed;
  uint32_t inverted, inverted_max;
  uint64_t substeps;
};

Result settle(const Shape &shape, const Substance &s, double step) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  test::BodyOptions o;
  const double frequency = shape.frequency(s);
  o.name = "body";
  o.young = s.young;
  o.density = s.density;
  o.poisson = s.poisson;
  o.damping_mass = 2 * frequency;
  o.position = {0, 0, shape.clamped() ? 0 : shape.ball() ? shape.size[0] + 1e-4 : 1e-4};
  const dfm_body body = test::make_body(context, world, shape.kind, shape.size, shape.cells, o);
  std::vector<uint32_t> end;
  if (shape.clamped()) {
    const std::vector<double> x = points(body);
    const std::vector<uint32_t> root = where(x, -1, 1e-9);
    end = where(x, shape.length - 1e-9, 1);
    test::ok(dfm_body_hold(body, uint32_t(root.size()), root.data(), 7));
  } else {
    test::add_plane(world, "floor");
    test::set_friction(world, 0, "none");
  }
  const double start = height(body, end);
  const int steps = std::max(30, int(std::ceil(20 / frequency / step)));
  for (int k = 0; k < steps; ++k)
    if (dfm_world_step(world, step, nullptr) != DFM_OK) {
      std::printf("%s\n", dfm_last_error());
      return Result{NAN, NAN, NAN, 0, 0, 0};
    }
  const dfm_body_measure m = test::measure(body);
  const dfm_world_stats now = test::stats(world);
  return {start - height(body, end),
          m.volume / m.rest_volume,
          std::sqrt(2 * m.kinetic / m.mass),
          m.inverted,
          now.inverted_max,
          now.substeps};
}

}  // namespace

int main(int argc, char **argv) {
  const char *only = argc > 2 && !std::strcmp(argv[argc - 2], "--only") ? argv[argc - 1] : "";
  FILE *out = argc > 1 && argv[1][0] != '-' ? std::fopen(argv[1], "w") : stdout;
  if (!out) {
    std::fprintf(stderr, "%s cannot be written\n", argv[1]);
    return 1;
  }
  std::fprintf(out,
               "shape,young_Pa,density,poisson,step_s,load,sag_m,linear_m,reference_m,sag_over_linear,sag_"
               "over_reference,volume_share,inverted,inverted_max,rest_speed,substeps\n");
  for (const Shape &shape : kShapes)
    for (const Substance &s : kSubstances) {
      if (!std::strstr(shape.name, only)) continue;
      const double linear = shape.linear(s);
      const double reference = shape.reference(s);
      const double load = s.density * kG * shape.length / s.young;
      for (const double step : kSteps) {
        const Result r = settle(shape, s, step);
        std::fprintf(out, "%s,%g,%g,%g,%.6g,%.4g,%.6g,%.6g,%.6g,%.4g,%.4g,%.4f,%u,%u,%.2g,%llu\n", shape.name,
                     s.young, s.density, s.poisson, step, load, r.sag, linear, reference, r.sag / linear,
                     r.sag / reference, r.share, r.inverted, r.inverted_max, r.speed,
                     static_cast<unsigned long long>(r.substeps));
        std::fflush(out);
      }
    }
  if (out != stdout) std::fclose(out);
  return testing::Test::HasFailure();
}
