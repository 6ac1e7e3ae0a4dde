// Contact between two rigid things, at least one of which can yield: tools (deform/tool.h) and bodies of the
// builtin host, with each other and with whatever does not yield (obstacles, fixed bodies). A coupled tool
// yields by its spring, a body by its mass and as its joints allow; a tool without a coupling follows its
// poses exactly and does not yield. Shapes are spheres, capsules, boxes and triangles; obstacles may also be
// planes and voxels, which only corners touch.
//
//   rows     u_n' >= -(gap - d_c) / h at the nearest places of two parts, p >= 0, one of both is zero; the
//            impulse acts at one point of both, so that both momenta are kept to rounding
//   energy   p u_n' <= 0 for gap >= d_c / 2: such a contact takes energy or none. A smaller gap opens by at
//            most a tenth of d_c in a planned sub-step, and no faster in the pieces of one
//   turning  The rotation of a free body counts to third order, along the normal too: to first order alone a
//            body that topples would sink by (h w)^2 r / 2 in a sub-step, which contact then opens by a tenth
//            of d_c. Not so for tools: it would give them p (h w)^2 r / 2 of energy, and their springs hold
//            them upright
//   friction the law of the pair, implicitly, at the slip and normal force of the solution (tool_rub.cpp);
//            impulses and the state of the law last from sub-step to sub-step (World::tool_store)
//   jaws     follow their angle exactly, so the force on what two of them hold would have no bound. Something
//            rigid turns a jaw about its hinge by moment over stiffness, at the end of the sub-step (a spring
//            without mass, backward Euler); soft bodies do not. The face of a jaw yields as well, by a
//            hundredth of a millimeter per newton; otherwise it would be undefined how rigid things share a
//            load. Jaws of a tool without a coupling pass through obstacles, as the tool does
//   joints   bodies that joints connect are one group, whose response contains the joints (tool_joints.cpp)
//   order    The rows are solved first without soft bodies, whose contacts then use the resulting motion of
//            tools; the impulses of soft bodies come back into the same rows, until neither changes the other
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "contact/contact_set.h"
#include "contact/store.h"
#include "core/disjoint_sets.h"
#include "friction/laws.h"
#include "math/vec3.h"
#include "state/rigid_report.h"
#include "step/tool_shape.h"

namespace dfm {

struct Obstacle;
struct RigidSet;
struct SceneFacts;
struct StepContext;
struct World;

class ToolTouch {
 public:
  explicit ToolTouch(const Memory &memory);
  // Called after a change of bodies or rules: finds which pairs may touch, and their laws.
  void prepare(World &w, SceneFacts &facts);
  // Thrown by what solves rows: a law failed, returned a value that is not finite, or a limit below zero.
  struct LawFailed {
    const LawInstance *law;
    double force, slip;  // N, m/s, at which the law was evaluated; nan: unknown
  };

  // Called before the solve: finds and solves the rows of this sub-step, and changes the sets' velocities by
  // their impulses. Returns false if the sub-step must be repeated, shorter (Guard::again).
  bool begin(World &w, StepContext &step);
  // Called after the hosts have predicted their velocities again.
  void correct();
  // Called when the sets hold the impulses of soft bodies: solves the rows again and adds their impulses.
  // Returns whether these differ from those in the velocities, so that soft bodies must be solved again.
  bool answer(World &w, StepContext &step);
  // Called where the motors of a set are decided again because of soft bodies: adds the impulses of the rows
  // to set.impulse, and their velocities to set.revised if the motors have changed.
  void add_to_impulses(RigidSet &set) const;
  void add_to_revised(RigidSet &set);
  // Whether the sub-step is short enough for the spin of what touches. False: as for begin().
  bool follows_arcs(const World &w, StepContext &step) const;
  // Called after the hosts have ended their sub-step: whether no fast free body has passed through something.
  // False: as for begin().
  bool stays_out(const World &w, StepContext &step);
  // Turns the ends of the jaws.
  void turn_jaws();
  // Called at the end of an accepted sub-step: moves what lasts to the world.
  void keep(World &w) noexcept;
  ContactStore &next() { return next_; }
  // tool_report.cpp: for events, lists of contacts and sums of pairs
  static bool b_first(const Obstacle &a, const Obstacle &b);
  RigidReport &next_report() { return next_report_; }
  size_t most_events(const World &w) const;  // that keep() adds

