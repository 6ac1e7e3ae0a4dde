// Gmsh files: the head that all versions share, sections, and elements.
#include "mesh/msh.h"

#include <algorithm>

#include "deform/plugin.h"

namespace dfm {

void MshReader::begin_elements(int64_t type) {
  // by number; there is none between 31 and 92
  static constexpr Element kKnown[32] = {
      {0, 0},  {2, 1},  {3, 2},  {4, 2},  {4, 3}, {8, 3}, {6, 3},  {5, 3},  {3, 1},  {6, 2}, {9, 2},
      {10, 3}, {27, 3}, {18, 3}, {14, 3}, {1, 0}, {8, 2}, {20, 3}, {15, 3}, {13, 3}, {9, 2}, {10, 2},
      {12, 2}, {15, 2}, {15, 2}, {21, 2}, {4, 1}, {5, 1}, {6, 1},  {20, 3}, {35, 3}, {56, 3}};
  element_ = type == 92   ? Element{64, 3}
             : type == 93 ? Element{125, 3}
                          : kKnown[type > 0 && type < 32 ? type : 0];
  if (element_.points == 0) in_.refuse("element type %lld is not known; 4 is a tetrahedron", ll(type));
  cell_ = nullptr;
  for (const CellKind &kind : cell_kinds())
    if (kind.msh == type) cell_ = &kind;
  curved_face_ = type == 9 || type == 10 || type == 16;
  if (element_.dimension == 3 && !cell_) {
    const bool tet = type >= 29 && type <= 31;
    in_.unsupported(tet ? "tetrahedra above second order (element type %lld, %u points); %s"
                        : "element type %lld (%u points) is a prism, a pyramid or a hexahedron above second "
                          "order; tetrahedra and hexahedra of first and second order are read: mesh the "
                          "volume with these; then %s",
                    ll(type), element_.points, kConvertMsh);
  }
}

void MshReader::add_element(uint32_t group) {
  uint32_t corners[kMaxNodes];
  if (cell_ || curved_face_ || (element_.points <= 4 && element_.dimension == 2)) {
    for (uint32_t k = 0; k < element_.points; ++k)
      corners[cell_ && cell_->in_msh ? cell_->in_msh[k] : k] = nodes_.find(in_, tags_[k]);
    if (cell_) out_.add_cell(in_, cell_->kind, corners, group);
    else if (curved_face_) out_.add_second_order(in_, corners, element_.points, group);
    else out_.add_polygon(in_, corners, element_.points, group);
    return;
  }
  curved_ += element_.dimension == 2;
  for (uint32_t k = 0; k < element_.points; ++k) {
    const uint32_t point = nodes_.find(in_, tags_[k]);
    out_.keep_points(&point, 1, group);
  }
}

namespace {

// Moves past "$NAME" content that is not used, to after "$EndNAME".
void skip_section(Cursor &in, std::string_view name) {
  const std::string end = "$End" + std::string(name.substr(1));
  if (!in.find(end))
    in.refuse("section %s has no end; expected %s", Cursor::quote(name).c_str(), Cursor::quote(end).c_str());
  in.word();
}

}  // namespace

void MshReader::read_physical_names() {
  const uint64_t n = in_.count(in_.integer("the number of physical names"), 6, "physical names");
  for (uint64_t i = 0; i < n; ++i) {
    const int64_t dimension = in_.integer("a physical group's dimension");
    if (dimension < 0 || dimension > 3)
      in_.refuse("a physical group of dimension %lld; expected 0 to 3", ll(dimension));
    const int32_t tag = in_.in_32_bits(in_.integer("a physical group's number"), "the physical group number");
    const std::string_view text = in_.line();
    const size_t open = text.find('"'), close = text.rfind('"');
    if (open == std::string_view::npos || close == open)
      in_.refuse("expected a physical group's name in double quotes, found %s",
                 Cursor::quote(text.empty() ? " " : text).c_str());
    const uint32_t group = out_.group(in_, static_cast<int32_t>(dimension), tag);
    if (group != kNoGroup && close > open + 1)
      out_.groups[group].name.assign(text.substr(open + 1, close - open - 1));
  }
  in_.expect("$EndPhysicalNames", "the physical names");
}

void MshReader::run() {
  bool nodes = false, elements = false;
  for (std::string_view section = in_.word(); !section.empty(); section = in_.word()) {
    const bool parametric = !four_ && section == "$ParametricNodes";
    if (section == "$PhysicalNames") {
      read_physical_names();
    } else if (four_ && (section == "$Entities" || section == "$PartitionedEntities")) {
      if (elements) in_.refuse("$Entities after $Elements; expected them first");
      read_entities_4(section != "$Entities");
    } else if (parametric || section == "$Nodes") {
      if (nodes)
        in_.refuse("a second %s; one mesh per file is read", four_ ? "$Nodes section" : "section of nodes");
      if (four_) read_nodes_4();
      else read_nodes_22(parametric);
      nodes_.finish(in_);
      nodes = true;
    } else if (section == "$Elements") {
      if (!nodes) in_.refuse("$Elements before $Nodes; expected the nodes first");
      if (elements) in_.refuse("a second $Elements section; one mesh per file is read");
      if (four_) read_elements_4();
      else read_elements_22();
      elements = true;
    } else if (section[0] == '$') skip_section(in_, section);
    else
      in_.refuse("expected a section such as $Nodes or $Elements, found %s", Cursor::quote(section).c_str());
  }
  if (!nodes || !elements)
    in_.refuse("no %s section; the file is truncated or holds no mesh", nodes ? "$Elements" : "$Nodes");
  if (curved_ && out_.tets.empty() && out_.tris.empty())
    in_.unsupported("%llu triangles or quadrangles above second order and nothing straight; %s", ull(curved_),
                    kConvertMsh);
}

void read_msh(Cursor &in, RawMesh &out) {
  std::string_view section = in.word();
  while (section == "$Comments") {
    skip_section(in, section);
    section = in.word();
  }
  if (section == "$NOD") in.unsupported("MSH version 1 ($NOD) is not read; %s", kConvertMsh);
  if (section != "$MeshFormat") {
    in.seek(0);
    in.refuse("expected $MeshFormat at the start of a gmsh file, found %s", Cursor::quote(section).c_str());
  }
  const double version = in.real("the format version");
  const int64_t type = in.integer("the file type"), size = in.integer("the data size");
  const bool two = version >= 2.0 && version <= 2.2, four = version == 4.0 || version == 4.1;
  if (!two && !four) {
    if (version == 1.0 || version == 3.0)
      in.unsupported("MSH version %.1f is not read; %s", version, kConvertMsh);
    in.unsupported("MSH version %g is not known; 2.2, 4.0 and 4.1 are read", version);
  }
  if (type != 0 && type != 1) in.refuse("file type %lld; expected 0 (ASCII) or 1 (binary)", ll(type));
  if (size != 8 && !(version == 4.1 && size == 4)) in.refuse("data size %lld; expected 8", ll(size));
  if (type == 1) {
    in.end_line("the data size");
    in.binary = true;
    const uint32_t one = in.value<uint32_t>("the byte-order mark");
    if (one != 1 && one != 0x01000000u) in.refuse("byte-order mark %u; expected the number 1", one);
    in.swap = one != 1;
  }
  in.expect("$EndMeshFormat", "the format");
  MshReader(in, out, version, size == 8).run();
}

}  // namespace dfm
