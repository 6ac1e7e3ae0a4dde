// The bodies and obstacles of a snapshot, each with the id that it had. A world that was built anew, or in
// which one of them was destroyed and created again, has the same things under other ids. A restore finds
// each by its name, or by its place among those without a name, and first gives it the id that it has in the
// snapshot. Ids decide every order, so the next steps then give the same bits.
#pragma once
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "snapshot/snapshot_stream.h"
#include "state/world.h"
#include "step/self_contact.h"

namespace dfm {

struct ThingRow {
  uint64_t id = 0;
  std::string name;   // empty: made from the id
  uint64_t made = 0;  // hash of mesh, masses, materials and shape
};
struct ThingRows {
  std::vector<ThingRow> bodies, obstacles;  // in id order, without pieces of bodies
};

ThingRows thing_rows(const World &w);

template <class Stream, class Rows>
void thing_fields(Stream &s, Rows &rows) {
  const auto list = [&](const char *what, const char *number, auto &things) {
    uint64_t last = 0;
    s.list(what, things, [&](auto &r) {
      s.value(number, r.id, must::any);
      s.must_hold(number, "rising numbers",
                  [&] { return r.id > std::exchange(last, r.id) && r.id < kMaxIds; });
      s.array("name of a thing", r.name, kAnyCount, must::any);
      s.value("make of a thing", r.made, must::any);
    });
  };
  list("bodies there are", "number of a body", rows.bodies);
  list("obstacles there are", "number of an obstacle", rows.obstacles);
}

// During its lifetime the things of the world have the ids of the rows; keep() makes that permanent.
class SnapshotIds {
 public:
  // Throws Error, which names the thing that is missing, too many or different; then the world is unchanged.
  SnapshotIds(World &w, const ThingRows &rows);
  SnapshotIds(const SnapshotIds &) = delete;
  ~SnapshotIds();
  void keep() noexcept;

 private:
  struct Word { uint64_t *at, before; };
  struct Name { std::string *at, other; };
  uint64_t now(uint64_t id) const;
  void change(uint64_t &id, uint64_t to);
  void detach_pieces(const ThingRows &rows);
  void refer(const ThingRows &rows);
  void exchange() noexcept;
  World &w_;
  std::vector<std::pair<uint64_t, uint64_t>> to_;  // (id, new id), sorted
  std::vector<Word> words_;
  std::vector<Name> names_;
  std::vector<std::vector<uint64_t>> cuts_;  // by tool
  std::vector<Sensed> sensed_;
  std::vector<PairDecision> decisions_;
  std::vector<std::unique_ptr<SelfBody>> self_;
};

}  // namespace dfm
