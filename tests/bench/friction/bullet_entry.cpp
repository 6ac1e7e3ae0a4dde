// One case of the friction benchmark in Bullet's deformable world: bullet_entry CASE MESH key=value...,
// prints key=value lines. Neo-Hookean tetrahedra, contacts of nodes with rigid bodies, its own friction (kDF
// times the rigid body's).
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>

namespace {

// Centimeters and grams: its solvers stop at absolute tolerances that a small body in SI units does not
// exceed. Values arrive in SI units.
constexpr double kLength = 100, kMass = 1000, kStress = kMass / kLength, kG = 9.81 * kLength;
constexpr btScalar kMargin = btScalar(1e-3 * kLength);
using Values = std::map<std::string, double>;

struct Scene {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver body_solver;
  btDeformableMultiBodyConstraintSolver solver;
  btDeformableMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration, &body_solver};
  btSoftBody *soft = nullptr;
  btDeformableGravityForce *gravity = nullptr;
  double time = 0, step, friction;
  explicit Scene(const Values &v) : step(v.at("step")), friction(v.at("mu")) {
    solver.setDeformableSolver(&body_solver);
    // The implicit integrator needs contacts as projections: as Lagrange multipliers they are not part
    // of its system.
    const bool implicit = v.at("implicit") != 0;
    world.setImplicit(implicit);
    world.setLineSearch(false);
    world.setUseProjection(implicit);
    btSoftBodyWorldInfo &info = world.getWorldInfo();
    info.m_dispatcher = &dispatcher;
    info.m_broadphase = &broadphase;
    info.m_gravity = btVector3(0, 0, 0);
    info.m_sparsesdf.setDefaultVoxelsz(2.5f);
    info.m_sparsesdf.Initialize();
    world.getSolverInfo().m_deformable_erp = btScalar(v.at("erp"));
    world.getSolverInfo().m_friction = 1;
    world.getSolverInfo().m_numIterations = int(v.at("iterations"));
  }

  void load(const std::string &path, const Values &v, double lift) {
    std::ifstream in(path);
    int npoint = 0, ntet = 0;
    in >> npoint >> ntet;
    btAlignedObjectArray<btVector3> x;
    for (int i = 0; i < npoint; ++i) {
      double a, b, c;
      in >> a >> b >> c;
      x.push_back(btVector3(btScalar(kLength * a), btScalar(kLength * b), btScalar(kLength * c + lift)));
    }
    soft = new btSoftBody(&world.getWorldInfo(), npoint, &x[0], nullptr);
    std::set<std::pair<int, int>> edges;
    for (int t = 0; t < ntet; ++t) {
      int c[4];
      in >> c[0] >> c[1] >> c[2] >> c[3];
      soft->appendTetra(c[0], c[1], c[2], c[3]);
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < i; ++j) edges.insert({std::min(c[i], c[j]), std::max(c[i], c[j])});
    }
    for (auto [a, b] : edges) soft->appendLink(a, b);
    btSoftBodyHelpers::generateBoundaryFaces(soft);
    soft->initializeDmInverse();
    soft->m_tetraScratches.resize(soft->m_tetras.size());
    soft->m_tetraScratchesTn.resize(soft->m_tetras.size());
    soft->getCollisionShape()->setMargin(kMargin);
    soft->setTotalMass(btScalar(kMass * v.at("mass")));
    soft->m_cfg.kKHR = 1;
    soft->m_cfg.kCHR = 1;
    soft->m_cfg.kDF = btScalar(friction);
    // Nodes against rigid bodies. With faces too (SDF_RDF) the implicit world stands still, without
    // friction neither.
    soft->m_cfg.collisions = btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN;
    soft->m_sleepingThreshold = 0;
    soft->setActivationState(DISABLE_DEACTIVATION);
    world.addSoftBody(soft);
    const double e = kStress * v.at("young");
    const double nu = v.at("poisson");
    const double shear = e / (2 * (1 + nu));
    const double lame = e * nu / ((1 + nu) * (1 - 2 * nu));
    world.addForce(
        soft, new btDeformableNeoHookeanForce(btScalar(shear), btScalar(lame), btScalar(v.at("damping"))));
    world.addForce(soft, gravity = new btDeformableGravityForce(btVector3(0, 0, 0)));
    soft->m_gravityFactor = 1;
  }

  btRigidBody *wall(btVector3 half, btVector3 at) {
    auto *const shape = new btBoxShape(half);
    shape->setMargin(kMargin);
    const btTransform pose(btQuaternion::getIdentity(), at);
    auto *const body = new btRigidBody(0, new btDefaultMotionState(pose), shape);
    body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    body->setActivationState(DISABLE_DEACTIVATION);
    body->setFriction(1);
    world.addRigidBody(body);
    return body;
  }

  static void move(btRigidBody *body, double x, double z) {
    body->getMotionState()->setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(btScalar(x), 0, btScalar(z))));
  }

  double speed(int axis) const {
    double sum = 0, mass = 0;
    for (int i = 0; i < soft->m_nodes.size(); ++i) {
      const double m = 1 / soft->m_nodes[i].m_im;
      sum += m * soft->m_nodes[i].m_v[axis];
      mass += m;
    }
    return sum / mass;
  }

  double center(int axis) const {
    double sum = 0;
    for (int i = 0; i < soft->m_nodes.size(); ++i) sum += soft->m_nodes[i].m_x[axis];
    return sum / soft->m_nodes.size();
  }

  void advance(const std::function<void(double)> &before) {
    before(time + step);
    world.stepSimulation(btScalar(step), 0, btScalar(step));
    time += step;
    // how far it came, should it be stopped
    if (std::floor(time / 0.1) > std::floor((time - step) / 0.1)) std::fprintf(stderr, "at %g\n", time);
    if (!std::isfinite(center(0))) {
      std::fprintf(stderr, "not finite at %g s\n", time);
      std::exit(1);
    }
  }

  void tilt(double angle) {
    gravity->m_gravity = btVector3(btScalar(kG * std::sin(angle)), 0, btScalar(-kG * std::cos(angle)));
  }
};

// Straight-line fit of what was recorded between two times: its slope.
struct Line {
  double n = 0, t = 0, x = 0, tt = 0, tx = 0;
  void add(double at, double value) {
    ++n;
    t += at;
    x += value;
    tt += at * at;
    tx += at * value;
  }
  double slope() const { return (n * tx - t * x) / (n * tt - t * t); }
};

double ramp(double t, double from, double to) {
  return std::min(1.0, std::max(0.0, (t - from) / (to - from)));
}

void print(const char *key, double value, double simulated) {
  std::printf("%s=%.9g\nsimulated=%.9g\n", key, value, simulated);
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
  Values v;
  for (int i = 3; i < argc; ++i) {
    const std::string pair = argv[i];
    v[pair.substr(0, pair.find('='))] = std::atof(pair.c_str() + pair.find('=') + 1);
  }
  return run(argv[1], argv[2], v);
}
