// deform-serve, which `deform serve` starts: a scene in a browser on this machine.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>

#include "cli/arguments.h"
#include "cli/become.h"
#include "cli/cli.h"
#include "cli/interrupt.h"
#include "cli/leaving.h"
#include "cli/messages.h"
#include "cli/rtp.h"
#include "cli/state_file.h"
#include "live/session.h"
#include "server.h"
#include "token.h"

namespace serve {
namespace {

struct Options {
  std::string scene, token, stream;  // stream: "rtp://ADDRESS:PORT"; empty: by WebSocket alone
  std::vector<std::string> set;
  uint16_t port = 0;    // 0: a free one
  double rate = 30;     // pictures a second
  bool paused = false;  // begins so
  double seconds = 0;   // of the clock, after which it ends; 0: never
};

// The same by RTP. Who steers there is a viewer like any other.
class Stream {
 public:
  Stream(const Options &options, live::Session &session, Server &server)
      : session_(session), server_(server), sender_(session.scene().world(), options.stream, options.token) {}
  void hear() {
    const std::vector<std::string> requests = sender_.take();
    if (sender_.steered() != (viewer_ != 0)) {
      if (viewer_) server_.remove_viewer(viewer_);
      viewer_ = viewer_ ? 0 : server_.join();
    }
    for (const std::string &text : requests) server_.hear(viewer_, text);
  }
  void show() {
    try {
      sender_.show();
      if (viewer_) sender_.send_state(session_.brief_state(viewer_, sent_slider_++));
    } catch (const cli::Failure &) {  // of which the session tells
    }
  }
  void end() { sender_.end(); }

 private:
  live::Session &session_;
  Server &server_;
  cli::RtpSender sender_;
  uint32_t viewer_ = 0;     // its number; 0: none steers
  size_t sent_slider_ = 0;  // the slider of which it is told next
};

// Until a signal ends it.
void run(const Options &options, const cli::Globals &globals) {
  using Clock = std::chrono::steady_clock;
  Server server(options.port, options.token, dfm_stream_pack);
  live::Session session(globals, options.scene, options.set, server, !options.paused);
  cli::catch_signals();
  cli::stepping = session.scene().world();
  std::printf("http://127.0.0.1:%u/?token=%s\n", unsigned{server.port()}, options.token.c_str());
  std::optional<Stream> stream;
  if (!options.stream.empty()) {
    stream.emplace(options, session, server);
    std::printf("deform view %s?token=%s\n", options.stream.c_str(), options.token.c_str());
  }
  std::fflush(stdout);
  const std::chrono::duration<double> picture(1 / options.rate);
  const Clock::time_point began = Clock::now();
  for (Clock::time_point next = began; !cli::interrupted() && server.works();) {
    if (stream) stream->hear();
    session.picture(picture.count());
    if (stream) stream->show();
    next += std::chrono::duration_cast<Clock::duration>(picture);
    next = std::max(next, Clock::now());
    std::this_thread::sleep_until(next);
    if (options.seconds > 0 && std::chrono::duration<double>(next - began).count() > options.seconds) break;
  }
  cli::stepping = 0;
  if (stream) stream->end();
  if (cli::interrupted()) cli::came_back();
  if (!server.works()) throw cli::Failure(cli::kStopped, "serve: the network has failed; start it again");
}

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
    run(*options, globals);
  });
}

}  // namespace
}  // namespace serve

int main(int argc, char **argv) { return cli::command_line(argc, argv, serve::add_serve); }
