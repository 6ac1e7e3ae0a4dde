// TetGen: points in NAME.node, tetrahedra of 4 or 10 points in NAME.ele, triangles in NAME.face, each with a
// head of counts and rows that begin with a number. Whichever is named, those beside it are read too. Groups
// are the regions of the tetrahedra and the markers of the triangles, without triangles of the points.
#include <algorithm>
#include <array>

#include "core/file.h"
#include "core/path.h"
#include "deform/plugin.h"
#include "mesh/numbers.h"
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

constexpr uint32_t kTet10[10] = {0, 1, 2, 3, 9, 7, 4, 5, 8, 6};  // place of each of ours

class TetgenReader {
 public:
  TetgenReader(Cursor &in, RawMesh &out) : in_(in), out_(out), nodes_(*out.memory, "node") {}

  void run() {
    const std::string ending = ending_of(in_.path());
    const auto read = [&](const char *part, void (TetgenReader::*rows)(Cursor &)) {
      if (ending == part) return (this->*rows)(in_);
      const std::string path = beside(part);
      const Array<char> bytes =
          read_whole_file(*out_.memory, path, kMaxMeshBytes, "the file that belongs to it");
      Cursor in(path, bytes.data(), bytes.size());
      (this->*rows)(in);
    };
    const auto has = [&](const char *part) {
      return ending == part || std::filesystem::exists(path_of(beside(part)));
    };
    markers_ = !has("face");
    read("node", &TetgenReader::read_points);
    if (has("ele")) read("ele", &TetgenReader::read_cells);
    if (!markers_) read("face", &TetgenReader::read_faces);
  }

 private:
  std::string beside(const char *ending) const {
    return in_.path().substr(0, in_.path().rfind('.') + 1) + ending;
  }

  void read_points(Cursor &in) {
    in.comment = '#';
    const int64_t n = in.integer("the number of points"), dimension = in.integer("the dimension"),
                  attributes = in.integer("the number of attributes"), marked = flag(in);
    if (dimension != 3) in.unsupported("points of dimension %lld; a body needs points x y z", ll(dimension));
    in.count(attributes, 2, "attributes");
    const uint32_t npoint = in.small(in.text_count(n, 4 + size_t(attributes + marked), "points"), "points");
    out_.points.reserve(3 * size_t(npoint));
    nodes_.reserve(npoint);
    for (uint32_t p = 0; p < npoint; ++p) {
      nodes_.add(in.integer("a point's number"));
      for (int k = 0; k < 3; ++k) out_.points.push_back(in.real("a point's coordinate"));
      for (int64_t k = 0; k < attributes; ++k) in.real("a point's attribute");
      if (marked) {
        const int32_t marker = group(in, in.word(), "a point's marker");
        if (markers_) out_.keep_points(&p, 1, out_.group(in, 0, marker));
      }
    }
    nodes_.finish(in);
  }

  void read_cells(Cursor &in) {
    in.comment = '#';
    const int64_t n = in.integer("the number of tetrahedra");
    corners_ = in.integer("the number of points of each");
    const int64_t regions = flag(in);
    if (corners_ != 4 && corners_ != 10)
      in.unsupported("tetrahedra of %lld points; 4 and 10 are read", ll(corners_));
    const uint64_t ncell = in.text_count(n, size_t(1 + corners_ + regions), "tetrahedra");
    if (corners_ == 4) out_.expect_tets(ncell);
    for (uint64_t c = 0; c < ncell; ++c) {
      uint32_t cell[10];
      in.integer("a tetrahedron's number");
      for (int64_t k = 0; k < corners_; ++k) cell[kTet10[k]] = node(in, in.word());
      const int32_t region = regions ? group(in, in.word(), "a tetrahedron's region") : 0;
      out_.add_cell(in, corners_ == 4 ? DFM_CELL_TET : DFM_CELL_TET10, cell, out_.group(in, 3, region));
    }
  }

  // Three corners, and perhaps the middles of the edges, whose order is not the same in all files: those of
  // the tetrahedra are taken. Behind the marker may stand the two tetrahedra that the triangle belongs to.
  void read_faces(Cursor &in) {
    in.comment = '#';
    const int64_t n = in.integer("the number of triangles"), marked = flag(in);
    Cursor first_row = in;
    first_row.skip_space();
    int64_t words = 0;
    for (std::string_view w; !(w = first_row.line_word()).empty() && w.front() != in.comment;) ++words;
    const size_t nodes = words - 1 - marked < 6 ? 3 : 6;
    const uint64_t nface = in.text_count(n, 1 + nodes + size_t(marked), "triangles");
    const Array<Middle> middles = middles_of_edges();
    for (uint64_t f = 0; f < nface; ++f, in.line()) {
      uint32_t face[6];
      in.integer("a triangle's number");
      for (size_t k = 0; k < 3; ++k) face[k] = node(in, in.line_word());
      for (size_t k = 3; k < nodes; ++k) node(in, in.line_word());
      const uint32_t in_group =
          out_.group(in, 2, marked ? group(in, in.line_word(), "a triangle's marker") : 0);
      size_t found = 0;  // a file may name other triangles than those of its tetrahedra
      for (size_t k = 0; k < 3; ++k) {
        const Middle edge = middle(face[k], face[(k + 1) % 3], 0);
        const auto at = std::lower_bound(middles.begin(), middles.end(), edge);
        if (at == middles.end() || (*at)[0] != edge[0] || (*at)[1] != edge[1]) continue;
        face[3 + k] = (*at)[2];
        ++found;
      }
      if (found == 3) out_.add_second_order(in, face, 6, in_group);
      else out_.add_polygon(in, face, 3, in_group);
    }
  }

  using Middle = std::array<uint32_t, 3>;  // the ends of an edge, ascending, and its middle
  static Middle middle(uint32_t a, uint32_t b, uint32_t of) { return {std::min(a, b), std::max(a, b), of}; }
  Array<Middle> middles_of_edges() const {
    Array<Middle> out{*out_.memory};
    if (corners_ != 10) return out;
    out.reserve(out_.cells.size() / 10 * 6);
    constexpr uint32_t kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
    for (size_t c = 0; c < out_.cells.size(); c += 10) {
      const uint32_t *const cell = &out_.cells[c];
      for (uint32_t e = 0; e < 6; ++e)
        out.push_back(middle(cell[kEdges[e][0]], cell[kEdges[e][1]], cell[4 + e]));
    }
    std::sort(out.begin(), out.end());
    return out;
  }

  static int64_t flag(Cursor &in) {
    const int64_t is = in.integer("whether there are markers or regions (0 or 1)");
    if (is != 0 && is != 1) in.refuse("%lld markers or regions; expected 0 or 1", ll(is));
    return is;
  }
  uint32_t node(Cursor &in, std::string_view word) {
    return nodes_.find(in, in.to_integer(word, "a point's number"));
  }
  // Regions are real numbers to TetGen.
  static int32_t group(Cursor &in, std::string_view word, const char *what) {
    const double number = in.to_real(word, what);
    if (!(number >= INT32_MIN && number <= INT32_MAX) || number != std::trunc(number))
      in.refuse("%s is %g; expected a whole number of 32 bits, which names a group", what, number);
    return static_cast<int32_t>(number);
  }

  Cursor &in_;
  RawMesh &out_;
  Numbers nodes_;
  bool markers_ = false;  // of points are groups
  int64_t corners_ = 4;
};

}  // namespace

void read_tetgen(Cursor &in, RawMesh &out) { TetgenReader(in, out).run(); }

}  // namespace dfm
