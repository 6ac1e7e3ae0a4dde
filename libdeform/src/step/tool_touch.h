// Contact of tools with each other (deform/tool.h) and with rigid bodies of the builtin host that have no
// joints, where one of the two gives way. Spheres, capsules and boxes; without friction.
//
//   rows     u_n' >= -(gap - d_c) / h at the nearest places of two parts, p >= 0, one of both is zero; the
//            impulse acts at one point of both, so that both momenta are kept to rounding
//   energy   p u_n' <= 0 for gap >= d_c / 2: such a contact takes energy or none. What is nearer opens by at
//            most a tenth of d_c in a sub-step
//   order    first without soft bodies, which then see how the tools really move; their impulses come back
//            into the same rows until neither changes the other
#pragma once
#include <cstdint>
#include <vector>

#include "math/vec3.h"

namespace dfm {

class ObstacleShape;
struct RigidSet;
struct StepContext;
struct World;

class ToolTouch {
 public:
  // Before the solve: the rows of this sub-step, and the sets' velocities with their impulses.
  void begin(World &w, StepContext &step);
  // The hosts were asked for their velocities anew.
  void correct();
  // The sets' impulses are those of soft bodies: adds those of the rows. True: they differ from those that
  // the velocities have, so soft bodies have to be asked again.
  bool answer();

 private:
  struct Side {
    size_t tool;  // place in sides_
    uint32_t part;
    Vec3 arm;
  };
  struct Row {
    Side a, b;
    Vec3 normal;                      // from b to a
    double rate;                      // m/s, that u_n must reach
    double inverse, impulse, before;  // before: what velocities have
  };
  struct Moved {
    RigidSet *set;
    std::vector<double> response, block;     // [6n,6n] 1/kg; of one group
    std::vector<double> free, base, change;  // [6n] m/s, rad/s
  };
  double speed(const Row &row) const;
  void push(const Row &row, double impulse);
  void push(const Side &side, Vec3 impulse, Vec3 moment, std::vector<double> Moved::*to);
  void find(const World &w, const StepContext &step);
  void add_rows(const ObstacleShape &a, const ObstacleShape &b, Side at_a, Side at_b);
  void add_row(Side a, Side b, Vec3 at, Vec3 normal, double gap, double reach);
  double fastest(const ObstacleShape &shape, const Side &side) const;
  Vec3 center(const Side &side) const;
  void solve();

  double h_ = 0, offset_ = 0;
  std::vector<Moved> sides_;
  std::vector<Row> rows_;
};

}  // namespace dfm
