// One key light with a soft shadow map, and a sky of 48 directions with a shadow map each: what the sky does
// not reach is dark, which is the shade in the gap between two bodies that shows whether they touch. A little
// light comes back from the ground, a soft rim from behind.
#include "shaders.h"

namespace render {

const char *const kVertexShader = R"(#version 330 core
in vec3 position;
in vec3 normal;
in vec3 color;
in vec2 value;
uniform mat4 to_clip;
centroid out vec3 p;
centroid out vec3 n;
flat out vec3 rgb;
centroid out vec2 scalar;
void main() {
  p = position;
  n = normal;
  rgb = color;
  scalar = value;
  gl_Position = to_clip * vec4(position, 1.0);
}
)";

const char *const kFragmentShader = R"(#version 330 core
const int SKY = 48;
const bool FAST = SKY < 48;  // for software: no powers, one sample of the key light
centroid in vec3 p;
centroid in vec3 n;
flat in vec3 rgb;     // one color a body: interpolation over triangles seen edge-on would round it
centroid in vec2 scalar;
const int kind = 0;          // 0 lit, 1 floor, 2 plain color, 3 values seen through: a program each
uniform float alpha;
uniform vec3 eye;
uniform vec3 up;
uniform vec3 key;            // toward the key light
uniform mat4 key_map;
uniform float key_texel;     // of the map, in lengths of the scene
uniform mat4 sky_map[SKY];
uniform vec3 sky[SKY];       // toward that piece of sky
uniform float sky_texel;
uniform vec3 casters;        // center of what casts shadows
uniform float casters_radius;
uniform float sky_scale;     // makes open level ground receive 1
uniform vec3 floor_center;
uniform vec3 floor_x;
uniform vec3 floor_y;
uniform vec2 floor_size;     // grid spacing, radius where it has faded
uniform sampler2DShadow key_shadow;
uniform sampler2DArrayShadow sky_shadow;
uniform sampler2D map;
layout(location = 0) out vec4 result;

vec3 linear(vec3 c) {
  if (FAST) return c * c;
  return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  if (FAST) return sqrt(c);
  return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}

// Sixteen points of a sunflower, each compared with its four neighbors by the sampler.
float key_light(vec3 nn) {
  vec3 q = (key_map * vec4(p + nn * (2.5 * key_texel), 1.0)).xyz;
  float depth = min(q.z - 0.0005, 1.0), lit = 0.0;
  if (FAST) return texture(key_shadow, vec3(q.xy, depth));
  float texel = 1.0 / float(textureSize(key_shadow, 0).x);
  for (int i = 0; i < 16; ++i) {
    float r = sqrt((float(i) + 0.5) / 16.0), a = 2.39996323 * float(i);
    lit += texture(key_shadow, vec3(q.xy + 3.5 * texel * r * vec2(cos(a), sin(a)), depth));
  }
  return lit / 16.0;
}

float sky_light(vec3 nn) {
  vec4 from = vec4(p + nn * (1.6 * sky_texel), 1.0);
  float away = smoothstep(2.5, 3.5, length(p - casters) / casters_radius);
  if (FAST) away = 1.0;  // few directions would each leave a shadow of its own on the level ground
  // most of the floor is open: a loop that ends at once costs nothing
  int count = kind == 1 && away >= 1.0 ? 0 : SKY;
  float sum = 0.0;
  for (int i = 0; i < count; ++i) {
    vec3 q = (sky_map[i] * from).xyz;
    sum += max(dot(nn, sky[i]), 0.0) * texture(sky_shadow, vec4(q.xy, float(i), min(q.z - 0.002, 1.0)));
  }
  return kind == 1 ? mix(sum * sky_scale, 1.0, away) : sum * sky_scale;
}

