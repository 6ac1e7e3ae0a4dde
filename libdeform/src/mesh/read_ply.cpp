// PLY: a text head that declares elements and their properties, then the elements one after another as text
// or as binary of either byte order. Of the vertices x y z are kept, of the faces the list of corners and a
// whole-number property that numbers groups; all else is skipped.
#include <bit>
#include <optional>

#include "mesh/raw_mesh.h"

namespace dfm {
namespace {

struct Property {
  std::string_view name;
  Number type = Number::f64;
  std::optional<Number> count;  // of a list
};
struct Element {
  std::string_view name;
  int64_t number = 0;
  std::vector<Property> properties;
};

class PlyReader {
 public:
  PlyReader(Cursor &in, RawMesh &out) : in_(in), out_(out), corners_(*out.memory) {}

  void run() {
    read_head();
    for (const Element &e : elements_) read_element(e);
    if (out_.npoint() != npoint_) in_.refuse("%u vertices are declared without properties", npoint_);
  }

 private:
  Number number_type(std::string_view name) const {
    static const std::pair<std::string_view, Number> known[] = {
        {"char", Number::i8},   {"uchar", Number::u8},   {"short", Number::i16},   {"ushort", Number::u16},
        {"int", Number::i32},   {"uint", Number::u32},   {"float", Number::f32},   {"double", Number::f64},
        {"int8", Number::i8},   {"uint8", Number::u8},   {"int16", Number::i16},   {"uint16", Number::u16},
        {"int32", Number::i32}, {"uint32", Number::u32}, {"float32", Number::f32}, {"float64", Number::f64}};
    for (const auto &[text, type] : known)
      if (text == name) return type;
    in_.refuse("expected a number type (float, double, int, uchar ...), found %s",
               Cursor::quote(name.empty() ? " " : name).c_str());
  }

  void read_head() {
    if (in_.line_word() != "ply") in_.refuse("expected 'ply' in the first line");
    in_.line();
    bool format = false, binary = false;
    for (;;) {
      if (in_.left() == 0) in_.refuse("end_header is missing: the file is truncated");
      const std::string_view word = in_.line_word();
      if (word == "end_header") break;
      if (word == "format") {
        format = true;
        binary = read_format();
      } else if (word == "element") read_element_head();
      else if (word == "property") read_property();
      else if (!word.empty() && word != "comment" && word != "obj_info")
        in_.refuse("expected format, comment, element, property or end_header, found %s",
                   Cursor::quote(word).c_str());
      in_.line();
    }
    if (!format) in_.refuse("the head has no format line");
    in_.end_line("end_header");
    in_.binary = binary;
  }

  bool read_format() {
    const std::string_view form = in_.line_word();
    const bool little = form == "binary_little_endian", big = form == "binary_big_endian";
    if (!little && !big && form != "ascii")
      in_.refuse("format %s; expected ascii, binary_little_endian or binary_big_endian",
                 Cursor::quote(form.empty() ? " " : form).c_str());
    in_.swap =
        little ? std::endian::native != std::endian::little : std::endian::native == std::endian::little;
    return little || big;
  }

  void read_element_head() {
    const std::string_view name = in_.line_word();
    const int64_t number = in_.to_integer(in_.line_word(), "the number of elements");
    if (number < 0) in_.refuse("promises %lld elements; a count cannot be negative", ll(number));
    if (name == "vertex" || name == "face")  // others are passed over
      for (const Element &e : elements_)
        if (e.name == name) in_.refuse("element %s is declared twice", Cursor::quote(name).c_str());
    if (name == "vertex") npoint_ = in_.small(static_cast<uint64_t>(number), "vertices");
    elements_.push_back({name, number, {}});
  }

  void read_property() {
    if (elements_.empty()) in_.refuse("a property before any element");
    const std::string_view first = in_.line_word();
    Property p;
    if (first == "list") {
      p.count = number_type(in_.line_word());
      if (is_real(*p.count)) in_.refuse("a list counted by floating-point numbers");
      p.type = number_type(in_.line_word());
    } else {
      p.type = number_type(first);
    }
    p.name = in_.line_word();
    elements_.back().properties.push_back(p);
  }

