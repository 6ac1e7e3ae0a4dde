// A window on a run elsewhere: draws what `--stream rtp://` sends with a camera of its own, and asks the
// sender for what hands do, where it lets them.
#pragma once
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "arrows.h"
#include "cli.h"
#include "hands.h"
#include "live/rtp_receiver.h"
#include "plots.h"
#include "script.h"

namespace view {

class Remote final : public Hands {
 public:
  // options.scene: "rtp://ADDRESS:PORT[?token=TEXT]". A script has the clock's time, and begins with the
  // first frame that comes.
  Remote(const Options &options, const cli::Globals &globals);

 private:
  void frame() override;
  void key(const std::string &name) override;
  void press(int button) override;
  void release(int button) override;
  void cut(const double blade[12]) override;
  void pull_to_mouse();
  void set_slider(const std::string &name, double value);
  void send_request(const char *what, const std::function<void(cli::JsonObject &)> &more = {},
                    const std::string &replaces = "");
  bool steers() const override;
  bool running() const { return receiver_.state().get("running") == "true"; }
  void first_look();
  void panels() override;
  void sample();
  void fill(render::Scene &picture);
  void draw();
  void shot(const std::string &name);

  const Options &options_;
  const cli::Globals &globals_;
  std::optional<Script> script_;
  live::RtpReceiver receiver_;
  Arrows arrows_;
  std::vector<std::vector<double>> placed_;  // points of things that have triangles, in the order of drawing
  double size_ = 0;                          // m, of what is shown; 0: nothing has come yet
  bool set_ = false;                         // the camera is as the sender's scene says
  double began_ = 0, last_ = 0;              // s
  std::optional<render::Vec> pulled_;        // m, the place that the mouse holds
  std::map<std::string, Plot> plots_;        // by what they show
  double plotted_ = 0;                       // s, of the state that they have got last
  uint64_t run_ = 0;                         // of which they are
};

}  // namespace view
