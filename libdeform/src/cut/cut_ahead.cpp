// What a cut makes anew follows from the cells of the body and from which faces open, not from how the body
// moves (make_shape). So it is the same whenever and by whomever it is made: by the thread beside the steps,
// by the step itself where that thread is late, or anew after a restore. Only the exchange, with the state of
// the body, belongs to the step (take_shape), and which step that is follows from the time alone.
//
// The thread works on a copy of the structure, and makes that for the next cut too, so that a step neither
// waits for it nor copies the body.
#include "cut/cut_ahead.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <exception>
#include <map>
#include <vector>

#include "broad/self_list.h"
#include "core/background.h"
#include "core/error.h"
#include "cut/body_shape.h"
#include "cut/cut.h"
#include "cut/separate.h"
#include "state/world.h"
#include "step/context.h"
#include "step/self_contact.h"
#include "step/stages.h"
#include "step/step_bound.h"
#include "world/may_cut.h"

namespace dfm {

// The pairs of the whole surface that may touch each other, which the first cut of a body needs. They are
// listed where the body is as it begins to wait; the step that follows the cut finds anew what has moved far
// since. Who uses other lists gets the same bits, so no step makes these.
struct ListJob : Background::Job {
  std::shared_ptr<const Body> from;
  Surface surface;
  SelfList list;
  double h, offset;
  bool made = false;

  ListJob(const World &w, const Body &b)
      : from(b.ahead.structure), list(w.meters.detection.memory(), surface), h(w.steps->h), offset(w.offset) {
    use_memory(w.meters.detection.memory(), surface.x, surface.v);
    surface.x = b.surface.x;
    surface.v = b.surface.v;
  }
  void run() noexcept override {
    try {
      const Array<double> x = std::move(surface.x), v = std::move(surface.v);
      surface = from->surface;
      surface.x = x;
      surface.v = v;
      list.update(h, offset);
      made = true;
    } catch (...) {  // the step after the cut lists them
    }
  }
};

struct CutJob : Background::Job {
  std::shared_ptr<const Body> from;
  Array<uint64_t> faces;
  double open_time;  // s, when they open: what follows from the time may not follow from when the job runs
  std::unique_ptr<MadeShape> made;
  std::shared_ptr<Body> next;         // the structure that is left
  std::unique_ptr<BodyShape> before;  // what the body was, once it has been cut; the thread frees it
  std::exception_ptr error;
  std::shared_ptr<ListJob> list;  // of a body that has no lists of itself yet; null: none

