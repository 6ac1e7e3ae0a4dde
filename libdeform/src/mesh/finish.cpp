// Turns the contents of a file into a mesh for a body. Order matters: invalid input is refused first (flat
// cells), then cells are reoriented, duplicates dropped and points renumbered; repairs are counted and
// reported. All thresholds are relative: a cell counts as flat when its volume is not above the rounding of
// its own coordinates, so bodies of nanometers and of 100 km load alike.
#include <algorithm>
#include <array>
#include <cfloat>
#include <cmath>
#include <numeric>
#include <tuple>

#include "core/names.h"
#include "core/path.h"
#include "math/vec3.h"
#include "mesh/cells.h"
#include "mesh/faces.h"
#include "mesh/finish.h"

namespace dfm {
namespace {

// rounding of coordinates over the shortest edge, from which on there is a warning
constexpr double kCoarseCoordinates = 1e-8;

struct CellShape { double volume6, edge_max, reach; };  // reach: largest coordinate

CellShape cell_shape(const double *points, const uint32_t *tet) {
  CellShape s{6 * tet_volume(points, tet), 0, 0};
  double longest2 = 0;
  for (const auto &e : kTetEdge)
    longest2 = std::max(longest2,
                        norm2(load3(points + 3 * size_t(tet[e[0]])) - load3(points + 3 * size_t(tet[e[1]]))));
  s.edge_max = std::sqrt(longest2);
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c) s.reach = std::max(s.reach, std::fabs(points[3 * size_t(tet[k]) + c]));
  return s;
}

// A coordinate x is known to eps*x; an altitude below a few of these is meaningless.
bool is_flat(const CellShape &s) {
  return !(std::fabs(s.volume6) > 8 * DBL_EPSILON * s.edge_max * s.edge_max * (s.edge_max + s.reach));
}

void refuse_flat(const std::string &path, const RawMesh &raw) {
  const uint32_t ntet = uint32_t(raw.tets.size() / 4);
  uint32_t flat = 0, first = 0;
  for (uint32_t t = 0; t < ntet; ++t)
    if (is_flat(cell_shape(raw.points.data(), &raw.tets[4 * size_t(t)])) && flat++ == 0) first = t;
  if (flat == 0) return;
  const uint32_t *c = &raw.tets[4 * size_t(first)];
  if (flat == ntet && ntet > 1)
    fail(DFM_E_FORMAT,
         "%s: all %u tetrahedra are flat (no volume): the points of each lie in one plane; a body needs a "
         "volume mesh",
         path.c_str(), ntet);
  fail(DFM_E_FORMAT,
       "%s: %u of %u tetrahedra %s flat (no volume), the first is tetrahedron %u (counted from 0) on points "
       "%u %u %u %u; remove slivers in the mesher",
       path.c_str(), flat, ntet, flat == 1 ? "is" : "are", first, c[0], c[1], c[2], c[3]);
}

void turn_negative(RawMesh &raw) {
  for (size_t t = 0; t < raw.tets.size(); t += 4)
    if (tet_volume(raw.points.data(), &raw.tets[t]) < 0) {
      std::swap(raw.tets[t + 2], raw.tets[t + 3]);
      ++raw.turned;
    }
}

// The same for cells of another kind, whose tetrahedra have one orientation each.
void turn_cells(const std::string &path, RawMesh &raw) {
  const CellKind &kind = cell_kind(raw.cell);
  for (size_t c = 0; c < raw.cells.size() / kind.nodes; ++c) {
    uint32_t *const cell = &raw.cells[kind.nodes * c];
    uint32_t n = 0, flat = 0;
    const auto count = [&] {
      n = flat = 0;
      for (size_t t = kind.tets * c; t < kind.tets * (c + 1); ++t) {
        const CellShape s = cell_shape(raw.points.data(), &raw.tets[4 * t]);
        n += s.volume6 < 0;
        flat += is_flat(s);
      }
    };
    count();
    if (2 * n > kind.tets) {  // reflected
      turn_over(kind, cell);
      if (double *const w = raw.inside.empty() ? nullptr : &raw.inside[kInsidePoints * c])
        std::swap_ranges(w, w + kInsidePoints / 3, w + 2 * kInsidePoints / 3);  // its third coordinate
      tets_of(kind, cell, &raw.tets[4 * kind.tets * c]);
      ++raw.turned;
      count();
    }
    if (n + flat)
      fail(DFM_E_FORMAT,
           "%s: cell %zu (counted from 0) of %s is so distorted that a part of it is flat or inverted; "
           "straighten its edges in the mesher, or order its points as the format says",
           path.c_str(), c, kind.name);
  }
}

// Triangles without a group add nothing to the boundary of the cells.
void keep_grouped_triangles(RawMesh &raw, const Array<uint32_t> &number) {
  keep_triangles(raw, [&](uint32_t t) {
    const uint32_t *const c = &raw.tris[3 * size_t(t)];
    return raw.tri_group[t] != kNoGroup &&
           std::none_of(c, c + 3, [&](uint32_t p) { return number[p] == kNoGroup; });
  });
  for (uint32_t &p : raw.tris) p = number[p];
  raw.tris.shrink_to_fit();
  raw.tri_group.shrink_to_fit();
}

// Keeps the points that cells use, in the file's order, and fills the groups' points.
void renumber(RawMesh &raw) {
  const uint32_t npoint = raw.npoint();
  const Array<uint32_t> number = keep_points(raw, raw.tets);
  raw.dropped_points = npoint - raw.npoint();
  for (uint32_t &p : raw.tets) p = number[p];
  for (uint32_t &p : raw.cells) p = number[p];
  keep_grouped_triangles(raw, number);

  for (MeshGroup &group : raw.groups) {
    for (uint32_t &p : group.points) p = number[p];
    group.points.erase(std::remove(group.points.begin(), group.points.end(), kNoGroup), group.points.end());
  }
  add_to_groups(raw.groups, raw.tet_group, raw.tets);
}

// Shares are used only if there is one for each cell, all in (0,1]; otherwise the array means something else.
void check_shares(RawMesh &raw) {
  const bool valid = raw.share.size() == raw.ntet() &&
                     std::ranges::all_of(raw.share, [](double s) { return s > 0 && s <= 1; });
  if (!valid) use_memory(*raw.memory, raw.share);
  if (raw.cell != DFM_CELL_HEX8 || raw.inside.size() != raw.cells.size() / 8 * kInsidePoints)
    use_memory(*raw.memory, raw.inside);
}

uint32_t count_overlaps(const RestMesh &mesh, uint32_t *crowded) {
  const Array<TetFace> faces = sorted_faces(*mesh.memory, mesh.ntet(), mesh.tets.data());
  uint32_t same_side = 0;
  *crowded = 0;
  for (size_t i = 0, j = 0; i < faces.size(); i = j) {
    while (j < faces.size() && faces[j].same_corners(faces[i])) ++j;
    if (j - i == 2) same_side += faces[i].odd == faces[i + 1].odd;
    else *crowded += j - i > 2;
  }
  return same_side;
}

void add_warnings(RestMesh &mesh, uint32_t crowded) {
  const auto warn = [&](const std::string &text) { mesh.warnings.push_back(text); };
  const dfm_mesh_info s = mesh_statistics(mesh);
  if (mesh.turned)
    warn(format("%u of %u cells had negative volume and %s turned", mesh.turned,
                s.ntet / cell_kind(mesh.cell).tets, was_were(mesh.turned)));
  if (mesh.overlapping)
    warn(
        format("the mesh is tangled: across %u face%s both cells lie on the same side, so they overlap; mesh "
               "the shape again",
               mesh.overlapping, plural(mesh.overlapping)));
  if (crowded)
    warn(format("%u face%s shared by more than two cells; the cells there overlap", crowded,
                crowded == 1 ? " is" : "s are"));
  add_count(mesh.warnings, mesh.dropped_cells, "duplicate cell", "", "dropped");
  add_count(mesh.warnings, mesh.dropped_points, "point", " that no cell uses", "dropped");
  if (s.duplicate_points)
    warn(format("%u point%s %s exactly at another point's place; cells that meet there are not joined",
                s.duplicate_points, plural(s.duplicate_points), s.duplicate_points == 1 ? "lies" : "lie"));
  if (s.npiece > 1) warn(format("the mesh has %u pieces that share no point and move apart", s.npiece));
  if (s.nonmanifold_edges)
    warn(format("%u edge%s of the surface %s used by more than two triangles", s.nonmanifold_edges,
                plural(s.nonmanifold_edges), is_are(s.nonmanifold_edges)));
  if (s.flat_cells)
    warn(format(
        "%u cell%s %s nearly flat (mean ratio below 0.01, least %.3g); they force small explicit steps",
        s.flat_cells, plural(s.flat_cells), is_are(s.flat_cells), s.quality_min));
  if (const std::string coarse = coarse_coordinates(s.lo, s.hi, s.edge_min); !coarse.empty()) warn(coarse);
}

}  // namespace

