// Steps that fail, or are interrupted, in the middle.
#pragma once
#include "rigid.h"

namespace test {

// A rigid host whose body stays where it is. Armed, it lets so many sub-steps go well and fails in the next
// one, in the first call of `where` or a later one, or interrupts the world.
struct Saboteur {
  enum Where { predict, commit };
  static inline Where where = predict;
  static inline int left = -1, nth = 1, calls = 0;
  static inline dfm_world interrupts = 0;
  static inline double at = 0;  // s
  static void arm(Where here, int good, dfm_world interrupted = 0, int call = 1) {
    interrupts = interrupted;
    where = here;
    left = good;
    nth = call;
    at = -1;
  }
  static dfm_status strike(Where here, const dfm_rigid_step *step) {
    if (here != where) return DFM_OK;
    calls = step->t == at ? calls + 1 : 1;
    at = step->t;
    if (calls != nth || left-- != 0) return DFM_OK;
    return interrupts ? dfm_world_interrupt(interrupts) : dfm_status(DFM_E_FATAL);
  }

  // Asked after the sets that are there already.
  static void join(dfm_world w) {
    static const dfm_status known = [] {
      dfm_rigid_host t{};
      t.size = sizeof t;
      t.create = [](void *, const dfm_rigid_set_def *, void **self, uint32_t *group, uint32_t *nextra) {
        *self = &left;
        group[0] = 0;
        *nextra = 0;
        return dfm_status(DFM_OK);
      };
      t.destroy = [](void *) {};
      t.predict = [](void *, const dfm_rigid_step *step, double *v) {
        std::fill(v, v + 6, 0.0);
        return strike(predict, step);
      };
      t.respond = [](void *, const dfm_rigid_step *, uint32_t, double *m) {
        std::fill(m, m + 36, 0.0);
        return dfm_status(DFM_OK);
      };
      t.commit = [](void *, const dfm_rigid_step *step, const double *, dfm_rigid_state *state, double *) {
        state[0] = step->state[0];
        return strike(commit, step);
      };
      return dfm_rigid_host_register("saboteur", &t);
    }();
    ok(known);
    create(w, {box("saboteur", {0.1, 0.1, 0.1}, 1, {50, 0, 0})}, {}, "saboteur");
  }
};

}  // namespace test
