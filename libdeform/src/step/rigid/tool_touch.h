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
//   jaws     follow their angle exactly, so the force on what two of them hold would have no bound. What a
//            jaw touches turns it about its hinge by moment over stiffness, at the end of the sub-step (a
//            spring without mass, backward Euler). Its face yields as well, by a hundredth of a millimeter
//            per newton; otherwise it would be undefined how rigid things share a load. Jaws of a tool
//            without a coupling pass through obstacles, as the tool does
//   joints   bodies that joints connect are one group, whose response contains the joints (tool_joints.cpp)
//   order    The rows are part of the one contact problem of a sub-step (step/solve/solve.cpp). What turning
//            adds and motors depend on its solution: follow() updates them, and the solve goes on
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <span>
#include <utility>
#include <vector>

#include "contact/contact_set.h"
#include "contact/rows.h"
#include "contact/store.h"
#include "core/disjoint_sets.h"
#include "friction/laws.h"
#include "geometry/box_tree.h"
#include "math/vec3.h"
#include "step/rigid/tool_shape.h"

namespace dfm {

struct Awake;
struct Budget;
struct Derived;
struct Entities;
struct Obstacle;
struct RigidMember;
struct RigidPair;
struct RigidSet;
struct SceneFacts;
struct Solution;
struct StepContext;
struct SubStepTimes;
struct Views;
struct World;
struct WorldMemory;
struct WorldState;

class ToolTouch {
 public:
  explicit ToolTouch(const Memory &memory);
  // Called after a change of bodies or rules: finds which pairs may touch, and their laws.
  void prepare(World &w, SceneFacts &facts);
  size_t near() const { return near_.size(); }  // pairs that were looked at in the last sub-step

  // Called before detection: finds the rows of this sub-step, and adds to the sets' velocities what their
  // impulses of the last one do. Returns false if the sub-step must be repeated, shorter (StepLength).
  bool begin(const WorldMemory &memory, const WorldState &state, const Entities &entities,
             const Derived &derived, const Awake &awake, const Views &views, SubStepTimes &times,
             Budget &budget);
  // The rows as part of a contact problem: sides of each row.
  std::span<const RigidSides> sides();
  // [6 bodies,6 bodies] 1/kg, of a world-wide group; false: it is unknown here
  bool fill_response(uint32_t group, double *matrix) const;
  // The bodies of a group, by their places in it.
  std::span<const RigidMember> members(const Views &views, uint32_t group) const;
  // m/s, rad/s [6] of a body without contact, with what turning adds. False: nothing here moves its set.
  bool free_velocity(const RigidSet &set, uint32_t body, double *out) const;
  void put(ContactRows &to, ContactState &state);
  // Called after the hosts have predicted their velocities again.
  void correct();
  // Takes impulses and velocities of a solve. left: m/s along normals, that it has left.
  void take(const StepContext &step, double left);
  void add_impulses() const;        // of the rows, to those of the sets
  void renew(const RigidSet &set);  // whose host has decided again about its motors (RigidSet::revised)
  bool press_harder();              // where motors hold; false: as hard as they can
  // Updates what turning adds, from the present solution. Returns whether the solve must go on.
  bool follow(World &w, StepContext &step);
  // Called once the rows are final: what the world is to keep of them.
  void list(const WorldState &state, const Solution &solution);
  // Whether the sub-step is short enough for the spin of what touches. False: as for begin().
  bool follows_arcs(const Entities &entities, const Derived &derived, const Awake &awake, SubStepTimes &times,
                    Budget &budget) const;
  // Called after the hosts have ended their sub-step: whether nothing that yields has met on its way what its
  // rows do not keep it apart from. False: as for begin().
  bool stays_out(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                 const Derived &derived, const Awake &awake, const Views &views, SubStepTimes &times,
                 Budget &budget);
  // The row of the two things that would end deepest in each other, of those that something driven leaves no
  // way; kNone: none.
  uint32_t jammed_row(const Derived &derived);
  // Turns the ends of the jaws.
  void turn_jaws();
  // Called at the end of an accepted sub-step: moves what lasts to the world.
  void keep(World &w) noexcept;
  ContactStore &next() { return next_; }
  std::string row_names(const Entities &entities, uint32_t row) const;  // of the two things, for messages
  // tool_report.cpp: for events, lists of contacts and sums of pairs
  static bool b_first(const Obstacle &a, const Obstacle &b);
  Array<RigidPair> &next_touching() { return next_touching_; }

