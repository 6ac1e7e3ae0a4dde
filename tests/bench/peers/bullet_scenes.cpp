// One scene of scenes.py in Bullet's deformable world: bullet_scenes SCENE MESH key=value..., prints rows of
// numbers (what they are: scenes_bullet.py), then at the end displacements z of all points, then `used`:
// processor time of the steps.
#include "../friction/bullet_world.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

namespace {

using namespace bullet;

double smooth(double t, double from, double to) {
  const double s = ramp(t, from, to);
  return s * s * (3 - 2 * s);
}

// Center by the points' masses at rest: those that are held have none left.
struct Center {
  std::vector<double> share;
  const btSoftBody *body;
  explicit Center(const btSoftBody *of) : body(of) {
    share.resize(size_t(body->m_nodes.size()));
    for (int i = 0; i < body->m_tetras.size(); ++i) {
      const btSoftBody::Tetra &t = body->m_tetras[i];
      const btVector3 a = t.m_n[0]->m_x;
      const double volume =
          std::fabs(double((t.m_n[1]->m_x - a).cross(t.m_n[2]->m_x - a).dot(t.m_n[3]->m_x - a)));
      for (const auto *const n : t.m_n) share[size_t(n - &body->m_nodes[0])] += volume;
    }
    double sum = 0;
    for (const double s : share) sum += s;
    for (double &s : share) s /= sum;
  }
  double operator()(int axis) const {
    double sum = 0;
    for (size_t i = 0; i < share.size(); ++i) sum += share[i] * body->m_nodes[int(i)].m_x[axis];
    return sum / kLength;
  }
};

// What a scene does in each step, and the row that it tells after it.
struct Play {
  std::function<void(double)> before = [](double) {};
  std::function<void(double)> row;
};

btVector3 along_z(double a, double b, double c) { return btVector3(btScalar(a), btScalar(b), btScalar(c)); }

Scene::Place at(double x, double y, double z) {
  return [=](double a, double b, double c) { return along_z(a + x, b + y, c + z); };
}

void clamp_ends(Scene &s, int axis, double low, double high, std::vector<int> &held) {
  held = s.hold(
      [=](const btVector3 &x) { return x[axis] < kLength * low + 1e-3 || x[axis] > kLength * high - 1e-3; });
}

Play beam(Scene &s, const std::string &mesh, const Values &v, bool matched) {
  s.load(mesh, v, at(0, 0, 0), matched);
  s.hold([](const btVector3 &x) { return x.x() < 1e-3; });
  s.gravity->m_gravity = btVector3(0, 0, btScalar(-kG));
  const btVector3 tip = btScalar(kLength) * along_z(v.at("length"), v.at("height") / 2, v.at("height") / 2);
  int nearest = 0;
  for (int i = 1; i < s.soft->m_nodes.size(); ++i)
    if ((s.soft->m_nodes[i].m_x - tip).length2() < (s.soft->m_nodes[nearest].m_x - tip).length2())
      nearest = i;
  const btSoftBody::Node *const node = &s.soft->m_nodes[nearest];
  const double rest = node->m_x.z();
  return {[](double) {},
          [=](double t) { std::printf("row %.9g %.9g\n", t, (node->m_x.z() - rest) / kLength); }};
}

Play slope(Scene &s, const std::string &mesh, const Values &v, bool matched) {
  const int count = int(v.at("count"));
  const double gap = 2 * kMargin / kLength;
  for (int i = 0; i < count; ++i) s.load(mesh, v, at(0, 0, gap + i * (v.at("height") + gap)), matched);
  const btScalar wide = btScalar(0.5 * kLength), thick = btScalar(0.05 * kLength);
  s.wall(btVector3(wide, wide, thick), btVector3(0, 0, -thick));
  const double angle = v.at("angle"), tilt = v.at("tilt");
  const auto center = std::make_shared<Center>(s.softs.back());
  return {[=, &s](double t) { s.tilt(angle * ramp(t, 0.2, tilt)); },
          [=](double t) { std::printf("row %.9g %.12g\n", t, (*center)(0)); }};
}

Play pair(Scene &s, const std::string &mesh, const Values &v, bool matched) {
  const double half = v.at("height") / 2, r = v.at("radius"), gap = 2 * kMargin / kLength;
  std::vector<int> held;
  s.load(mesh, v, [=](double a, double b, double c) { return along_z(a, c - half, -b); }, matched);
  clamp_ends(s, 1, -half, half, held);
  const auto center = std::make_shared<Center>(s.soft);
  s.load(
      mesh, v, [=](double a, double b, double c) { return along_z(c - half, b, 2 * r + gap - a); }, matched);
  clamp_ends(s, 0, -half, half, held);
  btSoftBody *const upper = s.soft;
  // two soft bodies stand off by `touch`
  const double down = kLength * (v.at("depth") + gap - v.at("touch")) / v.at("press");
  const double along = kLength * v.at("travel") / (v.at("slide_end") - v.at("slide_begin"));
  return {[=](double t) {
            const double middle = t - 1e-9;
            Scene::drive(upper, held,
                         btVector3(middle > v.at("slide_begin") ? btScalar(along) : 0, 0,
                                   middle <= v.at("press") ? btScalar(-down) : 0));
          },
          [=](double t) { std::printf("row %.9g %.9g %.9g\n", t, (*center)(0), (*center)(2)); }};
}

Play gripper(Scene &s, const std::string &mesh, const Values &v, bool matched) {
  const double r = v.at("radius"), half = 0.01, gap = 2 * kMargin / kLength, touch = v.at("touch");
  s.load(mesh, v, at(0, 0, r + gap), matched);
  const btScalar wide = btScalar(0.5 * kLength), thick = btScalar(0.05 * kLength);
  s.wall(btVector3(wide, wide, thick), btVector3(0, 0, -thick));
  s.gravity->m_gravity = btVector3(0, 0, btScalar(-kG));
  const btVector3 jaw = btScalar(kLength) * along_z(half, 0.06, 0.03);
  const double apart = r + half + gap, shut = v.at("depth") + gap - touch;
  btRigidBody *const left = s.wall(jaw, btScalar(kLength) * along_z(-apart, 0, r + gap));
  btRigidBody *const right = s.wall(jaw, btScalar(kLength) * along_z(apart, 0, r + gap));
  const auto center = std::make_shared<Center>(s.soft);
  return {[=](double t) {
            const double x = kLength * (apart - shut * ramp(t, 0, v.at("close")));
            const double z =
                kLength * (r + gap + v.at("rise") * smooth(t, v.at("lift_begin"), v.at("lift_end")));
            Scene::move(left, -x, z);
            Scene::move(right, x, z);
          },
          [=](double t) { std::printf("row %.9g %.12g\n", t, (*center)(2)); }};
}

}  // namespace

