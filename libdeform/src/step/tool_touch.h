// Contact of tools with each other (deform/tool.h) and with rigid bodies of the builtin host that have no
// joints, where one of the two gives way. Spheres, capsules, boxes and triangles; Coulomb friction
// between tools.
//
//   rows     u_n' >= -(gap - d_c) / h at the nearest places of two parts, p >= 0, one of both is zero; the
//            impulse acts at one point of both, so that both momenta are kept to rounding
//   energy   p u_n' <= 0 for gap >= d_c / 2: such a contact takes energy or none. What is nearer opens by at
//            most a tenth of d_c in a sub-step
//   friction |p_t| <= mu p, against the slip, with the limit of the pair's law; it takes energy or none
//   jaws     go where they are told, so what two of them hold would be pressed without a bound. Something
//            rigid turns a jaw about its hinge by moment over stiffness, at the end of the sub-step (a spring
//            without mass, backward Euler); soft bodies do not. Places on its face give way, too, by a
//            hundredth of a millimeter per newton: how rigid things share a load has no other answer
//   order    first without soft bodies, which then see how the tools really move; their impulses come back
//            into the same rows until neither changes the other
#pragma once
#include <cstdint>
#include <vector>

#include "math/vec3.h"
#include "step/tool_shape.h"

namespace dfm {

struct Obstacle;
struct RigidSet;
struct StepContext;
struct World;

class ToolTouch {
 public:
  // After a change of things or rules: which obstacles may touch, and how they rub.
  void prepare(const World &w);
  // Before the solve: the rows of this sub-step, and the sets' velocities with their impulses.
  void begin(World &w, StepContext &step);
  // The hosts were asked for their velocities anew.
  void correct();
  // The sets' impulses are those of soft bodies: adds those of the rows. True: they differ from those that
  // the velocities have, so soft bodies have to be asked again.
  bool answer();
  // Once the hosts have ended their sub-step: turns the ends of the jaws.
  void turn_jaws();

 private:
  struct Side {
    size_t tool;  // place in sides_
    uint32_t part;
    Vec3 arm;
  };
  struct Row {
    Side a, b;
    Vec3 normal, tangent[2];    // from b to a
    double rate;                // m/s, that u_n must reach
    double soft;                // 1/kg, of the face of a jaw
    double mu;                  // friction over normal force
    double inverse, inverse_t;  // kg
    bool tools;                 // both
    double impulse;
    Vec3 along;   // N s, friction on a
    Vec3 bend;    // m/s, what turning adds to the slip beyond the first order
    Vec3 before;  // the impulse on a that velocities have
    Vec3 given() const { return impulse * normal + along; }
  };
  struct Moved {
    RigidSet *set;
    std::vector<double> response, block;     // [6n,6n] 1/kg; of one group
    std::vector<double> free, base, change;  // [6n] m/s, rad/s
    bool responds;                           // the response is not zero
    struct Jaw {
      uint32_t part;
      Vec3 axis, lever;  // velocity of its center by a turn of one about the axis
      double give;       // rad/s by a moment's impulse of 1 N m s
      double moment;     // N m s, of the rows
    };
    std::vector<Jaw> jaws;
    bool gives() const { return responds || !jaws.empty(); }
  };
  // Two obstacles that may touch, by their places in World::obstacles.
  struct Pair {
    uint32_t a, b;
    double mu;
    bool tools;  // both are parts of tools
  };
  Vec3 speed(const Row &row) const;
  void push(const Row &row, Vec3 impulse);
  void push(const Side &side, Vec3 impulse, Vec3 moment, std::vector<double> Moved::*to, bool turns_jaws);
  Vec3 answer_to(const Row &row, Vec3 impulse);
  void find(const World &w, const StepContext &step);
  void add_rows(const Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b);
  void add_row(const Pair &pair, Side a, Side b, Vec3 at, Vec3 normal, double gap, double reach);
  double fastest(const ToolShape &shape, const Side &side) const;
  Vec3 center(const Side &side) const;
  void list_jaws(Moved &m) const;
  void straighten(Moved &m) const;
  Vec3 bend(const Side &side) const;
  bool soft(const Side &a, const Side &b) const;
  double sweep();
  void solve();

  double h_ = 0, offset_ = 0;
  std::vector<Pair> pairs_;
  std::vector<Moved> sides_;
  std::vector<Row> rows_;
};

}  // namespace dfm
