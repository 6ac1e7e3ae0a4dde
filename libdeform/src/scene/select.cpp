#include "scene/select.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace dfm::scene {
namespace {

void subtract(const double *a, const double *b, double *out) {
  for (int i = 0; i < 3; ++i) out[i] = a[i] - b[i];
}

double triple(const double *a, const double *b, const double *c) {
  return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
}

double triangle_area(const double *a, const double *b, const double *c) {
  double u[3], v[3];
  subtract(b, a, u), subtract(c, a, v);
  const double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
  return 0.5 * std::sqrt(x * x + y * y + z * z);
}

double tet_volume6(const BodyMesh &mesh, const uint32_t *t) {
  double u[3], v[3], w[3];
  const double *a = &mesh.points[3 * t[0]];
  subtract(&mesh.points[3 * t[1]], a, u), subtract(&mesh.points[3 * t[2]], a, v), subtract(&mesh.points[3 * t[3]], a, w);
  return triple(u, v, w);
}

// Position of each point within the selection; UINT32_MAX: not selected.
std::vector<uint32_t> ranks(const std::vector<uint32_t> &points, uint32_t npoint) {
  std::vector<uint32_t> rank(npoint, UINT32_MAX);
  for (uint32_t i = 0; i < points.size(); ++i) rank[points[i]] = i;
  return rank;
}

void normalise(std::vector<double> &weights) {
  double sum = 0;
  for (double w : weights) sum += w;
  for (double &w : weights) w /= sum;
}

}  // namespace

std::vector<uint32_t> select(const Selection &where, const BodyMesh &mesh, const std::string &file) {
  std::vector<uint32_t> out;
  if (!where.group.empty()) {
    std::vector<std::string> names(mesh.group_names, mesh.group_names + mesh.ngroup);
    const auto found = std::find(names.begin(), names.end(), where.group);
    if (found == names.end()) {
      const std::string near = nearest(where.group, names);
      fail(DFM_E_ARG, "%s: %s/group: the mesh has no physical group \"%s\"%s%s", file.c_str(), where.pointer.c_str(),
           where.group.c_str(), names.empty() ? "; it has none at all" : ("; it has: " + join(names)).c_str(),
           near.empty() ? "" : ("; did you mean \"" + near + "\"?").c_str());
    }
    const uint32_t group = uint32_t(found - names.begin());
    const uint32_t *points = nullptr;
    uint32_t n = 0;
    if (dfm_tetmesh_group_points(mesh.handle, group, nullptr, &points, &n) < 0) fail(DFM_E_HANDLE, "%s", dfm_last_error());
    if (n == 0)
      fail(DFM_E_ARG, "%s: %s/group: the physical group \"%s\" has no point of a tetrahedron", file.c_str(), where.pointer.c_str(),
           where.group.c_str());
    return {points, points + n};
  }
  // Points that lie on a face of the box by the author's reckoning may miss it by a rounding of scale or file format.
  const double slack = 1e-9 * mesh.size;
  for (uint32_t i = 0; i < mesh.npoint; ++i) {
    const double *p = &mesh.points[3 * i];
    bool in = true;
    for (int k = 0; k < 3; ++k) in = in && p[k] >= where.lo[k] - slack && p[k] <= where.hi[k] + slack;
    if (in) out.push_back(i);
  }
  if (out.empty())
    fail(DFM_E_ARG, "%s: %s/box: no point of the body lies in this box; the body at rest, scaled but before its pose, spans [%g, %g, %g] to [%g, %g, %g]",
         file.c_str(), where.pointer.c_str(), mesh.lo[0], mesh.lo[1], mesh.lo[2], mesh.hi[0], mesh.hi[1], mesh.hi[2]);
  return out;
}

std::vector<double> share_by_mass(const std::vector<uint32_t> &points, const BodyMesh &mesh) {
  const std::vector<uint32_t> rank = ranks(points, mesh.npoint);
  std::vector<double> weights(points.size(), 0.0);
  for (uint32_t c = 0; c < mesh.ntet; ++c) {
    const uint32_t *t = mesh.tets + 4 * size_t(c);
    const double quarter = std::fabs(tet_volume6(mesh, t)) / 24;
    for (int k = 0; k < 4; ++k)
      if (rank[t[k]] != UINT32_MAX) weights[rank[t[k]]] += quarter;
  }
  normalise(weights);
  return weights;
}

