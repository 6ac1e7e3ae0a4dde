#include "cut/planned_cut.h"

#include <algorithm>
#include <vector>

#include "cut/separate.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/stages.h"
#include "world/may_cut.h"
#include "world/model_change.h"

namespace dfm {
namespace {

constexpr double kOnTime = 1e-6;  // of a step: a cut may be early by this share

// The body and its pieces; a piece has none.
std::vector<Body *> with_pieces(Body &b) {
  std::vector<Body *> out{&b};
  for (auto &other : b.world->bodies)
    if (other->piece_of == b.id) out.push_back(other.get());
  return out;
}

// One planned cut, made through a body and all its pieces. after: how many planned cuts they have left.
struct Made {
  uint64_t whole;
  double t;
  size_t after;
  bool splits, met;
};

void note(std::vector<Made> &all, const Body &b, const PlannedCut &cut, bool met) {
  const uint64_t whole = b.piece_of ? b.piece_of : b.id;
  const size_t after = b.planned_cuts.size();
  for (Made &m : all)
    if (m.whole == whole && m.t == cut.t && m.after == after) {
      m.met = m.met || met;
      return;
    }
  all.push_back({whole, cut.t, after, cut.how == DFM_CUT_SPLIT, met});
}

void warn(const World &w, const std::vector<Made> &all) {
  for (const Made &m : all) {
    const auto whole = [&](auto &b) { return b->id == m.whole || b->piece_of == m.whole; };
    const auto b = std::find_if(w.bodies.begin(), w.bodies.end(), whole);
    if (m.met || b == w.bodies.end()) continue;
    w.context->warn(
        "body '%s': its cut at %g s has met no %s; give the place where the body is at that time, in the "
        "axes of the world%s",
        ((*b)->piece_of ? (*b)->whole_name : (*b)->name).c_str(), m.t,
        m.splits ? "closed face between two cells" : "cell",
        m.splits ? ", and no slice thinner than a cell" : "");
  }
}

CutReport cut_alone(Body &b, const CutShape &shape, uint32_t how, uint32_t most) {
  return how == DFM_CUT_SPLIT ? split_by_blade(b, shape, most) : remove_by_shape(b, shape, most);
}

}  // namespace

CutReport make_cut(Body &b, const CutShape &shape, uint32_t how, uint32_t most) {
  CutReport out = cut_alone(b, shape, how, most);
  separate_if_requested(b, out);
  return out;
}

void plan_cut(Body &b, const PlannedCut &cut) {
  const std::vector<Body *> all = with_pieces(b);
  std::vector<std::vector<PlannedCut>> lists;
  for (const Body *const part : all) {
    check_may_cut(*part, part->model);
    auto &list = lists.emplace_back(part->planned_cuts);
    const auto later = [&](const PlannedCut &c) { return c.t > cut.t; };
    list.insert(std::find_if(list.begin(), list.end(), later), cut);
  }
  const auto exchange = [&]() noexcept {
    for (size_t i = 0; i < all.size(); ++i) all[i]->planned_cuts.swap(lists[i]);
  };
  exchange();
  try {
    for (Body *const part : all)  // changes before the cut lead to models that can be cut
      if (!part->switches.empty() || !part->rule.empty()) rehearse(*part, part->switches, part->rule, false);
  } catch (...) {
    exchange();
    throw;
  }
}

void plan_no_cuts(Body &b) {
  for (Body *const part : with_pieces(b)) part->planned_cuts.clear();
}

// Pieces take over the cuts of the list, so a cut leaves the list before it is made; without memory it is put
// back. Its event is reported before its parts become pieces, because these may have to wait for memory of
// their own.
void make_planned_cuts(World &w, double dt) {
  const auto is_scheduled = [&](const auto &b) {
    return !b->planned_cuts.empty() && b->planned_cuts.front().t <= w.time + kOnTime * dt;
  };
  std::vector<Made> made;
  while (true) {
    const auto at = std::find_if(w.bodies.begin(), w.bodies.end(), is_scheduled);
    if (at == w.bodies.end()) break;
    Body &b = **at;
    const PlannedCut cut = b.planned_cuts.front();
    b.planned_cuts.erase(b.planned_cuts.begin());
    CutReport done;
    try {
      reserve_cut_events(w, 1);
      made.reserve(made.size() + 1);
      done = cut_alone(b, cut.shape, cut.how, cut.most);
    } catch (...) {
      b.planned_cuts.insert(b.planned_cuts.begin(), cut);  // there is room
      throw;
    }
    const uint32_t n = cut.how == DFM_CUT_SPLIT ? done.opened : done.cells;
    note(made, b, cut, n > 0);
    if (n == 0) continue;
    add_event(w, DFM_EVENT_CUT, b.id, b.id, n, w.time);
    separate_if_requested(b, done);
  }
  warn(w, made);
}

}  // namespace dfm
