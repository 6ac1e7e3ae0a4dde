// A position in the bytes of a mesh file: reads words and numbers as text, or binary values, and names the
// position in every error. Nothing is copied and lines may have any length; numbers are read by from_chars,
// so the locale has no effect.
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

inline constexpr uint32_t kMaxPoints = UINT32_MAX - 1;

// Types of the numbers in arrays; in text all are words.
enum class Number : uint8_t { f32, f64, i8, u8, i16, u16, i32, u32, i64, u64, text, bit };
constexpr size_t bytes_of(Number type) {  // 0 for text and bit
  constexpr uint8_t kBytes[] = {4, 8, 1, 1, 2, 2, 4, 4, 8, 8, 0, 0};
  return kBytes[size_t(type)];
}
constexpr bool is_whole(Number type) { return type >= Number::i8 && type <= Number::u64; }
constexpr bool is_real(Number type) { return type <= Number::f64; }

class Cursor {
 public:
  Cursor(const std::string &path, const char *begin, size_t bytes)
      : path_(path), begin_(begin), p_(begin), end_(begin + bytes) {}

  bool binary = false;  // names places by byte instead of line
  bool swap = false;    // binary values have the other byte order
  char comment = 0;     // a word that starts with it begins a comment up to the end of the line
  // of line_word(), beside blanks
  char separator = ' ';

  const std::string &path() const { return path_; }
  size_t left() const { return size_t(end_ - p_); }
  size_t offset() const { return size_t(p_ - begin_); }
  void seek(size_t offset) { p_ = begin_ + offset; }
  // The same file from here on, ending after `bytes`: positions in errors remain those of the file.
  Cursor part(size_t bytes) const {
    Cursor out = *this;
    out.end_ = p_ + bytes;
    return out;
  }
  std::string_view rest() const { return {p_, left()}; }

  // Throws "FILE:12: " or "FILE, byte 345: " followed by the sentence; DFM_E_FORMAT.
  [[noreturn]] void refuse(const char *sentence, ...) const DEFORM_PRINTF(2, 3);
  // The same for valid content that is not supported; DFM_E_UNSUPPORTED.
  [[noreturn]] void unsupported(const char *sentence, ...) const DEFORM_PRINTF(2, 3);