std::vector<double> share_by_area(const std::vector<uint32_t> &points, const BodyMesh &mesh, const std::vector<uint32_t> &triangles) {
  const std::vector<uint32_t> rank = ranks(points, mesh.npoint);
  std::vector<double> weights(points.size(), 0.0);
  bool any = false;
  for (size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const uint32_t r[3] = {rank[triangles[i]], rank[triangles[i + 1]], rank[triangles[i + 2]]};
    if (r[0] == UINT32_MAX || r[1] == UINT32_MAX || r[2] == UINT32_MAX) continue;
    any = true;
    const double *p = mesh.points.data();
    const double third = triangle_area(p + 3 * triangles[i], p + 3 * triangles[i + 1], p + 3 * triangles[i + 2]) / 3;
    for (uint32_t k : r) weights[k] += third;
  }
  if (!any) return {};
  normalise(weights);
  return weights;
}

std::vector<double> share(const Force &force, const std::vector<uint32_t> &points, const BodyMesh &mesh,
                          const std::vector<uint32_t> &triangles, const std::string &file) {
  if (force.by == "mass") return share_by_mass(points, mesh);
  std::vector<double> weights = share_by_area(points, mesh, triangles);
  if (force.by == "area") {
    if (weights.empty())
      fail(DFM_E_ARG, "%s: %s/by: no boundary triangle has its three corners in this selection; enlarge it or share by \"mass\"", file.c_str(),
           force.where.pointer.c_str());
    return weights;
  }
  // "auto": a selection that lies on the surface is a pressed face; one that reaches inside is a piece of the body.
  std::vector<uint8_t> boundary(mesh.npoint, 0);
  for (uint32_t p : triangles) boundary[p] = 1;
  const bool face = std::all_of(points.begin(), points.end(), [&](uint32_t p) { return boundary[p] != 0; });
  return face && !weights.empty() ? weights : share_by_mass(points, mesh);
}

namespace {

double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Distance of a point from a segment, and from a triangle: inside its prism the height, else the nearest of its edges.
double segment_distance(const double *p, const double *a, const double *b) {
  double u[3], v[3], r[3];
  subtract(b, a, u), subtract(p, a, v);
  const double t = std::clamp(dot(u, v) / dot(u, u), 0.0, 1.0);
  for (int k = 0; k < 3; ++k) r[k] = v[k] - t * u[k];
  return std::sqrt(dot(r, r));
}

double triangle_distance(const double *p, const double *const c[3]) {
  double u[3], v[3], w[3], n[3];
  subtract(c[1], c[0], u), subtract(c[2], c[0], v), subtract(p, c[0], w);
  for (int k = 0; k < 3; ++k) n[k] = u[(k + 1) % 3] * v[(k + 2) % 3] - u[(k + 2) % 3] * v[(k + 1) % 3];
  const double s = triple(w, v, n), t = triple(u, w, n), whole = dot(n, n);
  if (s >= 0 && t >= 0 && s + t <= whole) return std::fabs(dot(w, n)) / std::sqrt(whole);
  return std::min({segment_distance(p, c[0], c[1]), segment_distance(p, c[1], c[2]), segment_distance(p, c[2], c[0])});
}

}  // namespace

double locate(const BodyMesh &mesh, const double point[3], uint32_t corners[4], double weights[4]) {
  double best = INFINITY;
  for (uint32_t c = 0; c < mesh.ntet && best > 0; ++c) {
    const uint32_t *t = mesh.tets + 4 * size_t(c);
    const double volume6 = tet_volume6(mesh, t);
    if (!(std::fabs(volume6) > 0)) continue;
    double w[4], away = INFINITY;
    bool inside = true;
    for (int k = 0; k < 4; ++k) {  // volume with corner k moved to the point, over the cell's
      const double *p[4] = {&mesh.points[3 * t[0]], &mesh.points[3 * t[1]], &mesh.points[3 * t[2]], &mesh.points[3 * t[3]]};
      p[k] = point;
      double u[3], v[3], x[3];
      subtract(p[1], p[0], u), subtract(p[2], p[0], v), subtract(p[3], p[0], x);
      w[k] = triple(u, v, x) / volume6;
      inside = inside && w[k] >= 0;
    }
    for (int k = 0; k < 4 && !inside; ++k) {
      const double *face[3];
      for (int j = 0, n = 0; j < 4; ++j)
        if (j != k) face[n++] = &mesh.points[3 * t[j]];
      away = std::min(away, triangle_distance(point, face));
    }
    if (inside) away = 0;
    if (away >= best) continue;
    best = away;
    std::copy_n(t, 4, corners);
    std::copy_n(w, 4, weights);
  }
  return best;
}

}  // namespace dfm::scene
