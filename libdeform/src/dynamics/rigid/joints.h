// Joints as rows on the velocities of two bodies, and the small dense systems that they make.
//
//   row: J v = la . va + aa . wa + lb . vb + ab . wb        A = J M^-1 J^T, factorised as L D L^T
//
// A row whose pivot vanishes is redundant (a closed loop, a joint between fixed bodies) and is left out.
#pragma once
#include <span>
#include <vector>

#include "deform/rigid.h"
#include "math/vec3.h"

namespace dfm {

struct RigidPart {
  double inverse_mass = 0;
  Vec3 moments, inverse_moments;  // about its own axes; inverse 0 if fixed
};

struct RigidJoint {
  uint32_t type, a, b;             // parts; b: DFM_RIGID_WORLD for the world
  Vec3 anchor_a, anchor_b;         // in the parts' frames (world: world)
  Vec3 axis_a, axis_b, side_b[2];  // unit; side_b and axis_b are orthogonal
  Quat turn;                       // from b's frame to a's as created
  bool can_drive() const { return type == DFM_JOINT_HINGE || type == DFM_JOINT_SLIDER; }
};
RigidJoint make_joint(const dfm_joint_def &def, std::span<const dfm_rigid_def> bodies);

struct JointRow {
  uint32_t a, b;  // parts; b kNone: the world
  Vec3 la, aa, lb, ab;
  double error = 0;  // m or rad, error of the position
};

// Appends the rows of joint j at the present poses.
void hold_rows(const RigidJoint &j, std::span<const dfm_rigid_state> state, std::vector<JointRow> &out);
// The row of its motor; error: its angle (within half a turn) or distance.
JointRow drive_row(const RigidJoint &j, std::span<const dfm_rigid_state> state);

double row_rate(const JointRow &row, std::span<const double> velocity);  // J v, velocity [n,6]

// A of a few rows; velocities are [n,6] over the parts.
class JointSystem {
 public:
  void build(std::span<const JointRow> rows, std::span<const RigidPart> parts,
             std::span<const dfm_rigid_state> state);
  // solves A x = x in place; rows that are left out get 0
  void solve(std::span<double> x) const;
  // velocity += M^-1 J^T x
  static void push(std::span<const JointRow> rows, std::span<const double> x,
                   std::span<const RigidPart> parts, std::span<const dfm_rigid_state> state,
                   std::span<double> velocity);

 private:
  std::vector<double> factor_, responses_;
  size_t n_ = 0;
};

}  // namespace dfm
