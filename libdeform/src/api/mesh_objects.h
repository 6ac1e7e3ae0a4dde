// Meshes behind handles, with the arrays that the C API lends out.
#pragma once
#include <memory>
#include <string>
#include <vector>

#include "api/objects.h"
#include "mesh/tri_mesh.h"
#include "plugin/context.h"

namespace dfm {

template <class Mesh, Kind kKind>
struct MeshObject {
  dfm_context &context;
  Mesh mesh;
  decltype(mesh_statistics(std::declval<const Mesh &>())) info;
  std::vector<const char *> names;
  std::string warnings;

  MeshObject(dfm_context &c, Mesh &&m) : context(c), mesh(std::move(m)), info(mesh_statistics(mesh)) {
    for (const MeshGroup &g : mesh.groups) names.push_back(g.name.c_str());
    for (const std::string &w : mesh.warnings) warnings += w + "\n";
    info.warnings = warnings.c_str();
  }

  static MeshObject &of(uint64_t handle) {
    MeshObject &object = resolve<MeshObject>(kKind, handle);
    return held(object, object.context);
  }

  // Moves the mesh into the context and returns its handle.
  static uint64_t keep(dfm_context &context, Mesh &&mesh) {
    return keep_live(context, kKind, std::make_unique<MeshObject>(context, std::move(mesh)), end);
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

inline void log_warnings(const dfm_context &context, const char *what,
                         const std::vector<std::string> &warnings) {
  for (const std::string &w : warnings) context.logf(DFM_LOG_WARNING, "%s: %s", what, w.c_str());
}

using TetMeshObject = MeshObject<TetMesh, Kind::tetmesh>;
using TriMeshObject = MeshObject<TriMesh, Kind::trimesh>;

}  // namespace dfm
