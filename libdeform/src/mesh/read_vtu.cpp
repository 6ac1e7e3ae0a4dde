// VTU and VTP: the XML files of VTK. Pieces follow one another in one mesh; each holds points, cells
// (offsets, connectivity and, of UnstructuredGrid, types) and data, of which only an array over the cells
// that numbers groups and one of shares are kept.
#include <algorithm>
#include <bit>

#include "mesh/cells.h"
#include "mesh/vtu_array.h"

namespace dfm {
namespace {

struct CellList { VtuPlace connectivity, offsets, types; };

struct Piece {
  uint64_t npoint = 0;
  // UnstructuredGrid: the first alone; PolyData: vertices, lines, polygons, strips
  uint64_t ncell[4] = {};
  CellList cells[4];
  VtuPlace points, group, share, inside;
};

class VtuReader {
 public:
  VtuReader(Cursor &in, RawMesh &out) : in_(in), out_(out), sink_(out), corners_(*out.memory) {}

  void run() {
    find_head();
    find_appended();
    bool piece = false, closed = false;
    while (const auto tag = next_tag(in_)) {
      if (tag->name == "Piece" && !tag->closes) {
        read_piece(*tag);
        piece = true;
      } else if (tag->name == "FieldData" && !tag->closes && !tag->empty) {
        read_field_data();
      } else if (tag->name == "AppendedData" || (tag->name == "VTKFile" && tag->closes)) {
        closed = true;
        break;
      }
    }
    if (!closed) in_.refuse("</VTKFile> is missing: the file is truncated");
    if (!piece) in_.refuse("no Piece in this file; expected one with Points and Cells");
    sink_.finish(in_);
  }

 private:
  void find_head() {
    packing_.file_bytes = in_.left();
    auto tag = next_tag(in_);
    if (!tag || tag->name != "VTKFile")
      in_.refuse("expected <VTKFile> first, found %s", Cursor::quote(tag ? tag->name : "").c_str());
    const std::string_view type = tag->get("type");
    polydata_ = type == "PolyData";
    if (!polydata_ && type != "UnstructuredGrid")
      in_.unsupported(
          "a VTKFile of type %s; expected UnstructuredGrid or PolyData: save one of these (in ParaView: "
          "Append Datasets, then Save Data)",
          Cursor::quote(type.empty() ? " " : type).c_str());
    const std::string_view order = tag->get("byte_order");
    const std::string_view header = tag->get("header_type");
    const std::string_view compressor = tag->get("compressor");
    const bool little = order.empty() || order == "LittleEndian";
    if (!little && order != "BigEndian")
      in_.refuse("byte_order %s; expected LittleEndian or BigEndian", Cursor::quote(order).c_str());
    packing_.swap = little != (std::endian::native == std::endian::little);
    if (!header.empty() && header != "UInt32" && header != "UInt64")
      in_.refuse("header_type %s; expected UInt32 or UInt64", Cursor::quote(header).c_str());
    packing_.header_bytes = header == "UInt64" ? 8 : 4;
    packing_.compressed = !compressor.empty();
    if (packing_.compressed && compressor != "vtkZLibDataCompressor")
      in_.unsupported(
          "packed by %s; vtkZLibDataCompressor or no compressor is read: save it with one of these",
          Cursor::quote(compressor).c_str());
  }

  // Appended data come last but are needed first.
  void find_appended() {
    Cursor look = in_;
    if (!look.find("<AppendedData")) return;
    const auto tag = next_tag(look);
    const std::string_view encoding = tag->get("encoding");
    if (encoding != "raw" && encoding != "base64")
      look.refuse("AppendedData encoded as %s; expected raw or base64",
                  Cursor::quote(encoding.empty() ? " " : encoding).c_str());
    packing_.appended_base64 = encoding == "base64";
    if (!look.find("_")) look.refuse("AppendedData has no underscore before its data: the file is truncated");
    look.skip(1, "AppendedData");
    packing_.appended = look.rest();
    const size_t end =
        packing_.appended_base64 ? packing_.appended.find('<') : packing_.appended.rfind("</AppendedData");
    if (end != packing_.appended.npos) packing_.appended = packing_.appended.substr(0, end);
  }

