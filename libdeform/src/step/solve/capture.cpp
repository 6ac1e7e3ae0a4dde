#include "step/solve/capture.h"

#include <cinttypes>
#include <utility>

#include "contact/problem.h"
#include "core/error.h"
#include "core/file.h"
#include "plugin/context.h"
#include "state/world.h"
#include "step/context.h"
#include "step/solve/solve_islands.h"
#include "step/solve/tolerance.h"

namespace dfm {

std::unique_ptr<ContactProblem> take_problem(const World &w, const StepContext &step,
                                             const SolveIsland &own) {
  auto out = std::make_unique<ContactProblem>();
  out->h = step.h;
  out->rest = tangent_at_rest(w, step.h);
  out->bond = own.tolerance.bond;
  out->most_normal = own.tolerance.most_normal;
  each_row(own.part.contacts, [&](uint32_t i) {
    out->normal.push_back(own.tolerance.normal[i]);
    out->tangent.push_back(own.tolerance.tangent[i]);
  });
  for (const LawInstance *law : w.pairs.laws) out->laws.push_back({law->type->id, law->params});
  if (!out->take(step.rows, own.part, step.state, step.systems)) return nullptr;
  return out;
}

void write_problems(const World &w, StepContext &step) {
  Capture &capture = *step.capture;
  try {
    for (SolveIsland &own : step.solve_islands->all()) {
      if (!own.problem) continue;
      const std::unique_ptr<ContactProblem> problem = std::exchange(own.problem, nullptr);
      const bool failed = own.failed || own.bad || own.thrown || own.residual.required > 1;
      const uint64_t number = ++capture.solved;
      if (!failed && (capture.every == 0 || number % capture.every != 0)) continue;
      AtomicFile file(format("%s/%06" PRIu64 "-%08" PRIu64 "%s.contact", capture.folder.c_str(), w.step_count,
                             number, failed ? "-unsolved" : ""));
      file.write(problem->bytes());
      file.commit();
    }
  } catch (const Error &error) {
    w.context->logf(DFM_LOG_WARNING, "no more contact problems are written: %s", error.what());
    step.capture.reset();
  }
}

}  // namespace dfm
