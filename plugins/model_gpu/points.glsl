// What the shaders share: the arrays of the points, and what they are called with.
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Places { dvec4 place[]; };
layout(std430, binding = 1) readonly buffer Speeds { dvec4 speed[]; };
layout(std430, binding = 2) readonly buffer Loads { dvec4 loads[]; };
layout(std430, binding = 3) writeonly buffer NextPlaces { dvec4 next_place[]; };
layout(std430, binding = 4) writeonly buffer NextSpeeds { dvec4 next_speed[]; };
layout(std430, binding = 5) readonly buffer Seen { dvec4 seen[]; };
layout(std430, binding = 6) writeonly buffer NextSeen { dvec4 next_seen[]; };
layout(push_constant) uniform Now {
  double step;     // s
  double kept;     // share of v - u
  uint count;      // of invocations
  float damping;   // s
  float per_lag;   // 1/s
  double was;      // of branches (doc/models/msm_gpu.md): b of the sub-step before
  double keep;     // E and b of this one
  double next;
  double part;     // share of the stiffness
};
#define PLACE(i) place[i]
#define SPEED(i) speed[i]
#define LOAD(i) loads[i]
#define NEXT_PLACE(i, value) next_place[i] = value
#define NEXT_SPEED(i, value) next_speed[i] = value
#define SEEN(i) seen[i]
#define NEXT_SEEN(i, value) next_seen[i] = value
#define OF_DAMPERS(i) (per_lag > 0.0f ? seen[i] : speed[i])
#define STEP step
#define KEPT kept
#define PER_LAG per_lag
#define IN(name, n) double name[n]
#define OUT(name, n) precise inout double name[n]
#define UNROLLED [[unroll]]
#define DAMPING damping
#define WAS was
#define KEEP keep
#define NEXT next
#define PART part
