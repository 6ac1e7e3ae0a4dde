// What a reader hands over: points, tetrahedra and triangles in the file's order, not yet looked at as geometry.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mesh/cursor.h"
#include "mesh/mesh.h"
#include "mesh/tri_mesh.h"

namespace dfm {

struct RawMesh {
  explicit RawMesh(const Memory &m)
      : memory(&m), points(HookAllocator<double>(m)), tets(HookAllocator<uint32_t>(m)), tet_group(HookAllocator<uint32_t>(m)),
        tris(HookAllocator<uint32_t>(m)), tri_group(HookAllocator<uint32_t>(m)) {}
  const Memory *memory;
  Array<double> points;
  Array<uint32_t> tets;        // 0-based positions of points in the file
  Array<uint32_t> tet_group;   // index into groups
  Array<uint32_t> tris;        // polygons are cut into triangles by the readers
  Array<uint32_t> tri_group;   // index into groups, kNoGroup without
  std::vector<MeshGroup> groups;  // points: of elements below dimension 3 only, in file order, with repeats
  uint32_t npoint() const { return static_cast<uint32_t>(points.size() / 3); }

  // Index of the group, made where it is new. tag 0 is "no group".
  uint32_t group(const Cursor &at, int32_t dimension, int32_t tag);

 private:
  std::map<std::pair<int32_t, int32_t>, uint32_t> group_index_;
};

void read_msh(Cursor &in, RawMesh &out);
void read_vtk(Cursor &in, RawMesh &out);

void read_vtu(Cursor &in, RawMesh &out);
void read_medit(Cursor &in, RawMesh &out);
void read_obj(Cursor &in, RawMesh &out);
void read_ply(Cursor &in, RawMesh &out);
void read_stl(Cursor &in, RawMesh &out);
void read_off(Cursor &in, RawMesh &out);

// Reads any format by file name ending and content; fills tets, tris or both. parse_raw: from bytes in memory.
RawMesh read_raw(const Memory &memory, const std::string &path);
RawMesh parse_raw(const Memory &memory, const std::string &path, const char *bytes, size_t size);

// Repairs what can be repaired, counts it, and refuses what has no volume.
TetMesh finish_mesh(const std::string &path, RawMesh &&raw);
// The same for the triangles (or, where the file has tetrahedra, their boundary): merge, drop, turn, count.
TriMesh finish_surface(const std::string &path, RawMesh &&raw);

}  // namespace dfm
