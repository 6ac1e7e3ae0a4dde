#include "app.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "json_text.h"
#include "messages.h"
#include "run.h"
#include "run_folder.h"
#include "state_file.h"

namespace view {
namespace {

constexpr double kFrame = 1.0 / 60;  // s, of the clock of a script
constexpr double kBudget = 0.022;    // s of a frame that may go into steps, so that the window answers
constexpr double kTurn = 3.5;        // radians for a way across the picture's height

std::string folder_of(const Options &options, const std::string &scene) {
  if (!options.out.empty()) return options.out;
  return "out/" + std::filesystem::path(scene).stem().string() + "_view";
}

// As the off-screen pictures stand: the scene's own camera, or one that holds everything.
render::Camera first_camera(const cli::SceneFile &scene, const render::Scene &picture, double aspect) {
  render::Camera camera = render::auto_camera(picture, aspect);
  if (scene.settings().has_camera)
    for (int i = 0; i < 3; ++i) {
      camera.eye[i] = scene.settings().eye[i];
      camera.look_at[i] = scene.settings().look_at[i];
    }
  return camera;
}

// Begins where --from says; returns when the scene itself began.
double begin(const cli::SceneFile &scene, const Options &options) {
  cli::refuse_static(scene, "view");
  const double start = dfm_world_time(scene.world());
  if (!options.from.empty()) cli::read_state(scene, options.from);
  return start;
}

bool on_processor(const std::string &device) {
  return device.find("llvmpipe") != std::string::npos || device.find("softpipe") != std::string::npos ||
         device.find("swrast") != std::string::npos;
}

}  // namespace

App::App(const Options &options, const cli::Globals &globals)
    : options_(options),
      globals_(globals),
      scene_(globals, options.scene, options.set, 0),
      simulation_(scene_, begin(scene_, options)),
      drawing_(scene_, scene_.settings().color) {
  if (!options.script.empty()) script_.emplace(options.script);
  options_.out = folder_of(options, options.scene);
  window_ = Window::open(options.width, options.height,
                         "deform view " + std::filesystem::path(options.scene).filename().string(), !script_);
  window_->size(width_, height_);
  render::Scene picture;
  drawing_.fill(picture);
  extent_ = render::bounds(picture);
  orbit_.set(first_camera(scene_, picture, height_ > 0 ? aspect() : 1));
  wanted_ = simulation_.time();
  last_ = window_->now();
}

void App::run() {
  window_->begin_panels({}, kFrame);  // sizes of panels are known from the second time on
  panels();
  window_->end_panels();
  while (!window_->closed() && !quit_) frame();
}

void App::frame() {
  const bool idle = !script_ && !running_ && held_ < 0;
  std::vector<Input> inputs = window_->poll(idle ? 0.05 : 0);
  std::vector<ScriptLine> due;
  const double now = window_->now();
  double seconds = std::min(now - last_, 0.1);
  if (script_) {
    seconds = kFrame;
    script_->frame(double(frames_) * kFrame, inputs, due);
  }
  frame_ms_ += 0.1 * (1e3 * (now - last_) - frame_ms_);
  last_ = now;
  ++frames_;
  window_->begin_panels(inputs, seconds);
  for (const Input &in : inputs) handle(in);
  for (const ScriptLine &line : due)
    if (line.kind == ScriptLine::slider) set_slider(line.name, line.value);
  advance(seconds);
  panels();
  if (!draw()) return;
  for (const ScriptLine &line : due)
    if (line.kind == ScriptLine::shot) shot(line.name);
  window_->show();
  if (script_ && script_->done()) quit_ = true;
}

void App::handle(const Input &in) {
  if (in.kind == Input::key) return key(in.name);
  mouse(in);
}

void App::key(const std::string &name) {
  message_.clear();
  if (name == "space") {
    if (!running_ && simulation_.at_end()) simulation_.go_on();
    running_ = !running_;
    wanted_ = simulation_.time();
  } else if (name == "s" || name == ".") {
    running_ = false;
    if (simulation_.at_end()) simulation_.go_on();
    simulation_.step();
    wanted_ = simulation_.time();
  } else if (name == "r") {
    restart();
  } else if (name == "home") {
    render::Scene picture;
    drawing_.fill(picture);
    orbit_.set(first_camera(scene_, picture, aspect()));
  } else if (name == "c") {
    static const std::vector<std::string> kColors{"body", "contact", "speed", "displacement", "stress"};
    const auto at = std::find(kColors.begin(), kColors.end(), drawing_.color());
    drawing_.set_color(at == kColors.end() || at + 1 == kColors.end() ? kColors.front() : at[1]);
  } else if (name == "h") {
    help_ = !help_;
  } else if (name == "q" || name == "escape") {
    quit_ = true;
  } else if (script_) {
    throw cli::Failure(cli::kBadInput,
                       script_->path() + ": there is no key \"" + name + "\"; the key h shows them all");
  }
}

void App::mouse(const Input &in) {
  if (in.kind == Input::wheel) {
    if (!window_->panels_want_mouse()) orbit_.zoom(std::pow(0.88, in.turns));
    return;
  }
  const double dx = in.x - mouse_[0], dy = in.y - mouse_[1];
  mouse_[0] = in.x;
  mouse_[1] = in.y;
  if (in.kind == Input::press && held_ < 0 && !window_->panels_want_mouse()) held_ = in.button;
  if (in.kind == Input::release && in.button == held_) held_ = -1;
  if (in.kind != Input::move || held_ < 0) return;
  if (held_ == kMiddle) orbit_.shift(-dx / height_, dy / height_);
  else orbit_.turn(-kTurn * dx / height_, kTurn * dy / height_);
}

void App::set_slider(const std::string &name, double value) {
  if (name != "speed")
    throw cli::Failure(cli::kBadInput, script_->path() + ": there is no slider \"" + name + "\"");
  speed_ = value;
}

void App::advance(double seconds) {
  if (!running_) return;
  const double before = simulation_.time(), began = window_->now();
  wanted_ += seconds * speed_;
  while (simulation_.time() < wanted_ - 1e-9) {
    if (!simulation_.step()) {
      running_ = false;
      message_ = simulation_.trouble().empty() ? "The scene is at its end; space goes on."
                                               : "Stopped: " + simulation_.trouble();
      break;
    }
    if (!script_ && window_->now() - began > kBudget) {  // slower than asked for, rather than stuck
      wanted_ = simulation_.time();
      break;
    }
  }
  if (seconds > 0) real_ += 0.1 * ((simulation_.time() - before) / seconds - real_);
}

void App::restart() {
  simulation_.restart();
  wanted_ = simulation_.time();
  running_ = false;
}

bool App::draw() {
  uint32_t width = 0, height = 0;
  window_->size(width, height);
  if (width == 0 || height == 0) {
    window_->end_panels();
    return false;
  }
  if (!renderer_ || width != width_ || height != height_) {
    width_ = width;
    height_ = height;
    std::string why;
    renderer_.reset();
    const auto make = [&](render::Detail detail) {
      renderer_ = render::WindowRenderer::create(window_->symbol_of(), detail, width, height, &why);
      if (!renderer_) throw cli::Failure(cli::kBadInput, "view: " + why);
    };
    make(options_.detail == "full" ? render::Detail::full : render::Detail::fast);
    device_ = renderer_->device();
    if (options_.detail.empty() && !on_processor(device_)) make(render::Detail::full);
  }
  render::Scene picture;
  drawing_.fill(picture);
  picture.extent = extent_;
  picture.camera = orbit_.camera();
  std::string why;
  if (!renderer_->show(picture, &why)) throw cli::Failure(cli::kBadInput, "view: " + why);
  window_->end_panels();
  return true;
}

void App::shot(const std::string &name) {
  cli::make_folder(options_.out);
  const std::string path = name[0] == '/' ? name : options_.out + "/" + name;
  render::Image image;
  renderer_->read_window(image);
  std::string why;
  if (!render::write_png(path, image, &why)) throw cli::Failure(cli::kBadInput, why);
  const std::string hash = cli::hash_text(dfm_world_hash(scene_.world()));
  if (globals_.json) {
    cli::JsonObject bodies, row;
    for (const cli::BodyView &body : scene_.bodies())
      bodies.add(body.name, cli::json_vector(cli::body_measure(body).com));
    row.add("shot", cli::quoted(path))
        .add("t", cli::number(simulation_.time()))
        .add("state_hash", cli::quoted(hash))
        .add("com", bodies.text());
    std::printf("%s\n", row.text().c_str());
  } else if (!globals_.quiet) {
    std::printf("%s: t = %g s, state %s\n", path.c_str(), simulation_.time(), hash.c_str());
  }
  std::fflush(stdout);
}

}  // namespace view
