// Meshes behind handles, with the arrays that the C API lends out.
#pragma once
#include <algorithm>
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

// The fields that dfm_tetmesh_info and dfm_trimesh_info share.
template <class Info, class Object>
void put_shared(Info &info, const Object &object) {
  const auto &s = object.statistics;
  info.npoint = s.npoint;
  info.nedge = s.nedge;
  info.npiece = s.npiece;
  info.ngroup = static_cast<uint32_t>(object.mesh.groups.size());
  info.turned = object.mesh.turned;
  info.dropped_points = object.mesh.dropped_points;
  info.nonmanifold_edges = s.nonmanifold_edges;
  info.volume = s.volume;
  info.edge_min = s.edge_min;
  info.edge_median = s.edge_median;
  info.edge_max = s.edge_max;
  info.quality_min = s.quality_min;
  info.quality_mean = s.quality_mean;
  std::copy_n(s.histogram, 10, info.quality_histogram);
  std::copy_n(s.lo, 3, info.lo);
  std::copy_n(s.hi, 3, info.hi);
  info.warnings = object.warnings.c_str();
}

using TetMeshObject = MeshObject<TetMesh, Kind::tetmesh>;
using TriMeshObject = MeshObject<TriMesh, Kind::trimesh>;

}  // namespace dfm
