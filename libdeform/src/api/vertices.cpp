// Single-precision vertices of a surface, written into memory that may belong to a graphics card: each byte
// is written once, except `stick`, and none is read.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "api/objects.h"
#include "deform/surface.h"
#include "step/stages.h"
#include "world/queries.h"

using namespace dfm;

namespace {

struct Member {
  const char *name;
  uint32_t at, bytes;
};

// The bytes of a vertex that are written end here.
uint32_t check_layout(const dfm_vertex_layout &l) {
  const Member members[] = {{"position", l.position, 12},
                            {"normal", l.normal, 12},
                            {"velocity", l.velocity, 12},
                            {"displacement", l.displacement, 12},
                            {"stick", l.stick, 4}};
  if (l.stride == 0 || l.stride % 4 != 0)
    fail(DFM_E_ARG, "layout: stride is %u bytes; it must be a multiple of 4, above 0", l.stride);
  uint32_t end = 0;
  for (const Member &m : members) {
    if (m.at == DFM_VERTEX_NONE) continue;
    if (m.at % 4 != 0)
      fail(DFM_E_ARG, "layout: %s is at byte %u, which is not a multiple of 4", m.name, m.at);
    if (m.at > l.stride || l.stride - m.at < m.bytes)
      fail(DFM_E_ARG, "layout: %s is at byte %u and has %u bytes, beyond the stride of %u", m.name, m.at,
           m.bytes, l.stride);
    for (const Member &other : members)
      if (&other != &m && other.at != DFM_VERTEX_NONE && other.at < m.at + m.bytes &&
          m.at < other.at + other.bytes)
        fail(DFM_E_ARG, "layout: %s and %s share bytes", m.name, other.name);
    end = std::max(end, m.at + m.bytes);
  }
  if (!all_finite(l.origin, 3)) fail(DFM_E_ARG, "layout: the origin is not finite");
  return end;
}

void put(unsigned char *vertex, uint32_t at, Vec3 v) {
  if (at == DFM_VERTEX_NONE) return;
  const float x[3] = {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  std::memcpy(vertex + at, x, sizeof x);
}

// Calls f(surfel) for the surfels of a feature: a surfel, an edge or a triangle.
template <class F>
void each_surfel(const Surface &s, uint32_t type, uint32_t feature, F &&f) {
  if (type == 0) return f(feature);
  const uint32_t *const at = type == 1 ? &s.edge[2 * size_t{feature}] : &s.tri[3 * size_t{feature}];
  for (uint32_t k = 0; k <= type; ++k) f(at[k]);
}

// Marks where loaded contacts stick or slide.
void put_stick(const Body &b, const dfm_vertex_layout &l, bool sticks, unsigned char *out) {
  const ContactStore &c = b.world->store;
  const float value = sticks ? 1.0f : 0.5f;
  const auto mark = [&](uint32_t s) {
    std::memcpy(out + size_t{l.stride} * s + l.stick, &value, sizeof value);
  };
  for (uint32_t i = 0; i < c.n; ++i) {
    if (!c.bears(i) || c.sticks[i] != sticks) continue;
    if (c.id_a[i] == b.id) each_surfel(b.surface, c.type_a[i], c.feature_a[i], mark);
    if (c.id_b[i] == b.id) each_surfel(b.surface, c.type_b[i], c.feature_b[i], mark);
  }
}

void put_vertices(Body &b, const dfm_vertex_layout &l, unsigned char *out) {
  const Surface &s = b.surface;
  // N x_p may involve many points; then it is computed once for all triangles around a surfel
  const double *const formed = s.identity() ? nullptr : search(b).x;
  const auto x = [&](uint32_t i) {
    return formed ? load3(formed + 4 * size_t{i}) : b.surface.sum(i, b.p.x.data());
  };
  const Vec3 origin = load3(l.origin);
  const float none = 0;
  for (uint32_t i = 0; i < s.nsurfel; ++i, out += l.stride) {
    put(out, l.position, x(i) - origin);
    if (l.normal != DFM_VERTEX_NONE) {
      Vec3 sum;  // in the order of surface_normals()
      for (uint32_t k = s.fan_begin[i]; k < s.fan_begin[i + 1]; ++k) {
        const uint32_t *const c = &s.tri[3 * size_t{s.fan[k]}];
        const Vec3 a = x(c[0]);
        sum += cross(x(c[1]) - a, x(c[2]) - a);
      }
      put(out, l.normal, normalized(sum));
    }
    if (l.velocity != DFM_VERTEX_NONE) put(out, l.velocity, b.surface.sum(i, b.p.v.data()));
    if (l.displacement != DFM_VERTEX_NONE) put(out, l.displacement, surfel_displacement(b, i));
    if (l.stick != DFM_VERTEX_NONE) std::memcpy(out + l.stick, &none, sizeof none);
  }
}

}  // namespace

dfm_status dfm_surface_vertices(dfm_body body, const dfm_vertex_layout *layout, size_t bytes, void *out,
                                uint32_t *n) {
  return as_status(to_read<shown_body_of>, body, [&](Body &b) {
    const dfm_vertex_layout l = take_def(layout, dfm_vertex_layout_default());
    const uint32_t end = check_layout(l), count = b.surface.nsurfel;
    if (n) *n = count;
    if (!out && bytes == 0) return;
    need(out, "out");
    const size_t needed = count == 0 ? 0 : size_t{l.stride} * (count - 1) + end;
    if (bytes < needed)
      fail(DFM_E_ARG, "%zu bytes are too few for %u vertices; %zu are needed", bytes, count, needed);
    if (reinterpret_cast<uintptr_t>(out) % 4 != 0) fail(DFM_E_ARG, "the out argument is not aligned to 4");
    unsigned char *const to = static_cast<unsigned char *>(out);
    put_vertices(b, l, to);
    if (l.stick == DFM_VERTEX_NONE) return;
    for (const bool sticks : {false, true}) put_stick(b, l, sticks, to);
  });
}
