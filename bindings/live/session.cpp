#include "live/session.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "cli/interrupt.h"
#include "cli/messages.h"
#include "cli/state_file.h"

namespace live {
namespace {

constexpr double kBudget = 0.9;  // of the time of a picture, for steps; what is left is for viewers

constexpr size_t kBrief = 256;  // bytes of each text that goes in one datagram

constexpr double kFar = 1e6;  // m, of a viewer's coordinates

std::string list_of(const cli::JsonValue &line, const char *key, size_t n) {
  const std::vector<double> x = line.numbers(key, n);
  if (!std::ranges::all_of(x, [](double v) { return std::fabs(v) <= kFar; }))
    throw cli::Failure(cli::kBadInput, std::string("a number under \"") + key + "\" is too large");
  return cli::json_numbers(x);
}

render::Vec vector(const cli::JsonValue &line, const char *key) {
  list_of(line, key, 3);
  return render::vec(line.numbers(key).data());
}

}  // namespace

Session::Session(const cli::Globals &globals, const std::string &scene, const std::vector<std::string> &set,
                 Viewers &viewers, bool runs)
    : scene_(globals, scene, set, 0),
      simulation_(scene_, dfm_world_time(scene_.world())),
      pull_(simulation_),
      sliders_(make_sliders(simulation_)),
      upright_(scene_),
      viewers_(viewers),
      running_(runs) {
  cli::refuse_static(scene_, "serve");
}

void Session::picture(double seconds) {
  for (const Request &request : viewers_.take()) act(request);
  attempt([&] {
    if (pull_.holds() && viewers_.in_control() != holder_) pull_.release();
    if (running_) advance(seconds);
  });
  attempt([&] {
    scene_.renew_list();
    if (viewers_.viewers() > 0) show();
  });
}

// What fails tells viewers why, and ends a pull; they can go on, or reset.
void Session::attempt(const std::function<void()> &what) {
  try {
    what();
  } catch (const cli::Failure &e) {
    message_ = e.what();
    running_ = false;
    let_go();
  }
}

void Session::let_go() {
  try {
    pull_.release();
  } catch (const cli::Failure &) {  // a cut has taken what was held
  }
}

void Session::act(const Request &request) {
  cli::JsonValue line;
  message_.clear();
  try {
    if (!cli::parse_json(request.text, line) || line.kind != cli::JsonValue::object)
      throw cli::Failure(cli::kBadInput, "a request is an object of JSON");
    handle(line.get("do"), line, request.viewer);
  } catch (const cli::Failure &e) {
    message_ = e.what();
  }
}

// What a viewer may ask for, with names as in doc/reference/stream.md.
void Session::handle(const std::string &what, const cli::JsonValue &line, uint32_t viewer) {
  if (what == "grab") {
    let_go();
    holder_ = viewer;
    const render::Vec along = vector(line, "along");
    if (!(render::norm(along) > 0)) throw cli::Failure(cli::kBadInput, "\"along\" is zero");
    pull_.grab(vector(line, "from"), along);
  } else if (what == "pull") {
    pull_.move(vector(line, "to"));
  } else if (what == "release") {
    pull_.release();
  } else if (what == "slider") {
    set_slider(sliders_, line);
  } else if (what == "cut") {
    let_go();
    cli::JsonObject cut;
    simulation_.act(cut.add("do", "\"cut\"", "blade", list_of(line, "blade", 12)));
  } else if (what == "run") {
    const cli::JsonValue *const on = line.find("on");
    running_ = on && on->kind == cli::JsonValue::literal && on->text == "true";
    if (running_ && simulation_.at_end()) simulation_.go_on();
    wanted_ = simulation_.time();
  } else if (what == "step") {
    running_ = false;
    if (simulation_.at_end()) simulation_.go_on();
    if (!simulation_.step()) message_ = simulation_.trouble();
  } else if (what == "reset") {
    let_go();
    simulation_.restart();
    for (Slider &s : sliders_) s.value = s.first;
    wanted_ = 0;
  } else {
    throw cli::Failure(cli::kBadInput, "\"" + what + "\" is nothing that a viewer can ask for");
  }
}

// In the time of one picture; slower than real time where that is too short.
void Session::advance(double seconds) {
  const double before = simulation_.time();
  const Clock::time_point began = Clock::now();
  wanted_ += seconds;
  while (simulation_.time() < wanted_ - 1e-9 && !cli::interrupted()) {
    if (!simulation_.step()) {
      running_ = false;
      message_ = simulation_.trouble().empty() ? "The scene has ended; run goes on." : simulation_.trouble();
      break;
    }
    if (std::chrono::duration<double>(Clock::now() - began).count() > kBudget * seconds) {
      wanted_ = simulation_.time();
      break;
    }
  }
  real_ += 0.1 * ((simulation_.time() - before) / seconds - real_);
}

// What viewers have not yet, alone; viewers that come later get everything.
void Session::show() {
  teller_.look(scene_.world());
  if (!teller_.scene.empty()) viewers_.show_scene(std::move(teller_.scene), std::move(teller_.changed));
  viewers_.show_state(whole_state());
  viewers_.show_frame(teller_.frame);
}

std::string Session::probe(uint32_t i, size_t most) const {
  const char *name = nullptr;
  double at[3];
  cli::need(dfm_scene_probe(scene_.scene(), i, &name, at, nullptr));
  cli::JsonObject out;
  out.add("name", cli::quoted(std::string(name).substr(0, most)));
  return out.add("at", cli::json_vector(at)).text();
}

std::string Session::brief_state(uint32_t viewer, size_t turn) const {
  cli::JsonObject out = state(kBrief);
  out.add("you", viewer);
  if (!sliders_.empty()) out.add("sliders", cli::json_array({slider_text(sliders_[turn % sliders_.size()])}));
  if (const uint32_t n = scene_.settings().nprobe)
    out.add("probes", cli::json_array({probe(uint32_t(turn % n), kBrief)}));
  return cli::as_utf8(out.text());
}

std::string Session::whole_state() const {
  std::vector<std::string> sliders, probes;
  for (const Slider &s : sliders_) sliders.push_back(slider_text(s));
  for (uint32_t i = 0; i < scene_.settings().nprobe; ++i) probes.push_back(probe(i));
  cli::JsonObject out = state();
  out.add("sliders", cli::json_array(sliders), "probes", cli::json_array(probes));
  return cli::as_utf8(out.text());
}

cli::JsonObject Session::state(size_t most) const {
  double up[3];
  upright_.at(dfm_world_time(scene_.world()), up);
  cli::JsonObject out;
  out.add("scene", cli::quoted(scene_.path().substr(0, most)), "time", simulation_.time(), "frame",
          teller_.number(), "running", running_, "message", cli::quoted(message_.substr(0, most)), "step_ms",
          simulation_.step_ms(), "real", real_, "control", viewers_.in_control(), "viewers",
          viewers_.viewers(), "up", cli::json_vector(up));
  const dfm_scene_settings &settings = scene_.settings();
  if (settings.has_camera)
    out.add("eye", cli::json_vector(settings.eye), "look_at", cli::json_vector(settings.look_at));
  if (pull_.holds()) {
    cli::JsonObject pull;
    pull.add("place", text_of(pull_.place()), "to", text_of(pull_.to()));
    out.add("pull", pull.add("force", pull_.force()).text());
  }
  return out;
}

}  // namespace live
