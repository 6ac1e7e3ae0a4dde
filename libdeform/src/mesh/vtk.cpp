#include "mesh/vtk.h"

#include <algorithm>
#include <utility>

#include "core/names.h"
#include "deform/plugin.h"
#include "mesh/cells.h"

namespace dfm {

std::string vtk_lower(std::string_view text) { return lower(text.substr(0, 64)); }

bool vtk_names_groups(std::string_view array) {
  static const char *const known[] = {kVtkGroup,  "gmsh:physical", "medit:ref",   "cellentityids",
                                      "material", "materialids",   "material_id", "physical"};
  const std::string name = vtk_lower(array);
  return std::any_of(std::begin(known), std::end(known), [&](const char *k) { return name == k; });
}

void VtkCells::add(const Cursor &in, uint8_t type, const uint32_t *corners, size_t n, int64_t label) {
  const size_t cell = cell_++;
  const auto is_one_of = [type](std::initializer_list<uint8_t> types) {
    return std::find(types.begin(), types.end(), type) != types.end();
  };
  const auto group = [&](int32_t dimension) {
    return label >= INT32_MIN && label <= int64_t(UINT32_MAX)
               ? out_.group(in, dimension, static_cast<int32_t>(label))
               : kNoGroup;
  };
  for (const CellKind &of : cell_kinds()) {
    if (of.vtk != type) continue;
    if (n != of.nodes)
      in.refuse("cell %zu is of type %d, %s, with %zu points; expected %u", cell, type, of.name, n, of.nodes);
    return out_.add_cell(in, of.kind, corners, group(3));
  }
  // triangle, strip, polygon, pixel, quadrangle, and of second order: triangle, quadrangle of 8 and 9 points
  if (is_one_of({5, 6, 7, 8, 9, 22, 23, 28})) {
    const size_t expected = type == 5    ? 3
                            : type == 22 ? 6
                            : type == 23 ? 8
                            : type == 28 ? 9
                            : type >= 8  ? 4
                                         : 0;
    if (expected ? n != expected : n < 3)
      in.refuse("cell %zu (type %d) has %zu points; expected %zu%s", cell, type, n, expected ? expected : 3,
                expected ? "" : " or more");
    if (type >= 22) return out_.add_second_order(in, corners, n, group(2));
    if (type == 6) return out_.add_strip(in, corners, n, group(2));
    if (type != 8) return out_.add_polygon(in, corners, n, group(2));
    // a pixel's corners go row by row
    const uint32_t around[4] = {corners[0], corners[1], corners[3], corners[2]};
    return out_.add_polygon(in, around, 4, group(2));
  }
  if (is_one_of({1, 2, 3, 4})) return out_.keep_points(corners, n, group(type > 2));  // points, lines
  curved_ += is_one_of({30, 34, 36, 69, 70, 76, 77});
  if (is_one_of({64, 71, 78}))
    in.unsupported(
        "cell %zu is a tetrahedron above second order (type %d); write cells of first or second order (for "
        "instance gmsh -order 2)",
        cell, type);
  if (is_one_of({11, 13, 14, 15, 16, 26, 27, 31, 32, 33, 37, 41, 42, 65, 66, 67, 72, 73, 74, 79, 80, 81}))
    in.unsupported(
        "cell %zu is a volume cell of type %d (voxel, wedge, pyramid, polyhedron, or a hexahedron above "
        "second order); tetrahedra (types 10 and 24) and hexahedra (12, 25 and 29) are read: mesh the shape "
        "with these",
        cell, type);
}

void VtkCells::finish(const Cursor &in) {
  if (curved_ && out_.tets.empty() && out_.tris.empty())
    in.unsupported(
        "%llu second- or higher-order faces and nothing straight; write first-order cells (for instance gmsh "
        "-order 1)",
        ull(curved_));
  for (size_t k = 0; k < names_.size() && 2 * k + 1 < numbers_.size(); ++k) {
    const int64_t dimension = numbers_[2 * k], tag = numbers_[2 * k + 1];
    if (names_[k].empty() || dimension != int32_t(dimension) || tag != int32_t(tag)) continue;
    if (out_.has_group(int32_t(dimension), int32_t(tag)))
      out_.groups[out_.group(in, int32_t(dimension), int32_t(tag))].name = names_[k];
  }
}

void VtkCells::add_letter(int64_t letter) {
  if (letter) name_ += static_cast<char>(letter);
  else add_name(std::exchange(name_, {}));
}

}  // namespace dfm
