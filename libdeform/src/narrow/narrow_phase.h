// Contacts of a sub-step from the pairs that broad/ lists: closest points at the start of the sub-step, made
// where they are nearer than
//     reach = 2 d_c + 2 h |relative velocity of the features|,
// so that everything that may touch within the sub-step is a constraint in its solve.
//
// One rule excludes false contacts: a contact is a local minimum of the distance of the two surfaces, seen
// from outside. A point over a face has the face's normal; over an edge or a corner it counts only if no
// triangle beside it is nearer, and then once, not once per triangle. Two edges count only where both are
// convex and face each other. Beside a concave edge the second face's plane is a contact too if it can be
// reached. Edges that bore each other in the last sub-step count on, convex or not. All decisions use this
// and the geometry of the sub-step alone: more candidates never change the result.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "contact/contact_set.h"
#include "core/memory.h"
#include "core/tasks.h"
#include "geometry/views.h"
#include "narrow/list_memory.h"

namespace dfm {

// The list of candidates divided into blocks for workers, and their results. The division depends on the list
// alone, contacts are joined in its order, and blocks are independent: the bits are those of one thread.
class NarrowBlocks {
 public:
  explicit NarrowBlocks(const Memory &memory) : memory_(&memory), ranges_(memory) {}
  void start() { ranges_.clear(); }
  struct Range {  // of the list: candidates of one pair and kind
    size_t begin, end;
    double speed;      // m/s, bound over body b's surfels
    KnownRun known{};  // of its first one on
  };
  // A run of the list: all candidates of one pair and kind.
  void add(const Array<Candidate> &list, Range run);
  // find(candidates, range, contacts) for each block, re-entrant. Throws std::bad_alloc where one has no
  // memory.
  template <class Find>
  void run(Tasks &tasks, const Array<Candidate> &list, const Find &find, Array<ContactPoint> &out) {
    while (found_.size() < ranges_.size()) found_.emplace_back(*memory_);
    each_on(&tasks, ranges_.size(), 1, [&](size_t k) {
      found_[k].clear();
      const Range &p = ranges_[k];
      find(std::span(&list[p.begin], p.end - p.begin), p, found_[k]);
    });
    for (size_t k = 0; k < ranges_.size(); ++k) out.insert(out.end(), found_[k].begin(), found_[k].end());
  }

 private:
  const Memory *memory_;
  Array<Range> ranges_;
  std::vector<Array<ContactPoint>> found_;  // by piece
};

// candidates: in the order of BroadPhase::candidates(). out is cleared; contacts come sorted by (body a, body
// before obstacle, body or obstacle b, kind, type_a, feature a, feature b), keys are unique. Does not
// allocate once out's capacity has settled.
//   h          s
//   offset     m, rest distance d_c
//   crossings  ascending: what edges bore in the last sub-step
//   lent       scratch that the caller keeps
//   blocks, tasks   the same for work on several threads; null: none
//   known           follows a list that begins with candidates; null: none
// Values that are not finite make no contact.
void find_contacts(std::span<const BodyView> bodies, std::span<const ObstacleView> obstacles,
                   const Array<Candidate> &candidates, double h, double offset,
                   std::span<const Crossing> crossings, Array<uint8_t> &lent, Array<ContactPoint> &out,
                   NarrowBlocks *blocks = nullptr, Tasks *tasks = nullptr, ListMemory *known = nullptr);

}  // namespace dfm