  uint64_t number(const XmlTag &tag, const char *key) {
    const std::string_view text = tag.get(key);
    if (text.empty()) return 0;
    const int64_t n = Cursor(in_).to_integer(text, key);
    if (n < 0) in_.refuse("%s is %lld; a count cannot be negative", key, ll(n));
    return static_cast<uint64_t>(n);
  }

  void read_piece(const XmlTag &head) {
    static const char *const counts[] = {"NumberOfVerts", "NumberOfLines", "NumberOfPolys", "NumberOfStrips"};
    Piece piece;
    piece.npoint = number(head, "NumberOfPoints");
    if (polydata_)
      for (int k = 0; k < 4; ++k) piece.ncell[k] = number(head, counts[k]);
    else piece.ncell[0] = number(head, "NumberOfCells");
    if (!head.empty) find_arrays(piece);
    const uint32_t base = out_.npoint();
    read_points(piece);
    read_cells(piece, base);
  }

  void find_arrays(Piece &piece) {
    std::string_view section;
    while (const auto tag = next_tag(in_)) {
      if (tag->closes) {
        if (tag->name == "Piece") return;
        if (tag->name == section) section = {};
      } else if (tag->name == "DataArray" || tag->name == "Array") {
        if (section.empty() || tag->get("type") == "Bit" || (section == "PointData")) continue;
        keep_array(piece, section, vtu_place(in_, *tag));
      } else if (!tag->empty && section.empty()) section = tag->name;
    }
    in_.refuse("a Piece has no end: the file is truncated");
  }

  void keep_array(Piece &piece, std::string_view section, VtuPlace &&place) {
    if (section == "Points") {
      piece.points = std::move(place);
    } else if (section == "CellData") {
      if (!piece.group.given && place.components == 1 && is_whole(place.type) && vtk_names_groups(place.name))
        piece.group = std::move(place);
      else if (!piece.share.given && place.components == 1 && vtk_names_share(place.name, place.type))
        piece.share = std::move(place);
      else if (place.components == kInsidePoints && place.name == kVtkInside && !is_whole(place.type))
        piece.inside = std::move(place);
    } else {
      static constexpr std::string_view kLists[] = {"Verts", "Lines", "Polys", "Strips"};
      const size_t list = polydata_            ? size_t(std::find(kLists, kLists + 4, section) - kLists)
                          : section != "Cells" ? 4
                                               : 0;
      if (list == 4) return;
      const std::string name = vtk_lower(place.name);
      CellList &cells = piece.cells[list];
      if (name == "connectivity") cells.connectivity = std::move(place);
      else if (name == "offsets") cells.offsets = std::move(place);
      else if (name == "types") cells.types = std::move(place);
    }
  }

  VtuNumbers numbers(const VtuPlace &place, uint64_t n, const char *what, bool whole) {
    if (!place.given) in_.refuse("no DataArray of %s: the file is truncated or holds no mesh", what);
    if (whole && !is_whole(place.type)) in_.refuse("the DataArray of %s must be of whole numbers", what);
    VtuNumbers out(*out_.memory, in_, packing_, place);
    out.expect(n, what);
    return out;
  }

  void read_points(const Piece &piece) {
    if (piece.npoint == 0) return;
    if (piece.points.given && piece.points.components != 3)
      in_.refuse("points of %u components; expected 3", piece.points.components);
    const uint32_t n = in_.small(piece.npoint, "points");
    VtuNumbers a = numbers(piece.points, 3 * uint64_t(n), "points", false);
    in_.small(uint64_t(out_.npoint()) + n, "points");
    out_.points.reserve(out_.points.size() + 3 * size_t(n));
    for (uint64_t i = 0; i < 3 * uint64_t(n); ++i)
      out_.points.push_back(a.in.real(a.type, "a point's coordinate"));
  }

