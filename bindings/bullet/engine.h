// A btDiscreteDynamicsWorld inside the contact solve (rigid_host/engine.h). A sub-step is one tick of Bullet,
// run by its stages: collision once, constraints and integration as often as contact is solved.
//
// Bodies move in double precision whatever btScalar is: the dfm_world has their states, Bullet gets them
// rounded, and what its constraints change of a velocity is added to the unrounded one. A body without
// constraints ends where the solve has it, to the bit. What Bullet moves beside its velocities (split
// impulses, continuous collision) is seen as the rest of its motion, where that is above rounding.
//
// Bodies fall asleep by Bullet's rules: islands and gDeactivationTime. Its thresholds (0.8 m/s) are made for
// heaps of rigid bodies: here a sleeping body wakes at kIdleSpeed and kIdleSpin, and a faster body that soft
// bodies touch does not fall asleep.
//
// Bullet's gyroscopic terms are switched off during its solve; see ode/engine.h.
#pragma once
#include <functional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "multi_state.h"

namespace dfm_bullet_detail {

class BulletEngine;

// Pose and velocity of a body of Bullet, to the bit.
struct Stand {
  btTransform transform;
  btVector3 v, w;
  bool known = false;
  void take(const btRigidBody &body);
  bool holds(const btTransform &t, const btVector3 &v_now, const btVector3 &w_now) const;
};

// What all kinds of members share.
struct AnyMember : Member {
  explicit AnyMember(bool of_multibody) : is_link(of_multibody) {}
  const bool is_link;
};

struct BulletMember : AnyMember {
  BulletMember() : AnyMember(false) {}
  btRigidBody *body = nullptr;
  bool touched = false;    // by a constraint or contact of Bullet's in this sub-step
  size_t saved = 0;        // where the engine keeps it
  Stand last_put, marked;  // last_put: what was put into Bullet, as Bullet stores it
  dfm_rigid_state put_state{};

  dfm_rigid_state state() const override;
  void mark() override;
  bool stays() const override;
  void put(const dfm_rigid_state &s) override;
  const dfm_rigid_state &end() override { return ended; }
  bool enabled() const override { return body->isActive(); }
  Facts facts() const override;
  std::array<double, 2> idle_limits() const override;
  void read();  // mass, moments, axes that are free
};

// A link of a multibody, or its base (-1). In the solve it is like a body with constraints: its own mass, and
// the last effect of its joints.
struct LinkMember : AnyMember {
  LinkMember() : AnyMember(true) {}
  btMultiBody *body = nullptr;
  const btMultiBodyLinkCollider *collider = nullptr;
  int link = -1;

  dfm_rigid_state state() const override;
  void put(const dfm_rigid_state &) override {}  // its joints determine its place
  const dfm_rigid_state &end() override { return ended; }
  bool enabled() const override { return body->isAwake(); }
  Facts facts() const override;
  std::array<double, 2> idle_limits() const override;
  void read();
  void push(Vec force, Vec torque);  // N, N m
};

class BulletEngine : public Engine {
 public:
  btDiscreteDynamicsWorld *world = nullptr;
  // s, a tick of the caller's, by which Bullet's world is set up: it corrects errors by a share per tick,
  // which per sub-step would be a speed that grows as sub-steps get shorter; 0: each sub-step is one
  double callers_step = 0;
  bool falls = false;  // every body under `gravity`, which is not in its forces
  Vec gravity;
  std::function<void()> collided = [] {};  // between Bullet's collision and its islands

  void gather();  // before begin()

 protected:
  void prepare(const dfm_rigid_step &step) override;
  void restore(bool given) override;
  void keep_first() override {
    first_ = saved_;
    first_multi_ = multi_;
  }
  void take_first() override {
    saved_.swap(first_);
    multi_ = first_multi_;
  }
  void take(Member &m, const dfm_rigid_state &given, const double *extra) override;
  void put_forces(double h) override;
  void run(double h) override;
  void turned(Member &m, Quat to, Vec spin) override;
  void rest(double h) override;
  void restore_forces() override {}  // forces were never taken from the bodies
  void close() override {}

 private:
  struct Saved {
    btRigidBody *body = nullptr;
    btTransform transform;
    btVector3 v, w;
    btVector3 damped_v, damped_w;    // by Bullet's predictUnconstraintMotion
    int activation = 0, given = 0;   // for this sub-step; as it was given
    btScalar idle = 0;               // s
    BulletMember *member = nullptr;  // null: soft bodies do not touch it
    bool touched = false;
  };
  std::unordered_map<const btCollisionObject *, size_t> number_;  // in saved_
  std::vector<Member *> gathered_;                                // members when that was made
  std::vector<std::pair<const btRigidBody *, bool>> listed_;      // the world's bodies then; may they move?
  std::vector<int> flags_;                                        // of saved_ bodies, while the engine steps
  std::vector<std::pair<btVector3, btVector3>> before_actions_;
  MultiState multi_, first_multi_;
  double predicted_ = 0;      // s: damped_v and damped_w are v and w after this time; 0: they are not known
  bool has_islands_ = false;  // Bullet's islands are up to date, but not sorted yet
  std::vector<Saved> saved_, first_;  // every body that may move, members first

  std::vector<BulletMember *> bodies_;  // of members
  std::vector<LinkMember *> links_;
  bool is_gathered();
  static void take_damping_back(Saved &s);
  void predict_again(double h);
  void find_touched();
  void pull_awake();
  void finish(BulletMember &m, double h);
};

}  // namespace dfm_bullet_detail
