// The viewer: inputs in, steps, pictures with panels out.
#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "arrows.h"
#include "cli.h"
#include "drawing.h"
#include "hands.h"
#include "live/grip.h"
#include "plots.h"
#include "live/pull.h"
#include "script.h"
#include "live/sliders.h"
#include "space_mouse.h"

namespace view {

// What belongs to the scene as it was read.
struct Stage {
  Stage(const Options &options, const cli::Globals &globals, const cli::Recording *replay);
  cli::SceneFile scene;
  live::Simulation simulation;
  cli::Drawing drawing;
  render::Bounds extent, bodies;  // at the start
  double size;                    // m, of that
  live::Pull pull;
  live::Grip grip;
  Arrows arrows;
  Plots plots;
  std::vector<live::Slider> sliders;
};

class App final : public Hands {
 public:
  App(const Options &options, const cli::Globals &globals);

 private:
  void frame() override;
  void key(const std::string &name) override;
  void press(int button) override;
  void release(int button) override;
  void cut(const double blade[12]) override;
  bool leads(double dx, double dy) override;
  bool leads_deeper(double turns) override;
  bool tool_key(const std::string &name);  // false: no key of tools
  void request_probe();
  void lead(double dx, double dy);  // the tool in hand by the mouse
  void lead_by_space_mouse(double now);
  void add_probe();
  void add_tool_arrows(const render::Camera &camera, render::Scene &picture);
  void pull_to_mouse();
  void set_slider(const std::string &name, double value);
  void advance(double seconds);
  void restart();
  void save();
  void load();
  void record();
  void show_state(size_t i);  // of the recording that is shown
  // Shows the user what the library refuses, instead of ending.
  void attempt(const std::function<void()> &what);
  bool draw();  // false: the window has no size
  void first_look();
  void panels() override;
  void controls();
  void files();
  void slide(live::Slider &slider);
  void sliders();
  void plots();
  void numbers();
  void help();
  void shot(const std::string &name);

  Options options_;
  cli::Globals globals_;
  std::optional<Script> script_;
  std::optional<cli::Recording> replay_;
  std::unique_ptr<Stage> stage_;
  std::unique_ptr<SpaceMouse> space_mouse_;
  std::string no_space_mouse_;  // why there is none
  bool running_ = false, help_ = false;
  double speed_ = 1;                // simulated seconds per second
  double wanted_ = 0;               // s of the scene, by the clock of the window
  double last_ = 0;                 // s, when the last frame began
  double frame_ms_ = 0, real_ = 0;  // smoothed; simulated seconds per second
  uint64_t frames_ = 0;
  bool leads_ = false;            // the button that is held leads the tool in hand
  std::vector<double> felt_[2];   // arrows of forces and torques on tools
  double lead_[6] = {};           // from the tool in hand to where it shall go
  double strongest_[2] = {0, 0};  // N, N m, of an arrow of full length
  std::string message_;           // for the user, until the next one
  bool confirmed_ = false;        // whether b shall start the scene again; the next key answers
  std::string saved_, recorded_;  // the last state; the folder of the last recording
  size_t shown_ = 0;              // state of the recording
};

}  // namespace view
