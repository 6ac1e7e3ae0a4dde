// Abaqus input files (.inp), also as CalculiX and gmsh write them: keyword lines "*ELEMENT, TYPE=C3D4,
// ELSET=a" in any case, each followed by data lines of values between commas. Read are nodes, elements and
// sets, in three passes since a file may have them in any order; steps, loads and materials are skipped. Sets
// may overlap, and a cell has one group: that of its section, else of the last set that names it.
#include <cctype>
#include <map>
#include <set>

#include "core/names.h"
#include "deform/plugin.h"
#include "mesh/cells.h"
#include "mesh/finish.h"
#include "mesh/numbers.h"

namespace dfm {
namespace {

// Types of elements by what stands before the number of nodes.
struct Family {
  const char *prefix;
  uint8_t dimension;
};
constexpr Family kFamilies[] = {{"c3d", 3}, {"ac3d", 3}, {"dc3d", 3},  {"ec3d", 3}, {"fc3d", 3}, {"f3d", 2},
                                {"sc", 3},  {"css", 3},  {"coh3d", 3}, {"s", 2},    {"ds", 2},   {"stri", 2},
                                {"cps", 2}, {"cpe", 2},  {"cax", 2},   {"m3d", 2},  {"r3d", 2},  {"sfm3d", 2},
                                {"b", 1},   {"t2d", 1},  {"t3d", 1}};

std::string_view trimmed(std::string_view text) {
  constexpr const char *kBlank = " \t\r";
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return text.substr(0, text.find_last_not_of(kBlank) + 1);
}

class AbaqusReader {
 public:
  AbaqusReader(Cursor &in, RawMesh &out)
      : in_(in),
        out_(out),
        start_(in.offset()),
        bytes_(in.left()),
        nodes_(*out.memory, "node"),
        elements_(*out.memory, "element"),
        places_(*out.memory) {
    in.separator = ',';
  }

  void run() {
    while (next()) {
      check();
      if (is("*node") && !outside()) read_nodes();
    }
    if (out_.points.empty()) in_.refuse("no nodes (*NODE); the file is truncated or holds no mesh");
    nodes_.finish(in_);
    for (in_.seek(start_); next();)
      if (is("*element") && !outside()) read_elements();
    elements_.finish(in_);
    for (in_.seek(start_); next();) {
      if (outside() && !parameter("instance")) continue;
      if (is("*nset")) read_set(node_sets_, nodes_, "nset");
      else if (is("*elset")) read_set(element_sets_, elements_, "elset");
      else if (is("*solid section") && parameter("elset")) {
        const auto set = element_sets_.index.find(lower(*parameter("elset")));
        if (set != element_sets_.index.end()) element_sets_.all[set->second].section = true;
      }
    }
    make_groups();
    if (!passed_over_.empty())
      out_.warnings.push_back(
          "elements of these types have no cells or triangles of a body and were left out: " +
          join({passed_over_.begin(), passed_over_.end()}));
    if (lost_)
      out_.warnings.push_back(format("%zu entries of sets name no node and no element that was read", lost_));
  }

 private:
  struct Place { uint32_t first, n; };  // n: triangles from the first; 0: the cell
  struct Set {
    std::string_view name;
    Array<uint32_t> members;
    bool section = false;
    uint32_t groups[2] = {kNoGroup, kNoGroup};  // of its triangles, of its cells
  };
  struct Sets {
    std::vector<Set> all;
    std::map<std::string, uint32_t> index;  // by name in lower case
  };

  bool is(std::string_view lower) const { return Cursor::is_word(keyword_, lower); }
  const std::string_view *parameter(std::string_view lower) const {
    for (const auto &[name, value] : parameters_)
      if (Cursor::is_word(name, lower)) return &value;
    return nullptr;
  }
  // Between the instances of an assembly, whose own nodes are points of reference.
  bool outside() const { return assembly_ && !instance_; }

  // At a data line of this keyword; passes over comments and empty lines.
  bool data() {
    for (;; in_.line()) {
      in_.skip_space();
      if (in_.left() == 0 || in_.rest().front() != '*') return in_.left() != 0;
      if (in_.rest().substr(0, 2) != "**") return false;
    }
  }
  // Reads the next keyword line, which a comma at its end continues; false at the end of the file.
  bool next() {
    if (in_.offset() == start_) {
      assembly_ = instance_ = false;
      if (data()) in_.refuse("expected a keyword such as *NODE, found %s", Cursor::quote(in_.word()).c_str());
    }
    while (data()) in_.line();
    if (in_.left() == 0) return false;
    keyword_at_ = in_.offset();
    keyword_ = {};
    parameters_.clear();
    for (bool more = true; more && in_.left();) {
      std::string_view line = trimmed(in_.line());
      more = !line.empty() && line.back() == ',';
      while (!line.empty()) {
        const std::string_view field = trimmed(line.substr(0, line.find(',')));
        line.remove_prefix(std::min(line.find(','), line.size() - 1) + 1);
        if (keyword_.empty()) {
          keyword_ = field;
          continue;
        }
        const size_t equals = std::min(field.find('='), field.size());
        std::string_view value = trimmed(field.substr(std::min(equals + 1, field.size())));
        if (value.size() > 1 && value.front() == '"' && value.back() == '"')
          value = value.substr(1, value.size() - 2);
        parameters_.emplace_back(trimmed(field.substr(0, equals)), value);
      }
    }
    if (is("*assembly")) assembly_ = true;
    else if (is("*end assembly")) assembly_ = false;
    else if (is("*instance") || is("*end instance")) instance_ = is("*instance");
    return true;
  }

