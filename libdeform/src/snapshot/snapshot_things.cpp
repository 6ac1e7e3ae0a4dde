#include "snapshot/snapshot_things.h"

#include <algorithm>

#include "core/error.h"
#include "dynamics/rigid/rigid_set.h"
#include "snapshot/snapshot_cuts.h"
#include "snapshot/snapshot_structure.h"
#include "state/obstacle.h"
#include "state/tool.h"
#include "state/world.h"
#include "step/context.h"

namespace dfm {
namespace {

const char *kind_of(const Body &) { return "body"; }
const char *kind_of(const Obstacle &o) { return o.rigid && !o.added ? "rigid" : "obstacle"; }

const char *word_for(const Body &) { return "body"; }
const char *word_for(const Obstacle &o) { return o.rigid ? "rigid body or tool" : "obstacle"; }

// The name that a thing gets if it is created without one.
template <class T>
std::string usual_name(const T &thing, uint64_t id) {
  return kind_of(thing) + std::to_string(id);
}

std::vector<Body *> made_by_host(const World &w) {
  std::vector<Body *> out = all_bodies(w);
  std::erase_if(out, [](const Body *b) { return b->piece_of != 0; });
  return out;
}
std::vector<Obstacle *> obstacles_of(const World &w) {
  std::vector<Obstacle *> out;
  for (auto &o : w.obstacles) out.push_back(o.get());
  return out;
}

template <class T>
std::vector<ThingRow> rows_of(const std::vector<T *> &things) {
  std::vector<ThingRow> out;
  for (const T *const x : things)
    out.push_back({x->id, x->name == usual_name(*x, x->id) ? std::string() : x->name, make_of(*x)});
  return out;
}

[[noreturn]] void differs(const char *what, const std::string &name, const char *problem,
                          const char *remedy) {
  fail(DFM_E_FORMAT, "the snapshot belongs to another world: %s '%s' %s; %s; nothing was restored", what,
       name.c_str(), problem, remedy);
}

// The world's thing of each row.
template <class T>
std::vector<T *> find_things(const std::vector<T *> &things, const std::vector<ThingRow> &rows,
                             const char *what) {
  std::vector<T *> named, unnamed, out;
  for (T *const x : things) (x->name == usual_name(*x, x->id) ? unnamed : named).push_back(x);
  std::ranges::sort(named, {}, &T::name);
  size_t next = 0;
  for (const ThingRow &r : rows) {
    if (r.name.empty()) {
      if (next == unnamed.size())
        fail(DFM_E_FORMAT,
             "the snapshot belongs to another world: it needs more than the %zu of this world that were "
             "created without a name (%s); create them in the same order before you restore, or give names; "
             "nothing was restored",
             unnamed.size(), what);
      out.push_back(unnamed[next++]);
      continue;
    }
    const auto at = std::ranges::lower_bound(named, r.name, {}, &T::name);
    if (at == named.end() || (*at)->name != r.name)
      differs(what, r.name, "is not in this world", "create it before you restore");
    out.push_back(*at);
  }
  std::vector<const T *> found(out.begin(), out.end());
  std::sort(found.begin(), found.end());
  if (std::adjacent_find(found.begin(), found.end()) != found.end())
    fail(DFM_E_FORMAT, "the snapshot is damaged: name of a thing: expected each once; nothing was restored");
  for (T *const x : things)
    if (!std::binary_search(found.begin(), found.end(), x))
      differs(word_for(*x), x->name, "was not there when it was taken", "destroy it before you restore");
  for (size_t i = 0; i < rows.size(); ++i)
    if (rows[i].made != make_of(*out[i]))
      differs(word_for(*out[i]), out[i]->name,
              "has another shape, mesh, material, mass, cut delay or fields there",
              "create it as it was when the snapshot was taken");
  return out;
}

void renew_name(Obstacle &o) noexcept {
  o.def.name = o.name.c_str();
  if (o.rigid && !o.added) o.rigid->defs[o.rigid_body].name = o.name.c_str();
}

bool has_id(const std::vector<ThingRow> &rows, uint64_t id) {
  return std::ranges::find(rows, id, &ThingRow::id) != rows.end();
}

uint64_t id_of(const Body &b) { return b.id; }
uint64_t id_of(const Obstacle &o) { return o.id; }
uint64_t id_of(const RigidSet &set) { return set.obstacle[0]; }
uint64_t id_of(const Tool &t) { return id_of(*t.set); }

template <class List>
void sort_by_id(List &list) noexcept {
  std::ranges::sort(list, {}, [](const auto &x) { return id_of(*x); });
}

}  // namespace

ThingRows thing_rows(const World &w) { return {rows_of(made_by_host(w)), rows_of(obstacles_of(w))}; }

void SnapshotIds::change(uint64_t &id, uint64_t to) {
  if (id == to) return;
  words_.push_back({&id, id});
  id = to;
}

uint64_t SnapshotIds::now(uint64_t id) const {
  const auto at = std::ranges::lower_bound(to_, id, {}, &std::pair<uint64_t, uint64_t>::first);
  return at != to_.end() && at->first == id ? at->second : id;
}

// A piece keeps its id only if its body does, and if no other thing has it in the snapshot; the restore then
// removes it.
void SnapshotIds::detach_pieces(const ThingRows &rows) {
  for (auto *const list : {&w_.bodies, &w_.emptied, &w_.rolled_back})
    for (auto &b : *list) {
      if (!b->piece_of) continue;
      const uint64_t whole = now(b->piece_of);
      const bool taken = has_id(rows.bodies, b->id) || has_id(rows.obstacles, b->id);
      if ((whole != b->piece_of || taken) && b->id < kMaxIds) change(b->id, kMaxIds + b->id);
      change(b->piece_of, whole);
    }
}

// What else refers to things by their ids, and is not in the snapshot.
void SnapshotIds::refer(const ThingRows &rows) {
  for (auto &t : w_.tools) {
    cuts_.push_back(t->cuts.bodies);
    for (uint64_t &id : cuts_.back()) id = now(id);
    std::sort(cuts_.back().begin(), cuts_.back().end());
  }
  sensed_ = w_.sensed;
  for (Sensed &s : sensed_) s = {now(s.sensor), now(s.thing)};
  std::sort(sensed_.begin(), sensed_.end());
  decisions_ = w_.may_touch.decisions;
  for (PairDecision &p : decisions_) {
    p.a = now(p.a);
    p.b = now(p.b);
    if (has_id(rows.bodies, p.b) && p.b < p.a) std::swap(p.a, p.b);
  }
  std::sort(decisions_.begin(), decisions_.end(), [](const PairDecision &l, const PairDecision &r) {
    return std::pair(l.a, l.b) < std::pair(r.a, r.b);
  });
  for (auto &set : w_.rigid_sets)
    for (uint64_t &id : set->obstacle) change(id, now(id));
}

SnapshotIds::SnapshotIds(World &w, const ThingRows &rows) : w_(w) {
  const std::vector<Body *> bodies = find_things(made_by_host(w), rows.bodies, "body");
  const std::vector<Obstacle *> obstacles =
      find_things(obstacles_of(w), rows.obstacles, "obstacle, rigid body or tool");
  const auto note = [&](const auto &things, const std::vector<ThingRow> &of) {
    for (size_t i = 0; i < of.size(); ++i) {
      if (things[i]->id == of[i].id) continue;
      to_.emplace_back(things[i]->id, of[i].id);
      if (!of[i].name.empty()) continue;
      names_.push_back({&things[i]->name, usual_name(*things[i], of[i].id)});
    }
  };
  note(bodies, rows.bodies);
  note(obstacles, rows.obstacles);
  if (to_.empty()) return;
  std::sort(to_.begin(), to_.end());
  for (const ThingRow &row : rows.bodies)
    if (has_id(rows.obstacles, row.id))
      fail(DFM_E_FORMAT,
           "the snapshot is damaged: number of a body: expected that of no obstacle; nothing was restored");
  words_.reserve(2 * (w.bodies.size() + w.emptied.size() + w.rolled_back.size() + w.obstacles.size()) +
                 w.obstacles.size());
  refer(rows);
  detach_pieces(rows);
  for (size_t i = 0; i < bodies.size(); ++i) change(bodies[i]->id, rows.bodies[i].id);
  for (size_t i = 0; i < obstacles.size(); ++i) change(obstacles[i]->id, rows.obstacles[i].id);
  exchange();
}

// Everything but the ids; a second call undoes the first.
void SnapshotIds::exchange() noexcept {
  for (Name &n : names_) n.at->swap(n.other);
  for (auto &o : w_.obstacles) renew_name(*o);
  for (size_t k = 0; k < cuts_.size(); ++k) w_.tools[k]->cuts.bodies.swap(cuts_[k]);
  w_.sensed.swap(sensed_);
  w_.may_touch.decisions.swap(decisions_);
  w_.steps->self_bodies.swap(self_);  // they are kept by id
  for (auto *const list : {&w_.bodies, &w_.emptied, &w_.rolled_back}) sort_by_id(*list);
  sort_by_id(w_.obstacles);
  sort_by_id(w_.rigid_sets);
  sort_by_id(w_.tools);
}

SnapshotIds::~SnapshotIds() {
  if (to_.empty()) return;
  // tools first: what is kept of them is in the order that they had
  for (auto word = words_.rbegin(); word != words_.rend(); ++word) *word->at = word->before;
  sort_by_id(w_.tools);
  exchange();
}

void SnapshotIds::keep() noexcept {
  if (to_.empty()) return;
  w_.step_impulses.pairs.clear();  // of the step before, by the ids of that time
  to_.clear();
}

}  // namespace dfm
