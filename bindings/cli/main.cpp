// The `deform` command.
#include "arguments.h"
#include "become.h"
#include "cli.h"
#include "effect_costs.h"

int main(int argc, char **argv) {
  return cli::command_line(argc, argv, [](cli::Command top, cli::Globals &globals, int *exit_code) {
    cli::add_run(top, globals, exit_code, nullptr);
    cli::add_replay(top, globals, exit_code);
    cli::add_explain(top, globals, exit_code, nullptr);
    cli::add_program(top, globals, cli::kCalibrate);
    cli::add_mesh(top, globals, exit_code);
    cli::add_plugin(top, globals, exit_code);
    cli::add_program(top, globals, cli::kCcd);
    cli::add_program(top, globals, cli::kFriction);
    cli::add_program(top, globals, cli::kCost);
    cli::add_program(top, globals, cli::kRollback);
#ifdef _WIN32
    cli::add_program(top, globals, {"sweep", "deform-sweep", cli::kSweepAbout});
    cli::add_program(top, globals, {"fit", "deform-fit", cli::kFitAbout});
#elif !defined(__EMSCRIPTEN__)
    cli::add_study(top, globals, "sweep", cli::kSweepAbout);
    cli::add_study(top, globals, "fit", cli::kFitAbout);
    cli::add_worker(top, globals, exit_code);
#endif
    cli::add_program(top, globals, cli::kServe);
    cli::add_program(top, globals, cli::kView);
    cli::add_contact(top, globals, exit_code);
    cli::add_montage(top, globals, exit_code);
  });
}
