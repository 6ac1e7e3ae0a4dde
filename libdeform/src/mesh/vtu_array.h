// A DataArray of a VTU file as a cursor over numbers in any storage: text between the tags, base64 between
// the tags, or at an offset into the appended data (raw or base64); the last three may be in blocks
// compressed by zlib.
#pragma once
#include <optional>
#include <string>

#include "mesh/vtk.h"

namespace dfm {

// Attributes of one XML tag, in the order of the file.
class XmlTag {
 public:
  std::string_view name;  // without the slash
  bool closes = false;    // </name>
  bool empty = false;     // <name/>
  std::string_view attributes;
  std::string_view get(std::string_view key) const;  // empty where it is absent
};
// Moves past the next tag; skips comments and declarations. Empty at the end of the file.
std::optional<XmlTag> next_tag(Cursor &in);

// How the file packs its numbers.
struct VtuPacking {
  bool swap = false;        // byte order
  size_t header_bytes = 4;  // of each length
  bool compressed = false;
  bool appended_base64 = false;
  size_t file_bytes = 0;      // bounds what unpacking may take
  std::string_view appended;  // what follows the underscore
};

// Where one array lies.
struct VtuPlace {
  bool given = false;
  Number type = Number::f64;
  uint32_t components = 1;
  std::string name, format;
  std::string_view text;  // between the tags
  uint64_t offset = 0;    // into the appended data
};
VtuPlace vtu_place(Cursor &in, const XmlTag &tag);  // reads on to </DataArray>

class VtuNumbers {
 public:
  // `file`: where sentences point for text arrays; binary arrays name themselves.
  VtuNumbers(const Memory &memory, const Cursor &file, const VtuPacking &packing, const VtuPlace &place);
  // Refuses where the array has not at least n numbers.
  void expect(uint64_t n, const char *what);
  Cursor in;  // public for loops over it: a.in.real(a.type, ..)
  Number type;

 private:
  Array<char> unpacked_;
};

}  // namespace dfm
