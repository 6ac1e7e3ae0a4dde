// One case of the friction benchmark in Bullet's deformable world: bullet_entry CASE MESH key=value...,
// prints key=value lines.
#include "bullet_world.h"

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace bullet;

// The pad's top goes down and stays; the plate below turns about z, and slides along x in the combined cases.
// The floor's force on the pad is what holds the top, but for the pad's own momentum, which is even.
int rotating_pad(Scene &s, const Values &v, double lift) {
  const double top = kLength * v.at("height") + lift;
  const std::vector<int> held = s.hold([&](const btVector3 &x) { return x.z() > top - 1e-3; });
  const btScalar wide = btScalar(0.5 * kLength), thick = btScalar(0.05 * kLength);
  const double ratio = v.at("ratio"), speed = ratio > 0 ? kLength * v.at("speed") : 0;
  const double spin = ratio > 0 ? v.at("speed") / (ratio * v.at("radius")) : v.at("spin");
  const double middle = 0.5 * (v.at("begin") + v.at("end"));
  s.heavy(btVector3(wide, wide, thick), btVector3(btScalar(-speed * middle), 0, -thick),
          btVector3(btScalar(speed), 0, 0), btVector3(0, 0, btScalar(spin)));
  // a soft body and a wall touch where both margins do
  const double down = kLength * v.at("depth") + lift - v.at("touch") * kLength;
  double normal = 0, force = 0, moment = 0;
  while (s.time < v.at("end")) {
    s.advance([&](double t) {
      Scene::drive(s.soft, held, btVector3(0, 0, t <= v.at("press") ? btScalar(-down / v.at("press")) : 0));
    });
    if (s.time < v.at("begin")) continue;
    const auto [f, m] = s.reaction(held, btVector3(0, 0, 0));
    normal += f.z();
    force += std::hypot(f.x(), f.y());
    moment += std::fabs(m);
  }
  if (ratio == 0) print("torque_share", moment / (v.at("mu") * normal * kLength * v.at("radius")), s.time);
  else print("force_share", force / (v.at("mu") * normal), s.time);
  return 0;
}

int run(const std::string &name, const std::string &mesh, const Values &v) {
  Scene s(v);
  const double lift = 2 * kMargin;
  if (name == "pinch_hold") {
    const double r = kLength * v.at("radius");
    const double half = 0.01 * kLength;
    const double shut = 0.8 * v.at("close");
    const double apart = r + half + lift;
    s.load(mesh, v, 0);
    const btVector3 jaw(btScalar(half), btScalar(0.06 * kLength), btScalar(0.06 * kLength));
    btRigidBody *const left = s.wall(jaw, btVector3(btScalar(-apart), 0, 0));
    btRigidBody *const right = s.wall(jaw, btVector3(btScalar(apart), 0, 0));
    Line line;
    double started = NAN, first = NAN;
    while (s.time < v.at("end")) {
      s.advance([&](double t) {
        const double x = apart - (kLength * v.at("depth") + lift) * ramp(t, 0, shut);
        Scene::move(left, -x, 0);
        Scene::move(right, x, 0);
        s.gravity->m_gravity = btVector3(0, 0, btScalar(-kG * ramp(t, v.at("close"), v.at("load"))));
      });
      if (s.time < v.at("begin")) continue;
      line.add(s.time, s.center(2));
      if (std::isnan(first)) {
        started = s.time;
        first = s.speed(2);
      }
    }
    // what the walls carry: weight and the change of momentum
    std::printf("lift_share=%.9g\n", 1 + (s.speed(2) - first) / (s.time - started) / kG);
    print("creep_um_per_s", 1e6 / kLength * std::fabs(line.slope()), s.time);
    return 0;
  }
  s.load(mesh, v, lift);
  if (name == "rotating_pad") return rotating_pad(s, v, lift);
  const btScalar wide = btScalar(0.5 * kLength), thick = btScalar(0.05 * kLength);
  btRigidBody *const floor = s.wall(btVector3(wide, wide, thick), btVector3(0, 0, -thick));
  if (name == "slope_ramp") {
    double start = NAN, angle = 0;
    while (angle < std::atan(1.2 * v.at("mu"))) {
      s.advance([&](double t) { s.tilt(angle = std::max(0.0, v.at("rate") * (t - v.at("settle")))); });
      if (std::isnan(start) && s.time >= v.at("settle")) start = s.center(0);
      if (s.center(0) - start >= kLength * v.at("distance")) {
        print("slip_tan", std::tan(angle), s.time);
        return 0;
      }
    }
    print("slip_tan", INFINITY, s.time);
    return 0;
  }
  const bool slide = name == "slope_slide", shakes = name == "vibration_drift";
  const double w = shakes ? 2 * M_PI * v.at("frequency") : 0;
  const double begin = v.at("begin");
  const double middle = 0.5 * (begin + v.at("end"));
  Line all, first, last;
  while (s.time < v.at("end")) {
    s.advance([&](double t) {
      s.tilt(v.at("angle") * (slide ? 1 : ramp(t, 0.2, v.at("tilt"))));
      if (shakes)
        Scene::move(floor, kLength * v.at("acceleration") / (w * w) * std::sin(w * t), -0.05 * kLength);
    });
    if (s.time < begin) continue;
    all.add(s.time, s.center(0));
    (s.time < middle ? first : last).add(s.time, s.center(0));
  }
  // an even acceleration: the slopes of both halves are the speeds in their middles
  if (slide) {
    print("acceleration", (last.slope() - first.slope()) / (0.5 * (v.at("end") - begin)) / kLength, s.time);
    return 0;
  }
  print("creep_um_per_s", 1e6 / kLength * std::fabs(all.slope()), s.time);
  return 0;
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bullet_entry CASE MESH key=value...\n");
    return 2;
  }
  return run(argv[1], argv[2], values(argc, argv));
}
