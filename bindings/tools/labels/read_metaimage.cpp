// MetaImage: "Key = value" lines that end with ElementDataFile; LOCAL: the voxels follow (.mha), else they
// lie in that file (.mhd). Keys as the MetaIO documentation has them.
#include <algorithm>

#include "header_lines.h"

namespace labels {
namespace {

// MET_LONG has 4 bytes in a MetaImage.
const Type kTypes[] = {{"met_char", 1, true},         {"met_uchar", 1, false},
                       {"met_short", 2, true},        {"met_ushort", 2, false},
                       {"met_int,met_long", 4, true}, {"met_uint,met_ulong", 4, false},
                       {"met_long_long", 8, true},    {"met_ulong_long", 8, false}};

class Reader : private HeaderLines {
 public:
  Reader(const std::string &path, std::string_view bytes) : HeaderLines(path, bytes) {
    for (int k = 0; k < 3; ++k) direction_[4 * size_t(k)] = 1;
  }

  Stored read() {
    bool more = true;
    while (more) {
      if (at_ >= bytes_.size()) missing("ElementDataFile");
      more = line();
    }
    stored_.data_at = at_;
    finish();
    return std::move(stored_);
  }

 private:
  [[noreturn]] void missing(const char *what) const {
    refuse(path_, "the header has no \"%s\"; save the label map again as MetaImage", what);
  }

  bool line() {
    const std::string_view text = trimmed(next_line());
    if (text.empty()) return true;
    const size_t equals = text.find('=');
    if (equals == std::string_view::npos)
      refuse_line("expected \"Key = value\", found %s", quoted_part(text).c_str());
    const std::string_view key = trimmed(text.substr(0, equals)), value = trimmed(text.substr(equals + 1));
    if (key == "ElementDataFile") {
      if (lower(value) != "local") data_file(value);
      return false;
    }
    if (key == "NDims") dims(value);
    else if (key == "DimSize") sizes_ = numbers(value, 3, "DimSize");
    else if (key == "ElementSpacing") spacing_ = numbers(value, 3, "ElementSpacing");
    else if (key == "ElementSize" && spacing_.empty()) spacing_ = numbers(value, 3, "ElementSize");
    else if (key == "Offset" || key == "Position" || key == "Origin") origin_ = numbers(value, 3, "Offset");
    else if (key == "TransformMatrix" || key == "Rotation" || key == "Orientation")
      direction_ = numbers(value, 9, "TransformMatrix");
    else if (key == "ElementType") type(value, kTypes, "MET_CHAR to MET_ULONG_LONG");
    else if (key == "ElementNumberOfChannels") channels(value);
    else if (key == "BinaryData") binary_ = truth(value);
    else if (key == "BinaryDataByteOrderMSB" || key == "ElementByteOrderMSB")
      stored_.encoding.big_endian = truth(value);
    else if (key == "CompressedData") stored_.encoding.compressed = truth(value);
    else if (key == "HeaderSize") header_size(value);
    else if (key == "DistanceUnits") stored_.unit = unit(value);
    return true;
  }

  std::vector<double> numbers(std::string_view value, size_t n, const char *what) const {
    std::vector<double> out;
    for (const std::string_view word : words(value)) {
      out.push_back(0);
      if (!to_number(word, out.back()))
        refuse_line("expected %zu numbers as %s, found %s", n, what, quoted_part(word).c_str());
    }
    if (out.size() != n) refuse_line("%s has %zu numbers; a volume of 3 axes has %zu", what, out.size(), n);
    return out;
  }

  bool truth(std::string_view value) const {
    const std::string word = lower(value);
    if (word == "true" || word == "1") return true;
    if (word == "false" || word == "0") return false;
    refuse_line("expected True or False, found %s", quoted_part(value).c_str());
  }

  void dims(std::string_view value) const {
    int64_t n = 0;
    if (!to_number(value, n) || n != 3)
      refuse_line("NDims is %s; a label map has 3 axes", quoted_part(value).c_str());
  }
  void channels(std::string_view value) const {
    int64_t n = 0;
    if (!to_number(value, n) || n != 1)
      refuse_line("a voxel has %s values; a label map has one per voxel", quoted_part(value).c_str());
  }
  void header_size(std::string_view value) {
    if (!to_number(value, stored_.skip) || stored_.skip < -1)
      refuse_line("expected how many bytes precede the voxels, or -1, as HeaderSize, found %s",
                  quoted_part(value).c_str());
  }

  void finish() {
    if (stored_.encoding.bytes == 0) missing("ElementType");
    if (sizes_.empty()) missing("DimSize");
    if (!binary_)
      refuse(path_,
             "BinaryData is False or missing, so the voxels are text, which is not read; write BinaryData "
             "= True into the header if they are binary, else save the file anew");
    if (stored_.file.empty()) stored_.skip = 0;  // the voxels of a .mha follow the header
    for (size_t k = 0; k < 3; ++k) {
      const double n = sizes_[k];
      if (!(n >= 1 && n <= 65535 && n == double(uint32_t(n))))
        refuse(path_, "axis %zu has %g voxels; from 1 to 65,535 are read", k, n);
      stored_.volume.size[k] = uint32_t(n);
      if (!origin_.empty()) stored_.volume.origin[k] = origin_[k];
      for (size_t c = 0; c < 3; ++c)
        stored_.volume.axis[k][c] = direction_[3 * k + c] * (spacing_.empty() ? 1 : spacing_[k]);
    }
    if (spacing_.empty())
      stored_.volume.notes.push_back("the file gives no spacing; 1 was taken for each axis");
  }

  std::vector<double> sizes_, spacing_, origin_, direction_ = std::vector<double>(9, 0.0);
  bool binary_ = false;  // without the key the voxels are text
};

}  // namespace

Stored read_metaimage(const std::string &path, std::string_view bytes) { return Reader(path, bytes).read(); }

}  // namespace labels
