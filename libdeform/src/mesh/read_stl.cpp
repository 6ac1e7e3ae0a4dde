// STL, ASCII ("solid", facets of three vertices, "endsolid"; several solids, any case) and binary (80 bytes
// of anything, the number of triangles,
// 50 bytes each). Corners are points of their own; finish_surface joins them. A binary file may begin with
// "solid" too, so its size decides, and a byte 0, which no text has.
#include <bit>

#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

constexpr size_t kHead = 84, kEach = 50;

class StlReader {
 public:
  StlReader(Cursor &in, RawMesh &out) : in_(in), out_(out) { out_.own_corners = true; }

  void run() {
    const size_t size = in_.left();
    const bool solid = Cursor::is_word(Cursor(in_).word(), "solid") &&
                       in_.rest().substr(0, kHead).find('\0') == std::string_view::npos;
    const bool room = size >= kHead;
    if (room) in_.skip(kHead - 4, "the head");
    in_.binary = room;
    in_.swap = std::endian::native == std::endian::big;
    const uint64_t n = room ? in_.value<uint32_t>("the number of triangles") : 0;
    const uint64_t wanted = kHead + kEach * n;
    if (room && (wanted == size || (!solid && wanted < size && size - wanted < kEach))) return read_binary(n);
    in_.seek(0);
    in_.binary = false;
    if (solid) return read_text();
    if (!room)
      in_.refuse(
          "%zu bytes; expected an ASCII STL, which begins with 'solid', or a binary one of at least %zu "
          "bytes",
          size, kHead);
    in_.binary = true;
    in_.refuse(
        "a binary STL of %zu bytes promises %llu triangles, which take %llu: the file is truncated or its "
        "count is wrong",
        size, ull(n), ull(wanted));
  }

 private:
  void corner(double x, double y, double z) { out_.points.insert(out_.points.end(), {x, y, z}); }

  void triangle() {
    const uint32_t last = in_.small(out_.points.size() / 3, "corners");
    const uint32_t corners[3] = {last - 3, last - 2, last - 1};
    out_.add_polygon(in_, corners, 3, group_);
  }

  void read_binary(uint64_t n) {
    out_.points.reserve(9 * n);
    out_.tris.reserve(3 * n);
    out_.tri_group.reserve(n);
    for (uint64_t t = 0; t < n; ++t) {
      in_.skip(12, "a triangle's normal");  // follows from the corners
      double x[3];
      for (int k = 0; k < 3; ++k) {
        for (double &c : x) c = in_.binary_real<float>("a corner's coordinate");
        corner(x[0], x[1], x[2]);
      }
      in_.skip(2, "a triangle's attribute");
      triangle();
    }
  }

  void expect(std::string_view word, const char *wanted, const char *after) {
    if (!Cursor::is_word(word, wanted))
      in_.refuse("expected '%s' after %s, found %s", wanted, after, Cursor::quote(word).c_str());
  }
  void keyword(const char *wanted, const char *after) { expect(in_.word(), wanted, after); }

  void read_text() {
    for (std::string_view word = in_.word(); !word.empty(); word = in_.word()) {
      if (!Cursor::is_word(word, "solid"))
        in_.refuse("expected 'solid' or the end of the file, found %s", Cursor::quote(word).c_str());
      read_solid();
    }
  }

  void read_solid() {
    std::string_view name = in_.line();
    name.remove_prefix(std::min(name.find_first_not_of(" \t"), name.size()));
    name = name.substr(0, name.find_last_not_of(" \t") + 1);
    bool fresh = true;
    for (;;) {
      const std::string_view word = in_.word();
      if (Cursor::is_word(word, "endsolid")) break;
      if (!Cursor::is_word(word, "facet"))
        in_.refuse("expected 'facet' or 'endsolid', found %s", Cursor::quote(word).c_str());
      if (fresh) {
        group_ = out_.named_group(in_, 2, name);
        fresh = false;
      }
      // the normal follows from the corners, and some files have none
      std::string_view after = in_.word();
      while (!after.empty() && !Cursor::is_word(after, "outer") && !Cursor::is_word(after, "vertex"))
        after = in_.word();
      expect(after, "outer", "a facet's normal");
      keyword("loop", "'outer'");
      for (int k = 0; k < 3; ++k) {
        keyword("vertex", "'outer loop' or another vertex");
        const double x = in_.real("a corner's coordinate"), y = in_.real("a corner's coordinate");
        corner(x, y, in_.real("a corner's coordinate"));
      }
      keyword("endloop", "three vertices");
      keyword("endfacet", "'endloop'");
      triangle();
    }
    in_.line();  // the name again
  }

  Cursor &in_;
  RawMesh &out_;
  uint32_t group_ = kNoGroup;
};

}  // namespace

void read_stl(Cursor &in, RawMesh &out) { StlReader(in, out).run(); }

}  // namespace dfm
