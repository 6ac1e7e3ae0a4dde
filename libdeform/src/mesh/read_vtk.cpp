// Legacy VTK files 2.0 to 5.1, UNSTRUCTURED_GRID and POLYDATA, ASCII and binary (always big-endian). A line
// of header, a title, ASCII or BINARY, then sections by keyword. Cells come as "k i1 .. ik" rows (to 4.x) or,
// from 5.0 on, as OFFSETS and CONNECTIVITY arrays. Of the attributes behind them only an array that numbers
// groups and one of shares are kept.
#include <algorithm>
#include <bit>
#include <cctype>
#include <utility>

#include "mesh/vtk.h"

namespace dfm {
namespace {

// VTK writes vtkIdType as int; long is that of the machine that wrote the file, 8 bytes on all
// that count today.
Number number_type(const Cursor &in, std::string_view name) {
  static const std::pair<const char *, Number> known[] = {
      {"float", Number::f32},        {"double", Number::f64},
      {"int", Number::i32},          {"unsigned_int", Number::u32},
      {"long", Number::i64},         {"unsigned_long", Number::u64},
      {"vtktypeint64", Number::i64}, {"vtktypeuint64", Number::u64},
      {"vtktypeint32", Number::i32}, {"vtkidtype", Number::i32},
      {"short", Number::i16},        {"unsigned_short", Number::u16},
      {"char", Number::i8},          {"signed_char", Number::i8},
      {"unsigned_char", Number::u8}, {"string", Number::text},
      {"bit", Number::bit}};
  const std::string wanted = vtk_lower(name);
  for (const auto &[text, type] : known)
    if (wanted == text) return type;
  in.refuse("expected a number type (float, double, int, long, vtktypeint64 ...), found %s",
            Cursor::quote(name).c_str());
}

class VtkReader {
 public:
  VtkReader(Cursor &in, RawMesh &out) : in_(in), out_(out), sink_(out) {
    use_memory(*out.memory, cells_, start_, types_, labels_, shares_);
  }

  void run() {
    header();
    bool points = false, types = false, any = false;
    for (;;) {
      const std::string keyword = vtk_lower(in_.word());
      if (keyword == "points") {
        once(points, "POINTS");
        read_points();
      } else if (const uint8_t face = face_type(keyword); face && polydata_) {
        cells_after(points, any, keyword);
        read_cells(face);
      } else if (keyword == "cells" && !polydata_) {
        if (any) in_.refuse("a second CELLS section; one mesh per file is read");
        cells_after(points, any, keyword);
        read_cells(0);
      } else if (keyword == "cell_types" && !polydata_) {
        if (!any) in_.refuse("CELL_TYPES before CELLS; expected CELLS first");
        once(types, "CELL_TYPES");
        read_types();
      } else if (keyword == "field") {
        read_field(nullptr);
      } else if (keyword == "metadata") {
        skip_metadata();
      } else if (keyword == "point_data" || keyword == "cell_data") {
        read_attributes(keyword == "cell_data");
        break;
      } else if (keyword.empty()) break;
      else
        in_.refuse("unknown keyword %s; expected POINTS, %s, FIELD, METADATA, POINT_DATA or CELL_DATA",
                   Cursor::quote(keyword).c_str(),
                   polydata_ ? "VERTICES, LINES, POLYGONS, TRIANGLE_STRIPS" : "CELLS, CELL_TYPES");
    }
    const char *const missing = !points                ? "POINTS"
                                : !any                 ? (polydata_ ? "POLYGONS" : "CELLS")
                                : !types && !polydata_ ? "CELL_TYPES"
                                                       : nullptr;
    if (missing) in_.refuse("no %s section; the file is truncated or holds no mesh", missing);
    collect();
  }

