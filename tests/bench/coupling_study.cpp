// What the support radius of a coupling buys and costs: Zerbato 2010, chapter 3, shows 1.5, 3 and 4.5 mean
// distances. A sphere of 4,098 surfels hangs on a ball of 400 cells by each coupling; two motions whose shape
// is known everywhere are given to its phyxels:
//
//   twist   x turns about z by z / R radians     poke   a bump of 0.2 R, exp(-d2 / (0.35 R)2) around one pole
//
// and the surface is compared with the same motion of its own points: distance, and roughness: how much the
// angle between neighboring triangles differs. Forces: torque and power that arrive at the phyxels, by the
// transpose and by the printed rule (3.12), whose kernel is the truncated Gaussian (3.10). Tip: a bar of
// mass-springs, clamped, its end pulled down through the surface. Prints a table; with a folder as argument
// writes coupling_study.csv and coupling_profile.csv there (coupling_study.py draws them).
#include <chrono>
#include <cstdio>
#include <fstream>

#include "../support/coupled.h"
#include "../unit/narrow/detect_scene.h"
#include "core/error.h"
#include "mesh/mesh.h"

namespace {

using namespace dfm;

enum Kind { kBarycentric, kMls, kThesis };
constexpr const char *kName[] = {"barycentric", "mls", "thesis"};
constexpr double kRadius = 0.05;

Coupling couple(int kind, const CouplingInput &in) {
  const Memory &m = Memory::standard();
  return kind == kMls      ? couple_mls(m, in)
         : kind == kThesis ? couple_thesis(m, in)
                           : couple_barycentric(m, in);
}

struct Study {
  RestMesh cells = make_ball(Memory::standard(), kRadius, 400);
  test::Mesh fine = test::sphere_mesh(0.95 * kRadius, 5);
  CouplingInput in;
  Study() {
    in.npoint = cells.npoint();
    in.ntet = cells.ntet();
    in.nsurfel = fine.npoint();
    in.point = cells.points.data();
    in.tet = cells.tets.data();
    in.surfel = fine.x.data();
  }
  Vec3 phyxel(uint32_t i) const { return load3(&cells.points[3 * i]); }
};

Vec3 twist(Vec3 x) {
  const double a = x.z / kRadius, c = std::cos(a), s = std::sin(a);
  return {c * x.x - s * x.y, s * x.x + c * x.y, x.z};
}
Vec3 poke(Vec3 x) {
  const Vec3 pole{kRadius, 0, 0};
  return x + Vec3{0.2 * kRadius * std::exp(-norm2(x - pole) / (0.35 * 0.35 * kRadius * kRadius)), 0, 0};
}

struct Match { double error = 0, rough_max = 0, rough_rms = 0; };  // of the largest displacement; degrees

std::vector<Vec3> follow(const Study &k, const Surface &s, Vec3 (*motion)(Vec3)) {
  std::vector<Vec3> x(s.nsurfel);
  for (uint32_t i = 0; i < s.nsurfel; ++i)
    s.each_phyxel(i, [&](uint32_t p, double w) { x[i] += w * motion(k.phyxel(p)); });
  return x;
}

double fold(const Surface &s, const std::vector<Vec3> &x, uint32_t edge) {
  Vec3 n[2];
  for (size_t side = 0; side < 2; ++side) {
    const uint32_t *const c = &s.tri[size_t{3} * s.edge_tri[size_t{2} * edge + side]];
    n[side] = cross(x[c[1]] - x[c[0]], x[c[2]] - x[c[0]]);
  }
  const Vec3 along = x[s.edge[size_t{2} * edge + 1]] - x[s.edge[size_t{2} * edge]];
  return std::atan2(dot(cross(n[0], n[1]), normalized(along)), dot(n[0], n[1]));
}

Match compare(const Study &k, const Surface &s, Vec3 (*motion)(Vec3)) {
  const std::vector<Vec3> x = follow(k, s, motion);
  std::vector<Vec3> truth;
  double largest = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    truth.push_back(motion(k.fine.at(i)));
    largest = std::max(largest, norm(truth[i] - k.fine.at(i)));
  }
  Match out;
  for (uint32_t i = 0; i < s.nsurfel; ++i) out.error = std::max(out.error, norm(x[i] - truth[i]) / largest);
  for (uint32_t e = 0; e < s.nedge; ++e) {
    const double d = std::remainder(fold(s, x, e) - fold(s, truth, e), 2 * M_PI) * 180 / M_PI;
    out.rough_max = std::max(out.rough_max, std::fabs(d));
    out.rough_rms += d * d;
  }
  out.rough_rms = std::sqrt(out.rough_rms / s.nedge);
  return out;
}

