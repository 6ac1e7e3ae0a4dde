// MSH 4.0 and 4.1, ASCII and binary: nodes and elements in blocks, one per entity of the geometry; $Entities
// has the physical groups of each. Counts and numbers are size_t of the writing machine (data size 8 or 4),
// entity and type numbers are int. In 4.0 all numbers are int, points have a box, too, blocks begin with
// their entity, and a node's number stands before its place. Of a mesh that gmsh divided, elements are in
// $PartitionedEntities.
#include <algorithm>
#include <cstdlib>

#include "mesh/msh.h"

namespace dfm {

int64_t MshReader::size(const char *what) {
  const int64_t v = in_.integer(size_type(), what);
  if (in_.binary && v < 0) {
    in_.seek(in_.offset() - 8);
    in_.refuse("%s %llu is out of range", what, ull(static_cast<uint64_t>(v)));
  }
  return v;
}

void MshReader::read_entities_4(bool partitioned) {
  in_.begin_data(partitioned ? "$PartitionedEntities" : "$Entities");
  const auto pass = [&](size_t numbers_each, const char *some, const char *one) {
    const uint64_t m = in_.count(size(some), numbers_each * (in_.binary ? 4 : 2), some);
    for (uint64_t k = 0; k < numbers_each * m; ++k) number(one);
  };
  if (partitioned) {
    size("the number of partitions");
    pass(2, "the number of ghost entities", "a ghost entity");
  }
  Array<Entity> found{*out_.memory};
  int64_t n[4];
  for (int64_t &k : n) k = size("a number of entities");
  for (int32_t d = 0; d < 4; ++d) {
    const uint64_t m = in_.count(n[d], in_.binary ? 20 : 6, "entities");
    for (uint64_t i = 0; i < m; ++i) {
      const int32_t tag = number("an entity's number");
      uint32_t group = kNoGroup;
      if (partitioned) {
        const int32_t dimension = number("a parent's dimension"), parent = number("a parent's number");
        pass(1, "an entity's number of partitions", "a partition");
        if (dimension == d) group = group_of(d, parent);
      }
      for (int k = 0; k < (d == 0 && !first_four_ ? 3 : 6); ++k) real("an entity's box");
      const uint64_t physical =
          in_.count(size("an entity's number of physical groups"), in_.binary ? 4 : 2, "physical groups");
      for (uint64_t k = 0; k < physical; ++k) {
        int64_t named = number("a physical group's number");
        // a minus turns the entity round, but where a group has that number
        if (!out_.has_group(d, int32_t(named))) named = std::abs(named);
        if (k == 0) group = out_.group(in_, d, in_.in_32_bits(named, "a physical group's number"));
      }
      if (group != kNoGroup) found.push_back({d, tag, group});
      if (d > 0) pass(1, "an entity's number of boundaries", "a boundary entity");
    }
  }
  entities_.insert(entities_.end(), found.begin(), found.end());
  std::sort(entities_.begin(), entities_.end());
  in_.expect(partitioned ? "$EndPartitionedEntities" : "$EndEntities", "the entities promised");
}

uint32_t MshReader::group_of(int32_t dimension, int32_t tag) const {
  const Entity wanted{dimension, tag, 0};
  const auto at = std::lower_bound(entities_.begin(), entities_.end(), wanted);
  return at != entities_.end() && !(wanted < *at) ? at->group : kNoGroup;
}

void MshReader::read_nodes_4() {
  in_.begin_data("$Nodes");
  const int64_t nblock = size("the number of node blocks");
  const uint64_t nnode = in_.count(size("the number of nodes"), tag_bytes() + (in_.binary ? 24 : 6), "nodes");
  if (!first_four_) {
    size("the least node number");
    size("the greatest node number");
  }
  nodes_.reserve(nnode);
  out_.points.reserve(3 * nnode);
  for (int64_t b = 0; b < nblock; ++b) {
    if (first_four_) number("a node block's entity");
    const int32_t dimension = number("a node block's dimension");
    if (!first_four_) number("a node block's entity");
    const int32_t parametric = number("a node block's parametric flag");
    const int64_t n = size("a node block's number of nodes");
    if (dimension < 0 || dimension > 3)
      in_.refuse("a node block of dimension %d; expected 0 to 3", dimension);
    if (parametric != 0 && parametric != 1) in_.refuse("parametric flag %d; expected 0 or 1", parametric);
    const int32_t parameters = !parametric || (first_four_ && dimension == 3) ? 0 : dimension;
    if (n < 0 || uint64_t(n) > nnode - nodes_.size())
      in_.refuse("a block of %lld nodes where %llu of the %llu promised are left", ll(n),
                 ull(nnode - nodes_.size()), ull(nnode));
    for (int64_t i = 0; i < n && !first_four_; ++i) nodes_.add(tag("a node's number"));
    for (int64_t i = 0; i < n; ++i) {
      if (first_four_) nodes_.add(tag("a node's number"));
      for (int k = 0; k < 3; ++k) out_.points.push_back(real("a node's coordinate"));
      for (int k = 0; k < parameters; ++k) real("a node's parameter");
    }
  }
  in_.expect("$EndNodes", "the node blocks promised");
  if (nodes_.size() != nnode)
    in_.refuse("$Nodes promises %llu nodes, its blocks hold %zu", ull(nnode), nodes_.size());
}

void MshReader::read_elements_4() {
  in_.begin_data("$Elements");
  const int64_t nblock = size("the number of element blocks");
  const uint64_t nelement = in_.count(size("the number of elements"), 2 * tag_bytes(), "elements");
  if (!first_four_) {
    size("the least element number");
    size("the greatest element number");
  }
  uint64_t done = 0;
  for (int64_t b = 0; b < nblock; ++b) {
    int32_t entity = first_four_ ? number("an element block's entity") : 0;
    const int32_t dimension = number("an element block's dimension");
    if (!first_four_) entity = number("an element block's entity");
    const int32_t type = number("an element block's type");
    const int64_t n = size("an element block's number of elements");
    if (n < 0 || uint64_t(n) > nelement - done)
      in_.refuse("a block of %lld elements where %llu of the %llu promised are left", ll(n),
                 ull(nelement - done), ull(nelement));
    begin_elements(type);
    in_.count(n, tag_bytes() * (1 + element_.points), "elements in a block");
    if (type == kTet) out_.expect_tets(size_t(n));
    const uint32_t group = group_of(dimension, entity);
    if (group != kNoGroup && element_.dimension != dimension)
      in_.refuse("elements of type %d in an entity of dimension %d", type, dimension);
    for (int64_t i = 0; i < n; ++i) {
      tag("an element's number");
      for (uint32_t k = 0; k < element_.points; ++k) tags_[k] = tag("an element's node");
      add_element(group);
    }
    done += uint64_t(n);
  }
  in_.expect("$EndElements", "the element blocks promised");
  if (done != nelement)
    in_.refuse("$Elements promises %llu elements, its blocks hold %llu", ull(nelement), ull(done));
}

}  // namespace dfm
