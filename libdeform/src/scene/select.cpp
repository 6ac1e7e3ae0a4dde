#include "scene/select.h"

#include <algorithm>
#include <cmath>

#include "body/coupling.h"
#include "core/error.h"
#include "core/names.h"
#include "math/vec3.h"
#include "mesh/mesh.h"

namespace dfm::scene {
namespace {

// Position of each point within the selection; UINT32_MAX: not selected.
std::vector<uint32_t> ranks(const std::vector<uint32_t> &points, uint32_t npoint) {
  std::vector<uint32_t> rank(npoint, UINT32_MAX);
  for (uint32_t i = 0; i < points.size(); ++i) rank[points[i]] = i;
  return rank;
}

void normalize(std::vector<double> &weights) {
  double sum = 0;
  for (double w : weights) sum += w;
  for (double &w : weights) w /= sum;
}

}  // namespace

std::vector<uint32_t> points_of_nodes(const BodyMesh &mesh) {
  uint32_t highest = 0;
  for (uint32_t i = 0; i < mesh.info.npoint; ++i) highest = std::max(highest, mesh.info.file_point[i]);
  std::vector<uint32_t> out(size_t(highest) + 1, UINT32_MAX);
  for (uint32_t i = 0; i < mesh.info.npoint; ++i) out[mesh.info.file_point[i]] = i;
  return out;
}

std::string span_of(const BodyMesh &mesh) {
  return format("the body at rest, scaled but before its pose, spans [%g, %g, %g] to [%g, %g, %g]",
                mesh.lo[0], mesh.lo[1], mesh.lo[2], mesh.hi[0], mesh.hi[1], mesh.hi[2]);
}

const CellFinder &BodyMesh::finder() const {
  if (!cells_found)
    cells_found = std::make_shared<const CellFinder>(
        Memory::standard(),
        CellsAtRest{info.npoint, info.ntet, points.data(), info.tets, info.cells, info.cell});
  return *cells_found;
}

namespace {

// of the body's diagonal: points that lie on a face of the box by the author's reckoning may miss
// it by rounding
constexpr double kSlack = 1e-9;
constexpr double kNoWeight = 1e-9;  // of a point beside the face on which another one lies

bool in_box(const Selection &where, const BodyMesh &mesh, const double *p) {
  const double slack = kSlack * mesh.size;
  bool in = true;
  for (int k = 0; k < 3; ++k) in = in && p[k] >= where.lo[k] - slack && p[k] <= where.hi[k] + slack;
  return in;
}

uint32_t find_group(const std::string &group, const char *const *names, uint32_t n) {
  uint32_t g = 0;
  while (g < n && group != names[g]) ++g;
  return g;
}

// Error at a key of a selection.
[[noreturn]] void refuse(const Selection &where, const char *key, const std::string &file,
                         const std::string &sentence) {
  fail(DFM_E_ARG, "%s: %s/%s: %s", file.c_str(), where.pointer.c_str(), key, sentence.c_str());
}

[[noreturn]] void no_group(const Selection &where, const BodyMesh &mesh, const std::string &file) {
  std::vector<std::string> names(mesh.info.group_names, mesh.info.group_names + mesh.info.ngroup);
  names.insert(names.end(), mesh.skin.group_names, mesh.skin.group_names + mesh.skin.ngroup);
  refuse(where, "group", file,
         "the mesh has no physical group \"" + where.group + "\"" +
             (names.empty() ? "; it has none at all" : "; it has: " + join(names)) +
             did_you_mean(where.group, names));
}

// Triangles of the skin by group, or those with three corners in the box.
std::vector<uint32_t> skin_triangles(const Selection &where, const BodyMesh &mesh) {
  const Skin &skin = mesh.skin;
  std::vector<uint32_t> out;
  if (!where.group.empty()) {
    const uint32_t group = find_group(where.group, skin.group_names, skin.ngroup);
    for (uint32_t t = 0; t < skin.ntriangle && group < skin.ngroup; ++t)
      if (skin.triangle_group[t] == group) out.push_back(t);
    return out;
  }
  for (uint32_t t = 0; t < skin.ntriangle; ++t) {
    const uint32_t *c = skin.triangles + 3 * size_t(t);
    bool in = true;
    for (int k = 0; k < 3; ++k) in = in && in_box(where, mesh, &skin.points[3 * size_t(c[k])]);
    if (in) out.push_back(t);
  }
  return out;
}

// Points of the skin: of the triangles of a group, or those in the box.
std::vector<uint8_t> skin_marks(const Selection &where, const BodyMesh &mesh) {
  std::vector<uint8_t> out(mesh.skin.npoint, 0);
  if (where.group.empty())
    for (uint32_t s = 0; s < out.size(); ++s) out[s] = in_box(where, mesh, &mesh.skin.points[3 * size_t(s)]);
  else
    for (const uint32_t t : skin_triangles(where, mesh))
      for (int k = 0; k < 3; ++k) out[mesh.skin.triangles[3 * size_t(t) + size_t(k)]] = 1;
  return out;
}

// f(point, weight) for those that a point of the skin follows, as in the body's coupling.
template <class F>
void each_point_of(const BodyMesh &mesh, uint32_t s, F f) {
  if (!mesh.rows) {
    const CouplingInput in{{mesh.info.npoint, mesh.info.ntet, mesh.points.data(), mesh.info.tets,
                            mesh.info.cells, mesh.info.cell},
                           mesh.skin.npoint,
                           mesh.skin.points.data()};
    mesh.rows = std::make_shared<const Coupling>(couple_barycentric(Memory::standard(), in));
  }
  for (uint32_t k = mesh.rows->row[s]; k < mesh.rows->row[s + 1]; ++k)
    f(mesh.rows->col[k], mesh.rows->weight[k]);
}

// Marks the points that the skin's marked ones follow: the corners of their cells, or of the face or edge on
// which one lies.
void mark_cells(const std::vector<uint8_t> &surfel, const BodyMesh &mesh, std::vector<uint8_t> &point) {
  for (uint32_t s = 0; s < mesh.skin.npoint; ++s) {
    if (!surfel[s]) continue;
    each_point_of(mesh, s, [&](uint32_t p, double weight) {
      if (std::fabs(weight) > kNoWeight) point[p] = 1;
    });
  }
}

std::vector<uint32_t> marked(const std::vector<uint8_t> &marks) {
  std::vector<uint32_t> out;
  for (uint32_t i = 0; i < marks.size(); ++i)
    if (marks[i]) out.push_back(i);
  return out;
}

// By the mesh file's numbers.
std::vector<uint32_t> select_nodes(const Selection &where, const BodyMesh &mesh, const std::string &file) {
  if (mesh.renumbered)
    refuse(
        where, "points", file,
        "the body is a filled surface, and nodes of the mesh are not its points; use \"box\" or \"group\"");
  const std::vector<uint32_t> point_of = points_of_nodes(mesh);
  std::vector<uint8_t> point(mesh.info.npoint, 0);
  for (const uint32_t node : where.points) {
    if (node >= point_of.size() || point_of[node] == UINT32_MAX)
      refuse(where, "points", file,
             format("no tetrahedron of the mesh file has a node %u; nodes are numbered from 0", node));
    point[point_of[node]] = 1;
  }
  return marked(point);
}

std::vector<uint32_t> select_group(const Selection &where, const BodyMesh &mesh, const std::string &file) {
  const uint32_t group = find_group(where.group, mesh.info.group_names, mesh.info.ngroup);
  if (group == mesh.info.ngroup) {
    if (find_group(where.group, mesh.skin.group_names, mesh.skin.ngroup) == mesh.skin.ngroup)
      no_group(where, mesh, file);
    std::vector<uint8_t> point(mesh.info.npoint, 0);
    mark_cells(skin_marks(where, mesh), mesh, point);
    std::vector<uint32_t> out = marked(point);
    if (out.empty()) refuse(where, "group", file, "the group \"" + where.group + "\" has no triangle");
    return out;
  }
  const uint32_t *const points = mesh.info.group_points[group], n = mesh.info.group_npoint[group];
  if (n == 0)
    refuse(where, "group", file, "the physical group \"" + where.group + "\" has no point of a tetrahedron");
  return {points, points + n};
}

}  // namespace

std::vector<uint32_t> select(const Selection &where, const BodyMesh &mesh, const std::string &file) {
  if (!where.group.empty()) return select_group(where, mesh, file);
  if (!where.points.empty()) return select_nodes(where, mesh, file);
  std::vector<uint8_t> point(mesh.info.npoint, 0);
  for (uint32_t i = 0; i < mesh.info.npoint; ++i) point[i] = in_box(where, mesh, &mesh.points[3 * size_t(i)]);
  if (mesh.filled) mark_cells(skin_marks(where, mesh), mesh, point);
  std::vector<uint32_t> out = marked(point);
  if (out.empty()) refuse(where, "box", file, "no point of the body lies in this box; " + span_of(mesh));
  return out;
}

std::vector<uint32_t> select_skin(const Selection &where, const BodyMesh &mesh, const std::string &file) {
  std::vector<uint8_t> listed(mesh.skin.npoint, 0);
  for (const uint32_t s : where.points) {
    if (s >= listed.size())
      refuse(where, "points", file,
             format("the body's surface has the points 0 to %u, and no point %u", mesh.skin.npoint - 1, s));
    listed[s] = 1;
  }
  const bool by_points = where.group.empty() && !where.points.empty();
  std::vector<uint32_t> out = marked(by_points ? listed : skin_marks(where, mesh));
  if (!out.empty()) return out;
  if (!where.group.empty()) no_group(where, mesh, file);
  refuse(where, "box", file, "no point of the body's surface lies in the box; " + span_of(mesh));
}

std::vector<double> share_by_mass(const std::vector<uint32_t> &points, const BodyMesh &mesh) {
  const std::vector<uint32_t> rank = ranks(points, mesh.info.npoint);
  std::vector<double> weights(points.size(), 0.0);
  for (uint32_t c = 0; c < mesh.info.ntet; ++c) {
    const uint32_t *t = mesh.info.tets + 4 * size_t(c);
    const auto from_first = [&](int k) {
      return load3(&mesh.points[3 * size_t(t[k])]) - load3(&mesh.points[3 * size_t(t[0])]);
    };
    const double volume6 = dot(from_first(1), cross(from_first(2), from_first(3)));
    const double quarter = std::fabs(volume6) / 24 * (mesh.cell_weight.empty() ? 1 : mesh.cell_weight[c]);
    for (int k = 0; k < 4; ++k)
      if (rank[t[k]] != UINT32_MAX) weights[rank[t[k]]] += quarter;
  }
  normalize(weights);
  return weights;
}

std::vector<double> share_by_area(const std::vector<uint32_t> &points, const BodyMesh &mesh,
                                  const std::vector<uint32_t> &triangles) {
  const std::vector<uint32_t> rank = ranks(points, mesh.info.npoint);
  std::vector<double> weights(points.size(), 0.0);
  bool any = false;
  for (size_t i = 0; i + 2 < triangles.size(); i += 3) {
    const uint32_t r[3] = {rank[triangles[i]], rank[triangles[i + 1]], rank[triangles[i + 2]]};
    if (r[0] == UINT32_MAX || r[1] == UINT32_MAX || r[2] == UINT32_MAX) continue;
    any = true;
    const double third = triangle_area(mesh.points.data(), &triangles[i]) / 3;
    for (uint32_t k : r) weights[k] += third;
  }
  if (!any) return {};
  normalize(weights);
  return weights;
}

Shared share_on_skin(const std::vector<uint32_t> &triangles, const BodyMesh &mesh) {
  const Skin &skin = mesh.skin;
  std::vector<double> surfel(skin.npoint, 0.0), point(mesh.info.npoint, 0.0);
  std::vector<uint8_t> touched(mesh.info.npoint, 0);
  for (uint32_t t : triangles) {
    const uint32_t *c = skin.triangles + 3 * size_t(t);
    const double third = triangle_area(skin.points.data(), c) / 3;
    for (int k = 0; k < 3; ++k) surfel[c[k]] += third;
  }
  for (uint32_t s = 0; s < skin.npoint; ++s) {
    if (!(surfel[s] > 0)) continue;
    each_point_of(mesh, s, [&](uint32_t p, double weight) {
      point[p] += weight * surfel[s];
      touched[p] = 1;
    });
  }
  Shared out;
  for (uint32_t i : marked(touched)) {
    out.points.push_back(i);
    out.weights.push_back(point[i]);
  }
  normalize(out.weights);
  return out;
}

namespace {

// Shares on the cells' own points: a selection that lies on the boundary is a pressed face; one that reaches
// inside is a piece of the body.
Shared share_on_cells(const Force &force, const BodyMesh &mesh, const std::string &file) {
  Shared out;
  out.points = select(force.where, mesh, file);
  if (force.by == "mass") {
    out.weights = share_by_mass(out.points, mesh);
    return out;
  }
  const Array<uint32_t> faces = boundary_triangles(Memory::standard(), mesh.info.ntet, mesh.info.tets);
  const std::vector<uint32_t> triangles(faces.begin(), faces.end());
  out.weights = share_by_area(out.points, mesh, triangles);
  if (force.by == "area") {
    if (out.weights.empty())
      refuse(force.where, "by", file,
             "no boundary triangle has its three corners in this selection; enlarge it or share by \"mass\"");
    return out;
  }
  std::vector<uint8_t> boundary(mesh.info.npoint, 0);
  for (uint32_t p : triangles) boundary[p] = 1;
  const bool face =
      std::all_of(out.points.begin(), out.points.end(), [&](uint32_t p) { return boundary[p] != 0; });
  if (!face || out.weights.empty()) out.weights = share_by_mass(out.points, mesh);
  return out;
}

}  // namespace

Shared share(const Force &force, const BodyMesh &mesh, const std::string &file) {
  const bool of_cells =
      find_group(force.where.group, mesh.info.group_names, mesh.info.ngroup) < mesh.info.ngroup;
  const bool on_skin = force.where.points.empty() && (force.where.group.empty() ? mesh.filled : !of_cells);
  if (!on_skin || force.by == "mass") return share_on_cells(force, mesh, file);
  const std::vector<uint32_t> triangles = skin_triangles(force.where, mesh);
  if (!triangles.empty()) return share_on_skin(triangles, mesh);
  if (force.by == "area" && force.where.group.empty())
    refuse(force.where, "by", file,
           "no triangle of the surface has its three corners in this box; enlarge it or share by \"mass\"");
  Shared out;
  out.points = select(force.where, mesh, file);
  out.weights = share_by_mass(out.points, mesh);
  return out;
}

}  // namespace dfm::scene
