// Lines of a text header, one after the other, and sentences about the one that was taken last.
#pragma once
#include <algorithm>

#include "label_volume.h"

namespace labels {

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

  const std::string &path_;
  std::string_view bytes_;
  size_t at_ = 0, number_ = 0;  // byte after the last line, its number from 1
};

}  // namespace labels
