#include "own_world.h"

#include <cstring>
#include <limits>

#include "near.h"

namespace dfm_ode_detail {
namespace {

constexpr size_t kMotor = 3;              // values of extra per joint behind those of the bodies: speed, limit, effort of the last sub-step

class OwnWorld : public Host {
 public:
  OwnWorld(const dfm_rigid_set_def &set, uint32_t *group);
  ~OwnWorld() override;
  OwnWorld(const OwnWorld &) = delete;
  OwnWorld &operator=(const OwnWorld &) = delete;
  uint32_t extra() const { return static_cast<uint32_t>(first_joint() + kMotor * joints_.size()); }

  dfm_status predict(const dfm_rigid_step &step, double *velocity) override;
  void respond(const dfm_rigid_step &step, uint32_t group, double *matrix) override { engine_.respond(members_[moving_[group]], matrix); }
  void push(const dfm_rigid_step &step, const double *impulse) override;
  bool commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) override;
  dfm_status set_motor(uint32_t joint, double velocity, double max, double *extra) override;
  dfm_status joint(const dfm_rigid_state *state, const double *extra, uint32_t joint, double *position, double *rate, double *effort) override;

 private:
  struct Joint {
    dJointID id;
    uint32_t type;
    dJointFeedback feedback;
    uint32_t body, with;                  // of the set; kStill: not a body of ODE
    Vec axis;                             // in the frame of `with`
  };
  Engine engine_;
  dSpaceID space_ = nullptr;
  std::vector<Member> members_;           // by number in the set; body null: fixed
  std::vector<uint32_t> moving_;          // group -> number
  std::vector<Joint> joints_;
  std::vector<dfm_rigid_state> given_;    // as ODE's bodies stand
  RigidFriction near_;

