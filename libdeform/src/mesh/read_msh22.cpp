// MSH 2.0 to 2.2, ASCII and binary: nodes "number x y z", elements "number type ntags tags.. nodes..", the
// first tag the physical group.
#include "mesh/msh.h"

namespace dfm {
namespace {

void read_nodes(Cursor &in, RawMesh &out, NodeNumbers &nodes, bool parametric) {
  const uint64_t n = in.count(in.integer("the number of nodes"), in.binary ? 28 : 8, "nodes");
  nodes.reserve(n);
  out.points.reserve(3 * n);
  if (in.binary) in.end_line("the number of nodes");
  for (uint64_t i = 0; i < n; ++i) {
    nodes.add(in.binary ? in.value<int32_t>("a node") : in.integer("a node's number"));
    for (int k = 0; k < 3; ++k)
      out.points.push_back(in.binary ? in.binary_real("a node's coordinate")
                                     : in.real("a node's coordinate"));
    if (parametric) in.line();  // entity and parameters of the geometry, which a body has no use for
  }
  in.expect(parametric ? "$EndParametricNodes" : "$EndNodes", "the nodes promised");
  nodes.finish(in);
}

void read_text_elements(Cursor &in, RawMesh &out, ElementSink &sink) {
  const uint64_t n = in.count(in.integer("the number of elements"), 6, "elements");
  int64_t tags[kMaxElementPoints];
  for (uint64_t i = 0; i < n; ++i) {
    in.integer("an element's number");
    const int64_t type = in.integer("an element's type");
    const uint32_t points = sink.begin(in, type);
    const int64_t ntag = in.integer("an element's number of tags");
    if (ntag < 0) in.refuse("an element with %lld tags", ll(ntag));
    int32_t physical = 0;
    for (int64_t k = 0; k < ntag; ++k) {
      const int64_t tag = in.integer("an element's tag");
      if (k == 0) physical = msh_int(in, tag, "the physical group number");
    }
    for (uint32_t k = 0; k < points; ++k) tags[k] = in.integer("an element's node");
    sink.add(in, out.group(in, msh_element(type).dimension, physical), tags);
  }
}

// Binary elements come in runs of one type: type, how many follow, tags of each; then number, tags,
// nodes of each.
void read_binary_elements(Cursor &in, RawMesh &out, ElementSink &sink) {
  const uint64_t n = in.count(in.integer("the number of elements"), 8, "elements");
  in.end_line("the number of elements");
  int64_t tags[kMaxElementPoints];
  for (uint64_t i = 0; i < n;) {
    const int32_t type = in.value<int32_t>("an element's type");
    const int32_t follow = in.value<int32_t>("a run of elements");
    const int32_t ntag = in.value<int32_t>("a number of tags");
    const uint32_t points = sink.begin(in, type);
    if (follow <= 0 || uint64_t(follow) > n - i)
      in.refuse("a run of %d elements where %llu are left", follow, ull(n - i));
    if (ntag < 0) in.refuse("elements with %d tags", ntag);
    in.count(follow, 4 * (1 + size_t(ntag) + points), "elements in a run");
    if (type == kMshTet) out.expect_tets(size_t(follow));
    for (int32_t e = 0; e < follow; ++e, ++i) {
      in.value<int32_t>("an element's number");
      int32_t physical = 0;
      for (int32_t k = 0; k < ntag; ++k) {
        const int32_t tag = in.value<int32_t>("an element's tag");
        if (k == 0) physical = tag;
      }
      for (uint32_t k = 0; k < points; ++k) tags[k] = in.value<int32_t>("an element's node");
      sink.add(in, out.group(in, msh_element(type).dimension, physical), tags);
    }
  }
}

}  // namespace

void read_msh22(Cursor &in, RawMesh &out) {
  NodeNumbers nodes(*out.memory);
  ElementSink sink(out, nodes);
  bool have_nodes = false, have_elements = false;
  for (std::string_view section = in.word(); !section.empty(); section = in.word()) {
    if (section == "$PhysicalNames") {
      read_physical_names(in, out);
    } else if (section == "$Nodes" || section == "$ParametricNodes") {
      const bool parametric = section != "$Nodes";
      if (have_nodes) in.refuse("a second section of nodes; one mesh per file is read");
      if (parametric && in.binary) in.unsupported("binary $ParametricNodes of MSH 2; %s", kConvertMsh);
      read_nodes(in, out, nodes, parametric);
      have_nodes = true;
    } else if (section == "$Elements") {
      if (!have_nodes) in.refuse("$Elements before $Nodes; expected the nodes first");
      if (have_elements) in.refuse("a second $Elements section; one mesh per file is read");
      in.binary ? read_binary_elements(in, out, sink) : read_text_elements(in, out, sink);
      in.expect("$EndElements", "the elements promised");
      have_elements = true;
    } else if (section[0] == '$') skip_section(in, section);
    else
      in.refuse("expected a section such as $Nodes or $Elements, found %s", Cursor::quote(section).c_str());
  }
  if (!have_nodes || !have_elements)
    in.refuse("no %s section; the file is truncated or holds no mesh", have_nodes ? "$Elements" : "$Nodes");
  sink.finish(in);
}

}  // namespace dfm
