#include <deform/debug.h>

#include "adapter.h"

namespace dfm_bullet_detail {
namespace {

const btVector3 kSurface(btScalar(0.9), btScalar(0.6), btScalar(0.1));

void draw_line(void *drawer, const double a[3], const double b[3], uint32_t rgb) {
  const auto part = [&](int shift) { return btScalar((rgb >> shift & 255) / 255.0); };
  static_cast<btIDebugDraw *>(drawer)->drawLine(to_bullet(load(a)), to_bullet(load(b)),
                                                btVector3(part(16), part(8), part(0)));
}

// Draws each edge once: a closed surface has it in two triangles, in one of them in ascending order.
dfm_status draw_surface(dfm_body body, btIDebugDraw &drawer) {
  uint32_t points = 0, triangles = 0;
  TRY(dfm_surface_positions(body, 0, nullptr, &points));
  TRY(dfm_surface_triangles(body, 0, nullptr, &triangles));
  std::vector<double> x(size_t{3} * points);
  std::vector<uint32_t> corners(size_t{3} * triangles);
  TRY(dfm_surface_positions(body, points, x.data(), &points));
  TRY(dfm_surface_triangles(body, triangles, corners.data(), &triangles));
  const auto at = [&](uint32_t i) { return to_bullet(load(&x[size_t{3} * i])); };
  for (size_t t = 0; t < corners.size(); t += 3)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = corners[t + k], b = corners[t + (k + 1) % 3];
      if (a < b) drawer.drawLine(at(a), at(b), kSurface);
    }
  return DFM_OK;
}

}  // namespace

dfm_status Adapter::debug_draw(uint32_t what) const {
  btIDebugDraw *const drawer = engine_.world->getDebugDrawer();
  if (!drawer) return failed(DFM_E_STATE, "the world has no drawer; call its setDebugDrawer first");
  uint32_t n = 0;
  TRY(dfm_world_bodies(world_, 0, nullptr, &n));
  std::vector<dfm_body> bodies(n);
  TRY(dfm_world_bodies(world_, n, bodies.data(), &n));
  for (const dfm_body b : bodies) TRY(draw_surface(b, *drawer));
  return what ? dfm_debug_draw(world_, what, draw_line, drawer) : dfm_status{DFM_OK};
}

}  // namespace dfm_bullet_detail
