// Medit files (.mesh, ASCII): keywords, each with a count and rows of numbers from 1, the last of a row its
// reference. References other than 0 are groups of the cells, triangles (and quadrilaterals, cut) and edges.
// Keywords that a body does not need are skipped.
#include "deform/plugin.h"
#include "mesh/cells.h"
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

class MeditReader {
 public:
  MeditReader(Cursor &in, RawMesh &out) : in_(in), out_(out) { in.comment = '#'; }

  void run() {
    in_.expect("MeshVersionFormatted", "nothing");
    const int64_t version = in_.integer("the version");
    if (version < 1 || version > 4) in_.unsupported("Medit version %lld; 1 to 4 are read", ll(version));
    bool points = false, ended = false;
    for (std::string_view word = in_.word(); !word.empty() && !ended; word = ended ? word : in_.word()) {
      if (word == "Dimension") {
        dimension();
      } else if (word == "Vertices") {
        if (points) in_.refuse("a second Vertices section; one mesh per file is read");
        read_points();
        points = true;
      } else if (word == "Tetrahedra") read_volume(points, DFM_CELL_TET);
      else if (word == "TetrahedraP2") read_volume(points, DFM_CELL_TET10);
      else if (word == "Hexahedra" || word == "Hexaedra") read_volume(points, DFM_CELL_HEX8);
      else if (word == "HexahedraQ2") read_volume(points, DFM_CELL_HEX27);
      else if (word == "Triangles") read_cells(points, "triangles", 3, 2);
      else if (word == "TrianglesP2") read_cells(points, "second-order triangles", 6, 2);
      else if (word == "Quadrilaterals") read_cells(points, "quadrilaterals", 4, 2);
      else if (word == "QuadrilateralsQ2") read_cells(points, "second-order quadrilaterals", 9, 2);
      else if (word == "Edges") read_cells(points, "edges", 2, 1);
      else if (is_lost(word)) refuse_if_any(word);
      else if (word == "End") ended = true;
      else if (is_letter(word.front())) pass_over();
      else
        in_.refuse("expected a keyword such as Vertices, Tetrahedra or End, found %s",
                   Cursor::quote(word).c_str());
    }
    if (!points) in_.refuse("no Vertices section; the file is truncated or holds no mesh");
    if (!ended)
      out_.warnings.push_back(
          "End is missing; every section has as many lines as it promises, so the mesh was taken as "
          "complete");
  }

 private:
  static bool is_letter(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); }

  void dimension() {
    const int64_t d = in_.integer("the dimension");
    if (d != 3) in_.unsupported("a mesh of dimension %lld; a body needs points x y z", ll(d));
  }

  void read_points() {
    const uint32_t n =
        in_.small(in_.text_count(in_.integer("the number of vertices"), 4, "vertices"), "points");
    out_.points.reserve(3 * size_t(n));
    for (uint32_t i = 0; i < n; ++i) {
      for (int k = 0; k < 3; ++k) out_.points.push_back(in_.real("a vertex's coordinate"));
      in_.integer("a vertex's reference");
    }
  }

  void read_volume(bool points, uint32_t kind) {
    read_cells(points, cell_kind(kind).name, cell_kind(kind).nodes, 3, kind);
  }

  void read_cells(bool points, const char *what, uint32_t corners, int32_t dimension, uint32_t kind = 0) {
    if (!points) in_.refuse("%s before Vertices; expected Vertices first", what);
    const uint64_t n = in_.text_count(in_.integer("a number of elements"), corners + 1, what);
    if (kind == DFM_CELL_TET) out_.expect_tets(n);
    const uint8_t *const place = dimension == 3 ? cell_kind(kind).in_medit : nullptr;
    uint32_t corner[kMaxNodes];
    for (uint64_t i = 0; i < n; ++i) {
      for (uint32_t k = 0; k < corners; ++k) corner[place ? place[k] : k] = point();
      const int32_t reference = in_.in_32_bits(in_.integer("an element's reference"), "reference");
      const uint32_t group = out_.group(in_, dimension, reference);
      if (dimension == 3) out_.add_cell(in_, kind, corner, group);
      else if (corners > 4) out_.add_second_order(in_, corner, corners, group);
      else if (dimension == 2) out_.add_polygon(in_, corner, corners, group);
      else out_.keep_points(corner, corners, group);
    }
  }

  uint32_t point() {
    const int64_t p = in_.integer("an element's vertex");
    if (p < 1 || p > int64_t(out_.npoint()))
      in_.refuse("an element refers to vertex %lld; the file has vertices 1 to %u", ll(p), out_.npoint());
    return static_cast<uint32_t>(p - 1);
  }

  // Cells of other kinds and orders, and other orders of nodes, must not be lost in silence.
  static bool is_lost(std::string_view word) {
    for (const char *kind : {"Prisms", "Pyramids", "Tetrahedra", "Hexahedra", "Triangles"})
      if (word.substr(0, std::string_view(kind).size()) == kind) return true;
    return false;
  }
  void refuse_if_any(std::string_view what) {
    if (in_.integer("a number of elements") == 0) return;
    in_.unsupported(
        "%.*s; tetrahedra of 4 and 10 points and hexahedra of 8 and 27 are read: mesh the volume with these",
        int(what.size()), what.data());
  }

  // To the next keyword.
  void pass_over() {
    for (;;) {
      in_.skip_space();
      if (in_.left() == 0 || is_letter(in_.rest().front())) return;
      in_.word();
    }
  }

  Cursor &in_;
  RawMesh &out_;
};

}  // namespace

void read_medit(Cursor &in, RawMesh &out) { MeditReader(in, out).run(); }

}  // namespace dfm