  // Refuses what would lose a part of the mesh.
  void check() {
    for (const char *word :
         {"*include", "*system", "*ngen", "*nfill", "*ncopy", "*nmap", "*elgen", "*elcopy"})
      if (is(word)) not_whole();
    const std::string_view *system = parameter("system");
    if ((is("*node") && system && !Cursor::is_word(*system, "r")) ||
        ((is("*node") || is("*element") || is("*nset") || is("*elset")) && parameter("input")) ||
        (is("*nset") && parameter("elset")))
      not_whole();
    parts_ += is("*part");
    instances_ += is("*instance");
    if (parts_ > 1 || instances_ > 1) {
      in_.seek(keyword_at_);
      in_.unsupported("a second %s; write the mesh of each to a file of its own",
                      parts_ > 1 ? "part" : "instance");
    }
    if (is("*instance") && data())
      out_.warnings.push_back(
          "the place of the instance in its assembly is left out; the mesh is where its part is");
  }
  [[noreturn]] void not_whole() {
    in_.seek(keyword_at_);
    const std::string line = Cursor::quote(trimmed(in_.line()));
    in_.seek(keyword_at_);
    in_.unsupported("%s is not read; write one file with every node, element and set by its numbers",
                    line.c_str());
  }

  Set *set_called(Sets &sets, const std::string_view *name) {
    if (!name || name->empty()) return nullptr;
    const auto [at, fresh] = sets.index.try_emplace(lower(*name), uint32_t(sets.all.size()));
    if (fresh) sets.all.push_back({*name, Array<uint32_t>(*out_.memory)});
    return &sets.all[at->second];
  }

  // The next of the fields of a line, which end at commas; one that is blank or left out is 0. Without commas
  // words are.
  std::string_view field() {
    const std::string_view line = in_.rest().substr(0, in_.rest().find('\n'));
    const size_t comma = line.find(',');
    std::string_view word;
    if (comma == line.npos) {
      word = in_.line_word();
    } else {
      in_.skip(comma + 1, "a field");
      word = trimmed(line.substr(0, comma));
    }
    return word.empty() ? "0" : word;
  }

  void read_nodes() {
    Set *const set = set_called(node_sets_, parameter("nset"));
    for (; data(); in_.line()) {
      if (out_.npoint() == kMaxPoints) in_.unsupported("more than %u points", kMaxPoints);
      if (set) set->members.push_back(out_.npoint());
      nodes_.add(in_.to_integer(field(), "a node's number"));
      for (int k = 0; k < 3; ++k) out_.points.push_back(in_.to_real(field(), "a node's coordinate"));
    }
  }

  void read_elements() {
    const std::string_view *const type = parameter("type");
    if (!type) {
      in_.seek(keyword_at_);
      in_.refuse("*ELEMENT without a type; expected for instance TYPE=C3D4");
    }
    uint8_t dimension = 0;
    uint32_t n = 0, kind = 0;
    for (const Family &f : kFamilies) {
      const std::string_view prefix = f.prefix, number = type->substr(std::min(prefix.size(), type->size()));
      if (!Cursor::is_word(type->substr(0, prefix.size()), prefix) || number.empty() ||
          !std::isdigit(static_cast<unsigned char>(number.front())))
        continue;
      dimension = f.dimension;
      // STRI65 has 6 nodes, S4R5 has 4
      std::from_chars(number.data(), number.data() + (dimension == 3 ? number.size() : 1), n);
    }
    for (const CellKind &k : cell_kinds())  // where faces have middles, these files number them otherwise
      if (dimension == 3 && k.nodes == n && n < 27) kind = k.kind;
    if (dimension == 3 && !kind) {
      in_.seek(keyword_at_);
      in_.unsupported(
          "elements of type %s; tetrahedra of 4 and 10 nodes (C3D4, C3D10) and hexahedra of 8 and 20 "
          "(C3D8, C3D20) are read: mesh the volume with one of these",
          Cursor::quote(*type).c_str());
    }
    if (dimension == 1) return;  // lines
    if (!kind && n != 3 && n != 4 && n != 6 && n != 8) {
      passed_over_.insert(Cursor::quote(*type));
      return;
    }
    Set *const set = set_called(element_sets_, parameter("elset"));
    while (data()) {
      if (set) set->members.push_back(uint32_t(elements_.size()));
      elements_.add(in_.to_integer(in_.line_word(), "an element's number"));
      read_element(kind, n);
      if (!in_.line_word().empty()) in_.refuse("an element with more than the %u nodes of its type", n);
      in_.line();
    }
  }

