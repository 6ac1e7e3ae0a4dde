// What lies above the picture: buttons, numbers, help.
#include <imgui.h>

#include <cstdio>

#include "app.h"
#include "run.h"

namespace view {
namespace {

constexpr float kWide = 270, kGap = 12;  // pixels

void pale() {
  ImGui::StyleColorsLight();
  ImGuiStyle &style = ImGui::GetStyle();
  style.WindowRounding = 4;
  style.FrameRounding = 3;
  style.WindowBorderSize = 0;
  style.Colors[ImGuiCol_WindowBg] = {1, 1, 1, 0.78f};
}

}  // namespace

void App::panels() {
  pale();
  ImGui::SetNextWindowPos({kGap, kGap}, ImGuiCond_Always);
  ImGui::SetNextWindowSize({kWide, 0}, ImGuiCond_Always);
  ImGui::Begin("deform", nullptr,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                   ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_AlwaysAutoResize);
  controls();
  numbers();
  ImGui::End();
}

void App::controls() {
  if (ImGui::Button(running_ ? "pause" : "run", {60, 0})) key("space");
  ImGui::SameLine();
  if (ImGui::Button("step")) key("s");
  ImGui::SameLine();
  if (ImGui::Button("restart")) key("r");
  ImGui::SameLine();
  if (ImGui::Button("help")) key("h");
  float speed = float(speed_);
  ImGui::SetNextItemWidth(150);
  if (ImGui::SliderFloat("speed", &speed, 0.01f, 4, "%.2f x", ImGuiSliderFlags_Logarithmic)) speed_ = speed;
}

void App::numbers() {
  const dfm_world_stats stats = cli::world_stats(scene_);
  ImGui::Text("t = %.4f s", simulation_.time());
  ImGui::Text("%u contacts, %u stick", stats.contacts, stats.sticking);
  // What the machine needs differs from run to run, so that a script's pictures are without it.
  if (!script_) {
    ImGui::Text("%.3f ms a step, %.2f x real time", simulation_.step_ms(), running_ ? real_ : 0);
    ImGui::Text("%.0f frames a second", frame_ms_ > 0 ? 1e3 / frame_ms_ : 0);
  }
  if (!message_.empty()) {
    ImGui::PushTextWrapPos(kWide - 12);
    ImGui::TextUnformatted(message_.c_str());
    ImGui::PopTextWrapPos();
  }
  if (!help_) return;
  ImGui::Separator();
  ImGui::TextUnformatted(
      "space  run or pause\ns  one step\nr  back to the start\nc  next coloring\nhome  first camera\n"
      "left or right mouse  turn\nmiddle mouse  shift\nwheel  nearer, farther\nh  this help\nq  quit");
}

}  // namespace view
