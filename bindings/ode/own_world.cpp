#include "own_world.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <mutex>
#include <tuple>
#include <utility>
#include <vector>

#include "engine.h"
#include "near.h"
#include "rigid_host/own_world.h"
#include "trap.h"

namespace dfm_ode_detail {
namespace {

// What a geom stands for. ODE's own bits let a pair touch if either body's say so; here both must (body.h).
struct Shape {
  uint32_t number, category, collides_with;
  bool may_touch(const Shape &o) const { return category & o.collides_with && o.category & collides_with; }
};
const Shape &shape_of(dGeomID geom) { return *static_cast<Shape *>(dGeomGetData(geom)); }
uint32_t number_of(dGeomID geom) { return shape_of(geom).number; }

class OdeWorld : public OwnWorld {
 public:
  OdeWorld() : OwnWorld("ode", engine_) {}
  ~OdeWorld() override;
  OdeWorld(const OdeWorld &) = delete;
  OdeWorld &operator=(const OdeWorld &) = delete;
  // apart from the constructor, so that the destructor takes ODE's objects back when the set is refused
  void make(const dfm_rigid_set_def &set, uint32_t *group);

 protected:
  Member *make_body(const dfm_rigid_def &def, uint32_t number) override;
  void make_joint(const Joint &joint, size_t number) override;
  void set_gravity(const double g[3]) override { dWorldSetGravity(engine_.world, g[0], g[1], g[2]); }
  void set_correction(double share) override { dWorldSetERP(engine_.world, share); }
  void drive(size_t joint, double velocity, double max, double h) override;
  Wrench wrench(size_t joint) const override {
    return {load(ties_[joint].feedback.f1), load(ties_[joint].feedback.t1)};
  }
  void call(const std::function<void()> &f) override;

 private:
  // (If the first body is the world, ODE swaps the two by itself. It then reverses the joint's readings, but
  // not its motor.)
  struct Tie {
    dJointID id = nullptr;
    dJointFeedback feedback{};  // on ODE's first body, about its center of mass
  };
  OdeEngine engine_;
  dSpaceID space_ = nullptr;
  std::vector<OdeMember> members_;  // by number in the set; body null: fixed
  std::vector<Shape> shapes_;       // the data of geoms
  std::vector<Tie> ties_;           // ODE keeps the address of each feedback
  RigidFriction near_;
  // In the order in which ODE finds them, which depends on where the bodies have been; contact joints are
  // made in the order of the bodies, so that a step is a function of their states.
  std::vector<std::pair<dGeomID, dGeomID>> pairs_;

  // ODE's message when it stopped in the middle of a call; its world is not used after that
  std::string broken_;

