// deform-serve, which `deform serve` starts: a scene in a browser on this machine.
#include <cmath>
#include <memory>

#include "cli/arguments.h"
#include "cli/become.h"
#include "cli/cli.h"
#include "cli/messages.h"
#include "session.h"
#include "token.h"

namespace serve {
namespace {

void add_serve(cli::Command app, cli::Globals &globals, int *) {
  const auto options = std::make_shared<Options>();
  const auto port = std::make_shared<uint32_t>(0);
  cli::Command sub = app.command(cli::kServe.name, cli::kServe.about);
  sub.option("SCENE", options->scene, "scene file (JSON)").required();
  sub.option("--port", *port, "of 127.0.0.1 (a free one)").type_name("N");
  sub.option("--token", options->token, "what the URL has to say (a new one each time)").type_name("TEXT");
  sub.option("--stream", options->stream, "to there too, for `deform view` with the token")
      .type_name("rtp://ADDRESS:PORT");
  sub.option("--rate", options->rate, "pictures a second").with_default().positive();
  sub.option("--set", options->set, "change a value of the scene")
      .type_name("/json/pointer=value")
      .repeated();
  sub.flag("--paused", options->paused, "begin without steps");
  sub.option("--seconds", options->seconds, "of the clock, after which it ends (never)").positive();
  sub.calls([=, &globals] {
    if (*port > 65535) throw cli::Failure(cli::kBadInput, "--port: expected 0 to 65535");
    if (!(options->rate >= 1 && options->rate <= 240))
      throw cli::Failure(cli::kBadInput, "--rate: expected 1 to 240");
    if (options->token.find_first_not_of("0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ") !=
            std::string::npos ||
        options->token.size() > 64)
      throw cli::Failure(cli::kBadInput, "--token: expected at most 64 letters and digits");
    options->port = static_cast<uint16_t>(*port);
    if (options->token.empty()) options->token = new_token();
    Session(*options, globals).run();
  });
}

}  // namespace
}  // namespace serve

int main(int argc, char **argv) { return cli::command_line(argc, argv, serve::add_serve); }