 private:
  struct Side {
    size_t tool;  // place in sides_
    uint32_t part;
    Vec3 arm;   // of the place, from its center
    Vec3 bone;  // of a round shape: of the corner or axis inside; else, and beside a jaw, arm
  };
  // Two obstacles that may touch, by their places in World::obstacles.
  struct Pair {
    uint32_t a, b;
    std::array<uint64_t, 2> id;
    uint32_t law = 0;
    bool passes = false;             // nothing keeps the two apart, and no filter excludes them
    bool frees = true, jaw = false;  // none is of a tool; one is a jaw
    bool b_first = false;            // reports have b first
    double thin = 0;                 // m, least thickness of the two
    double dent = 0;                 // m: sharp edges that are further on the wrong side do not touch there
    double reach = 0, turn = 0;      // m, rad: how far its rows of this sub-step keep the two apart
  };
  // Things of one kind, planes aside, which are near everything.
  struct Things {
    std::vector<uint32_t> slot;
    BoxTree tree;
    Array<double> box;        // [n,2,4] m, least and largest corner of each one's box
    Array<uint32_t> corners;  // [n,3] of a triangle that has this box
    explicit Things(const Memory &m) : tree(m), box(m), corners(m) {}
    void start();
    void add(uint32_t obstacle);
    // Around balls that are larger by more[obstacle].
    void renew(std::span<const ObstacleView> views, std::span<const double> more);
    uint32_t at(uint32_t place) const { return slot[tree.triangles()[place]]; }
  };
  struct Row {
    const Pair *pair;
    Side a, b;
    uint64_t key;              // lasting name
    Vec3 normal, tangent[2];   // from b to a
    double rate;               // m/s, that u_n must reach
    double soft;               // 1/kg, of the face of a jaw, or of a motor that holds
    double impulse, along[2];  // N s on a: along the normal and the tangents
    Vec3 bend;                 // m/s, what turning adds to the slip beyond the first order, and belts
    bool far;                  // the gap is large beside the thickness of the two
    Vec3 at;                   // m, of the place
    double gap;                // m
    double lift;               // m/s, what turning adds to the speed along the normal, of free bodies
    Vec3 given() const { return impulse * normal + along[0] * tangent[0] + along[1] * tangent[1]; }
  };
  struct Moved {
    RigidSet *set;                    // nullptr: things that do not yield
    std::vector<Vec3> center, belt;   // [n] of these things; m/s
    std::vector<double> response;     // [6 bodies,6 bodies] 1/kg, of one group after another
    std::vector<size_t> first, wide;  // [groups] where it begins (kNone: none), 6 bodies
    std::vector<uint8_t> jointed;     // [groups]
    std::vector<double> free, now;    // [6n] m/s, rad/s: without contact, at the present impulses
    std::vector<double> turn;         // [6n] what impulses change beyond the response
    std::vector<double> reach;        // [n] m, of its rows from its center
    bool responds;                    // the response is not zero
    bool touched;                     // a row is its own
    bool drives;                      // it has motors
    struct Jaw {
      uint32_t part;
      Vec3 axis, lever;  // velocity of its center by a turn of one about the axis
      double softness;   // rad/s by a moment's impulse of 1 N m s
    };
    std::vector<Jaw> jaws;
    bool yields() const { return responds || !jaws.empty(); }
    // Whether contact with `to` changes the motion of this side. The jaws of a tool without a coupling yield
    // to tools and bodies, but not to obstacles: its poses may lead it along a table.
    bool gives(const Obstacle &to) const;
  };
  // Which features of the two meet.
  enum Meeting : uint32_t { kCornerOfA, kCornerOfB, kEdges };
  struct Name {
    Meeting kind;
    uint32_t first, second;
  };
  // bone_a, bone_b: corners, or points of edges or faces, without the radius around them
  struct Place { Vec3 at, bone_a, bone_b; };
  Vec3 speed(const Row &row, const std::vector<double> Moved::*of = &Moved::now) const;
  using Visit = std::function<void(Pair &, ToolShape &, ToolShape &, Side, Side)>;
  void each_pair(const Entities &entities, const Views &views, const Visit &f);
  static bool cull_facing(ToolShape &a, ToolShape &b, double far, bool flat);
  double add_rows(Pair &pair, ToolShape &a, ToolShape &b, Side at_a, Side at_b);
  void add_row(const Pair &pair, Name name, Side a, Side b, const Place &place, Vec3 normal, double gap,
               double reach);
  void find_near(const Views &views);
  static uint64_t key_of(const std::array<uint64_t, 2> &pair, Name name);
  double fastest(const Side &side, Vec3 around, double reach) const;
  Vec3 center(const Side &side) const;
  uint32_t group_of(const Side &side) const;
  uint32_t island_of(const Row &row) const;  // kNone: of things that nothing moves
  static double rate_of(const Moved &m, const Moved::Jaw &jaw);
  void straighten(Moved &m) const;
  void list_jaws(Moved &m);
  Vec3 bend(const Side &side, const Side &other) const;
  Vec3 bend(Vec3 spin, Vec3 arm) const;
  Vec3 bend_slope(Vec3 spin, Vec3 arm, Vec3 by) const;
  double follow_arc(Row &row) const;
  Vec3 spin(const Side &side) const;
  Vec3 belt(const Side &side) const;
  double follow_spin();
  const Moved *known(const RigidSet &set) const;
  Moved *known(const RigidSet &set) { return const_cast<Moved *>(std::as_const(*this).known(set)); }
  const double *first_of(const Side &side) const;
  // tool_rows.cpp
  static void add_jaw(const Moved::Jaw &jaw, double *matrix, size_t wide);
  RigidPlace place_of(const Side &side) const;
  void fill_row(Row &row, ContactRows &to, uint32_t r) const;
  void set_responses(Row &row, ContactRows &to, uint32_t r) const;
  void set_arcs(const Row &row, ContactRows &to, uint32_t r) const;
  // tool_joints.cpp
  bool belong_together(const World &w, const Obstacle &a, const Obstacle &b);
  static void list_joints(Moved &m);
  static void request_response(Moved &m, uint32_t group);
  void take_response(const Side &side);
  double response_without_joints(const Side &side, Vec3 along) const;
  bool jointed(const Side &side) const;
  double rounding_of(const Row &row, Vec3 along) const;
  double softness_of_motor(const Row &row) const;
  bool is_driven(const Side &side, Vec3 along) const;
  void begin_passes();
  void request_again(Moved &m);
  // tool_swept.cpp
  static double thickness(const Obstacle &o);
  bool goes_far_for_size(const Pair &pair) const;
  bool goes_far(const Pair &pair) const;
  double meeting(const Entities &entities, const Views &views, const Pair &pair, ToolShape &a,
                 ToolShape &b) const;
  // tool_warnings.cpp
  double depth(ToolShape &a, ToolShape &b, bool edges) const;
  void warn_deep(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                 const Pair &pair, double deep);
  void warn_passing(const WorldMemory &memory, const WorldState &state, const Entities &entities,
                    const Views &views);
  bool reported(const Pair &pair) const;
  bool inside(const ToolShape &a, const ToolShape &b, double deep) const;
  bool is_of_set(const Obstacle &o) const;
  void take_sets(const Entities &entities, const Views &views);
  // tool_rub.cpp
  void take_last(const WorldState &state, const Derived &derived, const Views &views);
  void add_rows_to_velocities(const Views &views);
  void drop_bad_starts(const Views &views);
  Vec3 slip(const Row &row) const;
  void keep_next(const Solution &solution);

