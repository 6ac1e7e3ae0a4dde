// Netgen's files (.vol, text): a keyword alone on its line, a count, and a line for each element or point.
// Elements come before the points that they name; names of materials and boundary conditions come last.
#include <algorithm>
#include <map>

#include "deform/plugin.h"
#include "mesh/cells.h"
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

// Places of Netgen's nodes among ours. Seen from the last corner of a cell the others turn the other way.
// Middles are those of the edges 01 02 03 12 13 23 of a cell, 12 02 01 of a triangle.
constexpr uint32_t kCell[10] = {0, 2, 1, 3, 6, 4, 7, 5, 9, 8}, kTriangle[6] = {0, 1, 2, 4, 5, 3};

class NetgenReader {
 public:
  NetgenReader(Cursor &in, RawMesh &out) : in_(in), out_(out) { in.comment = '#'; }

  void run() {
    in_.expect("mesh3d", "nothing");
    std::string_view word = keyword();
    for (; !word.empty() && word != "endmesh"; word = keyword()) {
      if (word == "dimension") {
        const int64_t d = in_.integer("the dimension");
        if (d != 3) in_.unsupported("a mesh of dimension %lld; a body needs one of dimension 3", ll(d));
      } else if (word == "points") {
        read_points();
      } else if (word == "surfaceelements" || word == "surfaceelementsgi" || word == "surfaceelementsuv") {
        read_elements(2);
      } else if (word == "volumeelements") {
        read_elements(3);
      } else if (word == "materials") {
        read_names(3);
      } else if (word == "bcnames") {
        read_names(2);
      }
    }
    if (word.empty()) in_.refuse("no endmesh; the file is truncated");
    if (most_ > int64_t(out_.npoint()))
      in_.refuse("an element refers to point %lld; the file has points 1 to %u", ll(most_), out_.npoint());
    name_groups();
  }

 private:
  // The next line of one word that is no number, or nothing: what other sections hold is passed over.
  std::string_view keyword() {
    for (;;) {
      in_.skip_space();
      if (in_.left() == 0) return {};
      const std::string_view word = in_.line_word();
      if (!word.empty() && word.front() >= 'a' && word.front() <= 'z' && in_.line_word().empty()) return word;
      in_.line();
    }
  }

  void read_points() {
    if (out_.npoint()) in_.refuse("a second section of points; one mesh per file is read");
    const uint32_t n = in_.small(in_.text_count(in_.integer("the number of points"), 3, "points"), "points");
    out_.points.reserve(3 * size_t(n));
    for (uint32_t i = 0; i < n; ++i)
      for (int k = 0; k < 3; ++k) out_.points.push_back(in_.real("a point's coordinate"));
  }

  // "surface condition inside outside n points.." or "material n points.."; what else a line has is not used.
  void read_elements(int32_t dimension) {
    const uint64_t n = in_.text_count(in_.integer("the number of elements"), 6, "elements");
    for (uint64_t i = 0; i < n; ++i) {
      if (dimension == 2) in_.integer("an element's surface");
      const char *const what = dimension == 2 ? "boundary condition" : "material";
      const int32_t number = in_.in_32_bits(in_.integer(what), what);
      if (dimension == 2)
        for (int k = 0; k < 2; ++k) in_.integer("a domain beside an element");
      const int64_t corners = in_.integer("an element's number of points");
      const bool second = corners == (dimension == 3 ? 10 : 6);
      if (!second && corners != 4 && (dimension == 3 || corners != 3))
        in_.unsupported(
            "an element of %lld points; tetrahedra of 4 and 10, triangles of 3 and 6 and quadrangles are "
            "read: mesh the volume with tetrahedra",
            ll(corners));
      uint32_t nodes[10];
      for (uint32_t k = 0; k < corners; ++k)
        nodes[dimension == 3 ? kCell[k] : second ? kTriangle[k] : k] = point();
      in_.line();
      const uint32_t group = out_.group(in_, dimension, number);
      if (dimension == 3) out_.add_cell(in_, second ? DFM_CELL_TET10 : DFM_CELL_TET, nodes, group);
      else if (second) out_.add_second_order(in_, nodes, 6, group);
      else out_.add_polygon(in_, nodes, size_t(corners), group);
    }
  }

  uint32_t point() {
    const int64_t p = in_.integer("an element's point");
    if (p < 1 || p > int64_t(kMaxPoints))
      in_.refuse("an element refers to point %lld; they count from 1", ll(p));
    most_ = std::max(most_, p);
    return static_cast<uint32_t>(p - 1);
  }

  void read_names(int32_t dimension) {
    const uint64_t n = in_.text_count(in_.integer("the number of names"), 1, "names");
    for (uint64_t i = 0; i < n; ++i) {
      const int64_t number = in_.integer("the number of a name");
      const std::string_view first = in_.line_word(), rest = in_.line();
      if (first.empty()) continue;
      std::string_view name(first.data(), size_t(rest.data() + rest.size() - first.data()));
      name = name.substr(0, name.find_last_not_of(" \t\r") + 1);
      if (name != "default") names_[{dimension, number}] = name;  // Netgen's word for none
    }
  }

  // Faces of a body often have one name, so groups of one name become one.
  void name_groups() {
    std::map<std::pair<int32_t, std::string_view>, uint32_t> known;
    std::vector<uint32_t> now;
    uint32_t kept = 0;
    for (MeshGroup &group : out_.groups) {
      const auto name = names_.find({group.dimension, group.tag});
      if (name != names_.end()) {
        const auto [first, fresh] = known.try_emplace({group.dimension, name->second}, kept);
        if (!fresh) {
          out_.keep_points(group.points.data(), group.points.size(), first->second);
          now.push_back(first->second);
          continue;
        }
        group.name = name->second;
      }
      now.push_back(kept);
      if (&out_.groups[kept] != &group) out_.groups[kept] = std::move(group);
      ++kept;
    }
    out_.groups.erase(out_.groups.begin() + std::ptrdiff_t(kept), out_.groups.end());
    for (Array<uint32_t> *const groups : {&out_.tet_group, &out_.tri_group})
      for (uint32_t &group : *groups)
        if (group != kNoGroup) group = now[group];
  }

  Cursor &in_;
  RawMesh &out_;
  int64_t most_ = 0;  // the greatest number of a point that an element has named
  std::map<std::pair<int32_t, int64_t>, std::string_view> names_;  // by dimension and number
};

}  // namespace

void read_netgen(Cursor &in, RawMesh &out) { NetgenReader(in, out).run(); }

}  // namespace dfm
