// The rigid host that moves tools: a set is one tool, its bodies are the parts, all in one group that moves
// with the frame of the tool. Lasting state is in `extra`, so that snapshots and the hash contain it.
#pragma once
#include <vector>

#include "deform/rigid.h"
#include "math/turn.h"

namespace dfm {

// Reserved name: no other host may use it, and dfm_rigid_create does not accept it.
inline constexpr char kToolHost[] = "tools";

// The constant data of a tool.
struct ToolMotion {
  struct Part {
    Pose at;       // in the tool's frame, at opening 0
    double turns;  // about y through the origin, in openings: jaws +-1/2
  };
  std::vector<Part> parts;
  double stiffness = 0, damping = 0, turn_stiffness = 0, turn_damping = 0;
  double mass = 0, inertia = 0;
  double late = 0;  // s; if above 0, past forces are kept
  bool coupled() const { return stiffness > 0; }
};

// The velocity of the device is given: for this step, for the next one.
inline constexpr double kToolMeasured = 1, kToolMeasuredNext = 2;

// The values of `extra`. Impulses, displacement and work are sums since the start of the present step.
struct ToolValues {
  double device[7];                // m and quaternion: where the device is now
  double target[7];                // where it will be at `goal`
  double target_velocity[6];       // m/s, rad/s at that time, if `measured` is set
  double measured;                 // 0, kToolMeasured, kToolMeasuredNext
  double goal;                     // s
  double opening, target_opening;  // rad
  double keyed, opening_keyed;     // 1: driven by keys
  double contact[6];               // N s and N m s on the tool, about `about`, world frame
  double about[3];                 // m, where its origin was when the step began
  double coupling[6];              // N s and N m s on the tool, about its origin as it moved
  double time;                     // s of the step completed so far
  double work;                     // J since creation of the tool
  double port_work;                // J, with `given` held while the hand makes a step
  double tank;                     // J, port_work, whose negative part decays over time
  double given[6];                 // N and N m on the hand after the last step, world frame
  double ngiven;                   // forces kept so far, of a late device
};
inline constexpr size_t kToolValues = sizeof(ToolValues) / sizeof(double);
// After the values, for a late device: the last forces and their times. Force number k is in row k mod
// kToolPast.
inline constexpr size_t kToolPast = 256;
struct ToolGiven {
  double t;  // s, the end of its step
  double force[6];
};
inline constexpr size_t kToolPastValues = kToolPast * sizeof(ToolGiven) / sizeof(double);
ToolValues tool_values(const double *extra);
void store_values(const ToolValues &values, double *extra);

Pose load_place(const double *p);  // m and quaternion
void store_place(double *p, const Pose &place);
// The place of a part for this pose of the tool's frame and this opening.
Pose part_place(const ToolMotion::Part &part, const Pose &tool, double opening);

const dfm_rigid_host &tool_host();  // its create takes a ToolMotion as the set's data

}  // namespace dfm