Array<uint32_t> keep_points(RawMesh &raw, const Array<uint32_t> &used) {
  Array<uint32_t> number(raw.npoint(), kNoGroup, *raw.memory);
  for (const uint32_t p : used) number[p] = 0;
  raw.file_point.reserve(size_t(std::count(number.begin(), number.end(), 0u)));
  for (uint32_t p = 0; p < number.size(); ++p)
    if (number[p] == 0) {
      number[p] = uint32_t(raw.file_point.size());
      std::copy_n(&raw.points[3 * size_t(p)], 3, &raw.points[3 * raw.file_point.size()]);
      raw.file_point.push_back(p);
    }
  raw.points.resize(3 * raw.file_point.size());
  raw.points.shrink_to_fit();
  return number;
}

void check_points(const std::string &path, const Array<double> &points) {
  for (size_t i = 0; i < points.size(); ++i)
    if (!(std::fabs(points[i]) <= kLargestCoordinate))
      fail(DFM_E_FORMAT,
           "%s: point %zu (counted from 0) has the coordinate %g m; coordinates up to %g m are read",
           path.c_str(), i / 3, points[i], kLargestCoordinate);
}

void sort_once(Array<uint32_t> &points) {
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  points.shrink_to_fit();
}

void keep_groups(RawMesh &raw, std::vector<uint32_t> kept) {
  std::ranges::sort(kept, {},
                    [&](uint32_t g) { return std::tuple(raw.groups[g].dimension, raw.groups[g].tag, g); });
  std::vector<MeshGroup> groups;
  std::vector<uint32_t> place(raw.groups.size(), kNoGroup);
  for (const uint32_t g : kept) {
    place[g] = uint32_t(groups.size());
    groups.push_back(std::move(raw.groups[g]));
  }
  raw.groups = std::move(groups);
  for (Array<uint32_t> *const of : {&raw.tet_group, &raw.tri_group})
    for (uint32_t &g : *of)
      if (g != kNoGroup) g = place[g];
}

