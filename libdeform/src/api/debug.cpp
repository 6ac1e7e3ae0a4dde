#include "deform/debug.h"

#include <cmath>

#include "api/objects.h"
#include "math/extent.h"
#include "mesh/mesh.h"
#include "step/context.h"
#include "world/measure.h"
#include "world/queries.h"

using namespace dfm;

namespace {

// [n,3] of a column that lies 4 apart.
std::vector<double> packed(const Array<double> &column, uint32_t n) {
  std::vector<double> out(size_t(3) * n);
  for (uint32_t i = 0; i < n; ++i) store3(&out[size_t(3) * i], load3(&column[size_t(i) * kStride]));
  return out;
}

// Equivalent stress of xx yy zz xy yz zx.
double von_mises(const double *s) {
  const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
  return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

}  // namespace

dfm_status dfm_debug_write_body(dfm_body body, const char *path) {
  return as_status(still_body_of, body, [&](Body &b) {
    need(path, "path");
    const std::vector<double> x = packed(b.p.x, b.p.n), v = packed(b.p.v, b.p.n);
    std::vector<double> u(x.size()), energy, stress, mises;
    for (uint32_t i = 0; i < b.p.n; ++i) store3(&u[size_t(3) * i], displacement(b, i));
    VtuGrid grid;
    grid.npoint = b.p.n;
    grid.ncell = b.ncell();
    grid.corners = 4;
    grid.points = x.data();
    grid.cells = b.tets.data();
    grid.point_data = {{"u", 3, u.data(), nullptr}, {"v", 3, v.data(), nullptr}};
    if (offers(b, DFM_EXT_CELL_ENERGY)) {
      energy.resize(grid.ncell);
      energy_density(b, energy.data());
      grid.cell_data.push_back({"energy_density", 1, energy.data(), nullptr});
    }
    if (offers(b, DFM_EXT_CELL_STRESS)) {
      stress.resize(size_t(6) * grid.ncell);
      cell_stress(b, stress.data());
      for (uint32_t c = 0; c < grid.ncell; ++c) mises.push_back(von_mises(&stress[size_t(6) * c]));
      grid.cell_data.push_back({"stress", 6, stress.data(), nullptr});
      grid.cell_data.push_back({"von_mises", 1, mises.data(), nullptr});
    }
    write_vtu(path, grid);
  });
}

dfm_status dfm_debug_write_surface(dfm_body body, const char *path) {
  return as_status(still_body_of, body, [&](Body &b) {
    need(path, "path");
    const uint32_t n = b.surface.nsurfel;
    std::vector<double> x(size_t(3) * n), v(size_t(3) * n), u(size_t(3) * n), force(size_t(3) * n);
    const double h = b.impulse_time();
    for (uint32_t s = 0; s < n; ++s) {
      store3(&x[size_t(3) * s], b.surface.sum(s, b.p.x.data()));
      store3(&v[size_t(3) * s], b.surface.sum(s, b.p.v.data()));
      store3(&u[size_t(3) * s], surfel_displacement(b, s));
      if (h > 0) store3(&force[size_t(3) * s], (1 / h) * load3(&b.surfel_impulse[size_t(3) * s]));
    }
    VtuGrid grid;
    grid.npoint = n;
    grid.ncell = b.surface.ntri;
    grid.corners = 3;
    grid.points = x.data();
    grid.cells = b.surface.tri.data();
    grid.point_data = {
        {"u", 3, u.data(), nullptr}, {"v", 3, v.data(), nullptr}, {"force", 3, force.data(), nullptr}};
    write_vtu(path, grid);
  });
}

dfm_status dfm_debug_displacements(dfm_body body, uint32_t capacity, double *u, uint32_t *n) {
  return as_status(still_body_of, body, [&](const Body &b) {
    copy_vectors(b.p.n, capacity, u, n, [&](uint32_t i) { return displacement(b, i); });
  });
}

dfm_status dfm_debug_surface_displacements(dfm_body body, uint32_t capacity, double *u, uint32_t *n) {
  return as_status(still_body_of, body, [&](const Body &b) {
    copy_vectors(b.surface.nsurfel, capacity, u, n, [&](uint32_t s) { return surfel_displacement(b, s); });
  });
}

dfm_status dfm_debug_draw(dfm_world world, uint32_t what, dfm_draw_line_fn line, void *user) {
  return as_status(to_read<world_of>, world, [&](const World &w) {
    if (!line) fail(DFM_E_ARG, "argument 'line' is NULL");
    double longest = 0;
    const ContactStore &c = w.store;
    for (uint32_t i = 0; i < c.n; ++i)
      if (c.touching[i]) longest = std::max(longest, c.impulse[size_t(3) * i]);
    // the strongest contact is drawn about five edges long
    const double scale = longest > 0 ? 1000 * w.offset / longest * 5 : 0;
    auto draw = [&](Vec3 a, Vec3 b, uint32_t rgb) {
      double p[3], q[3];
      store3(p, a);
      store3(q, b);
      line(user, p, q, rgb);
    };
    for (uint32_t i = 0; i < c.n; ++i) {
      if (!c.touching[i]) continue;
      const Vec3 at = load3(&c.point[size_t(3) * i]);
      if (what & DFM_DRAW_CONTACTS)
        draw(at, at + 1000 * w.offset * load3(&c.normal[size_t(3) * i]), 0x30a0ff);
      if (what & DFM_DRAW_FORCES) draw(at, at + scale * c.world_impulse(i), 0xff5030);
    }
    if (!(what & DFM_DRAW_BOXES)) return;
    for (auto &b : w.bodies) {
      Extent box;
      for (uint32_t s = 0; s < b->surface.nsurfel; ++s) box.add(b->surface.sum(s, b->p.x.data()));
      for (int corner = 0; corner < 8; ++corner)
        for (int axis = 0; axis < 3; ++axis) {
          if (corner & (1 << axis)) continue;
          Vec3 p, q;
          for (int k = 0; k < 3; ++k) p[k] = corner & (1 << k) ? box.hi[k] : box.lo[k];
          q = p;
          q[axis] = box.hi[axis];
          draw(p, q, 0x808080);
        }
    }
  });
}
