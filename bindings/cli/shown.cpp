#include "shown.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstring>

namespace cli {

std::string shown(const std::string &text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    const unsigned char c = static_cast<unsigned char>(text[i]);
    const unsigned char next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    // the control characters of ISO 6429 in UTF-8
    const bool second = c == 0xc2 && next >= 0x80 && next < 0xa0;
    char escape[8];
    std::snprintf(escape, sizeof escape, "\\u%04x", second ? next : c);
    if (c < 0x20 || c == 0x7f || second) out += escape;
    else out += text[i];
    i += second;
  }
  return out;
}

std::string shown_word(const std::string &text) {
  const bool plain = !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return std::isalnum(c) || c >= 0x80 || std::strchr("_-+./:,@%=", c);
  });
  if (plain) return shown(text);
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return shown(out + "'");
}

}  // namespace cli
