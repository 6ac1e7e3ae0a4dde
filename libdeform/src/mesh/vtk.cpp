#include "mesh/vtk.h"

#include <algorithm>
#include <cctype>

namespace dfm {

std::string vtk_lower(std::string_view text) {
  std::string out(text.substr(0, 64));
  for (char &c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

size_t vtk_bytes(VtkNumber type) {
  switch (type) {
    case VtkNumber::i8:
    case VtkNumber::u8: return 1;
    case VtkNumber::i16:
    case VtkNumber::u16: return 2;
    case VtkNumber::f32:
    case VtkNumber::i32:
    case VtkNumber::u32: return 4;
    case VtkNumber::f64:
    case VtkNumber::i64:
    case VtkNumber::u64: return 8;
    case VtkNumber::text:
    case VtkNumber::bit: break;
  }
  return 0;
}

double vtk_real(Cursor &in, VtkNumber type, const char *what) {
  if (!in.binary) return in.real(what);
  if (type == VtkNumber::f64) return in.binary_real(what);
  if (type == VtkNumber::f32) return in.binary_real<float>(what);
  return static_cast<double>(vtk_integer(in, type, what));
}

int64_t vtk_integer(Cursor &in, VtkNumber type, const char *what) {
  if (!in.binary) return in.integer(what);
  switch (type) {
    case VtkNumber::i8: return in.value<int8_t>(what);
    case VtkNumber::u8: return in.value<uint8_t>(what);
    case VtkNumber::i16: return in.value<int16_t>(what);
    case VtkNumber::u16: return in.value<uint16_t>(what);
    case VtkNumber::i32: return in.value<int32_t>(what);
    case VtkNumber::u32: return in.value<uint32_t>(what);
    case VtkNumber::i64: return in.value<int64_t>(what);
    // above 2^63 reads as negative and is refused by range
    case VtkNumber::u64: return static_cast<int64_t>(in.value<uint64_t>(what));
    default: break;
  }
  in.refuse("%s must be whole numbers", what);
}

bool vtk_names_groups(std::string_view array) {
  static const char *const known[] = {kVtkGroup,  "gmsh:physical", "medit:ref",   "cellentityids",
                                      "material", "materialids",   "material_id", "physical"};
  const std::string name = vtk_lower(array);
  return std::any_of(std::begin(known), std::end(known), [&](const char *k) { return name == k; });
}

void VtkCells::add(const Cursor &in, uint8_t type, const uint32_t *corners, size_t n, int64_t label) {
  const size_t cell = cell_++;
  const auto group = [&](int32_t dimension) {
    return label >= INT32_MIN && label <= int64_t(UINT32_MAX)
               ? out_.group(in, dimension, static_cast<int32_t>(label))
               : kNoGroup;
  };
  const auto face = [&](size_t expected) {
    if (expected ? n != expected : n < 3)
      in.refuse("cell %zu (type %d) has %zu points; expected %zu%s", cell, type, n, expected ? expected : 3,
                expected ? "" : " or more");
  };
  switch (type) {
    case 10:
      if (n != 4) in.refuse("cell %zu is a tetrahedron (type 10) with %zu points; expected 4", cell, n);
      return out_.add_tet(in, corners, group(3));
    case 5: face(3); return out_.add_polygon(in, corners, n, group(2));
    case 9: face(4); return out_.add_polygon(in, corners, n, group(2));
    case 7: face(0); return out_.add_polygon(in, corners, n, group(2));
    case 6: face(0); return out_.add_strip(in, corners, n, group(2));
    case 8: {
      face(4);
      // a pixel's corners go row by row
      const uint32_t around[4] = {corners[0], corners[1], corners[3], corners[2]};
      return out_.add_polygon(in, around, 4, group(2));
    }
    case 22:
    case 23:
    case 28:
    case 30:
    case 34:
    case 36:
    case 69:
    case 70:
    case 76:
    case 77: ++curved_; return;
    case 24:
    case 71:
    case 78:
    case 79:
    case 80:
      in.unsupported(
          "cell %zu is a second- or higher-order tetrahedron (type %d); write first-order cells (for "
          "instance gmsh -order 1)",
          cell, type);
    case 11:
    case 12:
    case 13:
    case 14:
    case 15:
    case 16:
    case 25:
    case 26:
    case 27:
    case 29:
    case 31:
    case 32:
    case 33:
    case 37:
    case 41:
    case 42:
    case 72:
    case 73:
    case 74:
      in.unsupported(
          "cell %zu is a volume cell of type %d (hexahedron, wedge, pyramid or polyhedron); only tetrahedra "
          "(type 10) are read: mesh the shape with tetrahedra",
          cell, type);
    case 1:
    case 2: return keep_points(corners, n, group(0));
    case 3:
    case 4: return keep_points(corners, n, group(1));
    default: return;
  }
}

void VtkCells::keep_points(const uint32_t *corners, size_t n, uint32_t group) {
  if (group != kNoGroup)
    out_.groups[group].points.insert(out_.groups[group].points.end(), corners, corners + n);
}

void VtkCells::finish(const Cursor &in) const {
  if (curved_ && out_.tets.empty() && out_.tris.empty())
    in.unsupported(
        "%llu second- or higher-order faces and nothing straight; write first-order cells (for instance gmsh "
        "-order 1)",
        ull(curved_));
}

void VtkCells::name_groups(const std::vector<int64_t> &numbers, const std::vector<std::string> &names) {
  for (MeshGroup &g : out_.groups)
    for (size_t k = 0; k < names.size() && 2 * k + 1 < numbers.size(); ++k)
      if (numbers[2 * k] == g.dimension && numbers[2 * k + 1] == g.tag && !names[k].empty())
        g.name = names[k];
}

}  // namespace dfm
