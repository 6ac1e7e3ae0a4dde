// The rigid host that moves tools: a set is one tool, its bodies are the parts, all in one group that moves
// as the tool's frame does. What lasts stands in `extra`, so that snapshots and the hash have it.
#pragma once
#include <vector>

#include "deform/rigid.h"
#include "math/vec3.h"

namespace dfm {

// Reserved: no other host may have it, and dfm_rigid_create cannot ask for it.
inline constexpr char kToolHost[] = "tools";

struct ToolPlace {
  Vec3 position;
  Quat rotation;
};

// What never changes of a tool.
struct ToolMotion {
  struct Part {
    ToolPlace at;  // in the tool's frame, at opening 0
    double turns;  // about y through the origin, in openings: jaws +-1/2
  };
  std::vector<Part> parts;
  double stiffness = 0, damping = 0, turn_stiffness = 0, turn_damping = 0;
  double mass = 0, inertia = 0;
  double late = 0;  // s; above 0 the forces that were given are remembered
  bool coupled() const { return stiffness > 0; }
};

// A velocity of the device was given: for this step, for the next one.
inline constexpr double kToolMeasured = 1, kToolMeasuredNext = 2;

// The values of `extra`. Impulses, way and work are sums since the present step began.
struct ToolValues {
  double device[7];                // m and quaternion: where the device is now
  double target[7];                // where it will be at `goal`
  double target_velocity[6];       // m/s, rad/s then, where `measured` says so
  double measured;                 // 0, kToolMeasured, kToolMeasuredNext
  double goal;                     // s
  double opening, target_opening;  // rad
  double keyed, opening_keyed;     // 1: keys lead
  double contact[6];               // N s and N m s on the tool, about `about`, world frame
  double about[3];                 // m, where its origin was when the step began
  double coupling[6];              // N s and N m s on the tool, about its origin as it moved
  double time;                     // s of the step that are done
  double work;                     // J since the tool was made
  double port_work;                // J, with `given` held while the hand makes a step
  double tank;                     // J, port_work, of which what is below 0 is forgiven in time
  double given[6];                 // N and N m on the hand after the last step, world frame
  double ngiven;                   // forces given so far, of a late device
  double cut_due;                  // J, that cuts have taken and the tool has not paid yet
  double cut_length;               // m, over which a coupled tool pays it
  double cut_at[3], cut_way[3];    // m, unit length: where its edge cuts and where to, in the tool's frame
};
inline constexpr size_t kToolValues = sizeof(ToolValues) / sizeof(double);
// Behind the values, of a late device: the last forces that were given, and when. Number k stands in row
// k mod kToolPast.
inline constexpr size_t kToolPast = 256;
struct ToolGiven {
  double t;  // s, the end of its step
  double force[6];
};
inline constexpr size_t kToolPastValues = kToolPast * sizeof(ToolGiven) / sizeof(double);
ToolValues tool_values(const double *extra);
void store_values(const ToolValues &values, double *extra);

ToolPlace load_place(const double *p);  // m and quaternion
void store_place(double *p, const ToolPlace &place);
ToolPlace place_of(const dfm_rigid_state &state);
// Where a part stands when the tool's frame stands there, at that opening.
ToolPlace part_place(const ToolMotion::Part &part, const ToolPlace &tool, double opening);

const dfm_rigid_host &tool_host();  // its create takes a ToolMotion as the set's data

}  // namespace dfm