 private:
  // The cell type that a section of POLYDATA holds; 0: no such section.
  static uint8_t face_type(const std::string &keyword) {
    return keyword == "vertices"          ? 2
           : keyword == "lines"           ? 4
           : keyword == "polygons"        ? 7
           : keyword == "triangle_strips" ? 6
                                          : 0;
  }
  void cells_after(bool points, bool &any, const std::string &keyword) {
    std::string name = keyword;
    for (char &c : name) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    if (!points) in_.refuse("%s before POINTS; expected POINTS first", name.c_str());
    any = true;
  }
  void once(bool &seen, const char *keyword) {
    if (seen) in_.refuse("a second %s section; one mesh per file is read", keyword);
    seen = true;
  }

  void header() {
    const std::string_view first = in_.line();
    constexpr std::string_view kMark = "# vtk DataFile Version ";
    if (first.substr(0, kMark.size()) != kMark) {
      in_.seek(0);
      in_.refuse("expected '# vtk DataFile Version x.y' in the first line, found %s",
                 Cursor::quote(first.empty() ? " " : first).c_str());
    }
    double version = 0;
    const std::string_view number = first.substr(kMark.size());
    std::from_chars(number.data(), number.data() + number.size(), version);
    if (!(version >= 2.0 && version < 5.15)) {
      in_.seek(0);
      in_.unsupported("legacy VTK version %s; 2.0 to 5.1 are read",
                      Cursor::quote(number.empty() ? " " : number).c_str());
    }
    in_.line();  // title
    const std::string_view form = in_.word();
    const std::string kind = vtk_lower(form);
    if (kind != "ascii" && kind != "binary")
      in_.refuse("expected ASCII or BINARY, found %s", Cursor::quote(form).c_str());
    const std::string_view keyword = in_.word();
    if (!Cursor::is_word(keyword, "dataset"))
      in_.refuse("expected DATASET after ASCII or BINARY, found %s", Cursor::quote(keyword).c_str());
    const std::string_view dataset = in_.word();
    polydata_ = vtk_lower(dataset) == "polydata";
    if (!polydata_ && vtk_lower(dataset) != "unstructured_grid")
      in_.unsupported("DATASET %s has no tetrahedra and no triangles; expected UNSTRUCTURED_GRID or POLYDATA",
                      Cursor::quote(dataset).c_str());
    in_.binary = kind == "binary";
    in_.swap = std::endian::native == std::endian::little;
  }

  Number real_type(std::string_view name) {
    const Number type = number_type(in_, name);
    if (bytes_of(type) == 0)
      in_.refuse("POINTS of type %s; expected float or double", Cursor::quote(name).c_str());
    return type;
  }
  Number integer_type(std::string_view name) {
    const Number type = number_type(in_, name);
    if (!is_whole(type))
      in_.refuse("cells of type %s; expected a whole-number type such as vtktypeint64",
                 Cursor::quote(name).c_str());
    return type;
  }

  void read_points() {
    const int64_t claimed = in_.integer("the number of points");
    const Number type = real_type(in_.word());
    in_.begin_data("POINTS");
    const uint32_t n = in_.small(in_.count(claimed, 3, type, "points"), "points");
    out_.points.reserve(size_t(n) * 3);
    for (size_t i = 0; i < size_t(n) * 3; ++i) out_.points.push_back(in_.real(type, "a point's coordinate"));
  }

  uint32_t corner(Number type) {
    const size_t at = in_.offset();
    const int64_t p = in_.integer(type, "a cell's point number");
    if (p < 0 || p >= int64_t(out_.npoint())) {
      if (in_.binary) in_.seek(at);
      in_.refuse("a cell refers to point %lld; the file has points 0 to %lld", ll(p), ll(out_.npoint()) - 1);
    }
    return uint32_t(p);
  }

  // Appends to the cells; type 0: given later by CELL_TYPES.
  void read_cells(uint8_t type) {
    if (!start_.empty()) start_.pop_back();
    read_rows();
    if (type) types_.resize(start_.size() - 1, type);
  }

