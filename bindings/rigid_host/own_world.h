// A host's set that consists of definitions only (from a scene): a world of the engine with these bodies and
// joints. Here is what all engines share: checks of states, readings of joints, motors.
#pragma once
#include <string>
#include <vector>

#include "host.h"

namespace dfm_rigid_detail {

class OwnWorld : public Host {
 public:
  uint32_t extra() const { return first_memory() + memory(); }

  dfm_status predict(const dfm_rigid_step &step, double *velocity) override;
  void respond(const dfm_rigid_step &step, uint32_t group, double *matrix) override;
  void push(const dfm_rigid_step &step, const double *impulse) override;
  bool commit(const dfm_rigid_step &step, dfm_rigid_state *state, double *extra) override;
  dfm_status set_motor(uint32_t joint, double velocity, double max, double *extra) override;
  dfm_status joint(const dfm_rigid_state *state, const double *extra, uint32_t joint, double *position,
                   double *rate, double *effort) override;

 protected:
  // The engine's first body is one that moves: `body`, or `with` where `body` is fixed.
  struct Joint {
    uint32_t type = 0, body = 0, with = 0;  // numbers in the set; with: DFM_RIGID_WORLD for the world
    bool made = false;                      // false: both bodies are fixed
    bool swapped = false;                   // the engine's first body is `with`
    Vec anchor, axis;                       // world, as created; axis: unit
    Vec anchor_body, anchor_with;           // in the frames of the two
    Vec axis_body, axis_with;               // unit, likewise
    Quat turn;                              // from the frame of `with` to that of `body`, as created
    double sign() const { return swapped ? -1 : 1; }
    Vec anchor_first() const { return swapped ? anchor_with : anchor_body; }
    Vec axis_first() const { return swapped ? axis_with : axis_body; }
    uint32_t first() const { return swapped ? with : body; }
    uint32_t second() const { return swapped ? body : with; }
  };
  // What the engine did to the joint's first body in the sub-step: N, N m about the body's center of mass.
  struct Wrench { Vec force, moment; };

  OwnWorld(const char *host, Engine &engine) : host_(host), engine_(engine) {}
  // Members and joints, group by number in the set; may refuse half way.
  void build(const dfm_rigid_set_def &set, uint32_t *group);

  virtual Member *make_body(const dfm_rigid_def &def, uint32_t number) = 0;  // null: fixed
  virtual void make_joint(const Joint &joint, size_t number) = 0;
  virtual void set_gravity(const double gravity[3]) = 0;
  // The share of an overlap or of a joint's error that the engine undoes in the sub-step.
  virtual void set_correction(double share) = 0;
  // Drives the first body of a joint against the second, in a sub-step of h.
  virtual void drive(size_t joint, double velocity, double max, double h) = 0;
  virtual Wrench wrench(size_t joint) const = 0;
  // What the engine remembers of earlier sub-steps, behind the values of bodies and joints: how many numbers;
  // after a sub-step, last: contact is not solved again; are these what it remembers; from these, before the
  // next sub-step.
  virtual uint32_t memory() const { return 0; }
  virtual void remember(double *, bool) {}
  virtual bool remembers(const double *) const { return true; }
  virtual void recall(const double *) {}
  // Runs what calls the engine, which may refuse.
  virtual void call(const std::function<void()> &f) { f(); }

  const std::vector<Joint> &joints() const { return joints_; }

 private:
  static constexpr size_t kMotor = 3;  // values of extra per joint behind those of the bodies: speed, limit,
                                       // effort of the last sub-step
  const char *host_;
  Engine &engine_;
  std::vector<Member *> members_;  // by number in the set; null: fixed
  std::vector<uint32_t> moving_;   // group -> number
  std::vector<Joint> joints_;
  std::vector<dfm_rigid_state> given_;  // present states of the engine's bodies
  bool predicted_ = false;              // and no commit since

  void predict_all(const dfm_rigid_step &step, double *velocity);
  uint32_t first_memory() const { return static_cast<uint32_t>(first_joint() + kMotor * joints_.size()); }
  size_t first_joint() const { return size_t{Member::kExtra} * members_.size(); }
  void add_joint(const dfm_joint_def &def);
  double effort(size_t joint, const dfm_rigid_state *state) const;
  void check(const dfm_rigid_state &s, uint32_t number, const char *when) const;
};

}  // namespace dfm_rigid_detail
