#include "deform/mesh.h"

#include <algorithm>
#include <string>

#include "api/mesh_objects.h"
#include "mesh/cells.h"
#include "mesh/raw_mesh.h"

using namespace dfm;
using Object = TetMeshObject;

namespace {
// "About" so many cells are asked for; who gets others by more than a quarter is told.
void warn_cell_count(TetMesh &mesh, const char *kind, uint32_t requested) {
  constexpr double kAbout = 1.25;
  const CellKind &of = cell_kind(mesh.cell);
  const double made = double(mesh.ntet() / of.tets);
  if (std::max(made, double(requested)) > kAbout * std::min(made, double(requested)))
    mesh.warnings.push_back(
        format("%.0f %s are made where %u were asked for: the lattice of a %s has no number of "
               "well-shaped cells nearer to that",
               made, of.name, requested, kind));
}
}  // namespace

dfm_status dfm_tetmesh_read(dfm_context *context, const char *path, dfm_tetmesh *out) {
  return as_status([&] {
    used(require(context));
    need(path, "path");
    need(out, "out");
    TetMesh mesh = read_tet_mesh(context->memory, path);
    log_warnings(*context, path, mesh.warnings);
    *out = Object::keep(*context, std::move(mesh));
  });
}

dfm_status dfm_mesh_file_kind(dfm_context *context, const char *path, uint32_t *kind) {
  return as_status([&] {
    used(require(context));
    need(path, "path");
    need(kind, "kind");
    *kind = has_cells(path, read_raw(context->memory, path)) ? DFM_MESH_TETS : DFM_MESH_SURFACE;
  });
}

dfm_status dfm_mesh_read(dfm_context *context, const char *path, dfm_tetmesh *cells, dfm_trimesh *surface) {
  return as_status([&] {
    used(require(context));
    need(path, "path");
    need(cells, "cells");
    need(surface, "surface");
    AnyMesh mesh = read_any_mesh(context->memory, path);
    log_warnings(*context, path, mesh.cells ? mesh.cells->warnings : mesh.surface->warnings);
    const dfm_tetmesh c = mesh.cells ? Object::keep(*context, std::move(*mesh.cells)) : 0;
    *surface = mesh.surface ? TriMeshObject::keep(*context, std::move(*mesh.surface)) : 0;
    *cells = c;
  });
}

dfm_status dfm_tetmesh_make(dfm_context *context, const char *kind, const double size[3], uint32_t cells,
                            dfm_tetmesh *out) {
  return as_status([&] {
    used(require(context));
    need(kind, "kind");
    need(size, "size");
    need(out, "out");
    const std::string name = kind;
    const Memory &memory = context->memory;
    const auto keep = [&](TetMesh mesh) {
      warn_cell_count(mesh, kind, cells);
      *out = Object::keep(*context, std::move(mesh));
    };
    if (name == "cylinder") keep(make_cylinder(memory, size[0], size[1], cells));
    else if (name == "beam") keep(make_beam(memory, size[0], size[1], size[2], cells));
    else if (name == "bricks") keep(make_bricks(memory, size[0], size[1], size[2], cells));
    else if (name == "ball") keep(make_ball(memory, size[0], cells));
    else if (name == "tube") keep(make_tube(memory, size[0], size[1], size[2], cells));
    else fail(DFM_E_ARG, "no generator is called '%s'; expected cylinder, beam, bricks, ball or tube", kind);
  });
}

dfm_status dfm_tetmesh_destroy(dfm_tetmesh mesh) {
  return as_status([&] { Object::destroy(mesh); });
}

dfm_status dfm_tetmesh_get_info(dfm_tetmesh mesh, dfm_tetmesh_info *out) {
  return as_status(Object::of, mesh, [&](const Object &object) { copy_out(out, object.info); });
}

dfm_status dfm_tetmesh_data(dfm_tetmesh mesh, const double **points, const uint32_t **tets,
                            const uint32_t **file_point) {
  return as_status([&] {
    const TetMesh &m = Object::of(mesh).mesh;
    if (points) *points = m.points.data();
    if (tets) *tets = m.tets.data();
    if (file_point) *file_point = m.file_point.data();
  });
}

dfm_status dfm_tetmesh_cells(dfm_tetmesh mesh, uint32_t *kind, const uint32_t **cells) {
  return as_status([&] {
    const TetMesh &m = Object::of(mesh).mesh;
    if (kind) *kind = m.cell;
    if (cells) *cells = m.cells.empty() ? nullptr : m.cells.data();
  });
}

dfm_status dfm_tetmesh_second_order(dfm_tetmesh mesh, dfm_tetmesh *out) {
  return as_status([&] {
    need(out, "out");
    const Object &object = Object::of(mesh);
    *out = Object::keep(object.context, second_order(object.mesh));
  });
}

dfm_status dfm_tetmesh_file_cells(dfm_tetmesh mesh, const uint32_t **file_cell) {
  return as_status([&] {
    need(file_cell, "file_cell");
    const TetMesh &m = Object::of(mesh).mesh;
    *file_cell = m.file_cell.empty() ? nullptr : m.file_cell.data();
  });
}

dfm_status dfm_tetmesh_groups(dfm_tetmesh mesh, const char *const **names, const uint32_t **cell_group) {
  return as_status(Object::of, mesh, [&](const Object &object) {
    if (names) *names = object.names.data();
    if (cell_group) *cell_group = object.mesh.tet_group.data();
  });
}

dfm_status dfm_tetmesh_triangles(dfm_tetmesh mesh, const uint32_t **triangles, const uint32_t **group,
                                 uint32_t *n) {
  return as_status([&] {
    const TetMesh &m = Object::of(mesh).mesh;
    if (triangles) *triangles = m.tris.data();
    if (group) *group = m.tri_group.data();
    if (n) *n = static_cast<uint32_t>(m.tri_group.size());
  });
}

dfm_status dfm_tetmesh_group_points(dfm_tetmesh mesh, uint32_t group, uint32_t *dimension,
                                    const uint32_t **points, uint32_t *n) {
  return as_status([&] {
    const TetMesh &m = Object::of(mesh).mesh;
    if (group >= m.groups.size())
      fail(DFM_E_ARG, "there is no group %u; the mesh has %zu", group, m.groups.size());
    const MeshGroup &g = m.groups[group];
    if (dimension) *dimension = static_cast<uint32_t>(g.dimension);
    if (points) *points = g.points.data();
    if (n) *n = static_cast<uint32_t>(g.points.size());
  });
}

dfm_status dfm_tetmesh_write(dfm_tetmesh mesh, const char *path) {
  return as_status([&] {
    need(path, "path");
    const Object &object = Object::of(mesh);
    if (!write_tet_mesh(object.mesh, path))
      object.context.logf(
          DFM_LOG_WARNING,
          "%s does not keep how much of each cell is material: a body of this file counts every cell "
          "whole in mass and stiffness; write %s",
          path, object.mesh.inside.empty() ? ".vtu or .vtk, which keep it" : ".vtu, which keeps it");
  });
}
