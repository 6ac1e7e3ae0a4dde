#include "mesh/cursor.h"

#include <algorithm>
#include <cstdio>

namespace dfm {

void Cursor::refuse_as(dfm_status status, const char *sentence, va_list args) const {
  char text[768];
  std::vsnprintf(text, sizeof text, sentence, args);
  if (binary) fail(status, "%s, byte %zu: %s", path_.c_str(), offset(), text);
  fail(status, "%s:%zu: %s", path_.c_str(), 1 + size_t(std::count(begin_, p_, '\n')), text);
}

void Cursor::refuse(const char *sentence, ...) const {
  va_list args;
  va_start(args, sentence);
  refuse_as(DFM_E_FORMAT, sentence, args);  // throws: no va_end is reached, which every ABI of ours allows
}

void Cursor::unsupported(const char *sentence, ...) const {
  va_list args;
  va_start(args, sentence);
  refuse_as(DFM_E_UNSUPPORTED, sentence, args);
}

std::string Cursor::quote(std::string_view text) {
  if (text.empty()) return "the end of the file";
  std::string out = "'";
  for (const char c : text.substr(0, 40)) out += c >= 32 && c < 127 ? c : '?';
  return out + (text.size() > 40 ? "...'" : "'");
}

}  // namespace dfm
