#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of spring_step.glsl: one invocation per point. A pipeline is made for each combination of
// the constants that a body needs.
#include "points.glsl"
#include "raise.glsl"
layout(constant_id = 0) const bool has_cells = false;
layout(constant_id = 1) const bool has_options = false;
layout(constant_id = 2) const bool has_branches = false;
layout(constant_id = 3) const bool turned = false;
layout(std430, binding = 8) buffer Stretches { double stretches[]; };
layout(std430, binding = 14) readonly buffer SpringRows { uvec2 spring_rows[]; };
layout(std430, binding = 15) readonly buffer Springs { uvec4 springs[]; };
layout(std430, binding = 16) readonly buffer Options { uvec2 options[]; };
#define HAS_CELLS has_cells
#define HAS_OPTIONS has_options
#define HAS_BRANCHES has_branches
#define TURNED turned
#define SPRING_ROW(i) spring_rows[i]
#define SPRING(i) springs[i]
#define OPTIONS(i) options[i]
#define STRETCH(i) stretches[i]
#define NEXT_STRETCH(i, value) stretches[i] = value
#include "spring_step.glsl"
void main() {
  if (gl_GlobalInvocationID.x < count) move_point(gl_GlobalInvocationID.x);
}