  void read_cells(const Piece &piece, uint32_t base) {
    static constexpr uint8_t kinds[] = {2, 4, 7, 6};  // of PolyData
    uint64_t total = 0;
    for (const uint64_t n : piece.ncell) {
      if (n > uint64_t(kMaxTets)) in_.unsupported("%llu cells; up to %u are read", ull(n), kMaxTets);
      total += n;
    }
    if (total == 0) return;
    std::optional<VtuNumbers> group, share, inside;
    if (piece.group.given) group.emplace(numbers(piece.group, total, "groups of cells", true));
    if (piece.share.given && !polydata_) share.emplace(numbers(piece.share, total, "shares of cells", false));
    if (piece.inside.given && !polydata_)
      inside.emplace(numbers(piece.inside, kInsidePoints * total, "weights of cells", false));
    for (int k = 0; k < 4; ++k)
      if (piece.ncell[k])
        read_list(piece.cells[k], piece.ncell[k], base, polydata_ ? kinds[k] : 0, group, share, inside);
  }

  void read_list(const CellList &list, uint64_t n, uint32_t base, uint8_t kind,
                 std::optional<VtuNumbers> &group, std::optional<VtuNumbers> &share,
                 std::optional<VtuNumbers> &inside) {
    VtuNumbers offsets = numbers(list.offsets, n, "offsets of cells", true);
    VtuNumbers connectivity = numbers(list.connectivity, 0, "connectivity", true);
    std::optional<VtuNumbers> types;
    if (kind == 0) {
      types.emplace(numbers(list.types, n, "types of cells", true));
      out_.expect_tets(std::min<size_t>(
          n, connectivity.in.left() / (connectivity.in.binary ? 4 * bytes_of(connectivity.type) : 8)));
    }
    const uint32_t npoint = out_.npoint() - base;
    int64_t end = 0;
    for (uint64_t c = 0; c < n; ++c) {
      const int64_t next = offsets.in.integer(offsets.type, "a cell's offset");
      if (next < end)
        offsets.in.refuse("the offset of cell %llu is %lld, after %lld; offsets are ends and rise", ull(c),
                          ll(next), ll(end));
      connectivity.expect(static_cast<uint64_t>(next) - static_cast<uint64_t>(end), "corners of a cell");
      corners_.clear();
      for (; end < next; ++end) {
        const int64_t p = connectivity.in.integer(connectivity.type, "a cell's point");
        if (p < 0 || p >= int64_t(npoint))
          connectivity.in.refuse("cell %llu refers to point %lld; the piece has points 0 to %lld", ull(c),
                                 ll(p), ll(npoint) - 1);
        corners_.push_back(base + static_cast<uint32_t>(p));
      }
      int64_t type = kind;
      if (types) type = types->in.integer(types->type, "a cell's type");
      if (type < 0 || type > 255)
        types->in.refuse("cell type %lld; expected 0 to 82 (10 is a tetrahedron)", ll(type));
      const int64_t label = group ? group->in.integer(group->type, "a cell's group") : 0;
      sink_.add(in_, static_cast<uint8_t>(type), corners_.data(), corners_.size(), label);
      const double part = share ? share->in.real(share->type, "a cell's share") : 1;
      if (share && type == 10) out_.share.push_back(part);
      for (uint32_t q = 0; inside && q < kInsidePoints; ++q) {
        const double weight = inside->in.real(inside->type, "a cell's weight");
        if (type == 12) out_.inside.push_back(weight);
      }
    }
  }

  // Names of groups.
  void read_field_data() {
    while (const auto tag = next_tag(in_)) {
      if (tag->closes && tag->name == "FieldData") return;
      if (tag->closes || (tag->name != "DataArray" && tag->name != "Array")) continue;
      const std::string_view name = tag->get("Name");
      if (name != kVtkGroupNumber && name != kVtkGroupName) continue;
      const VtuPlace place = vtu_place(in_, *tag);
      if (place.type != Number::text && !is_whole(place.type)) continue;
      VtuNumbers a(*out_.memory, in_, packing_, place);
      for (;;) {
        if (!a.in.binary) a.in.skip_space();
        if (a.in.left() == 0) break;
        const int64_t v = a.in.integer(a.type, "a value of the field data");
        if (name == kVtkGroupNumber) sink_.add_number(v);
        else sink_.add_letter(v);
      }
    }
    in_.refuse("FieldData has no end: the file is truncated");
  }

  Cursor &in_;
  RawMesh &out_;
  VtkCells sink_;
  VtuPacking packing_;
  bool polydata_ = false;
  Array<uint32_t> corners_;
};

}  // namespace

void read_vtu(Cursor &in, RawMesh &out) { VtuReader(in, out).run(); }

}  // namespace dfm
