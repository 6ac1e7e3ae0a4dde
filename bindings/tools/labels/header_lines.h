// Lines of a text header, one after the other, and sentences about the one that was taken last.
#pragma once
#include <algorithm>
#include <span>

#include "label_volume.h"

namespace labels {

struct Type {
  const char *names;  // in lower case, separated by commas
  uint32_t bytes;
  bool is_signed;
};

inline bool is_one_of(const std::string &word, std::string_view names) {
  while (!names.empty()) {
    const size_t comma = std::min(names.find(','), names.size());
    if (names.substr(0, comma) == word) return true;
    names.remove_prefix(std::min(comma + 1, names.size()));
  }
  return false;
}

class HeaderLines {
 protected:
  HeaderLines(const std::string &path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  // Without its end, which may be that of Windows.
  std::string_view next_line() {
    const size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    std::string_view text = bytes_.substr(at_, end - at_);
    at_ = std::min(end + 1, bytes_.size());
    ++number_;
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return text;
  }

  template <class... T>
  [[noreturn]] void refuse_line(const char *sentence, T... values) const {
    const std::string where = path_ + ":" + std::to_string(number_);
    if constexpr (sizeof...(values) == 0) refuse(where, "%s", sentence);
    else refuse(where, sentence, values...);
  }

  // What the values of fields are in both formats.
  void type(std::string_view value, std::span<const Type> known, const char *range) {
    const std::string word = lower(value);
    for (const Type &t : known)
      if (is_one_of(word, t.names)) {
        stored_.encoding.bytes = t.bytes;
        stored_.encoding.is_signed = t.is_signed;
        return;
      }
    refuse_line(
        "the voxels are of the type %s, and labels are whole numbers; save the label map with a type from %s",
        quoted_part(value).c_str(), range);
  }
  double unit(std::string_view word) const {
    const double meters = unit_of(word);
    if (meters == 0)
      refuse_line("unknown unit of length %s; known are um, mm, cm, dm, m and inch; give it by --unit",
                  quoted_part(word).c_str());
    return meters;
  }
  void data_file(std::string_view name) {
    if (name.empty()) refuse_line("expected the name of a file with the voxels");
    if (name.substr(0, 4) == "LIST" || name.find('%') != std::string_view::npos)
      refuse_line(
          "the data are a list or a pattern of files, which is not read; save all slices in one file");
    stored_.file = name;
  }

  Stored stored_;
  const std::string &path_;
  std::string_view bytes_;
  size_t at_ = 0, number_ = 0;  // byte after the last line, its number from 1
};

}  // namespace labels
