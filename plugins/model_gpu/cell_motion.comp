#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of cell_motion.glsl: one invocation per point.
#include "points.glsl"
layout(std430, binding = 5) readonly buffer Rows { uvec2 rows[]; };
layout(std430, binding = 8) readonly buffer Forces { dvec4 forces[]; };
layout(std430, binding = 9) readonly buffer RestRows { double rest_rows[]; };
layout(std430, binding = 10) buffer Highest { uint highest; };
#define ROW(i) rows[i]
#define CORNER_FORCE(i) forces[i]
#define REST_ROW(i) rest_rows[i]
#define RAISE(rate) raise(rate)
// A stale value costs an atomic maximum, no more.
void raise(float rate) {
  const uint bits = floatBitsToUint(rate);
  if (bits > highest) atomicMax(highest, bits);
}
#include "cell_motion.glsl"
void main() {
  if (gl_GlobalInvocationID.x < count) move_corners(gl_GlobalInvocationID.x);
}
