#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of cell_forces.glsl: one invocation per cell.
#include "points.glsl"
layout(std430, binding = 10) readonly buffer Corners { uvec4 corners[]; };
layout(std430, binding = 11) readonly buffer Shapes { dvec4 shapes[]; };
layout(std430, binding = 12) writeonly buffer Forces { dvec4 forces[]; };
#define CORNER(i) corners[i]
#define SHAPE(i) shapes[i]
#define FORCE(i, value) forces[i] = value
#include "cell_forces.glsl"
void main() {
  if (gl_GlobalInvocationID.x < count) force_of_cell(gl_GlobalInvocationID.x);
}