void add_to_groups(std::vector<MeshGroup> &groups, const Array<uint32_t> &group,
                   const Array<uint32_t> &corners) {
  const size_t width = group.empty() ? 0 : corners.size() / group.size();
  for (size_t i = 0; i < group.size(); ++i)
    if (group[i] != kNoGroup)
      groups[group[i]].points.insert(groups[group[i]].points.end(), &corners[width * i],
                                     &corners[width * i] + width);
  for (MeshGroup &g : groups) sort_once(g.points);
}

uint32_t drop_duplicate_cells(RawMesh &raw, Array<uint32_t> *file_cell) {
  struct Key {
    std::array<uint32_t, 4> corner;
    uint32_t cell;
    bool operator<(const Key &o) const { return corner != o.corner ? corner < o.corner : cell < o.cell; }
  };
  const uint32_t ntet = uint32_t(raw.tets.size() / 4);
  Array<Key> keys{*raw.memory};
  keys.reserve(ntet);
  for (uint32_t t = 0; t < ntet; ++t) {
    Key key{{}, t};
    std::copy_n(&raw.tets[4 * size_t(t)], 4, key.corner.begin());
    std::sort(key.corner.begin(), key.corner.end());
    keys.push_back(key);
  }
  std::sort(keys.begin(), keys.end());
  uint32_t dropped = 0;
  Array<uint8_t> drop(ntet, 0, *raw.memory);
  for (size_t i = 1; i < keys.size(); ++i)
    if (keys[i].corner == keys[i - 1].corner) {
      drop[keys[i].cell] = 1;
      ++dropped;
    }
  if (dropped == 0) return 0;
  size_t kept = 0;
  for (uint32_t t = 0; t < ntet; ++t)
    if (!drop[t]) {
      std::copy_n(&raw.tets[4 * size_t(t)], 4, &raw.tets[4 * kept]);
      if (raw.share.size() == ntet) raw.share[kept] = raw.share[t];
      raw.tet_group[kept++] = raw.tet_group[t];
      if (file_cell) file_cell->push_back(t);
    }
  if (raw.share.size() == ntet) raw.share.resize(kept);
  raw.tets.resize(4 * kept);
  raw.tet_group.resize(kept);
  return dropped;
}