  void read_rows() {
    const int64_t first = in_.integer("the number of cells");
    const int64_t second = in_.integer("the size of the cell list");
    const size_t at = in_.offset();
    // OFFSETS is text on a line of its own; old cell rows would be bytes here
    if (in_.binary) in_.end_line("CELLS");
    const bool arrays = vtk_lower(in_.word()) == "offsets";
    if (arrays) return read_cell_arrays(first, second);
    in_.seek(at);
    in_.begin_data("CELLS");
    const uint64_t size = in_.count(second, 1, Number::i32, "numbers in the cell list");
    if (first < 0 || uint64_t(first) > size)
      in_.refuse("CELLS promises %lld cells in a list of %lld numbers", ll(first), ll(second));
    const uint32_t ncell = in_.small(uint64_t(first), "cells");
    in_.small(size, "numbers in the cell list");
    in_.small(cells_.size() + size, "numbers in the cell lists");
    start_.reserve(start_.size() + ncell + 1);
    cells_.reserve(cells_.size() + (size - ncell));
    uint64_t used = 0;
    for (uint32_t c = 0; c < ncell; ++c) {
      const int64_t k = in_.integer(Number::i32, "a cell's number of points");
      if (k < 0 || used + 1 + uint64_t(k) > size)
        in_.refuse("cell %u has %lld points; the list of %lld numbers that CELLS promises has no room for it",
                   c, ll(k), ll(second));
      used += 1 + uint64_t(k);
      start_.push_back(uint32_t(cells_.size()));
      for (int64_t i = 0; i < k; ++i) cells_.push_back(corner(Number::i32));
    }
    if (used != size)
      in_.refuse("CELLS promises a list of %lld numbers, but its %u cells use %llu", ll(second), ncell,
                 ull(used));
    start_.push_back(uint32_t(cells_.size()));
  }

  void read_cell_arrays(int64_t noffset, int64_t nconnectivity) {
    const Number offset_type = integer_type(in_.word());
    in_.begin_data("OFFSETS");
    const uint32_t n = in_.small(in_.count(noffset, 1, offset_type, "cell offsets"), "cells");
    const size_t base = cells_.size();
    start_.reserve(start_.size() + n + 1);
    int64_t last = 0;
    for (uint32_t i = 0; i < n; ++i) {
      const int64_t v = in_.integer(offset_type, "a cell offset");
      if (v < last || v > nconnectivity || (i == 0 && v != 0))
        in_.refuse("cell offset %lld; offsets start at 0 and rise to the %lld numbers of CONNECTIVITY", ll(v),
                   ll(nconnectivity));
      start_.push_back(in_.small(base + uint64_t(v), "numbers in the cell lists"));
      last = v;
    }
    if (last != nconnectivity)
      in_.refuse("the last cell offset must equal the %lld numbers of CONNECTIVITY", ll(nconnectivity));
    if (n == 0) start_.push_back(in_.small(base, "numbers in the cell lists"));
    const std::string_view word = in_.word();
    if (vtk_lower(word) != "connectivity")
      in_.refuse("expected CONNECTIVITY after OFFSETS, found %s", Cursor::quote(word).c_str());
    const Number type = integer_type(in_.word());
    in_.begin_data("CONNECTIVITY");
    const uint32_t m =
        in_.small(in_.count(nconnectivity, 1, type, "numbers in CONNECTIVITY"), "numbers in CONNECTIVITY");
    cells_.reserve(base + m);
    for (uint32_t i = 0; i < m; ++i) cells_.push_back(corner(type));
  }

