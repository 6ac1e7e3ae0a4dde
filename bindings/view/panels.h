// Parts of panels that each window has.
#pragma once
#include <imgui.h>

#include <string>

#include "plots.h"

namespace view {

inline constexpr float kWide = 310, kGap = 12;  // pixels, for letters of 14
inline constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                                           ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoTitleBar |
                                           ImGuiWindowFlags_AlwaysAutoResize;
// Scales a size that is meant for letters of 14 pixels.
float scaled(float size);
void begin_panel();  // in the upper left corner; ImGui::End() ends it
void wrapped(const std::string &text);
void begin_plots(float width);  // in the upper right corner of a window so wide
void draw_plot(const Plot &plot);
// The number stands beside the handle, which would cover it. True: it was moved.
bool slider(const char *label, float *x, float low, float high, const char *format,
            ImGuiSliderFlags flags = 0);

}  // namespace view
