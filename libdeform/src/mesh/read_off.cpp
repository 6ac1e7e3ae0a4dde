// OFF: "OFF" (perhaps with ST, C and N before it, which add texture, color and normal to each vertex), the
// numbers of vertices, faces and edges, vertices, and faces as "n i1 .. in" from 0 with perhaps a color
// behind. Binary OFF holds the same as big-endian 32-bit numbers.
#include <bit>

#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

class OffReader {
 public:
  OffReader(Cursor &in, RawMesh &out) : in_(in), out_(out), corners_(*out.memory) { in.comment = '#'; }

  void run() {
    read_keyword();
    const int64_t npoint = number("the number of vertices"), nface = number("the number of faces");
    if (in_.binary) number("the number of edges");
    else in_.line();  // the number of edges, which is not needed and may be missing
    const uint32_t n = in_.small(in_.count(npoint, 3, Number::f32, "vertices"), "vertices");
    out_.points.reserve(3 * size_t(n));
    for (uint32_t i = 0; i < n; ++i) read_point();
    const uint64_t m = in_.count(nface, 2, Number::i32, "faces");
    for (uint64_t f = 0; f < m; ++f) read_face(f);
  }

 private:
  void read_keyword() {
    in_.skip_space();
    const size_t at = in_.offset();
    std::string_view word = in_.word();
    // the keyword may be absent
    if (!word.empty() && word.front() >= '0' && word.front() <= '9' && word.find("OFF") == word.npos)
      return in_.seek(at);
    const std::string whole(word.substr(0, 16));
    if (word.substr(0, 2) == "ST") {
      extra_ += 2;
      word.remove_prefix(2);
    }
    if (word.substr(0, 1) == "C") {
      extra_ += 4;
      word.remove_prefix(1);
    }
    if (word.substr(0, 1) == "N") {
      extra_ += 3;
      word.remove_prefix(1);
    }
    if (word == "4OFF" || word == "nOFF" || word == "4nOFF")
      in_.unsupported("%s has points of other than three coordinates; expected OFF",
                      Cursor::quote(whole).c_str());
    if (word != "OFF") {
      in_.seek(at);
      in_.refuse("expected OFF (or COFF, NOFF, STOFF) at the start, found %s", Cursor::quote(whole).c_str());
    }
    const size_t behind = in_.offset();
    if (in_.line_word() != "BINARY") return in_.seek(behind);
    in_.end_line("BINARY");
    in_.binary = true;
    in_.swap = std::endian::native == std::endian::little;
  }

  int64_t number(const char *what) { return in_.integer(Number::i32, what); }

  void read_point() {
    for (int k = 0; k < 3; ++k) out_.points.push_back(in_.real(Number::f32, "a vertex's coordinate"));
    if (in_.binary) in_.skip(4 * extra_, "a vertex's color or normal");
    else in_.line();
  }

  void read_face(uint64_t face) {
    const int64_t n = number("a face's number of corners");
    read_corners(in_, Number::i32, face, n, out_.npoint(), corners_);
    out_.add_polygon(in_, corners_.data(), corners_.size(), kNoGroup);
    if (in_.binary)
      in_.skip(4 * in_.count(number("a face's number of colors"), 4, "colors of a face"), "a face's color");
    else in_.line();
  }

  Cursor &in_;
  RawMesh &out_;
  size_t extra_ = 0;  // numbers behind the coordinates of a binary vertex
  Array<uint32_t> corners_;
};

}  // namespace

void read_off(Cursor &in, RawMesh &out) { OffReader(in, out).run(); }

}  // namespace dfm