  void read_types() {
    const int64_t claimed = in_.integer("the number of cell types");
    const size_t ncell = start_.size() - 1;
    if (claimed < 0 || uint64_t(claimed) != ncell)
      in_.refuse("CELL_TYPES promises %lld types, but CELLS has %zu cells", ll(claimed), ncell);
    in_.begin_data("CELL_TYPES");
    types_.reserve(in_.count(claimed, 1, Number::i32, "cell types"));
    for (size_t c = 0; c < ncell; ++c) {
      const int64_t type = in_.integer(Number::i32, "a cell type");
      if (type < 0 || type > 255)
        in_.refuse("cell type %lld; expected 0 to 82 (10 is a tetrahedron)", ll(type));
      types_.push_back(static_cast<uint8_t>(type));
    }
  }

  void collect() {
    const auto ntet = std::count(types_.begin(), types_.end(), 10);
    out_.expect_tets(size_t(ntet));
    if (labels_.size() != types_.size()) labels_.clear();
    for (size_t c = 0; c < types_.size(); ++c)
      sink_.add(in_, types_[c], cells_.data() + start_[c], start_[c + 1] - start_[c],
                labels_.empty() ? 0 : labels_[c]);
    for (size_t c = 0; shares_.size() == types_.size() && c < types_.size(); ++c)
      if (types_[c] == 10) out_.share.push_back(shares_[c]);
    sink_.finish(in_);
  }

  // "name type [components]", "LOOKUP_TABLE name", or "name components tuples type" in a FIELD; then the
  // values. Attributes are skipped, except those of cells that contain group numbers or shares. What
  // comes behind an unknown keyword is left unread.
  void read_attributes(bool of_cells) {
    int64_t n = in_.integer("the number of tuples");
    for (;;) {
      const std::string keyword = vtk_lower(in_.word());
      if (keyword == "point_data" || keyword == "cell_data") {
        of_cells = keyword == "cell_data";
        n = in_.integer("the number of tuples");
      } else if (keyword == "field") {
        read_field(of_cells ? &n : nullptr);
      } else if (keyword == "metadata") {
        skip_metadata();
      } else if (keyword == "scalars") {
        read_scalars(of_cells, n);
      } else if (keyword == "color_scalars" || keyword == "lookup_table") {
        in_.word();
        const int64_t k = in_.integer("a number of colors");
        skip_values(in_.binary ? Number::u8 : Number::f32,
                    keyword == "lookup_table" ? product(4, k) : product(k, n));
      } else if (const int64_t width = attribute_width(keyword)) {
        in_.word();
        const int64_t components = width < 0 ? in_.integer("a number of components") : width;
        skip_values(number_type(in_, in_.word()), product(components, n));
      } else {
        return;
      }
    }
  }

  static int64_t attribute_width(const std::string &keyword) {  // -1: the file says
    if (keyword == "vectors" || keyword == "normals") return 3;
    if (keyword == "tensors") return 9;
    if (keyword == "tensors6") return 6;
    if (keyword == "texture_coordinates") return -1;
    return keyword == "global_ids" || keyword == "pedigree_ids" || keyword == "edge_flags" ? 1 : 0;
  }

  int64_t product(int64_t a, int64_t b) const {
    if (a < 0 || b < 0 || (a && b > INT64_MAX / a))
      in_.refuse("an array of %lld x %lld values", ll(a), ll(b));
    return a * b;
  }

  void read_scalars(bool of_cells, int64_t n) {
    const std::string_view name = in_.word();
    const Number type = number_type(in_, in_.word());
    const std::string_view given = in_.line_word();
    const int64_t width = given.empty() ? 1 : in_.to_integer(given, "a number of components");
    const size_t at = in_.offset();
    if (vtk_lower(in_.word()) == "lookup_table") in_.word();
    else in_.seek(at);
    keep_or_skip(of_cells && width == 1, name, type, product(width, n));
  }

