// Lists of feature pairs that may touch, with a skin, so that most sub-steps only check that the lists are
// still valid.
//
// Every body and obstacle keeps the shape it had when its lists were made, and a margin m. Its share is
// respected while
//     displacement since then + d_c + 2 h speed <= m,
// and two features whose boxes were further apart than m_a + m_b (+ recovery depth) cannot be within the
// reach of a contact then. Lists contain a superset of the contacts, and narrow/ decides by the geometry of
// the sub-step alone, so results never depend on when lists were built.
//
// On several threads bodies are processed one by one, and pairs are listed in parts, a part of one surface
// with all of the other, each into memory of its own. Lists are sorted, so parts do not show in them.
#pragma once
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "broad/pair_filter.h"
#include "contact/reach.h"
#include "core/memory.h"
#include "core/tasks.h"
#include "geometry/box_tree.h"
#include "geometry/views.h"

namespace dfm {

class BroadPhase {
 public:
  explicit BroadPhase(const Memory &memory);

  // Updates what is out of date; returns true if candidates() changed. h in s; offset d_c in m. Views may
  // come in any order. tasks: null: on this thread alone.
  bool update(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
              const PairFilter &filter, double h, double offset, Tasks *tasks = nullptr);

  // The same lists, rebuilt if they do not cover the motion of the sub-step after its solve: speed[i] bounds
  // that of the surfels of body i; the views of obstacles contain theirs. After update(), on the same views.
  bool cover(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
             const PairFilter &filter, double h, double offset, std::span<const double> speed,
             Tasks *tasks = nullptr);
  // Calls f(triangle of a, triangle of b) for pairs that may meet now; slots of bodies, or of a mesh
  // obstacle.
  template <class F>
  void near_triangles_of(uint32_t slot_a, uint32_t slot_b, bool obstacle, F &&f) {
    const Side *a = nullptr, *b = nullptr;
    for (const Body &body : bodies_) {
      if (body.slot == slot_a) a = &body;
      if (!obstacle && body.slot == slot_b) b = &body;
    }
    for (const Thing &thing : things_)
      if (obstacle && thing.view.slot == slot_b) b = &thing;
    if (!a || !b || !a->usable || !b->usable) return;
    near_pairs(a->tree, b->tree, a->margin + b->margin, stack_,
               [&](uint32_t p, uint32_t q, double) { f(a->tree.triangles()[p], b->tree.triangles()[q]); });
  }

  // In the order that find_contacts expects: (id a, body before obstacle, id b, kind, feature a, feature b).
  const Array<Candidate> &candidates() const { return candidates_; }

  // m/s, largest speed of the surfels of view i at the last update().
  double speed(size_t i) const { return bodies_[i].speed; }

  // The skin is chosen to last for about this many sub-steps of the present motion. Results do not depend on
  // it.
  void set_skin_steps(double steps) { skin_steps_ = steps; }
  // Drops all lists (after a change that update() cannot detect). Results do not depend on it.
  void clear();

  struct Stats {
    uint64_t renewals = 0;  // calls of update() that rebuilt lists
    uint64_t refits = 0;    // trees whose boxes were refitted
    uint64_t rebuilds = 0;  // trees built from nothing
  };
  const Stats &stats() const { return stats_; }