  static constexpr double kOpens = 0.1;  // of d_c in a sub-step, where two things are in each other
  static constexpr double kArc = 0.2;    // rad in a sub-step, of a free body that touches
  static constexpr double kReach = 2;    // rows look so many times as far as a thing goes
  static constexpr double kOff = 0.2;    // of d_c, that places may be off after a sub-step
  static constexpr double kAims = 0.9;   // of what is allowed, where a sub-step is repeated

  double h_ = 0, offset_ = 0;
  double planned_ = 0;                // s, the sub-step before it was shortened
  std::vector<double> ways_, turns_;  // [obstacles] m, of any point in the sub-step; rad
  std::vector<double> reach_;         // [obstacles] m, that find_near() looks around each
  double off_ = 0;                    // m, that places with load or joints may be off after a solve
  double left_ = 0;                   // m/s along normals, that the last solve has left
  double strong_ = 1;                 // of the answer without joints, that places give where a motor holds
  std::vector<Pair> pairs_;           // by a, then b
  std::vector<uint32_t> near_;        // numbers of those that may be near each other in this sub-step
  std::vector<uint32_t> planar_;      // of those with a plane
  Things moved_, still_;
  Array<PairOfTriangles> stack_;  // scratch
  std::vector<RigidSet *> sets_;  // that take part
  std::vector<uint32_t> walls_;   // places in World::obstacles of those in no set of these
  std::vector<Side> side_of_;     // [obstacles] of those that take part
  std::vector<Moved> sides_;      // of this sub-step; kept for their memory, as shapes_ are
  ToolShape shapes_[2];
  std::vector<Row> rows_;
  std::vector<RigidSides> places_;
  uint32_t passes_ = 0;                // since motors were decided
  double changed_ = 0;                 // m/s, by the pass before
  DisjointSets islands_;               // of groups that rows connect
  std::vector<uint32_t> first_group_;  // [sides] of each, among all groups
  std::vector<uint8_t> driven_;        // [islands] scratch
  // m/s, the largest of places with and without the impulses of the start
  struct StartSpeeds { double with = 0, without = 0; };
  std::vector<StartSpeeds> start_speeds_;          // [islands] scratch
  std::vector<std::array<uint64_t, 2>> reported_;  // pairs that have met and pass each other
  // By row.
  ContactState state_;
  Array<ContactPoint> points_;  // key and normal
  Array<double> start_, tangents_;
  Array<uint32_t> match_;
  ContactStore next_;
  Array<RigidPair> next_touching_;
};

// Ends what the thing touches. At the removal of a thing.
void end_rigid_contacts(World &w, uint64_t id);
// The pairs that these contacts are of.
void find_touching(const World &w, const ContactStore &of, Array<RigidPair> &out);

}  // namespace dfm
