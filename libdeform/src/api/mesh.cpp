#include "deform/mesh.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "api/objects.h"
#include "mesh/cells.h"
#include "mesh/raw_mesh.h"
#include "plugin/context.h"

using namespace dfm;

namespace {

template <class T>
const T *lent(const Array<T> &values) {
  return values.empty() ? nullptr : values.data();
}

// A mesh behind its handle, with what dfm_mesh_info lends out.
struct MeshObject {
  dfm_context &context;
  RestMesh mesh;
  dfm_mesh_info info;
  std::string warnings;
  std::vector<const char *> names;
  std::vector<uint32_t> dimension, npoint;
  std::vector<const uint32_t *> points;

  MeshObject(dfm_context &c, RestMesh &&m) : context(c), mesh(std::move(m)), info(mesh_statistics(mesh)) {
    for (const std::string &w : mesh.warnings) warnings += w + "\n";
    for (const MeshGroup &g : mesh.groups) {
      names.push_back(g.name.c_str());
      dimension.push_back(static_cast<uint32_t>(g.dimension));
      npoint.push_back(static_cast<uint32_t>(g.points.size()));
      points.push_back(g.points.data());
    }
    info.warnings = warnings.c_str();
    info.points = mesh.points.data();
    info.file_point = mesh.file_point.data();
    info.nface = mesh.ntri();
    info.faces = lent(mesh.tris);
    info.face_group = lent(mesh.tri_group);
    info.group_names = names.data();
    info.group_dimension = dimension.data();
    info.group_npoint = npoint.data();
    info.group_points = points.data();
    info.tets = lent(mesh.tets);
    info.cells = lent(mesh.cells);
    info.cell_group = lent(mesh.tet_group);
    info.file_cell = lent(mesh.file_cell);
    info.share = lent(mesh.share);
    info.inside = lent(mesh.inside);
  }
};

MeshObject &mesh_of(dfm_mesh_handle handle) {
  MeshObject &object = resolve<MeshObject>(Kind::mesh, handle);
  return held(object, object.context);
}
const RestMesh &cells_of(const MeshObject &object, dfm_mesh_handle handle) {
  if (!object.mesh.tets.empty()) return object.mesh;
  fail(DFM_E_HANDLE,
       "mesh handle 0x%llx is that of a surface mesh; pass the handle of a mesh with cells, as dfm_mesh_fill "
       "makes it of a surface",
       static_cast<unsigned long long>(handle));
}
const RestMesh &surface_of(const MeshObject &object, dfm_mesh_handle handle) {
  if (object.mesh.tets.empty()) return object.mesh;
  fail(DFM_E_HANDLE,
       "mesh handle 0x%llx is that of a mesh with cells; pass the handle of a surface mesh, as dfm_mesh_load "
       "and dfm_mesh_make give with DFM_MESH_SURFACE",
       static_cast<unsigned long long>(handle));
}

// Moves a mesh into a context. from: logs its warnings with this before each.
void keep(dfm_context &context, RestMesh &&mesh, dfm_mesh_handle *out, const char *from = nullptr) {
  if (from)
    for (const std::string &w : mesh.warnings) context.warn("%s: %s", from, w.c_str());
  *out = keep_live(context, Kind::mesh, std::make_unique<MeshObject>(context, std::move(mesh)),
                   end_live<Kind::mesh, MeshObject>);
}

// "About" so many cells are asked for; a difference of more than a quarter is reported.
void warn_cell_count(RestMesh &mesh, const char *kind, uint32_t requested) {
  constexpr double kAbout = 1.25;
  const CellKind &of = cell_kind(mesh.cell);
  const double made = double(mesh.ntet() / of.tets);
  if (std::max(made, double(requested)) > kAbout * std::min(made, double(requested)))
    mesh.warnings.push_back(
        format("%.0f %s are made where %u were asked for: the lattice of a %s has no number of "
               "well-shaped cells nearer to that",
               made, of.name, requested, kind));
}
RestMesh generate_cells(const Memory &memory, const std::string &kind, const double size[3], uint32_t n) {
  if (kind == "cylinder") return make_cylinder(memory, size[0], size[1], n);
  if (kind == "beam") return make_beam(memory, size[0], size[1], size[2], n);
  if (kind == "bricks") return make_bricks(memory, size[0], size[1], size[2], n);
  if (kind == "ball") return make_ball(memory, size[0], n);
  if (kind == "tube") return make_tube(memory, size[0], size[1], size[2], n);
  fail(DFM_E_ARG, "no generator is called '%s'; expected cylinder, beam, bricks, ball or tube", kind.c_str());
}
RestMesh generate_surface(const Memory &memory, const std::string &kind, const double size[3], uint32_t n) {
  if (kind == "cylinder") return make_cylinder_surface(memory, size[0], size[1], n);
  if (kind == "beam") return make_beam_surface(memory, size[0], size[1], size[2], n);
  if (kind == "ball") return make_ball_surface(memory, size[0], n);
  if (kind == "tube") return make_tube_surface(memory, size[0], size[1], size[2], n);
  if (kind == "torus") return make_torus_surface(memory, size[0], size[1], n);
  fail(DFM_E_ARG, "no surface generator is called '%s'; expected cylinder, beam, ball, tube or torus",
       kind.c_str());
}
}  // namespace

