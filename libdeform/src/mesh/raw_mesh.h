// The result of a reader: points, tetrahedra and triangles in the file's order, not yet checked as geometry.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mesh/cursor.h"
#include "mesh/mesh.h"

namespace dfm {

inline constexpr uint32_t kMaxGroups = 1u << 16;  // of a file

struct RawMesh : RestMesh {
  explicit RawMesh(const Memory &m) : RestMesh(m) { cell = 0; }  // until the first one
  // share: how much of each tetrahedron is material, where the file says so of all; inside, of hexahedra,
  // likewise; else of no use (finish_mesh decides). tris: polygons are cut into triangles by the readers.
  // Points of groups: without those of tet_group, in file order, with repeats.
  bool own_corners = false;  // the format gives each triangle points of its own

  // Index of the group, made where it is new. tag 0 is "no group".
  uint32_t group(const Cursor &at, int32_t dimension, int32_t tag);
  bool has_group(int32_t dimension, int32_t tag) const { return group_index_.contains({dimension, tag}); }
  // The same where a file knows groups by name alone; they are numbered as they come. No name is "no group".
  uint32_t named_group(const Cursor &at, int32_t dimension, std::string_view name);

  void add_cell(const Cursor &at, uint32_t kind, const uint32_t *nodes, uint32_t in_group);
  // n >= 3 corners around a face, cut into n-2 triangles: a fan about the first (of four: about the least)
  // where none of them looks the other way, else ears. A fan always where a corner is not known yet, or there
  // are more than 512.
  void add_polygon(const Cursor &at, const uint32_t *corners, size_t n, uint32_t in_group);
  // Points of an element that is not kept itself; no group: nothing.
  void keep_points(const uint32_t *points_of, size_t n, uint32_t in_group) {
    if (in_group == kNoGroup) return;
    groups[in_group].points.insert(groups[in_group].points.end(), points_of, points_of + n);
  }
  // Corners, then the middles of the edges around, n = 6 or 8, then that of the face, n = 9: triangles as
  // those of a second-order cell.
  void add_second_order(const Cursor &at, const uint32_t *nodes, size_t n, uint32_t in_group);
  // Triangles (i, i+1, i+2), every second one turned.
  void add_strip(const Cursor &at, const uint32_t *corners, size_t n, uint32_t in_group);
  // Room for n more: readers that know a valid count call it once, and no array is grown by copying.
  void expect_tets(size_t n);

 private:
  void add_triangle(const Cursor &at, uint32_t a, uint32_t b, uint32_t c, uint32_t in_group);
  std::map<std::pair<int32_t, int32_t>, uint32_t> group_index_;
  std::map<std::pair<int32_t, std::string>, uint32_t> name_index_;
};
inline constexpr uint32_t kMaxTris = 1u << 30;

// The n corners of a face, from 0.
void read_corners(Cursor &in, Number type, uint64_t face, int64_t n, uint32_t npoint, Array<uint32_t> &out);

void read_msh(Cursor &in, RawMesh &out);
void read_vtk(Cursor &in, RawMesh &out);
void read_vtu(Cursor &in, RawMesh &out);
void read_medit(Cursor &in, RawMesh &out);
void read_abaqus(Cursor &in, RawMesh &out);
void read_tetgen(Cursor &in, RawMesh &out);
void read_netgen(Cursor &in, RawMesh &out);
void read_obj(Cursor &in, RawMesh &out);
void read_ply(Cursor &in, RawMesh &out);
void read_stl(Cursor &in, RawMesh &out);
void read_off(Cursor &in, RawMesh &out);

// Reads any format by file name ending and content; fills tets, tris or both. parse_raw: from
// bytes in memory.
RawMesh read_raw(const Memory &memory, const std::string &path);
RawMesh parse_raw(const Memory &memory, const std::string &path, const char *bytes, size_t size);

// What kind of mesh a file is, by its first bytes or the ending of its name ("STL"); empty: none is known.
std::string mesh_kind(const std::string &path, std::string_view bytes);

// Repairs what can be repaired, counts it, and refuses what has no volume.
RestMesh finish_mesh(const std::string &path, RawMesh &&raw);
// The same for the triangles (or, where the file has tetrahedra, their boundary): merge, drop, turn, count.
RestMesh finish_surface(const std::string &path, RawMesh &&raw);

}  // namespace dfm
