// Soft material at the defaults: nine materials, four shapes, three steps. Each body comes to rest under its weight, on a floor without friction or
// clamped at one end, and is compared with the linear theory of its shape: how far it sinks, what volume is left, and how many cells were ever inside
// out. Prints a table; with a file as argument writes it there (results/soft_material.csv, doc/models/msm.md).
#include <cstdio>

#include "../support/world.h"

namespace {

constexpr double kG = 9.81;

struct Substance { double young, density, poisson; };
constexpr Substance kSubstances[] = {{1e3, 1000, 0.3}, {3e3, 1000, 0.3}, {1e4, 1000, 0.3},  {1e4, 1000, 0.45}, {1e5, 300, 0.0},
                                     {1e5, 1000, 0.2}, {1e5, 1100, 0.49}, {1e6, 1200, 0.45}, {1e7, 1200, 0.4}};
constexpr double kSteps[] = {1e-3, 1.0 / 240, 1.0 / 60};

// Where the middle of the body, or the end of the beam, sinks by linear theory; and the slowest angular frequency, for a damper that brings it to rest.
struct Shape {
  const char *name, *kind;
  std::array<double, 3> size;
  uint32_t cells;
  bool clamped;
  double sag(const Substance &s) const {
    const double load = s.density * kG;
    if (!clamped) {   // a column: rho g L^2/(3 E) for its centre of mass; a ball by Hertz
      if (std::string(kind) != "ball") return load * std::pow(size[std::string(kind) == "beam" ? 2 : 1], 2) / (3 * s.young);
      const double force = load * 4.0 / 3 * M_PI * std::pow(size[0], 3), stiff = s.young / (1 - s.poisson * s.poisson);
      return std::cbrt(9 * force * force / (16 * stiff * stiff * size[0]));
    }
    const double length = size[0], height = size[2], shear = s.young / (2 * (1 + s.poisson));   // Timoshenko: bending and shear
    return load * std::pow(length, 4) / (8 * s.young * height * height / 12) + load * length * length / (2 * shear * 5 / 6);
  }
  double frequency(const Substance &s) const {
    const double speed = std::sqrt(s.young / s.density);
    if (clamped) return 3.516 * size[2] / std::sqrt(12.0) / (size[0] * size[0]) * speed;
    return M_PI / 2 * speed / (std::string(kind) == "ball" ? 2 * size[0] : std::string(kind) == "beam" ? size[2] : size[1]);
  }
};
constexpr Shape kShapes[] = {{"cube", "beam", {0.1, 0.1, 0.1}, 1000, false},
                             {"column", "cylinder", {0.04, 0.12, 0}, 1000, false},
                             {"ball", "ball", {0.05, 0, 0}, 1500, false},
                             {"cantilever", "beam", {0.3, 0.05, 0.05}, 2500, true}};

struct Result { double sag, theory, share, speed; uint32_t inverted; uint64_t substeps; };

// Height of the middle; of a clamped body, the mean of its free end's.
double height(const Shape &shape, dfm_body body) {
  if (!shape.clamped) return test::measure(body).com[2];
  uint32_t n = 0;
  test::ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
  std::vector<double> x(size_t(3) * n);
  test::ok(dfm_body_get_state(body, n, x.data(), nullptr, &n));
  static std::vector<uint32_t> end;   // found at rest, once: the mesh is the same for all
  if (end.empty())
    for (uint32_t i = 0; i < n; ++i)
      if (x[3 * i] > shape.size[0] - 1e-9) end.push_back(i);
  double z = 0;
  for (uint32_t i : end) z += x[3 * size_t(i) + 2] / double(end.size());
  return z;
}

Result settle(const Shape &shape, const Substance &s, double step) {
  test::Context context;
  const dfm_world world = test::make_world(context, {0, 0, -kG});
  test::BodyOptions o;
  const double frequency = shape.frequency(s);
  o.name = "body", o.young = s.young, o.density = s.density, o.poisson = s.poisson, o.damping_mass = 2 * frequency;
  o.position = {0, 0, shape.clamped ? 0 : std::string(shape.kind) == "ball" ? shape.size[0] + 1e-4 : 1e-4};
  const dfm_body body = test::make_body(context, world, shape.kind, shape.size, shape.cells, o);
  if (shape.clamped) {
    uint32_t n = 0;
    test::ok(dfm_body_get_state(body, 0, nullptr, nullptr, &n));
    std::vector<double> x(size_t(3) * n);
    test::ok(dfm_body_get_state(body, n, x.data(), nullptr, &n));
    std::vector<uint32_t> root;
    for (uint32_t i = 0; i < n; ++i)
      if (x[3 * i] < 1e-9) root.push_back(i);
    test::ok(dfm_body_hold(body, uint32_t(root.size()), root.data(), 7));
  } else {
    test::add_plane(world, "floor");
    test::set_friction(world, 0, "none");
  }
  const double start = height(shape, body) - (shape.clamped ? 0 : 1e-4);
  const int steps = std::max(30, int(std::ceil(20 / frequency / step)));
  for (int k = 0; k < steps; ++k)
    if (dfm_world_step(world, step, nullptr) != DFM_OK) return std::printf("%s\n", dfm_last_error()), Result{NAN, shape.sag(s), NAN, NAN, 0, 0};
  const dfm_body_measure m = test::measure(body);
  const dfm_world_stats now = test::stats(world);
  const double speed = std::sqrt(2 * m.kinetic / m.mass);
  return {start - height(shape, body), shape.sag(s), m.volume / m.rest_volume, speed, now.inverted_max, now.substeps};
}

}  // namespace

int main(int argc, char **argv) {
  FILE *out = argc > 1 ? std::fopen(argv[1], "w") : stdout;
  if (!out) return std::fprintf(stderr, "%s cannot be written\n", argv[1]), 1;
  std::fprintf(out, "shape,young_Pa,density,poisson,step_s,sag_m,linear_m,sag_over_linear,linear_strain,volume_share,inverted_max,rest_speed,substeps\n");
  for (const Shape &shape : kShapes)
    for (const Substance &s : kSubstances)
      for (const double step : kSteps) {
        const Result r = settle(shape, s, step);
        const double strain = r.theory / shape.size[std::string(shape.kind) == "cylinder" ? 1 : 0];
        std::fprintf(out, "%s,%g,%g,%g,%.6g,%.6g,%.6g,%.4g,%.3g,%.4f,%u,%.2g,%llu\n", shape.name, s.young, s.density, s.poisson, step, r.sag, r.theory,
                     r.sag / r.theory, strain, r.share, r.inverted, r.speed, static_cast<unsigned long long>(r.substeps));
        std::fflush(out);
      }
  if (out != stdout) std::fclose(out);
  return testing::Test::HasFailure();
}
