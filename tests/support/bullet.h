// A world of Bullet with a libdeform world beside it.
#pragma once
#include <memory>
#include <vector>

#include "deform/bullet.h"
#include "rigid.h"

namespace test {

inline btVector3 bt(Vec a) { return {btScalar(a[0]), btScalar(a[1]), btScalar(a[2])}; }
inline Vec vec(const btVector3 &a) { return {a.x(), a.y(), a.z()}; }
inline btTransform at(Vec place, const btQuaternion &q = btQuaternion::getIdentity()) {
  return btTransform(q, bt(place));
}
constexpr bool kSingle = sizeof(btScalar) == 4;

struct Bullet {
  Context context;
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  dfm_world soft = 0;
  dfm_bullet adapter = 0;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btCollisionObject>> objects;
  std::vector<std::unique_ptr<btTypedConstraint>> constraints;

  explicit Bullet(Vec gravity = {0, 0, -9.81}) {
    world.setGravity(bt(gravity));
    soft = make_world(context, {gravity[0], gravity[1], gravity[2]});
    dfm_bullet_def d = dfm_bullet_def_default();
    d.world = &world;
    ok(dfm_bullet_attach(soft, &d, &adapter));
  }
  ~Bullet() {
    ok(dfm_bullet_detach(adapter));
    for (auto &c : constraints) world.removeConstraint(c.get());
    for (auto &o : objects) world.removeCollisionObject(o.get());
  }
  Bullet(const Bullet &) = delete;
  Bullet &operator=(const Bullet &) = delete;

  template <class Shape, class... A>
  Shape *shape(A &&...a) {
    shapes.push_back(std::make_unique<Shape>(std::forward<A>(a)...));
    return static_cast<Shape *>(shapes.back().get());
  }
  // moments empty: those that the shape has; mass 0: static
  btRigidBody *body(btCollisionShape *of, double mass, Vec position = {}, Vec velocity = {},
                    Vec moments = {}) {
    btVector3 inertia = bt(moments);
    if (mass > 0 && moments == Vec{}) of->calculateLocalInertia(btScalar(mass), inertia);
    auto b = std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(btScalar(mass), nullptr, of, inertia));
    b->setCenterOfMassTransform(at(position));
    b->setLinearVelocity(bt(velocity));
    btRigidBody *const out = b.get();
    world.addRigidBody(out);
    objects.push_back(std::move(b));
    return out;
  }
  btRigidBody *ball(double radius, double mass, Vec position, Vec velocity = {}) {
    return body(shape<btSphereShape>(btScalar(radius)), mass, position, velocity);
  }
  btRigidBody *box(Vec half, double mass, Vec position, Vec velocity = {}) {
    return body(shape<btBoxShape>(bt(half)), mass, position, velocity);
  }
  void remove(btRigidBody *b) {
    world.removeRigidBody(b);
    std::erase_if(objects, [&](const auto &o) { return o.get() == b; });
  }

  void step(double dt = 1e-3) {
    world.stepSimulation(btScalar(dt), 0);
    ASSERT_EQ(dfm_bullet_last_tick(adapter, nullptr), DFM_OK) << dfm_last_error();
  }
  void run(double seconds, double dt = 1e-3) {
    const long n = std::lround(seconds / dt);
    for (long i = 0; i < n && !::testing::Test::HasFatalFailure(); ++i) step(dt);
  }
  dfm_bullet_stats stats() const {
    dfm_bullet_stats s{};
    s.size = sizeof s;
    ok(dfm_bullet_get_stats(adapter, &s));
    return s;
  }
  dfm_rigid rigid(const btRigidBody *b) const {
    dfm_rigid out = 0;
    ok(dfm_bullet_rigid(adapter, b, &out));
    return out;
  }
  // As the dfm_world has it: not rounded to btScalar.
  void add_to(Momenta &m, const btRigidBody *b) const { add(m, rigid_measure(rigid(b))); }
};

inline Vec position(const btRigidBody *b) { return vec(b->getCenterOfMassPosition()); }
inline Vec velocity(const btRigidBody *b) { return vec(b->getLinearVelocity()); }
inline Vec spin(const btRigidBody *b) { return vec(b->getAngularVelocity()); }
inline void set_spin(btRigidBody *b, Vec w) { b->setAngularVelocity(bt(w)); }

inline dfm_body soft_bed(Bullet &b, double young = 2e4) { return soft_bed(b.context, b.soft, young); }
inline dfm_body soft_ball(Bullet &b, Vec place, Vec speed = {}, double young = 3e4, double damping_mass = 0) {
  return soft_ball(b.context, b.soft, place, speed, young, damping_mass);
}

}  // namespace test
