#include "deform/callback.h"

#include "api/objects.h"
#include "state/obstacle.h"
#include "step/stages.h"

using namespace dfm;

namespace {

// The tables are rebuilt before the next step, with the pairs that may touch now.
void decide_pairs_again(World &w) {
  w.overlaps.all = true;
  wake_all(w);
  w.changed = true;
}

}  // namespace

dfm_status dfm_world_set_may_touch(dfm_world world, dfm_may_touch_fn may_touch, void *user) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    w.may_touch = {may_touch, user, {}};
    decide_pairs_again(w);
  });
}

dfm_status dfm_world_ask_again(dfm_world world, uint64_t a, uint64_t b) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    uint64_t first = a ? id_of(w, a, "a") : 0, second = b ? id_of(w, b, "b") : 0;
    if (first == 0) std::swap(first, second);
    std::erase_if(w.may_touch.decisions, [&](const PairDecision &p) {
      const auto has = [&](uint64_t id) { return id == 0 || p.a == id || p.b == id; };
      return has(first) && has(second);
    });
    decide_pairs_again(w);
  });
}

dfm_status dfm_world_set_pre_solve(dfm_world world, dfm_pre_solve_fn pre_solve, void *user) {
  return as_status(to_change<world_of>, world, [&](World &w) {
    w.pre_solve = {pre_solve, user};
    wake_all(w);
  });
}
