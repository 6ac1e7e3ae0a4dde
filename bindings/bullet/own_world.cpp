#include "own_world.h"

#include <BulletDynamics/ConstraintSolver/btGeneric6DofSpring2Constraint.h>
#include <BulletDynamics/MLCPSolvers/btDantzigSolver.h>
#include <BulletDynamics/MLCPSolvers/btMLCPSolver.h>

#include <memory>

#include "engine.h"
#include "own_contacts.h"
#include "rigid_host/own_world.h"

namespace dfm_bullet_detail {
namespace {

// Bullet multiplies the coefficients of two bodies: together 0.5, as on host "ode".
constexpr double kFriction = 0.70710678118654752440;

class BulletWorld : public OwnWorld {
 public:
  explicit BulletWorld(const dfm_rigid_set_def &set);
  ~BulletWorld() override;
  BulletWorld(const BulletWorld &) = delete;
  BulletWorld &operator=(const BulletWorld &) = delete;
  // apart from the constructor, so that the destructor empties Bullet's world when the set is refused
  void make(const dfm_rigid_set_def &set, uint32_t *group);

 protected:
  Member *make_body(const dfm_rigid_def &def, uint32_t number) override;
  void make_joint(const Joint &joint, size_t number) override;
  void set_gravity(const double g[3]) override;
  uint32_t memory() const override { return contacts_.room(); }
  void remember(double *out, bool last) override { contacts_.write(out, last); }
  bool remembers(const double *in) const override { return contacts_.are_of_now(in); }
  void recall(const double *in) override { contacts_.restore(in); }
  void set_correction(double share) override {
    world_.getSolverInfo().m_erp = world_.getSolverInfo().m_erp2 = btScalar(share);
  }
  void drive(size_t joint, double velocity, double max, double h) override;
  Wrench wrench(size_t joint) const override {
    const btJointFeedback &f = ties_[joint].feedback;
    return {from_bullet(f.m_appliedForceBodyA), from_bullet(f.m_appliedTorqueBodyA)};
  }

 private:
  struct Body {
    std::unique_ptr<btCollisionShape> shape;
    std::unique_ptr<btRigidBody> body;
    BulletMember member;
  };
  struct Tie {
    std::unique_ptr<btTypedConstraint> constraint;
    btJointFeedback feedback{};
    int axis = 0;  // of a slider
  };
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  OverlapsOfNow broadphase_;
  // Direct, as dWorldStep: the error that sweeps leave is drift, which grows with chains and mass ratios.
  btDantzigSolver direct_;
  btMLCPSolver solver_;
  btDiscreteDynamicsWorld world_;
  BulletEngine engine_;
  std::vector<Body> bodies_;  // by number in the set
  std::vector<Tie> ties_;
  OwnContacts contacts_;
  btRigidBody anchor_;  // the world, for joints to it

