// NRRD 1 to 5: a text header of "field: value" lines, an empty line, the voxels; or the voxels in a file of
// their own (.nhdr). Fields as Kindlmann's "Definition of NRRD File Format" has them.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "header_lines.h"

namespace labels {
namespace {

const Type kTypes[] = {
    {"signed char,int8,int8_t", 1, true},
    {"uchar,unsigned char,uint8,uint8_t", 1, false},
    {"short,short int,signed short,signed short int,int16,int16_t", 2, true},
    {"ushort,unsigned short,unsigned short int,uint16,uint16_t", 2, false},
    {"int,signed int,int32,int32_t", 4, true},
    {"uint,unsigned int,uint32,uint32_t", 4, false},
    {"longlong,long long,long long int,signed long long,signed long long int,int64,int64_t", 8, true},
    {"ulonglong,unsigned long long,unsigned long long int,uint64,uint64_t", 8, false}};

class Reader : private HeaderLines {
 public:
  Reader(const std::string &path, std::string_view bytes) : HeaderLines(path, bytes) {}

  Stored read() {
    bool more = true;
    while (more) {
      if (at_ >= bytes_.size()) break;  // a .nhdr may end with its last field
      more = line();
    }
    stored_.data_at = at_;
    finish();
    return std::move(stored_);
  }

 private:
  // False: the header ends with it.
  bool line() {
    const std::string_view text = next_line();
    if (text.empty()) return false;
    if (number_ == 1 || text[0] == '#') return true;
    const size_t colon = text.find(':');
    if (colon == std::string_view::npos)
      refuse_line("expected \"field: value\", found %s", quoted_part(text).c_str());
    if (colon + 1 < text.size() && text[colon + 1] == '=') {
      key_value(text.substr(0, colon), text.substr(colon + 2));
      return true;
    }
    return field(lower(trimmed(text.substr(0, colon))), trimmed(text.substr(colon + 1)));
  }

  // Names of segments as 3D Slicer writes them: Segment2_LabelValue:=3, Segment2_Name:=liver.
  void key_value(std::string_view key, std::string_view value) {
    const size_t bar = key.find('_');
    if (key.substr(0, 7) != "Segment" || bar == std::string_view::npos) return;
    int64_t number = 0;
    if (!to_number(key.substr(7, bar - 7), number)) return;
    if (key.substr(bar + 1) == "Name") segment_name_[number] = std::string(trimmed(value));
    int64_t label = 0;
    if (key.substr(bar + 1) == "LabelValue" && to_number(trimmed(value), label)) segment_[number] = label;
  }

  bool field(const std::string &name, std::string_view value) {
    if (name == "type") type(value, kTypes, "int8 to uint64");
    else if (name == "dimension") dimension_ = count(value, "dimension", 16);
    else if (name == "sizes") sizes_ = numbers<int64_t>(value, "sizes");
    else if (name == "spacings") spacings_ = spacings(value);
    else if (name == "space directions") directions(value);
    else if (name == "space origin") origin(value);
    else if (name == "space units" || name == "units") units(value);
    else if (name == "space") space(value);
    else if (name == "space dimension") count(value, "space dimension", 8);
    else if (name == "encoding") encoding(value);
    else if (name == "endian") endian(value);
    else if (name == "byte skip" || name == "byteskip") stored_.skip = skip(value, -1, int64_t(1) << 32);
    else if (name == "line skip" || name == "lineskip")
      stored_.skip_lines = uint32_t(skip(value, 0, UINT32_MAX));
    else if (name == "data file" || name == "datafile") data_file(value);
    return true;  // the others say nothing about where a voxel lies
  }

  uint32_t count(std::string_view value, const char *what, int64_t most) const {
    int64_t n = 0;
    if (!to_number(value, n) || n < 1 || n > most)
      refuse_line("expected a whole number from 1 to %lld as %s, found %s", static_cast<long long>(most),
                  what, quoted_part(value).c_str());
    return uint32_t(n);
  }

  int64_t skip(std::string_view value, int64_t least, int64_t most) const {
    int64_t n = 0;
    if (!to_number(value, n) || n < least || n > most)
      refuse_line("expected how many bytes or lines to skip, found %s", quoted_part(value).c_str());
    return n;
  }

  template <class N>
  std::vector<N> numbers(std::string_view value, const char *what) const {
    std::vector<N> out;
    for (const std::string_view word : words(value)) {
      out.emplace_back();
      if (!to_number(word, out.back()))
        refuse_line("expected numbers after %s, found %s", what, quoted_part(word).c_str());
    }
    return out;
  }

  // An axis that has no spacing says nan.
  std::vector<double> spacings(std::string_view value) const {
    std::vector<double> out;
    for (const std::string_view word : words(value)) {
      out.push_back(0);
      if (lower(word) == "nan") out.back() = NAN;
      else if (!to_number(word, out.back()))
        refuse_line("expected numbers after spacings, found %s", quoted_part(word).c_str());
    }
    return out;
  }

  // "(1,0,0)" or "none" for each axis.
  void directions(std::string_view value) {
    directions_.clear();
    while (!(value = trimmed(value)).empty()) {
      directions_.emplace_back();
      if (lower(value.substr(0, 4)) == "none") value.remove_prefix(4);
      else directions_.back() = vector(value);
    }
  }

  std::array<double, 3> vector(std::string_view &value) const {
    const size_t end = value.find(')');
    if (value[0] != '(' || end == std::string_view::npos)
      refuse_line("expected a vector such as (1,0,0), found %s", quoted_part(value).c_str());
    std::string inside(value.substr(1, end - 1));
    std::replace(inside.begin(), inside.end(), ',', ' ');
    const std::vector<double> x = numbers<double>(inside, "a vector");
    if (x.size() != 3) refuse_line("a vector has %zu numbers; the space of a label map has 3", x.size());
    value.remove_prefix(end + 1);
    return {x[0], x[1], x[2]};
  }

