#include "deform/surface.h"

#include "api/objects.h"
#include "world/queries.h"

using namespace dfm;

dfm_status dfm_surface_positions(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    copy_vectors(b.surface.nsurfel, capacity, xyz, n,
                 [&](uint32_t s) { return b.surface.sum(s, b.p.x.data()); });
  });
}

dfm_status dfm_surface_velocities(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    copy_vectors(b.surface.nsurfel, capacity, xyz, n,
                 [&](uint32_t s) { return b.surface.sum(s, b.p.v.data()); });
  });
}

dfm_status dfm_surface_forces(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    const double h = b.impulse_time();
    copy_vectors(b.surface.nsurfel, capacity, xyz, n, [&](uint32_t s) {
      return h > 0 ? (1 / h) * load3(&b.surfel_impulse[size_t(3) * s]) : Vec3{};
    });
  });
}

dfm_status dfm_surface_normals(dfm_body body, uint32_t capacity, double *xyz, uint32_t *n) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    if (!room(b.surface.nsurfel, capacity, xyz, n)) return;
    surface_normals(b, xyz);
  });
}

dfm_status dfm_surface_triangles(dfm_body body, uint32_t capacity, uint32_t *tri, uint32_t *n) {
  return as_status([&] {
    const Surface &s = shown_body_of(body).surface;
    if (room(s.ntri, capacity, tri, n)) std::copy(s.tri.begin(), s.tri.begin() + size_t(3) * s.ntri, tri);
  });
}

dfm_status dfm_surface_points(dfm_body body, uint32_t capacity, uint32_t *point, uint32_t *n) {
  return as_status(shown_body_of, body, [&](const Body &b) {
    if (!b.surface.identity())
      refuse(b, DFM_E_UNSUPPORTED,
             ": each of its surfels depends on several points, so there is no single point per surfel");
    if (room(b.surface.nsurfel, capacity, point, n))
      std::copy(b.surface.point.begin(), b.surface.point.begin() + b.surface.nsurfel, point);
  });
}
