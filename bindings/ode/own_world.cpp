#include "own_world.h"

#include <cmath>
#include <cstring>
#include <string>

#include "near.h"
#include "trap.h"

namespace dfm_ode_detail {
namespace {

// values of extra per joint behind those of the bodies: speed, limit, effort of the last sub-step
constexpr size_t kMotor = 3;

class OwnWorld : public Host {
 public:
  OwnWorld(const dfm_rigid_set_def &set, uint32_t *group);
  ~OwnWorld() override;
  OwnWorld(const OwnWorld &) = delete;
  OwnWorld &operator=(const OwnWorld &) = delete;
  uint32_t extra() const { return static_cast<uint32_t>(first_joint() + kMotor * joints_.size()); }

  dfm_status predict(const dfm_rigid_step &step, double *velocity) override;
  void respond(const dfm_rigid_step &step, uint32_t group, double *matrix) override {
    engine_.respond(members_[moving_[group]], matrix);
  }
  void push(const dfm_rigid_step &step, const double *impulse) override;
  bool commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) override;
  dfm_status set_motor(uint32_t joint, double velocity, double max, double *extra) override;
  dfm_status joint(const dfm_rigid_state *state, const double *extra, uint32_t joint, double *position,
                   double *rate, double *effort) override;

 private:
  // ODE's first body is one that moves: `body`, or `with` where `body` is fixed. (Handed nothing as its first
  // one ODE swaps the two by itself, and turns round what it says of the joint, but not its motor.)
  struct Joint {
    dJointID id;                   // null: both stand still
    uint32_t type, body, with;     // numbers in the set; with: DFM_RIGID_WORLD for the world
    bool swapped;                  // ODE's first body is `with`
    Vec anchor_body, anchor_with;  // in the frames of the two
    Vec axis_body, axis_with;      // unit, likewise
    Quat turn;                     // from the frame of `with` to that of `body`, as created
    dJointFeedback feedback;       // on ODE's first body, about its center of mass
    double sign() const { return swapped ? -1 : 1; }
  };
  Engine engine_;
  dSpaceID space_ = nullptr;
  std::vector<Member> members_;   // by number in the set; body null: fixed
  std::vector<uint32_t> moving_;  // group -> number
  std::vector<Joint> joints_;
  std::vector<dfm_rigid_state> given_;  // as ODE's bodies stand
  RigidFriction near_;

  // what ODE said when it stopped in the middle of a call; its world is not touched after that
  std::string broken_;

  // Runs what calls ODE; an assertion of ODE's ends in an error.
  template <class F>
  void call(F &&f);
  void build(const dfm_rigid_set_def &set, uint32_t *group);
  void predict_all(const dfm_rigid_step &step, double *velocity);
  size_t first_joint() const { return size_t{Member::kExtra} * members_.size(); }
  void add_body(const dfm_rigid_def &def, uint32_t number);
  void add_joint(const dfm_joint_def &def);
  static void drive(const Joint &j, const double *extra);
  static double effort(const Joint &j, const dfm_rigid_state *state);
};

// As `state` has it; the world's is that of the origin.
Pose pose_of(uint32_t number, const dfm_rigid_state *state) {
  if (number == DFM_RIGID_WORLD) return {};
  const double *const q = state[number].rotation;
  return {load(state[number].position), {q[0], q[1], q[2], q[3]}};
}
Motion motion_of(uint32_t number, const dfm_rigid_state *state) {
  if (number == DFM_RIGID_WORLD) return {};
  return {load(state[number].velocity), load(state[number].spin)};
}

dfm_rigid_state state_of(const dfm_rigid_def &def) {
  dfm_rigid_state s{};
  std::memcpy(s.position, def.pose.position, sizeof s.position);
  std::memcpy(s.rotation, def.pose.rotation, sizeof s.rotation);
  std::memcpy(s.velocity, def.velocity, sizeof s.velocity);
  std::memcpy(s.spin, def.spin, sizeof s.spin);
  return s;
}

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
  if (geom) {
    dGeomSetCategoryBits(geom, def.category);
    dGeomSetCollideBits(geom, def.collides_with);
  }
  if (def.fixed) {
    if (geom) {
      dGeomSetPosition(geom, x[0], x[1], x[2]);
      dGeomSetQuaternion(geom, q);
    }
    return;
  }
  m.body = dBodyCreate(engine_.world);
  dMass mass;
  dMassSetParameters(&mass, def.mass, 0, 0, 0, def.inertia[0], def.inertia[1], def.inertia[2], 0, 0, 0);
  dBodySetMass(m.body, &mass);
  m.inertia = inertia_of(m.body);
  m.put(given_[number]);
  if (geom) dGeomSetBody(geom, m.body);
  engine_.members.push_back(&m);
}

