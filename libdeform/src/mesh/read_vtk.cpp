// Legacy VTK files 2.0 to 5.1, UNSTRUCTURED_GRID, ASCII and binary (always big-endian). A line of header, a title, ASCII or BINARY, then
// sections by keyword. CELLS comes as "k i1 .. ik" rows (to 4.x) or, from 5.0 on, as OFFSETS and CONNECTIVITY arrays.
#include <algorithm>
#include <cctype>

#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

std::string lower(std::string_view text) {
  std::string out(text.substr(0, 64));
  for (char &c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

enum class Number { f32, f64, i8, u8, i16, u16, i32, u32, i64, u64, text, bit };

// VTK writes vtkIdType as int; long is that of the machine that wrote the file, 8 bytes on all that count today.
Number number_type(const Cursor &in, std::string_view name) {
  static const std::pair<const char *, Number> known[] = {
      {"float", Number::f32}, {"double", Number::f64}, {"int", Number::i32}, {"unsigned_int", Number::u32}, {"long", Number::i64},
      {"unsigned_long", Number::u64}, {"vtktypeint64", Number::i64}, {"vtktypeuint64", Number::u64}, {"vtktypeint32", Number::i32},
      {"vtkidtype", Number::i32}, {"short", Number::i16}, {"unsigned_short", Number::u16}, {"char", Number::i8},
      {"signed_char", Number::i8}, {"unsigned_char", Number::u8}, {"string", Number::text}, {"bit", Number::bit}};
  const std::string wanted = lower(name);
  for (const auto &[text, type] : known)
    if (wanted == text) return type;
  in.refuse("expected a number type (float, double, int, long, vtktypeint64 ...), found %s", Cursor::quote(name).c_str());
}

size_t number_bytes(Number type) {
  switch (type) {
    case Number::i8: case Number::u8: return 1;
    case Number::i16: case Number::u16: return 2;
    case Number::f32: case Number::i32: case Number::u32: return 4;
    case Number::f64: case Number::i64: case Number::u64: return 8;
    case Number::text: case Number::bit: break;
  }
  return 0;
}

class VtkReader {
 public:
  VtkReader(Cursor &in, RawMesh &out) : in_(in), out_(out), cells_(HookAllocator<uint32_t>(*out.memory)),
                                        start_(HookAllocator<uint32_t>(*out.memory)),
                                        types_(HookAllocator<uint8_t>(*out.memory)) {}

  void run() {
    header();
    bool points = false, cells = false, types = false;
    for (;;) {
      const std::string keyword = lower(in_.word());
      if (keyword == "points") once(points, "POINTS"), read_points();
      else if (keyword == "cells") {
        if (!points) in_.refuse("CELLS before POINTS; expected POINTS first");
        once(cells, "CELLS"), read_cells();
      } else if (keyword == "cell_types") {
        if (!cells) in_.refuse("CELL_TYPES before CELLS; expected CELLS first");
        once(types, "CELL_TYPES"), read_types();
      } else if (keyword == "field") skip_field();
      else if (keyword == "metadata") skip_metadata();
      else if (keyword == "point_data" || keyword == "cell_data" || keyword.empty()) break;  // attributes come last and are not used
      else in_.refuse("unknown keyword %s; expected POINTS, CELLS, CELL_TYPES, FIELD, METADATA, POINT_DATA or CELL_DATA",
          Cursor::quote(keyword).c_str());
    }
    if (!types) in_.refuse("no %s section; the file is truncated or holds no mesh", !points ? "POINTS" : !cells ? "CELLS" : "CELL_TYPES");
    collect();
  }

 private:
  void once(bool &seen, const char *keyword) {
    if (seen) in_.refuse("a second %s section; one mesh per file is read", keyword);
    seen = true;
  }

  void header() {
    const std::string_view first = in_.line();
    if (first.substr(0, 8) == "<VTKFile" || first.substr(0, 5) == "<?xml")
      in_.unsupported("this is an XML (VTU) file, not legacy VTK; reading VTU is not available yet, so save it as legacy VTK (for instance with meshio or ParaView)");
    constexpr std::string_view kMark = "# vtk DataFile Version ";
    if (first.substr(0, kMark.size()) != kMark)
      in_.seek(0), in_.refuse("expected '# vtk DataFile Version x.y' in the first line, found %s",
          Cursor::quote(first.empty() ? " " : first).c_str());
    double version = 0;
    const std::string_view number = first.substr(kMark.size());
    std::from_chars(number.data(), number.data() + number.size(), version);
    if (!(version >= 2.0 && version < 5.15))
      in_.seek(0), in_.unsupported("legacy VTK version %s; 2.0 to 5.1 are read", Cursor::quote(number.empty() ? " " : number).c_str());
    in_.line();  // title
    const std::string_view form = in_.word();
    const std::string kind = lower(form);
    if (kind != "ascii" && kind != "binary") in_.refuse("expected ASCII or BINARY, found %s", Cursor::quote(form).c_str());
    in_.expect("DATASET", "ASCII or BINARY");
    const std::string_view dataset = in_.word();
    if (lower(dataset) != "unstructured_grid")
      in_.unsupported("DATASET %s has no tetrahedra; expected UNSTRUCTURED_GRID", Cursor::quote(dataset).c_str());
    in_.binary = kind == "binary";
    in_.swap = std::endian::native == std::endian::little;
  }

  double real(Number type, const char *what) {
    if (!in_.binary) return in_.real(what);
    if (type == Number::f64) return in_.binary_real(what);
    if (type == Number::f32) {
      const float v = in_.value<float>(what);
      if (!std::isfinite(v)) in_.seek(in_.offset() - sizeof v), in_.refuse("%s is not a finite number", what);
      return v;
    }
    return static_cast<double>(integer(type, what));
  }

  int64_t integer(Number type, const char *what) {
    if (!in_.binary) return in_.integer(what);
    switch (type) {
      case Number::i8: return in_.value<int8_t>(what);
      case Number::u8: return in_.value<uint8_t>(what);
      case Number::i16: return in_.value<int16_t>(what);
      case Number::u16: return in_.value<uint16_t>(what);
      case Number::i32: return in_.value<int32_t>(what);
      case Number::u32: return in_.value<uint32_t>(what);
      case Number::i64: return in_.value<int64_t>(what);
      case Number::u64: return static_cast<int64_t>(in_.value<uint64_t>(what));  // above 2^63 reads as negative and is refused by range
      default: break;
    }
    in_.refuse("%s must be whole numbers", what);
  }

  // Bytes that one number takes at least in this file.
  size_t least(Number type) const { return in_.binary ? number_bytes(type) : 2; }
  // Text may end without a space after its last number.
  uint64_t count(int64_t claimed, size_t numbers_each, Number type, const char *what) const {
    const size_t bytes = numbers_each * least(type);
    if (!in_.binary && claimed > 0 && uint64_t(claimed) <= (in_.left() + 1) / bytes) return uint64_t(claimed);
    return in_.count(claimed, bytes, what);
  }
  uint32_t small_count(uint64_t n, const char *what) const {
    if (n >= UINT32_MAX) in_.unsupported("%llu %s; up to %u are read", ull(n), what, UINT32_MAX - 1);
    return uint32_t(n);
  }
  void begin_data(const char *after) {
    if (in_.binary) in_.end_line(after);
  }
  Number real_type(std::string_view name) {
    const Number type = number_type(in_, name);
    if (number_bytes(type) == 0) in_.refuse("POINTS of type %s; expected float or double", Cursor::quote(name).c_str());
    return type;
  }
  Number integer_type(std::string_view name) {
    const Number type = number_type(in_, name);
    if (number_bytes(type) == 0 || type == Number::f32 || type == Number::f64)
      in_.refuse("cells of type %s; expected a whole-number type such as vtktypeint64", Cursor::quote(name).c_str());
    return type;
  }

  void read_points() {
    const int64_t claimed = in_.integer("the number of points");
    const Number type = real_type(in_.word());
    begin_data("POINTS");
    const uint32_t n = small_count(count(claimed, 3, type, "points"), "points");
    out_.points.reserve(size_t(n) * 3);
    for (size_t i = 0; i < size_t(n) * 3; ++i) out_.points.push_back(real(type, "a point's coordinate"));
  }

  uint32_t corner(Number type) {
    const size_t at = in_.offset();
    const int64_t p = integer(type, "a cell's point number");
    if (p < 0 || p >= int64_t(out_.npoint())) {
      if (in_.binary) in_.seek(at);
      in_.refuse("a cell refers to point %lld; the file has points 0 to %lld", ll(p), ll(out_.npoint()) - 1);
    }
    return uint32_t(p);
  }

  void read_cells() {
    const int64_t first = in_.integer("the number of cells"), second = in_.integer("the size of the cell list");
    const size_t at = in_.offset();
    if (in_.binary) in_.end_line("CELLS");  // OFFSETS is text on a line of its own; old cell rows would be bytes here
    const bool arrays = lower(in_.word()) == "offsets";
    if (arrays) return read_cell_arrays(first, second);
    in_.seek(at);
    begin_data("CELLS");
    const uint64_t size = count(second, 1, Number::i32, "numbers in the cell list");
    if (first < 0 || uint64_t(first) > size) in_.refuse("CELLS promises %lld cells in a list of %lld numbers", ll(first), ll(second));
    const uint32_t ncell = small_count(uint64_t(first), "cells");
    small_count(size, "numbers in the cell list");
    start_.reserve(size_t(ncell) + 1), cells_.reserve(size - ncell);
    uint64_t used = 0;
    for (uint32_t c = 0; c < ncell; ++c) {
      const int64_t k = integer(Number::i32, "a cell's number of points");
      if (k < 0 || used + 1 + uint64_t(k) > size)
        in_.refuse("cell %u has %lld points; the list of %lld numbers that CELLS promises has no room for it", c, ll(k), ll(second));
      used += 1 + uint64_t(k);
      start_.push_back(uint32_t(cells_.size()));
      for (int64_t i = 0; i < k; ++i) cells_.push_back(corner(Number::i32));
    }
    if (used != size) in_.refuse("CELLS promises a list of %lld numbers, but its %u cells use %llu", ll(second), ncell, ull(used));
    start_.push_back(uint32_t(cells_.size()));
  }

  void read_cell_arrays(int64_t noffset, int64_t nconnectivity) {
    const Number offset_type = integer_type(in_.word());
    begin_data("OFFSETS");
    const uint32_t n = small_count(count(noffset, 1, offset_type, "cell offsets"), "cells");
    start_.reserve(n);
    for (uint32_t i = 0; i < n; ++i) {
      const int64_t v = integer(offset_type, "a cell offset");
      if (v < (i ? int64_t(start_.back()) : 0) || v > nconnectivity || (i == 0 && v != 0))
        in_.refuse("cell offset %lld; offsets start at 0 and rise to the %lld numbers of CONNECTIVITY", ll(v), ll(nconnectivity));
      start_.push_back(small_count(uint64_t(v), "numbers in the cell list"));
    }
    if (n ? int64_t(start_.back()) != nconnectivity : nconnectivity != 0)
      in_.refuse("the last cell offset must equal the %lld numbers of CONNECTIVITY", ll(nconnectivity));
    if (n == 0) start_.push_back(0);
    const std::string_view word = in_.word();
    if (lower(word) != "connectivity") in_.refuse("expected CONNECTIVITY after OFFSETS, found %s", Cursor::quote(word).c_str());
    const Number type = integer_type(in_.word());
    begin_data("CONNECTIVITY");
    const uint32_t m = small_count(count(nconnectivity, 1, type, "numbers in CONNECTIVITY"), "numbers in CONNECTIVITY");
    cells_.reserve(m);
    for (uint32_t i = 0; i < m; ++i) cells_.push_back(corner(type));
  }

  void read_types() {
    const int64_t claimed = in_.integer("the number of cell types");
    const size_t ncell = start_.size() - 1;
    if (claimed < 0 || uint64_t(claimed) != ncell)
      in_.refuse("CELL_TYPES promises %lld types, but CELLS has %zu cells", ll(claimed), ncell);
    begin_data("CELL_TYPES");
    types_.reserve(count(claimed, 1, Number::i32, "cell types"));
    for (size_t c = 0; c < ncell; ++c) {
      const int64_t type = integer(Number::i32, "a cell type");
      if (type < 0 || type > 255) in_.refuse("cell type %lld; expected 0 to 82 (10 is a tetrahedron)", ll(type));
      types_.push_back(static_cast<uint8_t>(type));
    }
  }

  // Tetrahedra are kept, cells below dimension 3 passed over, other volume cells refused: a body must not lose parts in silence.
  void collect() {
    size_t ntet = 0;
    for (size_t c = 0; c < types_.size(); ++c) {
      const uint32_t corners = start_[c + 1] - start_[c];
      switch (types_[c]) {
        case 10:
          if (corners != 4) in_.refuse("cell %zu is a tetrahedron (type 10) with %u points; expected 4", c, corners);
          ++ntet;
          break;
        case 24: case 71: case 78: case 79: case 80:
          in_.unsupported("cell %zu is a second- or higher-order tetrahedron (type %d); write first-order cells (for instance gmsh -order 1)", c, types_[c]);
        case 11: case 12: case 13: case 14: case 15: case 16: case 25: case 26: case 27: case 29: case 31: case 32: case 33:
        case 41: case 42: case 72: case 73: case 74:
          in_.unsupported("cell %zu is a volume cell of type %d (hexahedron, wedge, pyramid or polyhedron); only tetrahedra (type 10) are read: mesh the shape with tetrahedra", c, types_[c]);
        default: break;
      }
    }
    if (ntet >= kMaxTets) in_.unsupported("%zu tetrahedra; fewer than %u are read", ntet, kMaxTets);
    out_.tets.reserve(4 * ntet);
    for (size_t c = 0; c < types_.size(); ++c)
      if (types_[c] == 10) out_.tets.insert(out_.tets.end(), cells_.begin() + start_[c], cells_.begin() + start_[c] + 4);
    out_.tet_group.assign(ntet, kNoGroup);
  }

  // "FIELD name n", then n arrays "name components tuples type" and their values.
  void skip_field() {
    in_.word();
    const int64_t arrays = in_.integer("the number of arrays in FIELD");
    for (int64_t a = 0; a < arrays; ++a) {
      const size_t at = in_.offset();
      std::string_view name = in_.word();
      if (lower(name) == "metadata") { skip_metadata(); --a; continue; }
      if (name.empty()) in_.seek(at), in_.refuse("the file ends inside a FIELD that promises %lld arrays", ll(arrays));
      const int64_t width = in_.integer("an array's number of components"), tuples = in_.integer("an array's number of tuples");
      const Number type = number_type(in_, in_.word());
      if (width < 0 || tuples < 0 || (width && tuples > INT64_MAX / width))
        in_.refuse("a FIELD array of %lld x %lld values", ll(width), ll(tuples));
      skip_values(type, width * tuples);
    }
  }

  void skip_values(Number type, int64_t n) {
    if (type == Number::text) {
      in_.line();
      for (int64_t i = 0; i < n; ++i) {
        if (in_.left() == 0) in_.refuse("the file ends inside a FIELD of strings");
        if (in_.binary) in_.skip(string_bytes(), "a FIELD string");
        else in_.line();
      }
    } else if (in_.binary) {
      in_.end_line("an array's type");
      if (type == Number::bit) in_.skip(size_t((uint64_t(n) + 7) / 8), "a FIELD array");
      else in_.skip(in_.count(n, number_bytes(type), "values") * number_bytes(type), "a FIELD array");
    } else {
      for (int64_t i = 0; i < n; ++i)
        if (in_.word().empty()) in_.refuse("the file ends inside a FIELD array of %lld values", ll(n));
    }
  }

  // The two top bits of the first byte tell whether the length takes 1, 2, 4 or 8 bytes.
  size_t string_bytes() {
    const unsigned first = in_.value<uint8_t>("a string's length");
    const int more = first >> 6 == 3 ? 0 : first >> 6 == 2 ? 1 : first >> 6 == 1 ? 3 : 7;
    uint64_t length = first & 63;
    for (int i = 0; i < more; ++i) length = length << 8 | in_.value<uint8_t>("a string's length");
    return size_t(length);
  }

  // Up to the next blank line.
  void skip_metadata() {
    in_.line();
    while (in_.left() && in_.line().find_first_not_of(" \t") != std::string_view::npos) {}
  }

  Cursor &in_;
  RawMesh &out_;
  Array<uint32_t> cells_, start_;  // corners end to end; first corner of each cell, and the end
  Array<uint8_t> types_;
};

}  // namespace

void read_vtk(Cursor &in, RawMesh &out) { VtkReader(in, out).run(); }

}  // namespace dfm
