#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of cell_motion.glsl: one invocation per point.
#include "points.glsl"
#include "raise.glsl"
#include "cell_motion.glsl"
void main() {
  if (gl_GlobalInvocationID.x < count) move_corners(gl_GlobalInvocationID.x);
}
