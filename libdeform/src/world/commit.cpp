// Where bodies end: contact impulses to points, then positions and velocities at the end of the sub-step.
#include <algorithm>

#include "core/error.h"
#include "integrate/symplectic_euler.h"
#include "world/context.h"
#include "world/first_failure.h"
#include "world/stages.h"

namespace dfm {

void stage_distribute(StepContext &step) {
  distribute(step.contacts, step.rows.frame.data(), step.rows.impulse.data(), step.sinks);
}

// Self-stepping bodies write their end of the sub-step beside the present state, so that one that fails
// leaves all bodies as they were.
bool commit_steppers(World &w, StepContext &step, uint32_t *trouble) {
  FirstFailure failed;
  w.context->tasks.parallel_for(
      static_cast<uint32_t>(step.active.size()), 1, [&](uint32_t begin, uint32_t end) {
        for (const uint32_t i : std::span(step.active).subspan(begin, end - begin)) {
          Body &b = *w.bodies[i];
          if (!b.model.stepper) continue;
          if (!w.plan.touches()) std::fill(b.surfel_impulse.begin(), b.surfel_impulse.end(), 0.0);
          const dfm_kin k =
              b.kin(w.time, step.h, b.model.state_out.empty() ? nullptr : b.model.state_out.data());
          // x and v out must not alias k: v_free and f serve as the new arrays
          double *const x = b.p.f.data(), *const v = b.p.v_free.data();
          if (b.model.call("commit", [&] {
                return b.model.stepper->commit(b.model.self, &k, b.surfel_impulse.data(), x, v);
              }) != DFM_OK) {
            failed.note(i);
            continue;
          }
          double poison = 0;
          for (size_t j = 0; j < size_t(b.p.n) * kStride; ++j) poison += 0.0 * x[j] + 0.0 * v[j];
          if (poison != 0) failed.note(i);
        }
      });
  if (failed.body == kNone) return true;
  *trouble |= DFM_TROUBLE_PLUGIN;
  const Body &b = *w.bodies[failed.body];
  set_last_error(format("step %llu, body '%s': model '%s' could not end its step, or ended it with something "
                        "not finite; take a smaller step or change the model",
                        static_cast<unsigned long long>(w.step_count), b.name.c_str(), b.model.type->id)
                     .c_str());
  return false;
}

bool stage_commit(World &w, StepContext &step, uint32_t *trouble) {
  const bool steppers =
      std::any_of(w.bodies.begin(), w.bodies.end(), [](auto &b) { return b->model.stepper != nullptr; });
  if (steppers && !step.guard.stepped && !commit_steppers(w, step, trouble)) return false;
  step.guard.stepped = false;
  const double way = step.h * step.guard.motion;  // the guard may leave some of it out
  const bool touched = w.plan.has(StageRole::gives_impulses) && step.rows.n > 0;
  book_energy(w, step, step.guard.motion);
  w.context->tasks.parallel_for(
      static_cast<uint32_t>(step.active.size()), 1, [&](uint32_t begin, uint32_t end) {
        for (const uint32_t i : std::span(step.active).subspan(begin, end - begin)) {
          Body &b = *w.bodies[i];
          if (b.model.stepper) {
            for (size_t j = 0; step.guard.motion < 1 && j < b.p.x.size(); ++j)
              b.p.f[j] = b.p.x[j] + step.guard.motion * (b.p.f[j] - b.p.x[j]);
            b.p.x.swap(b.p.f);
            b.p.v.swap(b.p.v_free);
          } else {
            commit(b.p, touched, way);
          }
          b.model.commit_state();
          if (!w.plan.touches()) continue;
          Vec3 sum;
          for (uint32_t s = 0; s < b.surface.nsurfel; ++s) sum += load3(&b.surfel_impulse[3 * size_t(s)]);
          b.contact_impulse += sum;
        }
      });
  if (w.plan.touches()) {
    keep_contacts(w, step);
    add_impulses(w);
  }
  return true;
}

}  // namespace dfm
