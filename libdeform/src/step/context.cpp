#include "step/context.h"

namespace dfm {

StepContext::StepContext(const Memory &m)
    : broad(m),
      narrow(m),
      rows(m),
      acceleration(m),
      proximal(m),
      batches(m),
      areas(m),
      exchange(m),
      renewal(m),
      next_store(m),
      last_report(m),
      islands(m) {
  use_memory(m, driven, free_kinetic, looks, lent, contacts, tolerance.normal, tolerance.tangent, disturbance,
             best_impulse, trial_response, tangents, match, sharing, aim, stands, ways, renewed,
             block_surfels, near, touching, active, woken, stirred);
  use_memory(m, state.law, state.fn, state.vt, state.ft_stop, state.area, state.dwell, state.bristle,
             state.ft, state.dft_dvt, state.dft_dfn, state.limit, state.bristle_out, state.mode, state.form,
             state.slip, state.linear);
  use_memory(m, guard.joined, guard.near, guard.hits, guard.speed, guard.change, guard.kept,
             guard.blocks.pieces);
  GuardMemory &known = guard.memory;
  use_memory(m, known.runs, known.old_runs, known.features, known.old_features, known.rest, known.old_rest,
             known.normal, known.old_normal, known.before);
}

}  // namespace dfm