float lines_of(vec2 x, float width) {  // coverage of the lines at whole numbers, `width` in pixels
  vec2 w = fwidth(x), d = abs(fract(x - 0.5) - 0.5) / w;
  vec2 near = clamp(0.5 * width + 0.5 - d, 0.0, 1.0) * clamp(1.6 - 4.0 * w, 0.0, 1.0);
  return max(near.x, near.y);
}

void main() {
  vec3 v = normalize(eye - p), nn = normalize(n);
  if (kind == 2) { result = vec4(rgb, alpha); return; }
  if (!gl_FrontFacing) nn = -nn;  // by winding: at a silhouette the interpolated normal may already look away
  // Corners without a value weigh nothing in it; the flat ends of the step hide what interpolation over
  // slivers rounds.
  float value = scalar.x / max(scalar.y, 0.01), valued = smoothstep(0.1, 0.9, scalar.y);
  if (kind == 3) {
    result = vec4(texture(map, vec2(value * 256.0 / 257.0 + 0.5 / 257.0, 0.5)).rgb, alpha * valued);
    return;
  }
  vec3 base = linear(mix(rgb, texture(map, vec2(value * 256.0 / 257.0 + 0.5 / 257.0, 0.5)).rgb, valued));
  float a = alpha, gloss = 0.16;
  if (kind == 1) {
    vec2 x = vec2(dot(p - floor_center, floor_x), dot(p - floor_center, floor_y)) / floor_size.x;
    float far = length(p - floor_center) / floor_size.y;
    float plain = clamp(1.6 - 4.0 * max(fwidth(x.x), fwidth(x.y)), 0.0, 1.0);
    float odd = mod(floor(x.x) + floor(x.y), 2.0);
    base *= 1.0 - 0.035 * odd * plain - (gl_FrontFacing ? 0.09 : 0.6) * lines_of(x, 1.2);
    a *= 1.0 - smoothstep(0.12, 1.0, far);
    gloss = 0.0;
    if (!gl_FrontFacing) { result = vec4(encoded(base), a); return; }  // a veil with lines, seen from below
  }
  float facing = dot(nn, key), lit = facing > 0.0 ? facing * key_light(nn) : 0.0, open = sky_light(nn);
  float below = 0.5 - 0.5 * dot(nn, up);
  vec3 light = lit * vec3(1.00, 0.97, 0.92) * 0.72 + open * vec3(0.93, 0.97, 1.04) * 0.42 +
               (0.09 + 0.24 * below) * vec3(1.0, 0.97, 0.93) * (0.4 + 0.6 * min(open + 0.4, 1.0));
  vec3 c = base * light;
  if (FAST && kind == 1) { result = vec4(encoded(c), a); return; }
  float shine = pow(max(dot(nn, normalize(key + v)), 0.0), 36.0) * min(lit * 3.0, 1.0);
  float rim = pow(1.0 - max(dot(nn, v), 0.0), 3.0) * min(open, 1.0);
  c += gloss * (shine * vec3(1.0, 0.98, 0.94) + 0.9 * rim * vec3(0.86, 0.93, 1.0));
  result = vec4(encoded(c), a);
}
)";

const char *const kDepthVertexShader = R"(#version 330 core
in vec3 position;
uniform mat4 to_clip;
void main() { gl_Position = to_clip * vec4(position, 1.0); }
)";

const char *const kDepthFragmentShader = R"(#version 330 core
void main() {}
)";

const char *const kBackgroundVertexShader = R"(#version 330 core
out float height;
void main() {
  vec2 q = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  height = 0.5 * q.y + 0.5;
  gl_Position = vec4(q, 0.0, 1.0);
}
)";

const char *const kBackgroundFragmentShader = R"(#version 330 core
in float height;
layout(location = 0) out vec4 result;
void main() {
  vec3 c = mix(vec3(0.955, 0.960, 0.968), vec3(0.800, 0.845, 0.900), smoothstep(0.25, 1.0, height));
  result = vec4(c, 1.0);
}
)";

}  // namespace render
