#include "world/body_zones.h"

#include <algorithm>

#include "body/coupling.h"
#include "core/error.h"
#include "mesh/mesh.h"
#include "state/world.h"
#include "world/triangle_list.h"

namespace dfm {
namespace {

// The triangles of a surface, by points as they are numbered in the def.
TriangleList triangles_of(const Surface &s) {
  return {s.ntri, [&](size_t k) { return s.identity() ? s.point[s.tri[k]] : s.tri[k]; }};
}

void check_groups(const dfm_surface_groups &g, const Body &b, uint32_t npoint) {
  if (g.size < sizeof g) refuse(b, ": groups->size is %u, expected %zu; set it to sizeof", g.size, sizeof g);
  if ((g.ngroup && !g.names) || (g.ntriangle && !g.group))
    refuse(b, ": %u groups and %u triangles are announced, but groups->%s is NULL", g.ngroup, g.ntriangle,
           g.ngroup && !g.names ? "names" : "group");
  for (uint32_t k = 0; k < g.ngroup; ++k)
    if (!g.names[k] || !*g.names[k]) refuse(b, ": surface group %u has no name", k);
  if (!g.triangles && g.ntriangle != b.surface.ntri)
    refuse(b,
           ": groups are given for %u triangles in the surface's order, which has %u; give groups->triangles "
           "to name some of them",
           g.ntriangle, b.surface.ntri);
  for (uint32_t t = 0; t < g.ntriangle; ++t) {
    if (g.group[t] != UINT32_MAX && g.group[t] >= g.ngroup)
      refuse(b, ": triangle %u of groups is in group %u of %u", t, g.group[t], g.ngroup);
    for (uint32_t k = 0; g.triangles && k < 3; ++k)
      if (g.triangles[size_t{3} * t + k] >= npoint)
        refuse(b, ": triangle %u of groups names point %u of %u", t, g.triangles[size_t{3} * t + k], npoint);
  }
}

// [ntri] group of each triangle, or kNone. A triangle that is named twice keeps its first group; triangles
// inside the body are ignored.
std::vector<uint32_t> triangle_groups(const Body &b, const dfm_body_def &def) {
  std::vector<uint32_t> out(b.surface.ntri, kNone);
  if (!def.groups) return out;
  const dfm_surface_groups &g = *def.groups;
  check_groups(g, b, def.surface ? def.surface->npoint : def.npoint);
  if (!g.triangles) {
    std::copy(g.group, g.group + g.ntriangle, out.begin());
    return out;
  }
  const TriangleList index = triangles_of(b.surface);
  for (uint32_t t = 0; t < g.ntriangle; ++t) {
    const uint32_t *const c = g.triangles + size_t{3} * t;
    const uint32_t at = index.find(sorted(c[0], c[1], c[2]));
    if (at != kNone && out[at] == kNone) out[at] = g.group[t];
  }
  return out;
}

// [ntri] entry of materials.list of the cell that carries each triangle: the cell whose face it is, or the
// cell that contains its centroid.
std::vector<uint32_t> triangle_materials(const Body &b, const dfm_body_def &def,
                                         const CellMaterials &materials) {
  std::vector<uint32_t> out(b.surface.ntri, 0);
  if (materials.of.empty()) return out;
  if (!def.surface) {
    const TriangleList index = triangles_of(b.surface);
    for (uint32_t t = 0; t < def.ntet; ++t)
      for (const auto &face : kTetFace) {
        const uint32_t *const c = def.tets + size_t{4} * t;
        const uint32_t at = index.find(sorted(c[face[0]], c[face[1]], c[face[2]]));
        if (at != kNone) out[at] = materials.of[t];
      }
    return out;
  }
  std::vector<double> middle;
  for (uint32_t t = 0; t < def.surface->ntriangle; ++t) {
    Vec3 sum;
    for (uint32_t k = 0; k < 3; ++k)
      sum += load3(def.surface->points + size_t{3} * def.surface->triangles[size_t{3} * t + k]);
    for (int k = 0; k < 3; ++k) middle.push_back(sum[k] / 3);
  }
  CouplingInput in;
  in.npoint = def.npoint;
  in.ntet = def.ntet;
  in.nsurfel = b.surface.ntri;
  in.point = def.points;
  in.tet = def.tets;
  in.surfel = middle.data();
  const Array<uint32_t> cell = cells_of_surfels(b.world->memory(), in);
  for (uint32_t t = 0; t < b.surface.ntri; ++t) out[t] = materials.of[cell[t]];
  return out;
}

}  // namespace

double friction_of(const Material &m) { return m.entry(kFrictionKey, kDefaultFriction); }

void make_zones(Body &b, const dfm_body_def &def, const CellMaterials &materials, const Material &plain) {
  const auto name = [&](uint32_t k) {
    return materials.list[k] == &plain ? std::string() : materials.list[k]->name;
  };
  SurfaceZones &zones = b.zones;
  zones.list.clear();
  zones.of = Array<uint32_t>(b.world->memory());
  if (!def.groups && materials.of.empty()) {
    zones.list.push_back({"", name(0), friction_of(*materials.list[0])});
    return;
  }
  const std::vector<uint32_t> group = triangle_groups(b, def);
  const std::vector<uint32_t> material = triangle_materials(b, def, materials);
  std::vector<std::pair<uint32_t, uint32_t>> kinds;
  for (uint32_t t = 0; t < b.surface.ntri; ++t) {
    const std::pair kind(group[t], material[t]);
    const size_t at = size_t(std::find(kinds.begin(), kinds.end(), kind) - kinds.begin());
    if (at == kinds.size()) {
      kinds.push_back(kind);
      zones.list.push_back({group[t] == kNone ? "" : def.groups->names[group[t]], name(material[t]),
                            friction_of(*materials.list[material[t]])});
    }
    zones.of.push_back(uint32_t(at));
  }
  if (kinds.size() == 1) zones.of.clear();
}

}  // namespace dfm
