// deform-friction, which `deform friction CASE.json` starts: a friction law on a rig.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "arguments.h"
#include "become.h"
#include "cli.h"
#include "file.h"
#include "plot.h"
#include "rig.h"
#include "json_text.h"
#include "messages.h"
#include "system.h"

namespace cli {
namespace {

const double kStep = 1e-4;  // s, where --step is not given

struct FrictionOptions {
  std::string file, law, csv, plot;
  double step = kStep;
};

std::string csv_text(const RigResult &result) {
  std::string text;
  for (const std::string &name : result.columns) text += (text.empty() ? "" : ",") + name;
  char cell[40];
  for (const auto &row : result.rows) {
    for (size_t i = 0; i < row.size(); ++i) {
      std::snprintf(cell, sizeof cell, "%s%.17g", i ? "," : "\n", row[i]);
      text += std::isnan(row[i]) ? (i ? ",nan" : "\nnan") : cell;
    }
  }
  return text + "\n";
}

void print(const FrictionOptions &options, const Globals &globals, const FrictionCase &rig, const RigLaw &law,
           const RigResult &result) {
  if (globals.json) {
    JsonObject out;
    out.add("file", quoted(options.file), "case", quoted(rig.id), "kind", quoted(rig.kind), "law",
            quoted(law.type().id), "normal_force", law.normal_force(), "step", options.step, "steps",
            result.steps, "evaluations", law.evaluations(), "rows", result.rows.size(), "jumps",
            result.jumps);
    for (const auto &[name, values] : result.figures) {
      const bool list = values.size() != 1 || name.find("times") != std::string::npos ||
                        name.find("per_") != std::string::npos;
      out.add(name, list ? json_numbers(values) : number(values[0]));
    }
    out.add("warnings", json_words(warnings()));
    if (!result.stopped.empty()) out.add("stopped", quoted(result.stopped));
    std::fputs(as_utf8(indented(out.text())).c_str(), stdout);
  } else if (!globals.quiet) {
    std::printf(
        "%s\n  law          %s\n  drive        %s\n  steps        %llu of at most %g s, %.2f evaluations "
        "each\n  rows         %zu\n",
        shown(options.file).c_str(), law.type().id, rig.kind.c_str(),
        static_cast<unsigned long long>(result.steps), options.step,
        result.steps ? double(law.evaluations()) / double(result.steps) : 0.0, result.rows.size());
    for (const auto &[name, values] : result.figures) {
      if (values.empty()) continue;
      std::printf("  %-12s", name.c_str());
      for (size_t i = 0; i < values.size() && i < 8; ++i) std::printf(" %.9g", values[i]);
      std::printf(values.size() > 8 ? " ...\n" : "\n");
    }
    if (rig.drive == Drive::ramps)
      for (const auto &row : result.rows)
        std::printf("  %-12.4g %.9g\n", row[0], row.size() > 1 ? row[1] : 0.0);
  }
}

// Without matplotlib the rows are kept beside where the picture would be.
void picture(const FrictionOptions &options, const FrictionCase &rig, const RigLaw &law,
             const std::string &rows) {
  const std::string beside = name_of(path_of(options.plot).replace_extension(".csv"));
  const std::string kept = options.csv.empty() ? beside : options.csv;
  const std::string csv =
      options.csv.empty() ? options.plot + ".rows" + std::to_string(getpid()) : options.csv;
  if (options.csv.empty()) write_whole(csv, rows);
  bool made = false;
  try {
    made = plot_friction(csv, options.plot, rig.kind,
                         (rig.id.empty() ? rig.kind : rig.id) + ", law " + law.type().id);
  } catch (...) {
    if (options.csv.empty()) std::remove(csv.c_str());
    throw;
  }
  if (options.csv.empty()) std::remove(csv.c_str());
  if (made) return;
  if (options.csv.empty() && std::filesystem::exists(path_of(beside)) &&
      !holds(beside, rows.substr(0, rows.find('\n'))))
    throw Failure(kBadInput, beside +
                                 ": the rows would go here, for want of a python3 with matplotlib, and the "
                                 "file is there; give --csv");
  if (options.csv.empty()) write_whole(kept, rows);
  warn(
      "no picture: no python3 with matplotlib was found; install it (Debian: python3-matplotlib) or name one "
      "in DEFORM_PYTHON; the rows are in " +
      kept);
}

int friction(const FrictionOptions &options, const Globals &globals) {
  if (!(options.step > 0) || !std::isfinite(options.step))
    throw Failure(kBadInput, "--step is not above 0, expected the longest step in s");
  if (!options.csv.empty()) refuse_same("--csv", options.csv, options.file);
  if (!options.plot.empty() && path_of(options.plot).extension() != ".png")
    throw Failure(kBadInput, "--plot " + options.plot + ": the name of a picture must end in .png");
  const FrictionCase rig = read_case(options.file);
  RigLaw law(globals, rig, options.law);
  RigResult result;
  {
    Progress progress(!globals.quiet);
    result = run_rig(rig, law, options.step, progress);
  }
  if (result.jumps)
    warn("the law " + std::string(law.type().id) +
         " is discontinuous without declaring it: " + std::to_string(result.jumps) +
         " steps used a force between the two sides of a jump; a law that jumps at rest must set "
         "DFM_FRIC_SET_VALUED and use ft_stop");
  const std::string rows = csv_text(result);
  if (!options.csv.empty()) write_whole(options.csv, rows);
  if (!options.plot.empty() && !result.rows.empty()) picture(options, rig, law, rows);
  print(options, globals, rig, law, result);
  if (result.stopped.empty()) return kDone;
  fail(result.stopped + (options.csv.empty() ? "" : "; the rows until then are in " + options.csv));
  return kStopped;
}

void add_friction(Command app, Globals &globals, int *exit_code) {
  const auto options = std::make_shared<FrictionOptions>();
  Command sub = app.command(kFriction.name, kFriction.about);
  sub.option("CASE", options->file,
             "JSON with law, params, input, output_times (libdeform/doc/reference/friction_rig.md)")
      .required();
  sub.option("--law", options->law, "short name, full id, or path of a plugin file; otherwise the case's")
      .type_name("ID");
  sub.option("--step", options->step, "longest step, s").with_default().type_name("H");
  sub.option("--csv", options->csv, "the case's columns at its output times").type_name("OUT");
  sub.option("--plot", options->plot, "a picture of them (python3 with matplotlib)").type_name("OUT.png");
  sub.calls([=, &globals] { *exit_code = friction(*options, globals); });
}

}  // namespace
}  // namespace cli

int main(int argc, char **argv) { return cli::command_line(argc, argv, cli::add_friction); }
