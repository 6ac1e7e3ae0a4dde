// MSH 4.1, ASCII and binary: nodes and elements in blocks, one per entity of the geometry; $Entities has
// the physical groups of each. Counts and numbers are size_t of the writing machine (data size 8 or 4),
// entity and type numbers are int.
#include <algorithm>

#include "mesh/msh.h"

namespace dfm {
namespace {

class Msh41Reader {
 public:
  Msh41Reader(Cursor &in, RawMesh &out, size_t size_bytes)
      : in_(in),
        out_(out),
        wide_(size_bytes == 8),
        nodes_(*out.memory),
        sink_(out, nodes_),
        entities_(HookAllocator<Entity>(*out.memory)) {}

  void run() {
    bool have_nodes = false, have_elements = false;
    for (std::string_view section = in_.word(); !section.empty(); section = in_.word()) {
      if (section == "$PhysicalNames") {
        read_physical_names(in_, out_);
      } else if (section == "$Entities") {
        if (have_elements) in_.refuse("$Entities after $Elements; expected them first");
        read_entities();
      } else if (section == "$Nodes") {
        if (have_nodes) in_.refuse("a second $Nodes section; one mesh per file is read");
        read_nodes();
        have_nodes = true;
      } else if (section == "$Elements") {
        if (!have_nodes) in_.refuse("$Elements before $Nodes; expected the nodes first");
        if (have_elements) in_.refuse("a second $Elements section; one mesh per file is read");
        read_elements();
        have_elements = true;
      } else if (section[0] == '$') skip_section(in_, section);
      else
        in_.refuse("expected a section such as $Nodes or $Elements, found %s",
                   Cursor::quote(section).c_str());
    }
    if (!have_nodes || !have_elements)
      in_.refuse("no %s section; the file is truncated or holds no mesh",
                 have_nodes ? "$Elements" : "$Nodes");
    sink_.finish(in_);
  }

 private:
  struct Entity {
    int32_t dimension, tag;
    uint32_t group;
    bool operator<(const Entity &o) const {
      return std::pair(dimension, tag) < std::pair(o.dimension, o.tag);
    }
  };

  int64_t size(const char *what) {
    if (!in_.binary) return in_.integer(what);
    if (!wide_) return in_.value<uint32_t>(what);
    const uint64_t v = in_.value<uint64_t>(what);
    if (v > uint64_t(INT64_MAX)) {
      in_.seek(in_.offset() - 8);
      in_.refuse("%s %llu is out of range", what, ull(v));
    }
    return static_cast<int64_t>(v);
  }
  int32_t number(const char *what) {
    return in_.binary ? in_.value<int32_t>(what) : msh_int(in_, in_.integer(what), what);
  }
  double real(const char *what) { return in_.binary ? in_.binary_real(what) : in_.real(what); }
  size_t size_bytes() const { return !in_.binary ? 2 : wide_ ? 8 : 4; }
  size_t real_bytes() const { return in_.binary ? 8 : 2; }
  void begin(const char *section) {
    if (in_.binary) in_.end_line(section);
  }

  void read_entities() {
    begin("$Entities");
    int64_t n[4];
    for (int64_t &k : n) k = size("a number of entities");
    for (int32_t d = 0; d < 4; ++d) {
      const uint64_t m = in_.count(n[d], in_.binary ? 20 : 6, "entities");
      for (uint64_t i = 0; i < m; ++i) {
        const int32_t tag = number("an entity's number");
        for (int k = 0; k < (d == 0 ? 3 : 6); ++k) real("an entity's box");
        const uint64_t physical =
            in_.count(size("an entity's number of physical groups"), in_.binary ? 4 : 2, "physical groups");
        for (uint64_t k = 0; k < physical; ++k) {
          const int32_t group = number("a physical group's number");
          if (k == 0) entities_.push_back({d, tag, out_.group(in_, d, group)});
        }
        if (d > 0) {
          const uint64_t bounding =
              in_.count(size("an entity's number of boundaries"), in_.binary ? 4 : 2, "boundary entities");
          for (uint64_t k = 0; k < bounding; ++k) number("a boundary entity");
        }
      }
    }
    std::sort(entities_.begin(), entities_.end());
    in_.expect("$EndEntities", "the entities promised");
  }