  // ---- text ----
  void skip_space() {
    for (;;) {
      while (p_ < end_ && is_space(*p_)) ++p_;
      if (comment == 0 || p_ == end_ || *p_ != comment) return;
      while (p_ < end_ && *p_ != '\n') ++p_;
    }
  }
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
    refuse("expected %.*s after %s, found %s", int(wanted.size()), wanted.data(), after,
           quote(found).c_str());
  }
  int64_t integer(const char *what) { return to_integer(word(), what); }
  double real(const char *what) { return to_real(word(), what); }
  // A word of this file as a number.
  int64_t to_integer(std::string_view text, const char *what) {
    int64_t value = 0;
    if (parse(text, value) != std::errc()) refuse_word(text, what, "a whole number");
    return value;
  }
  double to_real(std::string_view text, const char *what) {
    double value = 0;
    const std::errc error = parse(text, value);
    if (error == std::errc::result_out_of_range && below_one(text)) return 0;
    if (error != std::errc() || !std::isfinite(value)) refuse_word(text, what, "a finite number");
    return value;
  }
  // The next word of this line; empty at its end, which stays unread. A backslash before a line end
  // continues the line.
  std::string_view line_word() {
    for (; p_ < end_ && *p_ != '\n'; ++p_) {
      if (is_space(*p_) || *p_ == separator) continue;
      if (continues()) {
        while (*p_ != '\n') ++p_;
        continue;
      }
      const char *from = p_;
      while (p_ < end_ && !is_space(*p_) && *p_ != separator && !continues()) ++p_;
      return {from, size_t(p_ - from)};
    }
    return {};
  }
  // Whether a word equals `lower`, ignoring case.
  static bool is_word(std::string_view word, std::string_view lower) {
    if (word.size() != lower.size()) return false;
    for (size_t i = 0; i < word.size(); ++i)
      if ((word[i] >= 'A' && word[i] <= 'Z' ? word[i] + ('a' - 'A') : word[i]) != lower[i]) return false;
    return true;
  }
  // Checks a count that the file announces: an error if the remaining bytes cannot hold so many numbers.
  uint64_t count(int64_t claimed, size_t least_bytes_each, const char *what) const {
    if (claimed < 0) refuse("promises %lld %s; a count cannot be negative", ll(claimed), what);
    if (static_cast<uint64_t>(claimed) > left() / least_bytes_each)
      refuse(
          "promises %lld %s, but the %zu bytes left in the file cannot hold them: the file is truncated or "
          "its count is wrong",
          ll(claimed), what, left());
    return static_cast<uint64_t>(claimed);
  }
  // The same in text, where no space need follow the last number.
  uint64_t text_count(int64_t claimed, size_t words_each, const char *what) const {
    if (claimed > 0 && uint64_t(claimed) <= (left() + 1) / (2 * words_each)) return uint64_t(claimed);
    return count(claimed, 2 * words_each, what);
  }
  // The number of a group.
  int32_t in_32_bits(int64_t value, const char *what) const {
    if (value < INT32_MIN || value > INT32_MAX) refuse("%s %lld does not fit 32 bits", what, ll(value));
    return static_cast<int32_t>(value);
  }
  // A promised number of what 32 bits can name.
  uint32_t small(uint64_t n, const char *what) const {
    if (n > kMaxPoints) unsupported("%llu %s; up to %u are read", ull(n), what, kMaxPoints);
    return static_cast<uint32_t>(n);
  }

  // ---- text or binary ----
  // The next number of an array; real() is finite.
  double real(Number type, const char *what);
  int64_t integer(Number type, const char *what);
  // As count(), of what takes so many numbers each.
  uint64_t count(int64_t claimed, size_t numbers_each, Number type, const char *what) const {
    return binary ? count(claimed, numbers_each * bytes_of(type), what)
                  : text_count(claimed, numbers_each, what);
  }
  // Binary data start right after the line end that closes the text before them.
  void begin_data(const char *after) {
    if (binary) end_line(after);
  }

  // ---- binary ----
  template <class T>
  T value(const char *what) {
    if (left() < sizeof(T)) refuse("the file ends inside %s", what);
    char raw[sizeof(T)];
    std::memcpy(raw, p_, sizeof(T));
    if (swap)
      for (size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(raw[i], raw[sizeof(T) - 1 - i]);
    p_ += sizeof(T);
    T out;
    std::memcpy(&out, raw, sizeof(T));
    return out;
  }
  template <class T = double>
  double binary_real(const char *what) {
    const T v = value<T>(what);
    if (!std::isfinite(v)) {
      p_ -= sizeof(T);
      refuse("%s is not a finite number", what);
    }
    return static_cast<double>(v);
  }
  void skip(size_t bytes, const char *what) {
    if (left() < bytes) refuse("the file ends inside %s", what);
    p_ += bytes;
  }
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

  // A word of the file for error messages: short and printable.
  static std::string quote(std::string_view text);

 private:
  static bool is_space(char c) {
    return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
  }
  // The whole word as a number, which may begin with a plus.
  template <class T>
  static std::errc parse(std::string_view text, T &value) {
    const char *from = text.data(), *const to = from + text.size();
    if (text.size() > 1 && *from == '+' && from[1] != '-') ++from;
    const auto [end, error] = std::from_chars(from, to, value);
    return end == to ? error : std::errc::invalid_argument;
  }
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
  bool continues() const {  // at a backslash just before the line's end
    return *p_ == '\\' && end_ - p_ > 1 &&
           (p_[1] == '\n' || (p_[1] == '\r' && end_ - p_ > 2 && p_[2] == '\n'));
  }
  [[noreturn]] void refuse_word(std::string_view text, const char *what, const char *kind) {
    if (!text.empty()) p_ = text.data();
    refuse("expected %s (%s), found %s", what, kind,
           text.empty() && left() ? "the end of the line" : quote(text).c_str());
  }
  [[noreturn]] void refuse_as(dfm_status status, const char *sentence, va_list args) const;
  std::string path_;
  const char *begin_, *p_, *end_;
};

}  // namespace dfm
