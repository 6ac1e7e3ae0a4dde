// deform run SCENE.json: simulates and writes what interfaces promise.
#include <ctime>

#include <algorithm>
#include <chrono>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>

#include "arguments.h"
#include "attachments.h"
#include "become.h"
#include "frames.h"
#include "impulses.h"
#include "interrupt.h"
#include "json_text.h"
#include "leaving.h"
#include "messages.h"
#include "out_folder.h"
#include "output.h"
#include "planned.h"
#include "progress.h"
#include "recording.h"
#include "rtp.h"
#include "run_plots.h"
#include "sensors.h"
#include "tools.h"
#include "state_file.h"
#include "step_size.h"

namespace cli {
namespace {

std::string seconds(double t) { return formatted("%g s", t); }

double cpu_seconds() {
  timespec t = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Multiples of an interval: due() is true once for each that time has passed. Outputs never shape the steps,
// so a run gives the same bits whatever it writes.
class Schedule {
 public:
  explicit Schedule(double interval) : interval_(interval) {}
  bool is_time(double t) {
    if (interval_ <= 0 || t < double(next_) * interval_ - 1e-9 * interval_) return false;
    next_ = uint64_t(std::floor(t / interval_ + 1e-9)) + 1;
    return true;
  }

 private:
  double interval_;
  uint64_t next_ = 0;
};

// A state from a file is none: it is that of a run, or one that has no fault of itself.
bool requests_spoiled_start(const SceneFile &scene) {
  return std::ranges::any_of(scene.bodies(), [&](const BodyView &body) {
    const std::string start = scene.pointer_of(body.name) + "/start";
    return !scene.value(start + "/scramble").empty() || !scene.value(start + "/flatten").empty() ||
           scene.value(start + "/invert") == "true";
  });
}

// The faces of a cut or a tear are those of cells.
constexpr const char *kTeeth =
    "teeth of a cut or tear are as large as the cells; a mesh with layers of cells along the cut has none, "
    "smaller cells have smaller ones";

void check_saves(const SceneFile &scene, const RunOptions &options) {
  const double duration = scene.settings().duration;
  if (!options.saves.empty() || !options.save_scene.empty()) make_folder(options.out);  // they may lie there
  if (!options.saves.empty()) refuse_static(scene, "--save");
  if (options.record) refuse_static(scene, "--record");
  if (!options.save_scene.empty()) {
    check_scene_path(scene, options.save_scene);
    refuse_same("--save-scene", options.save_scene, options.out + "/summary.json");
  }
  for (const RunOptions::Save &save : options.saves) {
    check_state_path(save.path);
    if (save.at > duration * (1 + 1e-9))
      throw Failure(kBadInput, "--save " + save.path + ": the run ends at " + seconds(duration) +
                                   ", before " + seconds(save.at) +
                                   "; give an earlier time, or a longer --time");
  }
}

void restore(const SceneFile &scene, const std::string &snapshot) {
  need(dfm_world_restore(scene.world(), snapshot.data(), snapshot.size()));
}

void check_from(const SceneFile &scene, const std::string &path) {
  refuse_static(scene, "--from");
  const double start = dfm_world_time(scene.world()), duration = scene.settings().duration;
  read_state(scene, path);
  const double t = dfm_world_time(scene.world()) - start;
  if (t >= duration * (1 - 1e-9))
    throw Failure(kBadInput, path + ": a state at " + seconds(t) + ", and the run ends at " +
                                 seconds(duration) +
                                 "; give a longer --time, counted from the scene's start");
}

// A run that ends early writes them too.
void check_states(const SceneFile &scene) {
  for (const BodyView &body : scene.bodies())
    for (const BodyView &other : scene.bodies())
      if (other.name == body.name + "_surface")
        throw Failure(kBadInput, "/bodies: the states of '" + other.name + "' would have the files of the " +
                                     "surface of '" + body.name + "'; rename one of them");
}

// What may be refused, before the results of an earlier run are deleted. The state to continue from may be
// one of them: returned as a snapshot, empty without one; the world stays at its start.
std::string prepare(const SceneFile &scene, const RunOptions &options) {
  check_saves(scene, options);
  check_states(scene);
  if (!options.stream.empty()) {
    refuse_static(scene, "--stream");
    check_sink(options.stream);
  }
  if (!options.problems.empty()) {
    make_folder(options.problems);
    options.capture(scene.world(), options.problems, options.every);
  }
  if (options.from.empty()) return "";
  const std::string start = snapshot_of(scene.world());
  check_from(scene, options.from);
  std::string from = snapshot_of(scene.world());
  restore(scene, start);
  return from;
}

// As prepare(); a refused run leaves no folder that it has made.
std::string prepare_or_leave_nothing(const SceneFile &scene, const RunOptions &options) {
  namespace fs = std::filesystem;
  std::error_code error;
  std::vector<fs::path> made;
  for (fs::path at = fs::absolute(path_of(options.out)); at.has_relative_path() && !fs::exists(at, error);
       at = at.parent_path())
    made.push_back(at);
  try {
    return prepare(scene, options);
  } catch (...) {
    for (const fs::path &empty : made) fs::remove(empty, error);
    throw;
  }
}

class Runner {
 public:
  // from: snapshot to go on from, empty: the scene's start, where the world is now.
  Runner(const SceneFile &scene, const RunOptions &options, const Globals &globals, Comparison *comparison,
         const std::string &from)
      : scene_(scene),
        options_(options),
        world_(scene.world()),
        duration_(scene.settings().duration),
        static_(scene.value("/time/mode") == "\"static\""),
        spoiled_(requests_spoiled_start(scene)),
        check_every_step_(options.check || scene.settings().check),
        progress_(!globals.quiet && !globals.json),
        outputs_(scene, options.out),
        checker_(scene),
        impulses_(scene, peak_window(scene)),
        sensors_(scene, options.out),
        attachments_(scene, options.out),
        tools_(scene, options.out),
        record_(scene.settings().every),
        frame_(frame_interval()),
        comparison_(comparison),
        from_(from) {
    result_.start = dfm_world_time(world_);
    if (options.record) recorder_.emplace(scene, options);
    if (options.plot) plots_ = RunPlots::create(scene);
    if (frame_interval() > 0) frames_ = Frames::create(scene, options.out + "/frames");
  }

  void run() {
    if (!from_.empty()) restore(scene_, from_);
    result_.begun = result_.simulated = dfm_world_time(world_);
    if (!options_.stream.empty()) stream_.emplace(world_, options_.stream);
    count_overlaps();
    add_unwatched(scene_, result_);
    outputs(true);
    mark_ = {wall_seconds(), cpu_seconds()};
    while (!interrupted() && !result_.stopped && advance()) outputs(false);
    if (stream_) {
      stream_->end();
      result_.stream = stream_->report();
    }
    came_back();
    count_time();
    if (frames_) finish_frames();
    if (interrupted()) {
      result_.interrupted = true;
      result_.stop_reason = "interrupted by a signal";
    }
    if (!at_record_) {  // after a stop, too: the world is back at its last good state
      record();
      if (!check_every_step_) check(false);
    }
    if (result_.interrupted || result_.stopped) outputs_.write_last();
    for (; saved_ < options_.saves.size(); ++saved_)
      warn("--save " + options_.saves[saved_].path + ": not written, the run ended before its time");
    if (result_.hold_begun) end_hold();
    outputs_.write_nodes();
    if (plots_) plots_->write(options_.out + "/plots.png");
    if (!options_.save_scene.empty()) save_scene();
    result_.impulses = impulses_.json();
    result_.sensors = sensors_.json();
    add_unwatched(scene_, result_);  // models may have changed
    if (!static_) result_.contacts_mean = world_stats(scene_).contacts_mean;
  }

  const RunResult &result() const { return result_; }
  const Checks &checks() const { return checker_.result(); }
  const std::optional<Failure> &unsaved() const { return unsaved_; }

  // Sentences that the summary must hold whether or not anybody reads the terminal.
  std::vector<std::string> remarks() const {
    std::vector<std::string> out;
    if (!static_ && (held_nothing_ || !result_.hold_begun))
      out.push_back("hold.creep_max_um_per_s is null: no pair sticks throughout the last half of the run");
    const dfm_world_stats stats = world_stats(scene_);
    if (trouble_ & DFM_TROUBLE_SUBSTEPS)
      out.push_back(
          "steps were cut into up to " + std::to_string(stats.substeps_max) +
          " sub-steps: the step is longer than the stable one (deform explain says why), or too long "
          "for bodies that meet fast");
    if (stats.cheapened > 0)
      out.push_back(std::to_string(stats.cheapened) +
                    " steps came near their limit of work or time (max_work, max_time), so some refinements "
                    "of the contact solve were left out");
    if (stats.shortened > 0)
      out.push_back(std::to_string(stats.shortened) +
                    " steps ended early, since their limit of work or time (max_work, max_time) was used up: "
                    "the run took more steps");
    if (stats.unconverged > 0 && !often_unsolved()) out.push_back(unsolved());
    if (stats.limited_max > 0)
      out.push_back("up to " + std::to_string(stats.limited_max) +
                    " cells at once were stretched so far that their model limited their stiffness: refine "
                    "the mesh or reduce the load");
    const auto refused = [](const dfm_swap &s) { return (s.flags & DFM_SWAP_REFUSED) != 0; };
    if (const auto n = std::ranges::count_if(result_.swaps, refused))
      out.push_back(
          std::string(n == 1 ? "a change of model was" : std::to_string(n) + " changes of models were") +
          " refused, because energy or surface would jump: swaps lists what was refused");
    return out;
  }

  // Results that are wrong as a picture of the scene: these are shown on the terminal too.
  std::vector<std::string> faults() const {
    std::vector<std::string> out;
    // A start with inverted cells may also cross itself; only what is left of that at the end counts.
    if (spoiled_ && checks().inverted_last > 0)
      out.push_back(
          std::to_string(checks().inverted_last) +
          " cells inverted by \"start\" are still inverted at the end: simulate a longer time, or use "
          "a model that recovers (corotational_fem, shape_matching)");
    else if (!spoiled_ && trouble_ & DFM_TROUBLE_INVERTED) out.push_back(inverted());
    if (often_unsolved()) out.push_back(unsolved());
    const Checks &seen = checks();
    const size_t others = spoiled_ ? seen.others_last : seen.others_max;
    const size_t parts = spoiled_ ? seen.parts_last : seen.parts_max;
    const size_t within = spoiled_ ? seen.self_last : seen.self_max;
    const std::string when = spoiled_ ? " in the last state" : " in one state";
    const auto pairs = [](auto most) { return "up to " + std::to_string(most) + " triangle pairs"; };
    const auto both = [](const std::string of[2]) { return "'" + of[0] + "' and '" + of[1] + "'"; };
    if (others > 0)
      out.push_back("surfaces cross: " + pairs(others) + " of two surfaces" + when + " (" +
                    both(seen.crossing) + ")");
    if (parts > 0)
      out.push_back("parts of a body cross where they came off: " + pairs(parts) + " of two parts" + when +
                    " (" + both(seen.parted) + "): " + kTeeth);
    if (within > 0)
      out.push_back("a surface crosses itself: " + pairs(within) + " of body '" + seen.crossed + "'" + when +
                    crossed_itself());
    return out;
  }

 private:
  struct Mark { double wall, cpu; };

  // Single solves that stop at their limit, as in an impact, are for the summary only.
  bool often_unsolved() const {
    const dfm_world_stats stats = world_stats(scene_);
    return double(stats.unconverged) >= 0.01 * double(stats.substeps) && stats.unconverged > 0;
  }

  std::string unsolved() const {
    const dfm_world_stats stats = world_stats(scene_);
    // the solve of a sub-step that ends the run counts, the sub-step does not
    const uint64_t substeps = std::max(stats.substeps, stats.unconverged);
    const std::string said =
        "the contact solve did not converge in " + std::to_string(stats.unconverged) + " of " +
        std::to_string(substeps) +
        formatted(
            " sub-steps (%.3g %%), with errors of up to %.1e m/s: forces of contact and friction are "
            "inexact there, and what should hold may creep; ",
            100 * double(stats.unconverged) / double(substeps), stats.residual_max);
    if (any_cut())
      return said +
             "where teeth of a cut or torn body jam, shorter steps do not help: give its material stiffness "
             "damping, or more of it";
    return said +
           "raise \"max_work\" of \"time\" if the scene has one, take a shorter step, or add damping to the "
           "material";
  }

  // A load that the material bears inverts few cells, where the mesh is coarse for it; one that it does not
  // bear inverts many, or takes much of the volume.
  std::string inverted() const {
    const Checks &seen = checks();
    const std::string what = "cells became inverted (inside out)";
    if (seen.inverted_there == 0) return what + " between two records: reduce the load, or refine the mesh";
    const std::string where =
        formatted(": up to %u of %u cells of body '%.100s', at %.0f %% of its volume; ", seen.inverted_there,
                  seen.cells_there, seen.inverted_body.c_str(), 100 * seen.volume_there);
    if (seen.inverted_there * 20 < seen.cells_there && seen.volume_there > 0.8)
      return what + where + "refine the mesh or reduce the load";
    if (seen.inverted_model == "org.deform.linear_fem")
      return what + where +
             "linear_fem holds for small strains and rotations only: use corotational_fem, or reduce the "
             "load";
    return what + where +
           "its material is too soft for the load, which a finer mesh does not change: give it a larger "
           "\"young\", or reduce what presses on it";
  }

  bool any_cut() const {
    return std::ranges::any_of(scene_.bodies(), [](const BodyView &b) { return b.cut; });
  }

  // What helps against a surface that crosses itself, as far as the scene does not ask for it yet. Self
  // contact keeps apart only what is apart at the start.
  std::string crossed_itself() const {
    if (!spoiled_ && checks().self_first > 0)
      return ", " + std::to_string(checks().self_first) +
             " at the start: its mesh is like this; mend it, or take the surface of the cells (\"surface\": "
             "{\"from\": \"boundary\"})";
    const auto at = std::ranges::find(scene_.bodies(), checks().crossed, &BodyView::name);
    const bool cut = at != scene_.bodies().end() && at->cut;
    if (!cut) {
      const std::string self = scene_.value("/contact/self");
      return self.empty() || self == "false" ? "; \"contact\": {\"self\": \"auto\"} prevents this"
                                             : "; take a shorter step";
    }
    const std::string &whole = scene_.name_of(at->whole);
    if (!scene_.value(scene_.pointer_of(whole) + "/separate").empty())
      return std::string(", where it is cut or torn: ") + kTeeth;
    return "; take a shorter step, or set \"separate\" of body '" + whole + "' to make its parts bodies";
  }

  // The summary is written, whatever becomes of the scene.
  void save_scene() {
    try {
      write_as_scene(scene_, options_.save_scene);
    } catch (const Failure &failure) {
      keep_warning(failure.what());
      unsaved_ = failure;
    }
  }

  double frame_interval() const {
    double rate = options_.frame_rate;
    if (rate <= 0 && scene_.settings().frames) {
      // a number is a rate; true: with every record
      rate = std::strtod(scene_.value("/output/frames").c_str(), nullptr);
      if (rate <= 0) return scene_.settings().every;
    }
    return rate > 0 ? 1 / rate : 0;
  }

  void record() {
    outputs_.record();
    attachments_.record();
    tools_.record();
    if (recorder_) recorder_->add();
    if (plots_) plots_->record();
  }

  // The equilibrium under the next share of the loads; false when it has all of them.
  bool advance_load() {
    const double step = scene_.settings().step;
    const uint64_t n = step > 0 ? uint64_t(std::ceil(duration_ / step - 1e-6)) : 1;
    if (result_.steps == n) return false;
    dfm_equilibrium_def def = dfm_equilibrium_def_default();
    def.load_from = double(result_.steps) / double(n);
    def.load_to = double(result_.steps + 1) / double(n);
    def.time = result_.start + duration_ * def.load_to - result_.simulated;
    dfm_equilibrium_info info = {};
    info.size = sizeof info;
    if (!taken([&] { return dfm_world_equilibrium(world_, &def, &info); })) return false;
    result_.load_steps += info.load_steps;
    result_.iterations += info.iterations;
    result_.residual = info.residual;
    result_.contacts_mean += (world_stats(scene_).contacts - result_.contacts_mean) / double(result_.steps);
    result_.simulated = dfm_world_time(world_);
    return true;
  }

  // A call that moves the world. False: the run ends here; interrupted, the world is as before the call.
  template <class Call>
  bool taken(const Call &call) {
    const double begin = wall_seconds();
    stepping = world_;
    const dfm_status status = interrupted() ? DFM_DISCARD : call();
    stepping = 0;
    last_step_ = wall_seconds() - begin;
    result_.times.add(last_step_);
    for (const dfm_swap &s : listed<dfm_swap>(dfm_world_swaps, world_)) result_.swaps.push_back(s);
    if (status == DFM_OK) ++result_.steps;
    else if (!interrupted() || status != DFM_DISCARD) stop();
    return status == DFM_OK;
  }

  // One step toward the end; false when there.
  bool advance() {
    if (static_) return advance_load();
    double step = next_step(scene_, result_.start, result_.simulated);
    if (comparison_) step = comparison_->prepare(scene_, step);
    if (step <= 0) return false;
    uint32_t trouble = 0;
    const bool done = taken([&] {
      return options_.step ? options_.step(world_, step, &trouble) : dfm_world_step(world_, step, &trouble);
    });
    if (!done) return false;
    trouble_ |= trouble;
    scene_.renew_list();
    const double passed = dfm_world_time(world_) - result_.simulated;
    impulses_.add_step(passed);
    sensors_.add_step();
    tools_.add_step(passed);
    result_.simulated = dfm_world_time(world_);
    if (stream_) stream_->after_step();
    return true;
  }

  void stop() {
    result_.stopped = true;
    result_.stop_reason = dfm_last_error();
    for (const BodyView &b : scene_.bodies())  // the sentence names the body in quotes
      if (result_.stop_reason.find("'" + b.name + "'") != std::string::npos) result_.stop_body = b.name;
  }

  void check(bool start_state) { checker_.check(start_state); }

  // What is due at this time; its cost is kept out of the run's times.
  void outputs(bool start_state) {
    const double t = result_.simulated;
    if (!static_ && !result_.hold_begun && t >= result_.start + duration_ / 2)
      result_.hold_begun = dfm_world_hold_begin(world_) == DFM_OK;
    at_record_ = record_.is_time(t - result_.start);
    const bool draws_frame = frames_ && frame_.is_time(t - result_.start);
    if (comparison_) comparison_->look(scene_);
    for (; saved_ < options_.saves.size() && t - result_.start >= options_.saves[saved_].at * (1 - 1e-9);
         ++saved_)
      write_state(scene_, options_.saves[saved_].path);
    if (at_record_ || draws_frame || check_every_step_) {
      if (!start_state) count_time();
      if (at_record_) record();
      if (at_record_ || check_every_step_) check(start_state);
      if (draws_frame) draw(t);
      mark_ = {wall_seconds(), cpu_seconds()};
    }
    if (result_.steps % 16 != 0 && !draws_frame && last_step_ < kSlowStep) return;
    const double spent = result_.wall + wall_seconds() - mark_.wall;
    progress_.show(t - result_.start, duration_,
                   result_.steps && spent > 0 ? double(result_.steps) / spent : 0, result_.pictures,
                   result_.drawing);
  }

  void draw(double t) {
    const double begin = wall_seconds();
    frames_->draw(t);
    result_.drawing += wall_seconds() - begin;
    ++result_.pictures;
    result_.drawn_by = frames_->drawn_by();
  }

  void finish_frames() {
    const double begin = wall_seconds();
    frames_->finish();
    result_.drawing += wall_seconds() - begin;
  }

  void count_time() {
    result_.wall += wall_seconds() - mark_.wall;
    result_.cpu += cpu_seconds() - mark_.cpu;
    mark_ = {wall_seconds(), cpu_seconds()};
  }

  void count_overlaps() {
    const std::vector<dfm_overlap> found = listed<dfm_overlap>(dfm_world_overlaps, world_);
    result_.overlaps = uint32_t(found.size());
    for (const dfm_overlap &o : found) result_.untangled += (o.flags & DFM_OVERLAP_SEPARATED) != 0;
  }

  void end_hold() {
    need(dfm_world_hold(world_, &result_.creep, &result_.hold_count));
    if (result_.hold_count == 0 || !std::isfinite(result_.creep)) {
      result_.hold_count = 0;
      held_nothing_ = true;
    }
  }

  const SceneFile &scene_;
  const RunOptions &options_;
  dfm_world world_;
  double duration_;
  bool static_;   // equilibria under growing loads instead of steps in time
  bool spoiled_;  // a body starts scrambled, flattened or inverted, as the scene asks
  bool check_every_step_, at_record_ = false, held_nothing_ = false;
  uint32_t trouble_ = 0;
  Progress progress_;
  Outputs outputs_;
  Checker checker_;
  Impulses impulses_;
  Sensors sensors_;
  Attachments attachments_;
  Tools tools_;
  Schedule record_, frame_;
  std::unique_ptr<Frames> frames_;
  std::optional<Recorder> recorder_;
  std::unique_ptr<RunPlots> plots_;
  std::optional<RtpSender> stream_;
  Comparison *comparison_;
  const std::string &from_;
  size_t saved_ = 0;                         // of options_.saves, which are in order of time
  static constexpr double kSlowStep = 0.02;  // s; after a longer step the progress is shown at once
  double last_step_ = 0;                     // s, wall time
  RunResult result_;
  std::optional<Failure> unsaved_;
  Mark mark_ = {};
};

}  // namespace

void run_scene(RunOptions options, const Globals &globals, Comparison *comparison) {
  if (options.out.empty()) options.out = out_folder(options.scene, "run");
  if (options.time > 0)  // the scene is read for that long: it reports what comes after its end
    options.set.push_back(formatted("/time/duration=%.17g", options.time));
  const SceneFile scene(globals, options.scene, options.set, options.jitter);
  const std::string planned = planned_json(scene);
  if (const std::string short_of = planned_sentence(planned); !short_of.empty()) warn(short_of);
  if (!globals.quiet && !globals.json) print_choice(planned);
  check_first_step(scene);
  const std::string from = prepare_or_leave_nothing(scene, options);
  RunResult result;
  Checks checks;
  std::optional<Failure> unsaved;
  results_lie_in(options.out);
  catch_signals();
  {
    Runner runner(scene, options, globals, comparison, from);
    runner.run();
    for (const std::string &remark : runner.remarks()) keep_warning(remark);
    for (const std::string &fault : runner.faults()) warn(fault);
    result = runner.result();
    checks = runner.checks();
    unsaved = runner.unsaved();
  }
  const std::string summary = summary_json(scene, options, result, checks);
  write_whole(options.out + "/summary.json", summary);
  if (globals.json) {
    std::printf("%s", summary.c_str());
  } else if (!globals.quiet) {
    print_table(scene, result, checks);
    std::printf("written: %s\n", shown(options.out).c_str());
  }
  if (options.profile && !globals.json) print_profile(scene, result);
  const std::string at = " at step " + std::to_string(result.steps) + ", t = " + seconds(result.simulated);
  if (result.stopped)
    throw Failure(kStopped, options.scene + ": stopped" + at + ": " + result.stop_reason +
                                "; the last good state is in " + options.out + "/states/last_*.vtu");
  if (result.interrupted)
    throw Failure(kInterrupted, options.scene + ": interrupted" + at +
                                    "; what was recorded until then is in " + options.out +
                                    ", its last state in states/last_*.vtu");
  if (unsaved) throw *unsaved;
}

void add_run_options(Command sub, RunOptions &options) {
  sub.option("SCENE", options.scene, "scene file (JSON)").required();
  sub.option("--out", options.out,
             "folder for the results (out/SCENE; of a FOLDER/scene.json out/FOLDER_run)")
      .type_name("DIR");
  sub.option("--time", options.time, "seconds to simulate, instead of the scene's").positive().type_name("T");
  sub.option("--set", options.set, "change a value of the scene").type_name("/json/pointer=value").repeated();
  sub.option("--frames", options.frame_rate, "pictures per simulated second").positive().type_name("FPS");
  sub.flag("--plot", options.plot,
           "plots of energy, bodies, contacts and probes over time, to DIR/plots.png");
  sub.flag("--profile", options.profile, "time spent in each stage");
  sub.option("--jitter", options.jitter,
             "small random changes of the start state; the same seed gives the same run")
      .type_name("SEED");
  sub.flag("--check", options.check, "count crossing triangles in every step, not only in recorded states");
}

void add_run(Command app, Globals &globals, int *exit_code, CaptureProblems *capture) {
  auto options = std::make_shared<RunOptions>();
  Command sub = app.command("run", "simulates a scene and writes figures and pictures");
  add_run_options(sub, *options);
  auto saves = std::make_shared<std::vector<std::pair<double, std::string>>>();
  sub.option("--save", *saves,
             "write the state of the first step at or after time T to FILE; may be repeated")
      .type_name("T FILE");
  sub.option("--save-scene", options->save_scene,
             "write the world at the end of the run as a scene of its own")
      .type_name("FILE");
  sub.option("--from", options->from,
             "continue from a state that --save or --record wrote, to the end of the scene or of --time")
      .type_name("FILE");
  sub.option("--contact-problems", options->problems,
             "write contact problems that were not solved to DIR, for `deform contact`")
      .type_name("DIR");
  sub.option("--contact-problems-every", options->every, "beside them every N-th contact problem")
      .type_name("N");
  sub.option("--stream", options->stream,
             "send the run, no faster than the clock, as RTP packets (doc/reference/stream.md)")
      .type_name("rtp://ADDRESS:PORT");
  sub.flag("--record", options->record, "keep every recorded state, for `deform replay`");
  sub.calls([=, &globals] {
    if (options->every > 0 && options->problems.empty())
      throw Failure(kBadInput, "--contact-problems-every needs --contact-problems DIR");
    if (!options->problems.empty() && !capture)
      become("run --contact-problems", "deform-capture", globals.words, kMadeByTools);
    options->capture = capture;
    for (const auto &[at, path] : *saves) {
      if (!(at >= 0) || !std::isfinite(at))
        throw Failure(kBadInput, "--save: expected a finite time of 0 s or more, found " + number(at));
      options->saves.push_back({at, path});
    }
    std::ranges::stable_sort(options->saves, [](const auto &a, const auto &b) { return a.at < b.at; });
    run_scene(*options, globals);
    *exit_code = kDone;
  });
}

}  // namespace cli
