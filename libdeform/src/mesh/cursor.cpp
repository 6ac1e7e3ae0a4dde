#include "mesh/cursor.h"

#include <algorithm>

namespace dfm {

void Cursor::refuse_as(dfm_status status, const char *sentence, va_list args) const {
  const std::string text = vformat(sentence, args);
  if (binary) fail(status, "%s, byte %zu: %s", path_.c_str(), offset(), text.c_str());
  fail(status, "%s:%zu: %s", path_.c_str(), 1 + size_t(std::count(begin_, p_, '\n')), text.c_str());
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

double Cursor::real(Number type, const char *what) {
  if (!binary) return real(what);
  if (type == Number::f64) return binary_real(what);
  if (type == Number::f32) return binary_real<float>(what);
  return static_cast<double>(integer(type, what));
}

int64_t Cursor::integer(Number type, const char *what) {
  if (!binary) return integer(what);
  switch (type) {
    case Number::i8: return value<int8_t>(what);
    case Number::u8: return value<uint8_t>(what);
    case Number::i16: return value<int16_t>(what);
    case Number::u16: return value<uint16_t>(what);
    case Number::i32: return value<int32_t>(what);
    case Number::u32: return value<uint32_t>(what);
    case Number::i64: return value<int64_t>(what);
    // above 2^63 reads as negative and is refused by range
    case Number::u64: return static_cast<int64_t>(value<uint64_t>(what));
    default: refuse("%s must be whole numbers", what);
  }
}

std::string Cursor::quote(std::string_view text) {
  if (text.empty()) return "the end of the file";
  std::string out = "'";
  for (const char c : text.substr(0, 40)) out += c >= 32 && c < 127 ? c : '?';
  return out + (text.size() > 40 ? "...'" : "'");
}

}  // namespace dfm
