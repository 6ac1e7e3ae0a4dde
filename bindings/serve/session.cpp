#include "session.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <thread>

#include "cli/leaving.h"
#include "cli/messages.h"

namespace serve {
namespace {

constexpr double kBudget = 0.9;  // of the time of a picture, for steps; what is left is for viewers

volatile std::sig_atomic_t ended = 0;
std::atomic<dfm_world> stepping{0};

void on_signal(int) {
  ended = 1;
  cli::expect_return();
  if (const dfm_world world = stepping) dfm_world_interrupt(world);
}

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

render::Vec vector(const cli::JsonValue &line, const char *key) {
  const std::vector<double> x = line.numbers(key);
  if (x.size() != 3 || !std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); }))
    throw cli::Failure(cli::kBadInput, std::string("expected three finite numbers under \"") + key + "\"");
  return render::vec(x.data());
}

std::string text_of(const render::Vec &v) {
  const double x[3] = {v.x, v.y, v.z};
  return cli::json_vector(x);
}

// What a viewer has sent, as it may stand in a sentence: an escaped half of a letter is none.
std::string plain(std::string text) {
  for (char &c : text)
    if (c < ' ' || c > '~') c = '?';
  return text;
}

// Four corners.
std::string blade_of(const cli::JsonValue &line) {
  const std::vector<double> x = line.numbers("blade");
  if (x.size() != 12 || !std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); }))
    throw cli::Failure(cli::kBadInput, "expected twelve finite numbers under \"blade\"");
  std::vector<std::string> out;
  for (const double v : x) out.push_back(cli::number(v));
  return cli::json_array(out);
}

const char *yes(bool x) { return x ? "true" : "false"; }

}  // namespace

Session::Session(const Options &options, const cli::Globals &globals)
    : options_(options),
      scene_(globals, options.scene, options.set, 0),
      simulation_(scene_, dfm_world_time(scene_.world())),
      pull_(simulation_),
      sliders_(live::make_sliders(simulation_)),
      upright_(scene_),
      server_(options.port, options.token),
      running_(!options.paused) {}

void Session::run() {
  catch_signals();
  stepping = scene_.world();
  std::printf("http://127.0.0.1:%u/?token=%s\n", unsigned{server_.port()}, options_.token.c_str());
  std::fflush(stdout);
  const std::chrono::duration<double> picture(1 / options_.rate);
  const Clock::time_point began = Clock::now();
  Clock::time_point next = began;
  while (!ended) {
    for (const Request &request : server_.take()) act(request);
    if (pull_.holds() && server_.in_control() != holder_) pull_.release();
    if (running_) advance(picture.count());
    scene_.renew_list();
    if (server_.viewers() > 0) show();
    next += std::chrono::duration_cast<Clock::duration>(picture);
    next = std::max(next, Clock::now());
    std::this_thread::sleep_until(next);
    if (options_.seconds > 0 && std::chrono::duration<double>(next - began).count() > options_.seconds) break;
  }
  stepping = 0;
  if (ended) cli::came_back();
}

void Session::act(const Request &request) {
  cli::JsonValue line;
  message_.clear();
  try {
    if (!cli::parse_json(request.text, line) || line.kind != cli::JsonValue::object)
      throw cli::Failure(cli::kBadInput, "a request is an object of JSON");
    holder_ = request.viewer;
    ask(line.get("do"), line);
  } catch (const cli::Failure &e) {
    message_ = e.what();
  }
}

// What a viewer may ask for, with names as in doc/reference/stream.md.
void Session::ask(const std::string &what, const cli::JsonValue &line) {
  if (what == "grab") {
    pull_.release();
    const render::Vec along = vector(line, "along");
    if (!(render::norm(along) > 0)) throw cli::Failure(cli::kBadInput, "\"along\" is zero");
    pull_.grab(vector(line, "from"), along);
  } else if (what == "pull") {
    pull_.move(vector(line, "to"));
  } else if (what == "release") {
    pull_.release();
  } else if (what == "slider") {
    const std::string name = line.get("name");
    const auto slider =
        std::find_if(sliders_.begin(), sliders_.end(), [&](const live::Slider &s) { return s.name == name; });
    if (slider == sliders_.end())
      throw cli::Failure(cli::kBadInput, "there is no slider \"" + plain(name) + "\"");
    const double value = line.scalar("value");
    if (!(value >= slider->low && value <= slider->high))
      throw cli::Failure(cli::kBadInput, "slider \"" + name + "\": the value is outside of its range");
    slider->apply(value);
    slider->value = value;
  } else if (what == "cut") {
    pull_.release();
    cli::JsonObject cut;
    simulation_.act(cut.add("do", "\"cut\"").add("blade", blade_of(line)));
  } else if (what == "run") {
    running_ = line.get("on") == "true";
    if (running_ && simulation_.at_end()) simulation_.go_on();
    wanted_ = simulation_.time();
  } else if (what == "step") {
    running_ = false;
    if (simulation_.at_end()) simulation_.go_on();
    if (!simulation_.step()) message_ = simulation_.trouble();
  } else if (what == "reset") {
    pull_.release();
    simulation_.restart();
    for (live::Slider &s : sliders_) s.value = s.first;
    wanted_ = 0;
  } else {
    throw cli::Failure(cli::kBadInput, "\"" + plain(what) + "\" is nothing that a viewer can ask for");
  }
}

