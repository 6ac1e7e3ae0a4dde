// OBJ: records of one line each (a backslash continues it): "v x y z", "f 1 2 3" with corners from 1, or from
// -1 backwards, of which a texture and a normal may follow behind slashes. A triangle's group is what "g"
// says, else "usemtl", else "o". All other records are skipped.
#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

class ObjReader {
 public:
  ObjReader(Cursor &in, RawMesh &out) : in_(in), out_(out), corners_(*out.memory) {}

  void run() {
    bool any = false;
    for (; in_.left(); in_.line()) {
      ended_ = false;
      const std::string_view word = next();
      if (word == "v") read_point();
      else if (word == "f" || word == "fo") read_face();
      else if (word == "g") set(group_, name());
      else if (word == "usemtl") set(material_, name());
      else if (word == "o") set(object_, name());
      else if (word.empty()) continue;
      else if (!is_known(word))
        in_.refuse("expected a record such as v, vn, vt, f or g, found %s", Cursor::quote(word).c_str());
      any = true;
      while (!next().empty()) {}
    }
    if (!any) in_.refuse("no records; the file holds no mesh");
  }

 private:
  // Every keyword of the format; anything else is not an OBJ file.
  static bool is_known(std::string_view word) {
    for (const char *k :
         {"vt",     "vn",         "vp",        "p",     "l",     "s",    "mg",    "mtllib",   "maplib",
          "usemap", "cstype",     "deg",       "bmat",  "step",  "curv", "curv2", "surf",     "parm",
          "trim",   "hole",       "scrv",      "sp",    "end",   "con",  "bevel", "c_interp", "d_interp",
          "lod",    "shadow_obj", "trace_obj", "ctech", "stech", "call", "csh"})
      if (word == k) return true;
    return false;
  }

  // The next word of a record, which may go on in further lines; empty at its end and before a comment.
  std::string_view next() {
    const std::string_view word = ended_ ? std::string_view() : in_.line_word();
    ended_ = word.empty() || word.front() == '#';
    return ended_ ? std::string_view() : word;
  }

  // A record's name: the rest of its line without blanks at its ends.
  std::string_view name() {
    const std::string_view first = next();
    if (first.empty()) return {};
    std::string_view last = first;
    for (std::string_view w = in_.line_word(); !w.empty(); w = in_.line_word()) last = w;
    return {first.data(), size_t(last.data() + last.size() - first.data())};
  }

  void set(std::string_view &which, std::string_view name) {
    which = name == "default" || name == "off" || name == "(null)" ? std::string_view() : name;
    const std::string_view current = !group_.empty() ? group_ : !material_.empty() ? material_ : object_;
    if (current == current_) return;
    current_ = current;
    stale_ = true;  // a group without faces is none
  }

  void read_point() {
    if (out_.npoint() == kMaxPoints) in_.unsupported("more than %u points", kMaxPoints);
    for (int k = 0; k < 3; ++k) out_.points.push_back(in_.to_real(in_.line_word(), "a vertex's coordinate"));
  }

  void read_face() {
    corners_.clear();
    for (std::string_view word = next(); !word.empty(); word = next()) corners_.push_back(corner(word));
    if (corners_.size() < 3) in_.refuse("a face with %zu corners; expected 3 or more", corners_.size());
    if (stale_) {
      in_group_ = out_.named_group(in_, 2, current_);
      stale_ = false;
    }
    out_.add_polygon(in_, corners_.data(), corners_.size(), in_group_);
  }

  uint32_t corner(std::string_view word) {
    const int64_t n = out_.npoint();
    const int64_t given = in_.to_integer(word.substr(0, word.find('/')), "a face's vertex");
    const int64_t at = given < 0 ? n + given : given - 1;
    if (given == 0)
      in_.refuse("a face refers to vertex 0; vertices are counted from 1, or from -1 backwards");
    if (at < 0 || at >= n)
      in_.refuse("a face refers to vertex %lld, but only %lld stand before it", ll(given), ll(n));
    return static_cast<uint32_t>(at);
  }

  Cursor &in_;
  RawMesh &out_;
  Array<uint32_t> corners_;
  std::string_view group_, material_, object_, current_;
  bool stale_ = false, ended_ = false;
  uint32_t in_group_ = kNoGroup;
};

}  // namespace

void read_obj(Cursor &in, RawMesh &out) { ObjReader(in, out).run(); }

}  // namespace dfm
