// The same scenes by the library's step and by the roll-back: what that does to sliding, bouncing, momentum
// and force. Tests and rollback_bench share them.
#pragma once
#include "rollback/scheme.h"
#include "stack.h"

namespace test::rollback {

inline constexpr double kG = 9.81, kDegree = 3.14159265358979323846 / 180;
using Vector = std::array<double, 3>;

enum class By { library, rollback };

struct World {
  Context context;
  dfm_world world;
  By by;
  dfm::rollback::Scheme scheme;
  World(By how, Vector gravity, double mu, uint32_t threads = 1)
      : context(threads), world(make_world(context, gravity)), by(how) {
    if (mu > 0) set_friction(world, mu);
    else set_friction(world, 0, "none");
  }
  ~World() { dfm_world_destroy(world); }
  World(const World &) = delete;
  World &operator=(const World &) = delete;

  void run(double seconds, double h) {
    if (by == By::library) return test::run(world, seconds, h);
    for (long i = std::lround(seconds / h); i > 0; --i) ok(scheme.step(world, h, nullptr));
  }

  // A cube of 0.1 m and 1 kg.
  dfm_body block(const char *name, Vector position, Vector velocity = {}, uint32_t cells = 96,
                 double young = 2e5) {
    BodyOptions o;
    o.name = name;
    o.young = young;
    o.damping_stiffness = 2e-3;
    o.position = position;
    o.velocity = velocity;
    return make_body(context, world, "beam", {0.1, 0.1, 0.1}, cells, o);
  }
  dfm_body ball(const char *name, Vector position, Vector velocity) {
    BodyOptions o;
    o.name = name;
    o.young = 5e4;
    o.damping_stiffness = 1e-4;
    o.volume = 1;
    o.position = position;
    o.velocity = velocity;
    return make_body(context, world, "ball", {0.1, 0, 0}, 600, o);
  }
};

inline Vector momentum(const std::vector<dfm_body> &bodies) {
  Vector p{};
  for (dfm_body b : bodies)
    for (size_t k = 0; k < 3; ++k) p[k] += measure(b).momentum[k];
  return p;
}
inline double energy(const std::vector<dfm_body> &bodies) {  // without that of weight
  double e = 0;
  for (dfm_body b : bodies) e += measure(b).kinetic + measure(b).elastic;
  return e;
}
inline double normal_sum(dfm_world w) {
  double sum = 0;
  for (const dfm_pair_report &p : pairs(w)) sum += p.normal;
  return sum;
}

// A block on a plane tilted by theta: mean acceleration along it and way over the last 0.3 s of 0.4 s; normal
// force as reported and as the momentum says, over that of the weight.
struct Slide { double acceleration, way, reported, felt; };
inline Slide incline(By by, double theta_deg, double mu, double h) {
  World w(by, {kG * std::sin(theta_deg * kDegree), 0, -kG * std::cos(theta_deg * kDegree)}, mu);
  add_plane(w.world, "floor");
  const dfm_body b = w.block("block", {0, 0, 2e-5});
  w.run(0.1, h);
  const dfm_body_measure from = measure(b);
  const long n = std::lround(0.3 / h);
  double reported = 0;
  for (long i = 0; i < n; ++i) {
    w.run(h, h);
    reported += normal_sum(w.world) / double(n);
  }
  const dfm_body_measure to = measure(b);
  const double weight = to.mass * kG * std::cos(theta_deg * kDegree);
  return {(to.velocity[0] - from.velocity[0]) / 0.3, to.com[0] - from.com[0], reported / weight,
          (to.contact_impulse[2] - from.contact_impulse[2]) / (0.3 * weight)};
}

// A block thrown along a floor: way until it is slower than 1 % of the throw, time of that.
struct Throw { double way, time; };
inline Throw thrown(By by, double speed, double mu, double h) {
  World w(by, {0, 0, -kG}, mu);
  add_plane(w.world, "floor");
  const dfm_body b = w.block("block", {0, 0, 2e-5}, {speed, 0, 0});
  const double from = measure(b).com[0];
  double t = 0;
  while (t < 2 && std::fabs(measure(b).velocity[0]) > 0.01 * speed) {
    w.run(h, h);
    t += h;
  }
  return {measure(b).com[0] - from, t};
}

// A ball of 4 kg, 3 cm above the floor, thrown at it; when it has left again: its velocity, its energy over
// that before, and the normal force that was reported over that which it felt, both summed over the impact.
struct Bounce {
  Vector velocity;
  double energy, time, reported;
};
inline Bounce bounce(By by, Vector velocity, double mu, double h) {
  World w(by, {0, 0, 0}, mu);
  add_plane(w.world, "floor");
  const dfm_body b = w.ball("ball", {0, 0, 0.13}, velocity);
  const double before = energy({b});
  double t = 0, reported = 0;
  bool met = false;
  for (; t < 1; t += h) {
    w.run(h, h);
    reported += h * normal_sum(w.world);
    const bool now = stats(w.world).contacts > 0;
    met = met || now;
    if (met && !now && measure(b).com[2] > 0.1) break;
  }
  const dfm_body_measure m = measure(b);
  return {{m.velocity[0], m.velocity[1], m.velocity[2]},
          energy({b}) / before,
          t,
          reported / m.contact_impulse[2]};
}

// Two blocks, one at rest, the other flying at it, face to face: what is left of momentum and energy once
// they part (or after 0.3 s).
struct Collision { double momentum, energy, first, second; };
inline Collision collision(By by, double speed, double h) {
  World w(by, {0, 0, 0}, 0.3);
  const std::vector<dfm_body> b = {w.block("flying", {-0.11, 0.004, 0.003}, {speed, 0, 0}),
                                   w.block("resting", {0, 0, 0})};
  const double p = momentum(b)[0], e = energy(b);
  w.run(0.3, h);
  return {momentum(b)[0] / p, energy(b) / e, measure(b[0]).velocity[0], measure(b[1]).velocity[0]};
}

// A block on a block on a floor, at rest: what the floor carries and what the lower block carries, over the
// weight above; as reported and as felt.
struct Stacked { double floor_reported, floor_felt, middle_reported, middle_felt; };
inline Stacked stacked(By by, double h) {
  World w(by, {0, 0, -kG}, 0.5);
  const dfm_obstacle floor = add_plane(w.world, "floor");
  const dfm_body lower = w.block("lower", {0, 0, 4e-5}), upper = w.block("upper", {0.004, 0.003, 0.10008});
  w.run(1, h);
  const dfm_body_measure l = measure(lower), u = measure(upper);
  const long n = std::lround(0.2 / h);
  Stacked s{};
  for (long i = 0; i < n; ++i) {
    w.run(h, h);
    for (const dfm_pair_report &p : pairs(w.world))
      (p.b == floor ? s.floor_reported : s.middle_reported) += p.normal / double(n);
  }
  const double above = u.mass * kG, all = above + l.mass * kG;
  const double up = (measure(upper).contact_impulse[2] - u.contact_impulse[2]) / 0.2;
  const double down = (measure(lower).contact_impulse[2] - l.contact_impulse[2]) / 0.2;
  return {s.floor_reported / all, (up + down) / all, s.middle_reported / above, up / above};
}

}  // namespace test::rollback
