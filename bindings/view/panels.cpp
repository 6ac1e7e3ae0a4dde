// What lies above the picture: buttons, numbers, help.
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "app.h"
#include "panels.h"
#include "run.h"

namespace view {
namespace {

constexpr float kPlot = 270, kHigh = 64, kLine = 16;
constexpr float kSlider = 96, kValue = 112, kLabel = 184;  // where a row's parts end or begin, from the left
constexpr float kKeys = 104;                               // of the help
const ImU32 kCurves[] = {IM_COL32(45, 105, 180, 255), IM_COL32(205, 80, 55, 255), IM_COL32(60, 140, 85, 255)};

void color_bar(const cli::Drawing::Legend &legend) {
  constexpr int kParts = 64;
  ImGui::TextWrapped("%s [%s]", legend.title.c_str(), legend.unit.c_str());
  const ImVec2 at = ImGui::GetCursorScreenPos(), size = {ImGui::GetContentRegionAvail().x, scaled(10)};
  ImDrawList *const list = ImGui::GetWindowDrawList();
  for (int i = 0; i < kParts; ++i) {
    const render::Color c = render::map_color(legend.map, float(i) / (kParts - 1));
    list->AddRectFilled({at.x + size.x * float(i) / kParts, at.y},
                        {at.x + size.x * float(i + 1) / kParts, at.y + size.y},
                        ImGui::ColorConvertFloat4ToU32({c.r, c.g, c.b, 1}));
  }
  ImGui::Dummy(size);
  char high[32];
  std::snprintf(high, sizeof high, "%.3g", double(legend.range.high));
  ImGui::Text("%.3g", double(legend.range.low));
  ImGui::SameLine(ImGui::GetStyle().WindowPadding.x + size.x - ImGui::CalcTextSize(high).x);
  ImGui::TextUnformatted(high);
}

}  // namespace

float scaled(float size) { return size * ImGui::GetFontSize() / 14; }
void pale() {
  ImGui::StyleColorsLight();
  ImGuiStyle &style = ImGui::GetStyle();
  style.WindowRounding = 4;
  style.FrameRounding = 3;
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {1, 1, 1, 0.78f};
}

bool slider(const char *label, float *x, float low, float high, const char *format, ImGuiSliderFlags flags) {
  char value[32];
  std::snprintf(value, sizeof value, format, double(*x));
  ImGui::PushID(label);
  ImGui::SetNextItemWidth(scaled(kSlider));
  const bool moved = ImGui::SliderFloat("", x, low, high, "", flags);
  ImGui::PopID();
  ImGui::SameLine(scaled(kValue));
  ImGui::TextUnformatted(value);
  ImGui::SameLine(scaled(kLabel));
  ImGui::TextWrapped("%s", label);
  return moved;
}

void begin_panel() {
  pale();
  ImGui::SetNextWindowPos({scaled(kGap), scaled(kGap)}, ImGuiCond_Always);
  ImGui::SetNextWindowSize({scaled(kWide), 0}, ImGuiCond_Always);
  ImGui::Begin("deform", nullptr, kFixed);
}

void wrapped(const std::string &text) {
  ImGui::PushTextWrapPos(scaled(kWide) - 12);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
}

void begin_plots(float width) {
  ImGui::SetNextWindowPos({width - scaled(kGap), scaled(kGap)}, ImGuiCond_Always, {1, 0});
  ImGui::SetNextWindowSize({scaled(kPlot), 0}, ImGuiCond_Always);
  ImGui::Begin("plots", nullptr, kFixed);
}

// Curves over simulated time in the rectangle below the cursor, with the ends of both axes.
void draw_plot(const Plot &plot) {
  const std::vector<double> &times = plot.times;
  if (times.size() < 2) return;
  ImGui::TextUnformatted((plot.title + ", " + plot.unit).c_str());
  for (size_t c = 0; c < plot.curves.size() && !plot.curves[c].name.empty(); ++c) {
    ImGui::SameLine();
    ImGui::TextColored(ImGui::ColorConvertU32ToFloat4(kCurves[c % 3]), "%s", plot.curves[c].name.c_str());
  }
  float low = 0, high = 0;
  for (const Curve &c : plot.curves)
    for (const float y : c.values) {
      low = std::min(low, y);
      high = std::max(high, y);
    }
  if (!(high > low)) high = low + 1e-12f;
  const ImVec2 at = ImGui::GetCursorScreenPos(), size = {scaled(kPlot) - 16, scaled(kHigh)};
  ImDrawList *const list = ImGui::GetWindowDrawList();
  const ImU32 ink = IM_COL32(90, 95, 105, 255);
  list->AddRectFilled(at, {at.x + size.x, at.y + size.y}, IM_COL32(255, 255, 255, 160));
  const auto down = [&](float y) { return at.y + size.y * (1 - (y - low) / (high - low)); };
  list->AddLine({at.x, down(0)}, {at.x + size.x, down(0)}, IM_COL32(170, 175, 185, 255));
  const double first = times.front(), length = std::max(times.back() - first, 1e-12);
  for (size_t c = 0; c < plot.curves.size(); ++c) {
    std::vector<ImVec2> way;
    for (size_t i = 0; i < times.size(); ++i)
      way.push_back({at.x + size.x * float((times[i] - first) / length), down(plot.curves[c].values[i])});
    list->AddPolyline(way.data(), int(way.size()), kCurves[c % 3], 0, 1.5f);
  }
  char text[32];
  const auto write = [&](float x, float y, double value, const char *unit) {
    std::snprintf(text, sizeof text, "%.3g%s", value, unit);
    list->AddText({x, y}, ink, text);
  };
  write(at.x + 2, at.y, high, "");
  write(at.x + 2, at.y + size.y - scaled(kLine), low, "");
  std::snprintf(text, sizeof text, "%.2f s", times.back());
  list->AddText({at.x + size.x - ImGui::CalcTextSize(text).x - 2, at.y + size.y - scaled(kLine)}, ink, text);
  ImGui::Dummy({size.x, size.y + 4});
}

void App::panels() {
  if (!show_panels_) return;
  begin_panel();
  controls();
  if (!replay_) files();
  numbers();
  if (!replay_) sliders();
  ImGui::End();
  if (show_plots_) plots();
}

void App::controls() {
  if (ImGui::Button(running_ ? "pause" : "run", {scaled(60), 0})) key("space");
  ImGui::SameLine();
  if (ImGui::Button("step")) key("s");
  ImGui::SameLine();
  if (ImGui::Button("restart")) key("r");
  ImGui::SameLine();
  if (ImGui::Button("help")) key("h");
  float speed = float(speed_);
  if (slider("speed", &speed, 0.01f, 4, "%.2f x", ImGuiSliderFlags_Logarithmic)) speed_ = speed;
  if (!replay_) return;
  float state = float(shown_);
  const float last = float(replay_->states.size() - 1);
  if (slider("state", &state, 0, last, "%.0f") && size_t(std::lround(state)) != shown_)
    attempt([&] {
      show_state(size_t(std::lround(state)));
      wanted_ = stage_->simulation.time();
    });
}

void App::files() {
  if (ImGui::Button("save", {scaled(60), 0})) key("f5");
  ImGui::SameLine();
  if (ImGui::Button("load")) key("f9");
  ImGui::SameLine();
  if (ImGui::Button(stage_->simulation.recording() ? "end recording" : "record")) key("v");
}

void App::slide(live::Slider &s) {
  float x = float(s.value);
  if (slider(s.label.c_str(), &x, float(s.low), float(s.high), s.format,
             s.logarithmic ? ImGuiSliderFlags_Logarithmic : 0))
    attempt([&] {
      s.apply(x);
      s.value = x;
    });
}

void App::sliders() {
  ImGui::Separator();
  float stiffness = float(stage_->pull.stiffness);
  if (slider("pull", &stiffness, 0.1f, 1000, "%.3g x", ImGuiSliderFlags_Logarithmic))
    stage_->pull.stiffness = stiffness;
  for (live::Slider &s : stage_->sliders) slide(s);
}

void App::plots() {
  if (stage_->plots.plots()[0].times.size() < 2) return;
  begin_plots(float(canvas_.width()));
  for (const Plot &p : stage_->plots.plots())
    if (!(p.measured && (script_ || replay_)) && (p.tool < 0 || p.tool == std::max(stage_->grip.taken(), 0)))
      draw_plot(p);
  ImGui::End();
}

void App::numbers() {
  const dfm_world_stats stats = cli::world_stats(stage_->scene);
  ImGui::Text("t = %.4f s", stage_->simulation.time());
  if (!replay_) {
    ImGui::Text("%u contacts,", stats.contacts);
    ImGui::SameLine();
    ImGui::TextColored({kSticks[0], kSticks[1], kSticks[2], 1}, "%u stick", stats.sticking);
    if (show_arrows_ && stats.contacts > 0) {
      ImGui::SameLine();
      ImGui::TextColored({0.8f, 0.5f, 0, 1}, "others slide");
      ImGui::Text("longest arrow %.3g N", stage_->arrows.longest());
    }
  }
  if (stage_->pull.holds()) ImGui::Text("pulled with %.3g N", stage_->pull.force());
  const live::Grip &grip = stage_->grip;
  if (grip.holds() && !replay_) {
    const live::Felt felt = grip.felt(size_t(grip.taken()));
    const auto text = [](const char *what, render::Vec v, const char *unit) {
      if (render::norm(v) < 0.1) v = v * 1e3;
      else ++unit;  // without its m for milli
      ImGui::Text("  %s %.2g %s (%.2g, %.2g, %.2g)", what, render::norm(v), unit, v.x, v.y, v.z);
    };
    const char *const name = grip.name(size_t(grip.taken())).c_str();
    if (grip.jaws()) ImGui::Text("in hand: %s, jaws %.0f deg", name, grip.opening() * 180 / std::numbers::pi);
    else ImGui::Text("in hand: %s", name);
    text("force", felt.force, "mN");
    text("torque", felt.torque, "mN m");
  }
  cli::Drawing::Legend legend;
  if (stage_->drawing.legend(legend)) color_bar(legend);
  else if (stage_->drawing.color() != "body")
    ImGui::TextWrapped("color: stress, which no model here provides");
  // What the machine needs differs from run to run, so that a script's pictures are without it.
  if (!script_) {
    ImGui::Text("%.3f ms a step, %.2f x real time", stage_->simulation.step_ms(), running_ ? real_ : 0);
    ImGui::Text("%.0f frames a second", frame_ms_ > 0 ? 1e3 / frame_ms_ : 0);
  }
  if (!message_.empty()) wrapped(message_);
  if (!help_) return;
  ImGui::Separator();
  help();
}

void App::help() {
  static const char *const kRows[][2] = {
      {"left mouse", "pulls a body; beside bodies: turns"},
      {"right mouse", "turns"},
      {"middle mouse", "shifts"},
      {"wheel", "nearer, farther"},
      {"space", "runs or pauses"},
      {"s", "one step"},
      {"r", "back to the start"},
      {"c", "next coloring"},
      {"a", "arrows of contact forces"},
      {"p", "plots"},
      {"t", "no panels, for a picture"},
      {"x", "strokes of the left mouse button cut"},
      {"f5, f9", "save, load"},
      {"v", "begins or ends a recording"},
      {"tab", "takes the next tool in hand; so does the mouse"},
      {"arrows, page up, page down", "move it; with shift: turn it"},
      {"j, k", "close, open its jaws"},
      {"l", "lets it go back to its motion"},
      {"b", "starts again with a ball as a further tool"},
      {"home", "first camera"},
      {"h", "this help"},
      {"q", "quits"},
      {"6-DOF mouse", space_mouse_ ? "leads the tool in hand" : no_space_mouse_.c_str()}};
  if (!ImGui::BeginTable("help", 2)) return;
  ImGui::TableSetupColumn("key", ImGuiTableColumnFlags_WidthFixed, scaled(kKeys));
  ImGui::TableSetupColumn("does", ImGuiTableColumnFlags_WidthStretch);
  for (const auto &[key, does] : kRows) {
    if (!*does) continue;
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextWrapped("%s", key);
    ImGui::TableNextColumn();
    ImGui::TextWrapped("%s", does);
  }
  ImGui::EndTable();
}

}  // namespace view
