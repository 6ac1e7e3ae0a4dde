// A cart in a world of ODE drives over a bump on four soft tires and brakes. ODE has chassis, hubs, hinges,
// motors and a crate that lies on the chassis; libdeform has the tires, which only contact holds on their
// hubs. Prints where the cart is, twice per second.
#include <array>
#include <cmath>
#include <cstdio>
#include <deform/ode.hpp>

namespace {

using deform::Vec3;

constexpr int kRate = 240;

// What a scene of ODE has of its own, ended in the order that ODE wants.
struct OdeWorld {
  dWorldID world = dWorldCreate();
  dSpaceID space = dHashSpaceCreate(nullptr);
  OdeWorld() {
    dWorldSetGravity(world, 0, 0, -9.81);
    dCreatePlane(space, 0, 0, 1, 0);
  }
  OdeWorld(const OdeWorld &) = delete;
  OdeWorld &operator=(const OdeWorld &) = delete;
  ~OdeWorld() {
    dSpaceDestroy(space);
    dWorldDestroy(world);
  }

  dBodyID body(dGeomID geom, const dMass &mass, Vec3 at) const {
    const dBodyID b = dBodyCreate(world);
    dBodySetMass(b, &mass);
    dGeomSetBody(geom, b);
    dBodySetPosition(b, at[0], at[1], at[2]);
    return b;
  }
  dBodyID box(double mass, Vec3 size, Vec3 at) const {
    dMass m;
    dMassSetBoxTotal(&m, mass, size[0], size[1], size[2]);
    return body(dCreateBox(space, size[0], size[1], size[2]), m, at);
  }
  // Along y; length: between the centers of its caps.
  dBodyID capsule(double mass, double radius, double length, Vec3 at) const {
    dMass m;
    dMassSetCapsuleTotal(&m, mass, 3, radius, length);
    const dBodyID b = body(dCreateCapsule(space, radius, length), m, at);
    dMatrix3 turn;
    dRFromAxisAndAngle(turn, 1, 0, 0, M_PI / 2);
    dBodySetRotation(b, turn);
    return b;
  }
};

struct Wheel {
  dBodyID hub;
  dJointID hinge;
  deform::Body tyre;
};

// m: radius of the hub, of the tyre, width of both
constexpr double kHub = 0.094, kTyre = 0.15, kWidth = 0.12;

Wheel make_wheel(const OdeWorld &ode, dBodyID chassis, const deform::World &soft, deform::BodyDef tyre,
                 Vec3 at) {
  Wheel w{};
  w.hub = ode.capsule(2, kHub, kWidth / 2, at);
  w.hinge = dJointCreateHinge(ode.world, nullptr);
  dJointAttach(w.hinge, w.hub, chassis);
  dJointSetHingeAnchor(w.hinge, at[0], at[1], at[2]);
  dJointSetHingeAxis(w.hinge, 0, 1, 0);
  tyre.pose.position[0] = at[0];
  tyre.pose.position[1] = at[1] + kWidth / 2;
  tyre.pose.position[2] = at[2];
  w.tyre = soft.add_body(tyre);
  return w;
}

void drive(const Wheel &w, double speed, double torque) {
  dJointSetHingeParam(w.hinge, dParamVel, speed);
  dJointSetHingeParam(w.hinge, dParamFMax, torque);
}

int run() {
  const OdeWorld ode;
  const dBodyID chassis = ode.box(16, {1, 0.38, 0.08}, {0, 0, kTyre + 1e-3});
  const dBodyID crate = ode.box(4, {0.2, 0.2, 0.2}, {-0.1, 0, kTyre + 0.142});
  const dGeomID bump = dCreateCapsule(ode.space, 0.1, 1.2);
  dMatrix3 across;
  dRFromAxisAndAngle(across, 1, 0, 0, M_PI / 2);
  dGeomSetRotation(bump, across);
  dGeomSetPosition(bump, 0.75, 0, -0.05);

  const auto context = deform::Context::make();
  const auto soft = context.make_world();
  deform::MaterialDef rubber;
  rubber.density = 250;
  rubber.young = 6e4;
  rubber.poisson = 0.3;
  rubber.damping_mass = 1;
  rubber.damping_stiffness = 1e-3;
  const auto mesh = context.make_tets("tube", {0.1, kTyre, kWidth}, 250);
  deform::BodyDef tyre;
  tyre.set_mesh(mesh);
  tyre.material = soft.add_material(rubber).get();
  tyre.pose.rotation[0] = tyre.pose.rotation[3] = std::sqrt(0.5);  // from along z to along y
  std::array<Wheel, 4> wheels;
  for (size_t i = 0; i < 4; ++i)
    wheels[i] =
        make_wheel(ode, chassis, soft, tyre, {i < 2 ? -0.4 : 0.4, i % 2 ? -0.32 : 0.32, kTyre + 1e-3});
  soft.add_friction("*", "*", "coulomb", deform::Params({{"mu", 0.8}}));

  deform::OdeDef def;
  def.world = ode.world;
  def.space = ode.space;
  // ends before the worlds: declared after them
  const auto both = deform::attach_ode(soft, def);
  std::array<deform::Rigid, 4> hubs;  // their handles in reports
  for (size_t i = 0; i < 4; ++i) hubs[i] = both.rigid(wheels[i].hub);

  constexpr int kDrive = 2 * kRate, kEnd = 11 * kRate / 4;
  double carried = 0;
  for (int i = 1; i <= kEnd; ++i) {
    for (size_t k = 0; k < 2; ++k) drive(wheels[k], i <= kDrive ? 6 : 0, 12);
    // discarded: too many sub-steps would have been needed
    if (!both.step(1.0 / kRate)) return 1;
    for (const deform::Rigid &hub : hubs)
      carried += i > kEnd - kRate / 4 ? hub.contact_wrench().force[2] / (kRate / 4) : 0;
    const dReal *const at = dBodyGetPosition(chassis);
    if (i % (kRate / 2) == 0) {
      const double rides = dBodyGetPosition(crate)[0] - at[0];
      std::printf("t %.1f s: chassis at %.3f m, %.3f m high, crate at %.3f m on it\n", double(i) / kRate,
                  at[0], at[2], rides);
    }
  }
  const double there = dBodyGetPosition(chassis)[0], weight = (16 + 4 + 4 * 2) * 9.81;
  std::printf("the tyres carry %.1f N of %.1f N\n", carried, weight);
  const dfm_ode_stats stats = both.stats();
  std::printf("%u bodies, %.2f sub-steps of ODE per step, residual %.1e at most\n", stats.bodies,
              double(stats.ode_steps) / double(stats.steps), stats.residual_max);
  return there > 1.2 && std::fabs(carried - weight) < 0.05 * weight ? 0 : 1;
}

}  // namespace

int main() {
  dInitODE2(0);
  int result = 1;
  try {
    result = run();
  } catch (const deform::Error &e) {  // the library's own sentence
    std::fprintf(stderr, "%s: %s\n", deform::status_name(e.status()), e.what());
  }
  dCloseODE();
  return result;
}
