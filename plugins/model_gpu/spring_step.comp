#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of spring_step.glsl: one invocation per point.
#include "points.glsl"
layout(std430, binding = 5) readonly buffer Rows { uvec2 rows[]; };
layout(std430, binding = 6) readonly buffer Springs { uvec4 springs[]; };
#define ROW(i) rows[i]
#define SPRING(i) springs[i]
#include "spring_step.glsl"
void main() {
  if (gl_GlobalInvocationID.x < count) move_point(gl_GlobalInvocationID.x);
}
