// Bullet's deformable world for the entries of the benchmarks: neo-Hookean tetrahedra, contacts of nodes with
// rigid bodies, its own friction (kDF times the rigid body's).
#pragma once

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
#include <ctime>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace bullet {

// Centimeters and grams: its solvers stop at absolute tolerances that a small body in SI units does not
// exceed. Values arrive in SI units.
constexpr double kLength = 100, kMass = 1000, kStress = kMass / kLength, kG = 9.81 * kLength;
constexpr btScalar kMargin = btScalar(1e-3 * kLength);  // where `margin` is not given
constexpr int kHopeless = 3;                            // how a run ends that is foreseen to be too slow
using Values = std::map<std::string, double>;

inline double given(const Values &v, const char *key, double otherwise) {
  const auto at = v.find(key);
  return at == v.end() ? otherwise : at->second;
}

struct Scene {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver body_solver;
  btDeformableMultiBodyConstraintSolver solver;
  btDeformableMultiBodyDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration, &body_solver};
  btSoftBody *soft = nullptr;  // the last that was loaded
  std::vector<btSoftBody *> softs;
  btDeformableNeoHookeanForce *elastic = nullptr;
  btDeformableGravityForce *gravity = nullptr;
  double time = 0, step, friction, end, most;
  btScalar margin;
  explicit Scene(const Values &v)
      : step(v.at("step")),
        friction(v.at("mu")),
        end(v.at("end")),
        most(given(v, "most", 0)),
        margin(btScalar(kLength * given(v, "margin", 1e-3))) {
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
    btContactSolverInfo &how = world.getSolverInfo();
    how.m_deformable_erp = btScalar(v.at("erp"));
    how.m_deformable_cfm = btScalar(given(v, "cfm", how.m_deformable_cfm));
    // speed of pushing out, in the length unit of this file
    how.m_deformable_maxErrorReduction = btScalar(given(v, "reduction", how.m_deformable_maxErrorReduction));
    how.m_splitImpulse = int(given(v, "split", how.m_splitImpulse));
    how.m_friction = 1;
    how.m_numIterations = int(v.at("iterations"));
  }

  // `place` turns a point of the file (m) and moves it. `matched`: moduli that give the law, which is that
  // of Smith, De Goes and Kim (ACM TOG 37, 2018), the material's E and nu at small strain; as it stands, 3/4
  // of its mu counts there.
  using Place = std::function<btVector3(double, double, double)>;
  void load(const std::string &path, const Values &v, const Place &place, bool matched = false) {
    std::ifstream in(path);
    int npoint = 0, ntet = 0;
    in >> npoint >> ntet;
    btAlignedObjectArray<btVector3> x;
    for (int i = 0; i < npoint; ++i) {
      double a, b, c;
      in >> a >> b >> c;
      x.push_back(place(a, b, c) * btScalar(kLength));
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
    soft->getCollisionShape()->setMargin(margin);
    soft->setTotalMass(btScalar(kMass * v.at("mass")));
    soft->m_cfg.kKHR = 1;
    soft->m_cfg.kCHR = btScalar(given(v, "chr", 1));
    soft->m_cfg.kDF = btScalar(friction);
    // Nodes against rigid bodies. With faces too (SDF_RDF) the implicit world stands still, without
    // friction neither.
    soft->m_cfg.collisions =
        btSoftBody::fCollision::SDF_RD |
        (given(v, "face", 0) != 0 ? btSoftBody::fCollision::SDF_RDF : btSoftBody::fCollision::SDF_RDN);
    // of soft bodies that touch each other, in the units of this file
    soft->setSpringStiffness(btScalar(given(v, "repulsion", soft->m_repulsionStiffness)));
    soft->m_sleepingThreshold = 0;
    soft->setActivationState(DISABLE_DEACTIVATION);
    world.addSoftBody(soft);
    const double e = kStress * v.at("young");
    const double nu = v.at("poisson");
    const double plain = e / (2 * (1 + nu));
    const double shear = matched ? plain * 4 / 3 : plain;
    const double lame = e * nu / ((1 + nu) * (1 - 2 * nu)) + (matched ? plain * 5 / 6 : 0);
    elastic = new btDeformableNeoHookeanForce(btScalar(shear), btScalar(lame), btScalar(v.at("damping")));
    world.addForce(soft, elastic);
    if (!gravity) gravity = new btDeformableGravityForce(btVector3(0, 0, 0));
    world.addForce(soft, gravity);
    soft->m_gravityFactor = 1;
    softs.push_back(soft);
  }

  // Lifted by `lift`, the length unit of this file.
  void load(const std::string &path, const Values &v, double lift) {
    load(path, v, [lift](double a, double b, double c) {
      return btVector3(btScalar(a), btScalar(b), btScalar(c + lift / kLength));
    });
  }

  btRigidBody *wall(btVector3 half, btVector3 at) {
    auto *const shape = new btBoxShape(half);
    shape->setMargin(margin);
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

  // A heavy body that moves on at even speed and spin. A kinematic one would lose its spin: Bullet takes it
  // from the cosine of half the step's turn, which is 1 in single precision below 7e-4 rad.
  btRigidBody *heavy(btVector3 half, btVector3 at, btVector3 velocity, btVector3 spin) {
    auto *const shape = new btBoxShape(half);
    shape->setMargin(margin);
    const btTransform pose(btQuaternion::getIdentity(), at);
    const btScalar mass = btScalar(1e9 * kMass);
    auto *const body =
        new btRigidBody(mass, new btDefaultMotionState(pose), shape, mass * btVector3(1, 1, 1));
    body->setActivationState(DISABLE_DEACTIVATION);
    body->setFriction(1);
    body->setDamping(0, 0);
    world.addRigidBody(body);
    body->setGravity(btVector3(0, 0, 0));
    body->setLinearVelocity(velocity);
    body->setAngularVelocity(spin);
    return body;
  }

  // Points that are held, and moved by what is given to their velocity.
  std::vector<int> hold(const std::function<bool(const btVector3 &)> &which) const {
    std::vector<int> held;
    for (int i = 0; i < soft->m_nodes.size(); ++i)
      if (which(soft->m_nodes[i].m_x)) {
        soft->setMass(i, 0);
        held.push_back(i);
      }
    return held;
  }

  static void drive(btSoftBody *body, const std::vector<int> &held, const btVector3 &velocity) {
    for (const int i : held) body->m_nodes[i].m_v = velocity;
  }

  // Force of the tetrahedra on held points, and its moment about the z axis through `axis`: what holds them,
  // the other way round. In the units of this file.
  std::pair<btVector3, double> reaction(const std::vector<int> &held, const btVector3 &axis) {
    btAlignedObjectArray<btVector3> force;
    force.resize(elastic->getNumNodes());
    for (int i = 0; i < force.size(); ++i) force[i].setZero();
    soft->updateDeformation();
    elastic->addScaledForces(1, force);
    btVector3 sum(0, 0, 0);
    double moment = 0;
    for (const int i : held) {
      const btSoftBody::Node &node = soft->m_nodes[i];
      const btVector3 &f = force[node.index];
      sum += f;
      moment += (node.m_x.x() - axis.x()) * f.y() - (node.m_x.y() - axis.y()) * f.x();
    }
    return {sum, moment};
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
    // twice the time would not be enough
    if (most > 0 && time < end / 4 && double(std::clock()) > most / 2 * CLOCKS_PER_SEC) {
      std::fprintf(stderr, "at %g\n", time);
      std::exit(kHopeless);
    }
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

inline double ramp(double t, double from, double to) {
  return std::min(1.0, std::max(0.0, (t - from) / (to - from)));
}

inline void print(const char *key, double value, double simulated) {
  std::printf("%s=%.9g\nsimulated=%.9g\n", key, value, simulated);
}

// The arguments key=value from the third on.
inline Values values(int argc, char **argv) {
  Values v;
  for (int i = 3; i < argc; ++i) {
    const std::string pair = argv[i];
    v[pair.substr(0, pair.find('='))] = std::atof(pair.c_str() + pair.find('=') + 1);
  }
  return v;
}

}  // namespace bullet