struct Loss { double torque = 0, power = 0; };  // share that does not arrive

// Forces of a twist about z, 1 N per meter from the axis; velocities: the twist's own.
Loss loss(const Study &k, const Surface &s, const std::vector<Vec3> &arrives) {
  const auto turning = [](Vec3 x) { return (x.z / kRadius) * cross({0, 0, 1}, x); };
  double torque_in = 0, torque_out = 0, power_in = 0, power_out = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i) {
    const Vec3 x = k.fine.at(i), f = cross({0, 0, 1}, x) + turning(x);
    Vec3 v;
    s.each_phyxel(i, [&](uint32_t p, double w) { v += w * turning(k.phyxel(p)); });
    torque_in += cross(x, f).z;
    power_in += dot(f, v);
  }
  for (uint32_t p = 0; p < k.in.npoint; ++p) {
    torque_out += cross(k.phyxel(p), arrives[p]).z;
    power_out += dot(arrives[p], turning(k.phyxel(p)));
  }
  return {1 - torque_out / torque_in, 1 - power_out / power_in};
}
Vec3 force_at(Vec3 x) { return cross({0, 0, 1}, x) + (x.z / kRadius) * cross({0, 0, 1}, x); }

std::vector<Vec3> by_transpose(const Study &k, const Surface &s) {
  std::vector<Vec3> f(k.in.npoint);
  for (uint32_t i = 0; i < s.nsurfel; ++i)
    s.each_phyxel(i, [&](uint32_t p, double w) { f[p] += w * force_at(k.fine.at(i)); });
  return f;
}
// (3.12): a surfel's force is shared among the phyxels that reach it by (3.10), exp(-r2/h2) for r <= h.
std::vector<Vec3> by_literal_rule(const Study &k, double support) {
  std::vector<double> h;
  for (uint32_t i = 0; i < k.in.npoint; ++i) {
    std::vector<double> d;
    for (uint32_t j = 0; j < k.in.npoint; ++j)
      if (j != i) d.push_back(norm(k.phyxel(j) - k.phyxel(i)));
    std::partial_sort(d.begin(), d.begin() + 10, d.end());
    double sum = 0;
    for (int n = 0; n < 10; ++n) sum += d[size_t(n)];
    h.push_back(support * sum / 10);
  }
  std::vector<Vec3> f(k.in.npoint);
  for (uint32_t s = 0; s < k.in.nsurfel; ++s) {
    std::vector<std::pair<uint32_t, double>> row;
    double sum = 0;
    for (uint32_t i = 0; i < k.in.npoint; ++i) {
      const double r2 = norm2(k.phyxel(i) - k.fine.at(s));
      if (r2 <= h[i] * h[i]) {
        row.push_back({i, std::exp(-r2 / (h[i] * h[i]))});
        sum += row.back().second;
      }
    }
    for (const auto &[i, w] : row) f[i] += (w / sum) * force_at(k.fine.at(s));
  }
  return f;
}

