// Shared by legacy VTK and VTU: number types, cell types, and groups of cells, which both store as an integer
// array over the cells and, from our writer, names in the field data.
#pragma once
#include <string>
#include <vector>

#include "mesh/raw_mesh.h"

namespace dfm {

std::string vtk_lower(std::string_view text);  // its first 64 characters

// Arrays over the cells that are taken for numbers of groups: ours and those of gmsh, meshio, medit and
// common meshers.
bool vtk_names_groups(std::string_view array);
inline constexpr const char *kVtkGroup = "group", *kVtkGroupNumber = "group_number",
                            *kVtkGroupName = "group_name";
// Real numbers over the cells by this name are the shares of a filled surface, as our writer leaves them.
inline constexpr const char *kVtkShare = "share";
inline constexpr const char *kVtkInside = "inside";  // of a lattice, mesh/cells.h
inline bool vtk_names_share(std::string_view array, Number type) {
  return array == kVtkShare && is_real(type);
}

// Takes cells one by one: keeps those of a body, and straight faces and six-point triangles (cut into
// triangles), skips points and lines, refuses other volume cells: a body must not lose parts silently.
class VtkCells {
 public:
  explicit VtkCells(RawMesh &out) : out_(out) {}
  // Corners are checked to be points of the file. `label`: the file's number of the group, 0 none.
  void add(const Cursor &in, uint8_t type, const uint32_t *corners, size_t n, int64_t label);
  void finish(const Cursor &in);

  // Names for groups, as our writer leaves them: pairs of dimension and number, and names whose letters are
  // each followed by a zero, or whole. Those beyond the number of groups that a file may have name none.
  void add_number(int64_t number) {
    if (numbers_.size() < 2 * kMaxGroups) numbers_.push_back(number);
  }
  void add_letter(int64_t letter);
  void add_name(std::string_view name) {
    if (names_.size() < kMaxGroups) names_.emplace_back(name);
  }

 private:
  RawMesh &out_;
  size_t cell_ = 0;
  uint64_t curved_ = 0;
  std::string name_;
  std::vector<std::string> names_;
  std::vector<int64_t> numbers_;
};

}  // namespace dfm
