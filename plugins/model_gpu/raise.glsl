// What a point reads of the cells around it, and where it leaves its rate, on the device.
layout(std430, binding = 7) buffer Highest { uint highest; };
layout(std430, binding = 9) readonly buffer CornerRows { uvec2 corner_rows[]; };
layout(std430, binding = 12) readonly buffer Forces { dvec4 forces[]; };
layout(std430, binding = 13) readonly buffer RestRows { double rest_rows[]; };
#define CORNER_ROW(i) corner_rows[i]
#define CORNER_FORCE(i) forces[i]
#define REST_ROW(i) rest_rows[i]
#define RAISE(rate) raise(rate)
// A stale value costs an atomic maximum, no more.
void raise(float rate) {
  const uint bits = floatBitsToUint(rate);
  if (bits > highest) atomicMax(highest, bits);
}