  void make_world(const dfm_rigid_set_def &set);
  void collide_in_order();
};

Member *OdeWorld::make_body(const dfm_rigid_def &def, uint32_t number) {
  dGeomID geom = nullptr;
  const double *const a = def.half_size;
  if (def.shape == DFM_SHAPE_SPHERE) geom = dCreateSphere(space_, def.radius);
  if (def.shape == DFM_SHAPE_BOX) geom = dCreateBox(space_, 2 * a[0], 2 * a[1], 2 * a[2]);
  if (def.shape == DFM_SHAPE_CAPSULE) geom = dCreateCapsule(space_, def.radius, 2 * def.half_length);
  OdeMember &m = members_[number];
  dQuaternion q;
  to_ode(unit(load_quat(def.pose.rotation)), q);
  const double *const x = def.pose.position;
  shapes_[number] = {number, def.category, def.collides_with};
  if (geom) dGeomSetData(geom, &shapes_[number]);
  if (def.fixed) {
    if (geom) {
      dGeomSetPosition(geom, x[0], x[1], x[2]);
      dGeomSetQuaternion(geom, q);
    }
    return nullptr;
  }
  m.body = dBodyCreate(engine_.world);
  dMass mass;
  dMassSetParameters(&mass, def.mass, 0, 0, 0, def.inertia[0], def.inertia[1], def.inertia[2], 0, 0, 0);
  dBodySetMass(m.body, &mass);
  m.inertia = inertia_of(m.body);
  if (geom) dGeomSetBody(geom, m.body);
  return &m;
}

void OdeWorld::make_joint(const Joint &joint, size_t number) {
  const dWorldID w = engine_.world;
  const auto body = [&](uint32_t i) { return i == DFM_RIGID_WORLD ? nullptr : members_[i].body; };
  const dBodyID first = body(joint.first()), second = body(joint.second());
  const Vec anchor = joint.anchor, axis = joint.axis;
  dJointID &j = ties_[number].id;
  switch (joint.type) {
    case DFM_JOINT_HINGE:
      j = dJointCreateHinge(w, nullptr);
      dJointAttach(j, first, second);
      dJointSetHingeAnchor(j, anchor.x, anchor.y, anchor.z);
      dJointSetHingeAxis(j, axis.x, axis.y, axis.z);
      break;
    case DFM_JOINT_SLIDER:
      j = dJointCreateSlider(w, nullptr);
      dJointAttach(j, first, second);
      dJointSetSliderAxis(j, axis.x, axis.y, axis.z);
      break;
    case DFM_JOINT_BALL:
      j = dJointCreateBall(w, nullptr);
      dJointAttach(j, first, second);
      dJointSetBallAnchor(j, anchor.x, anchor.y, anchor.z);
      break;
    default:
      j = dJointCreateFixed(w, nullptr);
      dJointAttach(j, first, second);
      dJointSetFixed(j);
      break;
  }
  dJointSetFeedback(j, &ties_[number].feedback);
}

void OdeWorld::call(const std::function<void()> &f) {
  if (broken_.empty()) {
    try {
      const Trap trap;
      return f();
    } catch (const Assertion &assertion) {
      broken_ = assertion.message.empty() ? "no reason given" : assertion.message;
    }
  }
  throw Refused{failed(
      DFM_E_DIVERGED,
      "host \"ode\": ODE gave up with \"%s\"; rigid bodies, joints or forces are beyond what it can compute: "
      "look for huge positions, speeds, spins or gravity, and for degenerate shapes and inertias",
      broken_.c_str())};
}

void OdeWorld::make(const dfm_rigid_set_def &set, uint32_t *group) {
  call([&] {
    make_world(set);
    build(set, group);
    engine_.gather({});
    engine_.begin(0);
  });
}

void OdeWorld::make_world(const dfm_rigid_set_def &set) {
  dInitODE2(0);
  engine_.world = dWorldCreate();
  space_ = dHashSpaceCreate(nullptr);
  engine_.spaces = {space_};
  engine_.contacts = dJointGroupCreate(0);
  near_.world = engine_.world;
  near_.group = engine_.contacts;
  engine_.friction = &near_;
  engine_.near_callback = [](void *data, dGeomID a, dGeomID b) {
    if (!shape_of(a).may_touch(shape_of(b))) return;
    if (number_of(a) > number_of(b)) std::swap(a, b);
    static_cast<OdeWorld *>(data)->pairs_.emplace_back(a, b);
  };
  engine_.near_data = this;
  engine_.collided = [this] { collide_in_order(); };
  members_.resize(set.nbody);
  shapes_.resize(set.nbody);
  ties_.resize(set.njoint);
}

void OdeWorld::collide_in_order() {
  std::sort(pairs_.begin(), pairs_.end(), [](const auto &x, const auto &y) {
    return std::pair(number_of(x.first), number_of(x.second)) <
           std::pair(number_of(y.first), number_of(y.second));
  });
  for (const auto &[a, b] : pairs_) near_callback(&near_, a, b);
  pairs_.clear();
}

OdeWorld::~OdeWorld() {
  if (!engine_.world) return;
  if (!broken_.empty()) {
    // ODE left its world locked and half stepped: destroying it would end the process. A static list still
    // points to its objects, so that leak checkers do not report them.
    static std::mutex mutex;  // worlds may be destroyed on several threads
    static auto *const left = new std::vector<std::tuple<dWorldID, dSpaceID, dJointGroupID>>;
    try {
      const std::lock_guard lock(mutex);
      left->emplace_back(engine_.world, space_, engine_.contacts);
    } catch (const std::exception &) {  // no memory for the list: leaked, and reported
    }
    return;
  }
  engine_.end();
  dJointGroupDestroy(engine_.contacts);
  dSpaceDestroy(space_);
  dWorldDestroy(engine_.world);
}

void OdeWorld::drive(size_t number, double velocity, double max, double) {
  const dJointID id = ties_[number].id;
  if (joints()[number].type == DFM_JOINT_HINGE) {
    dJointSetHingeParam(id, dParamVel, velocity);
    dJointSetHingeParam(id, dParamFMax, max);
  } else {
    dJointSetSliderParam(id, dParamVel, velocity);
    dJointSetSliderParam(id, dParamFMax, max);
  }
}

}  // namespace

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra) {
  auto own = std::make_unique<OdeWorld>();
  own->make(set, group);
  *nextra = own->extra();
  *self = static_cast<Host *>(own.release());
  return DFM_OK;
}

}  // namespace dfm_ode_detail
