// Gmsh files: the head that all versions share, and what 2.2 and 4.1 have in common.
#include "mesh/msh.h"

#include <algorithm>

namespace dfm {

MshElement msh_element(int64_t type) {
  switch (type) {
    case 15: return {1, 0};
    case 1: return {2, 1};
    case 8: return {3, 1};
    case 26: return {4, 1};
    case 27: return {5, 1};
    case 28: return {6, 1};
    case 2: return {3, 2};
    case 3: return {4, 2};
    case 9: return {6, 2};
    case 10: return {9, 2};
    case 16: return {8, 2};
    case 20: return {9, 2};
    case 21: return {10, 2};
    case 22: return {12, 2};
    case 23:
    case 24: return {15, 2};
    case 25: return {21, 2};
    case 4: return {4, 3};
    case 5: return {8, 3};
    case 6: return {6, 3};
    case 7: return {5, 3};
    case 11: return {10, 3};
    case 12: return {27, 3};
    case 13: return {18, 3};
    case 14: return {14, 3};
    case 17: return {20, 3};
    case 18: return {15, 3};
    case 19: return {13, 3};
    case 29: return {20, 3};
    case 30: return {35, 3};
    case 31: return {56, 3};
    case 92: return {64, 3};
    case 93: return {125, 3};
    default: return {0, 0};
  }
}

void NodeNumbers::finish(const Cursor &in) {
  if (tags_.size() >= UINT32_MAX)
    in.unsupported("%zu nodes; up to %u are read", tags_.size(), UINT32_MAX - 1);
  if (!std::is_sorted(tags_.begin(), tags_.end())) {
    order_.resize(tags_.size());
    for (uint32_t i = 0; i < order_.size(); ++i) order_[i] = i;
    std::sort(order_.begin(), order_.end(),
              [&](uint32_t a, uint32_t b) { return tags_[a] != tags_[b] ? tags_[a] < tags_[b] : a < b; });
    std::sort(tags_.begin(), tags_.end());
  }
  const auto twice = std::adjacent_find(tags_.begin(), tags_.end());
  if (twice != tags_.end()) in.refuse("node number %lld is given twice", ll(*twice));
}

uint32_t NodeNumbers::find(const Cursor &in, int64_t tag) const {
  size_t at;
  if (!tags_.empty() && tag >= tags_.front() && tag <= tags_.back()) {
    at = size_t(uint64_t(tag) - uint64_t(tags_.front()));  // where numbers have no gaps, this is the place
    if (at >= tags_.size() || tags_[at] != tag)
      at = size_t(std::lower_bound(tags_.begin(), tags_.end(), tag) - tags_.begin());
    if (tags_[at] == tag) return order_.empty() ? uint32_t(at) : order_[at];
  }
  in.refuse("an element uses node %lld, which the file does not define", ll(tag));
}

uint32_t ElementSink::begin(const Cursor &in, int64_t type) {
  element_ = msh_element(type);
  if (element_.points == 0) in.refuse("element type %lld is not known; 4 is a tetrahedron", ll(type));
  if (element_.dimension == 3 && type != kMshTet) {
    const bool tet = type == 11 || (type >= 29 && type <= 31);
    in.unsupported(tet ? "second- or higher-order tetrahedra (element type %lld, %u points); %s"
                       : "element type %lld (%u points) is a hexahedron, prism or pyramid; only tetrahedra "
                         "are read: mesh the volume with tetrahedra, or split the cells; then %s",
                   ll(type), element_.points, kConvertMsh);
  }
  return element_.points;
}

void ElementSink::add(const Cursor &in, uint32_t group, const int64_t *tags) {
  uint32_t corners[4];
  const bool straight = element_.points <= 4;
  if (straight && element_.dimension >= 2) {
    for (uint32_t k = 0; k < element_.points; ++k) corners[k] = nodes_.find(in, tags[k]);
    if (element_.dimension == 3) out_.add_tet(in, corners, group);
    else out_.add_polygon(in, corners, element_.points, group);
    return;
  }
  curved_ += element_.dimension == 2;
  for (uint32_t k = 0; k < element_.points; ++k) {
    const uint32_t point = nodes_.find(in, tags[k]);
    if (group != kNoGroup) out_.groups[group].points.push_back(point);
  }
}

void ElementSink::finish(const Cursor &in) const {
  if (curved_ && out_.tets.empty() && out_.tris.empty())
    in.unsupported("%llu second- or higher-order triangles or quadrangles and nothing straight; %s",
                   ull(curved_), kConvertMsh);
}

int32_t msh_int(const Cursor &in, int64_t value, const char *what) {
  if (value < INT32_MIN || value > INT32_MAX) in.refuse("%s %lld does not fit 32 bits", what, ll(value));
  return static_cast<int32_t>(value);
}

void skip_section(Cursor &in, std::string_view name) {
  const std::string end = "$End" + std::string(name.substr(1));
  if (!in.find(end))
    in.refuse("section %s has no end; expected %s", Cursor::quote(name).c_str(), Cursor::quote(end).c_str());
  in.word();
}

void read_physical_names(Cursor &in, RawMesh &out) {
  const uint64_t n = in.count(in.integer("the number of physical names"), 6, "physical names");
  for (uint64_t i = 0; i < n; ++i) {
    const int64_t dimension = in.integer("a physical group's dimension");
    if (dimension < 0 || dimension > 3)
      in.refuse("a physical group of dimension %lld; expected 0 to 3", ll(dimension));
    const int32_t tag = msh_int(in, in.integer("a physical group's number"), "the physical group number");
    const std::string_view text = in.line();
    const size_t open = text.find('"'), close = text.rfind('"');
    if (open == std::string_view::npos || close == open)
      in.refuse("expected a physical group's name in double quotes, found %s",
                Cursor::quote(text.empty() ? " " : text).c_str());
    const uint32_t group = out.group(in, static_cast<int32_t>(dimension), tag);
    if (group != kNoGroup && close > open + 1)
      out.groups[group].name.assign(text.substr(open + 1, close - open - 1));
  }
  in.expect("$EndPhysicalNames", "the physical names");
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
  const bool two = version >= 2.0 && version <= 2.2, four = version == 4.1;
  if (!two && !four) {
    if (version == 1.0 || version == 4.0 || version == 3.0)
      in.unsupported("MSH version %.1f is not read; %s", version, kConvertMsh);
    in.unsupported("MSH version %g is not known; 2.2 and 4.1 are read", version);
  }
  if (type != 0 && type != 1) in.refuse("file type %lld; expected 0 (ASCII) or 1 (binary)", ll(type));
  if (size != 8 && !(four && size == 4)) in.refuse("data size %lld; expected 8", ll(size));
  if (type == 1) {
    in.end_line("the data size");
    in.binary = true;
    const uint32_t one = in.value<uint32_t>("the byte-order mark");
    if (one != 1 && one != 0x01000000u) in.refuse("byte-order mark %u; expected the number 1", one);
    in.swap = one != 1;
  }
  in.expect("$EndMeshFormat", "the format");
  if (two) read_msh22(in, out);
  else read_msh41(in, out, size_t(size));
}

}  // namespace dfm
