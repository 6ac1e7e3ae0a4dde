// How bodies would move without contact, and where that puts their surfaces: stages model, predict,
// gather, broad.
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "integrate/symplectic_euler.h"
#include "world/context.h"
#include "world/first_failure.h"
#include "world/stages.h"
#include "surfel/make_surface.h"
#include "world/bounds.h"

namespace dfm {

bool stage_model(World &w, StepContext &step, uint32_t *trouble) {
  FirstFailure failed;
  w.context->tasks.parallel_for(
      static_cast<uint32_t>(step.active.size()), 1, [&](uint32_t begin, uint32_t end) {
        for (const uint32_t i : std::span(step.active).subspan(begin, end - begin)) {
          Body &b = *w.bodies[i];
          if (b.model.stepper) continue;
          std::copy(b.p.load.begin(), b.p.load.end(), b.p.f.begin());
          const dfm_kin k =
              b.kin(w.time, step.h, b.model.state_out.empty() ? nullptr : b.model.state_out.data());
          if (b.model.call("add_forces",
                           [&] { return b.model.ops->add_forces(b.model.self, &k, b.p.f.data()); }) != DFM_OK)
            failed.note(i);
        }
      });
  if (failed.body == kNone) return true;
  *trouble |= DFM_TROUBLE_PLUGIN;
  const Body &b = *w.bodies[failed.body];
  set_last_error(format("step %llu, body '%s': model '%s' could not compute its forces; take a smaller step "
                        "or change the model",
                        static_cast<unsigned long long>(w.step_count), b.name.c_str(), b.model.type->id)
                     .c_str());
  return false;
}

bool stage_predict(World &w, StepContext &step, uint32_t *trouble) {
  const bool touches = w.plan.touches();
  FirstFailure failed;
  w.context->tasks.parallel_for(
      static_cast<uint32_t>(step.active.size()), 1, [&](uint32_t begin, uint32_t end) {
        for (const uint32_t i : std::span(step.active).subspan(begin, end - begin)) {
          Body &b = *w.bodies[i];
          bool good = true;
          if (b.model.stepper) {
            // A self-stepping body takes loads and gravity as external forces and answers the surfels'
            // mean velocities.
            for (uint32_t k = 0; k < b.p.n; ++k) {
              double *const f = &b.p.f[size_t(k) * kStride];
              store3(f, load3(&b.p.load[size_t(k) * kStride]) + b.p.mass[k] * w.gravity);
            }
            const dfm_kin k = b.kin(w.time, step.h, nullptr);
            Array<double> &u = b.surfel_impulse;  // [nsurfel,3]: free until distribute
            good = b.model.call("predict", [&] {
              return b.model.stepper->predict(b.model.self, &k, b.p.f.data(), u.data());
            }) == DFM_OK;
            for (uint32_t s = 0; s < b.surface.nsurfel; ++s) {
              store3(&b.surface.v[size_t(s) * kStride], load3(&u[3 * size_t(s)]));
              for (size_t c = 0; c < 3; ++c) good = good && std::fabs(u[3 * size_t(s) + c]) <= kLight;
            }
            if (b.surface.identity()) gather_surface(b.surface, b.p.x.data(), nullptr);
          } else {
            step.free_kinetic[i] = predict(b.p, w.gravity, step.h);
            // A lightest point at the limit has so much alone; who has less need not be looked at
            // point by point.
            good = step.free_kinetic[i] < 0.5 * b.p.least_mass * (kLight * kLight) ||
                   (std::isfinite(step.free_kinetic[i]) &&
                    largest_coordinate(b.p.v_free.data(), b.p.n, kStride) <= kLight);
            if (touches && b.surface.identity()) gather_surface(b.surface, b.p.x.data(), b.p.v_free.data());
          }
          if (!good) failed.note(i);
        }
      });
  if (failed.body == kNone) return true;
  const Body &b = *w.bodies[failed.body];
  *trouble |= DFM_TROUBLE_NONFINITE;
  const double speed = b.model.stepper ? NAN : largest_coordinate(b.p.v_free.data(), b.p.n, kStride);
  const std::string what = speed > kLight && std::isfinite(speed)
                               ? format("a point would move at %.3g m/s, faster than light", speed)
                               : "forces or velocities are not finite";
  set_last_error(format("step %llu, body '%s': %s (model '%s'); take a smaller step, or look for loads and "
                        "parameters that are too large",
                        static_cast<unsigned long long>(w.step_count), b.name.c_str(), what.c_str(),
                        b.model.type->id)
                     .c_str());
  return false;
}

// Surfels that hang on several phyxels: rows of N are independent of each other, so they are cut
// among the threads.
void stage_gather(World &w, StepContext &step) {
  for (const uint32_t i : step.active) {
    const auto &b = w.bodies[i];
    if (b->surface.identity()) continue;
    // a self-stepping model has answered its surfels' velocities
    const double *const v = b->model.stepper ? nullptr : b->p.v_free.data();
    w.context->tasks.parallel_for(b->surface.nsurfel, 1024, [&](uint32_t begin, uint32_t end) {
      gather_rows(b->surface, b->p.x.data(), v, begin, end);
    });
  }
}

void stage_broad(World &w, StepContext &step) {
  try {
    step.broad.update(step.body_views, step.obstacle_views, w.filter, step.h, w.offset);
  } catch (...) {
    step.broad.clear();  // out of memory half way through its lists: they are made anew next time
    throw;
  }
}

}  // namespace dfm
