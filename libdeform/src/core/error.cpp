#include "core/error.h"

#include <algorithm>
#include <cstdio>
#include <cstring>

namespace dfm {
namespace {

thread_local char last_sentence[1024];
thread_local uint64_t said = 0;

std::string vformat(const char *format, va_list args) {
  char text[1024];
  std::vsnprintf(text, sizeof text, format, args);
  return text;
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

void fail(dfm_status status, const char *format, ...) {
  va_list args;
  va_start(args, format);
  std::string text = vformat(format, args);
  va_end(args);
  throw Error(status, std::move(text));
}

std::string format(const char *format, ...) {
  va_list args;
  va_start(args, format);
  std::string text = vformat(format, args);
  va_end(args);
  return text;
}

void set_last_error(const char *sentence) noexcept {
  std::strncpy(last_sentence, sentence, sizeof last_sentence - 1);
  last_sentence[sizeof last_sentence - 1] = 0;
  ++said;
}

const char *last_error() noexcept { return last_sentence; }
uint64_t sentences() noexcept { return said; }

std::string nearest(const std::string &wrong, const std::vector<std::string> &valid) {
  std::string best;
  size_t best_distance = std::max<size_t>(2, wrong.size() / 2) + 1;
  for (const auto &name : valid) {
    const size_t d = edit_distance(wrong, name);
    if (d < best_distance) best_distance = d, best = name;
  }
  return best;
}

std::string join(const std::vector<std::string> &names, const char *separator) {
  std::string text;
  for (const auto &name : names) text += (text.empty() ? "" : separator) + name;
  return text;
}

}  // namespace dfm