 private:
  struct Side {  // a surface in lists
    const Surface *surface = nullptr;
    double margin = -1;  // negative: no lists yet
    // since the lists were made, at the last update(); largest at that time
    double moved = 0, speed = 0;
    double expected = 0;  // speed that cover() requires of the lists
    // m, the share of the margin that is spent on motion to come; the most that it should be beside what is
    // near; the margin with the skin that it would have alone
    double skin = 0, skin_most = HUGE_VAL, margin_most = 0;
    bool dirty = true, usable = false;  // usable: all positions finite
    bool asleep = false;                // at the last update; unchanged positions if it still sleeps
    // updates since the margin was last compared with what they needed; the most of that, m
    uint32_t age = 0;
    double needed = 0;
    uint32_t refits = 0, rebuilds = 0;  // of the tree, not in stats_ yet
    BoxTree tree;
    Array<double> x;  // [nsurfel,4] when the lists were made
    explicit Side(const Memory &m) : tree(m), x(m) {}
  };
  struct Body : Side {
    uint64_t id = 0;
    uint32_t slot = 0, category = 0, collides_with = 0;
    using Side::Side;
  };
  struct Thing : Side {   // an obstacle; surface and tree of a mesh only
    ObstacleView view{};  // when the lists were made
    using Side::Side;
  };
  struct Segment {  // a run of candidates of one pair and one kind
    uint64_t id_a, id_b;
    uint32_t a, b;  // indices of the views
    uint32_t begin, count;
    uint8_t obstacle, kind;
    bool fresh;  // is in fresh_, not in candidates_
  };

  struct Pair {
    uint32_t a, b;  // indices of the views; listed bodies in the order of ids
    bool obstacle;
  };
  struct Part {  // of a pair: the triangles below these nodes of its trees
    uint32_t pair;
    PairOfTriangles nodes;
  };
  struct Found {        // {feature a, feature b} of one part
    bool near = false;  // not too far apart for any
    Array<uint64_t> vf, fv, ee;
    Array<PairOfTriangles> stack;
    explicit Found(const Memory &memory);
    void clear();
  };
  struct List {  // of one pair and kind, from all parts; its place in fresh_
    std::span<const Found> parts;
    Array<uint64_t> Found::*list;
    size_t begin;
  };

  // What update() and cover() were called with.
  struct Now {
    std::span<const BodyView> bodies;
    std::span<const ObstacleView> obstacles;
    const PairFilter &filter;
    double h, offset;
    Tasks *tasks;
  };
  void match(const Now &now);
  bool find_dirty(const Now &now);
  void look(Body &body, bool asleep, const Now &now);
  bool holds(const Thing &thing, const ObstacleView &view, const Now &now, double times = 2) const;
  double reach(const Body &body, const Now &now) const;
  double skin(const Body &body, const Now &now) const;
  double reach(const ObstacleView &view, const Now &now, double &speed) const;
  bool too_wide(Side &side, double needed) const;
  bool renew_tree(Side &side);
  void renew(const Now &now);
  void renew_body(Body &body, const Now &now);
  void renew_thing(Thing &thing, const ObstacleView &view, const Now &now);
  static void limit_skins(Side &a, Side &b);
  void bound_bodies();
  void find_pairs(const Now &now);
  void list_pairs(Tasks *tasks);
  void cut(uint32_t pair);
  void list(const Pair &pair, PairOfTriangles nodes, Found &found) const;
  bool list_surfaces(const Side &a, const Side &b, PairOfTriangles nodes, Found &found) const;
  bool list_voxels(const Body &a, const Thing &thing, Found &found) const;
  bool list_obstacle(const Body &a, const Thing &thing, Found &found) const;
  void add_segments(const Pair &pair, std::span<const Found> parts);
  void add_segment(uint32_t a, uint32_t b, bool obstacle, uint8_t kind, std::span<const Found> parts,
                   Array<uint64_t> Found::*list);
  void put_together(const List &list);
  void assemble();

  Memory memory_;
  double skin_steps_ = 24;
  Array<Body> bodies_;
  Array<Thing> things_;
  uint64_t filter_version_ = 0;
  // of a sphere around all bodies as they were when listed, for the motion of planes
  Vec3 center_;
  double radius_ = 0;
  Array<Segment> segments_, next_segments_;
  Array<Candidate> candidates_, next_;
  Array<uint64_t> fresh_;  // {feature a, feature b}
  Array<uint32_t> order_;
  Array<Pair> pairs_;         // to be listed
  Array<Part> parts_;         // of these, in their order
  std::vector<Found> found_;  // by number in parts_; of one thread the first
  Array<List> lists_;
  Array<PairOfTriangles> stack_;
  Stats stats_;
};

}  // namespace dfm
