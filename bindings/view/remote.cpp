#include "remote.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "drawing.h"
#include "live/pull.h"
#include "messages.h"
#include "panels.h"

namespace view {

using render::Vec;

namespace {

constexpr size_t kMaxPlots = 32;  // probes

// Distance along a ray to triangles; infinite: it meets none.
double distance(const live::Received::Mesh &m, const Ray &ray) {
  double best = std::numeric_limits<double>::infinity();
  const auto at = [&](uint32_t i) { return render::vec(&m.x[3 * size_t{i}]); };
  for (size_t k = 0; k + 2 < m.triangles.size(); k += 3) {
    const Vec p = at(m.triangles[k]), u = at(m.triangles[k + 1]) - p, v = at(m.triangles[k + 2]) - p;
    const Vec h = cross(ray.direction, v), s = ray.origin - p, q = cross(s, u);
    const double d = dot(u, h), a = dot(s, h) / d, b = dot(ray.direction, q) / d, far = dot(v, q) / d;
    if (a >= 0 && b >= 0 && a + b <= 1 && far > 0 && far < best) best = far;
  }
  return best;
}

// Three numbers of a state; none where they are no place.
std::vector<double> place_in(const cli::JsonValue &state, const char *key) {
  std::vector<double> x = state.numbers(key);
  const bool good = x.size() == 3 && std::ranges::all_of(x, [](double v) { return std::fabs(v) < 1e9; });
  return good ? x : std::vector<double>();
}

}  // namespace

Remote::Remote(const Options &options, const cli::Globals &globals)
    : options_(options), globals_(globals), receiver_(options.scene) {
  if (!options.script.empty()) script_.emplace(options.script);
  const std::string place = options.scene.substr(0, options.scene.find('?'));  // who looks on learns no token
  open(options, "deform view " + place.substr(0, 40), !script_);
  last_ = window_->now();
}

void Remote::frame() {
  std::vector<Input> inputs = window_->poll(0.004);
  receiver_.hear();
  std::vector<ScriptLine> current;
  const double now = window_->now();
  if (size_ == 0) first_look();
  if (size_ == 0) began_ = now;
  else if (script_) script_->frame(now - began_, inputs, current);
  window_->begin_panels(inputs, now - last_);
  last_ = now;
  for (const Input &in : inputs) handle(in);
  for (const ScriptLine &line : current)
    if (line.kind == ScriptLine::slider) set_slider(line.name, line.value);
  pull_to_mouse();
  sample();
  panels();
  draw();
  for (const ScriptLine &line : current)
    if (line.kind == ScriptLine::shot) shot(line.name);
  window_->show();
  if (script_ && (script_->done() || (size_ == 0 && receiver_.ended()))) quit_ = true;
}

// All of it, as for off-screen pictures; the scene's own camera where the sender tells it.
void Remote::first_look() {
  if (receiver_.frames() == 0) return;
  render::Scene picture;
  fill(picture);
  const render::Bounds all = render::bounds(picture);
  if (all.empty() || !canvas_.fit()) return;
  size_ = render::norm(render::vec(all.hi) - render::vec(all.lo));
  orbit_.set_up(render::vec(picture.up));
  orbit_.set(render::auto_camera(picture, canvas_.aspect()));
}

void Remote::send_request(const char *what, const std::function<void(cli::JsonObject &)> &more,
                          const std::string &replaces) {
  cli::JsonObject request;
  request.add("do", cli::quoted(what));
  if (more) more(request);
  receiver_.send(request, replaces);
}

bool Remote::steers() const {
  const cli::JsonValue &state = receiver_.state();
  return state.kind == cli::JsonValue::object && state.get("control") == state.get("you");
}

void Remote::key(const std::string &name) {
  if (name == "space") {
    send_request("run", [&](cli::JsonObject &r) { r.add("on", running() ? "false" : "true"); });
  } else if (name == "s" || name == ".") {
    send_request("step");
  } else if (name == "r") {
    send_request("reset");
  } else if (name == "c") {
    send_request("take");
  } else if (name == "home") {
    size_ = 0;
    set_ = false;
  } else if (!shared_key(name) && script_) {
    throw cli::Failure(cli::kBadInput, script_->path() + ": there is no key \"" + name + "\" of a stream");
  }
}

void Remote::release(int button) {
  if (button != kLeft || !pulled_) return;
  pulled_.reset();
  send_request("release");
}

void Remote::cut(const double blade[12]) {
  send_request("cut", [&](cli::JsonObject &r) { r.add("blade", cli::json_numbers({blade, 12})); });
}

void Remote::press(int button) {
  const Ray at = ray();
  double far = std::numeric_limits<double>::infinity();
  for (const auto &[number, body] : receiver_.scene().meshes())
    if (const auto *const m = body.drawn(); m && !m->rigid && receiver_.scene().present(number))
      far = std::min(far, distance(*m, at));
  if (button != kLeft || !std::isfinite(far) || !steers()) {
    held_ = button;
    return;
  }
  pulled_ = at.origin + at.direction * far;
  send_request("grab", [&](cli::JsonObject &r) {
    r.add("from", live::text_of(at.origin), "along", live::text_of(at.direction));
  });
}

// In the plane through the picked place that faces the camera.
void Remote::pull_to_mouse() {
  if (!pulled_) return;
  const Vec to = orbit_.at_depth(across(), above(), aspect(), *pulled_);
  if (render::norm(to - *pulled_) == 0) return;
  pulled_ = to;
  send_request("pull", [&](cli::JsonObject &r) { r.add("to", live::text_of(to)); }, "pull");
}

void Remote::set_slider(const std::string &name, double value) {
  send_request(
      "slider", [&](cli::JsonObject &r) { r.add("name", cli::quoted(name), "value", value); },
      "slider " + name);
}

// What the state tells of probes, one in each answer, and of the pull.
void Remote::sample() {
  const cli::JsonValue &state = receiver_.state();
  const double time = state.scalar("time");
  if (run_ != receiver_.runs() || time < plotted_) plots_.clear();  // of another run, or it was reset
  run_ = receiver_.runs();
  plotted_ = std::fabs(time) < 1e9 ? time : 0;
  const auto add = [&](const std::string &title, const Plot &fresh, const std::vector<double> &values) {
    const bool good =
        time == plotted_ && std::ranges::all_of(values, [](double v) { return std::fabs(v) < 1e9; });
    const auto at = plots_.find(title);
    if (!good || values.size() != fresh.curves.size() || (at == plots_.end() && plots_.size() >= kMaxPlots))
      return;
    Plot &plot = at == plots_.end() ? plots_.emplace(title, fresh).first->second : at->second;
    plot.add(time, values.data());
  };
  for (const cli::JsonValue &probe : state.list("probes")) {
    const std::string title = "probe " + probe.get("name").substr(0, 40);
    add(title, {title, "m", {{"x", {}}, {"y", {}}, {"z", {}}}}, probe.numbers("at"));
  }
  if (const cli::JsonValue *const pull = state.find("pull"))
    add("pull", {"pull", "N", {{"", {}}}}, {pull->scalar("force")});
}

void Remote::panels() {
  if (!show_panels_) return;
  begin_panel();
  const live::Received &scene = receiver_.scene();
  const cli::JsonValue &state = receiver_.state();
  if (steers()) {
    if (ImGui::Button(running() ? "pause" : "run", {scaled(60), 0})) key("space");
    ImGui::SameLine();
    if (ImGui::Button("step")) key("s");
    ImGui::SameLine();
    if (ImGui::Button("restart")) key("r");
    ImGui::SameLine();
    if (ImGui::Button(cutting_ ? "end cuts" : "cut")) key("x");
  } else if (state.kind == cli::JsonValue::object) {
    if (ImGui::Button("take control")) key("c");
  }
  ImGui::Text("t = %.4f s, frame %u", scene.time(), scene.frame());
  ImGui::Text("%llu packets, %llu lost", static_cast<unsigned long long>(receiver_.packets()),
              static_cast<unsigned long long>(receiver_.lost()));
  if (receiver_.ended()) ImGui::TextUnformatted("The sender has ended.");
  else if (receiver_.packets() == 0) ImGui::TextUnformatted("Nothing has come yet.");
  if (const std::string message = state.get("message"); !message.empty()) wrapped(message);
  for (live::RtpReceiver::Slider &s : receiver_.sliders()) {
    ImGui::PushID(s.name.c_str());  // labels may be alike
    float x = float(s.value);
    if (slider(s.label.c_str(), &x, float(s.low), float(s.high), "%.3g",
               s.logarithmic ? ImGuiSliderFlags_Logarithmic : 0)) {
      s.value = std::clamp(double(x), s.low, s.high);
      set_slider(s.name, s.value);
    }
    ImGui::PopID();
  }
  ImGui::End();
  if (!show_plots_ || plots_.empty()) return;
  begin_plots(float(canvas_.width()));
  for (const auto &[title, plot] : plots_) draw_plot(plot);
  ImGui::End();
}

void Remote::fill(render::Scene &out) {
  const live::Received &scene = receiver_.scene();
  if (const std::vector<double> up = place_in(receiver_.state(), "up");
      !up.empty() && render::norm(render::vec(up.data())) > 0)
    std::copy_n(up.begin(), 3, out.up);
  uint32_t color = 0;
  for (const auto &[number, body] : scene.meshes()) {
    if (body.rigid) continue;
    const render::Color own = render::palette(color++);
    const auto *const m = body.drawn();
    if (!m || !scene.present(number) || m->triangles.empty()) continue;
    render::Surface s;
    s.xyz = m->x.data();
    s.n = uint32_t(m->x.size() / 3);
    s.tri = m->triangles.data();
    s.ntri = uint32_t(m->triangles.size() / 3);
    s.rgb[0] = own.r;
    s.rgb[1] = own.g;
    s.rgb[2] = own.b;
    out.surfaces.push_back(s);
  }
  size_t drawn = 0;
  for (const auto &[number, t] : scene.meshes()) {
    if (!t.rigid || t.sensor || t.missing || !scene.present(number)) continue;
    if (t.triangles.empty()) {
      cli::Solid solid = {t.kind, {}, {}, double{t.radius}, double{t.half_length}};
      std::copy_n(t.half_size, 3, solid.half_size);
      std::copy_n(t.position, 3, solid.pose.position);
      std::copy_n(t.rotation, 4, solid.pose.rotation);
      cli::add_solid(solid, false, out);
      continue;
    }
    if (drawn == placed_.size()) placed_.emplace_back();
    std::vector<double> &xyz = placed_[drawn++];
    xyz.resize(t.base.size());
    for (size_t i = 0; i < xyz.size(); i += 3) {
      const double p[3] = {double{t.base[i]}, double{t.base[i + 1]}, double{t.base[i + 2]}};
      cli::rotate(t.rotation, p, &xyz[i]);
      for (size_t k = 0; k < 3; ++k) xyz[i + k] += t.position[k];
    }
    cli::add_gray(xyz, t.triangles.data(), uint32_t(t.triangles.size() / 3), out);
  }
  placed_.resize(drawn);
}

void Remote::draw() {
  if (!canvas_.fit()) return window_->end_panels();
  render::Scene picture;
  fill(picture);
  orbit_.set_up(render::vec(picture.up));
  const cli::JsonValue &state = receiver_.state();
  if (const std::vector<double> eye = place_in(state, "eye"), at = place_in(state, "look_at");
      size_ > 0 && !set_ && !eye.empty() && !at.empty() && eye != at) {
    set_ = true;
    render::Camera own = orbit_.camera();
    std::copy_n(eye.begin(), 3, own.eye);
    std::copy_n(at.begin(), 3, own.look_at);
    orbit_.set(own);
  }
  picture.camera = orbit_.camera();
  std::vector<Touch> touches;
  for (const live::Received::Contact &c : receiver_.scene().contacts())
    touches.push_back(
        {{c.point[0], c.point[1], c.point[2]}, {c.force[0], c.force[1], c.force[2]}, c.sticks == 1});
  if (show_arrows_) arrows_.fill(touches, size_, *picture.camera, picture);
  std::vector<double> held;
  if (const cli::JsonValue *const pull = state.find("pull")) {
    held = place_in(*pull, "place");
    const std::vector<double> to = place_in(*pull, "to");
    held.insert(held.end(), to.begin(), to.end());
    if (held.size() == 6) picture.lines.push_back({held.data(), 1, {0.1f, 0.1f, 0.1f}, 2, true});
  }
  add_stroke(picture);
  canvas_.show(picture);
  window_->end_panels();
}

void Remote::shot(const std::string &name) {
  const std::string path = canvas_.write(options_.out.empty() ? "out/stream_view" : options_.out, name);
  if (!globals_.json) {
    if (!globals_.quiet) std::printf("%s: t = %g s\n", path.c_str(), receiver_.scene().time());
  } else {
    cli::JsonObject row, middles, plotted;
    size_t triangles = 0;
    for (const auto &[title, plot] : plots_) plotted.add(title, plot.times.size());
    for (const auto &[number, body] : receiver_.scene().meshes()) {
      const auto *const m = body.drawn();
      if (!m || m->rigid || !receiver_.scene().present(number)) continue;
      double sum[3] = {0, 0, 0};
      for (size_t i = 0; i < m->x.size(); ++i) sum[i % 3] += m->x[i] / double(m->x.size() / 3);
      middles.add(m->name, cli::json_vector(sum));
      triangles += m->triangles.size() / 3;
    }
    row.add("shot", cli::quoted(path), "t", receiver_.scene().time(), "frame", receiver_.scene().frame(),
            "lost", receiver_.lost(), "middle", middles.text(), "triangles", triangles, "plotted",
            plotted.text());
    std::printf("%s\n", row.text().c_str());
  }
  std::fflush(stdout);
}

}  // namespace view