 private:
  struct Side {
    size_t tool;  // place in sides_
    uint32_t part;
    Vec3 arm;   // of the place, from its center
    Vec3 bone;  // of a round shape: of the corner or axis inside; else, and beside a jaw, arm
  };
  struct Row {
    Side a, b;
    uint64_t key, pair[2];    // lasting names: of itself, of the two obstacles
    Vec3 normal, tangent[2];  // from b to a
    double rate;              // m/s, that u_n must reach
    double soft;              // 1/kg, of the face of a jaw
    double opens;             // 1/kg: of the rate, if above zero, the load takes back min(opens p, rate)
    double inverse;           // kg
    double response;          // 1/kg, the largest one in the tangent plane; 0: does not rub
    uint32_t law;
    double impulse, along[2];  // N s on a: along the normal and the tangents
    Vec3 bend;                 // m/s, what turning adds to the slip beyond the first order, and belts
    bool frees, jaw;           // none is of a tool; one is a jaw
    bool far;                  // the gap is large beside the thickness of the two
    bool b_first;              // reports have b first
    Vec3 at;                   // m, of the place
    double gap;                // m
    double lift;               // m/s, what turning adds to the speed along the normal, of free bodies
    Vec3 before;               // the impulse on a that velocities have
    Vec3 given() const { return impulse * normal + along[0] * tangent[0] + along[1] * tangent[1]; }
  };
  struct Moved {
    RigidSet *set;                    // nullptr: things that do not yield
    std::vector<Vec3> center, belt;   // [n] of these things; m/s
    std::vector<double> response;     // [6 bodies,6 bodies] 1/kg, of one group after another
    std::vector<size_t> first, wide;  // [groups] where it begins (kNone: none), 6 bodies
    std::vector<uint8_t> jointed;     // [groups]
    // response = basis basis^T for groups with joints: [6 bodies,rank], of one group after another
    std::vector<double> basis;
    std::vector<size_t> basis_first, rank;   // [groups] where it begins (kNone: not computed yet)
    std::vector<double> free, base, change;  // [6n] m/s, rad/s
    std::vector<double> turn;                // [6n] what impulses change beyond the response
    std::vector<double> given;               // [6n] N s, N m s of soft bodies
    std::vector<double> reach;               // [n] m, of its rows from its center
    bool responds;                           // the response is not zero
    bool touched;                            // a row is its own
    bool drives;                             // it has motors
    bool stale;                              // the host may have decided about motors since
    struct Jaw {
      uint32_t part;
      Vec3 axis, lever;  // velocity of its center by a turn of one about the axis
      double give;       // rad/s by a moment's impulse of 1 N m s
      double moment;     // N m s, of the rows
    };
    std::vector<Jaw> jaws;
    // Whether contact with `to` changes the motion of this side. The jaws of a tool without a coupling yield
    // to tools and bodies, but not to obstacles: its poses may lead it along a table.
    bool gives(const Obstacle &to) const;
  };
  // Two obstacles that may touch, by their places in World::obstacles.
  struct Pair {
    uint32_t a, b, law;
    uint64_t id[2];
    bool frees, jaw;   // none is of a tool; one is a jaw
    bool b_first;      // reports have b first
    uint32_t wall[2];  // number among walls_; kNone: it is in a set
    double thin;       // m, least thickness of the two
  };
  // Which features of the two meet.
  enum Meeting : uint32_t { kCornerOfA, kCornerOfB, kEdges, kHitEdges };
  struct Name {
    Meeting kind;
    uint32_t first, second;
  };
  // bone_a, bone_b: corners, or points of edges or faces, without the radius around them
  struct Place { Vec3 at, bone_a, bone_b; };
  struct Hit {
    const Pair *pair;
    Name name;
    Side a, b;
    Place place;
    Vec3 normal;
    double gap;
  };
  Vec3 speed(const Row &row) const;
  void push(const Row &row, Vec3 impulse);
  void push(const Side &side, Vec3 impulse, Vec3 moment, std::vector<double> Moved::*to, bool turns_jaws);
  Vec3 answer_to(const Row &row, Vec3 impulse);
  void find(const World &w, const StepContext &step);
  using Visit = std::function<void(const Pair &, ToolShape &, ToolShape &, Side, Side)>;
  void each_pair(const World &w, const StepContext &step, const Visit &f);
  static bool look_at_each_other(ToolShape &a, ToolShape &b, double far, bool flat);
  double add_rows(const Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b);
  void add_row(const Pair &pair, Name name, Side a, Side b, const Place &place, Vec3 normal, double gap,
               double reach);
  static uint64_t key_of(const uint64_t pair[2], Name name);
  double fastest(const ToolShape &shape, const Side &side, const ToolShape &other) const;
  Vec3 center(const Side &side) const;
  void list_jaws(Moved &m) const;
  void straighten(Moved &m) const;
  Vec3 bend(const Side &side, const Side &other) const;
  Vec3 bend(Vec3 spin, Vec3 arm) const;
  Vec3 bend(Vec3 spin, const Quat &turn, Vec3 arm) const;
  Vec3 bend_slope(Vec3 spin, Vec3 arm, Vec3 by) const;
  double follow_arc(Row &row) const;
  Vec3 spin(const Side &side) const;
  Vec3 belt(const Side &side) const;
  void add_impulses(size_t k);
  void add_rows_to(size_t k, RigidSet &set) const;
  void set_base(size_t k);
  void set_answers(Row &row);
  double follow_spin();
  double sweep();
  void sweep_until(double done);
  void take_impulses(Array<double> &to) const;
  void solve(World &w, StepContext &step);
  Vec3 change_of(const Row &row) const;
  void push_all();
  // tool_newton.cpp
  struct Motion {
    size_t tool, at, size;  // at: first of its unknowns
    uint32_t group, jaw, part;
    Vec3 center;
    bool solved;   // of an island
    bool jointed;  // its unknowns are those of the basis of its group
    Vec3 spin;     // rad/s, so far
    Quat turn;     // by it in the sub-step
  };
  struct Lever {
    uint32_t motion;
    bool of_a;      // else of b
    size_t values;  // in lever_values_, where they begin
  };
  // [3,size] m/s along normal and tangents by the unknowns of its motion; and what turning adds to it beyond
  // the first order, by the spin so far.
  const double *by(const Lever &lever, size_t c) const {
    return &lever_values_[lever.values + c * motions_[lever.motion].size];
  }
  double *bent(const Lever &lever, size_t c) {
    return &lever_values_[lever.values + (3 + c) * motions_[lever.motion].size];
  }
  std::array<uint32_t, 2> movers_of(const Side &side);
  void list_motions();
  std::array<double, 2> rub_at(uint32_t i, double yields, const double last[3], double normal, double u1,
                               double u2) const;
  struct NewtonRow {
    uint32_t row;
    // along normal and tangents: m/s without impulses, with bend and lift; N s of the last round, and now; kg
    double start[3], last[3], now[3], rho[3];
    bool arcs[3];   // bend and lift follow the spin, and are not in `start`
    LinearLaw law;  // to come back to
  };
  // Of one island; kept for its memory.
  struct NewtonScratch {
    size_t n = 0;       // unknowns
    double yields = 0;  // of the last rounds of this solve; 0: none yet
    std::vector<NewtonRow> rows;
    std::vector<uint32_t> order;      // [motions], by which they are eliminated
    std::vector<uint8_t> joined;      // [motions,motions] while that is found
    std::vector<size_t> first, live;  // [n] place of the motion that an unknown is of; scratch
    std::vector<double> mass, system, x, left, from, force, good;  // [n,n], [n,n], [n], ...
    std::vector<double> slopes;                                    // [n,3]
  };
  void order_motions(uint32_t island);
  void put_masses();
  void turn_motions();
  Vec3 spin_of(const Motion &motion, const Side &side) const;
  bool number_unknowns(uint32_t island);
  bool set_masses(uint32_t island);
  void start_rows(uint32_t island);
  void set_rho(double yields);
  void add_motion(uint32_t row, const std::vector<double> &x, double u[3]) const;
  void add_arc(const NewtonRow &l, double u[3], bool slopes);
  void impulse_at(NewtonRow &l, const double u[3]) const;
  double force_along(const std::vector<double> &way);
  void shorten(double at_start);
  void gather_impulses();
  void answer_at(NewtonRow &l, const double u[3], double slope[3][3]) const;
  void add_slopes(uint32_t row, const double slope[3][3]);
  double newton_step();
  double end_round();
  bool solve_round(double done);
  bool solve_rounds(double done);
  bool newton(uint32_t island, double done);
  void leap(double done);
  // tool_joints.cpp
  bool belong_together(const World &w, const Obstacle &a, const Obstacle &b);
  static void list_joints(Moved &m);
  static void ask_response(Moved &m, uint32_t group);
  void take_response(const Side &side);
  double answer_without_joints(const Side &side, Vec3 along) const;
  bool jointed(const Side &side) const;
  double rounding_of(const Row &row, Vec3 along) const;
  bool motor_holds(const Row &row) const;
  bool is_driven(const Side &side, Vec3 along) const;
  double give_of_motor(const Row &row) const;
  void renew_rows();
  bool press_harder();
  void ask_again(Moved &m);
  static void find_basis(Moved &m, uint32_t group);
  const double *basis_of(const Moved &m, uint32_t part) const;
  void take_host(size_t k);
  bool decide_motors();
  // tool_swept.cpp
  static double thickness(const Obstacle &o);
  // tool_hits.cpp
  Vec3 end_of(const Side &side, Vec3 p) const;
  void find_hits(const Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b);
  bool add_hits(const World &w, const StepContext &step);
  void solve_past_hits(World &w, StepContext &step);
  double depth(ToolShape &a, ToolShape &b, bool edges) const;
  void tell_driven(const World &w, const StepContext &step);
  void tell_deep(const World &w, const Pair &pair, double deep, bool driven);
  void tell_passing(const World &w, const StepContext &step);
  bool told(const Pair &pair) const;
  bool inside(const ToolShape &a, const ToolShape &b, double deep) const;
  Side side_of(const Obstacle &o, uint32_t wall) const;
  void take_sets(World &w, StepContext &step);
  void give_velocities();
  // tool_rub.cpp
  void take_last(const World &w);
  double ask_laws(double least);
  Vec3 slip(const Row &row) const;
  std::array<double, 2> rub(uint32_t i) const;
  void keep_next();
  // tool_report.cpp
  void list_contact(uint32_t row);
  void list_contacts(const World &w);
  void report(World &w) noexcept;

