// A place in the bytes of a mesh file: words and numbers as text, or values as binary, with the place named in every refusal. Nothing is
// copied and no line is limited; numbers go through from_chars, so the locale has no say.
#pragma once
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "core/error.h"

namespace dfm {

// For sentences: printf has no name of its own for 64 bits.
inline long long ll(int64_t n) { return n; }
inline unsigned long long ull(uint64_t n) { return n; }

class Cursor {
 public:
  Cursor(const std::string &path, const char *begin, size_t bytes) : path_(path), begin_(begin), p_(begin), end_(begin + bytes) {}

  bool binary = false;  // names places by byte instead of line
  bool swap = false;    // binary values have the other byte order

  const std::string &path() const { return path_; }
  size_t left() const { return size_t(end_ - p_); }
  size_t offset() const { return size_t(p_ - begin_); }
  void seek(size_t offset) { p_ = begin_ + offset; }

  // Throws "FILE:12: " or "FILE, byte 345: " and then the sentence; DFM_E_FORMAT.
  [[noreturn]] void refuse(const char *sentence, ...) const __attribute__((format(printf, 2, 3)));
  // The same for content that is sound but not ours to read; DFM_E_UNSUPPORTED.
  [[noreturn]] void unsupported(const char *sentence, ...) const __attribute__((format(printf, 2, 3)));

  // ---- text ----
  void skip_space() { while (p_ < end_ && is_space(*p_)) ++p_; }
  std::string_view word() {  // empty at the end of the file
    skip_space();
    const char *from = p_;
    while (p_ < end_ && !is_space(*p_)) ++p_;
    return {from, size_t(p_ - from)};
  }
  std::string_view line() {  // the rest of this line without its end; moves past it
    const char *from = p_;
    while (p_ < end_ && *p_ != '\n') ++p_;
    std::string_view text(from, size_t(p_ - from));
    if (p_ < end_) ++p_;
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return text;
  }
  void expect(std::string_view wanted, const char *after) {
    const size_t at = next_offset();
    const std::string_view found = word();
    if (found == wanted) return;
    seek(at);
    refuse("expected %.*s after %s, found %s", int(wanted.size()), wanted.data(), after, quote(found).c_str());
  }
  int64_t integer(const char *what) {
    const size_t at = next_offset();
    const std::string_view text = word();
    int64_t value = 0;
    const char *from = text.data(), *to = from + text.size();
    if (text.size() > 1 && *from == '+' && from[1] != '-') ++from;
    const auto result = std::from_chars(from, to, value);
    if (text.empty() || result.ec != std::errc() || result.ptr != to) {
      seek(at);
      refuse("expected %s (a whole number), found %s", what, quote(text).c_str());
    }
    return value;
  }
  double real(const char *what) {
    const size_t at = next_offset();
    const std::string_view text = word();
    double value = 0;
    const char *from = text.data(), *to = from + text.size();
    if (text.size() > 1 && *from == '+' && from[1] != '-') ++from;
    const auto result = std::from_chars(from, to, value);
    const bool underflow = result.ec == std::errc::result_out_of_range && below_one(text);
    if (underflow) value = 0;
    if (text.empty() || result.ptr != to || (result.ec != std::errc() && !underflow) || !std::isfinite(value)) {
      seek(at);
      refuse("expected %s (a finite number), found %s", what, quote(text).c_str());
    }
    return value;
  }
  // Numbers that the file promises before it shows them: refused when the bytes left cannot hold them.
  uint64_t count(int64_t claimed, size_t least_bytes_each, const char *what) const {
    if (claimed < 0) refuse("promises %lld %s; a count cannot be negative", ll(claimed), what);
    if (static_cast<uint64_t>(claimed) > left() / least_bytes_each)
      refuse("promises %lld %s, but the %zu bytes left in the file cannot hold them: the file is truncated or its count is wrong",
             ll(claimed), what, left());
    return static_cast<uint64_t>(claimed);
  }

  // ---- binary ----
  template <class T>
  T value(const char *what) {
    if (left() < sizeof(T)) refuse("the file ends inside %s", what);
    char raw[sizeof(T)];
    std::memcpy(raw, p_, sizeof(T));
    if (swap) for (size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    p_ += sizeof(T);
    T out;
    std::memcpy(&out, raw, sizeof(T));
    return out;
  }
  double binary_real(const char *what) {
    const double v = value<double>(what);
    if (!std::isfinite(v)) p_ -= sizeof(double), refuse("%s is not a finite number", what);
    return v;
  }
  void skip(size_t bytes, const char *what) {
    if (left() < bytes) refuse("the file ends inside %s", what);
    p_ += bytes;
  }
  // Binary data start right after the line end that closes the text before them.
  void end_line(const char *after) {
    while (p_ < end_ && (*p_ == ' ' || *p_ == '\t' || *p_ == '\r')) ++p_;
    if (p_ == end_ || *p_ != '\n') refuse("expected a line end after %s", after);
    ++p_;
  }
  bool find(std::string_view text) {  // moves to the next occurrence
    const size_t at = std::string_view(p_, left()).find(text);
    if (at == std::string_view::npos) return false;
    p_ += at;
    return true;
  }

  // A word of the file as it may stand in a sentence: short and printable.
  static std::string quote(std::string_view text);

 private:
  static bool is_space(char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }
  // Whether an out-of-range decimal is too small rather than too large.
  static bool below_one(std::string_view text) {
    const size_t e = text.find_first_of("eE");
    if (e != std::string_view::npos) return e + 1 < text.size() && text[e + 1] == '-';
    const size_t digit = text.find_first_of("123456789"), point = text.find('.');
    return point != std::string_view::npos && digit != std::string_view::npos && digit > point;
  }
  size_t next_offset() {
    skip_space();
    return offset();
  }
  [[noreturn]] void refuse_as(dfm_status status, const char *sentence, va_list args) const;
  std::string path_;
  const char *begin_, *p_, *end_;
};

}  // namespace dfm
