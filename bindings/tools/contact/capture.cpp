// deform-capture, which `deform run --contact-problems` starts: `deform run`, with contact problems in files.
#include <cinttypes>
#include <map>
#include <mutex>

#include "api/objects.h"
#include "arguments.h"
#include "cli.h"
#include "core/file.h"
#include "messages.h"
#include "plugin/context.h"
#include "problem.h"
#include "step/context.h"
#include "step/solve/solve_islands.h"
#include "step/solve/tolerance.h"

namespace {

using namespace dfm;

class Capture {
 public:
  Capture(World &w, const std::string &folder, uint32_t every) : w_(w), folder_(folder), every_(every) {}

  // What the solve of this island is about to be given. Other islands may be solved at the same time.
  void take(const SolveIsland &own) {
    if (folder_.empty()) return;
    const StepContext &step = *w_.steps;
    ContactProblem problem;
    problem.h = step.h;
    problem.rest = tangent_at_rest(w_, w_, step.h);
    problem.bond = own.tolerance.bond;
    problem.most_normal = own.tolerance.most_normal;
    each_row(own.part.contacts, [&](uint32_t i) {
      problem.normal.push_back(own.tolerance.normal[i]);
      problem.tangent.push_back(own.tolerance.tangent[i]);
    });
    for (const LawInstance *law : w_.pairs.laws) problem.laws.push_back({law->type->id, law->params});
    // where a model cannot tell its forces, the solve finds that, too
    if (!problem.take(step.rows, own.part, step.state, step.systems)) return;
    const std::lock_guard one(mutex_);
    taken_[&own] = problem.bytes();
  }
  // After the islands have been solved. Ends the capture, with a warning, where a file cannot be written.
  void write() {
    try {
      for (const SolveIsland &own : w_.steps->solve_islands->all()) {
        const auto bytes = taken_.find(&own);
        if (bytes == taken_.end()) continue;
        const bool failed = own.failed || own.bad || own.residual.required > 1;
        const uint64_t number = ++solved_;
        if (!failed && (every_ == 0 || number % every_ != 0)) continue;
        AtomicFile file(format("%s/%06" PRIu64 "-%08" PRIu64 "%s.contact", folder_.c_str(), w_.step_count,
                               number, failed ? "-unsolved" : ""));
        file.write(bytes->second);
        file.commit();
      }
    } catch (const Error &error) {
      w_.context->logf(DFM_LOG_WARNING, "no more contact problems are written: %s", error.what());
      folder_.clear();
    }
    taken_.clear();
  }

 private:
  World &w_;
  std::string folder_;   // empty: the capture has ended
  uint32_t every_;       // problem that is written; 0: those that are not solved
  uint64_t solved_ = 0;  // problems so far, the others included
  std::mutex mutex_;
  std::map<const SolveIsland *, std::string> taken_;
};

void capture(dfm_world world, const std::string &folder, uint32_t every) {
  cli::need(as_status(to_change<world_of>, world, [&](World &w) {
    w.steps->on_solve = [own = std::make_shared<Capture>(w, folder, every)](const SolveIsland *island) {
      island ? own->take(*island) : own->write();
    };
  }));
}

}  // namespace

int main(int argc, char **argv) {
  return cli::command_line(argc, argv, [](cli::Command top, cli::Globals &globals, int *exit_code) {
    cli::add_run(top, globals, exit_code, capture);
  });
}
