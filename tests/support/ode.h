// An ODE world with a libdeform world beside it.
#pragma once
#include "deform/ode.h"
#include "rigid.h"

namespace test {

struct Ode {
  Context context;
  dWorldID world;
  dSpaceID space;
  dfm_world soft = 0;
  dfm_ode adapter = 0;

  explicit Ode(Vec gravity = {0, 0, -9.81}, uint32_t flags = 0, dNearCallback *near_callback = nullptr,
               void *near_data = nullptr, dJointGroupID group = nullptr) {
    dInitODE2(0);
    world = dWorldCreate();
    space = dHashSpaceCreate(nullptr);
    dWorldSetGravity(world, gravity[0], gravity[1], gravity[2]);
    soft = make_world(context, {gravity[0], gravity[1], gravity[2]});
    dfm_ode_def d = dfm_ode_def_default();
    d.world = world;
    d.space = space;
    d.flags = flags;
    d.near_callback = near_callback;
    d.near_data = near_data;
    d.contacts = group;
    ok(dfm_ode_attach(soft, &d, &adapter));
  }
  ~Ode() {
    ok(dfm_ode_detach(adapter));
    dSpaceDestroy(space);
    dWorldDestroy(world);
  }
  Ode(const Ode &) = delete;
  Ode &operator=(const Ode &) = delete;

  dBodyID body(double mass, Vec moments, Vec position = {}, Vec velocity = {}) {
    const dBodyID b = dBodyCreate(world);
    dMass m;
    dMassSetParameters(&m, mass, 0, 0, 0, moments[0], moments[1], moments[2], 0, 0, 0);
    dBodySetMass(b, &m);
    dBodySetPosition(b, position[0], position[1], position[2]);
    dBodySetLinearVel(b, velocity[0], velocity[1], velocity[2]);
    return b;
  }
  dBodyID ball(double radius, double mass, Vec position, Vec velocity = {}) {
    const double i = 0.4 * mass * radius * radius;
    const dBodyID b = body(mass, {i, i, i}, position, velocity);
    dGeomSetBody(dCreateSphere(space, radius), b);
    return b;
  }
  dBodyID box(Vec half, double mass, Vec position, Vec velocity = {}) {
    Vec i;
    for (size_t k = 0; k < 3; ++k)
      i[k] = mass / 3 * (half[(k + 1) % 3] * half[(k + 1) % 3] + half[(k + 2) % 3] * half[(k + 2) % 3]);
    const dBodyID b = body(mass, i, position, velocity);
    dGeomSetBody(dCreateBox(space, 2 * half[0], 2 * half[1], 2 * half[2]), b);
    return b;
  }

  void step(double dt = 1e-3) { ASSERT_EQ(dfm_ode_step(adapter, dt), DFM_OK) << dfm_last_error(); }
  void run(double seconds, double dt = 1e-3) {
    const long n = std::lround(seconds / dt);
    for (long i = 0; i < n && !::testing::Test::HasFatalFailure(); ++i) step(dt);
  }
  std::vector<unsigned char> snapshot() const {
    size_t bytes = 0;
    ok(dfm_ode_snapshot(adapter, nullptr, &bytes));
    std::vector<unsigned char> shot(bytes);
    ok(dfm_ode_snapshot(adapter, shot.data(), &bytes));
    return shot;
  }
  dfm_ode_stats stats() const {
    dfm_ode_stats s{};
    s.size = sizeof s;
    ok(dfm_ode_get_stats(adapter, &s));
    return s;
  }
};

inline Vec position(dBodyID b) { return vec(dBodyGetPosition(b)); }
inline Vec velocity(dBodyID b) { return vec(dBodyGetLinearVel(b)); }

inline Vec turned(const dReal *R, Vec a, bool back) {
  Vec out{};
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 3; ++c) out[r] += (back ? R[4 * c + r] : R[4 * r + c]) * a[c];
  return out;
}
inline void add(Momenta &to, dfm_body b) { add(to, measure(b)); }
inline void add(Momenta &to, dBodyID b) {
  dMass m;
  dBodyGetMass(b, &m);
  const dReal *const R = dBodyGetRotation(b);
  const Vec w = turned(R, vec(dBodyGetAngularVel(b)), true);
  Vec L{}, p = velocity(b);
  for (size_t r = 0; r < 3; ++r)
    for (size_t c = 0; c < 3; ++c) L[r] += m.I[4 * r + c] * w[c];
  for (double &x : p) x *= m.mass;
  add(to, p, position(b), turned(R, L, false));
}

inline dfm_body soft_bed(Ode &ode, double young = 2e4) { return soft_bed(ode.context, ode.soft, young); }
inline dfm_body soft_ball(Ode &ode, Vec at, Vec speed = {}, double young = 3e4, double damping_mass = 0) {
  return soft_ball(ode.context, ode.soft, at, speed, young, damping_mass);
}

}  // namespace test
