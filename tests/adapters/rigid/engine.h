// The engine that a program of this folder is built for: ODE, or Bullet of single or double precision; and a
// world of it that each test fills alike.
#pragma once
#ifdef DEFORM_TEST_BULLET
#include "bullet.h"
#include "deform/bullet_host.h"
#else
#include "deform/ode_host.h"
#include "ode.h"
#endif

namespace test {

#ifdef DEFORM_TEST_BULLET
constexpr const char *kEngine = "bullet";
constexpr double kRounding = kSingle ? 6e-8 : 1e-16;  // of the engine's own numbers
inline dfm_status register_engine() { return dfm_bullet_register(); }
struct Engine : Bullet {
  using Bullet::Bullet;
  double engine_seconds() const { return stats().bullet_seconds; }
  void ground() { body(shape<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)), 0); }
  // three balls of 0.05 m in a row along x, 0.15 m apart
  btRigidBody *bar(double mass, Vec moments, Vec place) {
    auto *const row = shape<btCompoundShape>();
    for (const double x : {-0.15, 0.0, 0.15})
      row->addChildShape(at({x, 0, 0}), shape<btSphereShape>(btScalar(0.05)));
    return body(row, mass, place, {}, moments);
  }
};
#else
constexpr const char *kEngine = "ode";
constexpr double kRounding = 1e-16;
inline dfm_status register_engine() { return dfm_ode_register(); }
inline Vec spin(dBodyID b) { return vec(dBodyGetAngularVel(b)); }
inline void set_spin(dBodyID b, Vec w) { dBodySetAngularVel(b, w[0], w[1], w[2]); }
struct Engine : Ode {
  using Ode::Ode;
  double engine_seconds() const { return stats().ode_seconds; }
  void ground() { dCreatePlane(space, 0, 0, 1, 0); }
  dBodyID bar(double mass, Vec moments, Vec place) {
    const dBodyID b = body(mass, moments, place);
    for (const double x : {-0.15, 0.0, 0.15}) {
      const dGeomID g = dCreateSphere(space, 0.05);
      dGeomSetBody(g, b);
      dGeomSetOffsetPosition(g, x, 0, 0);
    }
    return b;
  }
  dfm_rigid rigid(dBodyID b) const {
    dfm_rigid out = 0;
    ok(dfm_ode_rigid(adapter, b, &out));
    return out;
  }
  void add_to(Momenta &m, dBodyID b) const { add(m, b); }
};
#endif

}  // namespace test