  void keep_or_skip(bool candidate, std::string_view name, Number type, int64_t n) {
    if (candidate && shares_.empty() && vtk_names_share(name, type)) {
      in_.begin_data("an array's type");
      const uint64_t m = in_.count(n, 1, type, "shares");
      shares_.reserve(m);
      for (uint64_t i = 0; i < m; ++i) shares_.push_back(in_.real(type, "a cell's share"));
      return;
    }
    if (!candidate || !is_whole(type) || !labels_.empty() || !vtk_names_groups(name))
      return skip_values(type, n);
    read_whole(n, type, "numbers of groups", "a group's number", [&](int64_t v) {
      labels_.push_back(v >= INT32_MIN && v <= int64_t(UINT32_MAX) ? static_cast<int32_t>(v) : 0);
    });
  }

  // The n numbers of an array, whose type has just been read.
  template <class Keep>
  void read_whole(int64_t n, Number type, const char *all, const char *one, const Keep &keep) {
    in_.begin_data("an array's type");
    const uint64_t m = in_.count(n, 1, type, all);
    for (uint64_t i = 0; i < m; ++i) keep(in_.integer(type, one));
  }

  // "FIELD name n", then n arrays "name components tuples type" and their values. n_cells: where the field is
  // over the cells.
  void read_field(const int64_t *n_cells) {
    in_.word();
    const int64_t arrays = in_.integer("the number of arrays in FIELD");
    for (int64_t a = 0; a < arrays; ++a) {
      const size_t at = in_.offset();
      const std::string_view name = in_.word();
      if (vtk_lower(name) == "metadata") {
        skip_metadata();
        --a;
        continue;
      }
      if (name.empty()) {
        in_.seek(at);
        in_.refuse("the file ends inside a FIELD that promises %lld arrays", ll(arrays));
      }
      const int64_t width = in_.integer("an array's number of components");
      const int64_t tuples = in_.integer("an array's number of tuples");
      const Number type = number_type(in_, in_.word());
      if (name == kVtkGroupNumber && width == 2 && type == Number::i32)
        read_whole(product(2, tuples), type, "numbers of groups", "a group's number",
                   [&](int64_t v) { sink_.add_number(v); });
      else if (name == kVtkGroupName && width == 1 && type == Number::text) read_strings(tuples, true);
      else if (name == kVtkGroupName && width == 1 && type == Number::u8)
        read_whole(tuples, type, "characters of names", "a character of a group's name",
                   [&](int64_t c) { sink_.add_letter(c); });
      else keep_or_skip(n_cells && width == 1 && tuples == *n_cells, name, type, product(width, tuples));
    }
  }

  void skip_values(Number type, int64_t n) {
    if (type == Number::text) {
      read_strings(n, false);
    } else if (in_.binary) {
      in_.end_line("an array's type");
      if (type == Number::bit) in_.skip(size_t((uint64_t(n) + 7) / 8), "a FIELD array");
      else in_.skip(in_.count(n, bytes_of(type), "values") * bytes_of(type), "a FIELD array");
    } else {
      for (int64_t i = 0; i < n; ++i)
        if (in_.word().empty()) in_.refuse("the file ends inside a FIELD array of %lld values", ll(n));
    }
  }

  void read_strings(int64_t n, bool names) {
    in_.line();
    for (int64_t i = 0; i < n; ++i) {
      if (in_.left() == 0) in_.refuse("the file ends inside a FIELD of strings");
      std::string_view text;
      if (in_.binary) {
        const size_t bytes = string_bytes();
        text = in_.rest().substr(0, bytes);
        in_.skip(bytes, "a FIELD string");
      } else {
        text = in_.line();
      }
      if (names) sink_.add_name(text);
    }
  }

  // The two top bits of the first byte give the size of the length: 1, 2, 4 or 8 bytes.
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
  VtkCells sink_;
  bool polydata_ = false;
  Array<uint32_t> cells_, start_;  // corners end to end; first corner of each cell, and the end
  Array<uint8_t> types_;
  Array<int32_t> labels_;  // the file's number of each cell's group, where it has an array of them
  Array<double> shares_;   // of each cell, where it has these
};

}  // namespace

void read_vtk(Cursor &in, RawMesh &out) { VtkReader(in, out).run(); }

}  // namespace dfm