// The least of many, since others use the machine.
double ns_per_surfel(Surface &s, uint32_t npoint) {
  const Array<double> x(size_t{4} * npoint, 1.0), v(x);
  double best = INFINITY;
  for (int i = 0; i < 40; ++i) {
    const auto start = std::chrono::steady_clock::now();
    gather_surface(s, x.data(), v.data());
    best = std::min(
        best, std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  return best / s.nsurfel;
}

// A bar of 0.2 x 0.03 x 0.03 m under 0.02 N at its end, shared by the surfels of the end face. Returns how
// far these go down, m.
double tip(int kind, double support) {
  const test::Context context;
  const dfm_world w = test::make_world(context, {0, 0, 0});
  const std::array<double, 3> size{0.2, 0.03, 0.03};
  const test::Skin skin = test::box_skin(size, 12);
  const dfm_surface_def surface = skin.def(kind, support);
  test::BodyOptions o;
  o.young = 2e4;
  o.damping_mass = 8;
  o.surface = &surface;
  const dfm_body b = test::make_body(context, w, "beam", size, 500, o);
  // the same that the body was made from
  const RestMesh cells = make_beam(Memory::standard(), size[0], size[1], size[2], 500);
  const uint32_t n = cells.npoint();
  const double *const x = cells.points.data();
  CouplingInput in;
  in.npoint = n;
  in.ntet = cells.ntet();
  in.nsurfel = skin.npoint();
  in.support = support;
  in.point = x;
  in.tet = cells.tets.data();
  in.surfel = skin.points.data();
  const Coupling c = couple(kind, in);
  std::vector<uint32_t> held, all, end;
  for (uint32_t i = 0; i < n; ++i) {
    all.push_back(i);
    if (x[3 * i] < 1e-9) held.push_back(i);
  }
  for (uint32_t s = 0; s < skin.npoint(); ++s)
    if (skin.points[3 * s] > size[0] - 1e-9) end.push_back(s);
  std::vector<double> force(size_t{3} * n);
  for (uint32_t s : end)
    for (uint32_t j = c.row[s]; j < c.row[s + 1]; ++j)
      force[3 * c.col[j] + 2] -= 0.02 / double(end.size()) * c.weight[j];
  test::ok(dfm_body_hold(b, uint32_t(held.size()), held.data(), 7));
  test::ok(dfm_body_add_load(b, n, all.data(), force.data(), 0, nullptr, nullptr, nullptr));
  const auto height = [&] {
    const std::vector<double> at = test::surface_positions(b);
    double sum = 0;
    for (uint32_t s : end) sum += at[3 * s + 2];
    return sum / double(end.size());
  };
  const double before = height();
  test::run(w, 3, 2e-3);
  return before - height();
}

}  // namespace

int main(int argc, char **argv) {
  const Study k;
  struct Run {
    int kind;
    double support;
  };
  std::string csv =
      "coupling,support,weights_mean,weights_max,sum_abs_weight,linear_error,twist_error,twist_rough_max_deg,"
      "twist_rough_rms_deg,poke_error,poke_rough_max_deg,poke_rough_rms_deg,ns_per_surfel,torque_lost_"
      "transpose,torque_lost_3_12,power_lost_transpose,power_lost_3_12,tip_m\n";
  std::string profile = "coupling,support,angle_deg,radius\n";
  for (const Run &run : {Run{kBarycentric, 0},
                         {kMls, 1.5},
                         {kMls, 3},
                         {kMls, 4.5},
                         {kThesis, 1.5},
                         {kThesis, 3},
                         {kThesis, 4.5}}) {
    CouplingInput in = k.in;
    if (run.support > 0) in.support = run.support;
    Surface s;
    make_surface(Memory::standard(), k.fine.npoint(), k.fine.x.data(), k.fine.tri.data(), k.fine.ntri(), s);
    wear_coupling(couple(run.kind, in), s);
    double most = 0, absolute = 0, linear = 0;
    for (uint32_t i = 0; i < s.nsurfel; ++i) {
      Vec3 x;
      s.each_phyxel(i, [&](uint32_t p, double w) {
        x += w * k.phyxel(p);
        absolute += std::fabs(w);
      });
      most = std::max(most, double(s.row[i + 1] - s.row[i]));
      linear = std::max(linear, norm(x - k.fine.at(i)) / kRadius);
    }
    const Match a = compare(k, s, twist), b = compare(k, s, poke);
    const bool literal = run.kind == kThesis;
    const Loss t = loss(k, s, by_transpose(k, s));
    const Loss l = literal ? loss(k, s, by_literal_rule(k, run.support)) : Loss{NAN, NAN};
    csv += format("%s,%g,%.1f,%.0f,%.2f,%.1e,%.4f,%.2f,%.3f,%.4f,%.2f,%.3f,%.1f,%.2e,%.3f,%.2e,%.3f,%.5f\n",
                  kName[run.kind], run.support, double(s.weight.size()) / s.nsurfel, most,
                  absolute / s.nsurfel, linear, a.error, a.rough_max, a.rough_rms, b.error, b.rough_max,
                  b.rough_rms, ns_per_surfel(s, k.in.npoint), t.torque, l.torque, t.power, l.power,
                  tip(run.kind, run.support));
    // the meridian of the pole that is poked
    const std::vector<Vec3> x = follow(k, s, poke);
    std::vector<std::pair<double, double>> line;
    for (uint32_t i = 0; i < s.nsurfel; ++i)
      if (const Vec3 r = k.fine.at(i); r.y == 0 && r.x > 0)
        line.push_back({std::atan2(r.z, r.x) * 180 / M_PI, norm(x[i]) / kRadius});
    std::sort(line.begin(), line.end());
    for (const auto &[angle, radius] : line)
      profile += format("%s,%g,%.3f,%.5f\n", kName[run.kind], run.support, angle, radius);
  }
  for (double angle = -90; angle <= 90; angle += 2.8125) {
    const double a = angle * M_PI / 180;
    profile += format("exact,0,%.3f,%.5f\n", angle,
                      norm(poke(0.95 * kRadius * Vec3{std::cos(a), 0, std::sin(a)})) / kRadius);
  }
  std::fputs(csv.c_str(), stdout);
  if (argc > 1) {
    std::ofstream(std::string(argv[1]) + "/coupling_study.csv") << csv;
    std::ofstream(std::string(argv[1]) + "/coupling_profile.csv") << profile;
  }
}