  size_t first_joint() const { return size_t{Member::kExtra} * members_.size(); }
  void add_body(const dfm_rigid_def &def, uint32_t number);
  void add_joint(const dfm_joint_def &def);
  void drive(const Joint &j, const double *extra) const;
};

void OwnWorld::add_body(const dfm_rigid_def &def, uint32_t number) {
  dGeomID geom = nullptr;
  const double *const a = def.half_size;
  if (def.shape == DFM_SHAPE_SPHERE) geom = dCreateSphere(space_, def.radius);
  if (def.shape == DFM_SHAPE_BOX) geom = dCreateBox(space_, 2 * a[0], 2 * a[1], 2 * a[2]);
  if (def.shape == DFM_SHAPE_CAPSULE) geom = dCreateCapsule(space_, def.radius, 2 * def.half_length);
  Member &m = members_[number];
  m.engine = &engine_;
  dQuaternion q;
  to_ode(unit({def.pose.rotation[0], def.pose.rotation[1], def.pose.rotation[2], def.pose.rotation[3]}), q);
  const double *const x = def.pose.position;
  if (geom) dGeomSetCategoryBits(geom, def.category), dGeomSetCollideBits(geom, def.collides_with);
  if (def.fixed) {
    if (geom) dGeomSetPosition(geom, x[0], x[1], x[2]), dGeomSetQuaternion(geom, q);
    return;
  }
  m.body = dBodyCreate(engine_.world);
  dMass mass;
  dMassSetParameters(&mass, def.mass, 0, 0, 0, def.inertia[0], def.inertia[1], def.inertia[2], 0, 0, 0);
  dBodySetMass(m.body, &mass);
  m.inertia = inertia_of(m.body);
  dfm_rigid_state s{};
  std::memcpy(s.position, def.pose.position, sizeof s.position), std::memcpy(s.rotation, def.pose.rotation, sizeof s.rotation);
  std::memcpy(s.velocity, def.velocity, sizeof s.velocity), std::memcpy(s.spin, def.spin, sizeof s.spin);
  m.put(s);
  if (geom) dGeomSetBody(geom, m.body);
  engine_.members.push_back(&m);
}

void OwnWorld::add_joint(const dfm_joint_def &def) {
  const dWorldID w = engine_.world;
  const dBodyID a = members_[def.body].body, b = def.with == DFM_RIGID_WORLD ? nullptr : members_[def.with].body;
  const double *const p = def.anchor, *const n = def.axis;
  dJointID j = nullptr;
  switch (def.type) {
    case DFM_JOINT_HINGE:
      j = dJointCreateHinge(w, nullptr), dJointAttach(j, a, b);
      dJointSetHingeAnchor(j, p[0], p[1], p[2]), dJointSetHingeAxis(j, n[0], n[1], n[2]);
      break;
    case DFM_JOINT_SLIDER: j = dJointCreateSlider(w, nullptr), dJointAttach(j, a, b), dJointSetSliderAxis(j, n[0], n[1], n[2]); break;
    case DFM_JOINT_BALL: j = dJointCreateBall(w, nullptr), dJointAttach(j, a, b), dJointSetBallAnchor(j, p[0], p[1], p[2]); break;
    default: j = dJointCreateFixed(w, nullptr), dJointAttach(j, a, b), dJointSetFixed(j); break;
  }
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  Vec axis = length > 0 ? (1 / length) * load(n) : Vec{0, 0, 1};
  if (b) axis = rotate(conjugate(from_ode(dBodyGetQuaternion(b))), axis);
  joints_.push_back({j, def.type, {}, def.body, def.with, axis});
}

OwnWorld::OwnWorld(const dfm_rigid_set_def &set, uint32_t *group) {
  dInitODE2(0);
  engine_.world = dWorldCreate();
  space_ = dHashSpaceCreate(nullptr);
  engine_.spaces = {space_};
  engine_.contacts = dJointGroupCreate(0);
  near_.world = engine_.world, near_.group = engine_.contacts;
  engine_.friction = &near_;
  engine_.near_callback = near_callback, engine_.near_data = &near_;
  members_.resize(set.nbody), given_.resize(set.nbody);
  for (uint32_t i = 0; i < set.nbody; ++i) {
    add_body(set.bodies[i], i);
    group[i] = members_[i].body ? static_cast<uint32_t>(moving_.size()) : DFM_RIGID_STILL;
    if (members_[i].body) moving_.push_back(i);
  }
  joints_.reserve(set.njoint);            // ODE keeps the address of each feedback
  for (uint32_t k = 0; k < set.njoint; ++k) add_joint(set.joints[k]);
  for (Joint &j : joints_) dJointSetFeedback(j.id, &j.feedback);
  engine_.begin({});
}

OwnWorld::~OwnWorld() {
  engine_.end();
  dJointGroupDestroy(engine_.contacts);
  dSpaceDestroy(space_);
  dWorldDestroy(engine_.world);
}

void OwnWorld::drive(const Joint &j, const double *extra) const {
  if (j.type == DFM_JOINT_HINGE) dJointSetHingeParam(j.id, dParamVel, extra[0]), dJointSetHingeParam(j.id, dParamFMax, extra[1]);
  if (j.type == DFM_JOINT_SLIDER) dJointSetSliderParam(j.id, dParamVel, extra[0]), dJointSetSliderParam(j.id, dParamFMax, extra[1]);
}

dfm_status OwnWorld::predict(const dfm_rigid_step &step, double *velocity) {
  dWorldSetGravity(engine_.world, step.gravity[0], step.gravity[1], step.gravity[2]);
  for (size_t k = 0; k < joints_.size(); ++k) drive(joints_[k], step.extra + first_joint() + kMotor * k);
  for (const uint32_t i : moving_)
    if (std::memcmp(&given_[i], &step.state[i], sizeof given_[i]) != 0) engine_.reopen();
  if (!engine_.is_open())
    for (const uint32_t i : moving_) members_[i].put(step.state[i]), given_[i] = step.state[i];
  for (const uint32_t i : moving_) engine_.predict(members_[i], step, i, velocity + 6 * size_t{i});
  return DFM_OK;
}

void OwnWorld::push(const dfm_rigid_step &, const double *impulse) {
  for (const uint32_t i : moving_) engine_.push(members_[i], impulse + 6 * size_t{i});
}

bool OwnWorld::commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) {
  bool again = false;
  std::memcpy(extra, step.extra, sizeof(double) * this->extra());
  std::memcpy(state, step.state, sizeof(dfm_rigid_state) * members_.size());
  for (const uint32_t i : moving_) again |= engine_.commit(members_[i], i, state, extra, step.h);
  for (size_t k = 0; k < joints_.size(); ++k) {
    // What the constraint did along its own axis is the motor's doing: the joint alone is free there.
    const Joint &j = joints_[k];
    Vec axis = j.axis;
    if (j.with != DFM_RIGID_WORLD) {
      const double *const q = step.state[j.with].rotation;
      axis = rotate({q[0], q[1], q[2], q[3]}, axis);
    }
    const bool first = members_[j.body].body != nullptr;   // ODE swaps the bodies of a joint whose first is the world
    const double sign = first ? 1 : -1;
    extra[first_joint() + kMotor * k + 2] = sign * dot(axis, load(j.type == DFM_JOINT_HINGE ? j.feedback.t1 : j.feedback.f1));
  }
  // Asked for another round, the engine goes back by itself; the world then gives the same start state as before.
  for (const uint32_t i : moving_)
    if (!again) given_[i] = state[i];
  return again;
}

dfm_status OwnWorld::set_motor(uint32_t joint, double velocity, double max, double *extra) {
  if (joint >= joints_.size() || joints_[joint].type > DFM_JOINT_SLIDER) return DFM_E_ARG;
  double *const motor = extra + first_joint() + kMotor * joint;
  motor[0] = velocity, motor[1] = max;
  return DFM_OK;
}

dfm_status OwnWorld::joint(const dfm_rigid_state *, const double *extra, uint32_t joint, double *position, double *rate, double *effort) {
  if (joint >= joints_.size() || joints_[joint].type > DFM_JOINT_SLIDER) return DFM_E_ARG;
  const Joint &j = joints_[joint];
  const bool hinge = j.type == DFM_JOINT_HINGE;
  *position = hinge ? dJointGetHingeAngle(j.id) : dJointGetSliderPosition(j.id);
  *rate = hinge ? dJointGetHingeAngleRate(j.id) : dJointGetSliderPositionRate(j.id);
  *effort = extra[first_joint() + kMotor * joint + 2];
  return DFM_OK;
}

}  // namespace

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra) {
  auto *const own = new OwnWorld(set, group);
  *self = static_cast<Host *>(own), *nextra = own->extra();
  return DFM_OK;
}

}  // namespace dfm_ode_detail
