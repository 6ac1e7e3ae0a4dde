// Bodies of a physics engine inside the contact solve: what they would do in a sub-step, how they answer
// impulses, and where the engine puts them with these. An adapter derives from Engine and Member.
//
//   predict   free body      v = v0 + h (F/m + g); mean spin of constant angular momentum + h T
//             jointed body   v = v0 + h (F/m + g + b), w alike: b is what the engine's constraints added in
//                            the last sub-step beside the answer to contact
//   respond   M^-1 of the body alone; 0 for kinematic bodies and those that sleep
//   commit    the engine's step, in which the impulses change v by M^-1 p exactly. b for the next sub-step is
//             what v differs by from v0 + h (F/m + g) + M^-1 p. Where contact changed a jointed body
//             otherwise than foreseen by more than kResidual, the bodies are put back, contact is solved
//             again with the new b, and the engine steps once more; more often if a motor or a joint acts so
//             suddenly that once is not enough.
//
// A sleeping body does not move in the solve; when it fell asleep all forces on it were in balance. If the
// changes of its contact forces since then would make it move faster than an idle body, it wakes, and contact
// is solved again with its mass. Changes decay within kForget.
//
// Angular momentum: engines keep it to first order only. Free bodies are turned here instead, by the midpoint
// Lie scheme (Krysl 2005).
#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <limits>
#include <vector>

#include "deform/deform.h"
#include "rigid_math.h"

namespace dfm_rigid_detail {

struct Motion { Vec v, w; };  // m/s, rad/s; or N s, N m s

// Principal moments and their axes in the body's frame, of a symmetric matrix.
struct Inertia {
  double mass = 0;
  Vec moments{1, 1, 1};
  Quat axes;
};
Inertia inertia_of(double mass, const double tensor[3][3]);

Quat rotation_of(const dfm_rigid_state &s);
dfm_rigid_state state_of(Vec position, Quat rotation, Vec velocity, Vec spin);
bool same(const dfm_rigid_state &a, const dfm_rigid_state &b);  // to the bit
// From the frame of a body to that of its principal axes.
Pose in_principal_frame(const Inertia &inertia, const Pose &in_body);

class Engine;

// What acts on a body in the sub-step that begins.
struct Facts {
  bool enabled = true, kinematic = false;
  bool plain = true;  // no joint, contact or damping of the engine's
  bool turns = true;  // if plain: turned here
  Vec force, torque;  // of the caller, N and N m
  Vec gravity;        // m/s2
};

// A body that soft bodies may touch. Its state, to the world, is that of its principal axes.
struct Member {
  enum Kind : uint8_t { free, jointed, still };
  // values of a host's `extra`: b (6, m/s2 and rad/s2); awake: wrench of contact (6, N and N m), asleep:
  // drift (6, m/s and rad/s); not 0: asleep; idle for how many sub-steps, s
  static constexpr uint32_t kExtra = 15;
  bool restored = false;  // its state comes from a snapshot, with whether it sleeps
  Engine *engine = nullptr;
  Inertia inertia;
  // Axes along and about which it may move (1) or not (0), in the world's frame.
  Vec moves_along{1, 1, 1}, turns_about{1, 1, 1};

  // In this sub-step.
  Kind kind = still;
  bool turns = false;      // its rotation is computed here
  bool asleep = false;     // the engine has it asleep
  bool kinematic = false;  // it follows a given motion
  bool wakes = false;      // contact wakes it
  bool pulled = false;     // a joint or contact of the engine has woken it
  dfm_rigid_state start{};
  Motion plain, used;      // without constraints and contact; as predicted
  Motion bias, next_bias;  // b
  Vec turn_momentum;       // angular, at the start plus h T
  Motion impulse;
  dfm_rigid_state ended{};
  Motion drifted, drift;                      // of a sleeping body: the velocity that it would have had, has
  std::array<double, 2> idle{}, next_idle{};  // sub-steps, s

  virtual ~Member() = default;
  virtual dfm_rigid_state state() const = 0;                        // as the engine has it now
  virtual void put(const dfm_rigid_state &s) = 0;                   // into the engine
  virtual const dfm_rigid_state &end() { return ended = state(); }  // after the engine's step
  // Is the engine's body where it was at the last mark(), to the bit?
  virtual void mark() { marked_ = state(); }
  virtual bool stays() const { return same(state(), marked_); }
  virtual bool enabled() const = 0;
  virtual Facts facts() const = 0;
  virtual std::array<double, 2> idle_limits() const = 0;  // m/s, rad/s
  Motion response(const Motion &p) const {                // M^-1 p at the start
    return is_none(p.v) && is_none(p.w) ? Motion{} : response_of(p);
  }

