// What a reader hands over: points and tetrahedra in the file's order, not yet looked at as geometry.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mesh/cursor.h"
#include "mesh/mesh.h"

namespace dfm {

struct RawMesh {
  explicit RawMesh(const Memory &m)
      : memory(&m), points(HookAllocator<double>(m)), tets(HookAllocator<uint32_t>(m)), tet_group(HookAllocator<uint32_t>(m)) {}
  const Memory *memory;
  Array<double> points;
  Array<uint32_t> tets;        // 0-based positions of points in the file
  Array<uint32_t> tet_group;   // index into groups
  std::vector<MeshGroup> groups;  // points: of elements below dimension 3 only, in file order, with repeats
  uint32_t npoint() const { return static_cast<uint32_t>(points.size() / 3); }

  // Index of the group, made where it is new. tag 0 is "no group".
  uint32_t group(const Cursor &at, int32_t dimension, int32_t tag);

 private:
  std::map<std::pair<int32_t, int32_t>, uint32_t> group_index_;
};

void read_msh(Cursor &in, RawMesh &out);
void read_vtk(Cursor &in, RawMesh &out);

// Repairs what can be repaired, counts it, and refuses what has no volume.
TetMesh finish_mesh(const std::string &path, RawMesh &&raw);

}  // namespace dfm
