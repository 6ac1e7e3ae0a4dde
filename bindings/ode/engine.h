// A dWorldID inside the contact solve (rigid_host/engine.h).
//
// Auto-disable is counted here by ODE's rule, without repeated sub-steps: ODE's own counters continue through
// corrections and cannot be read. Its count of steps is one of the caller's steps: in ten short sub-steps a
// body that begins to fall would not yet be faster than the idle speed. For the same reason ODE corrects per
// caller's step: its share of a depth per sub-step would be a speed that grows as sub-steps get shorter.
// Bodies that ODE would wake in its step because they are connected to an awake body are woken before the
// solve, which would otherwise push bodies at rest.
//
// ODE's gyroscopic terms keep angular momentum to first order only, so its step runs without them. The shared
// engine turns free bodies. For jointed bodies ODE solves I(q0) (w1 - w0) = impulses, and then w =
// I(q1)^-1 I(q0) w1. A joint acts at two anchors whose distance is its error; the couple that results is
// taken back from both of its bodies.
#pragma once
#include <functional>
#include <ode/ode.h>

#include <array>
#include <unordered_map>
#include <vector>

#include "near.h"
#include "rigid_host/engine.h"

namespace dfm_ode_detail {

using namespace dfm_rigid_detail;

inline Quat from_ode(const dReal *q) { return {q[1], q[2], q[3], q[0]}; }
inline void to_ode(Quat q, dQuaternion out) {
  out[0] = q.w;
  out[1] = q.x;
  out[2] = q.y;
  out[3] = q.z;
}
Inertia inertia_of(dBodyID body);

class OdeEngine;

struct OdeMember : Member {
  dBodyID body = nullptr;
  size_t saved = 0;        // where the engine keeps it
  bool has_ended = false;  // `ended` is the state in ODE

  dfm_rigid_state state() const override;
  const dfm_rigid_state &end() override;
  void mark() override;
  bool stays() const override;
  void put(const dfm_rigid_state &s) override;
  bool enabled() const override { return dBodyIsEnabled(body); }
  Facts facts() const override;
  std::array<double, 2> idle_limits() const override {
    return {dBodyGetAutoDisableLinearThreshold(body), dBodyGetAutoDisableAngularThreshold(body)};
  }

 private:
  std::array<dReal, 13> marked_{};  // position, quaternion, velocity, spin, as ODE has them
  std::array<dReal, 13> now() const;
};

class OdeEngine : public Engine {
 public:
  dWorldID world = nullptr;
  bool quick = false;
  // s, the caller's step, by which ODE's world is set up: a step of ODE's, for its auto-disable and its
  // correction of errors; 0: each sub-step is one
  double callers_step = 0;
  dJointGroupID contacts = nullptr;
  std::vector<dSpaceID> spaces;  // at the start of each sub-step the geoms of each space are collided
  dNearCallback *near_callback = nullptr;
  void *near_data = nullptr;
  std::function<void()> collided = [] {};  // after these collisions
  RigidFriction *friction = nullptr;

  void gather(const std::vector<dBodyID> &bodies_without_geoms);  // before begin()
  using Idle = std::array<double, 2>;                             // caller's steps, s
  // of one without geoms, between steps; what members count is in their `extra`
  Idle idle(dBodyID body) const;
  void set_idle(dBodyID body, Idle idle) { idle_[body] = idle; }
  // N, N m: forces of the caller
  const auto &carried(const OdeMember &m) const { return saved_[m.saved]; }

 protected:
  void prepare(const dfm_rigid_step &step) override;
  void restore(bool given) override;
  void keep_first() override { first_ = saved_; }
  void take_first() override { saved_.swap(first_); }
  void take(Member &m, const dfm_rigid_state &given, const double *extra) override;
  void put_forces(double h) override;
  void run(double h) override;
  void turned(Member &m, Quat to, Vec spin) override;
  void rest(double h) override;
  void restore_forces() override;
  void close() override;
  void ended() override;

 private:
  struct Saved {
    dBodyID body;
    Vec force, torque, position, v, w;
    Quat rotation;
    bool enabled, given;  // for this sub-step; as it was given
    bool gyroscopic;      // as the caller has it
    Inertia inertia;
    Idle idle{}, next_idle{};  // of bodies without geoms
  };
  class Lent;
  // a, b: in saved_
  struct Tie {
    dJointID joint;
    size_t a, b;
    dJointFeedback own, *callers;
  };
  std::unordered_map<dBodyID, size_t> number_;  // in saved_
  std::vector<dBodyID> bodies_;                 // of saved_, when number_ was made
  std::vector<Tie> ties_;                       // joints between two bodies that move, but for contacts
  // every body known: members in their order, then bodies without geoms
  std::vector<Saved> saved_, first_;
  std::unordered_map<dBodyID, Idle> idle_;
  std::vector<Vec> turn_;  // per body of saved_, N m s

  double share_of_step(double h) const { return callers_step > h ? h / callers_step : 1; }
  OdeMember &member(size_t i) const { return *static_cast<OdeMember *>(members[i]); }
  void turn_jointed(double h);
  void find_ties();
  void pull_awake();
  // along joints that hold; reach: whether to continue from a body
  template <class F>
  void flood(std::vector<size_t> from, F &&reach);
};

}  // namespace dfm_ode_detail
