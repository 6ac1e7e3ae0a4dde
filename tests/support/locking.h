// What locks near poisson 1/2: answers of linear tetrahedra over the truth, with and without the volume
// change by points. Loads are those of the reference set, Young's modulus is 1e5 times theirs, so that
// strains are small and the corotational model is linear.
#pragma once
#include "statics.h"

namespace test {

constexpr double kStiffer = 1e5;

struct LockingBody : Statics {
  std::vector<double> rest_points, moved;
  // `locking`: as the parameter, 0 none, 1 nodal
  LockingBody(const std::string &mesh, const std::string &loads, double young, double poisson, double locking,
              bool plane_strain = false)
      : Statics(mesh_path(mesh), "corotational_fem", kStiffer * young, poisson, {{"locking", &locking, 1}}),
        rest_points(rest()) {
    apply(reference("fields/" + loads + "_bc.csv"));
    for (uint32_t i = 0; plane_strain && i < npoint; ++i) hold(i, rest_points[3 * i] == 0 ? 7 : 4);
    solve();
    moved = displacement();
    for (double &u : moved) u *= kStiffer;
  }
  // Mean of value(X, u) over the points that `is` picks by their rest positions.
  template <class Is, class Value>
  double mean(const Is &is, const Value &value) const {
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < npoint; ++i) {
      if (!is(&rest_points[3 * size_t(i)])) continue;
      sum += value(&rest_points[3 * size_t(i)], &moved[3 * size_t(i)]);
      ++count;
    }
    return sum / count;
  }
};

// Cook's membrane in plane strain, poisson 0.4999: the rise of its upper right corner; mesh 1 to 3.
inline double cooks_membrane(int mesh, double locking) {
  const std::string name = "cook3d_" + std::to_string(mesh);
  const LockingBody b("bench/" + name + ".msh", name, 1, 0.4999, locking, true);
  return b.mean([](const double *x) { return std::abs(x[0] - 48) < 1e-9 && std::abs(x[1] - 60) < 1e-9; },
                [](const double *, const double *u) { return u[1]; }) /
         19.427921689478026;
}

// Thick cylinder (plane strain) and thick sphere under pressure inside, radii 0.05 and 0.1: Lame's
// displacement of the inner face; mesh 1 or 2.
inline double lame(bool sphere, int mesh, double poisson, double locking) {
  constexpr double kInner = 0.05, kOuter = 0.1, kPressure = 1000, kYoung = 1e5;
  const std::string name = (sphere ? "lame_sphere_" : "lame_cylinder_") + std::to_string(mesh);
  const LockingBody b("bench/" + name + ".msh", name, kYoung, poisson, locking);
  const auto radius = [&](const double *x) { return std::hypot(x[0], x[1], sphere ? x[2] : 0); };
  const double n = sphere ? 3 : 2, a = std::pow(kInner, n), c = std::pow(kOuter, n);
  const double outward =
      sphere ? (1 - 2 * poisson) + (1 + poisson) / 2 * c / a : (1 + poisson) * ((1 - 2 * poisson) + c / a);
  return b.mean([&](const double *x) { return std::abs(radius(x) - kInner) < 1e-6; },
                [&](const double *x, const double *u) {
                  return (x[0] * u[0] + x[1] * u[1] + (sphere ? x[2] * u[2] : 0)) / radius(x);
                }) /
         (kPressure * a / (c - a) / kYoung * kInner * outward);
}

// Clamped bar of length 1 and section 0.1 x 0.1 under a load at its end: P L^3 / (3 E I); mesh bar_s2 or
// bar_s3.
inline double bent_bar(int mesh, double poisson, double locking) {
  const LockingBody b("bars/bar_s" + std::to_string(mesh) + ".msh",
                      "lin_bar_s" + std::to_string(mesh) + "_tip", 1e5, poisson, locking);
  return b.mean([](const double *x) { return std::abs(x[0] - 1) < 1e-9; },
                [](const double *, const double *u) { return u[2]; }) /
         -0.004;
}

// The same bar on cells of the generator, so that nothing is read: about four cells thick.
inline double bent_made_bar(double poisson, double locking) {
  Context context;
  dfm_mesh_handle mesh = 0;
  const double size[3] = {1, 0.1, 0.1}, young = 1e10, force = -10;
  ok(dfm_mesh_make(context, "beam", size, DFM_MESH_CELLS, 4000, &mesh));
  dfm_body_def d = dfm_body_def_default();
  lend(mesh, d);
  const std::vector<double> points(d.points, d.points + size_t(3) * d.npoint);
  const std::vector<uint32_t> tets(d.tets, d.tets + size_t(4) * d.ntet);
  Statics bar(points, tets, "corotational_fem", young, poisson, {{"locking", &locking, 1}});
  std::vector<uint32_t> tip;
  for (uint32_t i = 0; i < bar.npoint; ++i) {
    if (points[3 * size_t(i)] < 1e-9) bar.hold(i, 7);
    if (points[3 * size_t(i)] > 1 - 1e-9) tip.push_back(i);
  }
  const double share[3] = {0, 0, force / double(tip.size())};
  for (const uint32_t i : tip) bar.load(i, share);
  bar.solve();
  const std::vector<double> moved = bar.displacement();
  double down = 0;
  for (const uint32_t i : tip) down += moved[3 * size_t(i) + 2] / double(tip.size());
  const double inertia = 0.1 * 0.1 * 0.1 * 0.1 / 12;  // m4
  return down / (force / (3 * young * inertia));
}

}  // namespace test
