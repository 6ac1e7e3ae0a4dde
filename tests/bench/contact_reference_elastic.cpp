#include "contact_reference_elastic.h"

#include "contact_elastic.h"
#include "reference_table.h"
#include "support.h"

namespace bench {
namespace {

namespace el = test::elastic;
constexpr double kG = 9.81;

std::vector<std::vector<std::string>> table(const char *name) {
  auto rows = test::read_csv(test::reference_dir() + "/contact/tables/" + name + ".csv");
  rows.erase(rows.begin());
  return rows;
}
double number(const std::vector<std::string> &row, int k) { return std::stod(row[size_t(k)]); }
std::string signed_percent(double got, double want) { return text("%+.1f", percent(got, want)); }

using Jobs = std::vector<std::function<std::vector<std::string>()>>;
std::string run_all(std::vector<std::string> head, const Jobs &jobs) {
  Table t{std::move(head), std::vector<std::vector<std::string>>(jobs.size())};
  in_parallel(jobs.size(), [&](size_t i) { t.rows[i] = jobs[i](); });
  return t.markdown();
}

// ---- impacts ----------------------------------------------------------------------------------------------

// A body thrown down at a plane z = 0: how long they touch, how near its middle comes, with what share of its
// speed it leaves.
struct Impact { double time, low, rebound, impulse; };
Impact impact(dfm_world world, dfm_body body, double v, double h, double until) {
  double first = -1;
  Impact out{0, test::measure(body).com[2], 0, 0};
  for (double t = 0; t < until; t += h) {
    uint32_t trouble = 0;
    if (dfm_world_step(world, h, &trouble) != DFM_OK) break;
    out.low = std::min(out.low, test::measure(body).com[2]);
    dfm_pair_report pair{};
    uint32_t n = 0;
    test::ok(dfm_world_pairs(world, 1, &pair, &n));
    if (n && pair.normal > 0) {
      first = first < 0 ? t : first;
      out.time = t + h - first;
      out.impulse += h * pair.normal;
    } else if (first >= 0 && t - first > 1.5 * out.time) break;
  }
  out.rebound = test::measure(body).velocity[2] / v;
  return out;
}

std::string bar_impact() {
  Jobs jobs;
  for (const auto &row : table("bar_impact"))
    for (const uint32_t along : {10u, 20u, 40u})
      jobs.push_back([=] {
        const double length = number(row, 0), v = number(row, 3), width = length / along;
        test::Context context;
        const dfm_world world = test::make_world(context, {0, 0, 0});
        test::BodyOptions o;
        o.young = number(row, 1);
        o.density = number(row, 2);
        o.poisson = 0;
        o.velocity = {0, 0, -v};
        o.position = {0, 0, 2e-3};
        const dfm_body body = test::make_body(context, world, "beam", {width, width, length}, 12 * along, o);
        test::add_plane(world, "wall");
        const Impact got = impact(world, body, v, 5e-4, 3 * number(row, 5));
        dfm_world_destroy(world);
        return std::vector<std::string>{
            text("%g m/s", v), std::to_string(along), signed_percent(got.time, number(row, 5)),
            signed_percent(got.impulse / got.time / (width * width), number(row, 6)),
            text("%.3f", got.rebound)};
      });
  return run_all({"bar_impact", "elements along", "contact time, %", "mean stress, %", "rebound"}, jobs);
}

std::string hertz_impact() {
  Jobs jobs;
  for (const auto &row : table("hertz_impact"))
    for (const uint32_t layers : {6u, 9u, 12u})
      jobs.push_back([=] {
        const double R = number(row, 0);
        const double nu = number(row, 2);
        const double v = number(row, 4);
        const double depth = number(row, 6);
        const double time = number(row, 7);
        test::Context context;
        const dfm_world world = test::make_world(context, {0, 0, 0});
        test::BodyOptions o;
        o.young = number(row, 1);
        o.poisson = nu;
        o.density = number(row, 3);
        o.volume = el::volume_for(nu);
        o.velocity = {0, 0, -v};
        o.position = {0, 0, R + 0.02 * std::min(depth, R)};
        const test::Cells cells =
            el::graded_ball(context, R, layers, el::grading(std::min(0.5, std::sqrt(depth / R))));
        const dfm_body body = test::make_body(world, cells, o);
        test::add_plane(world, "plane");
        test::set_friction(world, 0, "none");
        const double high = test::measure(body).com[2] - 0.02 * std::min(depth, R);
        const Impact got = impact(world, body, v, 0.005 * time, 3 * time);
        const uint32_t inside_out = test::stats(world).inverted_max;
        dfm_world_destroy(world);
        return std::vector<std::string>{text("%g m/s, v/c %.2g", v, number(row, 9)),
                                        std::to_string(cells.ntet()),
                                        signed_percent(got.time, time),
                                        signed_percent(high - got.low, depth),
                                        text("%.3f", got.rebound),
                                        std::to_string(inside_out)};
      });
  return run_all({"hertz_impact", "cells", "contact time, %", "depth, %", "rebound", "cells inside out"},
                 jobs);
}

// ---- pressed ----------------------------------------------------------------------------------------------

std::string hertz() {
  Jobs jobs;
  for (const auto &row : table("hertz")) {
    const bool two = row[0] == "two equal spheres";
    if (!two && row[0] != "sphere-rigid plane") continue;
    for (const uint32_t layers : {6u, 9u, 12u})
      for (const double longer : {1.0, 2.0, 4.0}) {
        if (longer > 1 && layers != 9) continue;
        jobs.push_back([=] {
          const el::Sphere s{number(row, 1), number(row, 2), number(row, 3)};
          const double a = el::hertz_radius(s, number(row, 4));
          const auto p = el::pressed_ball(s, a * a / s.R, layers, longer, two);
          const el::Touch t = p->below();
          const double reached =
              two ? std::cbrt(3 * t.force * s.R / (4 * s.stiffness())) : el::hertz_radius(s, t.force);
          const double near = reached * reached / s.R;
          return std::vector<std::string>{
              text("%s, E %g, nu %g, a/R %.3f", two ? "two spheres" : "sphere on plane", s.young, s.nu,
                   a / s.R),
              std::to_string(p->cells.ntet()),
              text("%.1f", a / p->surfel()),
              text("%g", longer),
              std::to_string(t.points),
              text("%.2f", t.force / number(row, 4)),
              signed_percent(std::sqrt(2.5) * t.reach, reached),
              signed_percent(p->approach(), two ? 2 * near : near)};
        });
      }
  }
  return run_all({"hertz", "cells of a ball", "a / surfel", "step / bound", "contacts", "force / table's",
                  "a, %", "approach, %"},
                 jobs);
}

std::string hertz_line() {
  Jobs jobs;
  for (const auto &row : table("hertz")) {
    if (row[0].rfind("cylinder", 0) != 0) continue;
    for (const uint32_t across : {3u, 5u, 8u})
      jobs.push_back([=] {
        const double R = number(row, 1), young = number(row, 2), nu = number(row, 3), load = number(row, 4);
        const el::Line got = el::pressed_line(R, young, nu, load, across);
        return std::vector<std::string>{
            text("cylinder on plane, E %g, nu %g, a/R %.3f", young, nu, number(row, 5) / R),
            std::to_string(across), std::to_string(got.points), text("%.2f", got.load / load),
            signed_percent(got.half_width, el::line_half_width(R, young, nu, got.load))};
      });
  }
  return run_all({"hertz", "a / surfel", "contacts", "force / table's", "a, %"}, jobs);
}

std::string squeezed() {
  Jobs jobs;
  for (const auto &row : table("squeezed_ball_fe")) {
    if (row[3] != "1") continue;
    const bool ball = row[0] == "sphere";
    for (const uint32_t fine : ball ? std::vector<uint32_t>{6, 9, 12} : std::vector<uint32_t>{24, 36, 54})
      jobs.push_back([=] {
        constexpr double kYoung = 1e5;
        const double nu = number(row, 1), depth = number(row, 2), force = kYoung * number(row, 4);
        const auto p = ball ? el::pressed_ball({1, kYoung, nu}, depth, fine)
                            : el::pressed_disc(1, kYoung, nu, depth, force, fine);
        const el::Touch t = p->below();
        // the last per cent of the way by the power law that the table itself follows
        const double reached = p->approach() / depth, power = ball ? 1.52 : 1.17;
        return std::vector<std::string>{
            text("%s, nu %g, d/R %g", row[0].c_str(), nu, depth),
            std::to_string(p->cells.ntet()),
            text("%.1f", number(row, 5) / (ball ? p->surfel() : 1.0 / fine)),
            std::to_string(t.points),
            text("%.3f", reached),
            signed_percent((ball ? t.force : t.force * fine / 2) / std::pow(reached, power), force),
            signed_percent((ball ? std::sqrt(2.5) : 2) * t.reach / std::sqrt(reached), number(row, 5))};
      });
  }
  return run_all(
      {"squeezed_ball_fe", "cells", "a / surfel", "contacts", "depth / table's", "force, %", "a, %"}, jobs);
}

// Tangential load on a ball that was pressed without friction: shift and stick radius, against the closed
// forms at the normal force that was reached.
std::string mindlin() {
  struct Case {
    el::Sphere s;
    double load, mu;
    uint32_t layers;
  };
  std::vector<Case> cases;
  for (const auto &r : table("mindlin")) {
    const el::Sphere s{number(r, 0), number(r, 1), number(r, 2)};
    if (!cases.empty() && cases.back().s.young == s.young && cases.back().mu == number(r, 4)) continue;
    for (const uint32_t layers : {6u, 9u, 12u}) cases.push_back({s, number(r, 3), number(r, 4), layers});
  }
  Jobs jobs;
  for (const Case &c : cases)
    jobs.push_back([c] {
      const double a = el::hertz_radius(c.s, c.load);
      const auto p = el::pressed_ball(c.s, a * a / c.s.R, c.layers);
      const double n = p->below().force;
      const double reached = el::hertz_radius(c.s, n);
      const double shear = c.s.young / (2 * (1 + c.s.nu));
      test::ok(test::friction(p->world, "soft", "bottom", c.mu));
      p->shear(0);
      const auto start = p->frame();
      std::vector<std::string> out{text("E %g, nu %g, mu %g", c.s.young, c.s.nu, c.mu),
                                   std::to_string(p->cells.ntet()), text("%.1f", a / p->surfel())};
      // the table's last load is the limit itself, where it slides
      for (const double part : {0.25, 0.5, 0.75, 0.9, 0.995}) {
        p->shear(part * c.mu * n);
        const auto now = p->frame();
        const double shift = now.shift - start.shift - (now.turn - start.turn) * c.s.R;
        const double closed =
            3 * c.mu * n * (2 - c.s.nu) / (16 * shear * reached) * (1 - std::pow(1 - part, 2.0 / 3));
        out.push_back(text("%+.0f; %.2f (%.2f)", percent(shift, closed), std::sqrt(p->below().stick),
                           std::cbrt(1 - part)));
      }
      return out;
    });
  return run_all({"mindlin: shift, %; stick radius / a (closed form)", "cells", "a / surfel", "T = 0.25 mu N",
                  "0.5", "0.75", "0.9", "0.995"},
                 jobs);
}

// ---- stack ------------------------------------------------------------------------------------------------

// Springs in all directions alike under a compression s along z with free sides: W = 3 E <(|F n| - 1)^2>;
// nominal stress over E.
double spring_stress(double s) {
  constexpr int kPoints = 200;
  const auto over = [](double z, double lz, double lt) {
    return std::sqrt(lt * lt * (1 - z * z) + lz * lz * z * z);
  };
  const double lz = 1 - s;
  double low = 1, high = 1.6;
  const auto side = [&](double lt) {  // dW/dlt
    double sum = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double z = (i + 0.5) / kPoints, l = over(z, lz, lt);
      sum += (l - 1) / l * lt * (1 - z * z);
    }
    return sum;
  };
  for (int k = 0; k < 50; ++k) (side(0.5 * (low + high)) < 0 ? low : high) = 0.5 * (low + high);
  double sum = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double z = (i + 0.5) / kPoints, l = over(z, lz, 0.5 * (low + high));
    sum -= 6 * (l - 1) / l * lz * z * z / kPoints;
  }
  return sum;
}