// In the time of one picture; slower than real time where that is too short.
void Session::advance(double seconds) {
  const double before = simulation_.time();
  const Clock::time_point began = Clock::now();
  wanted_ += seconds;
  while (simulation_.time() < wanted_ - 1e-9 && !ended) {
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

Bytes Session::packets(uint32_t kind, dfm_body body) {
  dfm_stream_def def = dfm_stream_def_default();
  def.kind = kind;
  def.flags = kind == DFM_STREAM_FRAME ? uint32_t{DFM_STREAM_CONTACTS} : 0;
  def.frame = frame_;
  def.body = body;
  cli::write_packets(scene_.world(), def, buffer_);
  return buffer_;
}

// Bodies whose triangles are others than viewers have, alone; viewers that come later get everything.
void Session::show_scene(std::vector<std::pair<uint32_t, uint32_t>> shapes) {
  if (shapes == shown_ && !scene_due_) return;
  Bytes changed;
  for (const auto &shape : shapes) {
    if (std::find(shown_.begin(), shown_.end(), shape) != shown_.end()) continue;
    for (const cli::BodyView &body : scene_.bodies()) {
      if (static_cast<uint32_t>(body.handle) != shape.first) continue;
      const Bytes one = packets(DFM_STREAM_SCENE, body.handle);
      changed.insert(changed.end(), one.begin(), one.end());
    }
  }
  shown_ = std::move(shapes);
  server_.show_scene(packets(DFM_STREAM_SCENE), scene_due_ ? Bytes() : std::move(changed));
  scene_due_ = false;
}

void Session::show() {
  Bytes frame = packets(DFM_STREAM_FRAME);
  show_scene(cli::shapes_in(frame));
  server_.show_state(state());
  server_.show_frame(std::move(frame));
  ++frame_;
}

std::string Session::state() const {
  std::vector<std::string> sliders, probes;
  for (const live::Slider &s : sliders_) {
    cli::JsonObject one;
    one.add("name", cli::quoted(s.name))
        .add("label", cli::quoted(s.label))
        .add("value", cli::number(s.value));
    one.add("low", cli::number(s.low)).add("high", cli::number(s.high));
    sliders.push_back(one.add("logarithmic", yes(s.logarithmic)).text());
  }
  for (uint32_t i = 0; i < scene_.settings().nprobe; ++i) {
    const char *name = nullptr;
    double at[3];
    cli::need(dfm_scene_probe(scene_.scene(), i, &name, at, nullptr));
    probes.push_back(cli::JsonObject().add("name", cli::quoted(name)).add("at", cli::json_vector(at)).text());
  }
  double up[3];
  upright_.at(dfm_world_time(scene_.world()), up);
  cli::JsonObject out;
  out.add("scene", cli::quoted(scene_.path()))
      .add("time", cli::number(simulation_.time()))
      .add("frame", std::to_string(frame_))
      .add("running", yes(running_))
      .add("message", cli::quoted(message_))
      .add("step_ms", cli::number(simulation_.step_ms()))
      .add("real", cli::number(real_))
      .add("control", std::to_string(server_.in_control()))
      .add("viewers", std::to_string(server_.viewers()))
      .add("up", cli::json_vector(up))
      .add("sliders", cli::json_array(sliders))
      .add("probes", cli::json_array(probes));
  const dfm_scene_settings &settings = scene_.settings();
  if (settings.has_camera)
    out.add("eye", cli::json_vector(settings.eye)).add("look_at", cli::json_vector(settings.look_at));
  if (pull_.holds()) {
    cli::JsonObject pull;
    pull.add("place", text_of(pull_.place())).add("to", text_of(pull_.to()));
    out.add("pull", pull.add("force", cli::number(pull_.force())).text());
  }
  return out.text();
}

}  // namespace serve
