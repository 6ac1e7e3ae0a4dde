// Few cells for a closed surface whose triangles are all seen from one inner point: no lattice, the surface
// stays the border of the cells.
#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "math/vec3.h"
#include "mesh/finish.h"

namespace dfm {
namespace {

// From the inner point; of all places of one layer of points between, it gives a ball the best moment of
// inertia by point masses, 5 % too large; without such a layer it is 25 %.
constexpr double kShell = 0.625;
constexpr size_t kTests = 30000000;  // of a point against a plane: about 0.1 s

struct Plane {
  Vec3 point, normal;  // outward
};

double depth(const Plane &p, Vec3 x) { return dot(p.point - x, p.normal); }

// The center of mass if it sees all triangles, else the relaxation of Motzkin and Schoenberg (1954), which
// reflects the point in the plane that it violates most. Depth above `least` is required; false where kTests
// did not find a point.
bool find_eye(const std::vector<Plane> &planes, double least, Vec3 &eye) {
  for (size_t tests = 0; tests < kTests; tests += planes.size()) {
    const Plane *worst = &planes[0];
    double lowest = HUGE_VAL;
    for (const Plane &p : planes) {
      const double d = depth(p, eye);
      if (d >= lowest) continue;
      lowest = d;
      worst = &p;
    }
    const double missing = least - lowest;
    if (missing <= 0) return true;
    eye = eye - (2 * missing) * worst->normal;
  }
  return false;
}

}  // namespace

RestMesh fan_surface(const RestMesh &surface) {
  const dfm_mesh_info info = mesh_statistics(surface);
  if (!info.closed)
    fail(
        DFM_E_FORMAT,
        "the surface is not closed, or its triangles disagree about the outside: %u edges have one triangle, "
        "%u more than two; without cells of a lattice (\"cells\": 0) it must be closed: close it, or ask for "
        "cells",
        info.open_edges, info.nonmanifold_edges);
  if (!(info.volume > 0))
    fail(DFM_E_FORMAT,
         "the surface encloses %g m3; it should enclose a volume, its triangles counter-clockwise from "
         "outside",
         info.volume);
  if (info.npiece != 1)
    fail(DFM_E_UNSUPPORTED,
         "the surface has %u separate pieces; without cells of a lattice (\"cells\": 0) it must be one: make "
         "a body of each, or ask for cells",
         info.npiece);
  const auto at = [&](uint32_t i) { return load3(&surface.points[3 * size_t(i)]); };
  const Vec3 origin = at(0);
  std::vector<Plane> planes;
  Vec3 eye{};
  for (uint32_t t = 0; t < surface.ntri(); ++t) {
    const uint32_t *const q = &surface.tris[3 * size_t(t)];
    const Vec3 a = at(q[0]) - origin, b = at(q[1]) - origin, c = at(q[2]) - origin;
    const Vec3 n = cross(b - a, c - a);
    planes.push_back({at(q[0]), (1 / norm(n)) * n});
    eye = eye + (dot(a, n) / (24 * info.volume)) * (a + b + c);
  }
  eye = eye + origin;
  if (!find_eye(planes, 1e-3 * info.edge_median, eye))
    fail(
        DFM_E_UNSUPPORTED,
        "no point was found that sees all %u triangles of the surface from inside, and its cells would reach "
        "from one point to all of them; give a mesh with tetrahedra whose border is this surface, or ask for "
        "cells of a lattice",
        surface.ntri());

  RestMesh out(*surface.memory);
  const uint32_t n = surface.npoint(), middle = 2 * n;
  out.points.assign(surface.points.begin(), surface.points.end());
  for (uint32_t i = 0; i <= n; ++i) {
    const Vec3 x = i < n ? eye + kShell * (at(i) - eye) : eye;
    out.points.insert(out.points.end(), {x.x, x.y, x.z});
  }
  const auto add = [&](std::array<uint32_t, 4> tet) {
    const auto place = [&](int k) { return load3(&out.points[3 * size_t(tet[size_t(k)])]); };
    if (dot(place(1) - place(0), cross(place(2) - place(0), place(3) - place(0))) < 0)
      std::swap(tet[2], tet[3]);
    out.tets.insert(out.tets.end(), tet.begin(), tet.end());
  };
  for (uint32_t t = 0; t < surface.ntri(); ++t) {
    uint32_t q[3];
    std::copy_n(&surface.tris[3 * size_t(t)], 3, q);
    std::sort(q, q + 3);  // so that neighbors divide the side between them alike
    add({middle, n + q[0], n + q[1], n + q[2]});
    add({n + q[0], n + q[1], n + q[2], q[0]});
    add({n + q[1], n + q[2], q[0], q[1]});
    add({n + q[2], q[0], q[1], q[2]});
  }
  out.tet_group.assign(out.ntet(), kNoGroup);
  out.file_point.assign(surface.file_point.begin(), surface.file_point.end());
  uint32_t last = *std::max_element(out.file_point.begin(), out.file_point.end());
  while (out.file_point.size() < out.npoint()) out.file_point.push_back(++last);
  out.groups = surface.groups;
  for (uint32_t t = 0; t < surface.ntri(); ++t)
    if (!surface.tri_group.empty() && surface.tri_group[t] != kNoGroup) {
      out.tris.insert(out.tris.end(), &surface.tris[3 * size_t(t)], &surface.tris[3 * size_t(t)] + 3);
      out.tri_group.push_back(surface.tri_group[t]);
    }
  for (MeshGroup &g : out.groups) {
    g.dimension = 2;
    g.points.clear();
  }
  add_to_groups(out.groups, out.tri_group, out.tris);
  return out;
}

}  // namespace dfm
