// deform-rollback, which `deform rollback SCENE.json` starts: `deform run` by the collision solution of
// Zerbato (2010), for comparison.
#include <memory>
#include <string>

#include "arguments.h"
#include "become.h"
#include "messages.h"
#include "rollback/scheme.h"
#include "run.h"

namespace cli {
namespace {

void add_rollback(Command app, Globals &globals, int *exit_code) {
  const auto options = std::make_shared<RunOptions>();
  Command sub = app.command(kRollback.name, kRollback.about);
  add_run_options(sub, *options);
  sub.calls([=, &globals] {
    RunOptions run = *options;
    for (const char *const own :
         {"/time/mode=dynamic", "/time/integrator=symplectic_euler", "/contact/guard=false"}) {
      const std::string whole = own, pointer = whole.substr(0, whole.find('=') + 1);
      for (const std::string &set : options->set)
        if (set.starts_with(pointer))
          throw Failure(kBadInput, "--set " + set + ": the collision solution needs " + own + "; omit it");
      run.set.push_back(own);
    }
    dfm::rollback::Scheme scheme;
    run.step = [&scheme](dfm_world world, double dt, uint32_t *trouble) {
      const dfm_status status = scheme.step(world, dt, trouble);
      if (status == DFM_E_UNSUPPORTED) need(status);  // throws: not the simulation has stopped itself
      return status;
    };
    run_scene(run, globals);
    *exit_code = kDone;
  });
}

}  // namespace
}  // namespace cli

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::add_rollback); }
