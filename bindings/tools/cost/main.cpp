// deform-cost, which `deform cost SCENE`, `deform explain SCENE --costs` and `deform calibrate` start: what
// accuracy and effects cost on this scene, and models on this machine.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>

#include "arguments.h"
#include "become.h"
#include "calibrate.h"
#include "cost/chart.h"
#include "cost/report.h"
#include "effect_costs.h"
#include "file.h"
#include "messages.h"
#include "out_folder.h"
#include "run_folder.h"

namespace cli {
namespace {

struct CostOptions {
  std::string scene, out, apply;
  cost::StudyOptions study;
  unsigned parallel = 0;
};

std::vector<std::string> split(const std::vector<std::string> &lists) {
  std::vector<std::string> out;
  for (const std::string &list : lists)
    for (size_t i = 0; i <= list.size();) {
      const size_t end = std::min(list.find(',', i), list.size());
      if (end > i) out.push_back(list.substr(i, end - i));
      i = end + 1;
    }
  return out;
}

int cost_of(CostOptions options, Globals &globals) {
  if (options.out.empty()) options.out = out_folder(options.scene, "cost");
  if (!options.apply.empty()) refuse_same("--apply", options.apply, options.scene);
  options.study.axes = split(options.study.axes);
  const cost::Subject subject = cost::read_subject(options.scene, globals);
  const std::string cells_stay = cost::why_cells_stay(subject);
  cost::Study study;
  {
    cost::Runs runs(subject, options.out, options.parallel, options.study.budget,
                    !globals.quiet && !globals.json);
    study = cost::make_study(subject, cells_stay, options.study, runs);
  }
  const std::string report = cost::json_report(subject, study, cost::scene_patch(subject, study));
  write_whole(options.out + "/cost.csv", cost::csv_text(subject, study));
  write_whole(options.out + "/cost.json", report);
  write_whole(options.out + "/cost.html", cost::page_html(subject, study));
  if (!cost::draw_file(subject, study, options.out + "/cost.png"))
    warn("no cost.png: this deform was built without the renderer; cost.html holds the same chart");
  if (globals.json) {
    std::fputs(report.c_str(), stdout);
  } else {
    if (!globals.quiet) {
      std::fputs(cost::table_text(subject, study).c_str(), stdout);
      std::printf("written: %s\n", shown(options.out).c_str());
    }
  }
  if (options.apply.empty()) return kDone;
  if (const std::string why = cost::refusal_to_apply(study); !why.empty()) return fail(why);
  cost::write_applied(subject, study, options.apply);
  if (study.mesh_stays)
    warn("--apply: what is applied is proven for model and step on the scene's own mesh; " +
         cost::mesh_doubt(study) + "; " + cost::next_step(study));
  return kDone;
}

void add_commands(Command app, Globals &globals, int *exit_code) {
  add_calibrate(app, globals, exit_code);
  add_explain(app, globals, exit_code, measure_effects);
  auto options = std::make_shared<CostOptions>();
  Command sub = app.command(kCost.name, kCost.about);
  sub.option("SCENE", options->scene, "scene file (JSON)").required();
  sub.option("--budget", options->study.budget,
             "time limit in seconds for all runs in DIR; a later call with a larger limit continues there")
      .positive()
      .with_default()
      .type_name("SECONDS");
  sub.option("--target", options->study.target, "relative error for which the cheapest choice is sought")
      .positive()
      .with_default()
      .type_name("ERROR");
  sub.option("--quantity", options->study.quantities,
             "what is compared: a probe, or com, force, work, volume, energy, touch, slip, liftoff, rest "
             "(all of them are in the files); may be repeated (all probes)")
      .type_name("NAME")
      .repeated();
  sub.option("--axes", options->study.axes,
             "what varies, with commas: model, time, mesh, cells, volume, contact, law, self, "
             "guard, precision (all)")
      .type_name("LIST")
      .repeated();
  sub.option("--out", options->out, "folder for the results (out/SCENE_cost)").type_name("DIR");
  sub.option("--apply", options->apply,
             "writes the scene with the cheapest choice that is proven to be within the target")
      .type_name("FILE");
  sub.calls([=, &globals] {
    // Runs are processes of one thread each; without the option as many at a time as there are processors.
    const unsigned all = std::max(1u, std::thread::hardware_concurrency());
    options->parallel = sub.given("--threads") && globals.threads ? globals.threads : all;
    *exit_code = cost_of(*options, globals);
  });
}

}  // namespace
}  // namespace cli

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::add_commands); }
