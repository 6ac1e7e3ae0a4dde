// A dWorldID inside the contact solve: what its bodies would do in a sub-step, how they answer impulses, and
// where ODE puts them with these.
//
//   predict   free body      v = v0 + h (F/m + g); mean spin of constant angular momentum + h T
//             jointed body   v = v0 + h (F/m + g + b), w alike: b is what ODE's constraints added in the last
//                            sub-step beside the answer to contact
//   respond   M^-1 of the body alone; 0 for kinematic bodies and those that are disabled
//   commit    dWorldStep with the impulses as forces p / h, which changes v by M^-1 p exactly. b for the next
//             sub-step is what v differs by from v0 + h (F/m + g) + M^-1 p. Where contact changed a jointed
//             body otherwise than foreseen by more than kResidual, the bodies are put back, contact is solved
//             again with the new b, and ODE steps once more; again, where a motor or a joint acts so suddenly
//             that once is not enough.
//
// A disabled body stands still in the solve; when it fell asleep all forces on it were in balance. Would it,
// with what contact has changed since, move faster by now than ODE lets bodies that are idle, it wakes, and
// contact is solved again with its mass. Changes are forgotten within kForget. Auto-disable is counted here,
// in sub-steps that count, by ODE's rule: ODE's own counters run on through corrections and cannot be read.
// And what ODE would wake in its step because it hangs on something awake is woken before the solve, which
// else would push what stands still.
//
// Angular momentum: ODE's gyroscopic terms keep it to first order only. Bodies that have them on are turned
// here instead: free ones by the midpoint Lie scheme (Krysl 2005), and of jointed ones ODE solves I(q0) (w1 -
// w0) = impulses without these terms, after which w = I(q1)^-1 I(q0) w1. What a joint does at two anchors
// that stand apart by its error is a couple; it is taken back from both of its bodies.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <unordered_map>
#include <vector>

#include "deform/ode.h"
#include "near.h"
#include "rigid_math.h"

namespace dfm_ode_detail {

struct Motion { Vec v, w; };  // m/s, rad/s; or N s, N m s

// Mass, principal moments and their axes in the body's frame.
struct Inertia {
  double mass = 0;
  Vec moments{1, 1, 1};
  Quat axes;
};
Inertia inertia_of(dBodyID body);

class Engine;

// A body that soft bodies may touch. Its state, to the world, is that of its principal axes.
struct Member {
  enum Kind : uint8_t { free, jointed, still };
  // values of a host's `extra`: b (6, m/s2 and rad/s2); awake: wrench of contact (6, N and N m), asleep:
  // drift (6, m/s and rad/s); not 0: asleep; idle for how many sub-steps, s
  static constexpr uint32_t kExtra = 15;
  bool restored = false;  // its state comes from a snapshot, with whether it sleeps
  Engine *engine = nullptr;
  dBodyID body = nullptr;
  Inertia inertia;
  size_t saved = 0;  // where the engine keeps it

  // Of this sub-step.
  Kind kind = still;
  bool turns = false;   // its turn is computed here
  bool asleep = false;  // disabled in ODE
  bool wakes = false;   // contact wakes it
  bool pulled = false;  // a joint or contact of ODE has woken it
  dfm_rigid_state start{};
  Motion plain, used;      // without constraints and contact; as predicted
  Motion bias, next_bias;  // b
  Vec turn_momentum;       // angular, at the start plus h T
  Motion impulse;
  Motion drift;                               // of one that sleeps: what it would move at by now
  std::array<double, 2> idle{}, next_idle{};  // sub-steps, s

  dfm_rigid_state state() const;               // of `body` now
  void put(const dfm_rigid_state &s);          // into ODE
  Motion answer(const Motion &impulse) const;  // M^-1 p at the start
};

class Engine {
 public:
  dWorldID world = nullptr;
  bool quick = false;
  bool in_step = false;  // members may be asked
  dJointGroupID contacts = nullptr;
  std::vector<dSpaceID> spaces;  // collided at the start of each sub-step, each in itself
  dNearCallback *near_callback = nullptr;
  void *near_data = nullptr;
  RigidFriction *friction = nullptr;
  std::vector<Member *> members;  // of all sets

  uint64_t steps = 0, corrections = 0;
  double residual = 0, residual_max = 0, ode_seconds = 0;

  // Around a dfm_ode_step: forces that the caller put on bodies act over all of it. time: the dfm_world's, s.
  // A sub-step that it has not got past when all ends has failed, and ODE goes back to where that began;
  // where it was the first one, the caller's forces are on the bodies again.
  void begin(const std::vector<dBodyID> &bodies_without_geoms, double time = 0);
  void end(double time = std::numeric_limits<double>::quiet_NaN());
  void forget(Member *member);

  void predict(Member &m, const dfm_rigid_step &step, uint32_t number, double *velocity);
  void respond(const Member &m, double matrix[36]) const;
  void push(Member &m, const double *impulse);
  // True: solve again.
  bool commit(Member &m, uint32_t number, dfm_rigid_state *state, double *extra, double h);
  using Idle = std::array<double, 2>;  // sub-steps, s
  // of one without geoms, between steps; what members count is in their `extra`
  Idle idle(dBodyID body) const;
  void set_idle(dBodyID body, Idle idle) { idle_[body] = idle; }
  // states have been put into ODE from outside: the next predict begins anew
  void reopen() { open_ = false; }
  bool is_open() const { return open_; }

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
  std::vector<Tie> ties_;                       // joints between two bodies that move, but for contacts
  // every body known: members in their order, then bodies without geoms
  std::vector<Saved> saved_;
  std::unordered_map<dBodyID, Idle> idle_;
  std::vector<Vec> turn_;  // per body of saved_, N m s
  bool open_ = false, stepped_ = false, dirty_ = false, again_ = false;
  int rounds_ = 0;  // corrections of this sub-step
  double t_ = 0, h_ = 0, begun_ = 0;

  void open(const dfm_rigid_step &step);
  void restore();
  void close();
  void take(Member &m, const dfm_rigid_state &given, const double *extra);
  void classify(Member &m, const dfm_rigid_step &step, const double *extra);
  void advance(double h);
  void turn_free(double h);
  void turn_jointed(double h);
  void find_ties();
  bool wake_sleepers(double h);
  void pull_awake();
  void fall_asleep(double h);
  // along joints that hold; reach: goes on from there?
  template <class F>
  void flood(std::vector<size_t> from, F &&reach);
  double judge(Member &m, double h);
};

}  // namespace dfm_ode_detail