// Shortening of a column of weight q E on its foot, over its height; below 0: they do not carry it.
double spring_column(double q) {
  constexpr int kPoints = 100;
  double sum = 0;
  for (int i = 0; i < kPoints; ++i) {
    const double stress = q * (i + 0.5) / kPoints;
    double low = 0, high = 0.55;
    if (spring_stress(high) < q) return -1;
    for (int k = 0; k < 30; ++k)
      (spring_stress(0.5 * (low + high)) < stress ? low : high) = 0.5 * (low + high);
    sum += 0.5 * (low + high) / kPoints;
  }
  return sum;
}

double top_of(dfm_body body) {
  uint32_t n = 0;
  test::ok(dfm_surface_positions(body, 0, nullptr, &n));
  std::vector<double> x(3 * n);
  test::ok(dfm_surface_positions(body, n, x.data(), &n));
  double top = -1e300;
  for (uint32_t i = 0; i < n; ++i) top = std::max(top, x[3 * i + 2]);
  return top;
}

std::string box_stack() {
  Jobs jobs;
  for (const auto &row : table("box_stack")) {
    if (row[4] != "0") continue;
    for (const double stiffer : {1.0, 10.0})
      for (const bool guided : {false, true})
        for (const uint32_t cells : {12u, 96u, 324u})
          for (const double finer : {1.0, 2.0, 4.0}) {
            if ((finer > 1 && cells != 96) || (!guided && (finer > 1 || cells != 96))) continue;
            jobs.push_back([=] {
              const uint32_t count = uint32_t(std::stoul(row[0]));
              const double edge = number(row, 1);
              const double rho = number(row, 2);
              const double young = stiffer * number(row, 3);
              const double shortening = number(row, 6) / stiffer;
              // time goes with the root of the size
              const double second = std::sqrt(edge / 0.1), h = 1e-3 * second / finer;
              test::Context context;
              dfm_world_def wd = dfm_world_def_default();
              wd.max_substeps = 50;  // what folds asks for ever more
              dfm_world world = 0;
              test::ok(dfm_world_create(context, &wd, &world));
              std::vector<dfm_body> box;
              for (uint32_t k = 0; k < count; ++k) {
                test::BodyOptions o;
                o.young = young;
                o.density = rho;
                o.poisson = 0;
                o.damping_mass = 20 / second;
                o.damping_stiffness = 1e-3 * second;
                o.position = {-edge / 2, -edge / 2, k * (1 + 1e-3) * edge};
                const test::Cells mesh = test::make_cells(context, "beam", {edge, edge, edge}, cells);
                std::vector<uint8_t> fixed(mesh.npoint());
                for (uint32_t i = 0; guided && i < mesh.npoint(); ++i)
                  for (int axis = 0; axis < 2; ++axis)
                    if (std::fabs(mesh.point(i)[axis] - edge / 2) < 1e-9)
                      fixed[i] = uint8_t(fixed[i] | 1 << axis);
                box.push_back(test::make_body(world, mesh, o, nullptr, fixed.data()));
              }
              const dfm_obstacle floor = test::add_plane(world, "floor");
              test::set_friction(world, guided ? 0 : 0.3, guided ? "none" : "coulomb");
              bool stands = true;
              for (int k = 0; stands && k < int(2 * second / h); ++k) {
                uint32_t trouble = 0;
                stands = dfm_world_step(world, h, &trouble) == DFM_OK &&
                         (k % 50 || top_of(box.back()) > 0.5 * count * edge);
              }
              double worst = 0;
              for (uint32_t k = 0; stands && k < count; ++k) {
                const double origin[3] = {}, weight = (count - k) * rho * edge * edge * edge * kG;
                double force[3] = {};
                test::ok(dfm_world_pair_wrench(world, box[k], k ? uint64_t(box[k - 1]) : uint64_t(floor),
                                               origin, force, nullptr));
                worst = std::max(worst, std::fabs(percent(force[2], weight)));
              }
              const uint32_t inside_out = test::stats(world).inverted_max;
              stands = stands && !inside_out && worst < 50;
              const double law = spring_column(count * rho * edge * kG / young), height = count * edge;
              std::vector<std::string> out{
                  text("%u boxes, E %g%s", count, young, guided ? ", guided" : ""),
                  std::to_string(cells),
                  text("%g", 1e3 * h),
                  stands ? text("%.2g", worst) : "-",
                  stands ? signed_percent(height - top_of(box.back()), shortening) : "gives way",
                  law < 0 ? "cannot carry it" : signed_percent(law * height, shortening),
                  std::to_string(inside_out)};
              dfm_world_destroy(world);
              return out;
            });
          }
  }
  return run_all({"box_stack", "cells a box", "step, ms", "worst interface force, %", "shortening, %",
                  "springs in all directions, %", "cells inside out"},
                 jobs);
}

}  // namespace

std::vector<std::pair<std::string, std::function<std::string()>>> elastic_tables() {
  return {{"bar_impact", bar_impact}, {"hertz_impact", hertz_impact}, {"hertz", hertz},
          {"hertz_line", hertz_line}, {"squeezed", squeezed},         {"mindlin", mindlin},
          {"box_stack", box_stack}};
}

}  // namespace bench