void OwnWorld::add_joint(const dfm_joint_def &def) {
  const dWorldID w = engine_.world;
  dBodyID first = members_[def.body].body;
  dBodyID second = def.with == DFM_RIGID_WORLD ? nullptr : members_[def.with].body;
  Joint &joint = joints_.emplace_back();
  joint = {nullptr, def.type, def.body, def.with, !first, {}, {}, {}, {}, {}, {}};
  const double length = norm(load(def.axis));
  const Vec anchor = load(def.anchor), axis = length > 0 ? (1 / length) * load(def.axis) : Vec{0, 0, 1};
  const Pose body = pose_of(def.body, given_.data()), with = pose_of(def.with, given_.data());
  joint.anchor_body = rotate(conjugate(body.rotation), anchor - body.position);
  joint.axis_body = rotate(conjugate(body.rotation), axis);
  joint.anchor_with = rotate(conjugate(with.rotation), anchor - with.position);
  joint.axis_with = rotate(conjugate(with.rotation), axis);
  joint.turn = conjugate(with.rotation) * body.rotation;
  if (!first) std::swap(first, second);
  if (!first) return;
  dJointID &j = joint.id;
  switch (def.type) {
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
  dJointSetFeedback(j, &joint.feedback);
}

template <class F>
void OwnWorld::call(F &&f) {
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

// What ODE can be given: where a double still resolves a contact (1e-7 m at the bound), and far from where
// its squares overflow.
constexpr double kReach = 1e9, kFast = 1e9;  // m; m/s and rad/s

void check(const dfm_rigid_state &s, uint32_t number, const char *when) {
  const Quat q{s.rotation[0], s.rotation[1], s.rotation[2], s.rotation[3]};
  const double turn = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
  const auto within = [](const double *x, double most) {
    return std::fabs(x[0]) <= most && std::fabs(x[1]) <= most && std::fabs(x[2]) <= most;
  };
  if (within(s.position, kReach) && within(s.velocity, kFast) && within(s.spin, kFast) && turn > 0.5 &&
      turn < 2)
    return;
  throw Refused{failed(
      DFM_E_DIVERGED,
      "host \"ode\": rigid body %u (counted from 0) is %s at (%g, %g, %g) m with (%g, %g, %g) m/s and (%g, "
      "%g, %g) rad/s; ODE is given bodies within %g m, %g m/s and %g rad/s, turned by unit quaternions",
      number, when, s.position[0], s.position[1], s.position[2], s.velocity[0], s.velocity[1], s.velocity[2],
      s.spin[0], s.spin[1], s.spin[2], kReach, kFast, kFast)};
}

OwnWorld::OwnWorld(const dfm_rigid_set_def &set, uint32_t *group) {
  call([&] { build(set, group); });
}

void OwnWorld::build(const dfm_rigid_set_def &set, uint32_t *group) {
  dInitODE2(0);
  engine_.world = dWorldCreate();
  space_ = dHashSpaceCreate(nullptr);
  engine_.spaces = {space_};
  engine_.contacts = dJointGroupCreate(0);
  near_.world = engine_.world;
  near_.group = engine_.contacts;
  engine_.friction = &near_;
  engine_.near_callback = near_callback;
  engine_.near_data = &near_;
  members_.resize(set.nbody);
  given_.resize(set.nbody);
  for (uint32_t i = 0; i < set.nbody; ++i) {
    const dfm_rigid_def &def = *dfm_rigid_set_body(&set, i);
    given_[i] = state_of(def);
    check(given_[i], i, "made");
    add_body(def, i);
    group[i] = members_[i].body ? static_cast<uint32_t>(moving_.size()) : DFM_RIGID_STILL;
    if (members_[i].body) moving_.push_back(i);
  }
  joints_.reserve(set.njoint);  // ODE keeps the address of each feedback
  for (uint32_t k = 0; k < set.njoint; ++k) add_joint(*dfm_rigid_set_joint(&set, k));
  engine_.begin({});
}

OwnWorld::~OwnWorld() {
  // ODE left its world locked and half stepped: destroying it would end the process
  if (!broken_.empty()) return;
  engine_.end();
  dJointGroupDestroy(engine_.contacts);
  dSpaceDestroy(space_);
  dWorldDestroy(engine_.world);
}

void OwnWorld::drive(const Joint &j, const double *extra) {
  if (!j.id) return;
  const double velocity = j.sign() * extra[0];
  if (j.type == DFM_JOINT_HINGE) {
    dJointSetHingeParam(j.id, dParamVel, velocity);
    dJointSetHingeParam(j.id, dParamFMax, extra[1]);
  }
  if (j.type == DFM_JOINT_SLIDER) {
    dJointSetSliderParam(j.id, dParamVel, velocity);
    dJointSetSliderParam(j.id, dParamFMax, extra[1]);
  }
}

// What the joint did along its own axis in the sub-step that began at `state` is the motor's doing: alone it
// is free there. A hinge's is the moment about its anchor, where what the hinge holds with has none.
double OwnWorld::effort(const Joint &j, const dfm_rigid_state *state) {
  if (!j.id) return 0;
  const Quat q = pose_of(j.swapped ? j.with : j.body, state).rotation;
  const Vec axis = rotate(q, j.swapped ? j.axis_with : j.axis_body);
  const Vec arm = rotate(q, j.swapped ? j.anchor_with : j.anchor_body);
  const Vec force = load(j.feedback.f1);
  return j.sign() * dot(axis, j.type == DFM_JOINT_HINGE ? load(j.feedback.t1) - cross(arm, force) : force);
}

dfm_status OwnWorld::predict(const dfm_rigid_step &step, double *velocity) {
  for (const uint32_t i : moving_) check(step.state[i], i, "now");
  for (int k = 0; k < 3; ++k)
    if (!(std::fabs(step.gravity[k] * step.h) <= kFast))
      throw Refused{
          failed(DFM_E_DIVERGED,
                 "host \"ode\": gravity of %g m/s2 changes speeds by more than %g m/s in a sub-step of %g s",
                 step.gravity[k], kFast, step.h)};
  call([&] { predict_all(step, velocity); });
  return DFM_OK;
}

void OwnWorld::predict_all(const dfm_rigid_step &step, double *velocity) {
  dWorldSetGravity(engine_.world, step.gravity[0], step.gravity[1], step.gravity[2]);
  for (size_t k = 0; k < joints_.size(); ++k) drive(joints_[k], step.extra + first_joint() + kMotor * k);
  for (const uint32_t i : moving_)
    if (std::memcmp(&given_[i], &step.state[i], sizeof given_[i]) != 0) engine_.reopen();
  if (!engine_.is_open())
    for (const uint32_t i : moving_) {
      members_[i].put(step.state[i]);
      given_[i] = step.state[i];
    }
  for (const uint32_t i : moving_) engine_.predict(members_[i], step, i, velocity + 6 * size_t{i});
}

void OwnWorld::push(const dfm_rigid_step &, const double *impulse) {
  for (const uint32_t i : moving_) engine_.push(members_[i], impulse + 6 * size_t{i});
}

bool OwnWorld::commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) {
  bool again = false;
  std::memcpy(extra, step.extra, sizeof(double) * this->extra());
  std::memcpy(state, step.state, sizeof(dfm_rigid_state) * members_.size());
  call([&] {
    for (const uint32_t i : moving_) again |= engine_.commit(members_[i], i, state, extra, step.h);
  });
  for (const uint32_t i : moving_) check(state[i], i, "after the step");
  for (size_t k = 0; k < joints_.size(); ++k)
    extra[first_joint() + kMotor * k + 2] = effort(joints_[k], step.state);
  // Asked for another round, the engine goes back by itself; the world then gives the same start
  // state as before.
  for (const uint32_t i : moving_)
    if (!again) given_[i] = state[i];
  return again;
}

dfm_status OwnWorld::set_motor(uint32_t joint, double velocity, double max, double *extra) {
  if (joint >= joints_.size() || joints_[joint].type > DFM_JOINT_SLIDER) return DFM_E_ARG;
  double *const motor = extra + first_joint() + kMotor * joint;
  motor[0] = velocity;
  motor[1] = max;
  return DFM_OK;
}

// From what the world has, not from ODE's joint, which after a restore is still where it was.
dfm_status OwnWorld::joint(const dfm_rigid_state *state, const double *extra, uint32_t joint,
                           double *position, double *rate, double *effort) {
  if (joint >= joints_.size() || joints_[joint].type > DFM_JOINT_SLIDER) return DFM_E_ARG;
  const Joint &j = joints_[joint];
  const Pose a = pose_of(j.body, state), b = pose_of(j.with, state);
  const Motion of_a = motion_of(j.body, state), of_b = motion_of(j.with, state);
  const Vec axis = rotate(b.rotation, j.axis_with);
  if (j.type == DFM_JOINT_HINGE) {
    *position = dot(turn_of(a.rotation * conjugate(b.rotation * j.turn)), axis);
    *rate = dot(of_a.w - of_b.w, axis);
  } else {
    const Vec arm = rotate(a.rotation, j.anchor_body), place = a.position + arm;
    *position = dot(place - b.position - rotate(b.rotation, j.anchor_with), axis);
    *rate = dot(of_a.v + cross(of_a.w, arm) - of_b.v - cross(of_b.w, place - b.position), axis);
  }
  *effort = extra[first_joint() + kMotor * joint + 2];
  return DFM_OK;
}

}  // namespace

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra) {
  auto *const own = new OwnWorld(set, group);
  *self = static_cast<Host *>(own);
  *nextra = own->extra();
  return DFM_OK;
}

}  // namespace dfm_ode_detail
