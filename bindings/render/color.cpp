// Colors of bodies and of values. The maps are straight lines of lightness through OKLab (B. Ottosson 2020)
// with our own course of hue and chroma, so that equal steps of a value look like equal steps of lightness;
// they are our approximations, not a published map.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "render.h"

namespace render {
namespace {

struct Lch { float t, lightness, chroma, hue_deg; };

float encode(float linear) {
  const float x = std::clamp(linear, 0.f, 1.f);
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

bool inside(const float (&rgb)[3]) {
  return std::all_of(std::begin(rgb), std::end(rgb), [](float c) { return c >= -1e-4f && c <= 1.0001f; });
}

void oklab_to_linear(float lightness, float a, float b, float (&rgb)[3]) {
  const float l = std::pow(lightness + 0.3963377774f * a + 0.2158037573f * b, 3.f);
  const float m = std::pow(lightness - 0.1055613458f * a - 0.0638541728f * b, 3.f);
  const float s = std::pow(lightness - 0.0894841775f * a - 1.2914855480f * b, 3.f);
  rgb[0] = 4.0767416621f * l - 3.3077115913f * m + 0.2309699292f * s;
  rgb[1] = -1.2684380046f * l + 2.6097574011f * m - 0.3413193965f * s;
  rgb[2] = -0.0041960863f * l - 0.7034186147f * m + 1.7076147010f * s;
}

// Where a color leaves the screen's range its chroma is lowered, never its lightness.
Color from_lch(float lightness, float chroma, float hue_deg) {
  const float h = hue_deg * 3.14159265f / 180;
  float rgb[3], low = 0, high = chroma, c = chroma;
  for (int i = 0; i < 14; ++i) {
    oklab_to_linear(lightness, c * std::cos(h), c * std::sin(h), rgb);
    (inside(rgb) ? low : high) = c;
    if (low == chroma) break;
    c = 0.5f * (low + high);
  }
  return {encode(rgb[0]), encode(rgb[1]), encode(rgb[2])};
}

template <size_t N>
Color along(const Lch (&path)[N], float t) {
  size_t i = 0;
  while (i + 2 < N && t > path[i + 1].t) ++i;
  const Lch &p = path[i], &q = path[i + 1];
  const float f = (t - p.t) / (q.t - p.t);
  const auto mix = [f](float a, float b) { return a + f * (b - a); };
  return from_lch(mix(p.lightness, q.lightness), mix(p.chroma, q.chroma), mix(p.hue_deg, q.hue_deg));
}

constexpr Lch kEmber[] = {{0, 0.28f, 0.10f, 295},
                          {0.25f, 0.44f, 0.17f, 335},
                          {0.5f, 0.60f, 0.20f, 385},
                          {0.75f, 0.76f, 0.16f, 423},
                          {1, 0.93f, 0.12f, 462}};
constexpr Lch kLagoon[] = {
    {0, 0.30f, 0.11f, 275}, {0.33f, 0.50f, 0.11f, 235}, {0.66f, 0.71f, 0.12f, 180}, {1, 0.93f, 0.14f, 112}};

}  // namespace

Color palette(uint32_t i) {
  static constexpr Color colors[] = {
      {0.890f, 0.365f, 0.286f}, {0.243f, 0.510f, 0.796f}, {0.957f, 0.706f, 0.243f}, {0.180f, 0.631f, 0.557f},
      {0.557f, 0.431f, 0.757f}, {0.510f, 0.690f, 0.310f}, {0.886f, 0.494f, 0.643f}, {0.388f, 0.471f, 0.573f},
      {0.690f, 0.498f, 0.361f}, {0.376f, 0.741f, 0.847f}};
  return colors[i % std::size(colors)];
}

Color map_color(ColorMap map, float t) {
  t = t > 0 ? std::min(t, 1.f) : 0.f;
  return map == ColorMap::lagoon ? along(kLagoon, t) : along(kEmber, t);
}

}  // namespace render
