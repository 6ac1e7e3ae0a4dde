// All rows of the rigid-limit tables of ../shared/reference/contact, and the elastic cases (Hertz, impact, stack) with the model's own error,
// against mesh and step. libdeform/doc/concepts/contact_reference.md holds what it prints.
#include <cstdio>

#include "contact_reference.h"
#include "support.h"
#include "zoned.h"

namespace {

namespace ref = test::reference;

std::vector<std::vector<std::string>> table(const char *name) {
  auto rows = test::read_csv(test::shared_dir() + "/reference/contact/tables/" + name + ".csv");
  rows.erase(rows.begin());
  return rows;
}
double percent(double got, double want) { return 100 * (got / want - 1); }

void rigid() {
  double worst = 0, creep = 0;
  for (const auto &r : table("incline_block")) {
    const double theta = std::stod(r[0]), mu = std::stod(r[1]), ratio = std::stod(r[6]);
    if (std::fabs(ratio - 1) < 0.01) continue;
    const ref::Incline got = ref::incline(theta, mu);
    if (std::stod(r[2]) != 0) worst = std::max(worst, std::fabs(percent(got.acceleration, std::stod(r[3]))));
    else creep = std::max(creep, std::fabs(got.creep));
  }
  std::printf("incline_block: worst acceleration %.3f %%, most creep in 0.9 s %.2e m\n", worst, creep);
  for (const bool belt : {false, true}) {
    double time = 0, way = 0;
    for (const auto &r : table(belt ? "conveyor" : "sliding_stop")) {
      const ref::Slide got = ref::slide(std::stod(r[0]), std::stod(r[1]), belt);
      time = std::max(time, std::fabs(percent(got.time, std::stod(r[belt ? 2 : 3]))));
      way = std::max(way, std::fabs(percent(got.distance, std::stod(r[belt ? 3 : 2]))));
    }
    std::printf("%s: worst time %.3f %%, way %.3f %%\n", belt ? "conveyor" : "sliding_stop", time, way);
  }
  for (const bool ball : {false, true}) {
    const std::string name = ball ? "solid sphere" : "solid cylinder";
    for (const auto &r : table("rolling_incline")) {
      if (r[0] != name || (r[1] != "10" && r[1] != "30") || (r[2] != "0.1" && r[2] != "0.3")) continue;
      const ref::Roll got = ref::roll(ball, std::stod(r[1]), std::stod(r[2]));
      std::printf("%s, %s degrees, mu %s, %s: a %+.2f %%, R alpha %+.2f %%\n", r[0].c_str(), r[1].c_str(), r[2].c_str(), r[4].c_str(),
                  percent(got.acceleration, std::stod(r[5])), percent(got.turning, std::stod(r[6])));
    }
    for (const auto &r : table("skid_to_roll")) {
      if (r[0] != name || r[1] != "1" || (r[2] != "0.1" && r[2] != "0.3")) continue;
      const ref::Skid got = ref::skid(ball, 1, std::stod(r[2]));
      std::printf("%s thrown at 1 m/s, mu %s: time %+.2f %%, speed %+.2f %%, way %+.2f %%\n", r[0].c_str(), r[2].c_str(), percent(got.time, std::stod(r[3])),
                  percent(got.speed, std::stod(r[4])), percent(got.distance, std::stod(r[5])));
    }
  }
  for (const auto &r : table("stick_slip")) {
    const auto v = [&](int i) { return std::stod(r[size_t(i)]); };
    const ref::StickSlip got = ref::stick_slip(v(0), v(1), v(2), v(3), v(4), 1e-4, 2.3 * v(11) + v(5) / v(4), 8e-4 * v(4));
    std::printf("stick_slip, m %g: period %+.2f %%, swing %+.2f %%\n", v(0), percent(got.period, v(11)), percent(got.x_max - got.x_min, v(6) - v(8)));
  }
}

// Drop of the highest surfel of a body.
double top_of(dfm_body body) {
  uint32_t n = 0;
  test::ok(dfm_surface_positions(body, 0, nullptr, &n));
  std::vector<double> x(3 * n);
  test::ok(dfm_surface_positions(body, n, x.data(), &n));
  double top = -1e300;
  for (uint32_t i = 0; i < n; ++i) top = std::max(top, x[3 * i + 2]);
  return top;
}

// Boxes on each other, nu = 0: weight above each interface, and the shortening rho g (n L)^2 / (2 E).
void stack() {
  const auto row = table("box_stack").back();
  const uint32_t count = uint32_t(std::stoul(row[0]));
  const double edge = std::stod(row[1]), rho = std::stod(row[2]);
  for (const double stiffer : {1.0, 10.0})
    for (const uint32_t cells : {12u, 96u}) {
      const double young = stiffer * std::stod(row[3]), shortening = std::stod(row[6]) / stiffer;
      test::Context context;
      const dfm_world world = test::make_world(context);
      std::vector<dfm_body> box;
      for (uint32_t k = 0; k < count; ++k) {
        test::BodyOptions o;
        o.young = young, o.density = rho, o.poisson = 0, o.damping_mass = 10, o.damping_stiffness = 1e-3;
        o.position = {-edge / 2, -edge / 2, k * (edge + 1e-4)};
        box.push_back(test::make_body(context, world, "beam", {edge, edge, edge}, cells, o));
      }
      const dfm_obstacle floor = test::add_plane(world, "floor");
      test::set_friction(world, 0.3);
      test::run(world, 2, 1e-3);
      double worst = 0;
      for (uint32_t k = 0; k < count; ++k) {
        const double origin[3] = {};
        double force[3] = {};
        test::ok(dfm_world_pair_wrench(world, box[k], k ? uint64_t(box[k - 1]) : uint64_t(floor), origin, force, nullptr));
        worst = std::max(worst, std::fabs(percent(force[2], (count - k) * rho * edge * edge * edge * ref::kG)));
      }
      std::printf("box_stack, E %g Pa, boxes of %u cells: worst interface force %.3f %%, shortening %+.2f %%\n", young, cells, worst,
                  percent(count * edge - top_of(box.back()), shortening));
    }
}

// Bar of nu = 0 end-on against a wall: time in contact and rebound.
void bar_impact() {
  const auto row = table("bar_impact").at(0);
  const double length = std::stod(row[0]), young = std::stod(row[1]), rho = std::stod(row[2]), v = std::stod(row[3]);
  for (const uint32_t along : {10u, 20u, 40u})
    for (const double h : {1e-3, 2.5e-4}) {
      test::Context context;
      const dfm_world world = test::make_world(context, {0, 0, 0});
      test::BodyOptions o;
      o.young = young, o.density = rho, o.poisson = 0, o.velocity = {0, 0, -v}, o.position = {0, 0, 2e-3};
      const double width = length / along;
      const dfm_body body = test::make_body(context, world, "beam", {width, width, length}, 12 * along, o);
      test::add_plane(world, "wall");
      double first = -1, last = 0, peak = 0;
      int k = 0;
      for (double t = 0; t < 0.2; t += h, ++k) {
        test::run(world, h, h);
        dfm_pair_report pair{};
        uint32_t n = 0;
        test::ok(dfm_world_pairs(world, 1, &pair, &n));
        if (n && pair.normal > 0) first = first < 0 ? t : first, last = t + h, peak += h * pair.normal;
      }
      const dfm_body_measure m = test::measure(body);
      std::printf("bar_impact, %u elements along, h %g s: contact time %+.1f %%, mean stress %+.1f %%, rebound %.3f of v\n", along, h,
                  percent(last - first, std::stod(row[5])), percent(peak / (last - first) / (width * width), std::stod(row[6])), m.velocity[2] / v);
    }
}

// Sphere pressed on a plane by its own volume force (Hertz): radius of contact and approach at equilibrium.
void hertz() {
  const auto row = table("hertz").at(4);
  const double radius = std::stod(row[1]), young = std::stod(row[2]), nu = std::stod(row[3]), load = std::stod(row[4]);
  const double a = std::stod(row[5]), depth = std::stod(row[6]);
  for (const uint32_t cells : {1000u, 4000u, 12000u}) {
    test::Context context;
    const double volume = 4.18879020479 * radius * radius * radius, g = load / (1000 * volume);
    const dfm_world world = test::make_world(context, {0, 0, -g});
    test::BodyOptions o;
    o.young = young, o.poisson = nu, o.damping_mass = 60, o.damping_stiffness = 1e-4, o.position = {0, 0, radius};
    const dfm_body body = test::make_body(context, world, "ball", {radius, 0, 0}, cells, o);
    test::add_plane(world, "plane");
    test::run(world, 0.4, 5e-4);
    const dfm_body_measure m = test::measure(body);
    double reach = 0;
    for (const dfm_contact &c : test::contacts(world)) reach = std::max(reach, c.fn > 0 ? std::hypot(c.point[0] - m.com[0], c.point[1] - m.com[1]) : 0);
    std::printf("hertz, ball of %u cells: radius of contact %.5f m (%.5f), approach %.6f m (%.6f)\n", cells, reach, a, radius - m.com[2], depth);
  }
}

// Ball thrown at a plane: time in contact, depth, rebound.
void hertz_impact() {
  const auto row = table("hertz_impact").at(1);
  const double radius = std::stod(row[0]), young = std::stod(row[1]), nu = std::stod(row[2]), rho = std::stod(row[3]), v = std::stod(row[4]);
  for (const uint32_t cells : {1000u, 8000u}) {
    test::Context context;
    const dfm_world world = test::make_world(context, {0, 0, 0});
    test::BodyOptions o;
    o.young = young, o.poisson = nu, o.density = rho, o.velocity = {0, 0, -v}, o.position = {0, 0, 1.01 * radius};
    const dfm_body body = test::make_body(context, world, "ball", {radius, 0, 0}, cells, o);
    test::add_plane(world, "plane");
    double first = -1, last = 0, low = radius;
    const double h = 1e-4;
    for (double t = 0; t < 0.05; t += h) {
      test::run(world, h, h);
      low = std::min(low, test::measure(body).com[2]);
      if (test::stats(world).contacts) first = first < 0 ? t : first, last = t + h;
    }
    std::printf("hertz_impact at %g m/s, ball of %u cells: contact time %+.1f %%, depth %+.1f %%, rebound %.3f of v\n", v, cells, percent(last - first, std::stod(row[7])),
                percent(radius - low, std::stod(row[6])), test::measure(body).velocity[2] / v);
  }
}

}  // namespace

// contact_reference [rigid|elastic]: one half alone.
int main(int argc, char **argv) {
  if (test::shared_dir().empty()) return std::printf("../shared/reference is absent\n"), 0;
  const std::string half = argc > 1 ? argv[1] : "";
  if (half != "rigid") bar_impact(), hertz_impact(), stack(), hertz();
  if (half != "elastic") rigid();
}
