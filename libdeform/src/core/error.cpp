#include "core/error.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

#include "core/system.h"

namespace dfm {
namespace {

thread_local char last_sentence[1024];
thread_local uint64_t said = 0;

// Appends bytes as long as they and the terminating zero fit.
class Line {
 public:
  Line(char *out, size_t capacity) : out_(out), left_(capacity - 1) {}
  ~Line() { *out_ = 0; }
  void add(const char *bytes, size_t n) {
    if (n > left_) {
      left_ = 0;
    } else {
      std::memcpy(out_, bytes, n);
      out_ += n;
      left_ -= n;
    }
  }

 private:
  char *out_;
  size_t left_;
};

// Number of bytes of the UTF-8 character at `s`; 0 if it is not valid.
size_t character(const unsigned char *s) {
  const size_t n = s[0] < 0x80                   ? 1
                   : s[0] >= 0xc2 && s[0] < 0xe0 ? 2
                   : (s[0] & 0xf0) == 0xe0       ? 3
                   : s[0] >= 0xf0 && s[0] < 0xf5 ? 4
                                                 : 0;
  for (size_t i = 1; i < n; ++i)
    if ((s[i] & 0xc0) != 0x80) return 0;  // also ends at the terminating zero
  // longer than it need be, half of a pair of UTF-16, beyond U+10FFFF
  const unsigned first = n > 1 ? unsigned{s[0]} << 8 | s[1] : 0;
  const bool invalid = (first >= 0xe000 && first < 0xe0a0) || (first >= 0xeda0 && first < 0xee00) ||
                       (first >= 0xf000 && first < 0xf090) || first >= 0xf490;
  return invalid ? 0 : n;
}

size_t edit_distance(const std::string &a, const std::string &b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

std::string vformat(const char *format, va_list args) {
  char text[1024];
  os::print(text, sizeof text, format, args);
  return text;
}

void fail(dfm_status status, const char *format, ...) {
  va_list args;
  va_start(args, format);
  std::string text = vformat(format, args);
  va_end(args);
  throw Error(status, std::move(text));
}

namespace {

[[noreturn]] void refuse(const Named &whose, dfm_status status, const std::string &text) {
  fail(status, "%s '%s'%s", whose.kind, whose.name, text.c_str());
}

}  // namespace

void refuse(const Named &whose, const char *sentence, ...) {
  va_list args;
  va_start(args, sentence);
  const std::string text = vformat(sentence, args);
  va_end(args);
  refuse(whose, DFM_E_ARG, text);
}

void refuse(const Named &whose, dfm_status status, const char *sentence, ...) {
  va_list args;
  va_start(args, sentence);
  const std::string text = vformat(sentence, args);
  va_end(args);
  refuse(whose, status, text);
}

std::string format(const char *format, ...) {
  va_list args;
  va_start(args, format);
  std::string text = vformat(format, args);
  va_end(args);
  return text;
}

void printable(const char *text, char *out, size_t capacity) noexcept {
  Line line(out, capacity);
  for (const unsigned char *s = reinterpret_cast<const unsigned char *>(text); *s;) {
    const size_t n = character(s);
    const unsigned code = n == 2 ? (s[0] & 0x1fu) << 6 | (s[1] & 0x3fu) : s[0];
    char escape[8];
    if (n == 0) line.add("?", 1);
    else if (n <= 2 && (code < 0x20 || (code >= 0x7f && code < 0xa0)))
      line.add(escape, size_t(std::snprintf(escape, sizeof escape, "\\u%04x", code)));
    else line.add(text + (reinterpret_cast<const char *>(s) - text), n);
    s += std::max<size_t>(n, 1);
  }
}

void set_last_error(const char *sentence) noexcept {
  char text[sizeof last_sentence];
  printable(sentence, text, sizeof text);  // copied first: the sentence may be part of the previous one
  std::memcpy(last_sentence, text, sizeof text);
  ++said;
}

const char *last_error() noexcept { return last_sentence; }
uint64_t sentences() noexcept { return said; }

std::string nearest(const std::string &wrong, const std::vector<std::string> &valid) {
  // A part of a name, such as "fem", is nearer to that name than to a short one with few letters in common.
  const auto part_of = [&](const std::string &name) {
    return wrong.size() > 2 && name.find(wrong) != std::string::npos;
  };
  const bool parts = std::ranges::any_of(valid, part_of);
  std::string best;
  size_t best_distance = parts ? SIZE_MAX : std::max<size_t>(2, wrong.size() / 2) + 1;
  for (const auto &name : valid) {
    if (parts && !part_of(name)) continue;
    const size_t d = edit_distance(wrong, name);
    if (d < best_distance) {
      best_distance = d;
      best = name;
    }
  }
  return best;
}

std::string join(const std::vector<std::string> &names, const char *separator) {
  std::string text;
  for (const auto &name : names) text += (text.empty() ? "" : separator) + name;
  return text;
}

}  // namespace dfm