  void read_element(uint32_t kind, uint32_t n) {
    uint32_t nodes[kMaxNodes];
    for (uint32_t k = 0; k < n; ++k) {
      std::string_view word = in_.line_word();
      while (word.empty() && data()) word = in_.line_word();
      nodes[k] = nodes_.find(in_, in_.to_integer(word, "an element's node"));
    }
    if (kind) {
      places_.push_back({uint32_t(out_.tet_group.size() / cell_kind(kind).tets), 0});
      return out_.add_cell(in_, kind, nodes, kNoGroup);
    }
    const uint32_t first = out_.ntri();
    if (n > 4) out_.add_second_order(in_, nodes, n, kNoGroup);
    else out_.add_polygon(in_, nodes, n, kNoGroup);
    places_.push_back({first, out_.ntri() - first});
  }

  void read_set(Sets &sets, const Numbers &numbers, const char *named_by) {
    Set *const set = set_called(sets, parameter(named_by));
    if (!set) {
      in_.seek(keyword_at_);
      in_.refuse("a set without a name; expected %s=NAME", named_by);
    }
    Array<uint32_t> &members = set->members;
    const bool generate = parameter("generate");
    for (; data(); in_.line()) {
      for (std::string_view word = in_.line_word(); !word.empty(); word = in_.line_word()) {
        const auto other = sets.index.find(lower(word));
        if (generate) {
          const int64_t first = in_.to_integer(word, "the first of a range"),
                        last = in_.to_integer(in_.line_word(), "the last of a range");
          word = in_.line_word();
          const int64_t step = word.empty() ? 1 : in_.to_integer(word, "the step of a range");
          if (step < 1) in_.refuse("a range with the step %lld; expected 1 or more", ll(step));
          count(numbers.find_range(first, last, step, members));
        } else if (other != sets.index.end()) {
          const Array<uint32_t> copy = sets.all[other->second].members;
          members.insert(members.end(), copy.begin(), copy.end());
          count(copy.size());
        } else {
          const int64_t number = in_.to_integer(word, "a number or a set that stands before");
          const size_t before = members.size();
          numbers.find_range(number, number, 1, members);
          lost_ += members.size() == before;
        }
      }
    }
  }
  // A few bytes may name all nodes again and again.
  void count(uint64_t members) {
    if ((named_ += members) > bytes_)
      in_.unsupported("its sets name more than %zu members, one for each byte of the file; write fewer sets",
                      bytes_);
  }

  void make_groups() {
    for (Set &set : element_sets_.all) sort_once(set.members);
    for (const Set &set : node_sets_.all)
      if (!set.members.empty())
        out_.keep_points(set.members.data(), set.members.size(), out_.named_group(in_, 0, set.name));
    const CellKind &kind = cell_kind(out_.cell ? out_.cell : uint32_t{DFM_CELL_TET});
    const auto group = [&](Set &set, Place place) {
      uint32_t &g = set.groups[place.n == 0];
      if (g == kNoGroup) g = out_.named_group(in_, place.n ? 2 : 3, set.name);
      return g;
    };
    const auto take = [&](Set &set) {
      for (const uint32_t e : set.members) {
        const Place at = places_[e];
        if (at.n) std::fill_n(&out_.tri_group[at.first], at.n, group(set, at));
        else std::fill_n(&out_.tet_group[kind.tets * size_t{at.first}], kind.tets, group(set, at));
      }
    };
    for (Set &set : element_sets_.all) take(set);
    for (Set &set : element_sets_.all)
      if (set.section) take(set);
    const Array<uint32_t> &nodes = out_.cells.empty() ? out_.tets : out_.cells;
    Array<uint32_t> last(out_.npoint(), kNoGroup, *out_.memory);
    for (Set &set : element_sets_.all)
      for (const uint32_t e : set.members) {
        const Place at = places_[e];
        const uint32_t g = group(set, at);
        if (at.n) keep(&out_.tris[3 * size_t{at.first}], 3 * at.n, g, last);
        else if (out_.tet_group[kind.tets * size_t{at.first}] != g)
          keep(&nodes[kind.nodes * size_t{at.first}], kind.nodes, g, last);
      }
  }
  // Those of the points that are not yet in the group; last: the group to which each was added last.
  void keep(const uint32_t *points, size_t n, uint32_t group, Array<uint32_t> &last) {
    for (size_t k = 0; k < n; ++k) {
      if (last[points[k]] == group) continue;
      last[points[k]] = group;
      count(1);
      out_.keep_points(&points[k], 1, group);
    }
  }

  Cursor &in_;
  RawMesh &out_;
  size_t start_, bytes_, keyword_at_ = 0;
  std::string_view keyword_;
  std::vector<std::pair<std::string_view, std::string_view>> parameters_;
  bool assembly_ = false, instance_ = false;
  uint32_t parts_ = 0, instances_ = 0;
  Numbers nodes_, elements_;
  Array<Place> places_;  // of each element
  Sets node_sets_, element_sets_;
  size_t named_ = 0, lost_ = 0;
  std::set<std::string> passed_over_;
};

}  // namespace

void read_abaqus(Cursor &in, RawMesh &out) { AbaqusReader(in, out).run(); }

}  // namespace dfm