  static constexpr double kOpens = 0.1;  // of d_c in a sub-step, where two things are in each other

  double h_ = 0, offset_ = 0;
  double planned_ = 0;        // s, the sub-step before it was shortened
  std::vector<double> ways_;  // [obstacles] m, of any point in the sub-step
  double off_joints_ = 0;     // m, that places of bodies with joints may be off after a solve
  double strong_ = 1;         // of the answer without joints, that places give where a motor holds
  double thinnest_ = 0;       // m, of the pairs of free bodies
  std::vector<Pair> pairs_,
      passing_;                   // passing: nothing keeps the two apart, and no filter excludes them
  std::vector<RigidSet *> sets_;  // that take part
  std::vector<uint32_t> walls_;   // places in World::obstacles of those in no set of these
  std::vector<Moved> sides_;      // valid where there are rows; kept for their memory, as shapes_ are
  ToolShape shapes_[2];
  std::vector<Row> rows_;
  std::vector<Hit> hits_;
  std::vector<Motion> motions_;
  DisjointSets islands_;  // of motions that rows connect
  std::vector<Lever> levers_;
  std::vector<double> lever_values_;
  std::vector<uint32_t> first_lever_;  // [rows+1]
  NewtonScratch newton_;
  std::vector<std::array<uint64_t, 2>> told_;  // pairs that have met and pass each other
  // By row.
  ContactState state_;
  LawBatches batches_;
  std::vector<LawInstance *> laws_;  // of the world
  Array<ContactPoint> points_;       // key and normal
  Array<double> start_, tangents_, response_;
  Array<double> best_;  // [3 rows] impulses
  Array<uint32_t> match_;
  ContactStore next_;
  RigidReport next_report_;
};

// Ends what the thing touches. At the removal of a thing.
void leave_rigid_contacts(World &w, uint64_t id);
// The pairs that these contacts are of.
void find_touching(const World &w, const ContactStore &of, Array<RigidPair> &out);

}  // namespace dfm
