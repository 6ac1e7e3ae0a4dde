// Mesh files of a scene, each read once; a body whose file is a surface, or which asks for other cells than
// its file's, gets them by filling that surface, or the boundary of those cells.
#pragma once
#include <deque>
#include <map>
#include <set>
#include <string>

#include "scene/select.h"
#include "scene/split.h"

namespace dfm::scene {

inline constexpr uint32_t kFillCells = 5000;  // if a scene gives no number
inline constexpr double kMaxLattice = 1e6;    // cells; dfm_mesh_lattice says the same
// As large as a hexahedron: the cubes that 12 of a body-centered lattice make.
inline constexpr double kTetsOfHexahedron = 12;

class MeshFiles {
 public:
  // Meshes that `known` has are taken from there; it outlives this.
  MeshFiles(dfm_context *context, const Definition &def, const MeshFiles *known = nullptr)
      : context_(context), def_(def), known_(known) {}
  ~MeshFiles();
  MeshFiles(const MeshFiles &) = delete;

  std::string path_of(const std::string &path) const;  // relative to the scene file
  // Cells, surface and groups of a body, scaled. Borrows from this object. `warn`: tells what was made of its
  // file.
  BodyMesh load(const Body &body, bool warn = false);
  const dfm_type &model(const Body &body);  // that it names, or that of its cells
  // Triangles of an obstacle of shape mesh or voxels into its def. `points` takes those that are scaled; the
  // rest is borrowed from this object.
  void load(Obstacle &obstacle, std::vector<double> &points);

 private:
  // The mesh of this key, made by the first call.
  template <class Make>
  dfm_mesh_handle once(const std::string &key, const std::string &pointer, Make &&make) {
    if (known_ && known_->has(key)) return known_->meshes_.at(key);
    dfm_mesh_handle &mesh = meshes_[key];
    if (!mesh) def_.require(make(&mesh), pointer);
    return mesh;
  }
  bool has(const std::string &key) const {
    const auto at = meshes_.find(key);
    return at != meshes_.end() && at->second;
  }
  dfm_mesh_info info_of(dfm_mesh_handle mesh, const std::string &pointer) const;
  // reads the file; else it has a surface alone
  bool has_cells(const std::string &path, const std::string &pointer);
  // gives the name under which `cells` knows it
  std::string make(const Body &body);
  std::string make_surface(const Body &body);  // the same for `surface`
  dfm_mesh_handle cells(const std::string &path, const std::string &pointer);
  dfm_mesh_handle surface(const std::string &path, const std::string &pointer);
  dfm_mesh_handle filling(const std::string &path, const Body &body, bool warn);
  dfm_mesh_handle lattice(const std::string &path, const Body &body);
  void check_keys(const Body &body, bool has_cells, bool renumbered) const;
  void take_cells(dfm_mesh_handle mesh, const Body &body, BodyMesh &out) const;
  void split_skin(BodyMesh &out);
  void warn_unit(const Body &b, const BodyMesh &mesh) const;
  void warn_voxel_steps(const Body &body, const BodyMesh &mesh) const;
  void take_skin(dfm_mesh_handle mesh, const Body &body, const std::string &pointer, BodyMesh &out) const;

  dfm_context *context_;
  const Definition &def_;
  const MeshFiles *known_;
  std::set<std::string> surface_only_;
  std::map<std::string, dfm_mesh_handle> meshes_;  // by what is made, and its file or name
  std::deque<Triangles> split_;                    // by body, lent to its BodyMesh
};

}  // namespace dfm::scene
