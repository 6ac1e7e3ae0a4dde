#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of volume_forces.glsl: one invocation per cell.
#include "points.glsl"
layout(std430, binding = 10) readonly buffer Corners { uvec4 corners[]; };
layout(std430, binding = 11) readonly buffer Volumes { dvec4 volumes[]; };
layout(std430, binding = 12) writeonly buffer Forces { dvec4 forces[]; };
#define CORNER(i) corners[i]
#define VOLUME(i) volumes[i]
#define FORCE(i, value) forces[i] = value
// of model_common/volume_limits.h
#define COLLAPSE_BELOW 0.6lf
#define COLLAPSE_COUNTED 0.7lf
#define FADE1 0.1287f
#define FADE2 4.655f
#include "volume_forces.glsl"
void main() {
  if (gl_GlobalInvocationID.x < count) force_of_volume(gl_GlobalInvocationID.x);
}
