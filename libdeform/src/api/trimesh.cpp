#include <string>

#include "api/mesh_objects.h"
#include "deform/mesh.h"
#include "mesh/raw_mesh.h"

using namespace dfm;
using Object = TriMeshObject;

dfm_status dfm_trimesh_read(dfm_context *context, const char *path, dfm_trimesh *out) {
  return as_status([&] {
    used(require(context));
    need(path, "path");
    need(out, "out");
    TriMesh mesh = read_tri_mesh(context->memory, path);
    log_warnings(*context, path, mesh.warnings);
    *out = Object::keep(*context, std::move(mesh));
  });
}

dfm_status dfm_trimesh_create(dfm_context *context, uint32_t npoint, const double *points, uint32_t ntriangle,
                              const uint32_t *triangles, dfm_trimesh *out) {
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
    TriMesh mesh = finish_surface("dfm_trimesh_create", std::move(raw));
    log_warnings(*context, "dfm_trimesh_create", mesh.warnings);
    *out = Object::keep(*context, std::move(mesh));
  });
}

dfm_status dfm_trimesh_make(dfm_context *context, const char *kind, const double size[3], uint32_t triangles,
                            dfm_trimesh *out) {
  return as_status([&] {
    used(require(context));
    need(kind, "kind");
    need(size, "size");
    need(out, "out");
    const std::string name = kind;
    const Memory &memory = context->memory;
    const auto keep = [&](TriMesh &&mesh) { *out = Object::keep(*context, std::move(mesh)); };
    if (name == "cylinder") keep(make_cylinder_surface(memory, size[0], size[1], triangles));
    else if (name == "beam") keep(make_beam_surface(memory, size[0], size[1], size[2], triangles));
    else if (name == "ball") keep(make_ball_surface(memory, size[0], triangles));
    else if (name == "tube") keep(make_tube_surface(memory, size[0], size[1], size[2], triangles));
    else if (name == "torus") keep(make_torus_surface(memory, size[0], size[1], triangles));
    else
      fail(DFM_E_ARG, "no surface generator is called '%s'; expected cylinder, beam, ball, tube or torus",
           kind);
  });
}

dfm_status dfm_trimesh_destroy(dfm_trimesh mesh) {
  return as_status([&] { Object::destroy(mesh); });
}

dfm_status dfm_trimesh_get_info(dfm_trimesh mesh, dfm_trimesh_info *out) {
  return as_status(Object::of, mesh, [&](const Object &object) { copy_out(out, object.info); });
}

dfm_status dfm_trimesh_data(dfm_trimesh mesh, const double **points, const uint32_t **triangles,
                            const uint32_t **file_point) {
  return as_status([&] {
    const TriMesh &m = Object::of(mesh).mesh;
    if (points) *points = m.points.data();
    if (triangles) *triangles = m.tris.data();
    if (file_point) *file_point = m.file_point.data();
  });
}

dfm_status dfm_trimesh_groups(dfm_trimesh mesh, const char *const **names, const uint32_t **triangle_group) {
  return as_status(Object::of, mesh, [&](const Object &object) {
    if (names) *names = object.names.data();
    if (triangle_group) *triangle_group = object.mesh.tri_group.data();
  });
}

dfm_status dfm_trimesh_write(dfm_trimesh mesh, const char *path) {
  return as_status([&] {
    need(path, "path");
    write_tri_mesh(Object::of(mesh).mesh, path);
  });
}