  explicit CutJob(const Body &b)
      : from(b.ahead.structure), faces(b.world->memory()), open_time(b.ahead.open_time) {
    for (const AheadFace &f : b.ahead.faces) faces.push_back(f.face);
  }
  void run() noexcept override {
    try {
      made = make_opened(*from, faces, open_time);
      next = structure_left(*from, *made);
    } catch (...) {
      error = std::current_exception();
    }
  }
};

namespace {

// A thread that has had no core for so long is not waited for. One that has is: where a program steps faster
// than its clock, the delay is shorter than what a cut takes.
constexpr std::chrono::microseconds kPatience{2000};

bool is_of(const Body &structure, const Body &b) {
  const ModelOrigin &mine = structure.origin, &its = b.origin;
  return structure.shape == b.shape && structure.model.type == b.model.type && mine.params == its.params &&
         mine.held == its.held && mine.integrator == its.integrator &&
         std::memcmp(&mine.frame, &its.frame, sizeof mine.frame) == 0 &&
         structure.integrator.used == b.integrator.used && structure.model.params == b.model.params &&
         structure.switched_off.requested == b.switched_off.requested &&
         structure.p.dampers.lag == b.p.dampers.lag;
}

void renew_structure(Body &b) {
  CutsAhead &a = b.ahead;
  if (a.structure && is_of(*a.structure, b)) return;
  a.structure = structure_of(b);
  a.job.reset();
}

bool is_there(const Body &b, const AheadFace &f) {
  const auto [i, j] = present_cells(b, f.face);
  return i != kNone && j != kNone;
}

// The made cut, by whoever has made it. It is for one use: an exchange that fails leaves nothing of it.
std::shared_ptr<CutJob> finish(World &w, Body &b) {
  CutsAhead &a = b.ahead;
  renew_structure(b);
  // what the thread has refused, perhaps for want of memory, is tried once more
  if (!a.job || !w.background || !w.background->finish(a.job, kPatience) || a.job->error) {
    const std::shared_ptr<ListJob> list = a.job ? a.job->list : nullptr;
    a.job = std::make_shared<CutJob>(b);
    a.job->list = list;
    a.job->run();
  }
  if (const auto &list = a.job->list;
      list && w.background->finish(list, kPatience) && list->made && a.job->made)
    a.job->made->list = {list, &list->list};
  return std::move(a.job);
}

void open_faces_of(World &w, Body &b) {
  CutsAhead &a = b.ahead;
  std::map<uint64_t, uint32_t> by;
  for (const AheadFace &f : a.faces) by[f.by] += is_there(b, f);
  const uint64_t id = b.id;
  reserve_cut_events(w, by.size());
  const bool any = std::any_of(by.begin(), by.end(), [](const auto &part) { return part.second > 0; });
  if (any) {
    std::shared_ptr<CutJob> job = finish(w, b);
    if (job->error) std::rethrow_exception(job->error);
    job->before = put_opened(b, *job->made);
    job->next->shape = b.shape;
    a.structure = std::move(job->next);
    if (w.background) w.background->drop(std::move(job));  // with the structure and the shape before
  }
  a.job.reset();
  a.faces.swap(a.later);
  a.later.clear();
  a.open_time += a.delay;
  for (const auto &[part, n] : by)
    if (n > 0) add_event(w, DFM_EVENT_CUT, id, part, n, w.time);
  if (any) separate_if_requested(b);
}

// The stable step of the new shapes. Evaluating it takes longer than the exchange, and the next step finds
// the new pairs of the surfaces, so the step after that one evaluates it (doc/decisions/cutting.md). Where
// there is no estimate, it is evaluated now, at the positions at which the next step begins.
void set_bound(World &w, const WorldBound &before, double share, double dt) {
  if (!bound_expired(w) || estimate_bound(w, before, share, dt)) return;
  try {
    update_bound(w);
  } catch (...) {
    w.bound.age = kNone;  // the next step says what is wrong
  }
}

}  // namespace

void set_cut_delay(Body &b, double delay) {
  if (!(delay >= 0 && std::isfinite(delay)))
    refuse(b, ": cuts cannot wait for %g s; give the seconds until faces open, or 0", delay);
  if (b.piece_of)
    refuse(b, DFM_E_STATE,
           " is a piece of '%s', and its cuts wait as long as those of that body; set it there",
           b.whole_name.c_str());
  if (delay > 0) check_may_cut(b, b.model);
  std::vector<Body *> all;  // it and its pieces
  for (const auto *list : {&b.world->bodies, &b.world->emptied, &b.world->rolled_back})
    for (auto &other : *list)
      if (other.get() == &b || other->piece_of == b.id) all.push_back(other.get());
  for (const Body *const other : all)
    if (!other->ahead.faces.empty() && !other->emptied && !other->rolled_back)
      refuse(*other, DFM_E_STATE,
             ": %zu faces wait to be opened; set how long its cuts wait before a tool cuts it",
             other->ahead.faces.size() + other->ahead.later.size());
  std::vector<std::shared_ptr<const Body>> structures;  // now: the first step has no time for it
  for (const Body *const other : all) structures.push_back(delay > 0 ? structure_of(*other) : nullptr);
  for (size_t i = 0; i < all.size(); ++i) {
    all[i]->ahead = {};
    all[i]->ahead.delay = delay;
    all[i]->ahead.structure = std::move(structures[i]);
  }
}

void open_later(Body &b, std::span<const uint64_t> faces, uint64_t by) {
  CutsAhead &a = b.ahead;
  const bool first = a.faces.empty();
  std::vector<AheadFace> &list = first ? a.faces : a.later;
  std::vector<AheadFace> more(list);
  for (const uint64_t face : faces) more.push_back({face_of_whole(b, face), by});
  std::sort(more.begin(), more.end());
  list.swap(more);
  if (first) a.open_time = b.world->time + a.delay;
}

void open_scheduled(World &w, double dt) {
  std::vector<Body *> opening;  // bodies that have cells keep their places; pieces come after
  for (auto &b : w.bodies)
    if (!b->ahead.faces.empty() && w.time + 0.5 * dt > b->ahead.open_time) opening.push_back(b.get());
  if (opening.empty()) return;
  const WorldBound before = w.bound;
  const size_t bodies = w.bodies.size();
  double share = 1;
  for (Body *const b : opening) {
    const double at_rest = b->integrator.step;
    open_faces_of(w, *b);
    share = std::min(share, b->integrator.step / at_rest);
  }
  set_bound(w, before, w.bodies.size() == bodies ? share : 0, dt);
}

void prepare_cuts(World &w) {
  for (auto &b : w.bodies) {
    CutsAhead &a = b->ahead;
    if (!(a.delay > 0)) continue;
    renew_structure(*b);
    if (a.faces.empty() || a.job) continue;
    if (!w.background) w.background = std::make_unique<Background>();
    a.job = std::make_shared<CutJob>(*b);
    std::shared_ptr<ListJob> &list = a.job->list;  // first, since it is short
    if (lists_after_cut(w, *b) && found_memory([&] { list = std::make_shared<ListJob>(w, *b); }))
      w.background->start(list);
    w.background->start(a.job);
  }
}

void inherit_cuts(const Body &from, Body &piece) {
  CutsAhead &a = piece.ahead;
  a = {};
  a.delay = from.ahead.delay;
  a.faces = from.ahead.faces;
  a.later = from.ahead.later;
  a.open_time = from.ahead.open_time;
}

}  // namespace dfm