  btRigidBody &body(uint32_t number) { return number == DFM_RIGID_WORLD ? anchor_ : *bodies_[number].body; }
};

std::unique_ptr<btCollisionShape> shape_of(const dfm_rigid_def &def) {
  const double *const a = def.half_size;
  if (def.shape == DFM_SHAPE_SPHERE) return std::make_unique<btSphereShape>(btScalar(def.radius));
  if (def.shape == DFM_SHAPE_BOX) return std::make_unique<btBoxShape>(to_bullet(Vec{a[0], a[1], a[2]}));
  if (def.shape == DFM_SHAPE_CAPSULE)
    return std::make_unique<btCapsuleShapeZ>(btScalar(def.radius), btScalar(2 * def.half_length));
  return std::make_unique<btEmptyShape>();
}

// Number of bodies with a shape that move, or that are fixed.
uint32_t touching(const dfm_rigid_set_def &set, uint32_t fixed) {
  uint32_t n = 0;
  for (uint32_t i = 0; i < set.nbody; ++i) {
    const dfm_rigid_def &def = *dfm_rigid_set_body(&set, i);
    n += def.shape != DFM_SHAPE_NONE && (def.fixed != 0) == (fixed != 0);
  }
  return n;
}

BulletWorld::BulletWorld(const dfm_rigid_set_def &set)
    : OwnWorld(bullet_kind().host, engine_),
      dispatcher_(&configuration_),
      broadphase_(static_cast<int>(set.nbody)),
      solver_(&direct_),
      world_(&dispatcher_, &broadphase_, &solver_, &configuration_),
      bodies_(set.nbody),
      ties_(set.njoint),
      contacts_(dispatcher_, touching(set, 0), touching(set, 1)),
      anchor_(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, nullptr)) {
  engine_.world = &world_;
  engine_.falls = true;
  engine_.collided = [this] { contacts_.collided(world_); };
}

void BulletWorld::make(const dfm_rigid_set_def &set, uint32_t *group) {
  build(set, group);
  engine_.gather();
  engine_.begin(0);
}

BulletWorld::~BulletWorld() {
  engine_.end();
  for (const Tie &t : ties_)
    if (t.constraint) world_.removeConstraint(t.constraint.get());
  for (const Body &b : bodies_)
    if (b.body) world_.removeRigidBody(b.body.get());
}

Member *BulletWorld::make_body(const dfm_rigid_def &def, uint32_t number) {
  Body &b = bodies_[number];
  b.shape = shape_of(def);
  const double mass = def.fixed ? 0 : def.mass;
  const btVector3 inertia = def.fixed ? btVector3(0, 0, 0) : to_bullet(load(def.inertia));
  b.body = std::make_unique<btRigidBody>(
      btRigidBody::btRigidBodyConstructionInfo(btScalar(mass), nullptr, b.shape.get(), inertia));
  b.body->setCenterOfMassTransform(
      to_bullet(Pose{load(def.pose.position), unit(load_quat(def.pose.rotation))}));
  b.body->setFriction(btScalar(kFriction));
  b.body->setActivationState(DISABLE_DEACTIVATION);
  b.body->setUserIndex(static_cast<int>(number));
  world_.addRigidBody(b.body.get(), static_cast<int>(def.category), static_cast<int>(def.collides_with));
  if (def.shape == DFM_SHAPE_NONE)
    b.body->setCollisionFlags(b.body->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  if (def.fixed) return nullptr;
  b.member.body = b.body.get();
  b.member.read();
  // as the def has them, not rounded
  b.member.inertia.mass = def.mass;
  b.member.inertia.moments = load(def.inertia);
  return &b.member;
}

void BulletWorld::set_gravity(const double g[3]) {
  engine_.gravity = load(g);
  for (Body &b : bodies_) {
    if (!b.member.body) continue;
    b.body->clearForces();
    b.body->applyCentralForce(to_bullet(b.member.inertia.mass * engine_.gravity));
  }
}

// Frames at the anchor with their axis along x (hinge: z), in both bodies.
void BulletWorld::make_joint(const Joint &joint, size_t number) {
  btRigidBody &a = body(joint.first()), &b = body(joint.second());
  const int axis = joint.type == DFM_JOINT_HINGE ? 2 : 0;
  const Vec along = axis == 2 ? Vec{0, 0, 1} : Vec{1, 0, 0}, half = joint.axis + along;
  const Vec turned_half = cross(along, joint.axis);
  const Quat q = dot(half, half) > 1e-12
                     ? unit({turned_half.x, turned_half.y, turned_half.z, 1 + dot(along, joint.axis)})
                     : Quat{0, 1, 0, 0};
  const Pose frame{joint.anchor, q};
  const auto in = [&](const btRigidBody &body) {
    return to_bullet(inverse(from_bullet(body.getWorldTransform())) * frame);
  };
  Tie &t = ties_[number];
  if (joint.type == DFM_JOINT_HINGE) {
    t.constraint = std::make_unique<btHingeConstraint>(a, b, in(a), in(b));
  } else if (joint.type == DFM_JOINT_BALL) {
    t.constraint = std::make_unique<btPoint2PointConstraint>(a, b, in(a).getOrigin(), in(b).getOrigin());
  } else {
    auto six = std::make_unique<btGeneric6DofSpring2Constraint>(a, b, in(a), in(b));
    for (int k = 0; k < 6; ++k) six->setLimit(k, 0, 0);
    if (joint.type == DFM_JOINT_SLIDER) six->setLimit(0, 1, -1);  // free along x
    t.constraint = std::move(six);
  }
  t.constraint->setJointFeedback(&t.feedback);
  world_.addConstraint(t.constraint.get(), true);  // joined bodies do not collide
}

void BulletWorld::drive(size_t number, double velocity, double max, double h) {
  btTypedConstraint *const c = ties_[number].constraint.get();
  if (joints()[number].type == DFM_JOINT_HINGE) {
    static_cast<btHingeConstraint *>(c)->enableAngularMotor(max > 0, btScalar(velocity), btScalar(max * h));
    return;
  }
  auto *const six = static_cast<btGeneric6DofSpring2Constraint *>(c);
  six->enableMotor(0, max > 0);
  six->setTargetVelocity(0, btScalar(velocity));
  six->setMaxMotorForce(0, btScalar(max));
}

}  // namespace

dfm_status create_own_world(const dfm_rigid_set_def &set, void **self, uint32_t *group, uint32_t *nextra) {
  auto own = std::make_unique<BulletWorld>(set);
  own->make(set, group);
  *nextra = own->extra();
  *self = static_cast<Host *>(own.release());
  return DFM_OK;
}

}  // namespace dfm_bullet_detail
