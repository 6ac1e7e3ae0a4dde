// Shared by legacy VTK and VTU: number types, cell types, and groups of cells, which both store as an integer
// array over the cells and, from our writer, names in the field data.
#pragma once
#include <string>
#include <vector>

#include "mesh/raw_mesh.h"

namespace dfm {

enum class VtkNumber : uint8_t { f32, f64, i8, u8, i16, u16, i32, u32, i64, u64, text, bit };

size_t vtk_bytes(VtkNumber type);  // 0 for text and bit
inline bool vtk_whole(VtkNumber type) {
  return vtk_bytes(type) && type != VtkNumber::f32 && type != VtkNumber::f64;
}
// The next number of a text or binary array; real() is finite.
double vtk_real(Cursor &in, VtkNumber type, const char *what);
int64_t vtk_integer(Cursor &in, VtkNumber type, const char *what);
std::string vtk_lower(std::string_view text);  // its first 64 characters

// Arrays over the cells that are taken for numbers of groups: ours and those of gmsh, meshio, medit and
// common meshers.
bool vtk_names_groups(std::string_view array);
inline constexpr const char *kVtkGroup = "group", *kVtkGroupNumber = "group_number",
                            *kVtkGroupName = "group_name";
// Real numbers over the cells by this name are the shares of a filled surface, as our writer leaves them.
inline constexpr const char *kVtkShare = "share";
inline bool vtk_names_share(std::string_view array, VtkNumber type) {
  return array == kVtkShare && (type == VtkNumber::f32 || type == VtkNumber::f64);
}

// Takes cells one by one: keeps tetrahedra and straight faces (cut into triangles), skips points and lines,
// refuses other volume cells, because a body must not lose parts silently.
class VtkCells {
 public:
  explicit VtkCells(RawMesh &out) : out_(out) {}
  // Corners are checked to be points of the file. `label`: the file's number of the group, 0 none.
  void add(const Cursor &in, uint8_t type, const uint32_t *corners, size_t n, int64_t label);
  void finish(const Cursor &in) const;
  // Names for groups by dimension and number, as our writer leaves them.
  void name_groups(const std::vector<int64_t> &numbers, const std::vector<std::string> &names);

 private:
  void keep_points(const uint32_t *corners, size_t n, uint32_t group);
  RawMesh &out_;
  size_t cell_ = 0;
  uint64_t curved_ = 0;
};

}  // namespace dfm
