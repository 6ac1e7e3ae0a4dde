// deform replay DIR: the run that `deform run --record` recorded, simulated again or shown again.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "arguments.h"
#include "frames.h"
#include "json_text.h"
#include "messages.h"
#include "recording.h"
#include "run.h"
#include "state_file.h"
#include "system.h"

namespace cli {
namespace {

struct ReplayOptions {
  std::string folder, out;
  double frame_rate = 0;  // 1/s, 0: as the scene says
  std::vector<std::string> set;
  bool shown_only = false;
};

void only_outputs(const std::vector<std::string> &set) {
  for (const std::string &s : set)
    if (s.rfind("/output", 0) != 0)
      throw Failure(kBadInput, "--set " + s +
                                   ": a replay repeats the recorded run; only values under /output may "
                                   "change, such as /output/camera/eye=[1,-2,1]");
}

// The recorded states one after another: what they look like, not how they came about.
int show(const Recording &recording, const ReplayOptions &options, const Globals &globals,
         const std::vector<std::string> &set) {
  if (options.frame_rate > 0)
    throw Failure(kBadInput,
                  "--states draws each recorded state, so --frames does not apply; leave out --frames, or "
                  "leave out --states to simulate the run again");
  const SceneFile scene(globals, recording.scene, set, recording.jitter);
  const RunFolder held(options.out);
  const std::unique_ptr<Frames> frames = Frames::create(scene, options.out + "/frames");
  if (!frames) return kBadInput;  // the reason is among the warnings
  for (const RecordedState &state : recording.states) {
    read_state(scene, state.path);
    frames->draw(state.t);
  }
  const std::string pictures = options.out + "/frames";
  if (globals.json)
    std::printf("{\"pictures\": %zu, \"folder\": %s}\n", recording.states.size(),
                quoted(as_utf8(pictures)).c_str());
  else if (!globals.quiet)
    std::printf("%zu pictures of recorded states: %s\n", recording.states.size(), shown(pictures).c_str());
  return kDone;
}

int simulate(const Recording &recording, const ReplayOptions &options, const Globals &globals,
             const std::vector<std::string> &set) {
  RunOptions again;
  again.scene = recording.scene;
  again.out = options.out;
  again.set = set;
  again.jitter = recording.jitter;
  again.frame_rate = options.frame_rate;
  again.from = recording.states.front().path;
  // hands may go on beyond the scene's end
  if (!recording.acts.empty()) again.time = recording.states.back().t + 1;
  Comparison comparison(recording);
  run_scene(again, globals, &comparison);
  const std::string differs = comparison.sentence();
  if (!differs.empty())
    throw Failure(kFound, options.folder + ": the replay is not the run that was recorded: " + differs);
  if (!globals.quiet && !globals.json)
    std::printf("the same bits in all %zu recorded states\n", comparison.same());
  return kDone;
}

int replay(ReplayOptions options, const Globals &globals) {
  const Recording recording = read_recording(options.folder);
  if (!std::filesystem::exists(path_of(recording.scene)))
    throw Failure(kBadInput, recording.scene +
                                 ": the scene of the recording is not there; put it back, or "
                                 "correct \"scene\" in " +
                                 options.folder + "/recording/run.json");
  only_outputs(options.set);
  if (options.out.empty()) options.out = options.folder + "/replay";
  std::error_code absent;
  if (std::filesystem::equivalent(path_of(options.out), path_of(options.folder), absent))
    throw Failure(kBadInput, "--out " + options.out +
                                 ": the folder of the recording, whose states would be deleted; give "
                                 "another one");
  std::vector<std::string> set = recording.set;
  set.insert(set.end(), options.set.begin(), options.set.end());
  return (options.shown_only ? show : simulate)(recording, options, globals, set);
}

}  // namespace

void add_replay(Command app, Globals &globals, int *exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  Command sub = app.command(
      "replay", "simulates a recorded run again, with the same bits, or shows its recorded states");
  sub.option("DIR", options->folder, "results of `deform run --record`").required();
  sub.option("--out", options->out, "folder for the results (DIR/replay)").type_name("DIR");
  sub.option("--frames", options->frame_rate, "pictures per simulated second").positive().type_name("FPS");
  sub.option("--set", options->set, "change a value under /output, such as the camera")
      .type_name("/json/pointer=value")
      .repeated();
  sub.flag("--states", options->shown_only, "pictures of the recorded states, nothing is simulated");
  sub.calls([=, &globals] { *exit_code = replay(*options, globals); });
}

}  // namespace cli