  uint64_t list_length(const Property &p) {
    return in_.count(in_.integer(*p.count, "the length of a list"), 1, p.type, "values in a list");
  }

  void pass_over(const Property &p) {
    const uint64_t n = p.count ? list_length(p) : 1;
    if (in_.binary) return in_.skip(n * bytes_of(p.type), "a property");
    for (uint64_t i = 0; i < n; ++i)
      if (in_.word().empty())
        in_.refuse("the file ends inside property %s", Cursor::quote(p.name.empty() ? " " : p.name).c_str());
  }

  void read_element(const Element &e) {
    if (e.properties.empty()) return;  // takes no bytes
    if (e.name == "tristrips" && e.number > 0)
      in_.unsupported(
          "triangle strips; save the surface with faces (for instance meshlab, or meshio convert FILE "
          "OUT.obj)");
    size_t least = 0;
    for (const Property &p : e.properties) least += bytes_of(p.count.value_or(p.type));
    const std::string name = "elements " + Cursor::quote(e.name);
    const uint64_t n = in_.binary ? in_.count(e.number, least, name.c_str())
                                  : in_.text_count(e.number, e.properties.size(), name.c_str());
    if (e.name == "vertex") read_points(e, n);
    else if (e.name == "face") read_faces(e, n);
    else
      for (uint64_t i = 0; i < n; ++i)
        for (const Property &p : e.properties) pass_over(p);
  }

  void read_points(const Element &e, uint64_t n) {
    int axis_of[3] = {-1, -1, -1};
    for (size_t k = 0; k < e.properties.size(); ++k)
      for (int c = 0; c < 3; ++c)
        if (e.properties[k].name == std::string_view("xyz").substr(size_t(c), 1) && !e.properties[k].count)
          axis_of[c] = int(k);
    for (int c = 0; c < 3; ++c)
      if (axis_of[c] < 0) in_.refuse("vertices have no property %c", "xyz"[c]);
    out_.points.reserve(3 * n);
    for (uint64_t i = 0; i < n; ++i) {
      double x[3] = {};
      for (int k = 0; k < int(e.properties.size()); ++k) {
        const int c = k == axis_of[0] ? 0 : k == axis_of[1] ? 1 : k == axis_of[2] ? 2 : -1;
        if (c < 0) pass_over(e.properties[size_t(k)]);
        else x[c] = in_.real(e.properties[size_t(k)].type, "a vertex's coordinate");
      }
      out_.points.insert(out_.points.end(), x, x + 3);
    }
  }

  void read_faces(const Element &e, uint64_t n) {
    const Property *list = nullptr, *label = nullptr;
    for (const Property &p : e.properties) {
      if (p.count && (p.name == "vertex_indices" || p.name == "vertex_index")) list = &p;
      if (!p.count && is_whole(p.type) && !label &&
          (p.name == "group" || p.name == "material_index" || p.name == "material"))
        label = &p;
    }
    if (!list) in_.refuse("faces have no list vertex_indices");
    if (!is_whole(list->type)) in_.refuse("vertex_indices are not whole numbers");
    for (uint64_t f = 0; f < n; ++f) {
      int64_t number = 0;
      for (const Property &p : e.properties) {
        if (&p == list) read_corners(in_, p.type, f, int64_t(list_length(p)), npoint_, corners_);
        else if (&p == label) number = in_.integer(p.type, "a face's group");
        else pass_over(p);
      }
      const uint32_t group = number < INT32_MIN || number > INT32_MAX
                                 ? kNoGroup
                                 : out_.group(in_, 2, static_cast<int32_t>(number));
      out_.add_polygon(in_, corners_.data(), corners_.size(), group);
    }
  }

  Cursor &in_;
  RawMesh &out_;
  std::vector<Element> elements_;
  uint32_t npoint_ = 0;
  Array<uint32_t> corners_;
};

}  // namespace

void read_ply(Cursor &in, RawMesh &out) { PlyReader(in, out).run(); }

}  // namespace dfm
