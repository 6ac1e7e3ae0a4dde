// Bodies whose surface has named parts.
#pragma once
#include <algorithm>
#include <functional>
#include <vector>

#include "world.h"

namespace test {

struct ZonedOptions : BodyOptions {
  bool held = false;  // all points
  std::vector<const char *> groups;
  // of a triangle by its middle at rest; UINT32_MAX: none
  std::function<uint32_t(const double middle[3])> group;
  // of a cell by its middle at rest; replaces young, poisson and density
  std::function<dfm_material(const double middle[3])> material;
};

// A beam from the origin. Every face of every cell is offered as a triangle of its group: those inside must
// be passed over.
inline dfm_body make_zoned_beam(dfm_context *c, dfm_world w, std::array<double, 3> size, uint32_t cells,
                                const ZonedOptions &o) {
  dfm_mesh_handle mesh = 0;
  ok(dfm_mesh_make(c, "beam", size.data(), DFM_MESH_CELLS, cells, &mesh));
  dfm_body_def d = dfm_body_def_default();
  lend(mesh, d);
  const auto middle = [&](const uint32_t *corner, int n, double out[3]) {
    for (int k = 0; k < 3; ++k) {
      out[k] = 0;
      for (int i = 0; i < n; ++i) out[k] += d.points[3 * corner[i] + uint32_t(k)] / n;
    }
  };
  std::vector<uint32_t> triangles, group;
  std::vector<dfm_material> materials;
  double x[3];
  for (uint32_t t = 0; t < d.ntet; ++t) {
    const uint32_t *const q = d.tets + 4 * size_t(t);
    for (int f = 3; o.group && f >= 0; --f) {
      const uint32_t face[3] = {q[(f + 1) % 4], q[(f + 2) % 4], q[(f + 3) % 4]};
      middle(face, 3, x);
      triangles.insert(triangles.end(), face, face + 3);
      group.push_back(o.group(x));
    }
    if (o.material) {
      middle(q, 4, x);
      materials.push_back(o.material(x));
    }
  }
  const dfm_surface_groups groups{sizeof(dfm_surface_groups),
                                  uint32_t(o.groups.size()),
                                  o.groups.data(),
                                  uint32_t(group.size()),
                                  0,
                                  triangles.data(),
                                  group.data()};
  d.name = o.name.empty() ? nullptr : o.name.c_str();
  d.material = make_material(w, o);
  if (o.group) d.groups = &groups;
  if (o.material) d.cell_materials = materials.data();
  const std::vector<uint8_t> fixed(d.npoint, uint8_t(o.held ? 7 : 0));
  d.fixed = fixed.data();
  for (int k = 0; k < 3; ++k) {
    d.pose.position[k] = o.position[size_t(k)];
    d.velocity[k] = o.velocity[size_t(k)];
  }
  dfm_body body = 0;
  ok(dfm_body_create(w, &d, &body));
  ok(dfm_mesh_destroy(mesh));
  return body;
}

inline dfm_status friction(dfm_world w, const char *a, const char *b, double mu,
                           const char *law = "coulomb") {
  return add_friction(w, law, {{"mu", mu}}, a, b);
}

}  // namespace test
