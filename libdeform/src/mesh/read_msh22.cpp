// MSH 2.0 to 2.2, ASCII and binary: nodes "number x y z", elements "number type ntags tags.. nodes..", the
// first tag the physical group.
#include "mesh/msh.h"

namespace dfm {

void MshReader::read_nodes_22(bool parametric) {
  if (parametric && in_.binary) in_.unsupported("binary $ParametricNodes of MSH 2; %s", kConvertMsh);
  const uint64_t n = in_.count(in_.integer("the number of nodes"), in_.binary ? 28 : 8, "nodes");
  nodes_.reserve(n);
  out_.points.reserve(3 * n);
  in_.begin_data("the number of nodes");
  for (uint64_t i = 0; i < n; ++i) {
    nodes_.add(in_.integer(Number::i32, "a node's number"));
    for (int k = 0; k < 3; ++k) out_.points.push_back(real("a node's coordinate"));
    if (parametric) in_.line();  // entity and parameters of the geometry, which a body has no use for
  }
  in_.expect(parametric ? "$EndParametricNodes" : "$EndNodes", "the nodes promised");
}

// Binary elements come in runs of one type: type, how many follow, tags of each; then number, tags, nodes
// of each. In text each is a run of its own, which begins with its number.
void MshReader::read_elements_22() {
  const uint64_t n = in_.count(in_.integer("the number of elements"), in_.binary ? 8 : 6, "elements");
  in_.begin_data("the number of elements");
  const auto next = [&](const char *what) { return in_.integer(Number::i32, what); };
  for (uint64_t i = 0; i < n;) {
    if (!in_.binary) next("an element's number");
    const int64_t type = next("an element's type");
    begin_elements(type);
    const int64_t follow = in_.binary ? next("a run of elements") : 1;
    const int64_t ntag = next("an element's number of tags");
    if (follow <= 0 || uint64_t(follow) > n - i)
      in_.refuse("a run of %lld elements where %llu are left", ll(follow), ull(n - i));
    if (ntag < 0) in_.refuse("an element with %lld tags", ll(ntag));
    if (in_.binary) in_.count(follow, 4 * (1 + size_t(ntag) + element_.points), "elements in a run");
    if (type == kTet) out_.expect_tets(size_t(follow));
    for (const uint64_t end = i + uint64_t(follow); i < end; ++i) {
      if (in_.binary) next("an element's number");
      int32_t physical = 0;
      for (int64_t k = 0; k < ntag; ++k) {
        const int64_t tag = next("an element's tag");
        if (k == 0) physical = in_.in_32_bits(tag, "the physical group number");
      }
      for (uint32_t k = 0; k < element_.points; ++k) tags_[k] = next("an element's node");
      add_element(out_.group(in_, element_.dimension, physical));
    }
  }
  in_.expect("$EndElements", "the elements promised");
}

}  // namespace dfm