 private:
  Motion response_of(const Motion &p) const;
  dfm_rigid_state marked_{};
};

class Engine {
 public:
  bool in_step = false;           // members may be called
  std::vector<Member *> members;  // of all sets

  uint64_t steps = 0, corrections = 0;
  double residual = 0, residual_max = 0, engine_seconds = 0;

  Engine() = default;
  virtual ~Engine() = default;
  Engine(const Engine &) = delete;
  Engine &operator=(const Engine &) = delete;

  // Around a step of the dfm_world: forces that the caller put on bodies act over all of it. time: the
  // dfm_world's, s. A sub-step that it has not got past when all ends has failed, and the engine goes back to
  // where that began, or, with a dfm_world that was interrupted, to where the step began: then the caller's
  // forces are on the bodies again.
  void begin(double time);
  void end(double time = std::numeric_limits<double>::quiet_NaN());
  void forget(Member *member) { std::erase(members, member); }

  void predict(Member &m, const dfm_rigid_step &step, uint32_t number, double *velocity);
  void respond(const Member &m, double matrix[36]) const;
  void push(Member &m, const double *impulse);
  // True: solve again.
  bool commit(Member &m, uint32_t number, dfm_rigid_state *state, double *extra, double h);
  // states have been put into the engine from outside: the next predict starts again
  void reopen() { open_ = false; }
  bool is_open() const { return open_; }

 protected:
  // The sub-step's start is what the engine has now: the last one has been committed or undone.
  virtual void prepare(const dfm_rigid_step &step) = 0;
  // All bodies as they were at the start of the sub-step. given: asleep or awake as before it, too.
  virtual void restore(bool given) = 0;
  // The start of the step: that of the first sub-step, which is over; and it again, for restore(). Friction
  // between the engine's own bodies keeps what the sub-steps left.
  virtual void keep_first() = 0;
  virtual void take_first() = 0;
  // The world's state goes into the engine each time, so that what that does is a function of it to the last
  // bit, also after a restore or where the guard left out a part of the way. Sets m.start.
  virtual void take(Member &m, const dfm_rigid_state &given, const double *extra) = 0;
  virtual void put_forces(double h) = 0;  // of the sub-step; who wakes
  virtual void run(double h) = 0;         // the engine's own step
  // a free body's end, which is computed here: rotation of its principal axes, spin
  virtual void turned(Member &m, Quat to, Vec spin) = 0;
  virtual void rest(double h) = 0;    // who falls asleep after it
  virtual void restore_forces() = 0;  // the caller's forces
  virtual void close() = 0;           // what the engine made for a sub-step goes
  virtual void ended() {}             // all of the step is over
  bool stepped() const { return stepped_; }
  double step_length() const { return h_; }

 private:
  bool open_ = false, stepped_ = false, dirty_ = false, again_ = false;
  int rounds_ = 0;  // corrections of this sub-step
  double t_ = 0, h_ = 0, begun_ = 0;

  void open(const dfm_rigid_step &step);
  void classify(Member &m, const dfm_rigid_step &step, const double *extra);
  void advance(double h);
  void turn_free(double h);
  bool wake_sleepers(double h);
  double judge(Member &m, double h);
};

// The engine's bodies are the solve's while the dfm_world steps, however that ends.
class Stepping {
 public:
  Stepping(Engine &engine, dfm_world world) : engine_(engine), world_(world) {
    engine.begin(dfm_world_time(world));
  }
  ~Stepping() { engine_.end(dfm_world_time(world_)); }
  Stepping(const Stepping &) = delete;
  Stepping &operator=(const Stepping &) = delete;

 private:
  Engine &engine_;
  dfm_world world_;
};

class Timer {
 public:
  explicit Timer(double &to) : to_(to), start_(std::chrono::steady_clock::now()) {}
  ~Timer() { to_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Timer(const Timer &) = delete;
  Timer &operator=(const Timer &) = delete;

 private:
  double &to_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace dfm_rigid_detail