  uint32_t group_of(int32_t dimension, int32_t tag) const {
    const Entity wanted{dimension, tag, 0};
    const auto at = std::lower_bound(entities_.begin(), entities_.end(), wanted);
    return at != entities_.end() && !(wanted < *at) ? at->group : kNoGroup;
  }

  void read_nodes() {
    begin("$Nodes");
    const int64_t nblock = size("the number of node blocks");
    const uint64_t nnode = in_.count(size("the number of nodes"), size_bytes() + 3 * real_bytes(), "nodes");
    size("the least node number");
    size("the greatest node number");
    nodes_.reserve(nnode);
    out_.points.reserve(3 * nnode);
    for (int64_t b = 0; b < nblock; ++b) {
      const int32_t dimension = number("a node block's dimension");
      number("a node block's entity");
      const int32_t parametric = number("a node block's parametric flag");
      const int64_t n = size("a node block's number of nodes");
      if (dimension < 0 || dimension > 3)
        in_.refuse("a node block of dimension %d; expected 0 to 3", dimension);
      if (parametric != 0 && parametric != 1) in_.refuse("parametric flag %d; expected 0 or 1", parametric);
      if (n < 0 || uint64_t(n) > nnode - nodes_.size())
        in_.refuse("a block of %lld nodes where %llu of the %llu promised are left", ll(n),
                   ull(nnode - nodes_.size()), ull(nnode));
      for (int64_t i = 0; i < n; ++i) nodes_.add(size("a node's number"));
      for (int64_t i = 0; i < n; ++i) {
        for (int k = 0; k < 3; ++k) out_.points.push_back(real("a node's coordinate"));
        for (int k = 0; k < (parametric ? dimension : 0); ++k) real("a node's parameter");
      }
    }
    in_.expect("$EndNodes", "the node blocks promised");
    if (nodes_.size() != nnode)
      in_.refuse("$Nodes promises %llu nodes, its blocks hold %zu", ull(nnode), nodes_.size());
    nodes_.finish(in_);
  }

  void read_elements() {
    begin("$Elements");
    const int64_t nblock = size("the number of element blocks");
    const uint64_t nelement = in_.count(size("the number of elements"), 2 * size_bytes(), "elements");
    size("the least element number");
    size("the greatest element number");
    uint64_t done = 0;
    int64_t tags[kMaxElementPoints];
    for (int64_t b = 0; b < nblock; ++b) {
      const int32_t dimension = number("an element block's dimension");
      const int32_t entity = number("an element block's entity");
      const int32_t type = number("an element block's type");
      const int64_t n = size("an element block's number of elements");
      if (n < 0 || uint64_t(n) > nelement - done)
        in_.refuse("a block of %lld elements where %llu of the %llu promised are left", ll(n),
                   ull(nelement - done), ull(nelement));
      const uint32_t points = sink_.begin(in_, type);
      in_.count(n, size_bytes() * (1 + points), "elements in a block");
      if (type == kMshTet) out_.expect_tets(size_t(n));
      const uint32_t group = group_of(dimension, entity);
      if (group != kNoGroup && msh_element(type).dimension != dimension)
        in_.refuse("elements of type %d in an entity of dimension %d", type, dimension);
      for (int64_t i = 0; i < n; ++i) {
        size("an element's number");
        for (uint32_t k = 0; k < points; ++k) tags[k] = size("an element's node");
        sink_.add(in_, group, tags);
      }
      done += uint64_t(n);
    }
    in_.expect("$EndElements", "the element blocks promised");
    if (done != nelement)
      in_.refuse("$Elements promises %llu elements, its blocks hold %llu", ull(nelement), ull(done));
  }

  Cursor &in_;
  RawMesh &out_;
  bool wide_;
  NodeNumbers nodes_;
  ElementSink sink_;
  Array<Entity> entities_;
};

}  // namespace

void read_msh41(Cursor &in, RawMesh &out, size_t size_bytes) { Msh41Reader(in, out, size_bytes).run(); }

}  // namespace dfm
