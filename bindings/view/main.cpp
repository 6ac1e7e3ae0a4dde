// deform-view, which `deform view` starts: a window on a scene.
#include <cstdio>
#include <memory>

#include "app.h"
#include "arguments.h"
#include "become.h"
#include "cli.h"
#include "messages.h"
#include "remote.h"

namespace view {
namespace {

void read_size(const std::string &text, Options &out) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%ux%u%c", &out.width, &out.height, &rest) != 2 || out.width < 64 ||
      out.height < 64 || out.width > 8192 || out.height > 8192)
    throw cli::Failure(cli::kBadInput,
                       "--size " + text + ": expected WIDTHxHEIGHT, each 64 to 8192, such as 1280x720");
}

void add_view(cli::Command app, cli::Globals &globals, int *) {
  const auto options = std::make_shared<Options>();
  const auto size = std::make_shared<std::string>();
  cli::Command sub = app.command(cli::kView.name, cli::kView.about);
  sub.option("SCENE", options->scene,
             "scene file (JSON), or rtp://ADDRESS:PORT of a stream; not with --replay");
  sub.option("--replay", options->replay, "show the states that `deform run --record` kept").type_name("DIR");
  sub.option("--script", options->script, "no hands: lines `t key|drag|slider|shot ARGS`").type_name("FILE");
  sub.option("--from", options->from, "begin with a state that `deform run --save` or the viewer wrote")
      .type_name("FILE");
  sub.option("--out", options->out, "folder for pictures, states and recordings (out/SCENE_view)")
      .type_name("DIR");
  sub.option("--set", options->set, "change a value of the scene")
      .type_name("/json/pointer=value")
      .repeated();
  sub.option("--size", *size, "of the window in pixels (1280x720)").type_name("WxH");
  sub.option("--detail", options->detail,
             "light: full or fast (fast where OpenGL runs on the processor, else full)")
      .one_of({"full", "fast"});
  sub.calls([=, &globals] {
    if (options->scene.empty() && options->replay.empty())
      throw cli::Failure(cli::kBadInput,
                         "view: SCENE is required, or --replay DIR (see: deform view --help)");
    if (!size->empty()) read_size(*size, *options);
    const bool stream = options->scene.starts_with("rtp://");
    if (stream && !(options->replay.empty() && options->from.empty() && options->set.empty()))
      throw cli::Failure(cli::kBadInput, "view: a stream takes no --replay, --from or --set");
    if (stream) return Remote(*options, globals).run();
    App(*options, globals).run();
  });
}

}  // namespace
}  // namespace view

int main(int argc, char **argv) { return cli::command_line(argc, argv, view::add_view); }