int main(int argc, char **argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bullet_scenes SCENE MESH key=value...\n");
    return 2;
  }
  const Values v = values(argc, argv);
  const std::string name = argv[1], mesh = argv[2];
  Scene s(v);
  const bool matched = v.at("matched") != 0;
  const Play play = name == "beam"      ? beam(s, mesh, v, matched)
                    : name == "pair"    ? pair(s, mesh, v, matched)
                    : name == "gripper" ? gripper(s, mesh, v, matched)
                                        : slope(s, mesh, v, matched);
  if (s.softs.size() > 1)
    for (btSoftBody *const body : s.softs) body->m_cfg.collisions |= btSoftBody::fCollision::VF_DD;
  std::vector<double> rest;
  for (const btSoftBody *const body : s.softs)
    for (int i = 0; i < body->m_nodes.size(); ++i) rest.push_back(body->m_nodes[i].m_x.z());
  play.row(0);
  const std::clock_t started = std::clock();
  while (s.time < v.at("end") - 1e-9) {
    s.advance(play.before);
    play.row(s.time);
  }
  const double used = double(std::clock() - started) / CLOCKS_PER_SEC;
  size_t at = 0;
  for (const btSoftBody *const body : s.softs)
    for (int i = 0; i < body->m_nodes.size(); ++i)
      std::printf("moved %.9g\n", (body->m_nodes[i].m_x.z() - rest[at++]) / kLength);
  std::printf("used %.9g\n", used);
  return 0;
}
