#include "scene/load.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "body/make_surface.h"
#include "core/error.h"
#include "core/path.h"
#include "mesh/cells.h"
#include "plugin/context.h"
#include "world/body_model.h"

namespace dfm::scene {
namespace {

// Cells that may exceed the number in the scene, since so few cost little.
constexpr uint32_t kCheapCells = 1000;
// m; a body that is longer is asked for the unit of its file.
constexpr double kLongestBody = 10;
// Prefixes of the keys of meshes.
const std::string kCells = "cells ", kSurface = "surface ";

// m. All cells of a lattice are alike, so the first one is enough.
double longest_edge(const BodyMesh &mesh) {
  double longest = 0;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) {
      const double *const a = &mesh.points[3 * size_t{mesh.info.tets[i]}],
                          *const b = &mesh.points[3 * size_t{mesh.info.tets[j]}];
      longest = std::max(longest, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
    }
  return longest;
}

// m, of the skin's edges. Each cell of a lattice has points of the skin.
double longest_of_skin(const BodyMesh &mesh) {
  if (!mesh.info.inside) return kLongestEdge * longest_edge(mesh);
  double longest = 0;
  for (const size_t k : {1, 3, 4})
    for (size_t c = 0; c < 3; ++c)
      longest = std::max(longest, mesh.points[3 * size_t{mesh.info.cells[k]} + c] -
                                      mesh.points[3 * size_t{mesh.info.cells[0]} + c]);
  return longest;
}

std::vector<double> scaled(const dfm_mesh_info &mesh, double scale) {
  std::vector<double> out(mesh.points, mesh.points + 3 * size_t{mesh.npoint});
  for (double &x : out) x *= scale;
  return out;
}

}  // namespace

double BodyMesh::share_of(uint32_t tet) const {
  if (!info.inside) return info.share ? info.share[tet] : 1;
  const double *const weights = info.inside + size_t{kInsidePoints} * (tet / cell_kind(info.cell).tets);
  return std::accumulate(weights, weights + kInsidePoints, 0.0);
}

MeshFiles::~MeshFiles() {
  for (auto &[key, mesh] : meshes_) dfm_mesh_destroy(mesh);
}

dfm_mesh_info MeshFiles::info_of(dfm_mesh_handle mesh, const std::string &pointer) const {
  dfm_mesh_info info = {};
  info.size = sizeof info;
  def_.require(dfm_mesh_get_info(mesh, &info), pointer);
  return info;
}

std::string MeshFiles::path_of(const std::string &path) const {
  const std::filesystem::path p = dfm::path_of(path);
  return p.is_absolute() || def_.folder.empty() ? path
                                                : name_of((dfm::path_of(def_.folder) / p).lexically_normal());
}

bool MeshFiles::has_cells(const std::string &path, const std::string &pointer) {
  if (known_ && (known_->has(kCells + path) || known_->surface_only_.count(path)))
    return known_->has(kCells + path);
  if (has(kCells + path)) return true;
  if (surface_only_.count(path)) return false;
  dfm_mesh_handle mesh = 0;
  def_.require(dfm_mesh_load(context_, path.c_str(), DFM_MESH_ANY, &mesh), pointer);
  const bool cells = info_of(mesh, pointer).ntet > 0;
  if (!cells) surface_only_.insert(path);
  // a surface is perhaps known already, as that of a body
  if (!meshes_.try_emplace((cells ? kCells : kSurface) + path, mesh).second)
    def_.require(dfm_mesh_destroy(mesh), pointer);
  return cells;
}

// Stored under a name that no file can have.
std::string MeshFiles::make(const Body &b) {
  const MadeMesh &m = b.made;
  const std::string name = format("/dev/null/%s %a %a %a %u %u", m.kind.c_str(), m.size[0], m.size[1],
                                  m.size[2], m.cells, m.order);
  if (known_ && known_->has(kCells + name)) return name;
  dfm_mesh_handle &mesh = meshes_[kCells + name];
  if (mesh) return name;
  def_.require(dfm_mesh_make(context_, m.kind.c_str(), m.size, DFM_MESH_CELLS, m.cells, &mesh),
               b.pointer + "/mesh");
  if (m.order == 2) {
    const dfm_mesh_handle first = mesh;
    def_.require(dfm_mesh_second_order(first, &mesh), b.pointer + "/mesh");
    def_.require(dfm_mesh_destroy(first), b.pointer + "/mesh");
  }
  const dfm_mesh_info info = info_of(mesh, b.pointer + "/mesh");
  if (info.ncell > 2 * uint64_t{m.cells} && info.ncell > m.cells + kCheapCells)
    context_->warn(b,
                   ": its %s has %u cells, not about %u: cells are about as long as thick, and no fewer of "
                   "them fit into its thickness; make it thicker for fewer",
                   m.kind.c_str(), info.ncell, m.cells);
  return name;
}

dfm_mesh_handle MeshFiles::cells(const std::string &path, const std::string &pointer) {
  return once(kCells + path, pointer, [&](dfm_mesh_handle *mesh) {
    return dfm_mesh_load(context_, path.c_str(), DFM_MESH_CELLS, mesh);
  });
}

// Makes the surface of a generated mesh, no coarser than its own. A round surface of triangles as large as
// cells has less volume than the shape: edges are half of those of as many tetrahedra as are asked for, so
// that both errors fall alike. More hexahedra than there may be are refused where they are made.
std::string MeshFiles::make_surface(const Body &b) {
  const MadeMesh &m = b.made;
  const std::string pointer = b.pointer + "/mesh";
  const dfm_mesh_info own = info_of(cells(make(b), pointer), pointer);
  const double hexahedra = b.lattice_cells
                               ? b.lattice_cells
                               : std::min(kMaxLattice, own.volume * std::pow(b.scale / b.lattice_size, 3));
  const double wanted = b.lattice() ? kTetsOfHexahedron * hexahedra : b.fill.value_or(0);
  const auto n =
      uint32_t(std::lround(4.0 * own.ntriangle * std::pow(std::max(1.0, wanted / own.ntet), 2.0 / 3)));
  const std::string kind = m.kind == "bricks" ? "beam" : m.kind, name = make(b) + format(" %u", n);
  once(kSurface + name, pointer, [&](dfm_mesh_handle *mesh) {
    return dfm_mesh_make(context_, kind.c_str(), m.size, DFM_MESH_SURFACE, n, mesh);
  });
  return name;
}

dfm_mesh_handle MeshFiles::surface(const std::string &path, const std::string &pointer) {
  return once(kSurface + path, pointer, [&](dfm_mesh_handle *mesh) {
    return dfm_mesh_load(context_, path.c_str(), DFM_MESH_SURFACE, mesh);
  });
}

dfm_mesh_handle MeshFiles::filling(const std::string &path, const Body &b, bool warn) {
  const uint32_t wanted = b.fill.value_or(kFillCells);
  const dfm_mesh_handle skin = surface(path, b.pointer + "/mesh");
  const dfm_mesh_handle mesh =
      once(format("fill %u ", wanted) + path, b.pointer + (b.fill ? "/fill" : "/mesh"),
           [&](dfm_mesh_handle *made) { return dfm_mesh_fill(skin, wanted, made); });
  if (!b.fill && warn)
    context_->warn(b,
                   ": %s holds a surface and no cells; it is filled with %u tetrahedra; \"fill\": "
                   "{\"cells\": N} chooses",
                   path.c_str(), info_of(mesh, b.pointer + "/mesh").ntet);
  return mesh;
}

dfm_mesh_handle MeshFiles::lattice(const std::string &path, const Body &b) {
  const dfm_mesh_handle skin = surface(path, b.pointer + "/mesh");
  const double size = b.lattice_size / b.scale;
  return once(format("lattice %u %a ", b.lattice_cells, size) + path, b.pointer + "/lattice",
              [&](dfm_mesh_handle *mesh) { return dfm_mesh_lattice(skin, b.lattice_cells, size, mesh); });
}

// Keys that go with one kind of mesh file only.
void MeshFiles::check_keys(const Body &b, bool has_cells, bool renumbered) const {
  if (!has_cells) {
    if (renumbered && !b.nodal_bc.empty())
      def_.refuse(b.pointer + "/nodal_bc",
                  "the body is a filled surface, and nodes of the mesh are not its points; use \"fix\" and "
                  "\"forces\"");
    if (!b.fields.empty())
      def_.refuse(b.fields[0].pointer,
                  "the cells that fill the surface are not those of a file, which has no values for them; "
                  "fill it first with deform mesh fill and use the result as mesh");
    if (!b.by_group.empty())
      def_.refuse(b.by_group[0].pointer,
                  "the body is a filled surface, and the cells that fill it belong to no group");
    return;
  }
  if (b.surface.coupled && b.surface.mesh.empty())
    def_.refuse(b.surface.pointer + "/coupling",
                "the surface is the boundary of the cells, whose points are the body's own; a coupling needs "
                "\"mesh\"");
}

void MeshFiles::take_cells(dfm_mesh_handle mesh, const Body &b, BodyMesh &out) const {
  const dfm_mesh_info &info = out.info = info_of(mesh, b.pointer + "/mesh");
  out.points = scaled(info, b.scale);
  for (int k = 0; k < 3; ++k) {
    out.lo[k] = info.lo[k] * b.scale;
    out.hi[k] = info.hi[k] * b.scale;
  }
  out.size = std::sqrt(std::pow(out.hi[0] - out.lo[0], 2) + std::pow(out.hi[1] - out.lo[1], 2) +
                       std::pow(out.hi[2] - out.lo[2], 2));
}

void MeshFiles::take_skin(dfm_mesh_handle mesh, const Body &b, const std::string &pointer,
                          BodyMesh &out) const {
  const dfm_mesh_info info = info_of(mesh, pointer);
  Skin &skin = out.skin;
  skin.triangles = info.faces;
  skin.triangle_group = info.face_group;
  skin.group_names = info.group_names;
  skin.npoint = info.npoint;
  skin.ntriangle = info.ntriangle;
  skin.ngroup = info.ngroup;
  skin.points = scaled(info, b.scale);
}

// Contact with a plane acts at the points of the surface. If triangles were much larger than cells, the body
// would rest on a few cells, crush them, and sink through the floor between them.
void MeshFiles::split_skin(BodyMesh &out) {
  Skin &skin = out.skin;
  Triangles s;
  s.points = skin.points;
  s.triangles.assign(skin.triangles, skin.triangles + 3 * size_t{skin.ntriangle});
  if (skin.triangle_group) s.group.assign(skin.triangle_group, skin.triangle_group + skin.ntriangle);
  split_long_edges(longest_of_skin(out), s);
  if (s.points.size() == skin.points.size()) return;
  skin.points = s.points;
  Triangles &kept = split_.emplace_back(std::move(s));
  skin.npoint = uint32_t(skin.points.size() / 3);
  skin.ntriangle = uint32_t(kept.triangles.size() / 3);
  skin.triangles = kept.triangles.data();
  if (skin.triangle_group) skin.triangle_group = kept.group.data();
}

BodyMesh MeshFiles::load(const Body &b, bool warn) {
  const bool made = !b.made.kind.empty(), anew = b.fill || b.lattice();
  const std::string path = !made  ? path_of(b.mesh)
                           : anew ? make_surface(b)
                                  : make(b),
                    pointer = b.pointer + "/mesh";
  BodyMesh out;
  const bool cells_given = made || has_cells(path, pointer), whole = cells_given && !anew;
  out.filled = !whole && b.fill != 0u;
  out.renumbered = out.filled || (cells_given && anew);
  check_keys(b, whole, out.renumbered);
  take_cells(whole ? cells(path, pointer) : b.lattice() ? lattice(path, b) : filling(path, b, warn), b, out);
  out.wears_skin = !b.surface.mesh.empty() || (out.filled && !b.surface.boundary);
  if (!b.surface.mesh.empty()) {
    const std::string where = b.surface.pointer + "/mesh";
    take_skin(surface(path_of(b.surface.mesh), where), b, where, out);
  } else if (out.filled) {
    take_skin(surface(path, pointer), b, pointer, out);
    if (!out.wears_skin && warn) warn_voxel_steps(b, out);
    split_skin(out);
  }
  if (!whole && !made && !b.has_scale && warn) warn_unit(b, out);
  return out;
}

const dfm_type &MeshFiles::model(const Body &b) {
  const Registry &types = context_->registry;
  return b.model.empty() ? default_model(types, load(b).info.cell) : types.find(DFM_KIND_MODEL, b.model);
}

// Files of triangles name no unit, and most programs that write them count in millimeters.
void MeshFiles::warn_unit(const Body &b, const BodyMesh &mesh) const {
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, mesh.hi[k] - mesh.lo[k]);
  if (longest > kLongestBody)
    context_->warn(b,
                   " is %.3g m long: if %s is in millimeters, set \"scale\": 0.001 in its \"pose\" (1 if it "
                   "is in meters)",
                   longest, b.mesh.c_str());
}