dfm_status dfm_mesh_load(dfm_context *context, const char *path, uint32_t what, dfm_mesh_handle *out) {
  return as_status([&] {
    used(require(context));
    need(path, "path");
    need(out, "out");
    if (what > DFM_MESH_SURFACE)
      fail(DFM_E_ARG, "%s: what is %u; expected DFM_MESH_ANY, DFM_MESH_CELLS or DFM_MESH_SURFACE", path,
           what);
    keep(*context, read_mesh(context->memory, path, what), out, path);
  });
}

dfm_status dfm_mesh_make(dfm_context *context, const char *kind, const double size[3], uint32_t what,
                         uint32_t n, dfm_mesh_handle *out) {
  return as_status([&] {
    used(require(context));
    need(kind, "kind");
    need(size, "size");
    need(out, "out");
    if (what == DFM_MESH_SURFACE)
      return keep(*context, generate_surface(context->memory, kind, size, n), out);
    if (what != DFM_MESH_CELLS)
      fail(DFM_E_ARG, "'%s': what is %u; expected DFM_MESH_CELLS or DFM_MESH_SURFACE", kind, what);
    RestMesh mesh = generate_cells(context->memory, kind, size, n);
    warn_cell_count(mesh, kind, n);
    keep(*context, std::move(mesh), out);
  });
}

dfm_status dfm_mesh_create(dfm_context *context, uint32_t npoint, const double *points, uint32_t ntriangle,
                           const uint32_t *triangles, dfm_mesh_handle *out) {
  return as_status([&] {
    used(require(context));
    need(points, "points");
    need(triangles, "triangles");
    need(out, "out");
    for (size_t i = 0; i < 3 * size_t(ntriangle); ++i)
      if (triangles[i] >= npoint)
        fail(DFM_E_ARG, "triangle %zu (counted from 0) uses point %u, there are %u; numbers count from 0",
             i / 3, triangles[i], npoint);
    RawMesh raw(context->memory);
    raw.points.assign(points, points + 3 * size_t(npoint));
    raw.tris.assign(triangles, triangles + 3 * size_t(ntriangle));
    keep(*context, finish_surface("dfm_mesh_create", std::move(raw)), out, "dfm_mesh_create");
  });
}

dfm_status dfm_mesh_destroy(dfm_mesh_handle mesh) {
  return as_status([&] {
    MeshObject &object = mesh_of(mesh);
    Call::now().need_alone(&object, "mesh");
    object.context.remove_live(mesh);
    end_live<Kind::mesh, MeshObject>(mesh);
  });
}

dfm_status dfm_mesh_get_info(dfm_mesh_handle mesh, dfm_mesh_info *out) {
  return as_status(mesh_of, mesh, [&](const MeshObject &object) { copy_out(out, object.info); });
}

dfm_status dfm_mesh_write(dfm_mesh_handle mesh, const char *path) {
  return as_status([&] {
    need(path, "path");
    const MeshObject &object = mesh_of(mesh);
    if (!write_mesh(object.mesh, path))
      object.context.warn(
          "%s does not keep how much of each cell is material: a body of this file counts every cell whole "
          "in mass and stiffness; write %s",
          path, object.info.inside ? ".vtu, which keeps it" : ".vtu or .vtk, which keep it");
  });
}

dfm_status dfm_mesh_second_order(dfm_mesh_handle mesh, dfm_mesh_handle *out) {
  return as_status([&] {
    need(out, "out");
    const MeshObject &object = mesh_of(mesh);
    keep(object.context, second_order(cells_of(object, mesh)), out);
  });
}

dfm_status dfm_mesh_fill(dfm_mesh_handle surface, uint32_t cells, dfm_mesh_handle *out) {
  return as_status([&] {
    need(out, "out");
    const MeshObject &object = mesh_of(surface);
    const RestMesh &shell = surface_of(object, surface);
    keep(object.context, cells ? fill_surface(shell, cells) : fan_surface(shell), out, "filling a surface");
  });
}

dfm_status dfm_mesh_lattice(dfm_mesh_handle surface, uint32_t cells, double size, dfm_mesh_handle *out) {
  return as_status([&] {
    need(out, "out");
    const MeshObject &object = mesh_of(surface);
    keep(object.context, make_lattice(surface_of(object, surface), cells, size), out, "making a lattice");
  });
}