  // In a left-handed space the patient is mirrored.
  void space(std::string_view value) {
    const std::string word = lower(value);
    mirrored_ = is_one_of(word,
                          "left-anterior-superior,las,left-anterior-superior-time,last,3d-left-handed,"
                          "3d-left-handed-time");
  }

  void origin(std::string_view value) {
    if (value.empty()) refuse_line("expected a vector such as (1,0,0) as space origin");
    const std::array<double, 3> x = vector(value);
    std::copy_n(x.data(), 3, stored_.volume.origin);
  }

  // "mm" "mm" "mm": of the axes or of the space; one unit for all.
  void units(std::string_view value) {
    double found = 0;
    while (!value.empty()) {
      const size_t begin = value.find('"'), end = value.find('"', begin + 1);
      if (begin == std::string_view::npos || end == std::string_view::npos) break;
      const std::string_view word = trimmed(value.substr(begin + 1, end - begin - 1));
      value.remove_prefix(end + 1);
      if (word.empty() || word == "???" || lower(word) == "none") continue;
      const double meters = unit(word);
      if (found != 0 && found != meters)
        refuse_line("the axes have different units; write all lengths in millimeters");
      found = meters;
    }
    if (found != 0) stored_.unit = found;
  }

  void encoding(std::string_view value) {
    const std::string word = lower(value);
    encoded_ = true;
    if (word == "raw") return;
    if (word != "gzip" && word != "gz")
      refuse_line(
          "the voxels are stored as %s, which is not read; save the file with the encoding raw or gzip",
          quoted_part(value).c_str());
    stored_.encoding.compressed = true;
  }

  void endian(std::string_view value) {
    const std::string word = lower(value);
    if (word != "little" && word != "big")
      refuse_line("expected little or big as endian, found %s", quoted_part(value).c_str());
    stored_.encoding.big_endian = word == "big";
    ordered_ = true;
  }

  [[noreturn]] void missing(const char *what) const {
    refuse(path_, "the header has no field \"%s\"; save the label map again as NRRD", what);
  }

  // Three axes of space are left, and each has a step.
  void finish() {
    if (stored_.encoding.compressed && stored_.skip > 0)  // NRRD counts them so
      stored_.skip_unpacked = uint64_t(std::exchange(stored_.skip, 0));
    if (stored_.encoding.bytes == 0) missing("type");
    if (!encoded_) missing("encoding");
    if (dimension_ == 0) missing("dimension");
    if (sizes_.empty()) missing("sizes");
    if (stored_.encoding.bytes > 1 && !ordered_) missing("endian");
    if (sizes_.size() != dimension_)
      refuse(path_, "dimension is %u, and sizes has %zu numbers; save the label map again as NRRD",
             dimension_, sizes_.size());
    if (!directions_.empty() && directions_.size() != dimension_)
      refuse(path_, "dimension is %u, and space directions has %zu vectors", dimension_, directions_.size());
    if (!spacings_.empty() && spacings_.size() != dimension_)
      refuse(path_, "dimension is %u, and spacings has %zu numbers", dimension_, spacings_.size());
    std::vector<size_t> axes;
    for (size_t k = 0; k < dimension_; ++k) {
      const bool in_space = directions_.empty() || directions_[k].has_value();
      if (in_space && (dimension_ <= 3 || sizes_[k] != 1 || directions_.size() == dimension_))
        axes.push_back(k);
      else if (sizes_[k] != 1)
        refuse(path_,
               "axis %zu has %lld values per voxel; overlapping segments have one layer each: export them as "
               "one label map of 3 axes",
               k, static_cast<long long>(sizes_[k]));
    }
    if (axes.size() != 3) refuse(path_, "the volume has %zu axes of space; a label map has 3", axes.size());
    bool spaced = true;
    for (size_t k = 0; k < 3; ++k) {
      const int64_t n = sizes_[axes[k]];
      if (n < 1 || n > 65535)
        refuse(path_, "axis %zu has %lld voxels; from 1 to 65,535 are read", axes[k],
               static_cast<long long>(n));
      stored_.volume.size[k] = uint32_t(n);
      step(k, axes[k], spaced);
    }
    if (mirrored_) {
      stored_.volume.origin[1] = -stored_.volume.origin[1];
      for (auto &axis : stored_.volume.axis) axis[1] = -axis[1];
      stored_.volume.notes.push_back(
          "the file's space is left-handed; y was negated, so that nothing is mirrored");
    }
    if (!spaced) stored_.volume.notes.push_back("the file gives no spacing; 1 was taken for each axis");
    for (const auto &[segment, label] : segment_)
      if (segment_name_.count(segment)) stored_.volume.name[label] = segment_name_[segment];
  }

  void step(size_t k, size_t axis, bool &spaced) {
    double *out = stored_.volume.axis[k];
    if (!directions_.empty()) {
      std::copy_n(directions_[axis]->data(), 3, out);
      return;
    }
    const bool given = !spacings_.empty() && !std::isnan(spacings_[axis]);
    spaced = spaced && given;
    out[k] = given ? spacings_[axis] : 1;
  }

  uint32_t dimension_ = 0;
  bool encoded_ = false, ordered_ = false, mirrored_ = false;
  std::vector<int64_t> sizes_;
  std::vector<double> spacings_;
  std::vector<std::optional<std::array<double, 3>>> directions_;
  std::map<int64_t, std::string> segment_name_;
  std::map<int64_t, int64_t> segment_;
};

}  // namespace

Stored read_nrrd(const std::string &path, std::string_view bytes) { return Reader(path, bytes).read(); }

}  // namespace labels