std::string coarse_coordinates(const double lo[3], const double hi[3], double edge_min) {
  double reach = 0;
  for (int k = 0; k < 3; ++k) reach = std::max({reach, std::fabs(lo[k]), std::fabs(hi[k])});
  if (!(DBL_EPSILON * reach > kCoarseCoordinates * edge_min)) return {};
  return format("the body lies %.3g m from the origin, where coordinates resolve only %.2g m; move it nearer",
                reach, DBL_EPSILON * reach);
}

RestMesh finish_mesh(const std::string &path, RawMesh &&raw) {
  if (raw.tets.empty() && !raw.tris.empty())
    fail(DFM_E_FORMAT,
         "%s: no tetrahedra in this file, only a surface of %u triangles; fill it, and give it to the body "
         "as its surface: TetMesh.fill and surface= of add_body in Python, dfm_mesh_fill and "
         "dfm_body_def.surface in C, or deform mesh fill %s --out %s",
         path.c_str(), raw.ntri(), shell_word(path).c_str(),
         shell_word(name_of(path_of(path).replace_extension(".vtu"))).c_str());
  if (raw.tets.empty())
    fail(DFM_E_FORMAT, "%s: no tetrahedra in this file; a body needs a volume mesh or a closed surface",
         path.c_str());
  check_points(path, raw.points);
  check_shares(raw);
  if (raw.cells.empty()) {
    refuse_flat(path, raw);
    turn_negative(raw);
  } else {
    turn_cells(path, raw);
  }
  raw.dropped_cells = drop_duplicate_cells(raw, &raw.file_cell);
  if (raw.dropped_cells && !raw.cells.empty())
    fail(DFM_E_FORMAT, "%s: cells lie on one another; write each of the %s once", path.c_str(),
         cell_kind(raw.cell).name);
  renumber(raw);
  std::vector<uint32_t> groups(raw.groups.size());
  std::iota(groups.begin(), groups.end(), 0u);
  keep_groups(raw, std::move(groups));
  uint32_t crowded = 0;
  raw.overlapping = count_overlaps(raw, &crowded);
  add_warnings(raw, crowded);
  return std::move(raw);
}

}  // namespace dfm
