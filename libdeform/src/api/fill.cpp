#include "api/mesh_objects.h"
#include "deform/mesh.h"

using namespace dfm;

dfm_status dfm_tetmesh_fill(dfm_trimesh surface, uint32_t cells, dfm_tetmesh *out) {
  return as_status([&] {
    need(out, "out");
    const TriMeshObject &object = TriMeshObject::of(surface);
    TetMesh mesh = cells ? dfm::fill_surface(object.mesh, cells) : dfm::fan_surface(object.mesh);
    for (const std::string &w : mesh.warnings)
      object.context.logf(DFM_LOG_WARNING, "filling a surface: %s", w.c_str());
    *out = TetMeshObject::keep(object.context, std::move(mesh));
  });
}

dfm_status dfm_tetmesh_lattice(dfm_trimesh surface, uint32_t cells, double size, dfm_tetmesh *out) {
  return as_status([&] {
    need(out, "out");
    const TriMeshObject &object = TriMeshObject::of(surface);
    TetMesh mesh = make_lattice(object.mesh, cells, size);
    for (const std::string &w : mesh.warnings)
      object.context.logf(DFM_LOG_WARNING, "making a lattice: %s", w.c_str());
    *out = TetMeshObject::keep(object.context, std::move(mesh));
  });
}

dfm_status dfm_tetmesh_inside(dfm_tetmesh mesh, const double **inside) {
  return as_status([&] {
    need(inside, "inside");
    const TetMesh &m = TetMeshObject::of(mesh).mesh;
    *inside = m.inside.empty() ? nullptr : m.inside.data();
  });
}

dfm_status dfm_tetmesh_share(dfm_tetmesh mesh, const double **share) {
  return as_status([&] {
    need(share, "share");
    const TetMesh &m = TetMeshObject::of(mesh).mesh;
    *share = m.share.empty() ? nullptr : m.share.data();
  });
}
