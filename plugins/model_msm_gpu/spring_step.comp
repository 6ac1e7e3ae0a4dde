#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
// The device's side of spring_step.glsl: one invocation per point.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Places { dvec4 place[]; };
layout(std430, binding = 1) readonly buffer Speeds { dvec4 speed[]; };
layout(std430, binding = 2) readonly buffer Loads { dvec4 loads[]; };
layout(std430, binding = 3) readonly buffer Rows { uvec2 rows[]; };
layout(std430, binding = 4) readonly buffer Springs { uvec4 springs[]; };
layout(std430, binding = 5) writeonly buffer NextPlaces { dvec4 next_place[]; };
layout(std430, binding = 6) writeonly buffer NextSpeeds { dvec4 next_speed[]; };
layout(push_constant) uniform Now {
  double step;     // s
  uint npoint;
  float damping;   // s
};
#define PLACE(i) place[i]
#define SPEED(i) speed[i]
#define LOAD(i) loads[i]
#define ROW(i) rows[i]
#define SPRING(i) springs[i]
#define NEXT_PLACE(i, value) next_place[i] = value
#define NEXT_SPEED(i, value) next_speed[i] = value
#define STEP step
#define UNROLLED [[unroll]]
#define DAMPING damping
#include "spring_step.glsl"
void main() {
  if (gl_GlobalInvocationID.x < npoint) move_point(gl_GlobalInvocationID.x);
}
