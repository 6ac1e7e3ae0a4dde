// deform view SCENE.json: starts deform-view, the program with the window, which lies beside the command.
#include <memory>

#include "arguments.h"
#include "become.h"
#include "messages.h"

namespace cli {
namespace {

struct ViewOptions {
  std::string scene, replay, script, from, out, size, detail;
  std::vector<std::string> set;
};

// Becomes the viewer, or throws.
[[noreturn]] void become_viewer(const ViewOptions &options, const Globals &globals) {
  if (options.scene.empty() && options.replay.empty())
    throw Failure(kBadInput, "view: SCENE is required, or --replay DIR (see: deform view --help)");
  std::vector<std::string> words;
  const auto add = [&](const char *name, const std::string &value) {
    if (value.empty()) return;
    words.push_back(name);
    words.push_back(value);
  };
  add("--scene", options.scene);
  add("--replay", options.replay);
  add("--script", options.script);
  add("--from", options.from);
  add("--out", options.out);
  add("--size", options.size);
  add("--detail", options.detail);
  for (const std::string &s : options.set) add("--set", s);
  add("--threads", std::to_string(globals.threads));
  add("--quiet", globals.quiet ? "1" : "");
  add("--json", globals.json ? "1" : "");
  become("view", "deform-view", words,
         "with Debian's libglfw3-dev and libimgui-dev installed, `make view` builds it");
}

}  // namespace

void add_view(Command app, Globals &globals, int *) {
  auto options = std::make_shared<ViewOptions>();
  Command sub = app.command("view", "a window on a scene, with mouse, sliders and plots");
  sub.option("SCENE", options->scene, "scene file (JSON); not needed with --replay");
  sub.option("--replay", options->replay, "show the states that `deform run --record` kept").type_name("DIR");
  sub.option("--script", options->script, "no hands: lines `t key|drag|slider|shot ARGS`").type_name("FILE");
  sub.option("--from", options->from, "begin with a state that `deform run --save` or the viewer wrote")
      .type_name("FILE");
  sub.option("--out", options->out, "folder for pictures, states and recordings (out/SCENE_view)")
      .type_name("DIR");
  sub.option("--set", options->set, "change a value of the scene")
      .type_name("/json/pointer=value")
      .repeated();
  sub.option("--size", options->size, "of the window in pixels (1280x720)").type_name("WxH");
  sub.option("--detail", options->detail,
             "light: full or fast (fast where OpenGL runs on the processor, else full)")
      .one_of({"full", "fast"});
  sub.calls([=, &globals] { become_viewer(*options, globals); });
}

}  // namespace cli
