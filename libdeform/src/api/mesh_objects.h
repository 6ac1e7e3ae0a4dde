// Meshes behind handles, with the arrays that the C API lends out.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "api/objects.h"
#include "mesh/tri_mesh.h"
#include "plugin/context.h"

namespace dfm {

inline MeshStatistics statistics_of(const TetMesh &mesh) { return mesh_statistics(mesh); }
inline TriMeshStatistics statistics_of(const TriMesh &mesh) { return tri_mesh_statistics(mesh); }

template <class Mesh, Kind kKind>
struct MeshObject {
  dfm_context &context;
  Mesh mesh;
  decltype(statistics_of(std::declval<const Mesh &>())) statistics;
  std::vector<const char *> names;
  std::string warnings;

  MeshObject(dfm_context &c, Mesh &&m) : context(c), mesh(std::move(m)), statistics(statistics_of(mesh)) {
    for (const MeshGroup &g : mesh.groups) names.push_back(g.name.c_str());
    for (const std::string &w : mesh.warnings) warnings += w + "\n";
  }

  static MeshObject &of(uint64_t handle) {
    MeshObject &object = resolve<MeshObject>(kKind, handle);
    Call::now().hold(&object);
    Call::now().hold(&object.context);
    Call::now().count(object.context.calls);
    return object;
  }

  // Moves the mesh into the context and returns its handle.
  static uint64_t keep(dfm_context &context, Mesh &&mesh) {
    auto object = std::make_unique<MeshObject>(context, std::move(mesh));
    const uint64_t handle = handle_create(kKind, object.get());
    try {
      context.add_live(handle, end);
    } catch (...) {
      handle_destroy(handle);
      throw;
    }
    object.release();
    return handle;
  }

  static void destroy(uint64_t handle) {
    MeshObject &object = of(handle);
    Call::now().need_alone(&object, "mesh");
    object.context.remove_live(handle);
    end(handle);
  }

 private:
  static void end(uint64_t handle) {
    auto *object = static_cast<MeshObject *>(handle_find(kKind, handle));
    handle_destroy(handle);
    delete object;
  }
};

using TetMeshObject = MeshObject<TetMesh, Kind::tetmesh>;
using TriMeshObject = MeshObject<TriMesh, Kind::trimesh>;

}  // namespace dfm