// A cut needs the border of the cells as surface, which is not the shape that the file has.
void MeshFiles::warn_voxel_steps(const Body &b, const BodyMesh &mesh) const {
  const dfm_mesh_info &cells = mesh.info;
  double filled = 0;  // cells of the lattice are alike
  for (uint32_t t = 0; t < cells.ntet; ++t) filled += mesh.share_of(t);
  context_->warn(b,
                 " is drawn and touches with the %u triangles around its %u cells, in steps of about %.2g m "
                 "and with %.0f %% more volume, not with the %u triangles of %s: \"surface\" says "
                 "\"boundary\"%s make smaller steps",
                 cells.ntriangle, mesh.info.inside ? cells.ncell : cells.ntet, b.scale * cells.edge_median,
                 100 * (cells.ntet / filled - 1), mesh.skin.ntriangle,
                 b.made.kind.empty() ? b.mesh.c_str() : "the surface",
                 mesh.info.inside ? "; more cells (\"lattice\")"
                                  : ", as a body that is cut needs it; more cells (\"fill\")");
}

void MeshFiles::load(Obstacle &o, std::vector<double> &points) {
  const std::string pointer = o.pointer + "/mesh";
  const dfm_mesh_info info = info_of(surface(path_of(o.mesh), pointer), pointer);
  o.def.points = info.points;
  o.def.triangles = info.faces;
  o.def.npoint = info.npoint;
  o.def.ntriangle = info.ntriangle;
  if (o.scale == 1) return;
  points = scaled(info, o.scale);
  o.def.points = points.data();
}

}  // namespace dfm::scene
